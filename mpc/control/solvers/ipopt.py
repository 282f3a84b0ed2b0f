"""The reference: the same single shooting by Ipopt, with exact gradients and a limited-memory Hessian."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from mpc.control.predictor.predictor import Rollout
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import KILOWATT, ControlProblem
from mpc.control.solvers.solution import Solution, Solver, Status
from mpc.errors import MpcError
from thermal._types import FloatArray
from thermal.callback import ArrayFunction

_QUIET = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.hessian_approximation": "limited-memory",
}
_TUNED = {
    "ipopt.mu_init": 1e-3, "ipopt.bound_push": 1e-6, "ipopt.bound_frac": 1e-6,
    "ipopt.limited_memory_max_history": 20, "ipopt.nlp_scaling_method": "none",
}  # fmt: skip


class _OutOfTimeError(MpcError):
    """Ends a solve from within its callback."""


class _Evaluation:
    """Cost without demand charges, mean powers of the windows in kW, and their Jacobian, of the last few points."""

    def __init__(self, problem: ControlProblem) -> None:
        self.problem = problem

    def begin(self, data: HorizonData, deadline: float) -> None:
        """Take up a horizon."""
        self.data, self.deadline = data, deadline
        self.best: tuple[float, FloatArray, Rollout] | None = None
        self.error: BaseException | None = None
        self._rollouts: dict[bytes, Rollout] = {}

    def rollout(self, shares: FloatArray) -> Rollout:
        """Follow decisions, once."""
        key = shares.tobytes()
        if key not in self._rollouts:
            if time.perf_counter() > self.deadline:
                raise _OutOfTimeError
            if len(self._rollouts) > 3:
                self._rollouts.pop(next(iter(self._rollouts)))
            near = next(reversed(self._rollouts.values()), None)
            self._rollouts[key] = self.problem.predictor.rollout(self.data, self.problem.plan(shares), near)
        return self._rollouts[key]

    def values(self, shares: FloatArray) -> FloatArray:
        """Cost, then means over the windows [kW], shape (1 + n_window,)."""
        rollout = self.rollout(shares)
        terms = self.problem.terms(self.data, rollout)
        if np.isfinite(terms.total) and (self.best is None or terms.total < self.best[0]):
            self.best = (terms.total, shares.copy(), rollout)
        return np.concatenate([[terms.total - terms.demand], self.data.peaks.means(rollout.electric) / KILOWATT])

    def jacobian(self, shares: FloatArray) -> FloatArray:
        """Their derivatives, shape (1 + n_window, D)."""
        rollout = self.rollout(shares)
        by_plan = self.problem.predictor.sensitivity(self.data, rollout)
        means = self.data.peaks.weights @ by_plan.electric * self.problem.span / KILOWATT
        return np.vstack([self.problem.gradient(self.data, rollout, by_plan), means])

    def guarded(self, of: Callable[[FloatArray], FloatArray], shares: FloatArray) -> FloatArray:
        """Evaluate, and keep what breaks: CasADi reports only that a callback failed."""
        try:
            return of(shares)
        except BaseException as error:
            self.error = error
            raise


class IpoptSolver(Solver):
    """Ipopt on the single shooting: the reference for faster solvers.

    Parameters
    ----------
    problem : ControlProblem
        What is solved.
    tolerance : float
        Ipopt's [-].
    iterations : int
        Most of them.

    Notes
    -----
    The barrier starts small and close to the bounds, since the first guess is good; where that fails a second solver
    with Ipopt's defaults takes over. Peaks are variables above the mean powers of their windows. Solvers are kept for
    each number of windows: forecasts, prices, bands and states are parameters.
    """

    def __init__(self, problem: ControlProblem, tolerance: float = 1e-5, iterations: int = 200) -> None:
        self.problem, self.tolerance, self.iterations = problem, tolerance, iterations
        self._evaluation = _Evaluation(problem)
        self._built: dict[tuple[int, int, bool], tuple[Any, Any]] = {}

    def solve(self, data: HorizonData, plan: FloatArray, time_limit: float | None = None) -> Solution:
        """Solve for one horizon; see `Solver`.

        Parameters
        ----------
        data : HorizonData
            Its parameters.
        plan : ndarray, shape (n_block, n_channel)
            Where to start [unit of the channel].
        time_limit : float, optional
            Wall time after which the best plan so far is returned [s].
        """
        begin, problem = time.perf_counter(), self.problem
        shares = problem.shares(plan)
        first = problem.predictor.rollout(data, problem.plan(shares))
        start = problem.terms(data, first)
        self._evaluation.begin(data, np.inf if time_limit is None else begin + time_limit)
        status, message, steps = self._run(data, shares, True)
        if status is Status.FAILED:
            status, again, more = self._run(data, shares, False)
            message, steps = f"tuned solver: {message}; default solver: {again}", steps + more
        best = self._evaluation.best
        if best is None:
            best, status = (start.total, shares, first), Status.FAILED
        return Solution(
            problem.plan(best[1]), best[2], problem.terms(data, best[2]), start.total, status, message, steps,
            time.perf_counter() - begin, "ipopt",
        )  # fmt: skip

    def _run(self, data: HorizonData, shares: FloatArray, tuned: bool) -> tuple[Status, str, int]:
        n_window, n_peak, problem = len(data.peaks.offset), data.peaks.rate.size, self.problem
        solver = self._solver(n_window, n_peak, tuned)
        limited = np.flatnonzero(np.isfinite(problem.most_change))
        most, before = problem.most_change[limited], problem.standing(data)[limited]
        peaks, found = data.peaks.so_far / KILOWATT, None
        try:
            found = solver(
                x0=np.concatenate([shares, peaks]),
                p=np.concatenate([data.peaks.rate, data.peaks.bucket.astype(float)]),
                lbx=np.concatenate([np.zeros(shares.size), peaks]),
                ubx=np.concatenate([np.ones(shares.size), np.full(n_peak, np.inf)]),
                lbg=np.concatenate([np.full(n_window, -np.inf), before - most]),
                ubg=np.concatenate([np.zeros(n_window), before + most]),
            )
        except RuntimeError:  # of CasADi, for what the evaluation has kept, if anything
            pass
        error = self._evaluation.error
        if isinstance(error, _OutOfTimeError):
            return Status.TIME_LIMIT, "out of time", 0
        if error is not None:
            raise error
        stats = solver.stats()
        word, count = str(stats["return_status"]), int(stats.get("iter_count", 0))
        status = Status.of(word, found is not None and bool(stats["success"]))
        if found is not None and status is Status.CONVERGED:
            self._evaluation.best = None  # the point of convergence: a better one may break a limit
            self._evaluation.values(np.clip(np.array(found["x"]).ravel()[: shares.size], 0.0, 1.0))
        return Status.FAILED if status is Status.STALLED else status, word, count

    def _solver(self, n_window: int, n_peak: int, tuned: bool) -> Any:
        key = (n_window, n_peak, tuned)
        if key not in self._built:
            problem, n = self.problem, self.problem.span.size
            of = self._evaluation
            values, jacobian = (partial(of.guarded, f) for f in (of.values, of.jacobian))
            callback = ArrayFunction("control", values, n, (1 + n_window, 1), jacobian)
            x, p = ca.MX.sym("x", n + n_peak), ca.MX.sym("p", n_peak + n_window)
            outputs = callback(x[:n])
            # a product with 0 and 1 picks the peak of each window, so that which belongs where is a parameter too
            owners = [ca.sum1((p[n_peak + j] == ca.DM(range(n_peak))) * x[n:]) for j in range(n_window)]
            above = [outputs[1 + j] - owner for j, owner in enumerate(owners)]
            limited = np.flatnonzero(np.isfinite(problem.most_change))
            nlp: Any = {
                "x": x,
                "p": p,
                "f": outputs[0] + ca.dot(p[:n_peak], x[n:]),
                "g": ca.vertcat(*above, ca.mtimes(ca.DM(problem.differences[limited]), x[:n])),
            }
            options: Any = {"ipopt.tol": self.tolerance, "ipopt.max_iter": self.iterations, **_QUIET}
            self._built[key] = (ca.nlpsol("control", "ipopt", nlp, options | (_TUNED if tuned else {})), callback)
        return self._built[key][0]
