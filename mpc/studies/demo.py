"""The main job from beginning to end: check, calibrate, evaluate, diagnose and control a case, with a page a step."""

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from calibration.diagnosis.diagnosis import Diagnosis, diagnose
from calibration.evaluation.case_model import evaluate_case
from calibration.evaluation.intervals import Interval, default_intervals
from calibration.evaluation.n_step import Evaluation
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.calibrate import calibrate
from calibration.fit.result import CalibrationResult
from calibration.progress import Forward, Progress
from calibration.results import check_results_folder
from mpc.errors import ControlError
from mpc.loop.noise import SensorNoise
from mpc.reports.calibration import calibration_verdict, write_calibration
from mpc.reports.case import check_verdict, write_check
from mpc.reports.control import comparison_verdict, write_comparison
from mpc.reports.demo import render_demo
from mpc.reports.diagnosis import write_diagnosis
from mpc.reports.diagnosis_words import diagnosis_verdict
from mpc.reports.display import write_results
from mpc.reports.evaluation import evaluation_verdict, write_evaluation
from mpc.scenario.forecast import DAY_AHEAD_ERRORS
from mpc.scenario.weather_files import weather_of_case
from mpc.studies.run import Comparison, compare_controllers
from mpc.studies.study import StudySettings, make_study
from thermal.case.case import Case
from thermal.case.check import CaseCheck, describe_case
from thermal.data import load_bundled_case

#: Controllers of the day, rules first.
CONTROLLERS = ("schedule", "reset", "guideline36", "mpc")

#: Share of the time that is left which a step takes [-]: of 38 s, on the bundled case.
_SHARES = {"calibrate": 0.25, "diagnose": 0.55, "evaluate": 0.15}

Told = Callable[[str, str], None]


