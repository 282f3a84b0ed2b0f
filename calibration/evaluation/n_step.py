"""N-step prediction error exactly as the paper defines it, and per zone and per horizon."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from calibration.errors import HorizonError, NotEnoughDataError
from calibration.evaluation.carried import Carried
from calibration.evaluation.intervals import Interval, Runs, horizon_steps, select_runs
from calibration.evaluation.yardsticks import Yardsticks
from calibration.progress import Progress
from calibration.results import Axes, Plain, Result
from thermal._types import FloatArray
from thermal.case.estimated import Estimated, estimate_entry
from thermal.model.case_replay import SPIN_UP, Inputs, free_runs, spin_up
from thermal.model.matrices import Matrices, SymbolicModel
from thermal.model.step import IMPLICIT_EULER, Scheme
from thermal.network.network import ThermalNetwork

#: Horizons reported beside the main one.
HORIZONS = ("5min", "1h", "3h", "6h", "24h")


@dataclass(frozen=True)
class EvaluationSettings:
    """Which runs are made and what is kept of them.

    Parameters
    ----------
    horizon : str
        The prediction horizon; six hours in the paper.
    trajectories : bool
        Keep every step of the runs instead of the last only.
    horizons : sequence of str
        Further horizons; those that are no multiple of the step, or leave no run, are left out.
    scheme : Scheme
        Time stepping of the free runs.
    spin_up_seconds : float
        Telemetry before an interval that the spin-up may use [s].
    """

    horizon: str = "6h"
    trajectories: bool = False
    horizons: Sequence[str] = ()
    scheme: Scheme = IMPLICIT_EULER
    spin_up_seconds: float = SPIN_UP


@dataclass(frozen=True)
class Predictions:
    """N-step runs of one interval, simulated and measured.

    Parameters
    ----------
    interval : Interval
        Where the targets lie.
    start : DatetimeIndex, length n_run
        Stamps t0.
    simulated, measured : ndarray, shape (n_run, n_kept, n_zone)
        Zone temperatures, means over the steps [K]; NaN where not measured.
    steps : ndarray of int, shape (n_kept,)
        Which steps are kept.
    initial : ndarray, shape (n_run, n_zone)
        Measured zone temperatures at t0 [K].
    skipped : int
        Runs left out for missing telemetry.
    """

    interval: Interval
    start: pd.DatetimeIndex
    simulated: FloatArray
    measured: FloatArray
    steps: NDArray[np.int64]
    initial: FloatArray
    skipped: int

    @property
    def error(self) -> FloatArray:
        """Simulated minus measured at the last step, shape (n_run, n_zone) [K]."""
        return self.simulated[:, -1] - self.measured[:, -1]


@dataclass(frozen=True)
class Metrics(Plain):
    """Spatial errors at the N-th step.

    Parameters
    ----------
    mae : float
        The paper's ε_t averaged over runs: mean over zones of ``|T_real - T_sim|`` [K].
    median : float
        Median over zones of ``T_sim - T_real``, averaged over runs [K].
    bias : float
        Mean of ``T_sim - T_real`` [K].
    """

    mae: float
    median: float
    bias: float


@dataclass(frozen=True, repr=False)
class Evaluation(Result):
    """N-step prediction error of a model on intervals of telemetry.

    Parameters
    ----------
    steps : int
        N.
    step_seconds : float
        Step [s].
    predictions : tuple of Predictions
        One an interval.
    zones : tuple of str
        Zone names.
    by_horizon : mapping of str to float
        MAE at other horizons, each from its own runs [K].
    yardsticks : Yardsticks or None
        Errors of simple models on the same runs, where they were asked for.
    carried : Carried or None
        Errors when runs begin from a filter's state and carry its unmeasured heat on; None without a disturbance model.
    estimated : tuple of Estimated
        Where heat of the telemetry is estimated.
    """

    steps: int
    step_seconds: float
    predictions: tuple[Predictions, ...]
    zones: tuple[str, ...]
    by_horizon: dict[str, float] = field(default_factory=dict)
    yardsticks: Yardsticks | None = None
    carried: Carried | None = None
    estimated: tuple[Estimated, ...] = ()

    @property
    def beside(self) -> dict[str, Any]:
        """What files hold beside the errors, as far as it was made: with heat carried on, and yardsticks."""
        carried = {} if self.carried is None else {"carried": self.carried.to_dict()}
        return carried | ({} if self.yardsticks is None else self.yardsticks.beside(self.metrics.mae))

    @property
    def metrics(self) -> Metrics:
        """Over all intervals."""
        return spatial_metrics(np.concatenate([p.error for p in self.predictions]))

    def by_zone(self) -> dict[str, dict[str, float]]:
        """MAE and bias of every measured zone [K]."""
        error = np.concatenate([p.error for p in self.predictions])
        seen = np.isfinite(error).any(axis=0)
        return {
            zone: {"mae": float(np.nanmean(np.abs(e))), "bias": float(np.nanmean(e))}
            for zone, e, s in zip(self.zones, error.T, seen, strict=True)
            if s
        }

    def to_dict(self) -> dict[str, Any]:
        """Contents of ``evaluation.json``."""
        intervals = [
            p.interval.to_dict() | spatial_metrics(p.error).to_dict() | {"runs": len(p.start), "skipped": p.skipped}
            for p in self.predictions
        ]
        plain = {"steps": self.steps, "step_seconds": self.step_seconds, "intervals": intervals}
        return {**plain, **self.metrics.to_dict(), "by_zone": self.by_zone(), "by_horizon": self.by_horizon,
                **self.beside, **estimate_entry(self.estimated)}  # fmt: skip

    def to_frame(self) -> pd.DataFrame:
        """Errors of every measured zone [K]."""
        return pd.DataFrame.from_dict(self.by_zone(), orient="index", columns=["mae", "bias"]).rename_axis("zone")

    def growth(self) -> pd.Series[float]:
        """MAE by the time since the start of a run [h]: of the steps that were kept, in kelvin."""
        error = np.concatenate([np.abs(p.simulated - p.measured) for p in self.predictions])
        hours = self.predictions[0].steps * self.step_seconds / 3600.0
        mae = np.nanmean(np.nanmean(error, axis=2), axis=0)
        return pd.Series(mae, index=pd.Index(hours, name="hours"), name="mae", dtype=float)

    def _summary(self) -> str:
        runs, m = sum(len(p.start) for p in self.predictions), self.metrics
        ahead = self.steps * self.step_seconds / 3600.0
        return f"MAE {m.mae:.3f} K, bias {m.bias:+.3f} K at {ahead:g} h, {runs} runs, {len(self.zones)} zones"

    def _draw(self, axes: Axes) -> None:
        growth = self.growth()
        axes.plot(growth.index, growth, marker="o" if len(growth) == 1 else "")
        axes.set(xlabel="time since the start [h]", ylabel="MAE [K]")
        axes.set_ylim(0.0)


def spatial_metrics(error: FloatArray) -> Metrics:
    """MAE, median and bias of errors at the N-th step.

    Parameters
    ----------
    error : ndarray, shape (n_run, n_zone)
        Simulated minus measured [K], NaN where not measured; a run in which nothing is has no part.

    Notes
    -----
    Paper: ``ε_t = 1/Z Σ_z |T_real,t,z - T_sim,t,z|``.

    Examples
    --------
    >>> spatial_metrics(np.array([[0.5, -0.1], [0.2, 0.4]]))
    Metrics(mae=0.3, median=0.25, bias=0.25)
    """
    error = error[np.isfinite(error).any(axis=1)]
    if not error.size:
        return Metrics(mae=float("nan"), median=float("nan"), bias=float("nan"))
    return Metrics(
        mae=round(float(np.nanmean(np.nanmean(np.abs(error), axis=1))), 12),
        median=round(float(np.nanmean(np.nanmedian(error, axis=1))), 12),
        bias=round(float(np.nanmean(np.nanmean(error, axis=1))), 12),
    )


class Wanted(NamedTuple):
    """Runs of one interval, and the steps of them that are wanted."""

    runs: Runs
    keep: NDArray[np.int64]


#: Simulates sets of runs of one interval, each to zone means at its kept steps (n_run, n_kept, n_zone) [K].
Simulate = Callable[[Sequence[Wanted]], list[FloatArray]]


def evaluate_runs(
    simulate: Simulate,
    inputs: Inputs,
    zones: tuple[str, ...],
    intervals: Sequence[Interval],
    settings: EvaluationSettings,
    progress: Progress | None,
) -> Evaluation:
    """Choose the runs of every interval and horizon, simulate them, and compare them with what was measured.

    Parameters
    ----------
    simulate : callable
        Simulates all the runs of one interval.
    inputs : Inputs
        The telemetry.
    zones : tuple of str
        Zone names.
    intervals, settings, progress
        As in `evaluate_model`.

    Raises
    ------
    NotEnoughDataError
        When an interval has no run.
    """
    steps, spin_up_seconds = horizon_steps(settings.horizon, inputs.step), settings.spin_up_seconds
    keep = np.arange(1, steps + 1) if settings.trajectories else np.array([steps])
    main: list[Predictions] = []
    errors: dict[str, list[FloatArray]] = {name: [] for name in settings.horizons}
    for done, interval in enumerate(intervals):
        runs = select_runs(inputs, interval, steps, spin_up=spin_up_seconds)
        if runs.starts.size == 0:
            raise NotEnoughDataError(
                f"interval {interval.start} to {interval.end}: all {runs.skipped} runs miss telemetry"
            )
        found = {name: _further(inputs, interval, name, spin_up_seconds) for name in settings.horizons}
        further = {name: wanted for name, wanted in found.items() if wanted is not None}
        wanted = [Wanted(runs, keep), *further.values()]
        predicted = [_predictions(inputs, interval, w, s) for w, s in zip(wanted, simulate(wanted), strict=True)]
        main.append(predicted[0])
        for name, others in zip(further, predicted[1:], strict=True):
            errors[name].append(others.error)
        if progress is not None:
            progress("predict", done + 1, len(intervals))
    by_horizon = {n: spatial_metrics(np.concatenate(e)).mae for n, e in errors.items() if len(e) == len(intervals)}
    return Evaluation(steps, inputs.step, tuple(main), zones, by_horizon)


def _further(inputs: Inputs, interval: Interval, horizon: str, spin_up_seconds: float) -> Wanted | None:
    """Find the runs of a further horizon, None where there are none."""
    try:
        steps = horizon_steps(horizon, inputs.step)
        runs = select_runs(inputs, interval, steps, spin_up=spin_up_seconds)
    except (HorizonError, NotEnoughDataError):
        return None
    return Wanted(runs, np.array([steps])) if runs.starts.size else None


def _predictions(inputs: Inputs, interval: Interval, wanted: Wanted, simulated: FloatArray) -> Predictions:
    """Put runs beside what was measured; a zone that could not be matched at its start has no error."""
    runs, keep = wanted
    known, measured = inputs.bridged[runs.starts], inputs.targets(runs.starts, keep)
    return Predictions(interval, inputs.stamps[runs.starts], simulated, measured, keep, known, runs.skipped)


def evaluate_model(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    intervals: Sequence[Interval],
    settings: EvaluationSettings | None = None,
    progress: Progress | None = None,
) -> Evaluation:
    """N-step prediction error of a model at θ.

    Parameters
    ----------
    model : SymbolicModel
        On the grid or reduced.
    theta : ndarray, shape (n_parameter,)
        Parameter values, each in the unit of its `Parameter` [parameter units].
    inputs : Inputs
        The telemetry.
    intervals : sequence of Interval
        Runs start every hour such that their targets lie inside.
    settings : EvaluationSettings, optional
        Horizons, time stepping, and what is kept.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    NotEnoughDataError
        When an interval has no run.
    """
    chosen, matrices = settings or EvaluationSettings(), model.matrices(theta)

    def simulate(wanted: Sequence[Wanted]) -> list[FloatArray]:
        return _simulate(model.network, matrices, inputs, wanted, chosen.scheme)

    return evaluate_runs(simulate, inputs, model.network.zones, intervals, chosen, progress)


def predict_runs(
    model: SymbolicModel, matrices: Matrices, inputs: Inputs, interval: Interval, wanted: Wanted, scheme: Scheme
) -> Predictions:
    """Simulate runs of one interval that somebody chose: spin-up with the zones held, then N free steps.

    Parameters
    ----------
    model : SymbolicModel
        For its network.
    matrices : Matrices
        The model at one θ.
    inputs : Inputs
        The telemetry.
    interval : Interval
        Where the targets lie.
    wanted : Wanted
        From `select_runs`, with the steps to keep.
    scheme : Scheme
        Time stepping of the free runs.
    """
    return _predictions(inputs, interval, wanted, _simulate(model.network, matrices, inputs, [wanted], scheme)[0])


def _simulate(
    network: ThermalNetwork, matrices: Matrices, inputs: Inputs, wanted: Sequence[Wanted], scheme: Scheme
) -> list[FloatArray]:
    """Spin up and run every start once, as far as any set of runs wants it: on the way it meets the others' targets."""
    simulated: dict[int, FloatArray] = {}
    day = wanted[0].runs.begin + int(86400.0 / inputs.step)
    # a spin-up begins from the mean of its first day, or of what lies before its first start
    begins = [min(int(w.runs.starts[0]), day) for w in wanted]
    for begin in set(begins):
        numbers = [i for i, other in enumerate(begins) if other == begin]
        alike = [wanted[i] for i in numbers]
        starts = np.unique(np.concatenate([w.runs.starts for w in alike]))
        steps = np.unique(np.concatenate([w.keep for w in alike]))
        rows, reach = [np.searchsorted(starts, w.runs.starts) for w in alike], np.zeros(starts.size, dtype=np.int64)
        for w, row in zip(alike, rows, strict=True):
            reach[row] = np.maximum(reach[row], w.keep[-1])
        states, _ = spin_up(matrices, inputs, wanted[0].runs.begin, starts)
        means = np.full((starts.size, steps.size, len(network.zones)), np.nan)
        for last in np.unique(reach):
            part, keep = np.flatnonzero(reach == last), steps[steps <= last]
            found = free_runs(matrices, inputs, starts[part], keep, states[:, part], scheme=scheme)
            means[part, : keep.size] = found[0]
        for i, w, row in zip(numbers, alike, rows, strict=True):
            simulated[i] = means[row][:, np.searchsorted(steps, w.keep)]
    return [simulated[i] for i in range(len(wanted))]
