"""Which readings a controller takes: of points whose range is too narrow to run every plant, wider ones.

Telemetry is judged by `thermal.case.points`, where a value out of its range is left out of a fit. A controller that
refuses what a plant truly has refuses it for ever.
"""

from collections.abc import Mapping
from dataclasses import replace

from thermal.case.points import POINT_TYPES, PointType

# Assumed, of plants rather than of comfort [K, W, Pa, deg]: cold stores and saunas, but above the -40 degC that failed
# sensors read; superheated water; outdoor air behind a coil that is off; central plants; pumps of tall buildings; vanes
# that turn a little over.
_WIDER: Mapping[str, tuple[float, float]] = {
    "zone_air_temperature_sensor": (234.15, 393.15),
    "discharge_air_temperature_sensor": (233.15, 373.15),
    "supply_water_temperature_sensor": (253.15, 523.15),
    "return_water_temperature_sensor": (253.15, 523.15),
    "heating_power_sensor": (-1e7, 1e7),
    "differential_pressure_sensor": (-5000.0, 2e6),
    "wind_direction_sensor": (-180.0, 361.0),
}

#: The point types with the ranges of what a controller takes.
READINGS: Mapping[str, PointType] = POINT_TYPES | {
    name: replace(POINT_TYPES[name], lowest=lowest, highest=highest) for name, (lowest, highest) in _WIDER.items()
}
