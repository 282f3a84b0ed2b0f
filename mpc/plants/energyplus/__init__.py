"""EnergyPlus' reference buildings as plants, by its runtime interface (extra ``[energyplus]``)."""

from mpc.plants.energyplus._building import EnergyPlusBuilding, energyplus_building
from mpc.plants.energyplus._install import CHICAGO, reference_buildings, weather_files
from mpc.plants.energyplus._layout import AirLoop, PlantLayout, Terminal, WaterLoop
from mpc.plants.energyplus._make import OFFICE_COMFORT, energyplus_plant, energyplus_scenario
from mpc.plants.energyplus._plant import EnergyPlusPlant
from mpc.plants.energyplus._system import controller_system

__all__ = [
    "CHICAGO",
    "OFFICE_COMFORT",
    "AirLoop",
    "EnergyPlusBuilding",
    "EnergyPlusPlant",
    "PlantLayout",
    "Terminal",
    "WaterLoop",
    "controller_system",
    "energyplus_building",
    "energyplus_plant",
    "energyplus_scenario",
    "reference_buildings",
    "weather_files",
]
