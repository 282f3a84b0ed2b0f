"""The generated building of the pilot's size, and a plant for its zones, as benchmarks of speed use them."""

from __future__ import annotations

import numpy as np

from thermal import Building
from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.cooling_coil import CoolingCoil
from thermal.components.fan import Fan
from thermal.components.pump import Pump
from thermal.components.terminals import Terminals
from thermal.components.water_coil import WaterCoil
from thermal.pilot.building import devices, generate_office
from thermal.pilot.weather import MOUNTAIN_VIEW
from thermal.system.system import HvacSystem, vav_system

SEED = 0


def pilot() -> Building:
    """Make the generated pilot building, without telemetry."""
    plans = generate_office(SEED)
    return Building("pilot", MOUNTAIN_VIEW, 0.0, plans, devices(plans), (), "weather_station")


def plant_of(areas: np.ndarray) -> HvacSystem:
    """Plant with an air handler for each half of the zones."""
    flows, handler = 3.5e-3 * areas, (np.arange(len(areas)) >= len(areas) // 2).astype(int)
    terminals = Terminals.sized(flows, 45.0 * areas, air_handler=handler)
    parts = []
    for k in (0, 1):
        flow = float(flows[handler == k].sum())
        fans = Fan(0.9 * flow), Fan(0.9 * flow, 300.0, 100.0)
        coil = WaterCoil.sized(8.0 * 1006.0 * flow, flow)
        parts.append((AirHandler(*fans, CoolingCoil(15.0 * 1006.0 * flow), coil), coil))
    pump = Pump(float(terminals.water_flow.sum()) + sum(coil.water_flow for _, coil in parts))
    return vav_system(tuple(handler for handler, _ in parts), BoilerLoop(80.0 * areas.sum(), pump), terminals)
