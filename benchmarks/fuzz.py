"""Spoilt inputs of all kinds: whatever comes in, it is taken or refused by a named error of the library.

Six kinds of input: case folders and lists of drawings as YAML, plans and drawings, telemetry as CSV and as Parquet
(of a case, and from a foreign table), bodies of requests to both servers, and steps of a controller. Each input is a
valid one spoilt in a few places (`_fuzz_inputs.py`) by a seed of its own. It may be accepted, or refused by an error of
the library's families (a status of 400 to 499 with a message, for a server); anything else that is raised, a status of
500, or a controller without finite setpoints is a fault, and is listed with its seed.

Run: ``nice -n 10 python benchmarks/fuzz.py --inputs 20000 --out results/fuzz --publish``; five minutes of CPU.
Writes ``fuzz.json`` and ``fuzz.md``.
"""

from __future__ import annotations

import argparse
import io
import json
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from _fuzz_inputs import odd, spoil_bytes, spoil_frame, spoil_plan, spoil_tree
from _table import markdown, write

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
from thermal.case.load import load_building, load_case
from thermal.case.quality import assess
from thermal.errors import Described
from thermal.intake.telemetry import ImportSettings, import_telemetry
from thermal.plan.list import read_drawing_list, read_floor

Fuzzer = Callable[[np.random.Generator, Path], None]

PLAN = "\n".join(",".join(row) for row in (".......", ".#####.", ".#A+B#.", ".#A+B#.", ".#####.", ".......")) + "\n"
SITE = {"latitude": 42.0, "longitude": -88.0, "elevation": 10.0, "timezone": "Europe/Berlin"}
STAMPS = pd.date_range("2023-03-01T00:10", periods=24, freq="10min", tz="UTC", name="timestamp")
PLANS: dict[str, Any] = {
    "format": 3, "name": "two rooms", "location": SITE, "orientation": 10.0, "cell_size": 1.0,
    "floors": [{"name": "F1", "height": 3.0, "plan": "plan.csv"}], "glazing": {"A": {"south": 1.0}},
    "devices": [{"name": "VAV", "type": "vav", "zone": "A"}, {"name": "RAD", "type": "radiator", "zone": "B"}],
    "weather_station": "station", "telemetry": "telemetry.csv",
    "units": {"zone_air_temperature_sensor": "degC", "supply_air_flowrate_sensor": "m^3/h",
              "discharge_air_temperature_sensor": "degF", "outside_air_temperature_sensor": "degC"},
}  # fmt: skip
TABLE: dict[str, Any] = {key: PLANS[key] for key in ("format", "name", "location", "weather_station", "telemetry")} | {
    "units": PLANS["units"], "devices": PLANS["devices"],
    "zones": [{"name": "A", "volume": 60.0, "floor_area": 20.0}, {"name": "B", "volume": 60.0, "floor_area": 20.0}],
    "surfaces": [
        {"name": "W", "kind": "wall", "zone": "A", "other": "outdoor", "area": 30.0, "construction": "brick",
         "azimuth": 180.0},
        {"name": "P", "kind": "bridge", "zone": "A", "other": "B", "area": 9.0, "u_value": 1.0},
        {"name": "S", "kind": "bridge", "zone": "B", "other": "outdoor", "area": 9.0, "u_value": 1.0},
    ],
    "constructions": {"brick": [{"thickness": 0.2, "conductivity": 0.7, "density": 1700.0, "heat_capacity": 840.0}]},
}  # fmt: skip
LIST: dict[str, Any] = {
    "format": 1, "name": "house", "location": SITE, "orientation": 5.0, "cell_size": 0.5,
    "floors": [{"name": "F1", "file": "plan.csv", "height": 3.0, "cell_size": 0.5, "scale": {"metres_per_pixel": 0.1},
                "crop": [0, 0, 5, 5], "names": {"hall": [2.0, 2.0]}, "widest_door": 1.0}],
}  # fmt: skip


def telemetry() -> pd.DataFrame:
    """Two hours of a small building, in the units of its case."""
    wave = np.sin(np.arange(len(STAMPS)) / 3.0)
    return pd.DataFrame({
        "station/outside_air_temperature_sensor": 5.0 + 3.0 * wave, "VAV/zone_air_temperature_sensor": 20.0 + wave,
        "VAV/supply_air_flowrate_sensor": 300.0 + 50.0 * wave, "VAV/discharge_air_temperature_sensor": 80.0 + wave,
        "B/zone_air_temperature_sensor": 21.0 - wave,
    }, index=STAMPS)  # fmt: skip


