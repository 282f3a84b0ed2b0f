"""Do the intervals of calibrated parameters hold the truth? Coverage on twins, whose parameters are known.

A twin a seed (`thermal.pilot.twin.generate_twin`): an office of its own, θ drawn from the priors within their ranges,
the
grid model under thermostats, unmeasured heat and sensor noise of strengths drawn anew. `calibration.calibrate` sees the
telemetry only. Its intervals are normal on the estimation scale (log or logit), value ± quantile times standard error;
the 90 % interval that the result itself gives, cut at the range, takes their place. As θ comes from the prior that
calibration assumes, intervals of every level must hold the truth as often as they say, on average over all parameters,
what the data determine and what they do not alike (Talts et al. 2018, arXiv:1804.06788). Parameters of one twin share
its telemetry: the band about 90 % and how it is corrected for clusters are in `_coverage.py`.

The truth never leaves a parameter's physical range, while a normal interval may: where the data say little, a 90 %
interval that reaches beyond the range holds the truth more often than 90 %, up to some 95 %. The rows "cut to range"
are the intervals of the same normal distributions cut at the range, which do not.

Beside the coverage: the width of the intervals over that of the prior's, z = (truth - estimate) / standard error, and
the held-out error of six-hour predictions beside the same model's at the true parameters, which nothing can beat but
by chance.

Run: ``python benchmarks/parameter_recovery.py --out results/recovery``; 60 seeds. Each seed is one line of
``parameter_recovery.jsonl`` as soon as it is done: run the same command again after an interruption and it goes on
where it was. A seed that fails is a line too, named in the table, and tried again with ``--retry``.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
import traceback
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Literal

from _code import code
from _recovery_tables import report
from _table import publish, write

from calibration import CalibrationResult, CalibrationSettings, calibrate, evaluate_case
from calibration.fit.result import ParameterEstimate
from thermal import Building, Case, Parameter, load_case
from thermal.pilot.building import devices, generate_office
from thermal.pilot.twin import Excitation, Meter, TwinSettings, TwinTruth, generate_twin
from thermal.pilot.weather import MOUNTAIN_VIEW

NAME = "parameter_recovery"


@dataclass(frozen=True)
class Study:
    """What a seed's numbers depend on beside the seed; a study is of one kind."""

    days: float
    zones: int
    floor_area: float  # [m2]
    dx: float  # [m], of twin and calibration
    excitation: Excitation | Literal["alternate"]  # alternate: schedule for even seeds, prbs for odd ones
    meter: Meter
    case: str | None  # folder of a case whose building all twins have; None for an office a seed

    def building(self, seed: int) -> Building:
        """Draw the building of a seed's twin."""
        if self.case is not None:
            return load_case(self.case).building
        plans = generate_office(seed, floor_area=self.floor_area, zones=self.zones, floors=1)
        return Building("office", MOUNTAIN_VIEW, 0.0, plans, devices(plans))

    def twin(self, seed: int) -> tuple[Case, TwinTruth]:
        """Make the twin of a seed."""
        settings = TwinSettings(days=self.days, dx=self.dx, excitation=self.excitation_of(seed), meter=self.meter)
        return generate_twin(self.building(seed), seed, settings)

    def excitation_of(self, seed: int) -> Excitation:
        """Choose the set-points of a seed's twin."""
        if self.excitation == "alternate":
            return "prbs" if seed % 2 else "schedule"
        return self.excitation


def measure(study: Study, seed: int) -> dict[str, Any]:
    """Make a twin, calibrate it, and collect its line; an error is a line as well."""
    line: dict[str, Any] = {"seed": seed, "study": asdict(study), "code": code()}
    try:
        began = time.perf_counter()
        case, truth = study.twin(seed)
        made = time.perf_counter()
        result = calibrate(case, settings=CalibrationSettings(dx=study.dx, seed=seed))
        done = time.perf_counter()
        line |= summary(result, truth)
        line["conditions"]["excitation"] = study.excitation_of(seed)
        line["mae"]["truth"] = true_error(case, truth, result, study.dx)
        line["seconds"] = {"twin": made - began, "calibrate": done - made}
    except Exception as error:  # a study with failures that nobody sees would be worth nothing
        line["failure"] = f"{type(error).__name__}: {error}"
        line["traceback"] = traceback.format_exc()
    return line


def summary(result: CalibrationResult, truth: TwinTruth) -> dict[str, Any]:
    """Collect truth and estimate of each estimated parameter, and the errors before and after."""
    known = {p.name: (p, value) for p, value in zip(truth.parameters, truth.theta, strict=True)}
    estimated = [p for p in result.parameters if p.standard_error is not None]
    errors = {"before": result.uncalibrated["held_out"].metrics.mae, "after": result.calibrated["held_out"].metrics.mae}
    conditions = {name: value for name, value in truth.to_dict().items() if name not in ("seed", "parameters")}
    return {
        "conditions": conditions,
        "parameters": [on_estimation_scale(p, *known[p.name]) for p in estimated],
        "mae": errors,
        "solver": result.solver.to_dict(),
        "volumes": result.grid_check.volumes,
    }


