"""Convex programmes: dense quadratic ones, and linear predictive control of zone heat."""

import importlib
import time
import warnings
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp

from mpc.control.predictor.heat import HeatPredictor
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import KILOWATT, ControlProblem
from mpc.control.solvers.solution import Solution, Solver, Status
from mpc.errors import ControlError
from mpc.scenario.rates import KILOWATT_HOUR
from thermal._types import FloatArray
from thermal.units import REFERENCE_TEMPERATURE

#: Clarabel (interior point) or OSQP (operator splitting, polished).
QuadraticSolver = Literal["clarabel", "osqp"]

_OSQP = {"verbose": False, "eps_abs": 1e-8, "eps_rel": 1e-8, "max_iter": 20_000, "polishing": True}


class QuadraticResult(NamedTuple):
    """Outcome of a quadratic programme.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Minimiser [as the caller's].
    solved : bool
        Whether the solver reached its tolerance, and all is finite.
    status : str
        The solver's own word.
    """

    x: FloatArray
    solved: bool
    status: str


def solve_quadratic(
    hessian: FloatArray,
    gradient: FloatArray,
    rows: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    solver: QuadraticSolver = "clarabel",
) -> QuadraticResult:
    """Minimise ``½ x'Hx + g'x`` where ``lower <= A x <= upper``.

    Parameters
    ----------
    hessian : ndarray, shape (n, n)
        H, positive semidefinite [currency].
    gradient : ndarray, shape (n,)
        g [currency].
    rows : ndarray, shape (m, n)
        A [-].
    lower, upper : ndarray, shape (m,)
        Limits [-]; infinite where there is none.
    solver : str
        ``clarabel`` or ``osqp``.
    """
    size = max(float(np.abs(gradient).max(initial=0.0)), float(np.abs(hessian).max(initial=0.0)), 1e-12)
    half, scaled = sp.csc_matrix(np.triu(hessian / size)), gradient / size
    if solver == "clarabel":
        import clarabel  # here: a second for whoever imports the package and solves nothing

        top, bottom = np.isfinite(upper), np.isfinite(lower)
        both = sp.csc_matrix(np.vstack([rows[top], -rows[bottom]]))
        limits = np.concatenate([upper[top], -lower[bottom]])
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_threads = False, 1
        cones = [clarabel.NonnegativeConeT(len(limits))]
        found = clarabel.DefaultSolver(half, scaled, both, limits, cones, settings).solve()
        word = str(found.status)
    else:
        import osqp

        splitting = osqp.OSQP()
        splitting.setup(half, scaled, sp.csc_matrix(rows), lower, upper, **_OSQP)
        found = splitting.solve(raise_error=False)
        word = str(found.info.status)
    x = np.asarray(found.x)
    return QuadraticResult(x, Status.of(word) is Status.CONVERGED and bool(np.isfinite(x).all()), word)


class LinearSolver(Solver):
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
            raise ControlError("linear solver", "a problem of a HeatPredictor", found)
        self.problem, self.predictor = problem, problem.predictor
        self._built: dict[tuple[int, int], _Programme] = {}

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
        rollout = self.predictor.rollout(data, plan)
        start = terms = problem.terms(data, rollout)
        key = len(data.peaks.offset), data.peaks.rate.size
        if key not in self._built:
            self._built[key] = _Programme(problem, self.predictor, data)
        shares, status, message, steps = self._built[key].solve(data, time_limit)
        if shares is not None:
            rollout = self.predictor.rollout(data, problem.plan(np.clip(shares, 0.0, 1.0)))
            terms = problem.terms(data, rollout)
        return Solution(
            rollout.plan, rollout, terms, start.total, status, message, steps, time.perf_counter() - begin, "linear"
        )


