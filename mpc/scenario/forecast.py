"""A forecast as a controller gets it: a table with units, that says by name what it lacks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from mpc.errors import ScenarioError
from thermal._types import FloatArray
from thermal.case.points import POINT_TYPES
from thermal.errors import CaseError, describe, nearest
from thermal.units import QUANTITIES, to_si

#: Columns of a forecast that are no points of the case format, with their unit; those of a zone are ``ZONE/name``.
FORECAST_UNITS = {
    "electricity_price": "1/kWh",
    "gas_price": "1/kWh",
    "electricity_carbon_intensity": "kg/kWh",
    "gas_carbon_intensity": "kg/kWh",
    "internal_gain": "W",
    "comfort_lower_temperature": "K",
    "comfort_upper_temperature": "K",
}
_QUANTITY = {"internal_gain": "power", "comfort_lower_temperature": "temperature",
             "comfort_upper_temperature": "temperature"}  # fmt: skip


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
    raise ScenarioError(describe("forecast: column", "a name that forecasts have", repr(column), advice))


@dataclass(frozen=True, eq=False)
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
        When stamps have no time zone or do not rise, or a column is not known.
    """

    table: pd.DataFrame

    def __post_init__(self) -> None:
        index = self.table.index
        if not isinstance(index, pd.DatetimeIndex) or index.tz is None or not len(index):
            raise ScenarioError(describe("forecast", "stamps with a time zone", f"an index of {index.dtype}"))
        if not index.is_monotonic_increasing or not index.is_unique:
            raise ScenarioError(describe("forecast", "stamps that rise", f"{index[0]} to {index[-1]}, out of order"))
        for column in self.table.columns:
            column_unit(str(column))

    @classmethod
    def from_table(cls, table: pd.DataFrame, units: Mapping[str, str]) -> Forecast:
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
        >>> Forecast.from_table(table, {"outside_air_temperature_sensor": "degF"}).table.iloc[:, 0].round(2).tolist()
        [288.15, 293.15]
        """
        converted = table.copy()
        for column in table.columns:
            ScenarioError.unless(column in units, f"forecast: column {column!r}", "a unit", "none", "add it to `units`")
            wanted, name = column_unit(str(column)), str(column).rpartition("/")[2]
            quantity = _QUANTITY.get(name) or (POINT_TYPES[name].quantity if name in POINT_TYPES else None)
            where = f"forecast: column {column!r}"
            if quantity is None and units[column] != wanted:
                raise ScenarioError(describe(where, f"the unit {wanted!r}", repr(units[column])))
            if quantity is not None:
                try:
                    converted[column] = to_si(table[column].astype(float), units[column], quantity, where=where)
                except (TypeError, ValueError, CaseError) as error:
                    raise ScenarioError(f"{where}: {error}") from error
        return cls(converted)

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column."""
        return {str(column): column_unit(str(column)) for column in self.table.columns}

    def values(
        self,
        columns: Sequence[str],
        stamps: pd.DatetimeIndex | None = None,
        fill: Literal["hold"] | None = None,
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
        index = pd.DatetimeIndex(self.table.index) if stamps is None else stamps
        part = self.table.reindex(columns=list(columns)).reindex(index)
        if fill == "hold":
            part = part.ffill().bfill()
        ScenarioError.unless(fill in (None, "hold"), "fill", "'hold' or None", repr(fill))
        values = part.to_numpy(dtype=float)
        empty = np.isnan(values)
        if empty.any():
            k = int(np.argmax(empty.any(axis=0)))
            first = index[int(np.argmax(empty[:, k]))]
            count = int(empty[:, k].sum())
            advice = "supply it" if fill == "hold" else 'pass fill="hold" or supply it'
            known = columns[k] in self.table
            near = "" if known else f" ({nearest(columns[k], self.table.columns)})"
            raise ScenarioError(
                f"forecast lacks {columns[k]!r}{near} for {count} of {len(index)} steps "
                f"(first {first:%Y-%m-%d %H:%M}); {advice}"
            )
        return values