def write_case(folder: Path, content: Any = None, plan: bytes | None = None, table: bytes | None = None) -> Path:
    """Write a case folder of parts, which may be spoilt."""
    text = content if isinstance(content, bytes) else yaml.safe_dump(PLANS if content is None else content).encode()
    (folder / "building.yaml").write_bytes(text)
    (folder / "plan.csv").write_bytes(PLAN.encode() if plan is None else plan)
    (folder / "telemetry.csv").write_bytes(telemetry().to_csv().encode() if table is None else table)
    return folder


def fuzz_yaml(rng: np.random.Generator, folder: Path) -> None:
    """Case folders by their `building.yaml`, and lists of drawings."""
    base = (PLANS, TABLE, LIST)[int(rng.integers(3))]
    whole = rng.random() < 0.7
    text = yaml.safe_dump(spoil_tree(base, rng) if whole else base, sort_keys=False, allow_unicode=True)
    content = text.encode("utf-8", "replace")
    content = content if whole else spoil_bytes(content, rng)
    if base is LIST:
        (folder / "list.yaml").write_bytes(content)
        read_drawing_list(folder / "list.yaml")
        return
    _look(write_case(folder, content))


def _look(folder: Path) -> None:
    """Read a case as `check` does: all of it, with what is worth a remark."""
    case = load_case(folder)
    assert case.quality is not None and isinstance(case.remarks, tuple)  # noqa: S101


@cache
def drawings() -> dict[str, bytes]:
    """Small drawings of each kind that needs no further package."""
    codes = np.array([list(row.replace(",", "")) for row in PLAN.split()])
    image, packed = io.BytesIO(), io.BytesIO()
    numbers = np.select([codes == ".", np.isin(codes, ["#", "+"])], [2, 1], 0)
    np.save(packed, numbers)
    made = {"codes.npy": packed.getvalue(), "codes.csv": "\n".join(",".join(map(str, r)) for r in numbers).encode()}
    try:
        from PIL import Image
    except ImportError:
        return made
    grey = np.kron(np.where(codes == "#", 0, 255), np.ones((12, 12))).astype(np.uint8)
    Image.fromarray(grey).save(image, "PNG")
    return made | {"sheet.png": image.getvalue()}


def fuzz_plans(rng: np.random.Generator, folder: Path) -> None:
    """Plans of a case, and drawings that become floors."""
    if rng.random() < 0.6:
        plan = spoil_plan(PLAN, rng) if rng.random() < 0.7 else spoil_bytes(PLAN.encode(), rng)
        load_building(write_case(folder, None, plan))
        return
    name, data = list(drawings().items())[int(rng.integers(len(drawings())))]
    (folder / name).write_bytes(spoil_bytes(data, rng))
    entry = LIST["floors"][0] | {"file": name}
    entry = {key: value for key, value in entry.items() if key not in ("crop", "names")}
    if rng.random() < 0.5:
        entry = spoil_tree(entry, rng)
    (folder / "list.yaml").write_bytes(yaml.safe_dump(LIST | {"floors": [entry]}).encode("utf-8", "replace"))
    read_floor(read_drawing_list(folder / "list.yaml").floors[0], folder)


def fuzz_csv(rng: np.random.Generator, folder: Path) -> None:
    """Telemetry of a case as CSV, and foreign tables."""
    text = spoil_frame(telemetry(), rng).to_csv() if rng.random() < 0.5 else telemetry().to_csv()
    table = spoil_bytes(text.encode("utf-8", "replace"), rng)
    if rng.random() < 0.7:
        _look(write_case(folder, None, None, table))
    else:
        _import(folder, table, "export.csv")


def fuzz_parquet(rng: np.random.Generator, folder: Path) -> None:
    """Telemetry of a case as Parquet, and foreign tables."""
    stream = io.BytesIO()
    try:
        frame = spoil_frame(telemetry(), rng)
        (frame if rng.random() < 0.7 else frame.reset_index()).to_parquet(stream)
    except Exception:  # it cannot be written as Parquet: another one
        stream = io.BytesIO()
        telemetry().to_parquet(stream)
    table = stream.getvalue() if rng.random() < 0.7 else spoil_bytes(stream.getvalue(), rng)
    if rng.random() < 0.7:
        write_case(folder, PLANS | {"telemetry": "telemetry.parquet"})
        (folder / "telemetry.parquet").write_bytes(table)
        _look(folder)
    else:
        _import(folder, table, "export.parquet")


def _import(folder: Path, table: bytes, name: str) -> None:
    (folder / name).write_bytes(table)
    building = load_building(write_case(folder))
    found = import_telemetry(building, str(folder / name), ImportSettings(timezone="Europe/Berlin"))
    assess(found.telemetry, building)


