"""EnergyPlus' reference buildings as plants, by its runtime interface (extra ``[energyplus]``)."""

from mpc.adapters.energyplus.building import EnergyPlusBuilding, energyplus_building
from mpc.adapters.energyplus.install import CHICAGO, reference_buildings, weather_files
from mpc.adapters.energyplus.layout import AirLoop, PlantLayout, Terminal, WaterLoop
from mpc.adapters.energyplus.make import OFFICE_COMFORT, energyplus_plant, energyplus_scenario
from mpc.adapters.energyplus.plant import EnergyPlusPlant
from mpc.adapters.energyplus.system import controller_system

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
