"""What spoilt inputs are put to beside files: both servers, and a controller of the bundled building."""

from __future__ import annotations

import json
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _fuzz_inputs import odd, spoil_bytes, spoil_frame, spoil_tree

from mpc.control.controller.controller import MpcController
from mpc.control.controller.observer import Observer
from mpc.control.controller.site import SitePoints
from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import supply_channels
from mpc.control.problem.horizon import Horizon
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.sequential import SequentialSolver
from mpc.scenario.forecast import Forecast
from thermal import errors, load_bundled_case
from thermal.case.load import load_building
from thermal.errors import Described


class Served:
    """Both servers in this process, asked without a network.

    Parameters
    ----------
    folder : Path
        Case that is on the page.
    codes : bytes
        Drawing of codes that floors are made of.
    """

    def __init__(self, folder: Path, codes: bytes) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # newer versions of starlette prefer another client to httpx
            from starlette.testclient import TestClient

        from mpc.adapters.boptest.app import Guard, HeldTests, create_app
        from mpc.adapters.boptest.make import pilot_to_serve
        from thermal.plan.page import serve
        from thermal.plan.page.desk import LabelDesk
        from thermal.plan.page.draft import draft_of

        self.desk = LabelDesk(folder)
        self.page = TestClient(serve.create_app(self.desk, "t"), base_url="http://127.0.0.1:1")
        self.page.post("/t/api/session", json={"window": "w"})
        case = pilot_to_serve(1, floor_area=300.0, zones=6, floors=1, dx=1.0, days=4.0, name="small")
        tests = HeldTests([case])
        self.plant = TestClient(Guard(create_app(tests)), base_url="http://127.0.0.1:1")
        draft = json.loads(draft_of(load_building(folder)).model_dump_json(by_alias=True))
        (self.desk.store.own / "drawings" / "codes.csv").write_bytes(codes)
        entry = {"name": "F2", "file": "codes.csv", "height": 3.0, "cell_size": 1.0}
        floor = {"floors": [entry], "cell_size": 1.0}
        listed = list(case.signals.input_metadata())[:4]
        inputs = {name: 1 if name.endswith("_activate") else 290.0 for name in listed}
        self.asked: list[tuple[str, str, Any]] = [
            ("PUT", "/t/api/draft?window=w", draft), ("POST", "/t/api/session", {"window": "w", "previous": "v"}),
            ("POST", "/t/api/floors?window=w", floor), ("DELETE", "/t/api/drawings/{}?window=w", None),
            ("GET", "/t/api/drawings/{}", None), ("GET", "/t/api/pictures/{}", None), ("GET", "/t/api/jobs/{}", None),
            ("POST", "/t/api/jobs/{}/stop", None), ("GET", "/t/reports/{}/{}", None), ("GET", "/t/static/{}", None),
            ("PUT", "/initialize", {"start_time": 86400.0, "warmup_period": 0.0}), ("PUT", "/step", {"step": 300.0}),
            ("PUT", "/scenario", {"electricity_price": "constant", "time_period": "mix_day"}),
            ("PUT", "/forecast", {"point_names": ["TDryBul"], "horizon": 3600, "interval": 900}),
            ("PUT", "/results", {"point_names": list(inputs), "start_time": 0.0, "final_time": 90000.0}),
            ("POST", "/advance", inputs), ("POST", "/testcases/{}/select", {}), ("GET", "/name/{}", None),
        ]  # fmt: skip

    def ask(self, rng: np.random.Generator) -> None:
        """Ask something spoilt; a refusal is raised as a named error, a failure as it is."""
        number = 0 if rng.random() < 0.2 else int(rng.integers(len(self.asked)))  # a draft is the largest of all
        method, path, body = self.asked[number]
        client = self.page if path.startswith("/t/") else self.plant
        while "{}" in path:
            word = "".join(f"%{byte:02x}" for byte in str(odd(rng)).encode("utf-8", "replace"))
            path = path.replace("{}", word, 1)
        if body is not None and path.startswith("/t/api/draft"):
            body = body | {"revision": self.desk.store.draft.revision}
        content = b"" if body is None else _text(spoil_tree(body, rng))
        content = spoil_bytes(content, rng) if rng.random() < 0.2 else content
        answer = client.request(method, path, content=content, headers={"content-type": "application/json"})
        if answer.status_code >= 500 and answer.status_code != 503:
            raise RuntimeError(f"status {answer.status_code}: {answer.text[:300]}")
        if answer.status_code >= 400:
            raise RefusedError(answer.text[:200])
        if "/api/floors" in path:
            self._wait(answer.json()["number"])

    def _wait(self, number: int) -> None:
        """Wait for a job; its failure is a refusal where it is one of the library's."""
        while (job := self.page.get(f"/t/api/jobs/{number}").json())["state"] in ("waiting", "runs"):
            time.sleep(0.002)
        if job["state"] == "failed":
            kind = RefusedError if hasattr(errors, job["error"]["error"]) else RuntimeError
            raise kind(f"{job['error']['error']}: {job['error']['message'][:200]}")

    def close(self) -> None:
        """End what was begun."""
        self.desk.end()


class RefusedError(Described, Exception):
    """A server's answer with a status of 400 to 499, or that it is full."""


def _text(content: Any) -> bytes:
    return json.dumps(content).encode("utf-8", "replace")


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
