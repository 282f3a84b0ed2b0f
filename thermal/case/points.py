"""The point types of the case format: what each measures, and which values a sensor of it can report at all."""

from __future__ import annotations

from dataclasses import dataclass

from thermal.errors import CaseError, describe, nearest


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
_TABLE: tuple[tuple[str, str, float, float, str], ...] = (
    ("zone_air_temperature_sensor", "temperature", 253.15, 333.15, "air temperature of the zone"),
    ("supply_air_flowrate_sensor", "air_flow", -0.01, 200.0, "air flow into the zone"),
    ("discharge_air_temperature_sensor", "temperature", 243.15, 373.15, "temperature of that air"),
    ("heating_power_sensor", "power", -1e6, 1e6, "heat given to the zone"),
    ("zone_air_heating_temperature_setpoint", "temperature", 253.15, 333.15, "heating setpoint of the zone"),
    ("zone_air_cooling_temperature_setpoint", "temperature", 253.15, 333.15, "cooling setpoint of the zone"),
    ("supply_air_temperature_sensor", "temperature", 233.15, 373.15, "supply air of the air handler"),
    ("supply_air_temperature_setpoint", "temperature", 233.15, 373.15, "setpoint of the air handler's supply air"),
    ("mixed_air_temperature_sensor", "temperature", 213.15, 373.15, "mixed air in the air handler"),
    ("return_air_temperature_sensor", "temperature", 233.15, 373.15, "return air to the air handler"),
    ("supply_water_temperature_sensor", "temperature", 253.15, 453.15, "water from the boiler"),
    ("supply_water_temperature_setpoint", "temperature", 253.15, 453.15, "setpoint of the water from the boiler"),
    ("return_water_temperature_sensor", "temperature", 253.15, 453.15, "water back to the boiler"),
    ("supply_air_damper_percentage_command", "share", -0.05, 1.05, "damper of the terminal unit"),
    ("heating_water_valve_percentage_command", "share", -0.05, 1.05, "heating valve of the terminal unit"),
    ("supply_fan_power_sensor", "power", -1e4, 1e7, "electric power of the supply fan"),
    ("electrical_power_sensor", "power", -1e7, 1e8, "electric power"),
    ("gas_power_sensor", "power", -1e4, 1e8, "gas power"),
    ("pump_power_sensor", "power", -1e4, 1e7, "electric power of the pump"),
    ("exhaust_air_flowrate_sensor", "air_flow", -0.01, 200.0, "air flow out of the zone"),
    ("occupancy_count_sensor", "count", 0.0, 1e5, "people in the zone"),
    ("zone_air_co2_concentration_sensor", "concentration", 1e-4, 5e-2, "carbon dioxide in the zone's air"),
    ("outside_air_temperature_sensor", "temperature", 193.15, 338.15, "outdoor air temperature"),
    ("wind_speed_sensor", "speed", 0.0, 115.0, "wind speed"),
    ("wind_direction_sensor", "angle", -180.0, 360.0, "direction the wind comes from"),
    ("direct_normal_irradiance_sensor", "irradiance", -30.0, 1500.0, "beam from the sun"),
    ("diffuse_horizontal_irradiance_sensor", "irradiance", -30.0, 1500.0, "diffuse sun on the horizontal"),
    ("global_horizontal_irradiance_sensor", "irradiance", -30.0, 1700.0, "all sun on the horizontal"),
    ("horizontal_infrared_irradiance_sensor", "irradiance", 50.0, 700.0, "longwave from the sky"),
    # since format 2; transmitters may read a little below zero
    ("supply_air_static_pressure_setpoint", "pressure", -50.0, 3e3, "setpoint of the duct's static pressure"),
    ("supply_air_static_pressure_sensor", "pressure", -50.0, 3e3, "static pressure in the duct"),
    ("differential_pressure_setpoint", "pressure", -5e3, 1e6, "setpoint of the water's differential pressure"),
    ("differential_pressure_sensor", "pressure", -5e3, 1e6, "differential pressure of the water"),
)

POINT_TYPES: dict[str, PointType] = {row[0]: PointType(*row) for row in _TABLE}

#: Point types that came with the second number of the format; a case that has none of them is written as format 1.
SINCE_FORMAT_2 = frozenset(name for name, point in POINT_TYPES.items() if point.quantity == "pressure")

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
    if name not in POINT_TYPES:
        raise CaseError(
            describe(where, "a point type of the case format", repr(name), nearest(name, POINT_TYPES))
        )
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
        raise CaseError(
            describe(f"{where}: column {column!r}", "a name ENTITY/POINT", repr(column), "rename or drop the column")
        )
    return entity, point_type(point, f"{where}: column {column!r}").name
