"""Ventilation of zones with heat recovery, each zone with its own unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from thermal._types import FloatArray
from thermal.components.component import Conditions, Given, Group, IndexArray, Port, Range
from thermal.components.energy_balance import EnergyBalance
from thermal.components.operations import Operations, Value
from thermal.units import AIR_HEAT_CAPACITY

_SMALL = 0.1  # K
_SHARE = 0.25  # of a zone's heat loss that its ventilation is sized for, without recovery
_LIFT = 20.0  # K, of design


class VentilatorStep(NamedTuple):
    """What ventilators did in a step; one value a unit.

    Parameters
    ----------
    heat : Value
        Into the zone, negative where it cools, with the supply fan's [W].
    recovered : Value
        Heat from exhaust to supply [W].
    exhaust_temperature : Value
        Of the air that leaves the exchanger to outdoors [K].
    electric_power : Value
        Of both fans [W].
    """

    heat: Value
    recovered: Value
    exhaust_temperature: Value
    electric_power: Value


@dataclass(frozen=True, eq=False)
class Ventilators(Group):
    """Balanced ventilation with an exchanger between exhaust and supply; it always runs.

    Parameters
    ----------
    air_flow : float or numpy.ndarray, shape (n_unit,)
        Supply and exhaust [kg/s], positive.
    zone : numpy.ndarray of int, shape (n_unit,)
        Position of the zone that each ventilates.
    fan_power : float or numpy.ndarray, shape (n_unit,)
        Of both fans together [W]; the supply's half warms the supply air.
    effectiveness : float
        Sensible [-]; the default is usual for plates in counter flow (EN 13141-7 tests: 0.75 to 0.9).
    least_exhaust : float
        Temperature below which the exhaust is not let fall, lest it freezes [K]; EnergyPlus' default of 1.7 degC.

    Notes
    -----
    ``T_supply = T_out + eps (T_zone - T_out)``, with ``eps <= (T_zone - T_least) / (T_zone - T_out)`` against frost,
    and without exchanger as far as the zone calls for cooling while it is cooler outdoors.
    """

    label, device = "ventilator", "heat_recovery_ventilator"
    ports = (Port("heat", "heat", "W", "each"), Port("electric_power", "electricity", "W", "each"))
    sensors = ("heating_power_sensor", "electrical_power_sensor")

    air_flow: Annotated[FloatArray, Range("kg/s", 1e-6, 1e4)]
    zone: IndexArray
    fan_power: Annotated[FloatArray, Range("W", 0.0, 1e6)]
    effectiveness: Annotated[float, Range("-", 0.0, 0.98)] = 0.8
    least_exhaust: Annotated[float, Range("K", 253.15, 288.15)] = 274.85

    @classmethod
    def sized(cls, heat: ArrayLike, zone: IndexArray) -> Ventilators:
        """Size ventilators by the heat that their zones lose.

        Parameters
        ----------
        heat : array_like, shape (n_unit,)
            Heat [W]; a quarter of it is taken for that of ventilation at 20 K without recovery.
        zone : numpy.ndarray of int, shape (n_unit,)
            Positions of the zones.
        """
        flow = np.maximum(_SHARE * np.asarray(heat, dtype=float) / (_LIFT * AIR_HEAT_CAPACITY), 1e-4)
        return cls(flow, zone, 1000.0 * flow)  # W: 0.45 W/(m3/h), the Passivhaus limit, is 1350 W per kg/s

    def run(self, ops: Operations, given: Given) -> VentilatorStep:
        """Bring air from outdoors into the zones.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Temperatures of zones and outdoors, and calls for cooling.
        """
        zone, outdoor = self.of_zones(ops, given.conditions.zone_temperature), given.conditions.outdoor_temperature
        cold = self.of_zones(ops, given.calls.cooling)
        lift = zone - outdoor
        most = ops.positive(zone - self.least_exhaust) / ops.maximum(lift, _SMALL, _SMALL)
        share = ops.minimum(self.effectiveness, most, 0.1) * (1.0 - cold * ops.step(lift))
        rate = AIR_HEAT_CAPACITY * self.air_flow
        recovered = rate * share * lift
        heat = recovered - rate * lift + 0.5 * self.fan_power
        return VentilatorStep(heat, recovered, zone - share * lift, self.fan_power + 0.0 * zone)

    def energy(self, conditions: Conditions, done: VentilatorStep) -> EnergyBalance:
        """Where the energy of a step went: what the exhaust carries out beyond outdoor air, with its fan's heat.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : VentilatorStep
            What `run` returned.
        """
        above = done.exhaust_temperature - conditions.outdoor_temperature
        exhaust = AIR_HEAT_CAPACITY * self.air_flow * above + 0.5 * done.electric_power
        used, zones = done.electric_power.sum(axis=-1), done.heat.sum(axis=-1)
        return EnergyBalance(electricity=used, zones=zones, exhaust=exhaust.sum(axis=-1))

    def read(self, ops: Operations, given: Given, done: VentilatorStep) -> list[Value]:
        """Values of their points, one a unit each.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : VentilatorStep
            What `run` returned.
        """
        return [done.heat, done.electric_power]
