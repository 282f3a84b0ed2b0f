"""Electric heaters in zones, such as baseboards, all of a building at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from thermal._types import FloatArray
from thermal.components.component import Conditions, Given, Group, IndexArray, Port, Range
from thermal.components.energy_balance import EnergyBalance
from thermal.components.operations import Operations, Value


class HeaterStep(NamedTuple):
    """What electric heaters did in a step; one value a heater.

    Parameters
    ----------
    heat : Value
        Into the zone, air and surfaces together [W].
    radiant_heat : Value
        The part of it that falls on the surfaces [W].
    electric_power : Value
        [W].
    """

    heat: Value
    radiant_heat: Value
    electric_power: Value


@dataclass(frozen=True, eq=False)
class ElectricHeaters(Group):
    """Electric heaters, such as baseboards, on for the share of time that the thermostat calls for heating.

    Parameters
    ----------
    capacity : float or numpy.ndarray, shape (n_heater,)
        Heat of each [W], positive.
    zone : numpy.ndarray of int, shape (n_heater,)
        Position of the zone that each stands in.
    radiant_share : float
        Share of the heat that falls on the surfaces of the zone [-]. The default is EnergyPlus' for
        ZoneHVAC:Baseboard:RadiantConvective:Electric.
    """

    label, device = "electric heater", "electric_heater"
    ports = (
        Port("heat", "heat", "W", "each"), Port("radiant_heat", "heat", "W", "each"),
        Port("electric_power", "electricity", "W", "each"),
    )  # fmt: skip
    sensors = ("heating_power_sensor", "electrical_power_sensor")

    capacity: Annotated[FloatArray, Range("W", 1e-3, 1e7)]
    zone: IndexArray
    radiant_share: Annotated[float, Range("-", 0.0, 1.0)] = 0.3

    @classmethod
    def sized(cls, heat: ArrayLike, zone: IndexArray) -> ElectricHeaters:
        """Size heaters for the heat that they are to bring.

        Parameters
        ----------
        heat : array_like, shape (n_heater,)
            Heat [W]; a heater for nothing gets a watt.
        zone : numpy.ndarray of int, shape (n_heater,)
            Positions of the zones.
        """
        return cls(np.maximum(np.asarray(heat, dtype=float), 1.0), zone)

    def likely_heat(self, call: float, zone: FloatArray) -> FloatArray:
        """Heat at a call [W].

        Parameters
        ----------
        call : float
            For heating; negative for cooling [-].
        zone : numpy.ndarray, shape (n_heater,)
            Temperatures of their zones [K].
        """
        return max(call, 0.0) * self.capacity

    def run(self, ops: Operations, given: Given) -> HeaterStep:
        """Heat as the thermostats call for it.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            Calls of the thermostats.
        """
        heat = self.capacity * self.of_zones(ops, given.calls.heating)
        return HeaterStep(heat, self.radiant_share * heat, 1.0 * heat)

    def energy(self, conditions: Conditions, done: HeaterStep) -> EnergyBalance:
        """Where the energy of a step went: into the zones.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        done : HeaterStep
            What `run` returned.
        """
        return EnergyBalance(electricity=done.electric_power.sum(axis=-1), zones=done.heat.sum(axis=-1))

    def read(self, ops: Operations, given: Given, done: HeaterStep) -> list[Value]:
        """Values of their points, one a heater each.

        Parameters
        ----------
        ops : Operations
            Arithmetic.
        given : Given
            As `run` had it.
        done : HeaterStep
            What `run` returned.
        """
        return [done.heat, done.electric_power]
