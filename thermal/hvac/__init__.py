"""Heating, ventilation and air conditioning: the plant of a building, for simulation and for control."""

from thermal.errors import HvacActionError, HvacError, HvacParameterError
from thermal.hvac._air_handler import AirHandler, Heater, Mixed, Warmed
from thermal.hvac._balance import EnergyBalance, energy_balance
from thermal.hvac._boiler import BoilerLoop, Heated, Pump
from thermal.hvac._coil import WaterCoil
from thermal.hvac._cooling import Cooled, CoolingCoil
from thermal.hvac._curves import (
    CHILLER_CAPACITY,
    CHILLER_INPUT,
    CHILLER_PART_LOAD,
    CONDENSING_BOILER,
    CONSTANT_EFFICIENCY,
    DX_CAPACITY,
    DX_INPUT,
    DX_PART_LOAD,
    FAN_PART_LOAD,
    ORDINARY_BOILER,
    Biquadratic,
    Polynomial,
)
from thermal.hvac._fan import Fan
from thermal.hvac._plant import HvacPlant, HvacState
from thermal.hvac._points import HvacPoints
from thermal.hvac._replay import (
    AirHandlerReplay,
    LoopReplay,
    TerminalReplay,
    replay_air_handler,
    replay_loop,
    replay_reheat,
    replay_terminals,
)
from thermal.hvac._smooth import HvacSlopes, HvacStepper, KnobLayout, SmoothHvac
from thermal.hvac._step import Actions, Calls, Conditions, HvacStep
from thermal.hvac._symbolic import hvac_function
from thermal.hvac._system import HvacSystem
from thermal.hvac._terminals import Terminals
from thermal.hvac._thermostat import Mode, Thermostat

__all__ = [
    "CHILLER_CAPACITY",
    "CHILLER_INPUT",
    "CHILLER_PART_LOAD",
    "CONDENSING_BOILER",
    "CONSTANT_EFFICIENCY",
    "DX_CAPACITY",
    "DX_INPUT",
    "DX_PART_LOAD",
    "FAN_PART_LOAD",
    "ORDINARY_BOILER",
    "Actions",
    "AirHandler",
    "AirHandlerReplay",
    "Biquadratic",
    "BoilerLoop",
    "Calls",
    "Conditions",
    "Cooled",
    "CoolingCoil",
    "EnergyBalance",
    "Fan",
    "Heated",
    "Heater",
    "HvacActionError",
    "HvacError",
    "HvacParameterError",
    "HvacPlant",
    "HvacPoints",
    "HvacSlopes",
    "HvacState",
    "HvacStep",
    "HvacStepper",
    "HvacSystem",
    "KnobLayout",
    "LoopReplay",
    "Mixed",
    "Mode",
    "Polynomial",
    "Pump",
    "SmoothHvac",
    "TerminalReplay",
    "Terminals",
    "Thermostat",
    "Warmed",
    "WaterCoil",
    "energy_balance",
    "hvac_function",
    "replay_air_handler",
    "replay_loop",
    "replay_reheat",
    "replay_terminals",
]
