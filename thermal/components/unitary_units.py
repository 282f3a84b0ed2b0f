"""Packaged units of direct expansion in zones: heat pumps and air conditioners, all of a building at once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from thermal._types import FloatArray
from thermal.components.component import Conditions, Given, IndexArray, Port, Range
from thermal.components.curves import DX_CAPACITY, DX_HEATING_CAPACITY, DX_HEATING_INPUT, DX_INPUT
from thermal.components.energy_balance import EnergyBalance
from thermal.components.machine_map import Defrost, MachineMap
from thermal.components.moist_air import wet_bulb
from thermal.components.operations import Operations
from thermal.components.zone_units import UnitStep, ZoneUnits

#: Direct expansion that heats from air outdoors: EnergyPlus' defrosting on demand, part load with AHRI's loss.
DX_HEATING = MachineMap(3.36, DX_HEATING_CAPACITY, DX_HEATING_INPUT, cycling_loss=0.15, defrost=Defrost())
#: Direct expansion that cools: the 10-ton coil of the Medium Office, part load with the Small Office's loss.
DX_COOLING = MachineMap(4.1, DX_CAPACITY, DX_INPUT, cycling_loss=0.15)


@dataclass(frozen=True, eq=False)
class UnitaryUnits(ZoneUnits):
    """Packaged units of direct expansion: heat pumps, or air conditioners with electric heating, each in its zone.

    Parameters
    ----------
    heating, cooling : float or numpy.ndarray, shape (n_unit,)
        Rated heat and total cooling of the coils, at the conditions of the maps [W].
    zone : numpy.ndarray of int, shape (n_unit,)
        Position of the zone that each is in.
    air_flow, fan_power, bypass, pressure
        As in `ZoneUnits` [kg/s], [W], [-], [Pa].
    heating_map : MachineMap, optional
        Of the heat pump; x is the zone, y outdoors. None: it does not heat by the compressor.
    cooling_map : MachineMap
        x is the wet bulb of the air that enters, y outdoors.
    supplement : float or numpy.ndarray, shape (n_unit,)
        Electric resistance for what the heat pump cannot bring [W].

    Notes
    -----
    A call is a share of what the unit can bring at the time, compressor first. The fan runs while the compressor does.
    """

    label, device = "unitary heat pump", "unitary_heat_pump"
    ports = (Port("heat", "heat", "W", "each"), Port("electric_power", "electricity", "W", "each"))

    heating_map: MachineMap | None = DX_HEATING
    cooling_map: MachineMap = DX_COOLING
    supplement: Annotated[FloatArray, Range("W", 0.0, 1e7)] = field(default_factory=lambda: np.zeros(()))

    @classmethod
    def sized(cls, heat: ArrayLike, zone: IndexArray, cooling: ArrayLike | None = None) -> UnitaryUnits:
        """Size units for loads: a resistance brings half of the heat too.

        Parameters
        ----------
        heat, cooling : array_like, shape (n_unit,)
            Heat and sensible cooling that they are to bring [W].
        zone : numpy.ndarray of int, shape (n_unit,)
            Positions of the zones.
        """
        warm, cold, flow, fan = cls.by_loads(heat, cooling)
        return cls(warm, cold, zone, flow, fan, supplement=0.5 * warm)

    def run(self, ops: Operations, given: Given) -> UnitStep:
        """Run compressor, resistance and fan for the calls.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Calls of the thermostats, temperatures of the zones, outdoors, and humidities.
        """
        conditions = given.conditions
        zone, outdoor = self.of_zones(ops, conditions.zone_temperature), conditions.outdoor_temperature
        warm, cold = self.of_zones(ops, given.calls.heating), self.of_zones(ops, given.calls.cooling)
        humidity = self.humidity(conditions)
        wet = wet_bulb(ops, zone, humidity + 0.0 * zone, self.pressure)
        cooler = self.cooling_map
        most = cooler.available(ops, self.cooling, wet, outdoor, cooler.frosted(ops, outdoor, 0.0))
        chilled = cooler.run_at(ops, cold * most, self.cooling, wet, outdoor)
        share = self.sensible_share(ops, most, zone, humidity)
        heat, power, time = warm * self.supplement, warm * self.supplement, warm * 1.0
        if (machine := self.heating_map) is not None:
            damp = conditions.outdoor_humidity
            frost = machine.frosted(ops, outdoor, damp)
            able = machine.available(ops, self.heating, zone, outdoor, frost)
            wanted = warm * (able + self.supplement)
            done = machine.run_at(ops, wanted, self.heating, zone, outdoor, damp)
            heat, power, time = wanted, done.power + wanted - done.output, done.duty
        fan = self.fan_power * ops.clip(time + chilled.duty, 0.0, 1.0)
        cooling = chilled.output * share
        return UnitStep(
            heat - cooling + fan, heat, cooling, chilled.output - cooling, fan, power + chilled.power + fan
        )  # fmt: skip

    def energy(self, conditions: Conditions, done: UnitStep) -> EnergyBalance:
        """Where the energy of a step went: what compressors move leaves outdoors, or comes from there.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : UnitStep
            What `run` returned.
        """
        moved = done.electric_power - done.fan_power + done.cooling + done.moisture - done.heating
        return super().energy(conditions, done)._replace(condenser=moved.sum(axis=-1))
