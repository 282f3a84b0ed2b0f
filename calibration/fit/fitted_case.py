"""A case whose parameters are estimated, and the judgement of the estimate on tuning and held-out intervals."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version

from calibration.errors import CalibrationError
from calibration.estimation.bands import Forecaster
from calibration.evaluation.case_model import CaseModel
from calibration.evaluation.intervals import Interval, default_intervals, horizon_steps, select_runs
from calibration.evaluation.n_step import HORIZONS, Evaluation, EvaluationSettings
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.estimate import Estimate
from calibration.fit.left_out import Fitted, LeftOut, begin_at, left_out
from calibration.fit.likelihood import InnovationsProblem
from calibration.fit.problem import tuning_problem
from calibration.fit.result import CalibrationResult, SolverReport, describe
from calibration.fit.starts import STOPPED, solve_starts
from calibration.fit.told import told_by
from calibration.identifiability.information import information_of
from calibration.progress import Forward, Progress
from thermal.case.case import Case
from thermal.inputs.normalisation import fit_normalisation
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import ReducedModel, reduced_model

#: Zones beyond which no days are left out and no lumped structure is fitted: that has some ten parameters a zone.
_MOST_ZONES = 40


@dataclass(frozen=True)
class FittedCase:
    """A case whose parameters are estimated.

    Parameters
    ----------
    model : CaseModel
        As drawn, at the start of the parameters.
    reduced : ReducedModel
        Of it.
    best : Estimate
        Over the starts.
    failures : tuple of str
        What was wrong with the starts that failed.
    tuned, judged : tuple of Interval
        Where it was fitted, and where it is judged.
    settings : CalibrationSettings
        Model and fit.
    left : LeftOut or None
        Tuning days predicted by fits without them, where that is done already.
    """

    model: CaseModel
    reduced: ReducedModel
    best: Estimate
    failures: tuple[str, ...]
    tuned: tuple[Interval, ...]
    judged: tuple[Interval, ...]
    settings: CalibrationSettings
    left: LeftOut | None = None

    @property
    def case(self) -> Case:
        """Building and telemetry."""
        return self.model.case

    @property
    def calibration(self) -> CalibrationSettings:
        """Settings of the fit."""
        return self.settings

    @property
    def left_out_mae(self) -> float:
        """Mean absolute error on tuning days that were left out [K]; NaN where none were."""
        return float("nan") if self.left is None else self.left.mae

    def raise_if_interrupted(self) -> None:
        """Pass Ctrl-C on, which ended one of the starts and left the best of the others.

        Raises
        ------
        KeyboardInterrupt
            When it did.
        """
        if self.best.solve.interrupted or any(STOPPED in failure for failure in self.failures):
            raise KeyboardInterrupt

    def result(self, began: float, progress: Progress | None = None) -> CalibrationResult:
        """Judge the estimate on the grid and on the held-out intervals.

        Parameters
        ----------
        began : float
            When the calibration began, by `time.perf_counter` [s].
        progress : callable, optional
            Called with stage, done, total.
        """
        before, best, chosen = self.model, self.best, self.settings
        after = replace(
            before, theta=best.theta, source="estimate", disturbance=best.disturbance, band_factors=self._band_factors()
        )
        whole = Forward(progress)
        quick, check = after.certified(self.judged[0], horizon_steps(chosen.horizon, after.inputs.step), best.model)
        calibrated = self._evaluated(after, quick, whole.part(0.5, "held-out days"))
        seconds, solve = time.perf_counter() - began, best.solve
        network, information = before.grid.network, information_of(best)
        return CalibrationResult(
            case=before.case.building.name,
            zones=network.zones,
            parameters=describe(best, information, network.nominal),
            theta=best.theta,
            tuning=self.tuned,
            held_out=self.judged,
            uncalibrated=self.uncalibrated(whole.part(1.0, "before calibration")),
            calibrated=calibrated,
            solver=SolverReport(
                "ipopt", solve.status, solve.success, best.iterations, seconds, chosen.starts, self.failures,
                best.evaluations, best.settled,
            ),
            disturbance=best.disturbance,
            band_factors=after.band_factors,
            excess=best.excess,
            information=information,
            grid_check=check,
            objective=chosen.objective,
            horizon=chosen.horizon,
            settings=chosen.model,
            seed=chosen.seed,
            version=version("buildingmpc"),
            told=told_by(best),
        )  # fmt: skip

    def uncalibrated(self, progress: Progress | None = None) -> dict[str, Evaluation]:
        """Errors at the start of the parameters.

        Parameters
        ----------
        progress : callable, optional
            Called with stage, done, total.
        """
        return self._evaluated(self.model, self.reduced, progress)  # exact where it was made

    def _band_factors(self) -> dict[str, float]:
        """Make bands of predictions, where days were left out or somebody wants to know how good the model is."""
        best, chosen, left = self.best, self.settings, self.left
        small = not is_large(self.model.grid.network.zones)
        if left is None and chosen.yardsticks and small and chosen.objective == "multi_step":
            left = left_out(best, self.tuned, chosen.spin_up_seconds)
        if left is None or len(left.parts) < 2 or best.disturbance is None:
            return {}
        settings = EvaluationSettings(chosen.horizon, scheme=chosen.stepping, spin_up_seconds=chosen.spin_up_seconds)
        forecaster = Forecaster(best.model, self.model.inputs, best.disturbance, settings)
        return forecaster.factors(left.parts, left.thetas)

    def _evaluated(
        self, model: CaseModel, quick: SymbolicModel, progress: Progress | None
    ) -> dict[str, Evaluation]:
        """Errors on both kinds of interval, at other horizons too where held out."""
        horizon, errors, whole = self.settings.horizon, {}, Forward(progress)
        for name, part in (("tuning", self.tuned), ("held_out", self.judged)):
            settings = EvaluationSettings(horizon, True, HORIZONS if name == "held_out" else ())
            errors[name] = model.evaluate(quick, part, settings, whole.part(0.5 if name == "tuning" else 1.0))
        return errors


def fit_case(
    case: Case,
    tune: Sequence[Interval],
    hold_out: Sequence[Interval],
    settings: CalibrationSettings,
    progress: Progress | None = None,
    begin: Fitted | None = None,
) -> FittedCase:
    """Estimate the parameters of a case; `FittedCase.result` judges them.

    Parameters
    ----------
    case, tune, hold_out, progress
        As `calibrate` takes them.
    settings : CalibrationSettings
        Model and fit.
    begin : Fitted, optional
        A simpler model, at whose estimate this one begins; the centres of the priors by default.

    Raises
    ------
    CalibrationError
        As `calibrate` does.
    """
    tuned, judged = default_intervals(case, tune, hold_out)
    settings = with_normalisation(settings, case, tuned)
    _refuse_overlap(tuned, judged)
    problem = tuning_problem(case, tuned, settings)
    if begin is not None:
        problem = begin_at(problem, begin)
    grid, inputs, given = problem.grid, problem.inputs, problem.start
    for interval in judged:  # refused now rather than after the solve
        select_runs(inputs, interval, problem.steps, spin_up=settings.spin_up_seconds)
    first = reduced_model(grid, [given])
    if settings.objective == "innovations":
        problem = InnovationsProblem(
            grid, inputs, problem.runs, problem.steps, problem.free, given, problem.scheme, loss=settings.loss,
            intervals=tuple(tuned), spin_up_seconds=settings.spin_up_seconds, population=problem.population,
        ).at(first, given)  # fmt: skip
    best, failures = solve_starts(problem, first, settings.starts, settings.seed, progress, close=begin is not None)
    before = CaseModel(case, settings.model, grid, inputs, given, "start")
    return FittedCase(before, first, best, tuple(failures), tuple(tuned), tuple(judged), settings)


def with_normalisation(settings: CalibrationSettings, case: Case, tuned: Sequence[Interval]) -> CalibrationSettings:
    """Fit the constants of a model's inputs on tuning intervals, where it has inputs that are counted by some.

    Parameters
    ----------
    settings : CalibrationSettings
        Model and fit.
    case : Case
        With telemetry.
    tuned : sequence of Interval
        Where it is fitted.
    """
    if not (settings.effects or settings.structure.is_counted):
        return settings
    return replace(settings, normalisation=fit_normalisation(case, ((i.start, i.end) for i in tuned)))


def is_large(zones: Sequence[str]) -> bool:
    """Whether a building has too many zones to leave days out, or to be fitted lumped.

    Parameters
    ----------
    zones : sequence of str
        Their names.
    """
    return len(zones) > _MOST_ZONES


def _refuse_overlap(tuning: Sequence[Interval], held_out: Sequence[Interval]) -> None:
    for a in tuning:
        for b in held_out:
            if a.start <= b.end and b.start <= a.end:
                raise CalibrationError(
                    f"intervals: tuning {a.start}/{a.end} and held-out {b.start}/{b.end} overlap; "
                    "a held-out target may not be tuned on"
                )
