"""The answer of a diagnosis, without what follows from it: what was sought, what was found, and the verdict."""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from calibration.diagnosis.baseline import fit_baseline
from calibration.diagnosis.decide.outdone import held_out_of, is_outdone, regression_held_out
from calibration.diagnosis.decide.verdict import Verdict, doubted, gains_of, judge, summarised
from calibration.diagnosis.faults import LEAST, Fault, mend, with_faults
from calibration.diagnosis.free import Free, drawing_fails, held_against, must_be_better_by, search_free, with_recurring
from calibration.diagnosis.handed_on import other_structures
from calibration.diagnosis.known import reasons_of
from calibration.diagnosis.people import finds_people, with_people
from calibration.diagnosis.refit.challenge import challenge
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.how_far import Step, how_far
from calibration.diagnosis.refit.refit import HeldOut, elsewhere, held_out
from calibration.diagnosis.refit.search import Round, search
from calibration.diagnosis.refit.turned import turn
from calibration.diagnosis.screen.regular import Regular, regular
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings
from calibration.fit.fitted_case import FittedCase, is_large
from calibration.fit.ladder import ADVANCE, GAINS
from calibration.fit.left_out import LeftOut, left_out
from calibration.fit.result import Rung
from calibration.progress import Forward, Progress
from calibration.results import plain
from calibration.stages import stage
from thermal.case.case import Case
from thermal.case.plausibility.examine import check_calibratable
from thermal.effects.catalogue import CATALOGUE


class Structures(NamedTuple):
    """Other structures beside the building as drawn with what was found.

    Parameters
    ----------
    rungs : tuple of Rung
        All by their errors on left-out days.
    kept : FittedCase or None
        The one that predicts better.
    left : LeftOut or None
        Days left out by what is kept.
    """

    rungs: tuple[Rung, ...]
    kept: FittedCase | None
    left: LeftOut | None


@dataclass(frozen=True)
class Sought:
    """What was sought in a case, what was found, and the verdict.

    Parameters
    ----------
    models : ModelComparison
        The models that were compared, and their days.
    rounds : tuple of Round
        Of the search.
    verdict : Verdict
        Which effect.
    steps : tuple of Step
        How far each accepted effect closes the gap.
    floor : HeldOut
        Held-out errors below which nothing found lowers them.
    structures : Structures or None
        Where the verdict needed them: something was found missing.
    free : Free or None
        What was sought about a free structure, where the drawing does not hold.
    left_over : Regular or None
        What comes back of the errors of the last model, about a free structure, and where it decides: whether an effect
        that was accepted is named, or whether errors that are merely large say that something is missing.
    last_third : float or None
        As in `Diagnosis` [K].
    faults : tuple of Fault
        Of the telemetry, which were mended before anything else.
    seconds : float
        CPU time [s].
    outdone : float or None
        Held-out mean absolute error of a regression that knows nothing of buildings, where that says that something is
        missing beside all that was found [K].
    """

    models: ModelComparison
    rounds: tuple[Round, ...]
    verdict: Verdict
    steps: tuple[Step, ...]
    floor: HeldOut
    structures: Structures | None
    free: Free | None
    left_over: Regular | None
    last_third: float | None
    faults: tuple[Fault, ...] = ()
    seconds: float = field(default=0.0, compare=False)
    outdone: float | None = None

    @property
    def case(self) -> Case:
        """Building and telemetry, faults mended."""
        return self.models.case

    @property
    def left(self) -> float:
        """Held-out mean absolute error with all that was found [K]."""
        return self.rounds[-1].after_held_out.mae

    @property
    def gap(self) -> float:
        """Held-out mean absolute error of the calibrated baseline, before faults were mended [K]."""
        return self.faults[0].before.held_out if self.faults else self.rounds[0].held_out.mae

    def to_dict(self) -> dict[str, Any]:
        """Entries of ``diagnosis.json`` that tell the answer."""
        return {
            "verdict": self.verdict.name,
            "gap": {"mae": self.gap, "floor": self.floor.mae, "outdone": self.outdone},
            **answer_entries(self.verdict, self.steps, self.rounds, self.faults, self.floor.mae),
            "intervals": {"mae_of_last_third": self.last_third},
            "seconds": self.seconds,
        }


