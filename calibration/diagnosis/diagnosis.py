"""Diagnosis of a case: where model and building disagree, which effect causes it, how far the gap shrinks with it."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from typing import Any

import pandas as pd

from calibration.diagnosis.baseline import fit_baseline
from calibration.diagnosis.correction import CORRECTED, Correction, correct
from calibration.diagnosis.decide.verdict import Verdict, chance_of
from calibration.diagnosis.decide.where import DriftCurve, Where, drift_of, where_it_lies
from calibration.diagnosis.faults import Fault
from calibration.diagnosis.free import is_recurring
from calibration.diagnosis.handed_on import fit_content, judge_handed_on, other_structures, with_correction
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.how_far import Step
from calibration.diagnosis.refit.refit import held_out
from calibration.diagnosis.refit.search import Round, accepted_from
from calibration.diagnosis.screen.missing import Missing, at_start, missing_heat
from calibration.diagnosis.screen.regular import Regular
from calibration.diagnosis.seek import answer_entries, seek
from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation
from calibration.evaluation.settings import ModelSettings
from calibration.fit.ladder import ADVANCE, GAINS
from calibration.fit.result import CalibrationResult, Rung, SolverReport
from calibration.progress import Forward, Progress
from calibration.results import Axes, Result, plain
from thermal.case.case import Case
from thermal.case.estimated import Estimated, estimate_entry

#: Subsystem that an effect belongs to.
SUBSYSTEMS = {
    **dict.fromkeys(("flow_gain", "duct_loss", "capacity_limit", "valve_leak"), "terminal"),
    **dict.fromkeys(("sensor_bias", "sensor_lag", "clock_shift", "wrong_station"), "sensor"),
    **dict.fromkeys(("internal_gains", "latent_load"), "use"),
}


@dataclass(frozen=True)
class Replay:
    """A fitted model on the held-out intervals.

    Parameters
    ----------
    evaluation : Evaluation
        Its predictions, with every step.
    missing : Missing
        Heat that it lacks by hour and zone.
    drift : DriftCurve
        How the error of its free runs grows.
    """

    evaluation: Evaluation
    missing: Missing
    drift: DriftCurve


@dataclass(frozen=True, repr=False)
class Diagnosis(Result):
    """Outcome of `diagnose`.

    Parameters
    ----------
    case : str
        Name of the case.
    verdict : Verdict
        Which effect.
    where : Where
        Where the calibrated baseline is wrong.
    steps : tuple of Step
        How far each accepted effect closes the gap.
    gap, floor : float
        Held-out mean absolute error of the calibrated baseline, faults of the telemetry mended, and that below which
        nothing found lowers it [K].
    p_value : float
        Probability of as large a gain where nothing is missing [-].
    detectable : mapping of str to float
        Smallest constant heat that would have been found, by zone [W].
    rounds : tuple of Round
        Of the search.
    tuned, judged : tuple of Interval
        Where models were fitted, and where errors are measured.
    seconds : float
        Wall time [s].
    version : str
        Of the library.
    seed : int
        Of all resampling; it is fixed.
    settings : ModelSettings
        How the baseline was built and run.
    horizon : str
        Prediction horizon.
    last_third : float or None
        Held-out mean absolute error of a baseline tuned on the first two thirds [K], where that was so large that
        tuning and held-out days alternate instead.
    rungs : tuple of Rung
        The final model and other structures by their errors on left-out tuning days; empty where there was no choice.
    better : CalibrationResult or None
        Of another structure, where it predicts those days better.
    prediction : Evaluation
        Held-out errors of the model that is handed on, `final` or the better one, beside those of simple models.
    estimated : tuple of Estimated
        Where heat of the telemetry is estimated.
    disturbance : DisturbanceModel or None
        Unmeasured heat and sensor noise of the final model, where that is handed on.
    band_factors : mapping of str to float
        What the filter's deviation is multiplied by for bands of its predictions, by zone [-].
    left_over : Regular or None
        What comes back of the final model's errors, where the verdict hangs on it: where the drawing does not hold, an
        effect was accepted and much is left, or errors are merely large.
    correction : Correction or None
        The baseline with heat of unknown cause, where no effect explains what is missing and such heat is certified.
    faults : tuple of Fault
        Of the telemetry, which were mended before anything else: all the rest is about the mended case.
    outdone : float or None
        Held-out mean absolute error of a regression on the same telemetry, where that says that something is missing
        beside all that was found [K].
    """

    case: str
    verdict: Verdict
    where: Where
    steps: tuple[Step, ...]
    gap: float
    floor: float
    p_value: float
    detectable: Mapping[str, float]
    rounds: tuple[Round, ...]
    tuned: tuple[Interval, ...]
    judged: tuple[Interval, ...]
    seconds: float
    version: str
    prediction: Evaluation
    seed: int = field(default=0)
    settings: ModelSettings = field(default_factory=ModelSettings)
    horizon: str = "6h"
    last_third: float | None = None
    rungs: tuple[Rung, ...] = ()
    better: CalibrationResult | None = None
    estimated: tuple[Estimated, ...] = ()
    disturbance: DisturbanceModel | None = None
    band_factors: Mapping[str, float] = field(default_factory=dict)
    left_over: Regular | None = None
    correction: Correction | None = None
    faults: tuple[Fault, ...] = ()
    outdone: float | None = None

    @property
    def final(self) -> Fit:
        """Model with all accepted effects."""
        return self.rounds[-1].after

    @property
    def found(self) -> tuple[str, ...]:
        """Effects that were found: faults of the telemetry, then those that were accepted, and people's heat in a gain.

        Neither those that were known nor the clock of a structure that moves heat in time.
        """
        begun, faults = self.rounds[0].before.effects, [f.effect for f in self.faults]
        accepted = [effect for effect in self.final.effects if effect not in begun]
        return tuple(dict.fromkeys((*faults, *accepted, *([GAINS] if is_recurring(self.verdict) else []))))

    @property
    def gap_as_read(self) -> float:
        """Held-out mean absolute error of the calibrated baseline before faults of the telemetry were mended [K]."""
        return self.faults[0].before.held_out if self.faults else self.gap

    @property
    def drawing_fails(self) -> bool:
        """Whether the drawing does not hold, so that effects were sought about a free structure."""
        return self.settings.structure.lumped

    @property
    def taken(self) -> Fit:
        """What is handed on where no other structure predicts better: `final`, or the model with missing heat."""
        corrected = any(r.chosen and r.name == CORRECTED for r in self.rungs)
        return self.correction.fit if self.correction is not None and corrected else self.final

    @property
    def subsystem(self) -> str:
        """Part of the building that the first accepted effect belongs to; ``none`` where nothing is accepted."""
        first = self.rounds[0].accepted
        if self.faults:
            return "sensor"
        if first is None:
            return "unknown" if self.verdict.name == "unexplained" else "none"
        return SUBSYSTEMS.get(first.screened.effect, "envelope")

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``diagnosis.json`` but for its sentence, which `mpc.reports` adds."""
        w, simple, carried = self.where, self.prediction.yardsticks, self.prediction.carried
        return {
            "verdict": self.verdict.name,
            "gap": {
                "mae": self.gap_as_read,
                "floor": self.floor,
                "p_value": self.p_value,
                "smallest_detectable_watts": self.detectable,
                "outdone": self.outdone,
                **({} if simple is None else simple.beside(self.predicts)),
            },
            "where": {
                "zones": [
                    {
                        "zone": s.name,
                        "share": s.share,
                        "missing_watts_rms": w.missing.by_zone[s.name],
                        "missing_watts_rms_at_start": w.missing_at_start.by_zone[s.name],
                    }
                    for s in w.zones
                ],
                "hours": w.hours.tolist(),
                "subsystem": self.subsystem,
                "modes": {s.name: s.to_dict() for s in w.modes},
                "drift": {"seconds": w.drift.seconds.tolist(), "rms": w.drift.rms.tolist(), "slope": w.drift.slope,
                          "kind": w.drift.kind},
                "groups": {s.name: s.to_dict() for s in w.groups},
            },
            **answer_entries(self.verdict, self.steps, self.rounds, self.faults, self.floor),
            **({} if self.left_over is None else {"left_over": plain(self.left_over)}),
            "turned": self.settings.structure.turned,
            "correction": None if self.correction is None else self.correction.to_dict(),
            "prediction": {"rungs": plain(self.rungs), "held_out_mae": self.predicts, "carried": plain(carried)},
            "intervals": {
                "tuning": plain(self.tuned),
                "held_out": plain(self.judged),
                "mae_of_last_third": self.last_third,
            },
            **{key: getattr(self, key) for key in ("seconds", "case", "version", "seed")},
            **estimate_entry(self.estimated),
        }  # fmt: skip

    @property
    def predicts(self) -> float:
        """Held-out mean absolute error of the model that is handed on: `final`, or the better one [K]."""
        return self.prediction.metrics.mae

    def replays(self) -> list[Replay]:
        """Replay the calibrated baseline on the held-out intervals, and the final model where an effect was found."""
        models = [(self.rounds[0].before, self.where.missing, self.where.drift)]
        if self.steps:
            models.append((self.final, missing_heat(self.final, self.judged), drift_of(self.final, self.judged)))
        return [
            Replay(fit.evaluate(self.judged, self.horizon, trajectories=True), missing, drift)
            for fit, missing, drift in models
        ]

    def calibration(self) -> dict[str, Any]:
        """Contents of the ``calibration.json`` of the final model, or of a structure that predicts better."""
        if self.better is not None:
            return self.better.to_dict()
        fit, found = self.taken, self.taken.found
        status = "settled" if found.converged else "evaluations used up"
        content: dict[str, Any] = plain({
            **fit_content(fit, at_start(self.rounds[0].before), self.tuned, self.judged, self.horizon),
            "solver": SolverReport("gauss_newton", status, found.converged, found.evaluations, self.seconds, 1,
                                   evaluations=found.evaluations, settled=found.converged),
            "settings": replace(self.settings, effects=dict(fit.effects)), "case": self.case, "version": self.version,
            "seed": self.seed, **estimate_entry(self.estimated), "disturbance": self.disturbance,
            "band_factors": self.band_factors,
        })  # fmt: skip
        return content

    def to_frame(self) -> pd.DataFrame:
        """Tabulate the effects of the catalogue, the likeliest first.

        Returns
        -------
        DataFrame
            Index ``effect``; ``probability``, ``score`` and ``retained_share`` [-], ``group``, ``zones``,
            ``separate_by``, ``testable`` and ``reason``, as in `Candidate`.
        """
        rows = pd.DataFrame([c.to_dict() for c in self.verdict.candidates])
        return rows.set_index("effect").drop(columns="parameters")

    def _summary(self) -> str:
        after = self.steps[-1].after if self.steps else self.gap
        found = f", with {' + '.join(self.found)} {after:.3f} K" if self.found else ""
        return f"{self.case}, {self.verdict.name}; held-out error {self.gap_as_read:.3f} K{found}"

    def _draw(self, axes: Axes) -> None:
        shown = self.to_frame().query("testable")["probability"][::-1]
        shown.plot.barh(ax=axes, xlim=(0.0, 1.0), xlabel="probability that it is there [-]")


