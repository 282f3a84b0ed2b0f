"""Plants that controllers are tested on: our own building and plant in closed loop, and what all plants share."""

from mpc.plants._actuators import ACTION_LIMITS, Actuator
from mpc.plants._building import BuildingFlows, BuildingModel, BuildingStep, GridBuilding
from mpc.plants._extras import RadiantGains
from mpc.plants._history import RecentSteps, SystemBalance
from mpc.plants._make import pilot_weather, save_pilot, simulated_plant
from mpc.plants._noise import SensorNoise
from mpc.plants._operation import Operation, scheduled_operation
from mpc.plants._plant import Controller, Measurements, Plant, PointLayout, RestorablePlant
from mpc.plants._reduced import ReducedBuilding, reduced_building
from mpc.plants._replay import SubsystemGap, SubsystemReplay, replay_subsystems
from mpc.plants._run import ClosedLoopRun, FixedSetpoints, run_closed_loop
from mpc.plants._sensors import PlantDevices
from mpc.plants._simulated import SimulatedPlant
from thermal.pilot import pilot_building

__all__ = [
    "ACTION_LIMITS",
    "Actuator",
    "BuildingFlows",
    "BuildingModel",
    "BuildingStep",
    "ClosedLoopRun",
    "Controller",
    "FixedSetpoints",
    "GridBuilding",
    "Measurements",
    "Operation",
    "Plant",
    "PlantDevices",
    "PointLayout",
    "RadiantGains",
    "RecentSteps",
    "ReducedBuilding",
    "RestorablePlant",
    "SensorNoise",
    "SimulatedPlant",
    "SubsystemGap",
    "SubsystemReplay",
    "SystemBalance",
    "pilot_building",
    "pilot_weather",
    "reduced_building",
    "replay_subsystems",
    "run_closed_loop",
    "save_pilot",
    "scheduled_operation",
    "simulated_plant",
]
