"""The time periods of a served building: weeks around its coldest, its warmest and its usual days."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mpc.adapters.boptest.clock import DAY
from thermal._types import FloatArray

#: Length of a period and of the warm-up before it, BOPTEST's [d].
PERIOD_DAYS, WARM_UP_DAYS = 14, 7

#: Days whose mean is below or above these are days of heating or of cooling [K]: bases of degree days, 15 degC as in
#: Eurostat's definition, 18.3 degC (65 degF) as in ASHRAE's.
HEATING_BASE, COOLING_BASE = 288.15, 291.48


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
