"""Spoilt inputs of all kinds: whatever comes in, it is taken or refused by a named error of the library.

Eight kinds of input: case folders and lists of drawings as YAML, plans and drawings, telemetry as CSV and as Parquet
(of a case, and from a foreign table), requests to the labelling page, to its telemetry, places and jobs, and to the
server of BOPTEST's API (addresses, heads and bodies), and steps of a controller. Each input is a
valid one spoilt in a few places (`_fuzz_inputs.py`) by a seed of its own. It may be accepted, or refused by an error of
the library's families (a status of 400 to 499 with a message, for a server); anything else that is raised, a status of
500, or a controller without finite setpoints is a fault, and is listed with its seed.

Run: ``nice -n 10 python benchmarks/fuzz.py --inputs 20000 --out results/fuzz --publish``; eleven minutes of CPU.
Writes ``fuzz.json`` and ``fuzz.md``.
"""

from __future__ import annotations

import argparse
import io
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
from _fuzz_controller import Controlled
from _fuzz_inputs import spoil_bytes, spoil_frame, spoil_plan, spoil_tree
from _fuzz_servers import Page, Plant, TelemetryPage
from _table import markdown, write

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


def spoilt_table(name: str, rng: np.random.Generator) -> bytes:
    """Telemetry as CSV or Parquet, by the ending of its name, spoilt as a table, as bytes, or both."""
    if name.endswith(".csv"):
        text = spoil_frame(telemetry(), rng).to_csv() if rng.random() < 0.5 else telemetry().to_csv()
        return spoil_bytes(text.encode("utf-8", "replace"), rng)
    stream = io.BytesIO()
    try:
        frame = spoil_frame(telemetry(), rng)
        (frame if rng.random() < 0.7 else frame.reset_index()).to_parquet(stream)
    except Exception:  # it cannot be written as Parquet: another one
        stream = io.BytesIO()
        telemetry().to_parquet(stream)
    return stream.getvalue() if rng.random() < 0.7 else spoil_bytes(stream.getvalue(), rng)


def fuzz_csv(rng: np.random.Generator, folder: Path) -> None:
    """Telemetry of a case as CSV, and foreign tables."""
    table = spoilt_table("export.csv", rng)
    if rng.random() < 0.7:
        _look(write_case(folder, None, None, table))
    else:
        _import(folder, table, "export.csv")


def fuzz_parquet(rng: np.random.Generator, folder: Path) -> None:
    """Telemetry of a case as Parquet, and foreign tables."""
    table = spoilt_table("export.parquet", rng)
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
        folders = [Path(stack.enter_context(tempfile.TemporaryDirectory())) for _ in range(2)]
        page = Page(write_case(folders[0]), drawings()["codes.csv"])
        measured, plant, controlled = TelemetryPage(write_case(folders[1]), spoilt_table), Plant(), Controlled()
        for served in (page, measured):
            stack.callback(served.close)
        for client in (page.client, measured.client, plant.client):
            stack.enter_context(client)
        yield {
            "YAML of cases and lists of drawings": fuzz_yaml,
            "plans and drawings": fuzz_plans,
            "telemetry as CSV": fuzz_csv,
            "telemetry as Parquet": fuzz_parquet,
            "requests to the labelling page": lambda rng, folder: page.ask(rng),
            "its telemetry, files and jobs": lambda rng, folder: measured.ask(rng),
            "requests to BOPTEST's API": lambda rng, folder: plant.ask(rng),
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
