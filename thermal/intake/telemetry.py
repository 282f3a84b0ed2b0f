"""Telemetry of a building from any table: columns matched, units converted, regular steps; nothing lost in silence."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.case.points import POINT_TYPES, point_type
from thermal.case.telemetry import INDEX, LONGEST_STEP, Telemetry
from thermal.case.validation import check_columns
from thermal.errors import CaseError, PlanError
from thermal.intake.resample import counter_means, step_means, usual_interval
from thermal.intake.series import RawSeries, read_series, split_unit
from thermal.intake.source import shown
from thermal.intake.stamps import ClockReport
from thermal.plan.devices import words_of
from thermal.plan.guard import vocabulary
from thermal.plan.match import PointMatch, match_points
from thermal.units import QUANTITIES, check_unit, to_si

#: Shortest step of telemetry [s].
SHORTEST_STEP = 60.0

#: Steps that a clock of its own is brought to [s].
USUAL_STEPS = (60, 120, 300, 600, 900, 1200, 1800, 3600, 7200)

#: Words of columns that tell of heat.
HEAT_WORDS = frozenset({"heating", "cooling", "power", "energy", "gas", "flowrate", "kwh", "mwh", "boiler", "radiator"})

#: Most rows of an import: a year of minutes has half a million.
MOST_STEPS = 5_000_000


@dataclass(frozen=True)
class ImportSettings:
    """How a table is read.

    Parameters
    ----------
    table
        Sheet of a workbook, table of a database or query.
    timezone
        IANA name of the time zone of stamps without an offset; empty: they must have one.
    step
        Length of the steps [s], 60 to 7200; None: the table's own.
    units
        Unit in the table by point type; of energy or volume where it has readings of a counter.
    """

    table: str = ""
    timezone: str = ""
    step: float | None = None
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class TelemetryImport:
    """Telemetry of a building, and what became of the table that it is from.

    Parameters
    ----------
    telemetry
        In the library's units, on regular steps.
    matches
        What each column was taken for.
    remarks
        What was done to values and stamps, one sentence each.
    unmatched_heat
        Columns that tell of heat and are not in the telemetry.
    aside
        Values of all columns that are not: ``timestamp``, ``column``, ``value``.
    """

    telemetry: Telemetry
    matches: tuple[PointMatch, ...]
    remarks: tuple[str, ...]
    unmatched_heat: tuple[str, ...]
    aside: pd.DataFrame


def import_telemetry(
    building: Building,
    source: str,
    settings: ImportSettings | None = None,
    matches: Sequence[PointMatch] | None = None,
) -> TelemetryImport:
    """Make telemetry of a building from a table of any kind.

    Parameters
    ----------
    building : Building
        Whose zones and devices the columns are of.
    source : str
        Path of a Parquet, CSV or Excel file, or address of a PostgreSQL database.
    settings : ImportSettings, optional
        How it is read.
    matches : sequence of PointMatch, optional
        What columns are, corrected by a person; default: matched by name.

    Returns
    -------
    TelemetryImport
        Telemetry, and all that was done.

    Raises
    ------
    PlanError
        The table cannot be read, lacks a column of `matches`, no column is matched, or two are for the same point.
    CaseError
        A unit does not measure its point, an entity is none of the building's, or the steps are out of range.
    """
    given = settings or ImportSettings()
    series, clock = read_series(source, given.table, given.timezone)
    listed = tuple(matches) if matches is not None else match_series(building, series)
    return telemetry_of_series(building, series, clock, given, listed, shown(source))


def telemetry_of_series(
    building: Building,
    series: Mapping[str, RawSeries],
    clock: ClockReport,
    settings: ImportSettings,
    matches: Sequence[PointMatch],
    where: str,
) -> TelemetryImport:
    """Make telemetry of a building from the columns of a table that is read already.

    Parameters
    ----------
    building : Building
        Whose zones and devices the columns are of.
    series : mapping of str to RawSeries
        By name of the column.
    clock : ClockReport
        What became of their stamps.
    settings : ImportSettings
        How the table was read, and the steps that are wanted.
    matches : sequence of PointMatch
        What columns are.
    where : str
        The table, for messages.

    Returns
    -------
    TelemetryImport
        Telemetry, and all that was done.

    Raises
    ------
    PlanError
        A column of `matches` is not there, none is matched, or two are for the same point.
    CaseError
        A unit does not measure its point, an entity is none of the building's, or the steps are out of range.
    """
    used = {match.column: match for match in matches if match.point and not match.remark}
    if not used:
        raise PlanError(where, "a column that is matched to a point", "none", "see points.csv")
    if lacking := sorted(used.keys() - series.keys()):
        found = f"no {lacking[0]!r}" + (f" and {len(lacking) - 1} more" if len(lacking) > 1 else "")
        raise PlanError(where, "the columns of the list of points", found)
    owners: dict[str, str] = {}
    for match in used.values():
        first = owners.setdefault(f"{match.entity}/{match.point}", match.column)
        found, advice = f"{first!r} and {match.column!r}", "leave one of them out"
        PlanError.unless(first == match.column, f"{match.entity}/{match.point}", "one column", found, advice)
    units = {column: _unit(match, series[column], settings.units) for column, match in used.items()}
    check_columns(building, [f"{m.entity}/{m.point}" for m in used.values()], "points", check_boundaries=False)
    remarks = [*clock.sentences(settings.timezone)]
    clean = {column: _in_order(series[column], units[column], remarks) for column in used}
    ends, step = _grid(clean, settings.step, building.location.timezone, remarks)
    columns = {}
    for column, match in used.items():
        values = _on_steps(clean[column], units[column], match.point, ends, step, building.location.elevation, remarks)
        columns[f"{match.entity}/{match.point}"] = values
    frame = pd.DataFrame(columns, index=ends.rename(INDEX))
    left = [name for name in series if name not in used]
    heat = tuple(name for name in left if tells_of_heat(series[name]))
    aside = [pd.DataFrame({INDEX: s.values.index, "column": s.name, "value": s.values.to_numpy()}) for s in
             (series[name] for name in left)]  # fmt: skip
    empty = pd.DataFrame({INDEX: ends[:0], "column": [], "value": []})
    telemetry = Telemetry.from_frame(frame, where=where)
    return TelemetryImport(telemetry, tuple(matches), tuple(remarks), heat, pd.concat(aside) if aside else empty)


def match_series(building: Building, series: Mapping[str, RawSeries]) -> tuple[PointMatch, ...]:
    """Match columns to devices and points by name, units left out of the names.

    Parameters
    ----------
    building : Building
        With zones and devices.
    series : mapping of str to RawSeries
        By name of the column.

    Returns
    -------
    tuple of PointMatch
        One a column, in their order.
    """
    bare = [name if name.rpartition("/")[2] in POINT_TYPES else split_unit(name)[0] for name in series]
    spaces = (*building.zone_names, *building.measured_boundaries)
    found = match_points(bare, building.devices, spaces, weather_station=building.weather_station)
    named = [replace(m, column=name, unit=series[name].unit) for name, m in zip(series, found, strict=True)]
    return tuple(replace(m, remark=_misfit(m, series[m.column])) if m.point and not m.remark else m for m in named)


def _misfit(match: PointMatch, series: RawSeries) -> str:
    """Say why a column cannot be what its name says; nothing where it can."""
    try:
        _unit(match, series, {})
    except CaseError:
        return f"{series.unit!r} is no unit of {match.point}"
    return "" if series.values.notna().any() else "no numbers"


def tells_of_heat(series: RawSeries) -> bool:
    """Whether a column that is left out looks like heat, or like what heat is made of.

    Parameters
    ----------
    series : RawSeries
        Column.
    """
    short = vocabulary("abbreviations")
    words = {part for word in words_of(series.name) for part in str(short.get(word, word)).split()}
    energy = any(word in series.unit.casefold() for word in ("wh", "kw", "btu", "joule", "mj", "gj"))
    moves = series.values.nunique() > 1
    return moves and (energy or (bool(words & HEAT_WORDS) and not words & {"temperature", "setpoint"}))


def _unit(match: PointMatch, series: RawSeries, by_point: Mapping[str, str]) -> str:
    """Find the unit of a column: of the list of points, else of the option, else of its name, else the usual one."""
    where = f"points: {match.column!r}"
    quantity = point_type(match.point, where).quantity
    unit = (match.unit if match.unit != series.unit else "") or by_point.get(match.point) or series.unit
    unit = unit or QUANTITIES[quantity].file_unit
    try:
        check_unit(unit, quantity, where)
    except CaseError:
        if quantity not in _COUNTED:
            raise
        try:
            check_unit(f"({unit})/s", quantity, where)
        except CaseError as error:
            raise CaseError(where, f"a unit of {match.point}, or of what its counter counts", repr(unit)) from error
        return f"({unit})/s"
    return unit


#: Quantities that counters count over time.
_COUNTED = ("power", "air_flow")


def _in_order(series: RawSeries, unit: str, remarks: list[str]) -> pd.Series:
    """Values in the order of time, each stamp once."""
    if series.texts:
        remarks.append(f"{series.name}: {series.texts} cells are no numbers, such as {series.example!r}: left out")
    values = series.values.rename(series.name).sort_index(kind="stable")
    doubled = values.index.duplicated(keep=False)
    if doubled.any():
        groups = values[doubled].groupby(level=0)
        differ = int((groups.nunique() > 1).sum())
        merged = "the larger one was kept" if unit.startswith("(") else "their mean was taken"
        told = f"; {differ} of them with different values: {merged}" if differ else ""
        remarks.append(f"{series.name}: {groups.ngroups} stamps stand there twice or more{told}")
        whole = values.groupby(level=0)
        values = whole.max() if unit.startswith("(") else whole.mean()
    return values


def _grid(
    clean: Mapping[str, pd.Series], wanted: float | None, timezone: str, remarks: list[str]
) -> tuple[pd.DatetimeIndex, float]:
    """Find the ends of regular steps, and their length [s]."""
    present = [pd.DatetimeIndex(s.index) for s in clean.values() if len(s)]
    if not present:
        raise PlanError("table", "a matched column with numbers", "none", "see points.csv")
    stamps = present[0] if all(p.equals(present[0]) for p in present) else present[0].append(present[1:]).unique()
    stamps = pd.DatetimeIndex(stamps.sort_values()).as_unit("us")
    usual = min((u for p in present if np.isfinite(u := usual_interval(p))), default=np.nan)
    if not np.isfinite(usual):
        raise PlanError("table", "at least two stamps", f"{len(stamps)}")
    gaps = np.diff(stamps.asi8)
    regular = not (gaps % max(round(usual * 1e6), 1)).any()
    if wanted is None and regular and SHORTEST_STEP <= usual <= LONGEST_STEP:
        step, origin = usual, stamps[0]
    else:
        step = float(wanted or min(USUAL_STEPS, key=lambda s: abs(np.log(s / usual))))
        if not SHORTEST_STEP <= step <= LONGEST_STEP or 86400.0 % step:
            expected = f"a step of {SHORTEST_STEP:g} to {LONGEST_STEP:g} s that divides a day"
            raise CaseError("--resample", expected, f"{step:g} s", "such as 5min, 15min or 1h")
        if usual > 2.0 * LONGEST_STEP:
            raise CaseError("table", f"steps of up to {LONGEST_STEP:g} s", f"{usual:g} s")
        offset = pd.Timedelta(stamps[0].tz_convert(timezone).utcoffset() or 0)
        origin = (stamps[0] + offset).floor("D") - offset
        aligned = origin + pd.Timedelta(seconds=step) * np.arange(2)
        off = np.abs((stamps - aligned[0]).total_seconds().to_numpy() % usual)
        jitter = float(np.minimum(off, usual - off).max())
        told = f", up to {jitter:.3g} s beside even times" if jitter > 0.0 else ""
        remarks.append(f"{len(stamps)} stamps, usually {usual:g} s apart{told}: means over steps of {step:g} s")
    length = pd.Timedelta(seconds=step)
    first = origin + length * int(np.ceil((stamps[0] - origin) / length - 1e-9))
    count = int(np.ceil((stamps[-1] - first) / length - 1e-9)) + 1
    if count > max(MOST_STEPS, 20 * len(stamps)):
        raise CaseError("table", f"at most {MOST_STEPS} steps", f"{count}", "correct the first or the last stamp")
    return pd.date_range(first, periods=count, freq=length).as_unit("us").tz_convert(timezone), step


def _on_steps(
    series: pd.Series, unit: str, point: str, ends: pd.DatetimeIndex, step: float, elevation: float, remarks: list[str]
) -> FloatArray:
    """Values of a column on regular steps, in the library's units."""
    quantity = POINT_TYPES[point].quantity
    name = str(series.name)
    if unit.startswith("("):
        rates, report = counter_means(series, ends, step)
        if report.per_interval:
            remarks.append(f"{name}: amounts of each interval, not readings of a counter; divided by their time")
        else:
            found = [f"it began anew {report.resets} times"] if report.resets else []
            found += [f"it ran over its last digit {report.rollovers} times"] if report.rollovers else []
            found += [f"{report.glitches} readings fell back for a moment: left out"] if report.glitches else []
            remarks.append(f"{name}: readings of a counter, differenced" + "".join(f"; {text}" for text in found))
        return to_si(rates, unit, quantity, elevation=elevation)
    values = pd.Series(to_si(series.to_numpy(), unit, quantity, elevation=elevation), index=series.index)
    stamps = pd.DatetimeIndex(values.index)
    if quantity == "power" and len(values) > 50 and (np.diff(values) >= 0.0).all() and values.nunique() > 10:
        remarks.append(f"{name}: it never falls, as a counter does; give its unit, such as kWh, in points.csv")
    if stamps.isin(ends).all() and (len(stamps) < 2 or usual_interval(stamps) == step):
        return values.reindex(ends).to_numpy(dtype=float)
    if quantity == "angle":
        angles = np.radians(values.to_numpy(dtype=float))
        east, north = (step_means(pd.Series(of(angles), index=stamps), ends, step) for of in (np.sin, np.cos))
        return np.asarray(np.degrees(np.arctan2(east, north)) % 360.0)
    return step_means(values, ends, step, holds=point.endswith(("setpoint", "command")))
