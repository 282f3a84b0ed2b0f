"""A small plant, and one of the pilot's size."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import settings

from thermal.hvac._air_handler import AirHandler, Heater
from thermal.hvac._boiler import BoilerLoop, Pump
from thermal.hvac._coil import WaterCoil
from thermal.hvac._cooling import CoolingCoil
from thermal.hvac._fan import Fan
from thermal.hvac._system import HvacSystem
from thermal.hvac._terminals import Terminals

# the same examples at each run, and as long as a busy machine takes for them
settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")

FLOWS = np.array([0.3, 0.5, 0.2, 0.8, 0.4])  # kg/s
HANDLERS = np.array([0, 1, 0, 1, 1])


def air_handler(flow: float, heating: object = "water") -> AirHandler:
    """Air handler for a design flow [kg/s]."""
    coil = WaterCoil.sized(8.0 * 1006.0 * flow, flow) if heating == "water" else heating
    fans = Fan(0.9 * flow, 900.0), Fan(0.9 * flow, 300.0, 100.0, heat_to_air=0.8)
    return AirHandler(*fans, CoolingCoil(15.0 * 1006.0 * flow), coil)


def system_of(flows: np.ndarray, handlers: np.ndarray, heating: object = "water") -> HvacSystem:
    """Plant whose terminals have the design flows [kg/s] and hang on these air handlers."""
    terminals = Terminals.sized(flows, 9000.0 * flows, air_handler=handlers)
    parts = tuple(air_handler(flows[handlers == k].sum(), heating) for k in range(handlers.max() + 1))
    pump = Pump(float(terminals.water_flow.sum()) + 1.0)
    return HvacSystem(parts, BoilerLoop(15_000.0 * float(flows.sum()), pump, water_volume=0.3), terminals)


@pytest.fixture(scope="session")
def plant_system() -> HvacSystem:
    """Five terminals on two air handlers with water coils."""
    return system_of(FLOWS, HANDLERS)


@pytest.fixture(scope="session")
def gas_system() -> HvacSystem:
    """The same, one air handler, its coil burning gas."""
    return system_of(FLOWS, np.zeros(5, dtype=int), Heater(20_000.0))


@pytest.fixture(scope="session")
def pilot_system() -> HvacSystem:
    """123 terminals on three air handlers."""
    flows = np.random.default_rng(0).uniform(0.1, 0.6, 123)
    return system_of(flows, np.arange(123) % 3)
