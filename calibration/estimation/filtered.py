"""A model at θ with its predictor-corrector on telemetry: filtering an interval, and N-step errors from there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.errors import FilterError
from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.gains import TOLERANCE, Covariance
from calibration.estimation.kalman import Filtered, KalmanFilter
from calibration.estimation.start_spread import start_spread
from calibration.estimation.state_space import StateSpace, mean_flow, state_space
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation, Progress, Wanted, evaluate_runs
from thermal._types import FloatArray
from thermal.model.matrices import Matrices, SymbolicModel
from thermal.model.replay import LEAST_SPIN_UP, SPIN_UP, Inputs, spin_up
from thermal.model.step import IMPLICIT_EULER, Scheme


def filter_interval(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    interval: Interval,
    disturbance: DisturbanceModel,
    *,
    scheme: Scheme = IMPLICIT_EULER,
    covariance: Covariance = "exact",
    spin_up_seconds: float = SPIN_UP,
    tolerance: float = TOLERANCE,
) -> Filtered:
    """Filter one interval of telemetry; the states at its beginning come from a spin-up.

    Parameters
    ----------
    model : SymbolicModel
        Reduced.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    inputs : Inputs
        The telemetry.
    interval : Interval
        Filtered, less the 12 hours of the least spin-up where the telemetry does not begin before.
    disturbance : DisturbanceModel
        Unmeasured heat and sensors, from `tune_disturbance` or assumed.
    scheme : Scheme
        Time stepping.
    covariance : {"exact", "steady"}
        See `KalmanFilter`.
    spin_up_seconds : float
        Telemetry before the interval that the spin-up may use [s].
    tolerance : float
        See `KalmanFilter` [-].

    Raises
    ------
    FilterError
        When the model is not reduced, or the interval too short.
    """
    ready = prepare(model, theta, inputs, scheme)
    kalman = KalmanFilter(ready.space, disturbance, covariance=covariance, tolerance=tolerance)
    begin, at, stop = rows_of(inputs, interval, spin_up_seconds, covariance)
    return kalman.filter(inputs, at, stop, *ready.start(begin, at))


@dataclass(frozen=True)
class _Prepared:
    """A model at θ, ready to be filtered.

    Parameters
    ----------
    matrices : Matrices
        The reduced model at θ.
    space : StateSpace
        Its state space, with the telemetry's mean airflows.
    inputs : Inputs
        The telemetry.
    """

    matrices: Matrices
    space: StateSpace
    inputs: Inputs

    def start(self, begin: int, at: int) -> tuple[FloatArray, FloatArray]:
        """States of the reduced model after a spin-up (n, 1) [K], and what is unknown of x, see `start_spread`.

        Parameters
        ----------
        begin, at : int
            First row of the spin-up, and the one at whose stamp the state is wanted.
        """
        states, _ = spin_up(self.matrices, self.inputs, begin, np.array([at]))
        held = np.isfinite(self.inputs.held[begin])
        return states, start_spread(self.matrices.modal.modes, self.inputs.step, at - begin, held)


def prepare(model: SymbolicModel, theta: FloatArray, inputs: Inputs, scheme: Scheme) -> _Prepared:
    """Make the state space of a model at θ.

    Parameters
    ----------
    model : SymbolicModel
        Reduced.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    inputs : Inputs
        The telemetry.
    scheme : Scheme
        Time stepping.

    Raises
    ------
    FilterError
        When the model is not reduced.
    """
    matrices, airflows = model.matrices(theta), model.network.airflows
    if not matrices.reduced:
        raise FilterError("filter: expected a reduced model, came the grid; see `thermal.reduced_model`")
    flow = mean_flow(inputs) if airflows else None
    return _Prepared(
        matrices, state_space(matrices.modal.modes, inputs.step, scheme, airflows=airflows, flow=flow), inputs
    )


def rows_of(inputs: Inputs, interval: Interval, spin_up_seconds: float, covariance: Covariance) -> tuple[int, int, int]:
    """Rows at which an interval's spin-up begins, its filter starts, and it ends.

    The spin-up has at least 12 hours, of the interval if there is no telemetry before it. With steady gains, which know
    nothing of what a spin-up leaves unknown, it has its full length or a third of what there is.

    Parameters
    ----------
    inputs : Inputs
        The telemetry.
    interval : Interval
        What is filtered.
    spin_up_seconds : float
        Longest spin-up [s].
    covariance : {"exact", "steady"}
        See `KalmanFilter`.

    Raises
    ------
    FilterError
        When nothing is left to filter after the least spin-up.
    """
    first = int(inputs.stamps.searchsorted(interval.start))
    stop = int(inputs.stamps.searchsorted(interval.end, side="right")) - 1
    begin = max(0, first - 1 - round(spin_up_seconds / inputs.step))
    least = int(np.ceil(LEAST_SPIN_UP / inputs.step))
    if covariance == "steady":
        least = max(least, min(round(spin_up_seconds / inputs.step), (stop - begin) // 3))
    at = max(first - 1, begin + least)
    if at >= stop:
        raise FilterError(
            f"interval {interval.start} to {interval.end}: expected room for a step after {LEAST_SPIN_UP / 3600:g} h "
            f"of spin-up, found {stop - begin + 1} stamps"
        )
    return begin, at, stop


def evaluate_filter(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    intervals: Sequence[Interval],
    disturbance: DisturbanceModel,
    horizon: str = "6h",
    *,
    trajectories: bool = False,
    horizons: Sequence[str] = (),
    scheme: Scheme = IMPLICIT_EULER,
    covariance: Covariance = "exact",
    spin_up_seconds: float = SPIN_UP,
    progress: Progress | None = None,
) -> Evaluation:
    """N-step prediction error from the filtered state, on the runs and in the terms of `evaluate_model`.

    The filter starts 12 hours into an interval's spin-up and knows, at the start of a run, what was measured until then
    and nothing of what comes after.

    Parameters
    ----------
    model : SymbolicModel
        Reduced.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    inputs : Inputs
        The telemetry.
    intervals : sequence of Interval
        Runs start every hour such that their targets lie inside.
    disturbance : DisturbanceModel
        Unmeasured heat and sensors, tuned on other intervals.
    horizon : str
        The prediction horizon; six hours in the paper.
    trajectories : bool
        Keep every step of the runs instead of the last only.
    horizons : sequence of str
        Further horizons; those that are no multiple of the step, or leave no run, are left out.
    scheme : Scheme
        Time stepping.
    covariance : {"exact", "steady"}
        See `KalmanFilter`.
    spin_up_seconds : float
        Telemetry before an interval that spin-up and filter may use [s].
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    NotEnoughDataError
        When an interval has no run.
    FilterError
        When the model is not reduced.
    """
    ready = prepare(model, theta, inputs, scheme)
    kalman = KalmanFilter(ready.space, disturbance, covariance=covariance)

    def simulate(wanted: Sequence[Wanted]) -> list[FloatArray]:
        begin, last = wanted[0].runs.begin, max(int(w.runs.starts[-1]) for w in wanted)
        at = begin + int(np.ceil(LEAST_SPIN_UP / inputs.step))
        filtered = kalman.filter(inputs, at, max(last, at + 1), *ready.start(begin, at))
        return [_predicted(filtered, inputs, w) for w in wanted]

    return evaluate_runs(
        simulate,
        inputs,
        model.network.zones,
        intervals,
        horizon,
        trajectories=trajectories,
        horizons=horizons,
        spin_up_seconds=spin_up_seconds,
        progress=progress,
    )


def _predicted(filtered: Filtered, inputs: Inputs, wanted: Wanted) -> FloatArray:
    """Predict runs from the filtered states at their starts, (n_run, n_kept, n_zone) [K]."""
    starts, keep = wanted.runs.starts, wanted.keep
    rows = starts + np.arange(1, int(keep[-1]) + 1)[:, None]
    boundary, heat, airflow = (v[rows].transpose(0, 2, 1) for v in (inputs.boundary, inputs.heat, inputs.airflow))
    states = filtered.states[starts - filtered.begin].T
    return filtered.kalman.predict(states, boundary, heat, keep, airflow)