class Served:
    """Both servers in this process, asked without a network."""

    def __init__(self, folder: Path) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # newer versions of starlette prefer another client to httpx
            from starlette.testclient import TestClient

        from mpc.adapters.boptest.app import Guard, HeldTests, create_app
        from mpc.adapters.boptest.make import pilot_to_serve
        from thermal.plan.page import serve
        from thermal.plan.page.desk import LabelDesk
        from thermal.plan.page.draft import draft_of

        write_case(folder)
        self.desk = LabelDesk(folder)
        self.page = TestClient(serve.create_app(self.desk, "t"), base_url="http://127.0.0.1:1")
        self.page.post("/t/api/session", json={"window": "w"})
        case = pilot_to_serve(1, floor_area=300.0, zones=6, floors=1, dx=1.0, days=4.0, name="small")
        tests = HeldTests([case])
        self.plant = TestClient(Guard(create_app(tests)), base_url="http://127.0.0.1:1")
        draft = json.loads(draft_of(load_building(folder)).model_dump_json(by_alias=True))
        (self.desk.store.own / "drawings" / "codes.csv").write_bytes(drawings()["codes.csv"])
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


@dataclass
class Outcome:
    """What became of the inputs of a kind."""

    inputs: int = 0
    accepted: int = 0
    refused: int = 0
    slowest: float = 0.0
    faults: list[dict[str, Any]] = field(default_factory=list)


@contextmanager
def fuzzers() -> Iterator[dict[str, Fuzzer]]:
    """All kinds of input, ready to be asked; names as in the table."""
    with ExitStack() as stack:
        served = Served(Path(stack.enter_context(tempfile.TemporaryDirectory())))
        stack.callback(served.close)
        stack.enter_context(served.page)
        stack.enter_context(served.plant)
        controlled = Controlled()
        yield {
            "YAML of cases and lists of drawings": fuzz_yaml,
            "plans and drawings": fuzz_plans,
            "telemetry as CSV": fuzz_csv,
            "telemetry as Parquet": fuzz_parquet,
            "requests to the servers": lambda rng, folder: served.ask(rng),
            "steps of a controller": lambda rng, folder: controlled.step(rng),
        }


def attack(count: int, first: int = 0) -> dict[str, Outcome]:
    """Try a number of inputs, shared out over the kinds; seeds count up from `first`."""
    outcomes: dict[str, Outcome] = {}
    with fuzzers() as kinds, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a number that is too large is told by the refusal, not by numpy
        for number, (name, fuzzer) in enumerate(kinds.items()):
            outcome = outcomes[name] = Outcome()
            share = count // len(kinds) + (number < count % len(kinds))
            for seed in range(first, first + share):
                _try(fuzzer, number, seed, outcome)
    return outcomes


def _try(fuzzer: Fuzzer, number: int, seed: int, outcome: Outcome) -> None:
    """Try an input, and count what becomes of it."""
    outcome.inputs += 1
    with tempfile.TemporaryDirectory() as folder:
        begin = time.process_time()
        try:
            fuzzer(np.random.default_rng([number, seed]), Path(folder))
            outcome.accepted += 1
        except Exception as error:
            if isinstance(error, Described):
                outcome.refused += 1
                return
            last = traceback.extract_tb(error.__traceback__)[-1]
            ours = [f for f in traceback.extract_tb(error.__traceback__) if "site-packages" not in f.filename]
            place = f"{Path(ours[-1].filename).name}:{ours[-1].lineno}" if ours else f"{last.filename}:{last.lineno}"
            text = f"{type(error).__name__}: {error}"[:300]
            outcome.faults.append({"seed": [number, seed], "error": text, "place": place})
        finally:
            outcome.slowest = max(outcome.slowest, time.process_time() - begin)


def main() -> int:
    """Attack, print and write the table; 1 where there is a fault."""
    parser = argparse.ArgumentParser(description="spoilt inputs of all kinds")
    parser.add_argument("--inputs", type=int, default=20_000, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    parser.add_argument("--out", type=Path, default=Path("results/fuzz"), metavar="DIR")
    parser.add_argument("--publish", action="store_true", help="put the table into docs/validation.md")
    args = parser.parse_args()
    outcomes = attack(args.inputs, args.first)
    rows: list[list[Any]] = [
        [n, o.inputs, o.accepted, o.refused, len(o.faults), round(o.slowest, 2)] for n, o in outcomes.items()
    ]
    totals = [sum(row[k] for row in rows) for k in range(1, 5)]
    rows.append(["all", *totals, max(row[5] for row in rows)])
    columns = ["input", "tried", "accepted", "refused by name", "any other error", "slowest [s of CPU]"]
    data = {"first_seed": args.first, "kinds": {name: vars(outcome) for name, outcome in outcomes.items()}}
    table = markdown(columns, rows)
    print(table)
    for name, outcome in outcomes.items():
        for fault in outcome.faults[:20]:
            print(f"{name}: {fault}")
    write(args.out, "fuzz", table, data, args.publish)
    return 1 if totals[3] else 0


if __name__ == "__main__":
    raise SystemExit(main())