def diagnose(
    case: Case,
    tune: Sequence[Interval] = (),
    hold_out: Sequence[Interval] = (),
    *,
    dx: float | None = None,
    horizon: str = "6h",
    known: Sequence[str] = (),
    ruled_out: Sequence[str] = (),
    progress: Progress | None = None,
) -> Diagnosis:
    """Say where model and building disagree, which unmodelled effect causes it, and how far the gap shrinks with it.

    The baseline is calibrated; every effect of the catalogue that the case can tell is then screened by its tangents,
    with the calibrated parameters free to follow, and the few best are fitted anew. The best is accepted where its
    evidence exceeds what cases without any missing effect show, and the next is sought with it in the model.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune, hold_out : sequence of Interval
        First two thirds and last third of the telemetry when both are empty, or days that alternate where the baseline
        errs so much more in the last third that it shows other weather or use; what the other leaves when one is.
    dx : float, optional
        Distance between control volumes of a plan [m]; the plan's cell size by default.
    horizon : str
        Prediction horizon, such as ``6h``.
    known : sequence of str
        Effects that are known to be there, in the whole building: part of the baseline, with strengths that are fitted.
    ruled_out : sequence of str
        Effects that are known not to be there.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    CaseError
        When the case holds what cannot be true, as `buildingmpc check` says.
    EffectError
        When an effect is not in the catalogue, or the case cannot have one that is said to be known.
    CalibrationError
        When an interval has no usable run, or an effect is both known and ruled out.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> diagnose(load_bundled_case(), dx=1.0).verdict.candidates[0].effect
    'solar_gain'
    """
    began, whole = time.perf_counter(), Forward(progress)
    found = seek(
        case, tune, hold_out, dx=dx, horizon=horizon, known=known, ruled_out=ruled_out,
        progress=whole.part(0.85),
    )  # fmt: skip
    models, rounds, verdict = found.models, found.rounds, found.verdict
    rungs, kept, left = found.structures or other_structures(models, rounds[-1].after, whole.part(0.5), ADVANCE)
    errors, where = rounds[0].held_out, where_it_lies(models, rounds[0].before)
    areas = {name: room.floor_area for name, room in models.anatomy.rooms.items()}
    watts = rounds[0].screening.detectable(accepted_from(rounds[0].own))
    correction = correct(models, rounds[0].before, errors, found.floor) if verdict.name == "unexplained" else None
    rungs, left = with_correction(models, correction, rungs, left)
    taken = correction.fit if correction is not None and rungs[-1].chosen else None
    better = None if kept is None or taken is not None else replace(kept.result(began, whole.part(0.5)), rungs=rungs)
    prediction, disturbance, factors = judge_handed_on(models, taken or rounds[-1].after, better, left)
    return Diagnosis(
        case=case.building.name, verdict=verdict, where=where, steps=found.steps, gap=errors.mae, floor=found.floor.mae,
        p_value=chance_of(rounds[0]),
        detectable={zone: w * areas[zone] for zone, w in watts.items()}, rounds=rounds, tuned=tuple(models.tuned),
        judged=tuple(models.judged), seconds=time.perf_counter() - began, version=version("buildingmpc"),
        settings=replace(models.settings, normalisation=models.drivers.normalisation), horizon=horizon,
        last_third=found.last_third, rungs=rungs, better=better, prediction=prediction,
        estimated=found.case.estimated, disturbance=disturbance, band_factors=factors,
        left_over=found.left_over, correction=correction, faults=found.faults, outdone=found.outdone,
    )  # fmt: skip


def baseline_gap(
    case: Case,
    tune: Sequence[Interval] = (),
    hold_out: Sequence[Interval] = (),
    *,
    dx: float | None = None,
    horizon: str = "6h",
) -> float:
    """Calibrate the baseline and give its held-out error, by which `diagnose` chooses its days [K].

    Parameters
    ----------
    case : Case
        Building and telemetry.
    tune, hold_out : sequence of Interval
        As in `diagnose`.
    dx : float, optional
        Distance between control volumes of a plan [m]; the plan's cell size by default.
    horizon : str
        Prediction horizon, such as ``6h``.

    Raises
    ------
    CalibrationError
        When an interval has no usable run.
    """
    return float(held_out(*fit_baseline(ModelComparison(case, ModelSettings(dx=dx), tune, hold_out, horizon), {})).mae)
