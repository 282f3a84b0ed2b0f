"""Moves that a building can make without harm, from which an experiment is put together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from calibration.experiment.schedule import BAND, COOLING, HEATING, Move
from thermal._types import BoolArray, FloatArray
from thermal.case.building import Building
from thermal.case.case import Case
from thermal.network.topology import Anatomy

#: Distance that setpoints keep from the edge of the comfort band [K]: terminals without integral action rest up to
#: half of their throttling range from them (ASHRAE Handbook, Fundamentals 2017, ch. 7).
MARGIN = 0.5

#: How far below and above the band of occupied hours zones are driven while nobody is in [K]: from as cool to as warm
#: as thermostats are set (18 to 26 degC, ranges of `thermal.components.thermostat`), and back before people come.
BEYOND = (3.0, 2.5)

#: Hours before people come in which zones are back where they like it [h].
LEAD = 3.0

#: Hours after an experiment in which discomfort counts [h]: people that come when zones ought to be back, and as long.
AFTER = 2.0 * LEAD

#: How long setpoints hold where they go to and fro [h]: shorter than walls take to follow, longer than air does.
TURNS = (1.0, 3.0, 12.0)

#: Pressures of a duct against that of usual operation [-]: half of the air at the most.
PRESSURES = (1.0, 0.25)

#: Longer than any experiment [h]: setpoints that stay.
_LONG = 1e4


@dataclass(frozen=True)
class Lever:
    """A setpoint of air handlers that an experiment may change.

    Parameters
    ----------
    title : str
        In plain words.
    handlers : tuple of str
        Air handlers.
    levels : tuple of float
        Values in turn [K] or [Pa].
    """

    title: str
    handlers: tuple[str, ...]
    levels: tuple[float, ...]


@dataclass(frozen=True)
class Comfort:
    """Band of temperatures on some steps.

    Parameters
    ----------
    lower, upper : ndarray, shape (n_time,)
        Its edges [K].
    """

    lower: FloatArray
    upper: FloatArray

    @property
    def narrowest(self) -> tuple[float, float]:
        """Edges where they are closest, as they are while people are in [K]."""
        at = int(np.argmin(self.upper - self.lower))
        return float(self.lower[at]), float(self.upper[at])

    def discomfort(self, zone: FloatArray, step: float) -> FloatArray:
        """Distance from the band over time, shape (n_zone,) [K h].

        Parameters
        ----------
        zone : ndarray, shape (n_time, n_zone)
            Temperatures [K].
        step : float
            Time step [s].
        """
        off = np.maximum(self.lower[:, None] - zone, zone - self.upper[:, None])
        return np.asarray(np.maximum(off, 0.0).sum(axis=0) * step / 3600.0)


def office_comfort(stamps: pd.DatetimeIndex, step: float) -> Comfort:
    """Comfort of an office: 21 to 24 degC on weekdays from 6 to 19 h, 15 to 30 degC else.

    Those of BOPTEST's multi-zone office (Blum et al. 2021, doi:10.1080/19401493.2021.1986574).

    Parameters
    ----------
    stamps : DatetimeIndex, length n_time
        Ends of the steps, local to the building.
    step : float
        Their length [s].
    """
    middle = stamps - pd.Timedelta(seconds=step / 2.0)
    hour = np.asarray(middle.hour + middle.minute / 60.0)
    people = (np.asarray(middle.day_of_week) < 5) & (hour >= 6.0) & (hour < 19.0)
    return Comfort(np.where(people, 294.15, 288.15), np.where(people, 297.15, 303.15))


def places(
    building: Building, anatomy: Anatomy, movable: Sequence[str], members: Sequence[Sequence[str]]
) -> dict[str, tuple[str, ...]]:
    """Zones that are moved together, by what they are called.

    Parameters
    ----------
    building : Building
        With its floors.
    anatomy : Anatomy
        With facades and what lies on what.
    movable : sequence of str
        Zones with a terminal.
    members : sequence of sequence of str
        Zones of each member of the group.
    """
    found: dict[str, Sequence[str]] = {"all zones": building.zone_names}
    above = {high for _, high in anatomy.stacked}
    if above:
        found["the lower floors"] = [z for z in building.zone_names if z not in above]
        found["the upper floors"] = sorted(above)
    for zones in members:
        if zones:
            found[", ".join(zones[:4])] = zones
    outside = {zone for zone, _ in anatomy.facades}
    found["zones at a facade"] = [z for z in building.zone_names if z in outside]
    found["every other zone"] = building.zone_names[::2]
    chosen: dict[str, tuple[str, ...]] = {}
    for name, zones in found.items():
        here = tuple(z for z in building.zone_names if z in zones and z in movable)
        if here and here not in chosen.values():
            chosen[name] = here
    return chosen


def moves(
    where: Mapping[str, tuple[str, ...]], comfort: Comfort, band: tuple[float, float], hours: FloatArray,
    levers: Mapping[str, Lever],
) -> list[Move]:  # fmt: skip
    """Give all single moves.

    Parameters
    ----------
    where : mapping of str to tuple of str
        Zones by name, `places`.
    comfort : Comfort
        Band on the steps, and on those after the end as far as it is known, for people may come then.
    band : tuple of float
        Its edges while people are in [K].
    hours : ndarray, shape (n_time,)
        Middle of each step from the beginning [h].
    levers : mapping of str to Lever
        What can be set of air handlers, by point.
    """
    width = comfort.upper - comfort.lower
    people = width <= band[1] - band[0] + 1e-9
    width = width[: hours.size]
    low, high = band[0] + MARGIN, band[1] - MARGIN
    free = _spans(~_soon(people, hours), hours)
    loose = int(np.argmax(width))
    coldest = max(low - BEYOND[0], float(comfort.lower[loose]) + MARGIN)
    warmest = min(high + BEYOND[1], float(comfort.upper[loose]) - MARGIN)
    whole = ((0.0, float(hours[-1] + hours[0])),)
    found = []
    for name, zones in where.items():
        kinds: list[tuple[str, tuple[float, ...], float, tuple[tuple[float, float], ...]]] = [
            (f"hold {name} warm by day and night", (high,), _LONG, whole),
            (f"hold {name} cool by day and night", (low,), _LONG, whole),
            *((f"move {name} to and fro every {t:g} h", (high, low), t, whole) for t in TURNS),
        ]
        if free:
            kinds += [
                (f"hold {name} warm while nobody is in", (warmest,), _LONG, free),
                (f"let {name} cool while nobody is in", (coldest,), _LONG, free),
                *((f"move {name} to and fro every {t:g} h while nobody is in", (warmest, coldest), t, free)
                  for t in TURNS),
            ]  # fmt: skip
        for title, levels, every, spans in kinds:
            pairs = tuple((v - BAND / 2.0, v + BAND / 2.0) for v in levels)
            found.append(Move(title, zones, pairs, every, spans))
    for point, lever in levers.items():
        pairs = tuple((v, v) for v in lever.levels)
        found.append(Move(f"{lever.title} in turns of 3 h", lever.handlers, pairs, 3.0, whole, point))
    return found


def shortened(move: Move, share: float) -> Move:
    """Give the last part of a move: the same, for a share of its hours.

    Parameters
    ----------
    move : Move
        Any.
    share : float
        Of its hours [-], 0 to 1.
    """
    left, spans = share * move.hours, []
    for first, last in reversed(move.spans):
        if left <= 1e-9:
            break
        taken = min(left, last - first)
        spans.append((last - taken, last))
        left -= taken
    return replace(move, spans=tuple(reversed(spans)))


def by_hand(case: Case, moves: Sequence[Move]) -> tuple[str, ...]:
    """Name zones, or air handlers, that moves set and of which the telemetry has no setpoints.

    Nobody knows that the automation takes them.

    Parameters
    ----------
    case : Case
        With telemetry.
    moves : sequence of Move
        Of an experiment.
    """
    seen, building = set(case.telemetry.frame.columns), case.building
    found = {}
    for move in moves:
        points = (move.point,) if move.point else (HEATING, COOLING)
        for name in move.zones:
            own = [name, *(() if move.point else (d.name for d in building.devices_of(name)))]
            found[name] = not any(f"{n}/{point}" in seen for n in own for point in points)
    return tuple(name for name, lacks in found.items() if lacks)


def _soon(people: BoolArray, hours: FloatArray) -> BoolArray:
    """Whether people are in, or come within the hours that zones take to be back."""
    step = float(hours[1] - hours[0]) if hours.size > 1 else 1.0
    found = people.copy()
    for k in range(1, round(LEAD / step) + 1):
        found[:-k] |= people[k:]
    return found[: hours.size]


def _spans(inside: BoolArray, hours: FloatArray) -> tuple[tuple[float, float], ...]:
    """First and last hours of the parts in which something is so, of 2 h at least."""
    half = hours[0]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    parts = zip(edges[::2], edges[1::2], strict=True)
    found = ((float(hours[a] - half), float(hours[b - 1] + half)) for a, b in parts)
    return tuple(part for part in found if part[1] - part[0] >= 2.0)
