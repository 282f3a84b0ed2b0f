"""The point types of the case format: what each measures, and which values a sensor of it can report at all."""

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from thermal._types import BoolArray, FloatArray
from thermal.errors import CaseError
from thermal.units import QUANTITIES, from_si


@dataclass(frozen=True)
class PointType:
    """A point type of the Digital Buildings Ontology.

    Parameters
    ----------
    name
        As in telemetry columns, after the slash.
    quantity
        Key of `thermal.units.QUANTITIES`.
    lowest, highest
        The physically possible range [unit inside the library]; what lies outside is no measurement.
    largest_rate
        Fastest that a mean over five minutes or more can move [unit inside the library per hour]; infinite for what
        may jump from one end of its range to the other: flows, powers, commands, setpoints, sun and wind.
    meaning
        In a few words, for reports.
    """

    name: str
    quantity: str
    lowest: float
    highest: float
    largest_rate: float
    meaning: str

    def possible(self, values: ArrayLike) -> BoolArray:
        """Tell which values lie in the range, shape as given; what is missing (NaN) does not.

        Parameters
        ----------
        values
            Of any shape [unit inside the library].
        """
        array = np.asarray(values, dtype=float)
        return np.asarray((array >= self.lowest) & (array <= self.highest))

    def told(self, value: float) -> str:
        """Spell a value in the unit of files.

        Parameters
        ----------
        value
            [unit inside the library].

        Examples
        --------
        >>> POINT_TYPES["wind_speed_sensor"].told(3.25), POINT_TYPES["outside_air_temperature_sensor"].told(0.0)
        ('3.25 m/s', '-273.15 degC')
        """
        unit = QUANTITIES[self.quantity].file_unit
        return f"{float(from_si(value, unit, self.quantity)):.6g} {unit}"


# The ranges are wide on purpose: they catch failed sensors (-40, 0 K, 999, 6553.5), not unusual weather or hot rooms.
# Flow and irradiance may fall a little below zero: the zero offset of a differential pressure sensor, and the night
# offset of a pyranometer (ISO 9060 allows 7 to 30 W/m2). 1500 W/m2 is the solar constant with cloud enhancement.
# The rates are wide too: 10 K within five minutes for the air of a zone and outdoors, where the measured and practice
# cases show 5 and 2 K at most; 60 K for the air behind a coil (32 K seen), 20 K for return air, 100 K for water, which
# a pump that starts brings at once; 200 W/m2 for the sky when a cloud comes.
_ROWS = csv.reader((Path(__file__).parents[1] / "data" / "points.csv").read_text(encoding="utf-8").splitlines()[1:])
POINT_TYPES: dict[str, PointType] = {
    name: PointType(name, quantity, float(lowest), float(highest), float(rate), meaning)
    for name, quantity, lowest, highest, rate, meaning in _ROWS
}

ZONE_TEMPERATURE = "zone_air_temperature_sensor"
OUTDOOR_TEMPERATURE = "outside_air_temperature_sensor"
SUPPLY_FLOW = "supply_air_flowrate_sensor"
DISCHARGE_TEMPERATURE = "discharge_air_temperature_sensor"
HEATING_POWER = "heating_power_sensor"


def point_type(name: str, where: str) -> PointType:
    """Look a point type up.

    Parameters
    ----------
    name
        As in telemetry columns, after the slash.
    where
        Where the name stands, for the message.

    Returns
    -------
    PointType
        Its row of the table.

    Raises
    ------
    CaseError
        The format does not know it; the message names the nearest one.

    Examples
    --------
    >>> point_type("wind_speed_sensor", "units").quantity
    'speed'
    """
    CaseError.unless_known(name, POINT_TYPES, where, "a point type of the case format")
    return POINT_TYPES[name]


def split_column(column: str, where: str) -> tuple[str, str]:
    """Take a telemetry column apart.

    Parameters
    ----------
    column
        Name of the column, ``ENTITY/POINT``.
    where
        File, for the message.

    Returns
    -------
    tuple of str
        Entity and point type; an entity may hold slashes itself.

    Raises
    ------
    CaseError
        There is no slash, or nothing before or after it.
    CaseError
        The format does not know the point type.

    Examples
    --------
    >>> split_column("VAV_1/supply_air_flowrate_sensor", "telemetry")
    ('VAV_1', 'supply_air_flowrate_sensor')
    """
    entity, slash, point = column.rpartition("/")
    if not slash or not entity or not point:
        raise CaseError(f"{where}: column {column!r}", "a name ENTITY/POINT", repr(column), "rename or drop the column")
    return entity, point_type(point, f"{where}: column {column!r}").name


def possible_values(table: pd.DataFrame, types: Mapping[str, PointType] = POINT_TYPES) -> pd.DataFrame:
    """Leave out what no sensor of its point can read; columns that are no points stay as they are.

    Parameters
    ----------
    table
        Shape (n_time, n_column); columns end in the name of their point; in the library's units.
    types
        Of the points by name, with their ranges.
    """
    kept = table.copy()
    for position, column in enumerate(table.columns):
        kind = types.get(str(column).rpartition("/")[2])
        if kind is not None:
            values = table.iloc[:, position]
            kept.isetitem(position, values.where(kind.possible(values)).to_numpy())
    return kept


def numbers(values: Iterable[Any]) -> FloatArray:
    """Make numbers of readings, of the same length [as given]; NaN where one is missing or no number.

    Parameters
    ----------
    values
        As a building's automation has them.
    """
    return np.array([_number(value) for value in values], dtype=float)


def _number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return np.nan
