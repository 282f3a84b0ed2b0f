"""Named series of a description: from tables, from what a unit brings, from a run ahead of a unit."""

import json
import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import make_interp_spline

from mpc.adapters.boptest.scenario import DAY, PERIOD_DAYS, WARM_UP_DAYS, YearClock
from mpc.adapters.fmu.unit import Unit
from mpc.errors import PlantError, ScenarioError
from mpc.scenario.grid import StepGrid, index_seconds, means_of_steps, require_cover
from thermal._types import FloatArray
from thermal.case.years import within_years
from thermal.errors import nearest

# A series is regular where so many of its steps are the usual one [-], and has a hole where one is longer than so many
# of it [-]: a tariff's changes, whose steps differ, may hold for weeks; an hourly table may lack a night.
_REGULAR, _HOLE = 0.9, 12.0


@dataclass(frozen=True, eq=False)
class NamedSeries:
    """Values by name over time.

    Parameters
    ----------
    where : str
        Where they come from, for messages.
    seconds : ndarray, shape (n_time,)
        Since 1970 in UTC, rising [s].
    values : mapping of str to ndarray
        By name, shape (n_time,) [their own units].
    units : mapping of str to str
        By name, of those whose unit is declared.
    """

    where: str
    seconds: FloatArray
    values: Mapping[str, FloatArray]
    units: Mapping[str, str] = field(default_factory=dict)

    def on(self, name: str, grid: StepGrid, *, lines: bool) -> FloatArray:
        """Average over the steps of a grid, shape (n_steps,) [unit of the series].

        Parameters
        ----------
        name : str
            Which series.
        grid : StepGrid
            Steps, within the series.
        lines : bool
            Whether values lie on straight lines, as weather in BOPTEST's tables, or hold until the next, as prices do.

        Raises
        ------
        ScenarioError
            When it does not cover the grid.
        PlantError
            When a value is missing, or rows of a regular series.
        """
        values, times, edges = self.values[name], self.seconds, grid.edges.astype(float)
        where = f"series {name} of {self.where}"
        bad = int((~np.isfinite(values)).sum())
        PlantError.unless(not bad, where, "a value at each time", f"{bad} missing of {len(values)}")
        usual = float(np.median(np.diff(times)))
        last = times[-1] if lines else times[-1] + usual
        _without_holes(times, usual, edges, where)
        require_cover(grid, float(times[0]), float(last), where, ScenarioError)
        if lines:
            integral = make_interp_spline(times - times[0], values, k=1).antiderivative()
            return np.asarray(np.diff(integral(edges - times[0])) / np.diff(edges))
        return means_of_steps(np.append(times, last), values, edges)


def _without_holes(times: FloatArray, usual: float, edges: FloatArray, where: str) -> None:
    """Refuse a hole within a grid, of a series that is regular elsewhere; one of changes only has none."""
    steps = np.diff(times)
    if (np.abs(steps - usual) < 1.0).mean() < _REGULAR:
        return
    holes = np.flatnonzero((steps > _HOLE * usual) & (times[:-1] < edges[-1]) & (times[1:] > edges[0]))
    if holes.size:
        stamp = pd.Timestamp(times[holes[0]], unit="s", tz="UTC")
        found = f"{steps[holes[0]] / 3600.0:.4g} h without after {stamp:%Y-%m-%d %H:%M} UTC"
        raise PlantError(where, f"rows every {usual:g} s", found, "repeat the value where it holds")


def read_table(path: Path, name: str, clock: YearClock) -> NamedSeries:
    """Read a table of a description's folder.

    Parameters
    ----------
    path : Path
        A ``.csv`` file with a column ``time`` in seconds of the year, or ``timestamp`` in ISO 8601, local where it has
        no offset.
    name : str
        Of the file, for messages.
    clock : YearClock
        Of the plant.

    Raises
    ------
    PlantError
        When it cannot be read, or has no such column of two or more rising times.
    """
    PlantError.unless(path.is_file(), f"series {name}", "a .csv file", "no such file")
    try:
        table = pd.read_csv(path, comment="#")
        header = pd.read_csv(path, comment="#", header=None, nrows=1, dtype=str).iloc[0]
    except (OSError, ValueError) as error:
        raise PlantError(f"series {name}", "a table of comma-separated values", str(error)) from error
    twice = header[header.duplicated()]
    PlantError.unless(twice.empty, f"series {name}", "a name of its own for each column", f"{[*twice]} again")
    return _series(table, name, clock)


def unit_tables(path: Path, clock: YearClock) -> list[NamedSeries]:
    """Read the tables that a unit of BOPTEST brings, by seconds of the year.

    Parameters
    ----------
    path : Path
        The unit.
    clock : YearClock
        Of the plant.

    Raises
    ------
    PlantError
        When it brings none.
    """
    left_out = unit_notes(path, "config").get("resource_file_exclusion", [])
    found = []
    with zipfile.ZipFile(path) as unit:
        for name in unit.namelist():
            file = name.removeprefix("resources/")
            if name.startswith("resources/") and name.endswith(".csv") and file not in left_out:
                with unit.open(name) as content:
                    table = pd.read_csv(content, comment="#")
                if "time" in table:
                    found.append(_series(table, f"{path.name}: {file}", clock))
    advice = "name a .csv file in `series`, or `outputs`"
    PlantError.unless(found, f"series unit: {path.name}", "tables in its resources, as BOPTEST's units", "none", advice)
    return found


