"""Linear predictive control: zone heat in the modal model, a convex programme that is compiled once."""

from __future__ import annotations

import importlib
import time
import warnings
from typing import Any

import numpy as np

from mpc.control.predictor.heat import HeatPredictor
from mpc.control.problem.data import HorizonData
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.solution import Solution, Status
from mpc.errors import ControlError
from mpc.scenario.rates import KILOWATT_HOUR
from thermal._types import FloatArray
from thermal.errors import describe
from thermal.units import REFERENCE_TEMPERATURE

_KILOWATT = 1000.0  # W
_ENDS = {
    "optimal": Status.CONVERGED, "optimal_inaccurate": Status.STALLED, "user_limit": Status.TIME_LIMIT,
}  # fmt: skip


class LinearSolver:
    """The control problem of a `HeatPredictor` as one convex programme, by cvxpy and Clarabel.

    Parameters
    ----------
    problem : ControlProblem
        What is solved; its predictor is a `HeatPredictor`.

    Raises
    ------
    ControlError
        When the predictor is another.

    Notes
    -----
    States of the modes, decisions and slacks are variables. Comfort's penalty (30) is the least of ``a²/(2 δ) + b``
    over slacks a and b, none negative, that add up to the excess. State, forecasts, prices, bands, demand windows and
    what stands now are parameters in a form that cvxpy compiles once (disciplined parametrised programming, Agrawal et
    al. 2019, arXiv:1910.12430): once for each number of demand windows.
    """

    def __init__(self, problem: ControlProblem) -> None:
        if not isinstance(problem.predictor, HeatPredictor):
            found = type(problem.predictor).__name__
            raise ControlError(describe("linear solver", "a problem of a HeatPredictor", found))
        self.problem, self.predictor = problem, problem.predictor
        self.memory: FloatArray | None = None  # nothing is kept between solves
        self._built: dict[tuple[int, int], _Programme] = {}

    def forget(self) -> None:
        """Nothing is kept between solves."""
        self.memory = None

    def solve(self, data: HorizonData, plan: FloatArray, time_limit: float | None = None) -> Solution:
        """Solve for one horizon; see `Solver`.

        Parameters
        ----------
        data : HorizonData
            Its parameters.
        plan : ndarray, shape (n_block, n_channel)
            What the outcome is compared with [W]; a convex programme needs no start.
        time_limit : float, optional
            Wall time after which the plan given is returned [s].
        """
        begin, problem = time.perf_counter(), self.problem
        first = self.predictor.rollout(data, plan)
        start = problem.terms(data, first)
        key = len(data.peaks.offset), data.peaks.rate.size
        if key not in self._built:
            self._built[key] = _Programme(problem, self.predictor, *key)
        shares, status, message, steps = self._built[key].solve(data, time_limit)
        rollout, terms = first, start
        if shares is not None:
            rollout = self.predictor.rollout(data, problem.plan(np.clip(shares, 0.0, 1.0)))
            terms = problem.terms(data, rollout)
        return Solution(
            rollout.plan, rollout, terms, start.total, status, message, steps, time.perf_counter() - begin, "linear"
        )


