"""A controller of the bundled building that is given spoilt readings, forecasts and times."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from _fuzz_inputs import odd, spoil_frame

from mpc.control.controller.controller import MpcController
from mpc.control.controller.observer import Observer
from mpc.control.controller.site import SitePoints
from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import supply_channels
from mpc.control.problem.horizon import Horizon
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.sequential import SequentialSolver
from mpc.scenario.forecast import Forecast
from thermal import load_bundled_case


class Controlled:
    """An optimal controller of the bundled building, and readings and forecasts of it."""

    def __init__(self) -> None:
        from calibration import DisturbanceModel, KalmanFilter
        from calibration.estimation.state_space import state_space
        from mpc.scenario.scenario import zone_areas
        from thermal import SymbolicModel, build_network, reduced_model
        from thermal.components.air_handler import AirHandler
        from thermal.components.boiler_loop import BoilerLoop
        from thermal.components.cooling_coil import CoolingCoil
        from thermal.components.fan import Fan
        from thermal.components.pump import Pump
        from thermal.components.terminals import Terminals
        from thermal.components.water_coil import WaterCoil
        from thermal.model.modal import modal_model
        from thermal.system.smooth import SmoothHvac
        from thermal.system.system import vav_system

        building = load_bundled_case().building
        grid = SymbolicModel(build_network(building, dx=1.0))
        small = reduced_model(grid, [grid.network.start()], order=15)
        modes, areas = modal_model(small.matrices(small.theta)), zone_areas(building)
        terminals, flow = Terminals.sized(4e-3 * areas, 60.0 * areas), float(4e-3 * areas.sum())
        coil = WaterCoil.sized(8.0 * 1006.0 * flow, flow)
        handler = AirHandler(Fan(flow, 900.0), Fan(flow, 300.0, 100.0), CoolingCoil(15.0 * 1006.0 * flow), coil)
        pump = Pump(float(terminals.water_flow.sum()) + coil.water_flow)
        hvac = SmoothHvac(vav_system((handler,), BoilerLoop(120.0 * areas.sum(), pump, water_volume=0.1), terminals))
        horizon = Horizon.growing([(0.5, 300.0), (1.0, 900.0)], [0.5, 1.0])
        solver = SequentialSolver(ControlProblem(Predictor(modes, hvac, horizon, supply_channels(), 6 * 3600.0)))
        kalman = KalmanFilter(state_space(modes, 300.0), DisturbanceModel(100.0, 6 * 3600.0, 0.05))
        zones = building.zone_names
        names = tuple(f"VAV_{zone}" for zone in zones)
        points = SitePoints(zones, names, ("AHU",), "BOILER", "station", ("AHU/electrical_power_sensor",))
        self.controller = MpcController(solver, Observer(kalman, modes), points)
        self.now, self.zones = pd.Timestamp("2023-01-16 06:00", tz="Etc/GMT+8"), zones
        self.seen: dict[str, Any] = {column: 294.0 for column in points.columns}
        self.seen |= {column: 0.05 for column in points.columns if "flowrate" in column}

    def ahead(self) -> pd.DataFrame:
        """Forecast the next two hours."""
        stamps = pd.date_range(self.now, periods=25, freq="5min")[1:]
        usual = {"outside_air_temperature_sensor": 276.0, "electricity_price": 0.2, "gas_price": 0.05}
        for zone in self.zones:
            usual |= {f"{zone}/internal_gain": 100.0, f"{zone}/comfort_lower_temperature": 294.0}
            usual |= {f"{zone}/comfort_upper_temperature": 297.0}
        return pd.DataFrame(usual, index=stamps)

    def step(self, rng: np.random.Generator) -> None:
        """Take a step with spoilt readings, forecast or time."""
        self.now += pd.Timedelta(minutes=5)
        seen, forecast = dict(self.seen), self.ahead()
        now: Any = self.now
        for name in rng.choice(list(seen), int(rng.integers(0, 5)), replace=False):
            seen[str(name)] = odd(rng)
        part = rng.random()
        if part < 0.3:
            forecast = spoil_frame(forecast, rng)
        elif part < 0.4:
            now = pd.Timestamp(str(rng.choice(["NaT", "2023-01-16", "1800-01-01", "2250-01-01T00:00Z"])))
        action = self.controller.step(seen, Forecast(forecast) if rng.random() < 0.9 else None, now)
        values = np.array(list(action.values()))
        if not np.isfinite(values).all():
            raise RuntimeError(f"setpoints {values}")
