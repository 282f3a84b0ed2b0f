"""The bundled case's building with a plant of its size, and horizons of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from mpc.control.controller.site import SitePoints
from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import Channel, supply_channels
from mpc.control.problem.horizon import Horizon, HorizonData, PeakData
from mpc.control.problem.problem import ControlProblem
from mpc.scenario.forecast import Forecast
from mpc.scenario.scenario import zone_areas
from thermal import SymbolicModel, build_network, load_bundled_case, reduced_model
from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.cooling_coil import CoolingCoil
from thermal.components.fan import Fan
from thermal.components.pump import Pump
from thermal.components.terminals import Terminals
from thermal.components.water_coil import WaterCoil
from thermal.model.modal import ModalModel, modal_model
from thermal.system.smooth import SmoothHvac
from thermal.system.system import HvacSystem, vav_system

START = pd.Timestamp("2023-01-16 06:00", tz="Etc/GMT+8")
DataMaker = Callable[..., HorizonData]


@pytest.fixture(scope="session")
def modes() -> ModalModel:
    """Modes of the bundled building, a few."""
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
    small = reduced_model(grid, [grid.network.start()], order=25)
    return modal_model(small.matrices(small.theta))


@pytest.fixture(scope="session")
def system(modes: ModalModel) -> HvacSystem:
    """One air handler, a terminal a zone."""
    areas = zone_areas(load_bundled_case().building)
    terminals = Terminals.sized(4e-3 * areas, 60.0 * areas)
    flow = float(4e-3 * areas.sum())
    coil = WaterCoil.sized(8.0 * 1006.0 * flow, flow)
    handler = AirHandler(Fan(flow, 900.0), Fan(flow, 300.0, 100.0), CoolingCoil(15.0 * 1006.0 * flow), coil)
    pump = Pump(float(terminals.water_flow.sum()) + coil.water_flow)
    return vav_system((handler,), BoilerLoop(120.0 * areas.sum(), pump, water_volume=0.1), terminals)


@pytest.fixture(scope="session")
def hvac(system: HvacSystem) -> SmoothHvac:
    return SmoothHvac(system)


@pytest.fixture(scope="session")
def make_problem(modes: ModalModel, hvac: SmoothHvac) -> Callable[..., ControlProblem]:
    def make(horizon: Horizon | None = None, channels: tuple[Channel, ...] | None = None, **options) -> ControlProblem:
        chosen = horizon or Horizon.growing([(1.0, 300.0), (2.0, 900.0)], [0.5, 0.5, 1.0, 1.0])
        return ControlProblem(Predictor(modes, hvac, chosen, channels or supply_channels(), 6 * 3600.0), **options)

    return make


@pytest.fixture(scope="session")
def make_data(modes: ModalModel) -> DataMaker:
    def make(problem: ControlProblem, outdoor: float = 276.0, zone: float = 292.5, **other) -> HorizonData:
        count, n = len(problem.predictor.horizon), problem.predictor.n_zone
        ones, each = np.ones((count, n)), np.ones(count)
        given = dict(
            state=modes.uniform * (zone - 293.15), water=325.0, disturbance=np.full(n, 40.0),
            previous=np.array([288.0, 330.0])[: problem.shape[1]], boundary=np.full((count, 1), outdoor),
            outdoor_temperature=outdoor * each, outdoor_humidity=0.003 * each, gains=150.0 * ones, lower=294.15 * ones,
            upper=297.15 * ones, heating_setpoint=294.65 * ones, cooling_setpoint=296.65 * ones,
            running=np.ones((count, 1)), ventilation=np.ones((count, 1)), boiler=each,
            electricity_price=np.linspace(0.1, 0.3, count), gas_price=0.05 * each, comfort_price=0.3 * ones,
            peaks=PeakData.none(count),
        )  # fmt: skip
        return HorizonData(**(given | other))

    return make


@pytest.fixture(scope="session")
def points() -> SitePoints:
    zones = load_bundled_case().building.zone_names
    terminals = tuple(f"VAV_{zone}" for zone in zones)
    return SitePoints(zones, terminals, ("AHU",), "BOILER", "weather_station", ("AHU/electrical_power_sensor",))


@pytest.fixture(scope="session")
def make_forecast(points: SitePoints) -> Callable[..., Forecast]:
    def make(start: pd.Timestamp = START, count: int = 48) -> Forecast:
        stamps = pd.date_range(start, periods=count + 1, freq="5min")[1:]
        table = pd.DataFrame(index=stamps)
        table["outside_air_temperature_sensor"] = 276.0
        table["electricity_price"], table["gas_price"] = np.where(stamps.hour < 7, 0.1, 0.3), 0.05
        occupied = stamps > START + pd.Timedelta(hours=1)
        for zone in points.zones:
            table[f"{zone}/internal_gain"] = np.where(occupied, 300.0, 30.0)
            table[f"{zone}/comfort_lower_temperature"] = np.where(occupied, 294.15, 288.15)
            table[f"{zone}/comfort_upper_temperature"] = np.where(occupied, 297.15, 303.15)
        return Forecast(table)

    return make
