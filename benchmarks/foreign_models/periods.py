"""Two weeks of a weather file: the coldest, and typical ones of the heating season."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from mpc.scenario.weather_files import read_epw
from thermal.case.points import OUTDOOR_TEMPERATURE

#: Length of a period and of the days before it under the building's own control [d].
DAYS, WARM_UP = 14, 7
_BASE = 14.0  # degC: mean of a day below which houses are heated
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
def starts(weather: Path) -> dict[str, str]:
    """Begin of each period, ``coldest`` and ``typical``.

    The typical one is that whose mean is nearest to the mean of all days below 14 degC, none of its days in the
    coldest period.

    Parameters
    ----------
    weather : Path
        An ``.epw`` file.
    """
    means = day_means(weather)
    first, last = WARM_UP + 1, 365 - DAYS - 2
    of = np.array([means[k : k + DAYS].mean() for k in range(last)])
    candidates = np.arange(first, last)
    coldest = int(candidates[np.argmin(of[candidates])])
    others = candidates[np.abs(candidates - coldest) >= DAYS]
    typical = int(others[np.argmin(np.abs(of[others] - means[means < _BASE].mean()))])
    days = {"coldest": coldest, "typical": typical}
    return {name: f"{pd.Timestamp(_YEAR, 1, 1) + pd.Timedelta(days=day):%Y-%m-%d}" for name, day in days.items()}
