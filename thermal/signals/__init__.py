"""What drives the effects of the catalogue: sun, sky, wind and schedules, from a case's telemetry."""

from thermal.signals._drivers import Drivers, Signal
from thermal.signals._sun import GLASS_DIFFUSE, incidence_modifier

__all__ = ["GLASS_DIFFUSE", "Drivers", "Signal", "incidence_modifier"]
