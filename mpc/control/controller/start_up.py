"""What a controller makes of telemetry from before its first step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from mpc.control.controller.reading import SitePoints
from mpc.errors import ControlError
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.errors import describe


class _PastStep(NamedTuple):
    """A control step that has gone.

    Parameters
    ----------
    stamp : pandas.Timestamp
        Its end.
    measured : dict of str to float
        Means by ``ENTITY/POINT`` [library's units].
    outdoor : float
        Its temperature, the last that was measured [K].
    gains : ndarray, shape (n_zone,)
        Heat of people, lights and equipment as far as it was expected [W].
    """

    stamp: pd.Timestamp
    measured: dict[str, float]
    outdoor: float
    gains: FloatArray


def past_steps(telemetry: pd.DataFrame, points: SitePoints, control_step: float) -> list[_PastStep]:
    """Cut telemetry into control steps, the last of which ends with it.

    Parameters
    ----------
    telemetry : DataFrame, shape (n_time, n_column)
        Means over the steps that end at its stamps.
    points : SitePoints
        Names of zones and weather station.
    control_step : float
        [s].

    Raises
    ------
    ControlError
        When stamps have no time zone or do not rise, there is less than a control step, or no outdoor temperature.
    """
    index = telemetry.index
    if not isinstance(index, pd.DatetimeIndex) or index.tz is None or not index.is_monotonic_increasing:
        raise ControlError(describe("start-up: telemetry", "stamps with a time zone that rise", f"{index.dtype}"))
    length = pd.Timedelta(seconds=control_step)
    step = index[1] - index[0] if len(index) > 1 else length
    if not len(index) or step > length or index[-1] - index[0] + step < length:
        raise ControlError(describe("start-up: telemetry", f"a control step, {length}, or more", f"{len(index)} rows"))
    means = telemetry.resample(length, closed="right", label="right", origin=index[-1]).mean()
    outdoor = (
        means.reindex(columns=[f"{points.weather_station}/{OUTDOOR_TEMPERATURE}"]).ffill().bfill().to_numpy()[:, 0]
    )
    if np.isnan(outdoor).any():
        raise ControlError(
            describe("start-up: telemetry", "an outdoor temperature", "none", str(points.weather_station))
        )
    gains = means.reindex(columns=[f"{zone}/internal_gain" for zone in points.zones]).fillna(0.0).to_numpy()
    rows = zip(means.index, means.to_dict("records"), outdoor, gains, strict=True)
    return [_PastStep(stamp, {str(k): v for k, v in row.items()}, float(air), heat) for stamp, row, air, heat in rows]


def past_forecast(telemetry: pd.DataFrame, points: SitePoints) -> Forecast:
    """Take what signals of effects are made of from telemetry: the weather, and who was in which zone.

    Parameters
    ----------
    telemetry : DataFrame
        By ``ENTITY/POINT`` [library's units].
    points : SitePoints
        Names of the weather station and the zones.
    """
    station = f"{points.weather_station}/"
    weather = {column: column.removeprefix(station) for column in map(str, telemetry) if column.startswith(station)}
    people = [f"{zone}/occupancy_count_sensor" for zone in points.zones]
    return Forecast(telemetry[[*weather, *(c for c in people if c in telemetry)]].rename(columns=weather))
