"""Held-out error of the baseline before and after calibration, on every case of a folder.

Run: ``python benchmarks/baseline_accuracy.py [--cases CASES] --out DIR [--publish]``; always with the bundled case.
A case that holds an effect which the baseline leaves out keeps an error: finding that effect is what diagnosis is for.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from _table import markdown, write

from calibration import calibrate
from thermal import load_case
from thermal.data import bundled_case_path

COLUMNS = (
    "case", "zones", "step", "uncalibrated [K]", "calibrated [K]", "bias [K]", "on a bound", "determined", "status",
    "s",
)  # fmt: skip


def measure(path: Path) -> dict[str, Any]:
    """Calibrate one case with the defaults and collect its row."""
    case = load_case(path)
    result = calibrate(case)
    estimated = [p for p in result.parameters if p.standard_error is not None]
    return {
        "case": case.building.name,
        "zones": len(case.building.zone_names),
        "step_seconds": case.step,
        "uncalibrated": result.uncalibrated["held_out"].metrics.to_dict(),
        "calibrated": result.calibrated["held_out"].metrics.to_dict(),
        "tuning": result.calibrated["tuning"].metrics.to_dict(),
        "at_bound": [p.name for p in estimated if p.at_bound],
        "identifiable": [p.name for p in estimated if p.identifiable],
        "parameters": len(estimated),
        "solver": result.solver.to_dict(),
    }


def main() -> None:
    """Measure every case and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=Path, help="folder of case folders")
    parser.add_argument("--out", type=Path, default=Path("results"))
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    arguments = parser.parse_args()
    paths = sorted(p.parent for p in arguments.cases.glob("*/building.yaml")) if arguments.cases else []
    data, rows = [], []
    for path in [bundled_case_path(), *paths]:
        row = measure(path)
        data.append(row)
        rows.append(
            [
                row["case"],
                row["zones"],
                f"{row['step_seconds'] / 60:g} min",
                f"{row['uncalibrated']['mae']:.3f}",
                f"{row['calibrated']['mae']:.3f}",
                f"{row['calibrated']['bias']:+.3f}",
                f"{len(row['at_bound'])} of {row['parameters']}",
                f"{len(row['identifiable'])} of {row['parameters']}",
                row["solver"]["status"],
                f"{row['solver']['seconds']:.0f}",
            ]
        )
        print(" | ".join(str(v) for v in rows[-1]), flush=True)
    write(arguments.out, "baseline_accuracy", markdown(COLUMNS, rows), data, arguments.publish)


if __name__ == "__main__":
    main()
