"""A building that is served: everything that a test of it is made of, shared by all its tests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from mpc.adapters.boptest.clock import DAY, YearClock
from mpc.adapters.boptest.periods import Period, find_periods
from mpc.adapters.boptest.prices import scenario_prices
from mpc.adapters.boptest.recent import Recent
from mpc.adapters.boptest.signals import ObservedPlant, PlantSignals
from mpc.adapters.boptest.trajectory import Trajectory
from mpc.errors import BoptestRequestError, PlantError
from mpc.loop.building import BuildingModel
from mpc.loop.noise import SensorNoise
from mpc.loop.operation import Operation, scheduled_operation
from mpc.scenario.carbon import CarbonIntensity
from mpc.scenario.comfort import ComfortBand
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import Occupancy
from mpc.scenario.paper import paper_carbon, paper_tariff
from mpc.scenario.rates import Rate
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import Tariff
from mpc.scenario.weather import Weather
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.errors import describe
from thermal.system.system import HvacSystem

_MINUTE = 60.0
_KEPT, _WARM = 8, 4  # scenarios and warm-ups that are kept, so that tests of one period share theirs


class _Driven(NamedTuple):
    """What drives a plant: its scenario, and the schedules that follow from it."""

    scenario: Scenario
    operation: Operation


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
    _driven: Recent[tuple[float, float], _Driven] = field(default_factory=lambda: Recent(_KEPT), init=False)
    #: Plants after a warm-up, with what was noted down of it, by its end and its steps.
    warmed: Recent[tuple[float, int], tuple[Any, Trajectory]] = field(default_factory=lambda: Recent(_WARM), init=False)

    def __post_init__(self) -> None:
        if not (self.step >= _MINUTE and (self.step / _MINUTE).is_integer()):
            raise PlantError(describe("step", "a whole number of minutes, in seconds", repr(self.step)))
        if not self.longest_days > 0:
            raise PlantError(describe("longest_days", "more than 0", repr(self.longest_days)))
        if len(self.daily) < 3:
            raise PlantError(describe("weather", "three whole days at least", f"{len(self.daily)}"))

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
        return PlantSignals(self._plant(self._driven_by(first, first + DAY)))

    @cached_property
    def weather_points(self) -> frozenset[str]:
        """Points of the weather station that are known at any time."""
        frame = self.weather.frame
        return frozenset(str(point) for point in frame if frame[point].notna().any())

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
        driven = self._driven_by(begin - steps * self.step, begin + whole * self.step)
        return BegunPlant(self._plant(driven), begin, begin + whole * self.step, steps)

    def _driven_by(self, begin: float, end: float) -> _Driven:
        """Make what drives the plant over a time, and a day longer for forecasts where there is weather."""
        found = self._driven.get((begin, end))
        if found is None:
            steps = int((min(end + DAY, self.covered[1]) - begin) // self.step)
            scenario = build_scenario(
                self.building, StepGrid(self.clock.stamp(begin), self.step, steps), self.weather, self.tariff,
                carbon=self.carbon, occupancy=self.occupancy, comfort=self.comfort,
            )  # fmt: skip
            found = _Driven(scenario, scheduled_operation(scenario, len(self.system.air_handlers)))
            self._driven.put((begin, end), found)
        return found

    def _plant(self, driven: _Driven) -> ObservedPlant:
        middles = driven.scenario.grid.edges[:-1] + 0.5 * self.step
        beside: dict[str, float | FloatArray] = {}
        for name, series in self.boundaries.items():
            known = series.dropna()
            seconds = np.array([stamp.timestamp() for stamp in known.index])
            beside[name] = np.interp(middles, seconds, known.to_numpy(dtype=float))
        return ObservedPlant(
            driven.scenario, self.system, self.make_model(), driven.operation, noise=self.noise, warm_up_days=0,
            boundaries=beside,
        )  # fmt: skip
