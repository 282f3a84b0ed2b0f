"""Supply setpoints as a plant takes them; laid out anew only when they change."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from mpc.loop.actuators import DIFFERENTIAL_PRESSURE, STATIC_PRESSURE, SUPPLY_AIR, SUPPLY_WATER
from mpc.loop.sensors import PlantDevices
from thermal.hvac._step import Actions
from thermal.hvac._system import HvacSystem

#: Setpoints of supply air, supply water, static pressures and differential pressure [K, Pa].
_Supply = tuple[tuple[float, ...], float, tuple[float, ...], float | None]


class SupplySetpoints:
    """Makes actions of a plant from what a controller gave and what its schedules say.

    Parameters
    ----------
    devices : PlantDevices
        Names of air handlers and boiler.
    system : HvacSystem
        With the static pressures that hold where none are given.
    """

    def __init__(self, devices: PlantDevices, system: HvacSystem) -> None:
        self._devices, self._design = devices, system.static_pressures
        self._given: Mapping[str, float] | None = None
        self._supply: _Supply = ((), 0.0, (), None)
        self._made: tuple[Any, Actions | None, tuple[float, ...]] = (None, None, ())

    def actions(
        self, given: Mapping[str, float], runs: tuple[float, ...], ventilation: float
    ) -> tuple[Actions, tuple[float, ...]]:
        """Give the actions, the same object as long as nothing changes.

        Parameters
        ----------
        given : mapping of str to float
            The controller's, checked [K] or [Pa].
        runs : tuple of float
            1 or 0 for each air handler [-].
        ventilation : float
            Share of the minimum of outdoor air [-].

        Returns
        -------
        tuple
            Actions, and how much of its design flow each duct's pressure drives [-].
        """
        if given != self._given:
            self._given, self._supply = dict(given), self._laid_out(given)
        asked = self._supply, runs, ventilation
        known, actions, reach = self._made
        if actions is None or asked != known:
            air, water, static, pressure = self._supply
            actions = Actions(air, water, static, pressure, runs, max(runs), ventilation)
            reach = tuple(run * math.sqrt(p / d) for run, p, d in zip(runs, static, self._design, strict=True))
            self._made = asked, actions, reach
        return actions, reach

    def _laid_out(self, given: Mapping[str, float]) -> _Supply:
        names, boiler = self._devices.air_handlers, self._devices.boiler
        air = tuple(given[f"{name}/{SUPPLY_AIR}"] for name in names)
        usual = zip(names, self._design, strict=True)
        static = tuple(given.get(f"{name}/{STATIC_PRESSURE}", design) for name, design in usual)
        return air, given[f"{boiler}/{SUPPLY_WATER}"], static, given.get(f"{boiler}/{DIFFERENTIAL_PRESSURE}")