def answer_entries(
    verdict: Verdict, steps: Sequence[Step], rounds: Sequence[Round], faults: Sequence[Fault], floor: float
) -> dict[str, Any]:
    """Entries of ``diagnosis.json``: which effect, how far, and the rounds.

    Parameters
    ----------
    verdict : Verdict
        Which effect.
    steps : sequence of Step
        How far each accepted effect closes the gap.
    rounds : sequence of Round
        Of the search.
    faults : sequence of Fault
        Of the telemetry.
    floor : float
        Error below which nothing found lowers it [K].
    """
    halves = {s.effects[-1]: s.halves.to_dict() for s in steps if s.halves is not None}
    return {
        "which": [c.to_dict() | {"repeats": plain(halves.get(c.effect))} for c in verdict.candidates],
        "set90": verdict.set90,
        "summary": None if verdict.summary is None else verdict.summary.to_dict(),
        "combinations": [{"effects": list(e), "probability": p} for e, p in verdict.combinations.items()],
        "how_far": [*(f.how_far(floor) for f in faults), *(s.to_dict() for s in steps)],
        "rounds": [r.to_dict() | {"worth": gains_of(r)} for r in rounds],
        "faults": plain([f.to_dict() for f in faults]),
    }


def seek(
    case: Case,
    tune: Sequence[Interval] = (),
    hold_out: Sequence[Interval] = (),
    *,
    dx: float | None = None,
    horizon: str = "6h",
    known: Sequence[str] = (),
    ruled_out: Sequence[str] = (),
    progress: Progress | None = None,
) -> Sought:
    """Seek what a case's model leaves out, and judge it; `diagnose` adds what follows from the answer.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune, hold_out, horizon, known, ruled_out, progress
        As in `diagnose`.
    dx : float, optional
        Distance between control volumes of a plan [m]; the plan's cell size by default.

    Raises
    ------
    CaseError, EffectError, CalibrationError
        As `diagnose`.
    """
    began = time.process_time()
    check_calibratable(case)
    whole = Forward(progress)
    faults = mend(case, tune, hold_out, {"dx": dx, "horizon": horizon}, whole.part(0.1, "telemetry"))

    def without(
        mended: tuple[Fault, ...], tuned: Sequence[Interval] = tune, judged: Sequence[Interval] = hold_out
    ) -> Sought:
        of = mended[-1].mended if mended else case
        models = ModelComparison(of, ModelSettings(dx=dx), tuned, judged, horizon)
        return replace(_seek(models, known, ruled_out, whole), faults=mended)

    sought, certain = without(faults), tuple(itertools.takewhile(lambda fault: fault.is_certain, faults))
    if len(certain) < len(faults) and sought.structures is not None:  # what is missing can look like a fault
        other = without(certain, sought.models.tuned, sought.models.judged)
        if other.left < (1.0 - LEAST) * sought.left:
            sought = replace(other, last_third=sought.last_third)
    verdict, seconds = with_faults(sought.verdict, sought.faults), time.process_time() - began
    if sought.outdone is not None and verdict.name == "no_gap":
        verdict = replace(verdict, name="unexplained")
    return replace(sought, verdict=verdict, seconds=seconds)


def _seek(drawn: ModelComparison, known: Sequence[str], ruled_out: Sequence[str], whole: Forward) -> Sought:
    """Seek what the models of a case leave out, whose telemetry has no faults."""
    untestable = drawn.untestable()
    untestable |= reasons_of(known, ruled_out, untestable)
    whole.say("baseline")
    begun = stage("baseline", lambda: _begin(drawn, {name: () for name in known}, whole))
    models, baseline, errors, last_third = begun
    testable = [e for e in CATALOGUE if e not in untestable]
    rounds = search(models, baseline, errors, testable, whole.part(0.5))
    models, rounds = stage("turned building", lambda: turn(models, rounds, testable, whole.part(0.1, "north")))
    models, rounds = stage(
        "values by zone", lambda: challenge(models, rounds, testable, whole.part(0.3, "values by zone"))
    )
    about = _About(models, rounds, untestable)
    nothing = judge(rounds, untestable).name == "no_gap"
    regression = regression_held_out(models, rounds[-1].after) if nothing else None
    if not nothing or is_outdone(rounds[-1].after_held_out, regression):
        about = stage("structures", lambda: _other_structures(about, known, ruled_out, whole))
    models, rounds, untestable, structures, free, left_over = about
    steps, floor = how_far(models, rounds)
    verdict = doubted(judge(rounds, untestable, left_over), {s.effects[-1] for s in steps if s.void})
    if free is not None and structures is not None:
        verdict = with_recurring(verdict, free, structures.rungs)
    regression = regression or regression_held_out(models, rounds[-1].after)
    kept = None if structures is None or free is not None else structures.kept
    errors = rounds[-1].after_held_out if kept is None else held_out_of(models, kept.best)
    outdone = regression.mae if regression and is_outdone(errors, regression) else None
    return Sought(models, rounds, verdict, steps, floor, structures, free, left_over, last_third, outdone=outdone)


