"""What drives the effects of the catalogue: sun, sky, wind and schedules, from a case's telemetry."""

from thermal.inputs.drivers import (
    INFRARED,
    IRRADIANCE,
    REFERENCE_TEMPERATURE,
    WIND,
    Drivers,
    Signal,
    signal_values,
)
from thermal.inputs.sun import Sun, incidence_modifier, sun_of

__all__ = [
    "INFRARED",
    "IRRADIANCE",
    "REFERENCE_TEMPERATURE",
    "WIND",
    "Drivers",
    "Signal",
    "Sun",
    "incidence_modifier",
    "signal_values",
    "sun_of",
]
