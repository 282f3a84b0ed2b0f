"""Forecasts: a table with units that says by name what it lacks, and those of a scenario, perfect or with errors."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from mpc.errors import ScenarioError
from mpc.scenario.scenario import Scenario
from mpc.scenario.weather import SKY, SUN_POINTS
from thermal._types import FloatArray
from thermal.case.points import OUTDOOR_TEMPERATURE, POINT_TYPES
from thermal.errors import CaseError, nearest
from thermal.units import QUANTITIES, to_si

#: Columns of a forecast that are no points of the case format, with their unit; those of a zone are ``ZONE/name``.
FORECAST_UNITS = {
    "electricity_price": "1/kWh",
    "gas_price": "1/kWh",
    "district_heating_price": "1/kWh",
    "electricity_carbon_intensity": "kg/kWh",
    "gas_carbon_intensity": "kg/kWh",
    "district_heating_carbon_intensity": "kg/kWh",
    "internal_gain": "W",
    "comfort_lower_temperature": "K",
    "comfort_upper_temperature": "K",
}
_QUANTITY = {"W": "power", "K": "temperature"}  # of these units, converted from others


def column_unit(column: str) -> str:
    """Name the unit that a column of a forecast has inside the library.

    Parameters
    ----------
    column : str
        A weather point, a name of `FORECAST_UNITS`, or ``ZONE/`` before a point or such a name.

    Raises
    ------
    ScenarioError
        When the name is not known.

    Examples
    --------
    >>> column_unit("outside_air_temperature_sensor"), column_unit("north/internal_gain")
    ('kelvin', 'W')
    """
    name = column.rpartition("/")[2]
    if name in FORECAST_UNITS:
        return FORECAST_UNITS[name]
    if name in POINT_TYPES:
        return QUANTITIES[POINT_TYPES[name].quantity].unit
    advice = nearest(name, [*FORECAST_UNITS, *POINT_TYPES])
    raise ScenarioError("forecast: column", "a name that forecasts have", repr(column), advice)


@dataclass(frozen=True, eq=False, repr=False)
class Forecast:
    """What is expected over the coming steps.

    Parameters
    ----------
    table : DataFrame, shape (n_steps, n_column)
        Stamps at the ends of the steps, with a time zone; columns as in `column_unit`, in the library's units. NaN is
        missing.

    Raises
    ------
    ScenarioError
        When stamps have no time zone or do not rise, or a column is not known or holds other than numbers.
    """

    table: pd.DataFrame

    def __post_init__(self) -> None:
        index = self.table.index
        if not isinstance(index, pd.DatetimeIndex) or index.tz is None or not len(index):
            raise ScenarioError("forecast", "stamps with a time zone", f"an index of {index.dtype}")
        if not index.is_monotonic_increasing or not index.is_unique:
            raise ScenarioError("forecast", "stamps that rise", f"{index[0]} to {index[-1]}, out of order")
        for column, kind in zip(self.table.columns, self.table.dtypes, strict=True):
            column_unit(str(column))
            ScenarioError.unless(kind.kind in "iufb", f"forecast: column {str(column)!r}", "numbers", kind)

    @classmethod
    def from_frame(cls, table: pd.DataFrame, units: Mapping[str, str]) -> Forecast:
        """Make a forecast from a table in units of one's own.

        Parameters
        ----------
        table : DataFrame, shape (n_steps, n_column)
            Stamps at the ends of the steps.
        units : mapping of str to str
            Unit of each column, any that pint knows; prices and intensities are per kWh.

        Returns
        -------
        Forecast
            In the library's units.

        Raises
        ------
        ScenarioError
            When a column has no unit, or one of something else.

        Examples
        --------
        >>> stamps = pd.date_range("2023-07-06 07:05", periods=2, freq="5min", tz="UTC")
        >>> table = pd.DataFrame({"outside_air_temperature_sensor": [59.0, 68.0]}, index=stamps)
        >>> Forecast.from_frame(table, {"outside_air_temperature_sensor": "degF"}).table.iloc[:, 0].round(2).tolist()
        [288.15, 293.15]
        """
        converted = table.copy()
        for column in map(str, table.columns):
            where, name = f"forecast: column {column!r}", column.rpartition("/")[2]
            ScenarioError.unless(column in units, where, "a unit", "none", "add it to `units`")
            wanted, unit = column_unit(column), units[column]
            quantity = _QUANTITY.get(wanted) if name in FORECAST_UNITS else POINT_TYPES[name].quantity
            if quantity is None:
                ScenarioError.unless(unit == wanted, where, f"the unit {wanted!r}", repr(unit))
                continue
            try:
                converted[column] = to_si(table[column].astype(float), unit, quantity, where=where)
            except (TypeError, ValueError, CaseError) as error:
                raise ScenarioError(f"{where}: {error}") from error
        return cls(converted)

    def to_frame(self) -> pd.DataFrame:
        """Give the table, to be written to; `units` says what its columns are in."""
        return self.table.copy()

    def __repr__(self) -> str:
        first, last = self.table.index[[0, -1]]
        return f"Forecast({len(self.table)} steps, {first} to {last}, {self.table.shape[1]} columns)"

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column."""
        return {str(column): column_unit(str(column)) for column in self.table.columns}

    def values(
        self, columns: Sequence[str], stamps: pd.DatetimeIndex | None = None, fill: Literal["hold"] | None = None
    ) -> FloatArray:
        """Take columns out, whole.

        Parameters
        ----------
        columns : sequence of str
            Which, in order.
        stamps : DatetimeIndex
            Steps that are needed; default those of the table.
        fill : str
            ``hold`` carries the last known value forward, and the first one back; default None: nothing is filled.

        Returns
        -------
        ndarray, shape (n_steps, n_column)
            Without gaps [units of the library].

        Raises
        ------
        ScenarioError
            Which column is missing, for how many steps, and when first.
        """
        ScenarioError.unless(fill in (None, "hold"), "fill", "'hold' or None", repr(fill))
        index = pd.DatetimeIndex(self.table.index) if stamps is None else stamps
        part = self.table.reindex(columns=list(columns)).reindex(index)
        values = (part if fill is None else part.ffill().bfill()).to_numpy(dtype=float)
        empty = np.isnan(values)
        if not empty.any():
            return values
        k, advice = int(np.argmax(empty.any(axis=0))), "supply it" if fill else 'pass fill="hold" or supply it'
        near = "" if columns[k] in self.table else f" ({nearest(columns[k], self.table.columns)})"
        raise ScenarioError(
            f"forecast lacks {columns[k]!r}{near} for {empty[:, k].sum()} of {len(index)} steps "
            f"(first {index[int(np.argmax(empty[:, k]))]:%Y-%m-%d %H:%M}); {advice}"
        )


