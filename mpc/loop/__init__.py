"""Plants that controllers are tested on: our own building and plant in closed loop, and what all plants share."""

from mpc.loop.actuators import ACTION_LIMITS, Actuator
from mpc.loop.building import BuildingFlows, BuildingModel, BuildingStep, GridBuilding
from mpc.loop.extras import RadiantGains
from mpc.loop.history import RecentSteps, SystemBalance
from mpc.loop.make import pilot_weather, save_pilot, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.operation import Operation, scheduled_operation
from mpc.loop.plant import Controller, Measurements, Plant, PointLayout, RestorablePlant
from mpc.loop.reduced import ReducedBuilding, reduced_building
from mpc.loop.replay import SubsystemGap, SubsystemReplay, replay_subsystems
from mpc.loop.run import ClosedLoopRun, FixedSetpoints, run_closed_loop
from mpc.loop.sensors import PlantDevices
from mpc.loop.simulated import SimulatedPlant
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
