"""What the controller's logs say of the time before: the plans on record, and the past that a new process is told."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from mpc.errors import LiveError
from mpc.live.audit import log_files, log_lines

#: How far back is looked [s]: walls and slabs remember a day or two.
SPAN = 2 * 86400.0


def plans_on_record(
    folder: Path, *, newest_first: bool = False
) -> Iterator[tuple[float, dict[str, Any], dict[str, Any], dict[str, float | None]]]:
    """Read the plans in the controller's logs; what cannot be read is left out: the log is not judged here.

    Parameters
    ----------
    folder : Path
        Of the logs.
    newest_first : bool
        Whether the last plan comes first. Default: the first.

    Yields
    ------
    tuple
        Begin of the step that was planned [s], the inputs, the plan, and what was forecast for that step by column,
        empty where there was no forecast.
    """
    files = log_files(folder, "controller")
    for path in reversed(files) if newest_first else files:
        try:
            lines = log_lines(path)
        except LiveError:
            continue
        for line in reversed(lines) if newest_first else lines:
            if b'"kind":"plan"' not in line:
                continue
            try:
                content = json.loads(line)["content"]
                inputs, plan = content["inputs"], content["plan"]
                begin, forecast = float(inputs["begin"]), inputs["forecast"] or {"columns": [], "values": []}
                first = {n: values[0] for n, values in zip(forecast["columns"], forecast["values"], strict=True)}
            except (ValueError, KeyError, TypeError, IndexError):
                continue
            yield begin, inputs, plan, first


def recent_past(folder: Path, begin: float, columns: Sequence[str]) -> list[dict[str, Any]]:
    """Read the inputs of the last plans from the controller's logs, oldest first.

    Parameters
    ----------
    folder : Path
        Of the logs.
    begin : float
        Begin of the step that is to be planned [s].
    columns : sequence of str
        Measurements that count.

    Returns
    -------
    list of dict
        ``begin`` [s], ``means`` of the step before it by column, and ``ahead``: what was forecast for the step after
        it, by column.
    """
    wanted, found = set(columns), dict[float, dict[str, Any]]()
    for at, inputs, _, first in plans_on_record(folder, newest_first=True):
        if at < begin - SPAN:
            break
        if at < begin:
            means = {name: value for name, value in (inputs.get("means") or {}).items() if name in wanted}
            ahead = {name: value for name, value in first.items() if "comfort" not in name and "price" not in name}
            found.setdefault(at, {"begin": at, "means": means, "ahead": ahead})
    return [found[t] for t in sorted(found)]


def past_table(
    past: Sequence[Mapping[str, Any]], begin: float, step: float, timezone: str, station: str
) -> pd.DataFrame:
    """Lay the past out as telemetry, a row a control step up to the one before the last.

    Parameters
    ----------
    past : sequence of mapping
        Of `recent_past`, one at least.
    begin : float
        Begin of the step that is to be planned [s]; the plan itself takes in the step before it.
    step : float
        Control step [s].
    timezone : str
        Of the building.
    station : str
        Name of the weather station, whose forecasts stand where it measured nothing.

    Returns
    -------
    DataFrame, shape (n_time, n_column)
        Means over the steps that end at the stamps, by ``ENTITY/POINT``; NaN where nothing is known.
    """
    rows: dict[float, dict[str, float]] = {}
    for one in past:
        rows.setdefault(one["begin"], {}).update({k: v for k, v in one["means"].items() if v is not None})
        ends = rows.setdefault(one["begin"] + step, {})
        for name, value in one["ahead"].items():
            ends.setdefault(name if "/" in name else f"{station}/{name}", math.nan if value is None else value)
    known = sorted(time for time in rows if time < begin)
    index = pd.to_datetime(known, unit="s", utc=True).tz_convert(timezone)
    table = pd.DataFrame([rows[time] for time in known], index=pd.DatetimeIndex(index), dtype=float)
    length = pd.Timedelta(seconds=step)
    last = pd.Timestamp(begin, unit="s", tz="UTC").tz_convert(timezone) - length
    return table.reindex(pd.date_range(table.index[0], last, freq=length, name="timestamp"))