_STREAM = 12  # of random numbers of a seed

#: What errors are told apart by: points whose error is one and the same.
ERROR_POINTS = {
    "temperature": (OUTDOOR_TEMPERATURE,),
    "wind": ("wind_speed_sensor",),
    "sun": SUN_POINTS,
    "sky": (SKY,),
}


@dataclass(frozen=True)
class ErrorGrowth:
    """Error of a forecast that grows with the time since it was issued.

    ``e_i = φ e_{i-1} + σ sqrt(1 - φ²) w_i``, ``e_0 = 0``, ``φ = exp(-Δt / τ)``: the deviation after a lead t is
    ``σ sqrt(1 - exp(-2 t / τ))`` at any step.

    Parameters
    ----------
    deviation : float
        Standard deviation σ at long leads, 0 or more [K or m/s or W/m2; - for the sun: relative to the truth].
    time_constant : float
        τ [s], positive.

    Raises
    ------
    ScenarioError
        When a number is out of range.

    Examples
    --------
    >>> round(ErrorGrowth(2.0, 86400.0).after(6 * 3600.0), 2)
    1.25
    """

    deviation: float
    time_constant: float

    def __post_init__(self) -> None:
        possible = self.deviation >= 0 and self.time_constant > 0 and np.isfinite(self.deviation)
        expected, found = "a deviation of 0 or more and a positive time", f"{self.deviation} and {self.time_constant} s"
        ScenarioError.unless(possible, "error", expected, found)

    def after(self, lead: float) -> float:
        """Tell the standard deviation of the error after a lead [unit of the deviation].

        Parameters
        ----------
        lead : float
            Time since the forecast was issued [s].
        """
        return float(self.deviation * np.sqrt(-np.expm1(-2.0 * lead / self.time_constant)))

    def path(self, rng: np.random.Generator, count: int, step: float) -> FloatArray:
        """Draw the errors of the first steps of a forecast, shape (count,) [unit of the deviation].

        Parameters
        ----------
        rng : numpy.random.Generator
            Where randomness comes from.
        count : int
            Number of steps.
        step : float
            Their length [s].
        """
        keep = np.exp(-step / self.time_constant)
        drive = self.deviation * np.sqrt(1.0 - keep**2) * rng.standard_normal(count)
        return np.asarray(lfilter([1.0], [1.0, -keep], drive), dtype=float)


#: Assumed errors, of the size that day-ahead numerical weather prediction has at a site: 2 K and 1.5 m/s, a third of
#: the sun, 15 W/m2 of the sky. They are no fit to any service: replace them where one is known.
DAY_AHEAD_ERRORS: Mapping[str, ErrorGrowth] = {
    "temperature": ErrorGrowth(2.0, 24 * 3600.0),
    "wind": ErrorGrowth(1.5, 12 * 3600.0),
    "sun": ErrorGrowth(0.3, 6 * 3600.0),
    "sky": ErrorGrowth(15.0, 12 * 3600.0),
}


