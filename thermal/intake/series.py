"""One series a column, of wide tables and of long ones: values, stamps in UTC, and units that names give."""

import re
from dataclasses import dataclass

import numpy as np
import pandas as pd

from thermal.case.telemetry import MISSING
from thermal.errors import CaseError, PlanError
from thermal.intake.source import read_table, shown
from thermal.intake.stamps import ClockReport, parse_stamps, spelled, to_utc
from thermal.units import QUANTITIES, check_unit

#: Names of the column of stamps, of values, and of units in a long table.
STAMPS = ("timestamp", "time", "datetime", "date_time", "date time", "stamp", "ts", "date", "zeitstempel", "zeit")
VALUES = ("value", "val", "reading", "measurement", "wert")
UNITS = ("unit", "units", "uom", "einheit")

#: Units that stand at the end of a column's name without brackets, as pint writes them.
_TRAILING = {"kwh": "kWh", "mwh": "MWh", "wh": "Wh", "kw": "kW", "cfm": "cfm", "degf": "degF", "degc": "degC"}
#: What people write for units, as pint writes it.
_SPELT = {
    "°c": "degC", "c": "degC", "°f": "degF", "f": "degF", "m³/h": "m^3/h", "m3/h": "m^3/h", "l/s": "L/s",
    "w/m²": "W/m^2", "w/m2": "W/m^2", "m3": "m^3", "m³": "m^3", "%rh": "%",
}  # fmt: skip


@dataclass(frozen=True)
class RawSeries:
    """A column as its source has it.

    Parameters
    ----------
    name
        Of the column; the words of a long table's keys with slashes.
    values
        Numbers and NaN, tz-aware index in UTC, in the order of the rows; stamps may stand twice.
    unit
        As its name or the table gives it; empty when neither does.
    texts
        Cells that hold text rather than numbers.
    example
        The first of these.
    """

    name: str
    values: pd.Series
    unit: str = ""
    texts: int = 0
    example: str = ""


def read_series(source: str, table: str = "", timezone: str = "") -> tuple[dict[str, RawSeries], ClockReport]:
    """Read a table as one series a column.

    Parameters
    ----------
    source, table : str
        As `thermal.intake.source.read_table` takes them.
    timezone : str
        IANA name of the time zone of stamps without an offset.

    Returns
    -------
    tuple of dict and ClockReport
        Series by name, and what became of stamps.

    Raises
    ------
    PlanError
        The table cannot be read, has no stamps or no values, or its stamps have no offset and no time zone is given.

    Notes
    -----
    A table is long when it has a column of values (``value``) and columns that say of what; else it is wide.
    """
    frame, where, report = read_table(source, table), shown(source), ClockReport()
    lower = {str(column).casefold(): str(column) for column in frame}
    stamp = next((lower[name] for name in STAMPS if name in lower), str(frame.columns[0]))
    cells = frame[stamp]
    if (lower.get("date") == stamp and "time" in lower) or (lower.get("time") == stamp and "date" in lower):
        cells = frame[lower["date"]].astype(str).str[:10] + " " + frame[lower["time"]].astype(str)
        frame = frame.drop(columns=lower["time" if lower["date"] == stamp else "date"])
    stamps = parse_stamps(cells, f"{where}: column {stamp!r}", report)
    if stamps.dt.tz is None and not timezone:
        advice = "say whose clock they show: --tz Europe/Berlin"
        raise PlanError(f"{where}: column {stamp!r}", "stamps with an offset", repr(spelled(cells.iloc[0])), advice)
    frame = frame.drop(columns=stamp)
    value = next((lower[name] for name in VALUES if name in lower and lower[name] in frame), None)
    keys = [name for name in map(str, frame) if name != value and name.casefold() not in UNITS]
    wide = value is None or not keys
    if wide:
        parts = {str(column): (frame[column], stamps, "") for column in frame}
    else:
        unit = next((lower[name] for name in UNITS if name in lower), None)
        names = frame[keys].astype(str).agg("/".join, axis=1)
        cells, spelling = frame[str(value)], frame[unit] if unit is not None else names.map(lambda _: "")
        parts = {}
        for name, rows in names.groupby(names, sort=False).groups.items():
            units = spelling[rows].dropna().astype(str).unique()
            parts[str(name)] = (cells[rows], stamps[rows], str(units[0]) if len(units) == 1 else "")
    if not parts:
        raise PlanError(where, "a column of values beside the stamps", "none")
    whole = to_utc(_forwards(stamps), timezone, report) if wide else stamps
    return {
        name: _series(name, column, whole if wide else to_utc(_forwards(at), timezone, report), given)
        for name, (column, at, given) in parts.items()
    }, report


def _forwards(stamps: pd.Series) -> pd.Series:
    """Stamps of a table that runs backwards, turned round; their index says which row each is of."""
    steps = np.diff(stamps.dropna().astype("int64"))
    return stamps.iloc[::-1] if (steps < 0).sum() > (steps > 0).sum() else stamps


def _series(name: str, column: pd.Series, stamps: pd.Series, given: str) -> RawSeries:
    """Make numbers of cells; what is text becomes NaN and is counted."""
    cells = column.loc[stamps.index]
    if not pd.api.types.is_numeric_dtype(cells):
        text = cells.where(cells.notna(), "").astype(str).str.strip()
        text = text.where(~text.str.casefold().isin(MISSING), "")
        commas = text.str.match(r"^[+-]?\d+,\d+$")
        text = text.str.replace(",", ".") if commas.any() and not text.str.contains(r"\d\.\d").any() else text
        switched = text.str.casefold().map({"true": "1", "false": "0"})
        numbers = pd.to_numeric(switched.fillna(text), errors="coerce")
        odd = text[numbers.isna() & (text != "")]
    else:
        numbers, odd = cells, cells[:0]
    values = pd.Series(numbers.to_numpy(dtype=float, na_value=np.nan), index=pd.DatetimeIndex(stamps))
    values[~np.isfinite(values)] = np.nan
    example = str(odd.iloc[0]) if len(odd) else ""
    return RawSeries(name, values[values.index.notna()], spelt(given) or split_unit(name)[1], len(odd), example)


def split_unit(name: str) -> tuple[str, str]:
    """Take a unit off the end of a column's name.

    Parameters
    ----------
    name : str
        Such as ``Boiler energy [kWh]``, ``room 1 (°C)`` or ``boiler_kWh``.

    Returns
    -------
    tuple of str
        The rest, and the unit as pint writes it; empty when there is none.

    Examples
    --------
    >>> split_unit("Boiler energy [kWh]"), split_unit("room 1")
    (('Boiler energy', 'kWh'), ('room 1', ''))
    """
    bracketed = re.match(r"^(.*?)\s*[\[(]([^\[\]()]+)[\])]\s*$", name)
    if bracketed and _measures(spelt(bracketed[2])):
        return bracketed[1], spelt(bracketed[2])
    words = re.match(r"^(.*?)[\s_.-]+([A-Za-z]+)$", name)
    unit = _TRAILING.get(words[2].casefold(), "") if words else ""
    return (words[1], unit) if words and unit else (name, "")


def _measures(unit: str) -> bool:
    """Whether a text is a unit of any point, or of what a counter counts."""
    for quantity in QUANTITIES:
        for text in (unit, f"({unit})/s"):
            try:
                check_unit(text, quantity, "")
            except CaseError:
                continue
            return True
    return False


def spelt(unit: str) -> str:
    """Spell a unit as pint does.

    Parameters
    ----------
    unit : str
        As people write it.
    """
    return _SPELT.get(unit.strip().casefold(), unit.strip())
