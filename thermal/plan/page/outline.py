"""Outline of a column: what a picture of it needs, however long the record."""

from typing import Any

import numpy as np
import pandas as pd

from thermal._types import FloatArray


def outline(values: pd.Series, parts: int, timezone: str = "UTC") -> dict[str, Any]:
    """Give the lowest and the highest value in equal parts of time: however long the record, each extreme is seen.

    Parameters
    ----------
    values : Series
        Numbers, tz-aware index.
    parts : int
        How many [-].
    timezone : str
        Of the stamps in the result.

    Returns
    -------
    dict
        ``start`` and ``end`` in ISO 8601; ``low`` and ``high`` by part, None where there is no value.

    Examples
    --------
    >>> hours = pd.date_range("2024-01-01", periods=4, freq="h", tz="UTC")
    >>> outline(pd.Series([1.0, 3.0, np.nan, np.nan], index=hours), 2)["high"]
    [3.0, None]
    """
    known = values[np.isfinite(values.to_numpy())]
    if not len(values):
        return {"start": None, "end": None, "low": [], "high": []}
    stamps = pd.DatetimeIndex(values.index)
    start, end = stamps.min(), stamps.max()
    share = (pd.DatetimeIndex(known.index) - start) / max(end - start, pd.Timedelta(1, "s"))
    part = np.minimum((share.to_numpy() * parts).astype(np.int64), parts - 1)
    low, high = np.full(parts, np.inf), np.full(parts, -np.inf)
    np.minimum.at(low, part, known.to_numpy())
    np.maximum.at(high, part, known.to_numpy())
    ends = {"start": start.tz_convert(timezone).isoformat(), "end": end.tz_convert(timezone).isoformat()}
    return {**ends, "low": _short(low), "high": _short(high)}


def _short(values: FloatArray) -> list[float | None]:
    """Numbers to five digits, which is more than a picture shows."""
    return [float(f"{value:.5g}") if np.isfinite(value) else None for value in values]