@dataclass(eq=False, repr=False)
class Forecaster:
    """Forecasts of a scenario, step by step.

    A forecast is issued anew at the multiples of `issue_every`; in between its errors stay as they are, and the time
    ahead counts from the issue. Random numbers belong to the issue and the point, so that no forecast depends on which
    others were asked for.

    Parameters
    ----------
    scenario : Scenario
        Truth.
    horizon : int
        Steps of a forecast, at least 1.
    errors : mapping of str to ErrorGrowth
        Of ``temperature``, ``wind``, ``sun`` and ``sky``, such as `DAY_AHEAD_ERRORS`; default none: perfect weather.
    occupancy : str
        ``expected`` people and gains (default), or the ``actual`` ones that only a bound may know.
    issue_every : float
        Time between issues [s]; default an hour.
    seed : int
        Of the errors; 0 or more.

    Raises
    ------
    ScenarioError
        When an option is not known or out of range.
    """

    scenario: Scenario
    horizon: int
    errors: Mapping[str, ErrorGrowth] | None = None
    occupancy: Literal["expected", "actual"] = field(default="expected", kw_only=True)
    issue_every: float = field(default=3600.0, kw_only=True)
    seed: int = field(default=0, kw_only=True)

    def __post_init__(self) -> None:
        count, errors = self.scenario.grid.n_steps, self.errors or {}
        possible = 1 <= self.horizon <= count and self.seed >= 0 and self.issue_every > 0
        expected = f"a horizon of 1 to {count} steps, a seed of 0 or more, a time between issues"
        found = f"{self.horizon}, {self.seed}, {self.issue_every} s"
        ScenarioError.unless(possible, "forecaster", expected, found)
        ScenarioError.unless_known(self.occupancy, ("expected", "actual"), "occupancy", "'expected' or 'actual'")
        for name in errors:
            ScenarioError.unless_known(name, ERROR_POINTS, "errors", "a known one")
        truth = self.scenario.to_frame(expected=self.occupancy == "expected")
        self.columns = tuple(truth)
        self._wrong = {name: np.flatnonzero(truth.columns.isin(ERROR_POINTS[name])) for name in errors}
        self._truth = np.ascontiguousarray(truth.to_numpy())
        self._truth.setflags(write=False)
        self._issue: tuple[int, dict[str, FloatArray]] = (-1, {})

    def values(self, k: int) -> FloatArray:
        """Forecast the steps from one on.

        Parameters
        ----------
        k : int
            Number of the step that comes next, from 0.

        Returns
        -------
        ndarray, shape (horizon, n_column)
            Columns as `columns`, in the library's units; not to be written to.

        Raises
        ------
        ScenarioError
            When the scenario ends before the horizon does.
        """
        if not 0 <= k <= len(self._truth) - self.horizon:
            expected = f"a step from 0 to {len(self._truth) - self.horizon}, so that the scenario covers the horizon"
            raise ScenarioError("forecast", expected, repr(k), "make the scenario's grid longer")
        truth = self._truth[k : k + self.horizon]
        if not self.errors:
            return truth
        values = truth.copy()
        begin = int(self.scenario.grid.edges[k])
        issue = int(begin // self.issue_every)
        since = int((begin - issue * self.issue_every) // self.scenario.grid.step)
        for name, path in self._paths(issue).items():
            at, error = self._wrong[name], path[since : since + self.horizon, None]
            if name == "sun":
                values[:, at] *= np.maximum(1.0 + error, 0.0)
            else:
                values[:, at] += error
            if name == "wind":
                values[:, at] = np.maximum(values[:, at], 0.0)
        return values

    def table(self, k: int) -> Forecast:
        """Forecast the steps from one on, as a table with units.

        Parameters
        ----------
        k : int
            Number of the step that comes next, from 0.
        """
        stamps = self.scenario.grid.stamps[k : k + self.horizon]
        return Forecast(pd.DataFrame(self.values(k), index=stamps, columns=list(self.columns)))

    def _paths(self, issue: int) -> dict[str, FloatArray]:
        if self._issue[0] != issue:
            count = self.horizon + int(self.issue_every // self.scenario.grid.step) + 1
            paths = {}
            for name, error in (self.errors or {}).items():
                rng = np.random.default_rng([self.seed, _STREAM, issue, zlib.crc32(name.encode())])
                paths[name] = error.path(rng, count, self.scenario.grid.step)
            self._issue = (issue, paths)
        return self._issue[1]
