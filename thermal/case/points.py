"""The point types of the case format: what each measures, and which values a sensor of it can report at all."""

import csv
from dataclasses import dataclass
from pathlib import Path

from thermal.errors import CaseError


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
    meaning
        In a few words, for reports.
    """

    name: str
    quantity: str
    lowest: float
    highest: float
    meaning: str


# The ranges are wide on purpose: they catch failed sensors (-40, 0 K, 999, 6553.5), not unusual weather or hot rooms.
# Flow and irradiance may fall a little below zero: the zero offset of a differential pressure sensor, and the night
# offset of a pyranometer (ISO 9060 allows 7 to 30 W/m2). 1500 W/m2 is the solar constant with cloud enhancement.
_ROWS = csv.reader((Path(__file__).parents[1] / "data" / "points.csv").read_text(encoding="utf-8").splitlines()[1:])
POINT_TYPES: dict[str, PointType] = {
    name: PointType(name, quantity, float(lowest), float(highest), meaning)
    for name, quantity, lowest, highest, meaning in _ROWS
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