@dataclass(frozen=True, eq=False)
class Demo:
    """What each step of the main job found.

    Parameters
    ----------
    case : Case
        What it was done on.
    check : CaseCheck
        What was understood of the case.
    calibration : CalibrationResult
        Of the baseline.
    diagnosis : Diagnosis
        Why the calibrated baseline is still wrong.
    evaluation : Evaluation
        On held-out days, of the model with the effects that the diagnosis found.
    comparison : Comparison
        A day of rules and of optimal control, on a plant that is this model.
    pages : mapping of str to Path
        Report by step.
    verdicts : mapping of str to str
        What was found, in plain words, by step.
    """

    case: Case
    check: CaseCheck
    calibration: CalibrationResult
    diagnosis: Diagnosis
    evaluation: Evaluation
    comparison: Comparison
    pages: dict[str, Path] = field(default_factory=dict)
    verdicts: dict[str, str] = field(default_factory=dict)

    @property
    def effects(self) -> list[str]:
        """Effects that the diagnosis put into the model, in the order in which they were accepted."""
        return list(self.diagnosis.steps[-1].effects) if self.diagnosis.steps else []

    @property
    def fine(self) -> bool:
        """Whether the solver of the calibration ended well, and optimal control had plans of its own."""
        controlled = self.comparison.of("mpc")
        planned = controlled is not None and controlled.sources.get("optimal plan", 0) > 0
        return self.calibration.solver.success and planned

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``demo.json``."""
        mpc, best = self.comparison.of("mpc"), self.comparison.best_rule
        study, result = self.comparison.study, self.calibration
        costs = {run.controller: run.cost for run in self.comparison.runs}
        return {
            "held_out_mae": {
                "uncalibrated": result.uncalibrated["held_out"].metrics.mae,
                "calibrated": result.calibrated["held_out"].metrics.mae,
                "with_effects": self.evaluation.metrics.mae,
            },
            "diagnosis": {"verdict": self.diagnosis.verdict.name, "effects": self.effects},
            "control": {
                "start": study.scenario.grid.start.isoformat(),
                "end": study.stamps[-1].isoformat(),
                "costs": costs,
                "discomfort": {run.controller: run.kpis.tdis_tot for run in self.comparison.runs},
                "best_rule": None if best is None else best.controller,
                "saving": None if mpc is None else self.comparison.saving(mpc),
            },
            "verdicts": dict(self.verdicts),
            "reports": {step: f"{page.parent.name}/{page.name}" for step, page in self.pages.items()},
            "fine": self.fine,
            "case": self.case.building.name, "version": version("buildingmpc"), "seed": result.seed,
        }  # fmt: skip


def run_demo(
    out: str | Path,
    *,
    case: Case | None = None,
    dx: float | None = None,
    force: bool = False,
    progress: Progress | None = None,
    told: Told | None = None,
) -> Demo:
    """Check, calibrate, diagnose, evaluate and control a case, and write a page of each step and one of all.

    Parameters
    ----------
    out : str or Path
        Folder, made if need be: ``demo.json``, ``report.html`` that leads to the others, and a folder a step.
    case : Case, optional
        With a working day of telemetry after those that it is calibrated on; the bundled case by default.
    dx : float, optional
        Distance between control volumes of a plan [m]; default: its cell size.
    force : bool
        Replace earlier results.
    progress : callable, optional
        Called with stage, done, total.
    told : callable, optional
        Called with the name of a step and what it found, when it is done.

    Returns
    -------
    Demo
        What was found.

    Raises
    ------
    ResultsExistError
        When the folder holds something and ``force`` is not set.
    ControlError
        When no whole working day is left to control.
    """
    folder, whole = check_results_folder(out, force), Forward(progress)
    case = case or load_bundled_case()
    judged = default_intervals(case)[1]
    first, last = _working_day(case, judged[-1])
    pages: dict[str, Path] = {}
    verdicts: dict[str, str] = {}

    def end(step: str, page: Path, verdict: str) -> None:
        pages[step], verdicts[step] = page, verdict
        if told is not None:
            told(step, verdict)

    def part(step: str) -> Progress:
        return whole.part(_SHARES.get(step, 1.0), step)

    checked = describe_case(case)
    end("check", write_check(checked, folder / "check", force=force), check_verdict(checked))
    fitted = calibrate(case, settings=CalibrationSettings(dx=dx), progress=part("calibrate"))
    end("calibrate", write_calibration(fitted, case, folder / "calibrate", force=force), calibration_verdict(fitted))
    found = diagnose(case, dx=dx, progress=part("diagnose"))
    end("diagnose", write_diagnosis(found, case, folder / "diagnose", force), diagnosis_verdict(found))
    model = folder / "diagnose" / "calibration.json"
    errors = evaluate_case(case, judged, parameters=model, dx=dx, trajectories=True, progress=part("evaluate"))
    name = "calibration.json of the diagnosis"
    page = write_evaluation(errors, case, folder / "evaluate", parameters=name, force=force)
    end("evaluate", page, evaluation_verdict(errors))
    whole.say("compare controllers: put the plant together")
    settings = StudySettings(parameters=model, noise=SensorNoise(), errors=DAY_AHEAD_ERRORS)
    study = make_study(case.building, weather_of_case(case), first, last, settings)
    compared = compare_controllers(study, CONTROLLERS, part("compare controllers"))
    end("compare", write_comparison(compared, folder / "compare", force=force), comparison_verdict(compared))
    demo = Demo(case, checked, fitted, found, errors, compared, pages, verdicts)
    write_results(folder, {"demo.json": demo.to_dict(), "report.html": _page(demo)}, force=True)
    return demo


def _page(demo: Demo) -> str:
    """Lay out the page that leads to the others."""
    result, links = demo.calibration, {step: f"{page.parent.name}/{page.name}" for step, page in demo.pages.items()}
    errors = {
        "as it was drawn": result.uncalibrated["held_out"],
        "calibrated": result.calibrated["held_out"],
        "with what the diagnosis found": demo.evaluation,
    }
    return render_demo(demo.case.building.name, demo.verdicts, links, errors, demo.effects, demo.comparison, demo.fine)


def _working_day(case: Case, interval: Interval) -> tuple[str, str]:
    """Begin and end of the last whole working day of an interval, ISO 8601."""
    zone = case.building.location.timezone
    days = pd.date_range(interval.start.tz_convert(zone).ceil("D"), interval.end.tz_convert(zone), freq="D")
    whole = [day for day in days[:-1] if day.weekday() < 5]
    span = f"{interval.start.isoformat()} to {interval.end.isoformat()}"
    ControlError.unless(whole, "day to control", "a whole working day of held-out telemetry", span)
    return whole[-1].isoformat(), (whole[-1] + pd.DateOffset(days=1)).isoformat()

