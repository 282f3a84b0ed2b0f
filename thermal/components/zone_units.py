"""What units with a fan in the zone that they heat and cool share: on water, or on direct expansion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from thermal._types import FloatArray
from thermal.components.component import Conditions, Given, Group, IndexArray, Range
from thermal.components.energy_balance import EnergyBalance
from thermal.components.moist_air import (
    enthalpy,
    saturated_temperature,
    saturation_humidity,
)
from thermal.components.operations import Operations, Value
from thermal.units import AIR_HEAT_CAPACITY

_WARM, _COLD = 15.0, 11.0  # K: of the air over and under the zone at design, for the flow
_FAN = 400.0  # W per kg/s of air: 0.3 W/(l/s), usual for fan coils (ASHRAE 90.1-2019, 6.5.3.1.3)


class UnitStep(NamedTuple):
    """What units in zones did in a step; one value a unit.

    Parameters
    ----------
    heat : Value
        Into the zone, sensible, with the fan's; negative where it cools [W].
    heating, cooling, moisture : Value
        Of the coils: heat, sensible cooling, and the latent one that dries the air [W].
    fan_power : Value
        [W].
    electric_power : Value
        All of it [W].
    """

    heat: Value
    heating: Value
    cooling: Value
    moisture: Value
    fan_power: Value
    electric_power: Value


@dataclass(frozen=True, eq=False)
class ZoneUnits(Group):
    """Units whose fan and coils are on for the share of time that the thermostat calls; the base of both kinds.

    Parameters
    ----------
    heating, cooling : float or numpy.ndarray, shape (n_unit,)
        Rated heat and total cooling of the coils [W], positive.
    zone : numpy.ndarray of int, shape (n_unit,)
        Position of the zone that each is in.
    air_flow : float or numpy.ndarray, shape (n_unit,)
        Of the fan while it runs [kg/s], positive.
    fan_power : float or numpy.ndarray, shape (n_unit,)
        While it runs; all of it warms the air [W].
    bypass : float
        Share of the air that does not touch the cooling coil [-]. The default is usual for three to four rows.
    pressure : float
        Of the air [Pa].
    """

    heating: Annotated[FloatArray, Range("W", 1e-3, 1e7)]
    cooling: Annotated[FloatArray, Range("W", 1e-3, 1e7)]
    zone: IndexArray
    air_flow: Annotated[FloatArray, Range("kg/s", 1e-6, 1e4)]
    fan_power: Annotated[FloatArray, Range("W", 0.0, 1e6)]
    bypass: Annotated[float, Range("-", 0.0, 0.5)] = 0.1
    pressure: Annotated[float, Range("Pa", 5e4, 1.1e5)] = 101_325.0

    sensors = ("heating_power_sensor", "electrical_power_sensor")

    @staticmethod
    def by_loads(heat: ArrayLike, cooling: ArrayLike | None) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Size coils and fan for loads: heating and cooling [W], air [kg/s], and the fan's power [W].

        Parameters
        ----------
        heat : array_like, shape (n_unit,)
            Heat that they are to bring [W].
        cooling : array_like, shape (n_unit,), optional
            Sensible cooling [W]; as much as the heat by default.
        """
        warm = np.maximum(np.asarray(heat, dtype=float), 100.0)
        cold = warm if cooling is None else np.maximum(np.asarray(cooling, dtype=float), 100.0)
        flow = np.maximum(warm / _WARM, cold / _COLD) / AIR_HEAT_CAPACITY
        return warm, 1.25 * cold, flow, _FAN * flow

    def likely_heat(self, call: float, zone: FloatArray) -> FloatArray:
        """Heat at a call and rated capacity [W].

        Parameters
        ----------
        call : float
            For heating; negative for cooling [-].
        zone : numpy.ndarray, shape (n_unit,)
            Temperatures of their zones [K].
        """
        fan = abs(call) * self.fan_power
        return fan + (call * self.heating if call > 0.0 else 0.8 * call * self.cooling)

    def humidity(self, conditions: Conditions) -> Value:
        """Humidity ratio of the zones' air [kg/kg]: the return air's, of several air handlers their mean.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        """
        given = conditions.return_humidity
        return sum(given) / len(given) if isinstance(given, tuple | list) else given

    def sensible_share(self, ops: Operations, total: Value, temperature: Value, humidity: Value) -> Value:
        """Share of a coil's cooling that is sensible, by the apparatus dew point [-].

        ``h_s(T_adp) = h_in - Q / (m (1 - b))``; ``(h(T_in, w_adp) - h_adp) / (h_in - h_adp)``, 1 where that is dry
        (EnergyPlus Engineering Reference 26.1, DX cooling coil).

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        total : Value
            Cooling while it runs [W].
        temperature, humidity : Value
            Of the air that enters [K], [kg/kg].
        """
        drop = ops.maximum(total / (self.air_flow * (1.0 - self.bypass)), 10.0, 100.0)
        inside = enthalpy(temperature, humidity)
        surface = saturated_temperature(ops, inside - drop, self.pressure)
        dew = saturation_humidity(ops, surface, self.pressure)
        latent = ops.positive(humidity - dew, 1e-3) * (2.501e6 + 1860.0 * (temperature - 273.15))
        return 1.0 - ops.clip(latent / drop, 0.0, 0.95)

    def energy(self, conditions: Conditions, done: UnitStep) -> EnergyBalance:
        """Where the energy of a step went.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : UnitStep
            What `run` returned.
        """
        used, drying = done.electric_power.sum(axis=-1), done.moisture.sum(axis=-1)
        return EnergyBalance(electricity=used, zones=done.heat.sum(axis=-1), moisture=-drying)

    def read(self, ops: Operations, given: Given, done: UnitStep) -> list[Value]:
        """Values of their points, one a unit each.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : UnitStep
            What `run` returned.
        """
        return [done.heat, done.electric_power]
