"""Generated cases of the size of the paper's pilot building, and twins of any, from a seed."""

from thermal.pilot.errors import ClosedLoopError, LayoutError, TwinError
from thermal.pilot.truth import TwinRanges, TwinTruth
from thermal.pilot.building import pilot_building
from thermal.pilot.disturbance import draw_disturbance
from thermal.pilot.layout import devices, generate_office
from thermal.pilot.pilot import PlantFactory, generate_pilot
from thermal.pilot.prbs import PrbsThermostats, draw_prbs_thermostats
from thermal.pilot.sizing import DesignConditions, size_system
from thermal.pilot.telemetry import Plant, Progress, generate_telemetry
from thermal.pilot.thermostat import Terminals, Thermostats, draw_thermostats, size_terminals
from thermal.pilot.twin import Excitation, Meter, generate_twin
from thermal.pilot.weather import MOUNTAIN_VIEW, generate_weather

__all__ = [
    "MOUNTAIN_VIEW",
    "ClosedLoopError",
    "DesignConditions",
    "Excitation",
    "LayoutError",
    "Meter",
    "Plant",
    "PlantFactory",
    "PrbsThermostats",
    "Progress",
    "Terminals",
    "Thermostats",
    "TwinError",
    "TwinRanges",
    "TwinTruth",
    "devices",
    "draw_disturbance",
    "draw_prbs_thermostats",
    "draw_thermostats",
    "generate_office",
    "generate_pilot",
    "generate_telemetry",
    "generate_twin",
    "generate_weather",
    "pilot_building",
    "size_system",
    "size_terminals",
]
