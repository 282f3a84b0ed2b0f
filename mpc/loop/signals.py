"""Signals that drive the effects in a plant: of the scenario in advance, of air and heat while the loop runs."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from mpc.errors import PlantError
from mpc.loop.extras import ScenarioDrivers
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.errors import describe
from thermal.inputs.drivers import Signal
from thermal.network.network import ThermalNetwork
from thermal.system.replay import replay_reheat
from thermal.system.system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY

#: Zone, supply air and supply water that design capacities of terminals are counted at [K], those of `Terminals.sized`.
_ROOM, _SUPPLY, _WATER = 294.15, 285.95, 355.35


class _NeedsLoop(PlantError):  # noqa: N818 - control flow within this module, never seen outside
    """A signal asks for what only the running loop knows."""


class _InAdvance(ScenarioDrivers):
    """Drivers of a scenario, which does not know what the plant will do."""

    def _unknown(self) -> Any:
        raise _NeedsLoop

    heat = cached_property(_unknown)
    supply = cached_property(_unknown)
    airflow = cached_property(_unknown)


class _Now:
    """Drivers of a step of the loop, behind two rows of what is the most: quantiles over telemetry mean that."""

    def __init__(self, zones: tuple[str, ...], flow: FloatArray, heat: FloatArray) -> None:
        self.zones = zones
        self.heat, self._flow = np.stack([heat, heat, heat]), np.stack([flow, flow, flow])
        self.supply = (self._flow, self.heat)

    def put(self, flow: FloatArray, heat: FloatArray) -> None:
        """Set the row of now."""
        self._flow[2], self.heat[2] = flow, heat

    def __getattr__(self, name: str) -> Any:
        raise _NeedsLoop(name)


def _most_heat(system: HvacSystem) -> FloatArray:
    """Heat that the terminals can bring to their zones at design, shape (n_terminal,) [W]."""
    terminals, flow = system.terminals, system.terminals.heating_flow
    entering, wanted = np.full((1, len(flow)), _SUPPLY), np.full((1, len(flow)), terminals.discharge_limit)
    reached = replay_reheat(terminals, flow[np.newaxis], entering, wanted, np.array([_WATER])).discharge[0]
    return np.asarray(AIR_HEAT_CAPACITY * flow * np.maximum(reached - _ROOM, 0.0))


class EffectSignals:
    """Signals of a network's effects, step by step.

    Parameters
    ----------
    network : ThermalNetwork
        With effects, or without.
    scenario : Scenario
        Weather and people.
    system : HvacSystem
        Whose terminals say what the most of air and heat is: their design flows, and what their coils give at design.

    Raises
    ------
    PlantError
        When an effect is one of a meter's clock, which means nothing in a closed loop.
    EffectError
        When the weather lacks what an effect needs.
    """

    def __init__(self, network: ThermalNetwork, scenario: Scenario, system: HvacSystem) -> None:
        self._values = np.zeros((scenario.grid.n_steps, len(network.signals)))
        self._system, terminals = system, system.terminals
        flow, heat = (system.by_zone(value) for value in (terminals.design_flow, _most_heat(system)))
        self._now = _Now(network.zones, flow, heat)
        self._live: list[tuple[int, Signal]] = []
        drivers = _InAdvance(scenario.driving_case(), scenario) if network.signals else None
        for k, signal in enumerate(network.signals):
            try:
                self._values[:, k] = signal.of(drivers)  # type: ignore[arg-type]
            except _NeedsLoop:
                self._try(signal)
                self._live.append((k, signal))

    def _try(self, signal: Signal) -> None:
        try:
            self._of(signal)
        except _NeedsLoop as error:
            found = f"{signal.name!r}, which is made of {error}"
            expected = "signals of a step, its air and its heat"
            raise PlantError(describe("effects of the plant", expected, found, "leave that effect out")) from error

    def _of(self, signal: Signal) -> float:
        return float(signal.of(self._now)[-1])  # type: ignore[arg-type]

    def known(self, k: int) -> FloatArray:
        """Give the signals of a step as far as they are known before it, shape (n_signal,) [signal unit].

        Parameters
        ----------
        k : int
            Number of the step.
        """
        row: FloatArray = self._values[k]
        return row

    def at(self, k: int, airflow: FloatArray, heat: FloatArray) -> FloatArray:
        """Give the signals of a step, shape (n_signal,) [signal unit].

        Parameters
        ----------
        k : int
            Number of the step.
        airflow : ndarray, shape (n_terminal,)
            Supply air of the terminals [kg/s].
        heat : ndarray, shape (n_zone,)
            That it brings to the zones [W].
        """
        row: FloatArray = self._values[k]
        if self._live:
            row = row.copy()
            self._now.put(self._system.by_zone(airflow), heat)
            for position, signal in self._live:
                row[position] = self._of(signal)
        return row
