"""Metered energy, outdoor temperature and what else is known, by hour and by day."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mpc.errors import VerificationError
from thermal._types import FloatArray
from thermal.errors import CaseError
from thermal.intake.resample import counter_means, step_means
from thermal.intake.series import RawSeries, read_series
from thermal.intake.source import shown
from thermal.intake.stamps import checked_zone
from thermal.units import check_unit, to_si

#: Length of the steps of hourly models [s].
HOUR = 3600.0

#: Share of a day that must be metered for the day to count [-]: a tenth lost moves its mean by a per cent.
LEAST_OF_A_DAY = 0.9

#: Share of a day's hours with one control for the day to be of that control [-].
OF_ONE_CONTROL = 0.9


@dataclass(frozen=True)
class MeteredColumns:
    """Which columns of a table are what.

    Parameters
    ----------
    power : tuple of str
        Meters, which are added up: powers, or readings of energy counters where their unit is one of energy.
    outdoor : str
        Outdoor air temperature.
    acts : str
        1 where the new control acts and 0 where the building's own does; empty: none.
    occupancy : str
        People, or a share of them; empty: none.
    zone : str
        Mean temperature of the zones; empty: none.
    predicted : str
        Power that shadow operation expects to be saved; empty: none.
    """

    power: tuple[str, ...]
    outdoor: str
    acts: str = ""
    occupancy: str = ""
    zone: str = ""
    predicted: str = ""


@dataclass(frozen=True, eq=False)
class Metered:
    """Metered energy of a building by hour.

    Parameters
    ----------
    hours : DataFrame, shape (n_hour, n_column)
        Index: local ends of the hours. ``power`` [W], ``outdoor`` [K], and ``acts`` [-], ``occupancy`` [any], ``zone``
        [K], ``predicted`` [W] where they are known; NaN where missing.
    """

    hours: pd.DataFrame

    def __post_init__(self) -> None:
        lacking = [name for name in ("power", "outdoor") if name not in self.hours]
        VerificationError.unless(not lacking, "metered energy", "columns 'power' and 'outdoor'", [*self.hours])
        zoned = isinstance(self.hours.index, pd.DatetimeIndex) and self.hours.index.tz is not None
        VerificationError.unless(
            zoned, "metered energy", "local time stamps with a time zone", str(self.hours.index.dtype)
        )

    def days(self) -> pd.DataFrame:
        """Means by local day, every day of the span one row.

        Returns
        -------
        DataFrame, shape (n_day, n_column)
            The columns of `hours`, NaN where under nine tenths of a day are known; ``zone_start``: mean of the first
            two hours [K]; ``weekend`` [-]; ``acts``: 0 or 1, NaN on a day that has both.
        """
        begins = pd.DatetimeIndex(self.hours.index) - pd.Timedelta(hours=1)
        by_day = self.hours.groupby(begins.normalize())
        length = by_day.size().clip(lower=23).to_numpy()  # a day at the end of the span is no whole one
        days = by_day.mean().where(by_day.count().ge(LEAST_OF_A_DAY * length[:, None]))
        if "zone" in self.hours:
            days["zone_start"] = self.hours["zone"][begins.hour < 2].groupby(begins[begins.hour < 2].normalize()).mean()
        if "acts" in days:
            share = days["acts"]
            days["acts"] = np.where(share >= OF_ONE_CONTROL, 1.0, np.where(share <= 1.0 - OF_ONE_CONTROL, 0.0, np.nan))
        days = days.asfreq("D")
        days["weekend"] = (pd.DatetimeIndex(days.index).day_of_week >= 5).astype(float)
        return days

    def with_rehearsed(self, days: pd.DataFrame, where: str = "rehearsed days") -> "Metered":
        """Take what a rehearsal foretold for what shadow operation expected to save.

        Parameters
        ----------
        days : DataFrame, shape (n_day, n_column)
            Of `mpc.live.rehearsal.Rehearsal`: by local midnight, with ``own_energy`` and ``energy`` [kWh].
        where : str
            Where they are from, for messages.

        Raises
        ------
        VerificationError
            When days are no such table, or none of them was metered.
        """
        kept, index = days.filter(["own_energy", "energy"]), days.index
        zoned = isinstance(index, pd.DatetimeIndex) and index.tz is not None and index.is_unique
        fits = zoned and len(kept.select_dtypes("number").columns) == 2
        expected = "local days, each once, with own_energy and energy [kWh], as days.parquet of `buildingmpc rehearse`"
        VerificationError.unless(fits, where, expected, ", ".join(map(str, days)) or "no column")
        midnights = pd.DatetimeIndex(pd.DatetimeIndex(self.hours.index) - pd.Timedelta(hours=1)).normalize()
        saved = (kept["own_energy"] - kept["energy"]).tz_convert(midnights.tz)
        advice = "name the clock of the building with --tz"
        local = pd.DatetimeIndex(saved.index)
        VerificationError.unless(
            bool((local == local.normalize()).all()), where, f"days that begin at midnight in {midnights.tz}",
            str(local[0]) if len(local) else "none", advice,
        )  # fmt: skip
        kilowatt_hours = saved.reindex(midnights).to_numpy()
        length = (midnights + pd.DateOffset(days=1) - midnights).to_numpy() / np.timedelta64(1, "h")
        found = f"{index.min():%Y-%m-%d} to {index.max():%Y-%m-%d}" if len(index) else "none"
        advice = "rehearse days of shadow that are in the table"
        VerificationError.unless(np.isfinite(kilowatt_hours).any(), where, "days that were metered", found, advice)
        return Metered(self.hours.assign(predicted=1000.0 * kilowatt_hours / length))


def read_metered(source: str, columns: MeteredColumns, timezone: str = "", table: str = "") -> Metered:
    """Read metered energy from a table of any kind.

    Parameters
    ----------
    source : str
        Path of a Parquet, CSV or Excel file, or address of a PostgreSQL database.
    columns : MeteredColumns
        Which column is what; units stand at the end of their names, such as ``[kWh]``; default W and degC.
    timezone : str
        IANA name of the clock by which days are told, and of stamps without an offset; default: UTC.
    table : str
        Sheet, table or query.

    Raises
    ------
    PlanError
        The table cannot be read.
    VerificationError
        A column is not there, or its unit is not one of what it is for.
    """
    series, _ = read_series(source, table, checked_zone(timezone, "--tz"))
    return metered_of_series(series, columns, timezone or "UTC", shown(source))


def metered_of_series(series: Mapping[str, RawSeries], columns: MeteredColumns, timezone: str, where: str) -> Metered:
    """Bring columns to hours.

    Parameters
    ----------
    series : mapping of str to RawSeries
        By name of the column.
    columns : MeteredColumns
        Which is what.
    timezone : str
        IANA name of the building's clock.
    where : str
        The table, for messages.

    Raises
    ------
    VerificationError
        A column is not there, or its unit is not one of what it is for.
    """
    VerificationError.unless(
        columns.power, where, "a column of metered power or energy", "none", "name it with --power"
    )
    others = {n: c for n in ("outdoor", "acts", "occupancy", "zone", "predicted") if (c := getattr(columns, n))}
    for name in (*columns.power, *others.values()):
        VerificationError.unless_known(name, series, f"{where}: columns", "a column of the table")
    ends = _hours([series[name] for name in columns.power], timezone, where)
    made = {"power": np.sum([_power(series[name], ends, where) for name in columns.power], axis=0)}
    for name, column in others.items():
        values = _in_order(series[column])
        if name == "predicted":
            made[name] = _power(series[column], ends, where)
            continue
        means = step_means(values, ends, HOUR, holds=name in ("acts", "occupancy"))
        made[name] = _kelvin(means, series[column], where) if name in ("outdoor", "zone") else means
    return Metered(pd.DataFrame(made, index=ends.rename("timestamp")))


def _hours(meters: Sequence[RawSeries], timezone: str, where: str) -> pd.DatetimeIndex:
    """List the ends of the hours that the meters span."""
    stamps = [m.values.dropna().index for m in meters]
    VerificationError.unless(all(len(s) > 1 for s in stamps), where, "meters with numbers", "a column without any")
    first, last = (
        pd.Timestamp(of(s)) for of, s in ((min, [s.min() for s in stamps]), (max, [s.max() for s in stamps]))
    )
    begin, end = first.tz_convert(timezone).floor("h"), last.tz_convert(timezone).ceil("h")
    return pd.date_range(begin, end, freq="h")[1:]


def _in_order(series: RawSeries) -> pd.Series:
    return series.values.groupby(level=0).mean()


def _power(series: RawSeries, ends: pd.DatetimeIndex, where: str) -> FloatArray:
    """Mean power by hour [W], of powers or of the readings of a counter of energy."""
    unit, values = series.unit or "W", _in_order(series)
    for text, counted in ((unit, False), (f"({unit})/s", True)):
        try:
            check_unit(text, "power", where)
        except CaseError:
            continue
        means = counter_means(values, ends, HOUR)[0] if counted else step_means(values, ends, HOUR)
        return to_si(means, text, "power")
    raise VerificationError(f"{where}: {series.name!r}", "a unit of power or energy, such as kW or kWh", repr(unit))


def _kelvin(means: FloatArray, series: RawSeries, where: str) -> FloatArray:
    try:
        return to_si(means, series.unit or "degC", "temperature")
    except CaseError as error:
        raise VerificationError(f"{where}: {series.name!r}", "a unit of temperature", repr(series.unit)) from error