def on_estimation_scale(estimate: ParameterEstimate, parameter: Parameter, truth: float) -> dict[str, Any]:
    """Put one parameter's estimate, truth and prior on the scale that it is estimated on."""
    error = float(estimate.standard_error or 0.0)
    own = getattr(estimate, "interval90", None)
    return {
        "name": estimate.name,
        "unit": estimate.unit,
        "value": estimate.value,
        "true_value": float(truth),
        "standard_error": error,
        "identifiable": estimate.identifiable,
        "at_bound": estimate.at_bound,
        "truth": parameter.transform(truth),
        "estimate": parameter.transform(estimate.value),
        "error": error / parameter.slope(estimate.value),
        "prior_centre": parameter.transform(parameter.start),
        "prior_deviation": parameter.prior_deviation,
        "lower": parameter.transform(parameter.lower),
        "upper": parameter.transform(parameter.upper),
        "own_interval90": None if own is None else [parameter.transform(float(end)) for end in own],
    }


def true_error(case: Case, truth: TwinTruth, result: CalibrationResult, dx: float) -> float:
    """Held-out error of the model at the true parameters [K]."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "truth.json"
        path.write_text(json.dumps({"parameters": truth.to_dict()["parameters"]}), encoding="utf-8")
        return evaluate_case(case, result.held_out, parameters=path, horizon=result.horizon, dx=dx).metrics.mae


def read_lines(path: Path, study: Study) -> dict[int, dict[str, Any]]:
    """Read what was measured before: the last line of each seed. A line cut off by a kill is dropped."""
    lines: dict[int, dict[str, Any]] = {}
    for text in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            line = json.loads(text)
        except json.JSONDecodeError:
            continue
        if line["study"] != asdict(study):
            raise SystemExit(
                f"{path}: expected a study of {asdict(study)}, found {line['study']}; choose another --out"
            )
        lines[line["seed"]] = line
    return lines


def run(study: Study, seeds: list[int], workers: int, path: Path) -> None:
    """Measure seeds in processes of their own and append a line each."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # spawned workers load NumPy after this
    path.parent.mkdir(parents=True, exist_ok=True)
    cut_off = path.exists() and not path.read_bytes().endswith(b"\n")
    with path.open("a", encoding="utf-8") as out, ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        out.write("\n" if cut_off else "")
        tasks = [pool.submit(measure, study, seed) for seed in seeds]
        for number, task in enumerate(as_completed(tasks), 1):
            try:
                line = task.result()
            except (BrokenProcessPool, KeyboardInterrupt) as error:
                pool.shutdown(wait=False, cancel_futures=True)
                raise SystemExit(f"stopped by {type(error).__name__}; run again to go on with the rest") from error
            out.write(json.dumps(line) + "\n")
            out.flush()
            outcome = line.get("failure") or f"{line['seconds']['calibrate']:.1f} s, {line['solver']['status']}"
            print(f"{number} of {len(seeds)}: seed {line['seed']}: {outcome}", flush=True)


def main() -> None:
    """Measure the seeds that are not there yet, and write the tables of all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder of the results")
    parser.add_argument("--seeds", type=int, default=60, help="number of twins, seeds from 0")
    parser.add_argument("--workers", type=int, default=2, help="processes, one thread each")
    parser.add_argument("--days", type=float, default=21.0, help="telemetry of a twin [d]; a third is held out")
    parser.add_argument("--zones", type=int, default=6)
    parser.add_argument("--floor-area", type=float, default=300.0, help="[m2]")
    parser.add_argument("--dx", type=float, default=1.0, help="distance between control volumes [m]")
    parser.add_argument("--excitation", choices=("schedule", "prbs", "alternate"), default="alternate")
    parser.add_argument("--meter", choices=("sensors", "exact"), default="sensors", help="see generate_twin")
    parser.add_argument("--case", type=Path, help="use this case's building for every twin")
    parser.add_argument("--retry", action="store_true", help="measure seeds again that failed")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    case = str(options.case) if options.case else None
    kept = {name: getattr(options, name) for name in ("days", "zones", "floor_area", "dx", "excitation", "meter")}
    study, path = Study(**kept, case=case), options.out / f"{NAME}.jsonl"
    lines = read_lines(path, study)
    missing = [s for s in range(options.seeds) if s not in lines or (options.retry and "failure" in lines[s])]
    if missing:
        run(study, missing, options.workers, path)
        lines = read_lines(path, study)
    short, coverage, page, data = report([lines[seed] for seed in sorted(lines) if seed < options.seeds])
    write(options.out, NAME, page, data, published=False)
    if options.publish:
        publish(NAME, short)
        publish(f"{NAME}_coverage", coverage)
    print(page)


if __name__ == "__main__":
    main()
