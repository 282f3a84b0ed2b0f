"""An excitation that is safe to run on people: random levels within comfort bands, and back to the plant outside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mpc.identify.machines import Machine, as_heated
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast
from thermal.case.points import ZONE_TEMPERATURE


@dataclass(frozen=True)
class ExcitationSettings:
    """Choices of an excitation.

    Parameters
    ----------
    hold : tuple of float
        Shortest and longest time that a level is held [s]: several minutes of a machine's start up, and times over
        which a floor answers.
    ahead : tuple of float
        How long before it holds a lower and an upper edge count, the other way round of cooling [s]: a heated floor
        warms in hours, and gives its heat off over half a day.
    guard : tuple of float
        Distance from the lower and from the upper edge at which the plant gets a machine back that drives there [K];
        the upper one is larger, as a floor goes on to give heat.
    back : float
        Shortest time that the plant then keeps them [s].
    part_load : float
        Share of the levels of a machine that lie between off and full load [-].
    seed : int
        Of the random levels.
    """

    hold: tuple[float, float] = (1800.0, 10_800.0)
    ahead: tuple[float, float] = (10_800.0, 43_200.0)
    guard: tuple[float, float] = (0.2, 1.0)
    back: float = 3600.0
    part_load: float = 0.35
    seed: int = 0


class _Place(NamedTuple):
    """Where the zones of a machine are in their bands [K].

    Least distances from the lower and from the upper edges, these edges, and the edge of the coming two steps that the
    machine drives the zones to.
    """

    below: float
    above: float
    low: float
    high: float
    other: float


class Excitation:
    """Sets machines to random levels that are held for random times, more heat the colder their zones are in the band.

    A pseudo-random sequence (Ljung 1999, System Identification, ch. 13.3) of levels rather than of two values, as maps
    are to be told from it too: off, full load and, where the actuator takes them, loads in between; setpoints anywhere
    within the band of their zone, clear of the zone's other setpoint (`Machine.farthest`). Once a zone of a machine is
    nearer to an edge of its band than the guard, on the side that the machine drives it to, the plant's own control has
    the machine.

    Parameters
    ----------
    machines : sequence of Machine
        What is set.
    step : float
        Control step [s].
    settings : ExcitationSettings, optional
        Choices.
    """

    def __init__(self, machines: Sequence[Machine], step: float, settings: ExcitationSettings | None = None) -> None:
        self.machines, self.step_seconds, self.settings = machines, step, settings or ExcitationSettings()
        self._random = np.random.default_rng(self.settings.seed)
        self._value = dict.fromkeys((m.name for m in machines), np.nan)
        self._until = dict.fromkeys((m.name for m in machines), -1)
        self._back = dict.fromkeys((m.name for m in machines), -1)
        self._count = 0
        self.handed_back = 0

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        """Choose levels, or nothing for machines that the plant keeps.

        Parameters
        ----------
        measurements : Measurements
            Zone temperatures count [K].
        forecast : Forecast or None
            Comfort bands ahead count [K].
        """
        k, chosen = self._count, dict[str, float]()
        self._count += 1
        for machine in self.machines:
            place = self._place(machine, measurements, forecast)
            value = self._value[machine.name]
            if self._unsafe(machine, place, value):
                self._back[machine.name] = k + round(self.settings.back / self.step_seconds)
            if k < self._back[machine.name] or place is None:
                self.handed_back += 1
                self._until[machine.name] = -1
                self._value[machine.name] = np.nan
                continue
            if k >= self._until[machine.name]:
                self._draw(machine, place, k, measurements)
            value = self._value[machine.name]
            if machine.role == "setpoint":
                chosen |= machine.told(value, place.other)
            else:
                chosen[machine.name] = value
        return chosen

    def _place(self, machine: Machine, measurements: Measurements, forecast: Forecast | None) -> _Place | None:
        """Find where the served zones are in their bands; None while nothing tells."""
        if forecast is None:
            return None
        counts = tuple(max(round(s / self.step_seconds), 1) for s in self.settings.ahead)
        for_low, for_high = counts if machine.sign > 0.0 else counts[::-1]
        found = []
        for zone in machine.serves:
            name = f"{zone}/{ZONE_TEMPERATURE}"
            if name not in measurements or not np.isfinite(measurements[name]):
                return None
            lower, upper = (forecast.table[f"{zone}/comfort_{side}_temperature"] for side in ("lower", "upper"))
            low, high = float(lower.iloc[:for_low].max()), float(upper.iloc[:for_high].min())
            other = upper.iloc[:2].min() if machine.sign > 0.0 else lower.iloc[:2].max()
            found.append((measurements[name] - low, high - measurements[name], low, high, float(other)))
        below, above, lows, highs, others = zip(*found, strict=True)
        other = min(others) if machine.sign > 0.0 else max(others)
        return _Place(min(below), min(above), max(lows), min(highs), other)

    def _unsafe(self, machine: Machine, place: _Place | None, value: float) -> bool:
        """Whether a zone is at an edge and the level drives it on; setpoints lie within the band anyhow."""
        if place is None or machine.role == "setpoint":
            return False
        full = value > 0.5 * (machine.actuator.lowest + machine.actuator.highest)
        cold, warm = self.settings.guard
        return place.above < warm if full else place.below < cold

    def _draw(self, machine: Machine, place: _Place, k: int, measurements: Measurements) -> None:
        """Draw a level and how long it is held."""
        random, actuator = self._random, machine.actuator
        shortest, longest = (max(round(s / self.step_seconds), 1) for s in self.settings.hold)
        self._until[machine.name] = k + int(random.integers(shortest, longest + 1))
        low, high = actuator.lowest, actuator.highest
        if machine.role == "setpoint":
            edges = (place.low, place.high) if machine.sign > 0.0 else (place.high, place.low)
            near, far = (as_heated(edge, machine.sign) for edge in edges)
            far = machine.farthest(near, far, measurements) - self.settings.guard[0]
            near += self.settings.guard[0]
            value = as_heated(random.uniform(min(near, far), max(near, far)), machine.sign)
            self._value[machine.name] = float(np.clip(value, low, high))
            return
        room = max(place.below + place.above - self.settings.guard[1], 0.1)
        share = float(np.clip(0.9 - 0.8 * place.below / room, 0.05, 0.95))
        least = actuator.minimum if actuator.minimum is not None else low + 0.2 * (high - low)
        if random.random() > share:
            self._value[machine.name] = low
        elif actuator.kind != "on_off" and random.random() < self.settings.part_load:
            self._value[machine.name] = float(random.uniform(least, high))
        else:
            self._value[machine.name] = high
