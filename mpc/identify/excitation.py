"""An excitation that is safe to run on people: random levels within comfort bands, and back to the plant outside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mpc.identify.machines import Machine, as_heated
from mpc.loop.actuators import Actuator
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
    water_hold : tuple of float
        Shortest and longest time that the temperature of supply water is held [s]: what terminals give with it shows
        within an hour.
    own_water : float
        Share of these times in which the plant itself has the water [-].
    """

    hold: tuple[float, float] = (1800.0, 10_800.0)
    ahead: tuple[float, float] = (10_800.0, 43_200.0)
    guard: tuple[float, float] = (0.2, 1.0)
    back: float = 3600.0
    part_load: float = 0.35
    seed: int = 0
    water_hold: tuple[float, float] = (3600.0, 14_400.0)
    own_water: float = 0.3


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
    the machine. Supply water has random temperatures, until a zone is near the edge that the water keeps it from.

    Parameters
    ----------
    machines : sequence of Machine
        What is set.
    step : float
        Control step [s].
    settings : ExcitationSettings, optional
        Choices.
    water : Actuator, optional
        Setpoint of the water that a source supplies to the machines.
    """

    def __init__(
        self, machines: Sequence[Machine], step: float, settings: ExcitationSettings | None = None,
        water: Actuator | None = None,
    ) -> None:  # fmt: skip
        self.machines, self.step_seconds, self.settings = machines, step, settings or ExcitationSettings()
        self._water = None if water is None else _Water(water, step, self.settings)
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
        if self._water is not None:
            near = min(self._near(machine, measurements, forecast) for machine in self.machines)
            chosen |= self._water.step(k, near)
        return chosen

    def _near(self, machine: Machine, measurements: Measurements, forecast: Forecast | None) -> float:
        """Least distance of the served zones from the edge that the machine keeps them from, now and in a step [K]."""
        found, side = [], "lower" if machine.sign > 0.0 else "upper"
        for zone in machine.serves:
            name = f"{zone}/{ZONE_TEMPERATURE}"
            if forecast is None or name not in measurements or not np.isfinite(measurements[name]):
                return -np.inf
            edges = forecast.table[f"{zone}/comfort_{side}_temperature"].iloc[:2]
            kept = edges.max() if machine.sign > 0.0 else edges.min()
            found.append(machine.sign * float(measurements[name] - kept))
        return min(found)

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


class _Water:
    """Random temperatures of supply water, and the plant's own while a zone is near an edge."""

    def __init__(self, actuator: Actuator, step: float, settings: ExcitationSettings) -> None:
        self._actuator, self._step, self._settings = actuator, step, settings
        self._random = np.random.default_rng([settings.seed, 1])
        self._until, self._value = -1, np.nan

    def step(self, k: int, near: float) -> dict[str, float]:
        """Choose a temperature, or nothing while the plant has the water."""
        told = self._settings
        if near < told.guard[0]:
            self._until, self._value = k + round(told.back / self._step), np.nan
        elif k >= self._until:
            shortest, longest = (max(round(s / self._step), 1) for s in told.water_hold)
            self._until = k + int(self._random.integers(shortest, longest + 1))
            own = self._random.random() < told.own_water
            drawn = self._random.uniform(self._actuator.lowest, self._actuator.highest)
            self._value = np.nan if own else float(drawn)
        return {} if np.isnan(self._value) else {self._actuator.name: self._value}
