"""Who is in and when: schedules, people who come and go at random, and the comfort bands of occupied hours."""

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mpc.errors import ScenarioError
from mpc.scenario.grid import RESOLUTION, WEEKDAY, Calendar, StepGrid, by_clock, index_seconds, local_hours
from thermal._types import FloatArray

#: Share of the people that are in at each hour of a weekday, a Saturday, and a Sunday or holiday [-]: offices of the
#: U.S. DOE's reference buildings (Deru et al. 2011, NREL/TP-5500-46861), schedule BLDG_OCC_SCH.
OFFICE_PRESENCE: tuple[tuple[float, ...], ...] = (
    (0.0,) * 6 + (0.1, 0.2) + (0.95,) * 4 + (0.5,) + (0.95,) * 4 + (0.7, 0.4, 0.4, 0.1, 0.1, 0.05, 0.05),
    (0.0,) * 6 + (0.1,) * 2 + (0.5,) * 6 + (0.1,) * 3 + (0.0,) * 7,
    (0.0,) * 24,
)

#: Floor area of an office for each of its people [m2]: the same reference buildings.
OFFICE_AREA_PER_PERSON = 18.58

_STREAM = 11  # of random numbers of a seed


@dataclass(frozen=True, eq=False)
class Occupancy:
    """People in the zones over time: always in, unless a class says otherwise.

    Parameters
    ----------
    assigned : float or mapping of str to float
        People assigned to each zone, or to each of the zones named (others have none) [-]; default one a zone.
    calendar : Calendar
        Which days are holidays; default none.

    Raises
    ------
    ScenarioError
        When a number of people is negative or not finite.
    """

    assigned: float | Mapping[str, float] = 1.0
    calendar: Calendar = field(default_factory=Calendar, kw_only=True)

    def __post_init__(self) -> None:
        possible = all(np.isfinite(count) and count >= 0 for count in self._counts)
        ScenarioError.unless(possible, "assigned", "people of 0 or more", self.assigned)

    @property
    def _counts(self) -> list[float]:
        return [*self.assigned.values()] if isinstance(self.assigned, Mapping) else [self.assigned]

    def people(self, zones: Sequence[str]) -> FloatArray:
        """People assigned to each zone, shape (n_zone,) [-].

        Parameters
        ----------
        zones : sequence of str
            Names.
        """
        each = self.assigned if isinstance(self.assigned, Mapping) else dict.fromkeys(zones, self.assigned)
        return np.array([float(each.get(zone, 0.0)) for zone in zones])

    def expected(self, grid: StepGrid, zones: Sequence[str]) -> FloatArray:
        """Mean number of people expected in each zone over each step, shape (n_steps, n_zone) [-].

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        zones : sequence of str
            Names.
        """
        return np.outer(np.ones(grid.n_steps), self.people(zones))

    def draw(self, grid: StepGrid, zones: Sequence[str], seed: int) -> FloatArray:
        """Mean number of people in each zone over each step, as it came out, shape (n_steps, n_zone) [-].

        What is `expected`, unless a class draws at random.

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        zones : sequence of str
            Names.
        seed : int
            Same seed, same people at the same times, whatever grid or zones are asked for; 0 or more.
        """
        return self.expected(grid, zones)


@dataclass(frozen=True, eq=False)
class ScheduledOccupancy(Occupancy):
    """People who come and go by the clock.

    Parameters
    ----------
    assigned : float or mapping of str to float
        People assigned to each zone, or to each of the zones named (others have none) [-].
    presence : array_like, shape (3, 24)
        Share of them that is in at each local hour of a weekday, a Saturday, and a Sunday or holiday [-]; default
        `OFFICE_PRESENCE`.
    calendar : Calendar
        Which days are holidays; default none.

    Raises
    ------
    ScenarioError
        When the table has another shape, or a number is out of range.
    """

    presence: ArrayLike = OFFICE_PRESENCE

    def __post_init__(self) -> None:
        super().__post_init__()
        table = np.asarray(self.presence, dtype=float)
        possible = table.shape == (3, 24) and ((table >= 0) & (table <= 1)).all()
        expected = "3 rows (weekday, Saturday, Sunday) of 24 shares from 0 to 1"
        ScenarioError.unless(possible, "presence", expected, f"shape {table.shape}")

    def expected(self, grid: StepGrid, zones: Sequence[str]) -> FloatArray:
        """Mean number of people expected in each zone over each step, shape (n_steps, n_zone) [-].

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        zones : sequence of str
            Names.
        """
        table = np.asarray(self.presence, dtype=float)[:, None, :]
        return np.outer(grid.mean(by_clock(table, self.calendar, grid)), self.people(zones))


