"""A building that is served: everything that a test of it is made of, shared by all its tests."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from mpc.adapters.boptest.scenario import DAY, Period, YearClock, find_periods, scenario_prices
from mpc.adapters.boptest.signals import Metadata, ObservedPlant, PlantSignals, forecast_metadata
from mpc.errors import BoptestRequestError, PlantError
from mpc.loop.building import BuildingModel
from mpc.loop.noise import SensorNoise
from mpc.loop.operation import Operation, scheduled_operation
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import ComfortBand, Occupancy
from mpc.scenario.rates import Rate
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import CarbonIntensity, Tariff, paper_carbon, paper_tariff
from mpc.scenario.weather import Weather
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.system.system import HvacSystem

_MINUTE = 60.0
_KEPT, _WARM = 8, 4  # scenarios and warm-ups that are kept, so that tests of one period share theirs


class Trajectory:
    """Outputs and inputs of a run by time, a row a step of the plant.

    Parameters
    ----------
    names : sequence of str
        Of the values.
    rows : iterable of ndarray, shape (1 + n_name,)
        Time [s] and values.
    """

    def __init__(self, names: Sequence[str], rows: Iterable[FloatArray] = ()) -> None:
        self.names, self._rows = tuple(names), list(rows)

    def __len__(self) -> int:
        return len(self._rows)

    def append(self, time: float, values: Sequence[float]) -> None:
        """Add a row.

        Parameters
        ----------
        time : float
            BOPTEST's [s], after that of the row before.
        values : sequence of float
            In the order of the names [their units].
        """
        self._rows.append(np.array((time, *values), dtype=float))

    def copy(self) -> Trajectory:
        """Give the same rows, to go on from."""
        return Trajectory(self.names, self._rows)

    def last(self) -> dict[str, float]:
        """Give the last row, by name, with its time."""
        return dict(zip(("time", *self.names), self._rows[-1].tolist(), strict=True))

    def between(self, names: Sequence[str], start: float, end: float) -> dict[str, list[float]]:
        """Rows of a time, column by column.

        Parameters
        ----------
        names : sequence of str
            Which values.
        start, end : float
            BOPTEST's times, both included [s].
        """
        first = bisect_left(self._rows, start, key=itemgetter(0))
        last = bisect_right(self._rows, end, key=itemgetter(0))
        position = {name: k for k, name in enumerate(("time", *self.names))}
        columns = [position[name] for name in ("time", *names)]
        table = np.array([row[columns] for row in self._rows[first:last]]).reshape(-1, len(columns))
        return dict(zip(("time", *names), table.T.tolist(), strict=True))


class BegunPlant(NamedTuple):
    """A plant whose scenario begins with a warm-up.

    Parameters
    ----------
    plant : ObservedPlant
        Not yet reset.
    start : float
        BOPTEST's time at which the warm-up ends [s].
    end : float
        BOPTEST's time at which the test ends [s].
    warm_up_steps : int
        Steps of the plant before the start.
    """

    plant: ObservedPlant
    start: float
    end: float
    warm_up_steps: int


@dataclass(frozen=True, eq=False)
class BoptestCase:
    """A building that is served as a test case of BOPTEST's API.

    Parameters
    ----------
    name : str
        Of the test case.
    building : Building
        With devices for a plant: a terminal a zone, air handlers, a boiler.
    weather : Weather
        Of a year, or of a shorter time, which then bounds what can be simulated.
    make_model : callable
        Gives a new `BuildingModel` for each test, at the plant's step.
    system : HvacSystem
        The plant.
    step : float
        Step of the plant [s], a whole number of minutes.
    tariff : Tariff, optional
        Its price of electricity is the ``dynamic`` one; those of the paper's simulator by default.
    carbon : CarbonIntensity, optional
        Those of the paper's simulator by default.
    occupancy : Occupancy, optional
        People; an office's schedule by default.
    comfort : ComfortBand, optional
        Of all zones; BOPTEST's office band by default.
    noise : SensorNoise, optional
        Errors of sensors; none by default, as in BOPTEST.
    boundaries : mapping of str to Series, optional
        Temperatures of boundaries beside outdoor, by stamps with a time zone [K].
    longest_days : float
        How long a test may go on that no time period ends [d].

    Raises
    ------
    PlantError
        When the step is no whole number of minutes, or the weather has no three whole days.
    """

    name: str
    building: Building
    weather: Weather
    make_model: Callable[[], BuildingModel]
    system: HvacSystem
    step: float = 300.0
    tariff: Tariff = field(default_factory=paper_tariff)
    carbon: CarbonIntensity = field(default_factory=paper_carbon)
    occupancy: Occupancy | None = None
    comfort: ComfortBand | None = None
    noise: SensorNoise | None = None
    boundaries: Mapping[str, pd.Series] = field(default_factory=dict)
    longest_days: float = 31.0

    def __post_init__(self) -> None:
        if not (self.step >= _MINUTE and (self.step / _MINUTE).is_integer()):
            raise PlantError("step", "a whole number of minutes, in seconds", repr(self.step))
        PlantError.unless(self.longest_days > 0, "longest_days", "more than 0", repr(self.longest_days))
        PlantError.unless(len(self.daily) >= 3, "weather", "three whole days at least", f"{len(self.daily)}")

    @cached_property
    def clock(self) -> YearClock:
        """Its year is that of the weather's first stamp; a typical year stands for 2023, which began on a Sunday."""
        zone = self.building.location.timezone
        first = self.weather.stamps[0].tz_convert(zone) - pd.Timedelta(seconds=self.weather.step)
        return YearClock(2023 if self.weather.typical else int(first.year), zone)

    @cached_property
    def covered(self) -> tuple[float, float]:
        """BOPTEST's times between which there is weather [s]; a typical year goes on into the next."""
        if self.weather.typical:
            return 0.0, 2 * 365 * DAY
        stamps = self.weather.stamps
        first = self.clock.time(stamps[0].timestamp() - self.weather.step)
        # a whole minute inside of what there is
        return float(np.ceil(first / _MINUTE) * _MINUTE), self.clock.time(stamps[-1].timestamp())

    @cached_property
    def periods(self) -> dict[str, Period]:
        """Time periods of the scenarios, by name."""
        return find_periods(self._first_day, self.daily)

    @cached_property
    def prices(self) -> dict[str, Rate]:
        """Prices of the scenarios, by name."""
        hours = StepGrid(self.clock.stamp(self._first_day), 3600.0, 24 * len(self.daily))
        return scenario_prices(self.tariff.electricity, hours)

    @cached_property
    def daily(self) -> FloatArray:
        """Means of the outdoor temperature over whole days of the clock, shape (n_day,) [K]; NaN is unknown."""
        last = self.covered[1]
        last = min(last, 365 * DAY) if self.weather.typical else last
        count = int((last - self._first_day) // DAY)
        if count < 1:
            return np.zeros(0)
        grid = StepGrid(self.clock.stamp(self._first_day), 3600.0, 24 * count)
        hourly = self.weather.on(grid).frame[OUTDOOR_TEMPERATURE].to_numpy(dtype=float)
        return np.asarray(hourly.reshape(count, 24).mean(axis=1))

    @cached_property
    def signals(self) -> PlantSignals:
        """What of its plants is seen and set."""
        first, _ = self.covered
        return PlantSignals(self._plant(first, first + DAY))

    @cached_property
    def forecast_points(self) -> Metadata:
        """Metadata of the boundary conditions, of the weather those that are known at any time."""
        frame = self.weather.frame
        known = {str(point) for point in frame if frame[point].notna().any()}
        return forecast_metadata(known, self.building.zone_names, self.tariff.currency, self.carbon.kind)

    @property
    def _first_day(self) -> float:
        return float(np.ceil(self.covered[0] / DAY) * DAY)

    def begin(self, start: float, warm_up: float, end: float | None = None) -> BegunPlant:
        """Make a plant for a test.

        Parameters
        ----------
        start : float
            BOPTEST's time [s]; moved to a whole minute before it.
        warm_up : float
            Time before it [s]; shortened to what the weather has and to whole steps.
        end : float, optional
            BOPTEST's time at which the test ends [s]; `longest_days` after the start by default, or with the weather.

        Returns
        -------
        BegunPlant
            To be reset.

        Raises
        ------
        BoptestRequestError
            When the weather has no step of the plant after the start.
        """
        first, last = self.covered
        begin = float(np.floor(start / _MINUTE) * _MINUTE)
        if not first <= begin <= last - self.step:
            raise BoptestRequestError(
                f"Invalid value {start} for parameter start_time. It must be from {first:g} to {last - self.step:g} s "
                f"since the begin of {self.clock.year}, where there is weather: give a weather file for the whole year"
            )
        steps = int(min(warm_up, begin - first) // self.step)
        latest = min(begin + self.longest_days * DAY if end is None else end, last)
        whole = int((latest - begin) // self.step)
        stop = begin + whole * self.step
        return BegunPlant(self._plant(begin - steps * self.step, stop), begin, stop, steps)

    @cached_property
    def warmed(self) -> Callable[[float, int], list[tuple[Any, Trajectory]]]:
        """Where a plant after a warm-up is kept, with what was noted down of it, by its end and its steps."""
        return lru_cache(_WARM)(lambda start, steps: [])

    @cached_property
    def _driven(self) -> Callable[[float, float], tuple[Scenario, Operation]]:
        """Scenario of a time, a day longer for forecasts where there is weather, and its schedules."""

        def make(begin: float, end: float) -> tuple[Scenario, Operation]:
            steps = int((min(end + DAY, self.covered[1]) - begin) // self.step)
            scenario = build_scenario(
                self.building, StepGrid(self.clock.stamp(begin), self.step, steps), self.weather, self.tariff,
                carbon=self.carbon, occupancy=self.occupancy, comfort=self.comfort,
            )  # fmt: skip
            return scenario, scheduled_operation(scenario, len(self.system.air_handlers))

        return lru_cache(_KEPT)(make)

    def _plant(self, begin: float, end: float) -> ObservedPlant:
        scenario, operation = self._driven(begin, end)
        middles = scenario.grid.edges[:-1] + 0.5 * self.step
        beside: dict[str, float | FloatArray] = {}
        for name, series in self.boundaries.items():
            known = series.dropna()
            seconds = np.array([stamp.timestamp() for stamp in known.index])
            beside[name] = np.interp(middles, seconds, known.to_numpy(dtype=float))
        return ObservedPlant(
            scenario, self.system, self.make_model(), operation, noise=self.noise, warm_up_days=0, boundaries=beside
        )
