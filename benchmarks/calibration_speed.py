"""Time of a calibration, of the paper's eight parameters alone and of all that the model has, at the plan's cell size.

First two thirds of the telemetry to tune on, last third held out; everything else as `calibration.calibrate` does it.
Without ``--case`` the bundled case, and beside it ``practice_none_prbs`` where the shared cases lie next to the
repository: 12 zones, 0.5 m, two weeks to tune on. Parameters that are not estimated keep their start.

Run: ``python benchmarks/calibration_speed.py --out results/speed [--case CASE ...] [--publish]``; two minutes on two
cores. Writes ``calibration_speed.json`` and ``.md``; with ``--publish`` also the table between its marks.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

from _table import ROOT, markdown, write
from simulator_speed import PARAMETERS

from calibration import CalibrationResult, CalibrationSettings, calibrate
from thermal import build_network, load_case
from thermal.data import bundled_case_path

PRACTICE = ROOT.parent / "shared" / "cases" / "practice_none_prbs"
COLUMNS = (
    "case", "zones", "volumes", "tuned on [d]", "parameters", "iterations", "wall [s]", "CPU [s]",
    "held-out MAE before [K]", "after [K]", "status",
)  # fmt: skip


def measure(path: Path) -> list[dict[str, Any]]:
    """Calibrate a case twice, with the paper's parameters and with all of them."""
    case = load_case(path)
    parameters = build_network(case.building).parameters
    rest = {p.name: p.start for p in parameters if p.name not in PARAMETERS}
    rows = []
    for fixed in (rest, {}):
        wall, cpu = time.perf_counter(), time.process_time()
        result = calibrate(case, settings=CalibrationSettings(fixed=fixed))
        times = {"wall": time.perf_counter() - wall, "cpu": time.process_time() - cpu}
        rows.append({"parameters": len(parameters) - len(fixed), "fixed": sorted(fixed), **times, **summary(result)})
    return rows


def summary(result: CalibrationResult) -> dict[str, Any]:
    """Collect what the calibration reached."""
    return {
        "case": result.case,
        "zones": len(result.zones),
        "volumes": result.grid_check.volumes,
        "days": sum((i.end - i.start).total_seconds() for i in result.tuning) / 86400.0,
        "before": result.uncalibrated["held_out"].metrics.mae,
        "after": result.calibrated["held_out"].metrics.mae,
        "solver": result.solver.to_dict(),
    }


def cells(row: dict[str, Any]) -> list[Any]:
    """Lay out one line of the table."""
    solver = row["solver"]
    return [
        row["case"], row["zones"], f"{row['volumes']:,}", f"{row['days']:.1f}", row["parameters"],
        solver["iterations"], f"{row['wall']:.1f}", f"{row['cpu']:.1f}", f"{row['before']:.3f}", f"{row['after']:.3f}",
        solver["status"],
    ]  # fmt: skip


def main() -> None:
    """Measure every case and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--case", type=Path, action="append", help="case folder with floor plans; may be repeated")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    paths = options.case or [bundled_case_path(), *([PRACTICE] if PRACTICE.exists() else [])]
    rows = [row for path in paths for row in measure(path)]
    table = markdown(COLUMNS, [cells(row) for row in rows])
    note = (
        f"{os.cpu_count()} cores, {os.environ.get('OMP_NUM_THREADS', 'as many')} threads of linear algebra, load "
        f"average {os.getloadavg()[0]:.1f}; MAE of six-hour predictions on the last third of the telemetry.\n"
    )
    write(options.out, "calibration_speed", f"{table}\n{note}", rows, options.publish)
    print(table, note, sep="\n")


if __name__ == "__main__":
    main()
