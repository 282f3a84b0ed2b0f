"""Forecasts of a BOPTEST server as forecasts of ours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd

from mpc.adapters.boptest.forecast import WEATHER_NAMES
from mpc.adapters.boptest.mapping import BoptestSignals
from mpc.adapters.boptest.prices import PRICE_POINTS
from mpc.errors import BoptestError
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.errors import describe

_ZONE_COLUMNS = {
    "LowerSetp": "comfort_lower_temperature",
    "UpperSetp": "comfort_upper_temperature",
    "Occupancy": "occupancy_count_sensor",
    "InternalGainsCon": "internal_gain",
}
_SINGLE = {
    "PriceGasPower": "gas_price",
    "EmissionsElectricPower": "electricity_carbon_intensity",
    "EmissionsGasPower": "gas_carbon_intensity",
}


class _Source(NamedTuple):
    """Where a column of a forecast comes from.

    Parameters
    ----------
    point : str
        Forecast point of the server.
    divisor : float
        Of its values, from the server's unit to the library's [unit of the point per library's unit].
    weather : bool
        Whether it changes between its values rather than holding them.
    """

    point: str
    divisor: float
    weather: bool


def forecast_sources(known: Mapping[str, object], signals: BoptestSignals, price: str) -> dict[str, _Source]:
    """Choose the forecast points of each column.

    Parameters
    ----------
    known : mapping
        Forecast points that the server has.
    signals : BoptestSignals
        Of the test case.
    price : str
        Which electricity price holds.
    """
    found = {point: _Source(name, factor, True) for name, (_, point, factor, _) in WEATHER_NAMES.items()}
    found["electricity_price"] = _Source(PRICE_POINTS[price], 1.0, False)
    found |= {column: _Source(name, 1.0, False) for name, column in _SINGLE.items()}
    for zone in signals.zones:
        index = signals.forecast_zones.get(zone, zone)
        found |= {f"{zone}/{column}": _Source(f"{n}[{index}]", 1.0, False) for n, column in _ZONE_COLUMNS.items()}
    return {column: source for column, source in found.items() if source.point in known}


def as_forecast(payload: object, sources: Mapping[str, _Source], stamps: pd.DatetimeIndex, *, means: bool) -> Forecast:
    """Make a forecast of what a server answered.

    Parameters
    ----------
    payload : object
        Lists of numbers by point, one more than there are stamps.
    sources : mapping of str to _Source
        By column.
    stamps : DatetimeIndex
        Ends of the steps.
    means : bool
        Whether values are means from their time on, rather than readings at it.

    Raises
    ------
    BoptestError
        When a point is missing or of another length.
    """
    count, columns = len(stamps), {}
    for column, source in sources.items():
        listed = payload.get(source.point) if isinstance(payload, dict) else None
        if not isinstance(listed, list) or len(listed) != count + 1:
            found = f"{len(listed)}" if isinstance(listed, list) else "none"
            raise BoptestError(describe(f"forecast point {source.point}", f"{count + 1} values", found))
        values: FloatArray = np.array(listed, dtype=float) / source.divisor  # null becomes NaN
        columns[column] = 0.5 * (values[:-1] + values[1:]) if source.weather and not means else values[:-1]
    return Forecast(pd.DataFrame(columns, index=stamps))
