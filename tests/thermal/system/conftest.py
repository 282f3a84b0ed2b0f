"""Small plants."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import settings

from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.cooling_coil import CoolingCoil
from thermal.components.fan import Fan
from thermal.components.heater import Heater
from thermal.components.pump import Pump
from thermal.components.terminals import Terminals
from thermal.components.water_coil import WaterCoil
from thermal.system.system import HvacSystem, vav_system

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
    return vav_system(parts, BoilerLoop(15_000.0 * float(flows.sum()), pump, water_volume=0.3), terminals)


@pytest.fixture(scope="session")
def plant_system() -> HvacSystem:
    """Five terminals on two air handlers with water coils."""
    return system_of(FLOWS, HANDLERS)


@pytest.fixture(scope="session")
def gas_system() -> HvacSystem:
    """The same, one air handler, its coil burning gas."""
    return system_of(FLOWS, np.zeros(5, dtype=int), Heater(20_000.0))


def told(
    system: HvacSystem, air: Any, water: Any, static: Any = None, pressure: Any = None, running: Any = 1.0,
    boiler: Any = 1.0, ventilation: Any = 1.0,
) -> dict[str, Any]:  # fmt: skip
    """Actions of a supervisory controller [K], [Pa], [-]; pressures are those of the design where none is given."""
    given = {
        "supply_air_temperature_setpoint": air, "supply_water_temperature_setpoint": water, "fan_running": running,
        "boiler_running": boiler, "ventilation": ventilation,
    }  # fmt: skip
    pressures = {"supply_air_static_pressure_setpoint": static, "differential_pressure_setpoint": pressure}
    return system.actions(**given, **{point: value for point, value in pressures.items() if value is not None})


@pytest.fixture(scope="session")
def command() -> Callable[..., dict[str, Any]]:
    """Make actions of a system."""
    return told
