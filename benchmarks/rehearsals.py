"""What acting saves, as plans promise it, as a rehearsal on the site's model foretells it, and as it comes.

Offices of 12 zones, plants of ours whose parameters are drawn, with sun and people; their own control holds 13 degC of
supply air and 75 degC of supply water. The model is what ``buildingmpc calibrate`` makes of two weeks. A week is run
in shadow, as ``operate`` would, without BACnet and database, and ``rehearse`` reads its log. Then the same week is run
with the plans' values in force. Before both the building has a week under its own control.

Run: ``python benchmarks/rehearsals.py --out results/rehearsals [--seeds 0-5] [--workers 2] [--publish]``; five CPU
minutes a week. Needs ``[live]`` and ``pip install rusty-bacnet``. Writes ``rehearsals.json`` and ``.md``; resumes.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _pilot_site import CONTROL_STEP, EFFECTS, OWN, RUN_IN, OwnControl
from _plant_site import PlantSite
from _seeds import seed_range
from _table import markdown, write
from _threads import use_one_thread

from mpc.live.audit import AuditLog
from mpc.live.planner import Planner, forecast_to_dict
from mpc.live.rehearsal import rehearse
from mpc.live.site import Site
from mpc.loop.make import save_pilot
from thermal.case.building import Building
from thermal.pilot.building import pilot_building

#: Mondays of the weeks, one after the other by seed; days before them that the model is calibrated on, and of a week.
STARTS, BEFORE, DAYS = ("2023-01-09", "2023-04-17", "2023-11-13"), 14, 7
COLUMNS = ("office", "week of", "own control [USD]", "acting [USD]", "saved", "rehearsed", "promised by plans",
           "K h, own and acting")  # fmt: skip


def prepare(building: Building, start: str, seed: int, work: Path) -> None:
    """Make the case of the two weeks before, and calibrate."""
    before = f"{pd.Timestamp(start) - pd.Timedelta(days=BEFORE):%Y-%m-%d}"
    settings = OwnControl(building, before, BEFORE, seed, step=300.0).settings
    save_pilot(work / "case", building, settings, start=before, days=BEFORE, setpoints=OWN)
    effects = ["--effects", ",".join((*EFFECTS, "internal_gains"))]
    command = ["buildingmpc", "calibrate", work / "case", *effects, "--out", work / "calibrated"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def run_week(plant: OwnControl, site: Site, log: AuditLog | None, days: int) -> pd.DataFrame:
    """Run a week in shadow, with a log, or with the plans in force; give cost and discomfort by day."""
    planner, each = Planner(site), round(site.step / plant.control_step)
    seen = [plant.reset()]
    for _ in range(round(days * 86400.0 / site.step)):
        means = np.mean([one.values_array for one in seen], axis=0)
        inputs = {"begin": float(seen[-1].seconds), "means": dict(zip(plant.columns, means.tolist(), strict=True)),
                  "forecast": forecast_to_dict(plant.forecast()), "trouble": ""}  # fmt: skip
        plan = planner.plan(inputs)
        if log is not None:
            log.append("plan", {"inputs": inputs, "plan": plan})
        values = {} if log is not None else plan["values"]
        seen = [plant.step(values) for _ in range(each)]
    return plant.bought()


def compare(seed: int, days: int) -> dict[str, Any]:
    """Foretell a week, and let it come."""
    use_one_thread()
    start = STARTS[seed % len(STARTS)]
    building = pilot_building(seed, floor_area=600.0, zones=12, name=f"office_{seed}")
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        prepare(building, start, seed, work)
        plant = OwnControl(building, start, days, seed, run_in=RUN_IN)
        air, water = OWN.values()
        model = {"building": str(work / "case"), "parameters": str(work / "calibrated/calibration.json"),
                 "own_control": {"air": [air] * 2, "water": [water] * 2}}  # fmt: skip
        device = PlantSite(plant.described("office", start), plant, work / "site", 1.001, CONTROL_STEP)
        try:
            site = Site(device.begin("postgresql:///none", more={"controller": "mpc", "model": model}))
        finally:
            device.stop()
        log = AuditLog(site.folder, "controller", dict)
        shadow = run_week(plant, site, log, days)
        log.close()
        foretold, acted = rehearse(site), run_week(plant, site, None, days)
    return {
        "seed": seed, "start": start, "own": shadow.to_dict("list"), "acted": acted.to_dict("list"),
        "rehearsed": foretold.to_dict(),
    }  # fmt: skip


def saved(found: dict[str, Any]) -> float:
    """Share of the cost that acting saved [-]."""
    return float(1.0 - sum(found["acted"]["cost"]) / sum(found["own"]["cost"]))


def rows(found: list[dict[str, Any]]) -> list[list[Any]]:
    """Lay out the table, a row a week."""
    made = []
    for one in found:
        own, acted, told = one["own"], one["acted"], one["rehearsed"]
        shares = (saved(one), told["saving"], told["promised"])
        made.append([
            one["seed"], one["start"], f"{sum(own['cost']):.1f}", f"{sum(acted['cost']):.1f}",
            *(f"{100.0 * share:.1f} %" for share in shares),
            f"{sum(own['discomfort']):.1f}, {sum(acted['discomfort']):.1f}",
        ])  # fmt: skip
    return made


def main() -> None:
    """Run the weeks, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--seeds", type=seed_range, default=range(6))
    parser.add_argument("--days", type=int, default=DAYS, help="of a week")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    files = {seed: options.out / f"week_{seed}_{options.days}.json" for seed in options.seeds}
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
        asked = {seed: pool.submit(compare, seed, options.days) for seed, file in files.items() if not file.exists()}
        for seed, one in asked.items():
            files[seed].write_text(json.dumps(one.result()) + "\n", encoding="utf-8")
            print(markdown(COLUMNS, rows([json.loads(files[seed].read_text(encoding="utf-8"))])), flush=True)
    found = [json.loads(file.read_text(encoding="utf-8")) for file in files.values()]
    apart = {name: [abs(one["rehearsed"][name] - saved(one)) for one in found] for name in ("saving", "promised")}
    foretold, promised = (
        f"{100.0 * np.median(off):.1f} points in the median, {100.0 * max(off):.1f} at most" for off in apart.values()
    )
    table = markdown(COLUMNS, rows(found))
    note = f"Weeks of {options.days} days. Rehearsals are off by {foretold}; the plans' promises by {promised}.\n"
    write(options.out, "rehearsals", f"{table}\n{note}", {"weeks": found}, options.publish)
    print(table, note, sep="\n")


if __name__ == "__main__":
    main()
