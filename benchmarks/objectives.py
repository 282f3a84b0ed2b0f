"""The two objectives of `calibrate` beside each other: cases, and twins whose parameters are known."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from _table import ROOT, markdown, write

from calibration import CalibrationResult, CalibrationSettings, calibrate
from thermal import Case, load_case
from thermal.pilot.twin import TwinSettings, TwinTruth, generate_twin

Objective = Literal["multi_step", "innovations"]

NAME = "objectives"
SHARED = ROOT.parent / "shared" / "cases"
CASES = ("practice_none_prbs", "practice_none_schedule")
COLUMNS = (
    "case", "objective", "held-out 6 h MAE [K]", "parameter error [-]", "in 90 % interval", "determined", "on bounds",
    "excess", "CPU [s]",
)  # fmt: skip


def recovered(result: CalibrationResult, truth: TwinTruth) -> dict[str, float | int]:
    """RMS error of the estimates in deviations of their priors, and how many 90 % intervals hold the truth."""
    known = {p.name: (p, float(value)) for p, value in zip(truth.parameters, truth.theta, strict=True)}
    off, inside = [], 0
    for found in result.parameters:
        if found.interval90 is not None:
            p, value = known[found.name]
            off.append((p.transform(found.value) - p.transform(value)) / p.prior_deviation)
            inside += found.interval90[0] <= value <= found.interval90[1]
    return {"error": float(np.sqrt(np.mean(np.square(off)))), "inside": inside}


def measure(case: Case, name: str, truth: TwinTruth | None, objective: Objective, **settings: Any) -> dict[str, Any]:
    """Calibrate one case by one objective."""
    began = time.process_time()
    result = calibrate(case, settings=CalibrationSettings(objective=objective, **settings))
    seconds = time.process_time() - began
    estimated = [p for p in result.parameters if p.standard_error is not None]
    return {
        "case": name,
        "objective": objective,
        "mae": result.calibrated["held_out"].metrics.mae,
        "estimated": len(estimated),
        "determined": sum(p.identifiable for p in estimated),
        "at_bound": sum(p.at_bound for p in estimated),
        "excess": result.excess,
        "seconds": seconds,
        "settings": settings,
        "solver": result.solver.to_dict(),
        "parameters": {p.name: p.to_dict() for p in estimated},
    } | ({} if truth is None else recovered(result, truth))


def cells(line: dict[str, Any]) -> list[Any]:
    """One row of the table."""
    twin, of = "error" in line, line["estimated"]
    return [
        line["case"], line["objective"], f"{line['mae']:.3f}", f"{line['error']:.2f}" if twin else "",
        f"{line['inside']} of {of}" if twin else "", f"{line['determined']} of {of}", line["at_bound"],
        f"{line['excess']:.1f}", f"{line['seconds']:.0f}",
    ]  # fmt: skip


def subjects(folder: Path, names: list[str], seeds: list[int]) -> Iterator[tuple[str, Case, TwinTruth | None]]:
    """Cases as they are, then twins of the first case's building: even seeds by schedule, odd ones by PRBS."""
    for name in names:
        yield name, load_case(folder / name), None
    for seed in seeds:
        building = load_case(folder / names[0]).building
        case, truth = generate_twin(building, seed, TwinSettings(dx=1.0, excitation="prbs" if seed % 2 else "schedule"))
        yield f"twin {seed}", case, truth


def main() -> None:
    """Measure what is not there yet, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=Path, default=SHARED)
    parser.add_argument("--names", nargs="*", default=list(CASES))
    parser.add_argument("--twins", type=int, nargs="*", default=[1, 2])
    parser.add_argument("--starts", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("results/objectives"))
    options = parser.parse_args()
    path = options.out / f"{NAME}.json"
    lines = json.loads(path.read_text(encoding="utf-8")) if path.exists() else []
    for name, case, truth in subjects(options.cases, options.names, options.twins):
        for objective in get_args(Objective):
            settings = {"starts": options.starts} | ({"dx": 1.0} if truth is not None else {})
            done = [(line["case"], line["objective"], line["settings"]) for line in lines]
            if (name, objective, settings) not in done:
                lines.append(measure(case, name, truth, objective, **settings))
                write(options.out, NAME, markdown(COLUMNS, [cells(line) for line in lines]), lines, published=False)


if __name__ == "__main__":
    main()