class _Programme:
    """The compiled programme for the number of demand windows and peaks that a horizon has."""

    def __init__(self, problem: ControlProblem, predictor: HeatPredictor, data: HorizonData) -> None:
        # here: seconds for whoever imports the package and solves nothing; it is typed in part
        cp: Any = importlib.import_module("cvxpy")
        self._problem, self._predictor, self._cp = problem, predictor, cp
        given = {
            name: cp.Parameter(np.shape(values), nonneg=name in ("weight", "owner", "rate"))
            for name, values in self._values(data).items()
        }
        self._given, self._u = given, cp.Variable(problem.span.size)
        count, m = len(predictor.horizon), problem.shape[1]
        x = cp.Variable((count + 1, predictor.modes.capacity.size))
        bent, straight = cp.Variable((count, predictor.n_zone)), cp.Variable((count, predictor.n_zone))
        heat = cp.reshape(self._u, problem.shape, order="C")[predictor.horizon.block_of]
        span, least = problem.span[:m], problem.lower[:m]
        zone = x[1:] @ predictor.modes.output.T
        change = problem.differences @ self._u - given["before"]
        rules = [x[0] == given["start"], self._u >= 0, self._u <= 1, bent >= 0, straight >= 0]
        rules += [bent + straight >= given["lower"] - zone, bent + straight >= zone - given["upper"]]
        for dt in np.unique(predictor.horizon.steps):
            rows = np.flatnonzero(predictor.horizon.steps == dt)
            keep, push = predictor.transition(float(dt))
            added = heat[rows] @ (push * span).T + np.tile(push @ least, (rows.size, 1)) + given["drive"][rows]
            rules.append(x[rows + 1] == cp.multiply(x[rows], np.tile(keep, (rows.size, 1))) + added)
        limited = np.flatnonzero(np.isfinite(problem.most_change))
        if limited.size:
            rules.append(cp.abs(change[limited]) <= problem.most_change[limited])
        power, fuel = predictor.electric_per_channel / KILOWATT, predictor.fuel_per_channel / KILOWATT
        electric = heat @ (span * power) + float(least @ power)
        cost = given["electricity"] @ electric + given["gas"] @ (heat @ (span * fuel)) - given["end"] @ x[count]
        cost += cp.sum(cp.multiply(given["weight"], cp.square(bent) / (2.0 * problem.softness) + straight))
        cost += problem.move_weight * cp.sum_squares(change)
        if "windows" in given:
            highest = cp.Variable(data.peaks.rate.size)
            above = given["owner"] @ highest >= given["windows"] @ electric + given["used"]
            rules += [highest >= given["so_far"], above]
            cost += given["rate"] @ highest
        self._programme = cp.Problem(cp.Minimize(cost), rules)

    def _values(self, data: HorizonData) -> dict[str, FloatArray]:
        """Parameters of the programme."""
        problem, predictor, peaks = self._problem, self._predictor, data.peaks
        values = {
            "start": data.state, "drive": predictor.drive(data), "before": problem.standing(data),
            "lower": data.lower - REFERENCE_TEMPERATURE, "upper": data.upper - REFERENCE_TEMPERATURE,
            # the gradient of a kelvin far outside is what a kelvin costs in a step
            "weight": problem.penalty(data, data.upper + 100.0).gradient,
            "electricity": data.electricity_price * problem.hours, "gas": data.gas_price * problem.hours,
            "end": data.heat_value / KILOWATT_HOUR * predictor.heat_row,
        }  # fmt: skip
        if peaks.offset.size:
            values |= {
                "windows": peaks.weights, "used": peaks.offset / KILOWATT, "rate": peaks.rate,
                "owner": np.eye(peaks.rate.size)[peaks.bucket], "so_far": peaks.so_far / KILOWATT,
            }  # fmt: skip
        return values

    def solve(self, data: HorizonData, time_limit: float | None) -> tuple[FloatArray | None, Status, str, int]:
        """Solve: decisions in shares of their ranges or None, status, word, iterations."""
        for name, values in self._values(data).items():
            self._given[name].value = values
        options: dict[str, Any] = {} if time_limit is None else {"time_limit": time_limit}
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # of inaccuracy, which the status says
                self._programme.solve(solver=self._cp.CLARABEL, ignore_dpp=False, enforce_dpp=True, **options)
        except self._cp.error.SolverError as error:
            return None, Status.FAILED, str(error), 0
        word, found = str(self._programme.status), self._u.value
        steps = int(self._programme.solver_stats.num_iters or 0)
        usable = found is not None and bool(np.isfinite(found).all()) and word != "user_limit"
        return found if usable else None, Status.of(word), word, steps