class _Programme:
    """The compiled programme for a number of demand windows and peaks."""

    def __init__(self, problem: ControlProblem, predictor: HeatPredictor, n_window: int, n_peak: int) -> None:
        # here: seconds for whoever imports the package and solves nothing; it is typed in part
        cp: Any = importlib.import_module("cvxpy")
        self._problem, self._predictor, self._cp = problem, predictor, cp
        count, n, r = len(predictor.horizon), predictor.n_zone, predictor.modes.capacity.size
        m, size = len(predictor.channels), problem.span.size
        self._start, self._drive = cp.Parameter(r), cp.Parameter((count, r))
        self._lower, self._upper = cp.Parameter((count, n)), cp.Parameter((count, n))
        self._weight = cp.Parameter((count, n), nonneg=True)
        self._electricity, self._gas, self._end = cp.Parameter(count), cp.Parameter(count), cp.Parameter(r)
        self._before = cp.Parameter(size)
        self._u = cp.Variable(size)
        x, bent, straight = cp.Variable((count + 1, r)), cp.Variable((count, n)), cp.Variable((count, n))
        heat = cp.reshape(self._u, (problem.shape[0], m), order="C")[predictor.horizon.block_of]
        span, least = problem.span[:m], problem.lower[:m]
        zone = x[1:] @ predictor.modes.output.T
        change = problem.differences @ self._u - self._before
        rules = [x[0] == self._start, self._u >= 0, self._u <= 1, bent >= 0, straight >= 0]
        rules += [bent + straight >= self._lower - zone, bent + straight >= zone - self._upper]
        for dt in np.unique(predictor.horizon.steps):
            rows = np.flatnonzero(predictor.horizon.steps == dt)
            keep, push = predictor.transition(float(dt))
            added = heat[rows] @ (push * span).T + np.tile(push @ least, (rows.size, 1))
            rules.append(x[rows + 1] == cp.multiply(x[rows], np.tile(keep, (rows.size, 1))) + added + self._drive[rows])
        limited = np.flatnonzero(np.isfinite(problem.most_change))
        if limited.size:
            rules.append(cp.abs(change[limited]) <= problem.most_change[limited])
        power, fuel = predictor.electric_per_channel / _KILOWATT, predictor.fuel_per_channel / _KILOWATT
        electric = heat @ (span * power) + float(least @ power)
        cost = self._electricity @ electric + self._gas @ (heat @ (span * fuel)) - self._end @ x[count]
        cost += cp.sum(cp.multiply(self._weight, cp.square(bent) / (2.0 * problem.softness) + straight))
        cost += problem.move_weight * cp.sum_squares(change)
        if n_window:
            self._windows, self._used = cp.Parameter((n_window, count)), cp.Parameter(n_window)
            self._owner = cp.Parameter((n_window, n_peak), nonneg=True)
            self._rate, self._so_far = cp.Parameter(n_peak, nonneg=True), cp.Parameter(n_peak)
            highest = cp.Variable(n_peak)
            rules += [highest >= self._so_far, self._owner @ highest >= self._windows @ electric + self._used]
            cost += self._rate @ highest
        self._programme = cp.Problem(cp.Minimize(cost), rules)

    def _fill(self, data: HorizonData) -> None:
        problem, predictor = self._problem, self._predictor
        self._start.value, self._drive.value = data.state, predictor.drive(data)
        self._lower.value, self._upper.value = data.lower - REFERENCE_TEMPERATURE, data.upper - REFERENCE_TEMPERATURE
        # the slope of a kelvin far outside is what a kelvin costs in a step
        self._weight.value = problem.penalty(data, data.upper + 100.0).slope
        self._electricity.value = data.electricity_price * problem.hours
        self._gas.value = data.gas_price * problem.hours
        self._end.value = data.heat_value / KILOWATT_HOUR * predictor.heat_row
        self._before.value = problem.standing(data)
        if data.peaks.offset.size:
            peaks = data.peaks
            self._windows.value, self._used.value = peaks.weights, peaks.offset / _KILOWATT
            self._owner.value = np.eye(peaks.rate.size)[peaks.bucket]
            self._rate.value, self._so_far.value = peaks.rate, peaks.so_far / _KILOWATT

    def solve(self, data: HorizonData, time_limit: float | None) -> tuple[FloatArray | None, Status, str, int]:
        """Solve: decisions in shares of their ranges or None, status, word, iterations."""
        self._fill(data)
        options: dict[str, Any] = {} if time_limit is None else {"time_limit": time_limit}
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # of inaccuracy, which the status says
                self._programme.solve(solver=self._cp.CLARABEL, ignore_dpp=False, enforce_dpp=True, **options)
        except self._cp.error.SolverError as error:
            return None, Status.FAILED, str(error), 0
        word = str(self._programme.status)
        steps = int(self._programme.solver_stats.num_iters or 0)
        usable = self._u.value is not None and bool(np.isfinite(self._u.value).all()) and word != "user_limit"
        return self._u.value if usable else None, _ENDS.get(word, Status.FAILED), word, steps