@dataclass(frozen=True, eq=False)
class RandomOccupancy(Occupancy):
    """People who each arrive once and depart once on a working day, at random times of two windows of the local clock.

    ``exponential`` is the law of the paper's simulator in continuous time: from the window's opening a person arrives,
    and departs, at the constant rate ``2 / W`` (W the window's length), so that half the window is the mean. Who has
    not arrived when the window closes stays away that day (13.5 %); who has not left by its close leaves then.
    ``uniform`` is what the name says: everybody comes. Arrivals end before departures begin, so that the chance to be
    in is ``F_a(t) (1 - F_d(t))``.

    Parameters
    ----------
    assigned : float or mapping of str to float
        People assigned to each zone, or to each of the zones named (others have none); whole numbers [-]. The paper's
        simulator has 1 a zone.
    arrival, departure : tuple of float
        Opening and close of the windows, local [h]; multiples of 5 minutes. Defaults are those of the paper's
        simulator.
    law : str
        ``exponential`` or ``uniform``.
    calendar : Calendar
        Which days are holidays; default none. Nobody comes on Saturdays, Sundays and holidays.

    Raises
    ------
    ScenarioError
        When windows are not in order within a day, or a number of people is not whole.
    """

    arrival: tuple[float, float] = (3.0, 12.0)
    departure: tuple[float, float] = (13.0, 23.0)
    law: Literal["exponential", "uniform"] = "exponential"

    def __post_init__(self) -> None:
        super().__post_init__()
        hours = np.array([0.0, *self.arrival, *self.departure, 24.0])
        off = np.abs(hours * 3600.0 / RESOLUTION - np.round(hours * 3600.0 / RESOLUTION)) > 1e-6
        ordered = (np.diff(hours) >= 0.0).all() and hours[1] < hours[2] and hours[3] < hours[4]
        found = f"arrival {self.arrival}, departure {self.departure}"
        fit = ordered and not off.any()
        ScenarioError.unless(fit, "windows", "rising multiples of 5 minutes from 0 to 24 h", found)
        ScenarioError.unless_known(self.law, ("exponential", "uniform"), "law", "'exponential' or 'uniform'")
        whole = all(float(count).is_integer() for count in self._counts)
        ScenarioError.unless(whole, "assigned", "whole numbers of people", self.assigned)

    def chance(self, hours: ArrayLike) -> FloatArray:
        """Chance that a person is in at an hour of a working day [-].

        Parameters
        ----------
        hours : array_like
            Local [h].
        """
        hour = np.asarray(hours, dtype=float)
        arrived, left = (self._passed(hour, window) for window in (self.arrival, self.departure))
        return np.asarray(arrived * np.where(hour >= self.departure[1], 0.0, 1.0 - left))

    def _passed(self, hour: FloatArray, window: tuple[float, float]) -> FloatArray:
        share = np.clip((hour - window[0]) / (window[1] - window[0]), 0.0, 1.0)
        return share if self.law == "uniform" else 1.0 - np.exp(-2.0 * share)

    def expected(self, grid: StepGrid, zones: Sequence[str]) -> FloatArray:
        """Mean number of people expected in each zone over each step, shape (n_steps, n_zone) [-].

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        zones : sequence of str
            Names.
        """
        half = 0.5 * grid.step / grid.per_step / 3600.0
        hour = local_hours(grid.middles)
        # Simpson's rule over a piece: the chance is smooth within it, since its corners are edges of pieces.
        inside = 1e-9
        chance = (self.chance(hour - half + inside) + 4.0 * self.chance(hour) + self.chance(hour + half - inside)) / 6.0
        working = self.calendar.kinds_on(grid.middles) == WEEKDAY
        return np.outer(grid.mean(np.where(working, chance, 0.0)), self.people(zones))

    def draw(self, grid: StepGrid, zones: Sequence[str], seed: int) -> FloatArray:
        """Mean number of people in each zone over each step, as it came out, shape (n_steps, n_zone) [-].

        Each day of each zone has random numbers of its own, so that a person's day does not depend on what else is
        asked for, nor in which order.

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        zones : sequence of str
            Names.
        seed : int
            Same seed, same people at the same times; 0 or more.

        Raises
        ------
        ScenarioError
            When the seed is negative.
        """
        ScenarioError.unless(seed >= 0, "seed", "0 or more", repr(seed))
        days = [d for d, kind in zip(grid.days, self.calendar.kind(grid.days), strict=True) if kind == WEEKDAY]
        count = np.zeros((grid.n_steps, len(zones)))
        for k, (zone, people) in enumerate(zip(zones, self.people(zones), strict=True)):
            if people and days:
                hours = np.stack([self._day(seed, day, zone, int(people)) for day in days])
                count[:, k] = _presence(_local_seconds(days, hours, grid), grid)
        return count

    def _day(self, seed: int, day: date, zone: str, people: int) -> FloatArray:
        """Hours of arrival and departure of each person on a day, shape (n_people, 2); NaN for who stays away."""
        rng = np.random.default_rng([seed, _STREAM, day.toordinal(), zlib.crc32(zone.encode())])
        share = rng.random((people, 2)) if self.law == "uniform" else 0.5 * rng.standard_exponential((people, 2))
        windows = np.array([self.arrival, self.departure])
        hours = windows[:, 0] + share * np.diff(windows, axis=1)[:, 0]
        hours[:, 1] = np.minimum(hours[:, 1], windows[1, 1])
        hours[hours[:, 0] > windows[0, 1]] = np.nan
        return np.asarray(hours)


