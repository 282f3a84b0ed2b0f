"""Measured buildings: as drawn, calibrated and diagnosed, beside what anyone fits in an hour, on the same runs.

Run: ``python benchmarks/measured.py CASE... --out DIR [--diagnose] [--publish]``; a CASE may be a folder of cases.
Intervals are of 90 %, by a bootstrap over held-out days. ``bands hold`` is the share of the held-out temperatures
inside their 90 % bands. ``chosen`` is the structure that left-out tuning days prefer.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _table import markdown, write

from calibration import calibrate, diagnose
from calibration.fit.cross_validation import local_days, run_errors
from calibration.fit.result import CalibrationResult
from thermal import load_case

COLUMNS = (
    "case", "zones", "days", "step", "as drawn [K]", "calibrated [K]", "90 % [K]", "heat carried on [K]",
    "bands hold [%]", "chosen", "persistence [K]",
    "2R2C [K]", "ARX [K]", "useful", "diagnosed [K]", "verdict", "CPU [s]",
)  # fmt: skip

#: Draws of days.
_DRAWS = 2000


def measure(path: Path, diagnosed: bool) -> dict[str, Any]:
    """Calibrate one case as the command does, and diagnose it where that is asked for."""
    case, began = load_case(path), time.process_time()
    result = calibrate(case, settings={"climb": True, "yardsticks": True})
    seconds = time.process_time() - began
    judged = result.calibrated["held_out"]
    if judged.yardsticks is None:
        raise RuntimeError("calibrate was asked for yardsticks and gave none")
    row = {
        "case": case.building.name,
        "zones": len(case.building.zone_names),
        "days": (case.stamps[-1] - case.stamps[0]) / pd.Timedelta(days=1),
        "step_seconds": case.step,
        "drawn": result.uncalibrated["held_out"].metrics.mae,
        "calibrated": judged.metrics.mae,
        "interval90": interval(result),
        "carried": None if judged.carried is None else judged.carried.to_dict(),
        "rungs": [rung.to_dict() for rung in result.rungs],
        "chosen": next((rung.name for rung in result.rungs if rung.chosen), "drawn"),
        "seconds": seconds,
        **judged.yardsticks.beside(judged.metrics.mae),
    }
    if diagnosed:
        found = diagnose(case)
        row |= {"verdict": found.verdict.name, "diagnosed": found.predicts, "effects": list(found.found)}
    return row


def interval(result: CalibrationResult) -> tuple[float, float]:
    """Interval of the held-out error by a bootstrap over days [K]."""
    errors = run_errors(result.calibrated["held_out"])
    days = local_days(pd.DatetimeIndex(errors.index))
    by_day = errors.groupby(days).agg(["sum", "count"]).to_numpy()
    drawn = by_day[np.random.default_rng(0).integers(0, len(by_day), (_DRAWS, len(by_day)))].sum(axis=1)
    low, high = np.quantile(drawn[:, 0] / drawn[:, 1], (0.05, 0.95))
    return float(low), float(high)


def cells(row: dict[str, Any]) -> list[str]:
    """Spell a row of the table."""

    def kelvin(value: float | None) -> str:
        return "–" if value is None else f"{value:.3f}"

    def percent(share: float | None) -> str:
        return "–" if share is None else f"{100.0 * share:.0f}"

    low, high = row["interval90"]
    yardsticks, known = row["yardsticks"], row["carried"] or {}
    carried = kelvin(known.get("mae")), percent(known.get("coverage"))
    return [
        row["case"], str(row["zones"]), f"{row['days']:.0f}", f"{row['step_seconds'] / 60:g} min", kelvin(row["drawn"]),
        f"**{row['calibrated']:.3f}**", f"{low:.2f}-{high:.2f}", *carried, row["chosen"],
        kelvin(yardsticks["persistence"]), kelvin(yardsticks["rc"]), kelvin(yardsticks["arx"]),
        "yes" if row["useful"] else "not yet",
        kelvin(row.get("diagnosed")), row.get("verdict", "–"), f"{row['seconds']:.0f}",
    ]  # fmt: skip


def main() -> None:
    """Measure every case and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", type=Path, nargs="+", metavar="CASE")
    parser.add_argument("--out", type=Path, default=Path("results"))
    parser.add_argument("--diagnose", action="store_true", help="diagnose each case too")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    arguments = parser.parse_args()
    paths = [
        p
        for given in arguments.cases
        for p in ([given] if (given / "building.yaml").exists() else [f.parent for f in given.glob("*/building.yaml")])
    ]
    data, rows = [], []
    for path in sorted(paths):
        data.append(measure(path, arguments.diagnose))
        rows.append(cells(data[-1]))
        print(" | ".join(rows[-1]), flush=True)
    write(arguments.out, "measured", markdown(COLUMNS, rows), data, arguments.publish)


if __name__ == "__main__":
    main()
