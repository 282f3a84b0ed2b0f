"""A model at θ with its predictor-corrector on telemetry: filtering an interval, and N-step errors from there.

A filter starts with what a spin-up leaves unknown of walls, slabs and furniture.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.errors import FilterError
from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.gains import TOLERANCE, Covariance
from calibration.estimation.kalman import Filtered, KalmanFilter
from calibration.estimation.state_space import StateSpace, state_space
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation, EvaluationSettings, Wanted, evaluate_runs
from calibration.progress import Progress
from thermal._types import BoolArray, FloatArray
from thermal.model.case_replay import LEAST_SPIN_UP, SPIN_UP, Inputs, spin_up
from thermal.model.matrices import Matrices, SymbolicModel
from thermal.model.modal import ModalModel
from thermal.model.step import IMPLICIT_EULER, Scheme

#: How far the mean temperatures of the weeks before the telemetry may be from those of its first day [K], standard
#: deviation. Daily means of the shared cases vary by 1.5 to 8 K outdoors and by 0.4 to 0.6 K in occupied zones (4 K in
#: a house that is heated for a test): rather wide than narrow, since measurements make it smaller and nothing larger.
ZONE_SPREAD, BOUNDARY_SPREAD = 1.5, 5.0


@dataclass(frozen=True)
class FilterSettings:
    """How a model is filtered.

    Parameters
    ----------
    scheme : Scheme
        Time stepping.
    covariance : {"exact", "steady"}
        See `KalmanFilter`.
    spin_up_seconds : float
        Telemetry before an interval that the spin-up may use [s].
    tolerance : float
        See `KalmanFilter` [-].
    """

    scheme: Scheme = IMPLICIT_EULER
    covariance: Covariance = "exact"
    spin_up_seconds: float = SPIN_UP
    tolerance: float = TOLERANCE


def filter_interval(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    interval: Interval,
    disturbance: DisturbanceModel,
    settings: FilterSettings | None = None,
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
    settings : FilterSettings, optional
        Time stepping, covariance and spin-up.

    Raises
    ------
    FilterError
        When the model is not reduced, or the interval too short.
    """
    chosen = settings or FilterSettings()
    ready = prepare(model, theta, inputs, chosen.scheme)
    kalman = KalmanFilter(ready.space, disturbance, covariance=chosen.covariance, tolerance=chosen.tolerance)
    return kalman.filter(inputs, *ready.interval(interval, chosen))


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

    def interval(self, interval: Interval, settings: FilterSettings) -> tuple[int, int, FloatArray, FloatArray]:
        """Row at which the filter of an interval starts and the last one, see `rows_of`, and what it starts from.

        Parameters
        ----------
        interval : Interval
            What is filtered.
        settings : FilterSettings
            With the longest spin-up.
        """
        begin, at, stop = rows_of(self.inputs, interval, settings)
        return at, stop, *self.start(begin, at)


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
    FilterError.unless(matrices.reduced, "filter", "a reduced model", "the grid", "see `thermal.reduced_model`")
    flow = inputs.airflow[inputs.complete].mean(axis=0) if airflows else None
    return _Prepared(
        matrices, state_space(matrices.modal.modes, inputs.step, scheme, airflows=airflows, flow=flow), inputs
    )


