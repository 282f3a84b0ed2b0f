"""A highly dynamic price of electricity by the hour, drawn from a seed: wholesale with two peaks a day, and a fee."""

from __future__ import annotations

import numpy as np
import pandas as pd

#: What is chosen so that mean and spread are those of day-ahead markets in a year of usual prices, in EUR/kWh.
FEE, MEAN, SPREAD = 0.13, 0.10, 0.03
# Of the day's shape, by local hour: low at night and at noon, peaks in the morning and the evening [-].
_SHAPE = np.array([-1.0, -1.1, -1.2, -1.2, -1.1, -0.7, 0.1, 0.9, 1.2, 0.9, 0.5, 0.2, 0.0, -0.2, -0.2, 0.0, 0.5, 1.2,
                   1.7, 1.5, 0.9, 0.3, -0.2, -0.6])  # fmt: skip
_KEEP = 0.93  # of a deviation is left after an hour: a day and a half of wind
_DEVIATION = 0.03  # EUR/kWh, standard deviation of what is not the day's shape
_WEEKEND = -0.015  # EUR/kWh
_FLOOR = -0.02  # EUR/kWh, of the wholesale price
_YEAR = 2023


def dynamic_prices(timezone: str, seed: int = 20) -> pd.DataFrame:
    """Draw a year of hourly prices and two days of the next.

    Parameters
    ----------
    timezone : str
        Of the plant, without summer time.
    seed : int
        Of the draw.

    Returns
    -------
    DataFrame, shape (8808, 2)
        Columns ``timestamp`` and ``dynamic`` [EUR/kWh].
    """
    stamps = pd.date_range(f"{_YEAR}-01-01", periods=8760 + 48, freq="h", tz=timezone)
    draw = np.random.default_rng(seed).normal(size=len(stamps)) * _DEVIATION * np.sqrt(1.0 - _KEEP**2)
    wind = np.zeros(len(stamps))
    for k in range(1, len(stamps)):
        wind[k] = _KEEP * wind[k - 1] + draw[k]
    wholesale = MEAN + SPREAD * _SHAPE[stamps.hour] + wind + _WEEKEND * (stamps.day_of_week >= 5)
    price = FEE + np.maximum(wholesale, _FLOOR)
    return pd.DataFrame({"timestamp": [s.isoformat() for s in stamps], "dynamic": np.round(price, 5)})
