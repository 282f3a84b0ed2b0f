"""Generated cases of the size of the paper's pilot building: plans, devices, weather and telemetry from a seed."""

from thermal.pilot._errors import ClosedLoopError, LayoutError
from thermal.pilot.layout import devices, generate_office
from thermal.pilot.pilot import PlantFactory, generate_pilot
from thermal.pilot.telemetry import Plant, Progress, generate_telemetry
from thermal.pilot.thermostat import Terminals, Thermostats, draw_thermostats, size_terminals
from thermal.pilot.weather import MOUNTAIN_VIEW, generate_weather

__all__ = [
    "MOUNTAIN_VIEW",
    "ClosedLoopError",
    "LayoutError",
    "Plant",
    "PlantFactory",
    "Progress",
    "Terminals",
    "Thermostats",
    "devices",
    "draw_thermostats",
    "generate_office",
    "generate_pilot",
    "generate_telemetry",
    "generate_weather",
    "size_terminals",
]