def rows_of(inputs: Inputs, interval: Interval, settings: FilterSettings) -> tuple[int, int, int]:
    """Rows at which an interval's spin-up begins, its filter starts, and it ends.

    The spin-up has at least 12 hours, of the interval if there is no telemetry before it. With steady gains, which know
    nothing of what a spin-up leaves unknown, it has its full length or a third of what there is.

    Parameters
    ----------
    inputs : Inputs
        The telemetry.
    interval : Interval
        What is filtered.
    settings : FilterSettings
        With the longest spin-up.

    Raises
    ------
    FilterError
        When nothing is left to filter after the least spin-up.
    """
    first = int(inputs.stamps.searchsorted(interval.start))
    stop = int(inputs.stamps.searchsorted(interval.end, side="right")) - 1
    longest, least = round(settings.spin_up_seconds / inputs.step), int(np.ceil(LEAST_SPIN_UP / inputs.step))
    begin = max(0, first - 1 - longest)
    if settings.covariance == "steady":
        least = max(least, min(longest, (stop - begin) // 3))
    at = max(first - 1, begin + least)
    where, found = f"interval {interval.start} to {interval.end}", f"{stop - begin + 1} stamps"
    FilterError.unless(at < stop, where, f"room for a step after {LEAST_SPIN_UP / 3600:g} h of spin-up", found)
    return begin, at, stop


def evaluate_filter(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    intervals: Sequence[Interval],
    disturbance: DisturbanceModel,
    settings: EvaluationSettings | None = None,
    covariance: Covariance = "exact",
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
    settings : EvaluationSettings, optional
        Horizons, time stepping, and what is kept; spin-up and filter use the telemetry before an interval.
    covariance : {"exact", "steady"}
        See `KalmanFilter`.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    NotEnoughDataError
        When an interval has no run.
    FilterError
        When the model is not reduced.
    """
    chosen = settings or EvaluationSettings()
    ready = prepare(model, theta, inputs, chosen.scheme)
    kalman = KalmanFilter(ready.space, disturbance, covariance=covariance)

    def simulate(wanted: Sequence[Wanted]) -> list[FloatArray]:
        begin, last = wanted[0].runs.begin, max(int(w.runs.starts[-1]) for w in wanted)
        at = begin + int(np.ceil(LEAST_SPIN_UP / inputs.step))
        filtered = kalman.filter(inputs, at, max(last, at + 1), *ready.start(begin, at))
        return [_predicted(filtered, inputs, w) for w in wanted]

    return evaluate_runs(simulate, inputs, model.network.zones, intervals, chosen, progress)


def _predicted(filtered: Filtered, inputs: Inputs, wanted: Wanted) -> FloatArray:
    """Predict runs from the filtered states at their starts, (n_run, n_kept, n_zone) [K]."""
    starts, keep = wanted.runs.starts, wanted.keep
    rows = starts + np.arange(1, int(keep[-1]) + 1)[:, None]
    boundary, heat, airflow = (v[rows].transpose(0, 2, 1) for v in (inputs.boundary, inputs.heat, inputs.airflow))
    states = filtered.states[starts - filtered.begin].T
    return filtered.kalman.predict(states, boundary, heat, keep, airflow)


def start_spread(modes: ModalModel, step: float, steps: int, held: BoolArray) -> FloatArray:
    """Columns whose outer products are the covariance of the state after a spin-up, shape (r, n_column).

    A spin-up begins from the steady state of one day's mean temperatures and then holds the zones at what was measured
    (`thermal.spin_up`). The building came from other days: its state then was off by steady states of other zone and
    boundary temperatures, and what is left of them decays while the zones are held.

    Parameters
    ----------
    modes : ModalModel
        The building.
    step : float
        Step [s].
    steps : int
        Steps that the zones were held.
    held : ndarray of bool, shape (n_zone,)
        Zones that were held: those with a sensor.

    Notes
    -----
    Steady, ``k ξ = B u + H λ`` with ``O ξ = T``; held, ``(c + Δt k) ξ' = c ξ + Δt H λ`` with ``O ξ' = 0``, as in
    `thermal.spin_up`.
    """
    observe, heat, k = modes.observation[held], modes.heating[:, held], modes.conductance[:, None]
    unit = heat / k
    by_zone = unit @ np.linalg.inv(observe @ unit)
    by_boundary = modes.boundary[:, : modes.boundary.shape[1] - modes.n_signal] / k
    by_boundary = by_boundary - by_zone @ (observe @ by_boundary)
    columns = np.hstack([ZONE_SPREAD * by_zone, BOUNDARY_SPREAD * by_boundary])
    system = modes.capacity[:, None] + step * k
    stay, push = modes.capacity[:, None] / system, step * heat / system
    back = np.linalg.inv(observe @ push)
    for _ in range(steps):
        columns = stay * columns
        columns = columns - push @ (back @ (observe @ columns))
    return columns
