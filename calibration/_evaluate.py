"""N-step prediction error exactly as the paper defines it, and per zone and per horizon."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from calibration._intervals import Interval, Runs, horizon_steps, select_runs
from calibration.errors import HorizonError, NotEnoughDataError
from thermal import Inputs, SymbolicModel, free_runs, spin_up
from thermal.model import IMPLICIT_EULER, SPIN_UP, Matrices, Scheme

FloatArray = NDArray[np.float64]

#: Called with what is being done, how much is done and how much there is.
Progress = Callable[[str, int, int], None]

#: Horizons reported beside the main one.
HORIZONS = ("5min", "1h", "3h", "6h", "24h")


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
class Metrics:
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

    def to_dict(self) -> dict[str, float]:
        """Values by name."""
        return {"mae": self.mae, "median": self.median, "bias": self.bias}


@dataclass(frozen=True)
class Evaluation:
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
    """

    steps: int
    step_seconds: float
    predictions: tuple[Predictions, ...]
    zones: tuple[str, ...]
    by_horizon: dict[str, float] = field(default_factory=dict)

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
        return {
            "steps": self.steps,
            "step_seconds": self.step_seconds,
            "intervals": [
                {
                    **p.interval.to_dict(),
                    **spatial_metrics(p.error).to_dict(),
                    "runs": len(p.start),
                    "skipped": p.skipped,
                }
                for p in self.predictions
            ],
            **self.metrics.to_dict(),
            "by_zone": self.by_zone(),
            "by_horizon": self.by_horizon,
        }


def spatial_metrics(error: FloatArray) -> Metrics:
    """MAE, median and bias of errors at the N-th step.

    Parameters
    ----------
    error : ndarray, shape (n_run, n_zone)
        Simulated minus measured [K], NaN where not measured.

    Notes
    -----
    Paper: ``ε_t = 1/Z Σ_z |T_real,t,z - T_sim,t,z|``.

    Examples
    --------
    >>> spatial_metrics(np.array([[0.5, -0.1], [0.2, 0.4]]))
    Metrics(mae=0.3, median=0.25, bias=0.25)
    """
    return Metrics(
        mae=round(float(np.nanmean(np.nanmean(np.abs(error), axis=1))), 12),
        median=round(float(np.nanmean(np.nanmedian(error, axis=1))), 12),
        bias=round(float(np.nanmean(np.nanmean(error, axis=1))), 12),
    )


def predict_runs(
    model: SymbolicModel,
    matrices: Matrices,
    inputs: Inputs,
    interval: Interval,
    runs: Runs,
    steps: int,
    keep: NDArray[np.int64] | None = None,
    scheme: Scheme = IMPLICIT_EULER,
) -> Predictions:
    """Simulate the runs of one interval: spin-up with the zones held, then N free steps.

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
    runs : Runs
        From `select_runs`.
    steps : int
        N.
    keep : ndarray of int, optional
        Steps to keep; the last only by default.
    scheme : Scheme
        Time stepping of the free runs.
    """
    keep = np.array([steps]) if keep is None else keep
    states, _ = spin_up(matrices, inputs, runs.begin, runs.starts)
    simulated, _ = free_runs(matrices, model.network, inputs, runs.starts, steps, states, scheme=scheme, keep=keep)
    measured = np.where(
        np.isfinite(inputs.bridged[runs.starts])[:, None, :], inputs.zone[runs.starts[:, None] + keep[None, :]], np.nan
    )
    return Predictions(
        interval, inputs.stamps[runs.starts], simulated, measured, keep, inputs.bridged[runs.starts], runs.skipped
    )


def evaluate_model(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    intervals: Sequence[Interval],
    horizon: str = "6h",
    *,
    trajectories: bool = False,
    horizons: Sequence[str] = (),
    scheme: Scheme = IMPLICIT_EULER,
    spin_up_seconds: float = SPIN_UP,
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
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    NotEnoughDataError
        When an interval has no run.
    """
    matrices = model.matrices(theta)
    steps = horizon_steps(horizon, inputs.step)
    total = len(intervals) * (1 + len(horizons))

    def runs_of(n: int, keep: NDArray[np.int64] | None, interval: Interval) -> Predictions:
        runs = select_runs(inputs, interval, n, spin_up=spin_up_seconds)
        if runs.starts.size == 0:
            raise NotEnoughDataError(
                f"interval {interval.start} to {interval.end}: all {runs.skipped} runs miss telemetry"
            )
        return predict_runs(model, matrices, inputs, interval, runs, n, keep, scheme)

    main, done = [], 0
    for interval in intervals:
        main.append(runs_of(steps, np.arange(1, steps + 1) if trajectories else None, interval))
        done += 1
        if progress is not None:
            progress("predict", done, total)
    by_horizon = {}
    for name in horizons:
        try:
            n = horizon_steps(name, inputs.step)
            errors = [runs_of(n, None, interval).error for interval in intervals]
        except (HorizonError, NotEnoughDataError):
            errors = []
        if errors:
            by_horizon[name] = spatial_metrics(np.concatenate(errors)).mae
        done += len(intervals)
        if progress is not None:
            progress("predict", done, total)
    return Evaluation(steps, inputs.step, tuple(main), model.network.zones, by_horizon)
