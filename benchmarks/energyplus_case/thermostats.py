"""Seeded set points: unequal zones, night set-back, own morning hours, a few random changes."""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import pandas as pd


@dataclass(frozen=True)
class Thermostat:
    """One zone's day.

    Parameters
    ----------
    heating, setback : float
        Heating set point by day and by night [degC].
    cooling, cooling_night : float
        Cooling set point by day and by night [degC].
    start, end : float
        The day, hours of standard time, 0 to 24 [h].
    """

    heating: float
    setback: float
    cooling: float
    cooling_night: float
    start: float
    end: float


THERMOSTATS = MappingProxyType(
    {
        "F1_N": Thermostat(21.6, 17.8, 24.0, 26.5, 6.0, 19.0),
        "F1_W": Thermostat(20.4, 16.8, 22.8, 26.0, 7.25, 20.0),
        "F1_C": Thermostat(21.2, 18.6, 23.6, 26.0, 5.5, 18.0),
        "F1_E": Thermostat(22.2, 17.6, 24.4, 27.0, 6.5, 17.5),
        "F1_S": Thermostat(20.0, 16.5, 22.2, 25.5, 7.75, 18.5),
    }
)
CHANGES_PER_DAY = 2.0  # mean number of random changes a zone and day
OFFSETS = (-1.5, -1.0, 1.0, 1.5)  # [K], on both set points
HOURS = (2.0, 5.0)  # [h], shortest and longest change


def setpoints(index: pd.DatetimeIndex, seed: int) -> pd.DataFrame:
    """Return heating and cooling set points [degC], columns (zone, `heating` or `cooling`).

    Parameters
    ----------
    index : DatetimeIndex, shape (n_time,)
        Starts of the intervals, standard time, one regular step.
    seed : int
        Of the random changes, at least 0.
    """
    rng = np.random.default_rng([seed, 1])
    hour = (index.hour + index.minute / 60.0).to_numpy()
    step = (index[1] - index[0]) / pd.Timedelta(hours=1)
    columns: dict[tuple[str, str], np.ndarray] = {}
    for zone, thermostat in THERMOSTATS.items():
        day = (hour >= thermostat.start) & (hour < thermostat.end)
        offset = np.zeros(len(index))
        for first in np.sort(rng.choice(len(index), round(CHANGES_PER_DAY * len(index) * step / 24.0), replace=False)):
            length = round(rng.uniform(*HOURS) / step)
            offset[first : first + length] = rng.choice(OFFSETS)
        columns[zone, "heating"] = np.where(day, thermostat.heating, thermostat.setback) + offset
        columns[zone, "cooling"] = np.where(day, thermostat.cooling, thermostat.cooling_night) + offset
    return pd.DataFrame(columns, index=index)