def _local_seconds(days: Sequence[date], hours: FloatArray, grid: StepGrid) -> FloatArray:
    """Seconds since 1970 in UTC of local hours of days, shape (n_person_day, 2), without those who stay away."""
    midnight = np.array([(d - date(1970, 1, 1)).days * 86400.0 for d in days])
    wall = (midnight[:, None, None] + hours * 3600.0).reshape(-1, 2)
    wall = wall[~np.isnan(wall).any(axis=1)]
    naive = pd.DatetimeIndex(pd.to_datetime(np.round(wall.ravel()), unit="s"))
    # A time that the clock skips is the moment it jumps, a time that it shows twice is the first of the two.
    first = np.ones(len(naive), dtype=bool)
    local = naive.tz_localize(grid.start.tz, ambiguous=first, nonexistent="shift_forward")
    return index_seconds(local).astype(float).reshape(-1, 2)


def _presence(stays: FloatArray, grid: StepGrid) -> FloatArray:
    """Mean number of people over each step from the stays of each, exactly."""

    def since(moments: FloatArray) -> FloatArray:
        """Person-seconds since moments, at the edges of the steps."""
        ordered = np.sort(moments) - grid.edges[0]
        edges = (grid.edges - grid.edges[0]).astype(float)
        past = np.searchsorted(ordered, edges)
        return np.asarray(past * edges - np.concatenate([[0.0], np.cumsum(ordered)])[past])

    mean = np.diff(since(stays[:, 0]) - since(stays[:, 1])) / grid.step
    return np.where(np.abs(mean) < 1e-9, 0.0, mean)  # what rounding leaves of an empty room


@dataclass(frozen=True)
class ComfortBand:
    """A band in occupied hours and a wider one outside of them, by the local clock.

    Parameters
    ----------
    occupied, unoccupied : tuple of float
        Lower and upper temperature [K]. Defaults are those of BOPTEST's multi-zone office, 21 to 24 and 15 to 30 degC
        (Blum et al. 2021, doi:10.1080/19401493.2021.1986574).
    weekday, saturday, sunday : tuple of float or None
        Start and end of the occupied hours, local [h], multiples of 5 minutes; None is a day without. A holiday is
        like a Sunday. Defaults are weekdays from 6 to 19.
    calendar : Calendar
        Which days are holidays; default none.

    Raises
    ------
    ScenarioError
        When a band is empty or hours are out of order.
    """

    occupied: tuple[float, float] = (294.15, 297.15)
    unoccupied: tuple[float, float] = (288.15, 303.15)
    weekday: tuple[float, float] | None = (6.0, 19.0)
    saturday: tuple[float, float] | None = None
    sunday: tuple[float, float] | None = None
    calendar: Calendar = field(default_factory=Calendar)

    def __post_init__(self) -> None:
        for name in ("occupied", "unoccupied"):
            lower, upper = getattr(self, name)
            require_band(lower, upper, f"comfort: {name}")
        for name in ("weekday", "saturday", "sunday"):
            hours = getattr(self, name)
            rising = hours is None or 0.0 <= hours[0] < hours[1] <= 24.0
            ScenarioError.unless(rising, f"comfort: {name}", "rising hours from 0 to 24", hours)

    def occupied_share(self, grid: StepGrid) -> FloatArray:
        """Share of each step that lies in occupied hours, shape (n_steps,) [-].

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        """
        of_kind = np.array([hours or (0.0, 0.0) for hours in (self.weekday, self.saturday, self.sunday)])
        hour, (first, last) = local_hours(grid.middles), of_kind[self.calendar.kinds_on(grid.middles)].T
        inside = ((hour >= first) & (hour < last)).astype(float)
        return grid.mean(inside)

    def on(self, grid: StepGrid) -> tuple[FloatArray, FloatArray]:
        """Lower and upper edge over each step, shape (n_steps,) each [K].

        A step that is partly occupied has the occupied band.

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        """
        occupied = self.occupied_share(grid) > 0.0
        lower, upper = (np.where(occupied, self.occupied[side], self.unoccupied[side]).astype(float) for side in (0, 1))
        return lower, upper


def require_band(lower: ArrayLike, upper: ArrayLike, where: str) -> None:
    """Refuse a band that is empty, or in other units than kelvin.

    Parameters
    ----------
    lower, upper : float or ndarray
        Edges, of the same shape [K].
    where : str
        What it is, for the message.

    Raises
    ------
    ScenarioError
        When it is, at any time.
    """
    low, high = np.atleast_1d(lower), np.atleast_1d(upper)
    wrong = np.flatnonzero(~((low >= 223.15) & (low < high) & (high <= 373.15)))
    expected = "a lower and an upper temperature in K"
    found = f"{low[wrong[0]]:g} to {high[wrong[0]]:g}" if wrong.size else ""
    ScenarioError.unless(not wrong.size, where, expected, found)
