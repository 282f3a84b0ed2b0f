"""BOPTEST's scenarios: the clock of a year, the time periods of a served building, and three electricity prices."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mpc.scenario.grid import StepGrid
from mpc.scenario.rates import ConstantRate, Rate, SeriesRate
from thermal._types import FloatArray

#: Length of a day [s].
DAY = 86_400.0

#: Length of a period and of the warm-up before it, BOPTEST's [d].
PERIOD_DAYS, WARM_UP_DAYS = 14, 7

#: Days whose mean is below or above these are days of heating or of cooling [K]: bases of degree days, 15 degC as in
#: Eurostat's definition, 18.3 degC (65 degF) as in ASHRAE's.
HEATING_BASE, COOLING_BASE = 288.15, 291.48

#: Names that a scenario's ``electricity_price`` takes, and the forecast point of each.
PRICE_POINTS: Mapping[str, str] = {
    "constant": "PriceElectricPowerConstant",
    "dynamic": "PriceElectricPowerDynamic",
    "highly_dynamic": "PriceElectricPowerHighlyDynamic",
}

# Shape of a day of a day-ahead market with much sun: a morning and a higher evening peak, a trough at noon. Assumed, of
# the form that such markets have; its mean is 1.
_MORNING = (0.82, 0.78, 0.76, 0.76, 0.80, 0.92, 1.12, 1.30, 1.28, 1.12, 0.94, 0.80)
_EVENING = (0.72, 0.68, 0.70, 0.80, 0.98, 1.26, 1.52, 1.56, 1.38, 1.16, 0.96, 0.88)
_SHAPE = np.array((*_MORNING, *_EVENING)) / np.mean((*_MORNING, *_EVENING))
_SPREAD = 0.35  # standard deviation of a day's logarithm, assumed
_STREAM = 21  # of random numbers, apart from those of plants


@dataclass(frozen=True)
class YearClock:
    """Seconds of a year: 0 is the local midnight that it begins with, and no clock is ever put forward or back.

    Parameters
    ----------
    year : int
        Which year begins at 0.
    timezone : str
        IANA name of the building's time zone.

    Examples
    --------
    >>> clock = YearClock(2023, "America/Los_Angeles")
    >>> clock.stamp(200 * 86_400.0).isoformat()  # in summer an hour from midnight
    '2023-07-20T01:00:00-07:00'
    """

    year: int
    timezone: str

    @cached_property
    def zero(self) -> int:
        """The begin of the year, since 1970 in UTC [s]."""
        return int(pd.Timestamp(self.year, 1, 1).tz_localize(self.timezone).timestamp())

    def time(self, seconds: float) -> float:
        """Tell BOPTEST's time [s].

        Parameters
        ----------
        seconds : float
            Since 1970 in UTC [s].
        """
        return float(seconds - self.zero)

    def stamp(self, time: float) -> pd.Timestamp:
        """Tell the local time.

        Parameters
        ----------
        time : float
            BOPTEST's [s]; whole seconds count.
        """
        return pd.Timestamp(self.zero + round(time), unit="s", tz="UTC").tz_convert(self.timezone)


class Period(NamedTuple):
    """A period that a test runs over.

    Parameters
    ----------
    start, end : float
        BOPTEST's time [s].
    warm_up : float
        Time before the start that is run to forget how it began [s].
    """

    start: float
    end: float
    warm_up: float


def find_periods(first: float, daily: FloatArray) -> dict[str, Period]:
    """Choose the periods that BOPTEST's scenarios name, as far as the weather has such days.

    BOPTEST takes the days of the largest and of the median load. Here the outdoor temperature stands for the load: the
    coldest day and the median of all days of heating, the warmest day and the median of all days of cooling, and the
    day nearest to the middle of both bases. A period has a week on both sides of the beginning of its day, moved to
    where there is weather for it, for a day of warm-up before it and for a day of forecast after it.

    Parameters
    ----------
    first : float
        BOPTEST's time at which the first whole day begins [s].
    daily : ndarray, shape (n_day,)
        Means of the outdoor temperature, a day each, at least 3 [K]; NaN is unknown.

    Returns
    -------
    dict of str to Period
        By BOPTEST's names.
    """
    heating, cooling = np.flatnonzero(daily < HEATING_BASE), np.flatnonzero(daily > COOLING_BASE)
    days: dict[str, int] = {}
    if heating.size:
        days["peak_heat_day"] = int(heating[np.argmin(daily[heating])])
        days["typical_heat_day"] = _median_day(daily, heating)
    if cooling.size:
        days["peak_cool_day"] = int(cooling[np.argmax(daily[cooling])])
        days["typical_cool_day"] = _median_day(daily, cooling)
    days["mix_day"] = int(np.nanargmin(np.abs(daily - 0.5 * (HEATING_BASE + COOLING_BASE))))
    length = min(PERIOD_DAYS, daily.size - 2)
    periods = {}
    for name, day in days.items():
        start = min(max(day - length // 2, 1), daily.size - 1 - length)
        begin = first + start * DAY
        periods[name] = Period(begin, begin + length * DAY, min(WARM_UP_DAYS, start) * DAY)
    return periods


def _median_day(daily: FloatArray, days: NDArray[np.int64]) -> int:
    """Day that is nearest to the median of some days."""
    return int(days[np.argmin(np.abs(daily[days] - np.median(daily[days])))])


@dataclass(frozen=True, eq=False)
class MarketRate:
    """A price that changes every hour and from day to day, as on a day-ahead market; assumed, not measured.

    Each day has the same shape times a factor of its own, drawn from its date alone.

    Parameters
    ----------
    mean : float
        Its mean over many days [currency/kWh].
    """

    mean: float

    def on(self, grid: StepGrid) -> np.ndarray:
        """Average over each step of a grid, shape (n_steps,) [per kWh].

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        """
        zone = grid.start.tz
        first = grid.start.tz_localize(None).normalize() - pd.Timedelta(days=1)
        last = grid.stamps[-1].tz_localize(None).normalize() + pd.Timedelta(days=2)
        start, end = first.tz_localize(zone), last.tz_localize(zone)
        hours = pd.date_range(start, end, freq="h", inclusive="left")
        factors = {day: self._factor(day) for day in {stamp.toordinal() for stamp in hours.date}}
        values = [self.mean * _SHAPE[s.hour] * factors[s.toordinal()] for s in hours]
        return SeriesRate(pd.Series(values, index=hours), "start").on(grid)

    def _factor(self, day: int) -> float:
        draw = np.random.default_rng([_STREAM, day]).standard_normal()
        return float(np.exp(_SPREAD * draw - 0.5 * _SPREAD**2))


def scenario_prices(electricity: Rate, year: StepGrid) -> dict[str, Rate]:
    """Make the prices of BOPTEST's scenarios.

    Parameters
    ----------
    electricity : Rate
        The building's, which is the dynamic one.
    year : StepGrid
        What the constant price is the mean over.

    Returns
    -------
    dict of str to Rate
        ``constant``: its mean; ``dynamic``: the tariff itself; ``highly_dynamic``: an assumed market of the same mean.
    """
    mean = float(electricity.on(year).mean())
    return {"constant": ConstantRate(mean), "dynamic": electricity, "highly_dynamic": MarketRate(mean)}
