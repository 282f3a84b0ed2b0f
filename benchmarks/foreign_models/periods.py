"""Two weeks of a weather file: the coldest or the hottest, and typical ones of that season."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from mpc.scenario.weather_files import read_epw
from thermal.case.points import OUTDOOR_TEMPERATURE

#: Length of a period and of the days before it under the building's own control [d].
DAYS, WARM_UP = 14, 7
_HEATED, _COOLED = 14.0, 18.33  # degC: mean of a day below which houses are heated, and above which they are cooled
_YEAR = 2023


def day_means(weather: Path) -> np.ndarray:
    """Mean outdoor temperature of each day of the year, shape (365,) [degC].

    Parameters
    ----------
    weather : Path
        An ``.epw`` file.
    """
    values = read_epw(weather).frame[OUTDOOR_TEMPERATURE].to_numpy(dtype=float)[: 365 * 24]
    return np.asarray(values.reshape(365, 24).mean(axis=1) - 273.15)


@cache
def starts(weather: Path, cooled: bool = False) -> dict[str, str]:
    """Begin of each period, ``coldest`` and ``typical``, or ``hottest`` and ``typical``.

    The typical one is that whose mean is nearest to the mean of all days below 14 degC, or above 18.33 degC, none of
    its days in the coldest or hottest period.

    Parameters
    ----------
    weather : Path
        An ``.epw`` file.
    cooled : bool
        Whether periods are those of summer.
    """
    means = day_means(weather)
    first, last = WARM_UP + 1, 365 - DAYS - 2
    of = np.array([means[k : k + DAYS].mean() for k in range(last)])
    candidates = np.arange(first, last)
    season, name = (means > _COOLED, "hottest") if cooled else (means < _HEATED, "coldest")
    most = int(candidates[np.argmax(of[candidates]) if cooled else np.argmin(of[candidates])])
    others = candidates[np.abs(candidates - most) >= DAYS]
    typical = int(others[np.argmin(np.abs(of[others] - means[season].mean()))])
    days = {name: most, "typical": typical}
    return {period: f"{pd.Timestamp(_YEAR, 1, 1) + pd.Timedelta(days=day):%Y-%m-%d}" for period, day in days.items()}