def unit_notes(path: Path, name: str) -> dict[str, Any]:
    """Read one of the JSON files that a unit of BOPTEST brings; empty where it does not.

    Parameters
    ----------
    path : Path
        The unit.
    name : str
        ``days``, ``config`` or ``kpis``.
    """
    try:
        with zipfile.ZipFile(path) as unit:
            return dict(json.loads(unit.read(f"resources/{name}.json")))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile):
        return {}


def unit_period(path: Path, name: str) -> tuple[float, float, float]:
    """Tell when a time period of a unit of BOPTEST is: two weeks, the second of which begins with its day.

    Parameters
    ----------
    path : Path
        The unit.
    name : str
        Such as ``peak_heat_day``.

    Returns
    -------
    tuple of float
        Start in seconds of the year, length and warm-up [s].

    Raises
    ------
    PlantError
        When the unit names no such period.
    """
    days = unit_notes(path, "days")
    advice = nearest(name, days) if days else "give the start and the days"
    PlantError.unless(name in days, "period", f"one that {path.name} names in resources/days.json", repr(name), advice)
    start = (float(days[name]) - PERIOD_DAYS / 2) * DAY
    return start, PERIOD_DAYS * DAY, min(WARM_UP_DAYS * DAY, max(start, 0.0))


def run_ahead(
    unit: Unit, names: Iterable[str], grid: StepGrid, clock: YearClock, step: float, values: Mapping[str, float]
) -> NamedSeries:
    """Run a unit once over a grid under its own control and note down what its variables say.

    Parameters
    ----------
    unit : Unit
        It is begun anew, and ended.
    names : iterable of str
        Of variables that no action changes, such as the weather.
    grid : StepGrid
        Steps.
    clock : YearClock
        Of the unit.
    step : float
        Time between two readings [s], a part of the grid's step.
    values : mapping of str to float
        Of parameters and inputs [their declared units].
    """
    listed, start, count = list(names), clock.time(float(grid.edges[0])), round(grid.n_steps * grid.step / step)
    unit.start(start, values, step)
    rows = [unit.get(listed)]
    for k in range(count):
        unit.step(start + k * step, step)
        rows.append(unit.get(listed))
    unit.end()
    columns = {name: np.array([row[name] for row in rows]) for name in listed}
    declared = {name: unit.declared(unit.variables[name], "unit") for name in listed}
    units = {name: told for name, told in declared.items() if told}
    return NamedSeries(f"outputs of {unit.name}", grid.edges[0] + step * np.arange(count + 1.0), columns, units)


def _stamps(texts: pd.Series, timezone: str) -> pd.DatetimeIndex:
    """Read stamps in ISO 8601, local ones where they have no offset."""
    with_offset = texts.str.contains(r"[T ]\d.*(?:Z|[+-]\d\d(?::?\d\d)?)\s*$")
    if with_offset.any():  # over a change of clocks they differ
        stamps = pd.DatetimeIndex(pd.to_datetime(texts, format="ISO8601", utc=True))
    else:
        naive = pd.DatetimeIndex(pd.to_datetime(texts, format="ISO8601"))
        stamps = naive.tz_localize(timezone, ambiguous="infer")
    bad = np.flatnonzero(~within_years(stamps))
    if bad.size:
        raise ValueError(f"{texts.iloc[bad[0]]!r} in row {bad[0] + 1}")
    return stamps


def _series(table: pd.DataFrame, name: str, clock: YearClock) -> NamedSeries:
    column = next((c for c in ("timestamp", "time") if c in table), None)
    if column is None:
        raise PlantError(f"series {name}", "a column 'time' [s of the year] or 'timestamp'", str([*table][:6]))
    try:
        if column == "time":
            seconds = clock.zero + table["time"].to_numpy(dtype=float)
        else:
            seconds = index_seconds(_stamps(table["timestamp"].astype(str), clock.timezone)).astype(float)
    except (TypeError, ValueError) as error:
        advice = "write offsets or UTC, such as 2023-10-29 02:30+01:00" if column == "timestamp" else ""
        raise PlantError(f"series {name}: column {column!r}", "times", " ".join(str(error).split()), advice) from error
    last = np.append(np.diff(seconds) != 0.0, True)  # of equal times: what holds from then on
    rising = last.sum() > 1 and bool((np.diff(seconds[last]) > 0.0).all())
    PlantError.unless(rising, f"series {name}: column {column!r}", "two or more rising times", f"{len(seconds)} others")
    numbers = table.drop(columns=column).apply(pd.to_numeric, errors="coerce")
    return NamedSeries(name, seconds[last], {str(c): numbers[c].to_numpy(dtype=float)[last] for c in numbers})