def _begin(
    drawn: ModelComparison, effects: dict[str, tuple[str, ...]], whole: Forward
) -> tuple[ModelComparison, Fit, HeldOut, float | None]:
    """Fit the baseline, on days that alternate where the last third is another world; also what it erred by there."""
    models, baseline = fit_baseline(drawn, effects, whole.part(0.2, "baseline"))
    first = errors = held_out(models, baseline)
    turns = elsewhere(baseline, first) and models.alternate(baseline.built.inputs)
    if turns:
        # what heaters give their heat by is chosen by days that tune, and these are others now
        other_days = replace(drawn, tune=models.tuned, hold_out=models.judged)
        models, baseline = fit_baseline(other_days, effects, whole.part(0.2, "baseline"))
        errors = held_out(models, baseline)
    return models, baseline, errors, first.mae if turns else None


class _About(NamedTuple):
    """What a verdict is about: the models that were compared and what was found of them."""

    models: ModelComparison
    rounds: tuple[Round, ...]
    untestable: dict[str, str]
    structures: Structures | None = None
    free: Free | None = None
    left_over: Regular | None = None


def _other_structures(about: _About, known: Sequence[str], ruled_out: Sequence[str], whole: Forward) -> _About:
    """Hold other structures against a drawing that lacks something, and seek effects about a free one."""
    models, rounds, case = about.models, about.rounds, about.models.case
    told, alone = judge(rounds, about.untestable).name, summarised(rounds).by_size_alone()
    unexplained = told in ("unexplained", "no_gap")  # or a regression says that there is a gap
    # a drawing that is known to lack what nothing explains has no advance
    advance = 0.0 if unexplained else ADVANCE
    for fit in held_against(rounds, case.building.geometry_quality):
        least = must_be_better_by([e for e in fit.effects if e not in known])
        beside = [] if GAINS in ruled_out else [rounds[0].before.effects]
        if beside and fit is rounds[-1].before and fit is not rounds[0].before:
            beside.append(fit.effects)
        structures = Structures(*other_structures(models, fit, whole.part(0.5), advance, beside, min(advance, least)))
        about = about._replace(structures=structures)
        kept = structures.kept
        if kept is not None and finds_people(kept):
            return _beside_people(about, structures, kept, whole)
        if kept is not None and drawing_fails(structures.rungs, kept, least):  # names make up for it
            part = whole.part(0.6, "free structure")
            free = search_free(models, rounds, structures.rungs, kept, known, ruled_out, part)
            structures = Structures(free.rungs, free.kept, free.kept.left)
            return _About(free.models, free.rounds, free.untestable, structures, free, free.left_over)
    if unexplained and (rounds[0].accepted or alone) and not is_large(case.building.zone_names):
        left_over = regular(models, rounds[-1].after)
        if rounds[0].accepted or not left_over.matters:  # large errors of which nothing comes back are by chance
            return about._replace(left_over=left_over)
    return about


def _beside_people(about: _About, structures: Structures, kept: FittedCase, whole: Forward) -> _About:
    """Seek what else is missing beside people who have hours of their own in each zone."""
    models = about.models
    rounds, found = with_people(models, about.rounds, kept)
    testable = [e for e in CATALOGUE if e not in about.untestable]
    rounds += search(models, found.fit, found.held_out, testable, whole.part(0.6, "beside people's heat"))
    final = rounds[-1].after
    left = left_out(final.known, models.tuned, models.settings.spin_up_seconds)
    unexplained = judge(rounds, about.untestable).name == "unexplained"
    left_over = regular(models, final) if unexplained else None
    return about._replace(rounds=rounds, structures=structures._replace(kept=None, left=left), left_over=left_over)
