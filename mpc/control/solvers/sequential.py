"""Sequential quadratic programming on the single shooting: exact gradients, piecewise comfort, cost by BFGS."""

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mpc.control.predictor.predictor import Rollout, Sensitivity
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import KILOWATT, ControlProblem, CostTerms
from mpc.control.solvers.convex import QuadraticSolver, solve_quadratic
from mpc.control.solvers.solution import Solution, Solver, Status
from thermal._types import FloatArray

_INNER = 12  # most quadratic programmes of one step; three are usual
_SHORTEST = 1.0 / 256.0  # of a step, when the line search gives up
_SUFFICIENT = 0.1  # share of the predicted decrease that a step must bring (Armijo)


class _Point(NamedTuple):
    """A plan, what it leads to and what it costs."""

    shares: FloatArray
    rollout: Rollout
    terms: CostTerms
    cost: float


class _Model(NamedTuple):
    """Convex model of the cost around a point; comfort and peaks are kept as they are, with linearised arguments."""

    shares: FloatArray
    zone: FloatArray
    zone_by_plan: FloatArray  # (N n_zone, D), by the plan itself
    zone_jacobian: FloatArray  # (N n_zone, D), by shares of the ranges
    means: FloatArray
    mean_jacobian: FloatArray  # (n_window, D)
    smooth: FloatArray
    gradient: FloatArray
    hessian: FloatArray

    def zone_at(self, step: FloatArray) -> FloatArray:
        """Temperatures after a step, shape (N, n_zone) [K]."""
        return self.zone + (self.zone_jacobian @ step).reshape(self.zone.shape)


@dataclass(eq=False)
class SequentialSolver(Solver):
    """Sequential quadratic programming for control in real time.

    Parameters
    ----------
    problem : ControlProblem
        What is solved.
    tolerance : float
        Decrease over the cost at which the solve has converged [-]: promised by the model, or brought by each of the
        last two steps.
    iterations : int
        Most steps.
    reach : float
        Longest step of a decision, as a share of its range [-]; it shrinks and recovers with what steps bring. Longer
        ones leap over valleys of the cost.
    quadratic : str
        ``clarabel`` or ``osqp``: who solves the quadratic programmes.

    Notes
    -----
    The temperatures and the mean powers of demand windows are linearised. The penalty of comfort and the peaks are
    convex in them and stay as they are: a piecewise quadratic programme, solved by a semismooth Newton method whose
    steps are quadratic programmes in the few decisions. The curvature of energy's cost, and that of the temperatures
    in so far as comfort feels it, come from a structured BFGS (Dennis, Gay and Welsch 1981, doi:10.1145/355958.355965)
    with Powell's damping; it is kept from solve to solve. Gauss-Newton alone crawls: the cost is curved.
    """

    problem: ControlProblem
    tolerance: float = 1e-3
    iterations: int = 30
    reach: float = 0.2
    quadratic: QuadraticSolver = "clarabel"

    def __post_init__(self) -> None:
        self._longest = 0.0  # s, that a step took: what is left of the time limit must hold another one
        self._deadline = np.inf
        self.forget()

    @property
    def memory(self) -> FloatArray | None:
        """Curvature and, below it, the length of the next first step, shape (D + 1, D) [currency, -]; None is none."""
        if self._curvature is None:
            return None
        return np.vstack([self._curvature, np.full(self._curvature.shape[0], self._reach)])

    @memory.setter
    def memory(self, kept: FloatArray | None) -> None:
        self._curvature: FloatArray | None = None if kept is None else np.array(kept[:-1])
        self._reach = self.reach if kept is None else float(kept[-1, 0])

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
        begin = time.perf_counter()
        self._deadline = np.inf if time_limit is None else begin + time_limit
        given = self._at(data, self.problem.admitted(data, self.problem.shares(plan)))
        point, start = self._off_plateaus(data, given), given.cost
        status, message, k = Status.ITERATION_LIMIT, f"after {self.iterations} steps", 0
        if not np.isfinite(point.cost):
            status, message = Status.FAILED, "the plan to start from has no finite cost"
        last: _Model | None = None
        reach, fresh, slow = self._reach, self._curvature is None, 0
        while status is Status.ITERATION_LIMIT and k < self.iterations:
            lap = time.perf_counter()
            if lap + self._longest > self._deadline:
                status, message = Status.TIME_LIMIT, f"after {k} steps, {time_limit:g} s allowed"
                break
            k += 1
            scale = max(abs(point.cost), 1e-6)
            sensitivity = self.problem.predictor.sensitivity(data, point.rollout)
            model = self._model(data, point, sensitivity, last)
            step, promised, solved = self._step(data, point, model, reach)
            if not solved:
                status, message = Status.STALLED, f"quadratic programme of step {k} failed"
                break
            if promised <= self.tolerance * scale and not fresh:
                # curvature that was learned elsewhere may promise too little: ask again without it
                self._curvature, fresh = None, True
                model = self._model(data, point, sensitivity, None)
                step, promised, _ = self._step(data, point, model, reach)
            late = time.perf_counter() > self._deadline  # what was promised so far need not be all
            if not late and promised <= self.tolerance * scale:
                status, message = Status.CONVERGED, f"the next step promises {promised / scale:.1e} of the cost"
                break
            new, length = None, 0.0
            if not late:
                new, length = self._search(data, point, step, promised)
                self._longest = max(0.9 * self._longest, time.perf_counter() - lap)
            if new is None:
                status, message = Status.STALLED, f"no decrease along step {k}"
                if time.perf_counter() > self._deadline:
                    status, message = Status.TIME_LIMIT, f"within step {k}, {time_limit:g} s allowed"
                else:
                    self._curvature = None
                break
            gained = point.cost - new.cost
            if gained > 0.75 * promised:
                reach = min(2.0 * reach, self.reach)
            elif length < 1.0:
                reach = max(length * reach, 0.02)
            slow = slow + 1 if gained <= self.tolerance * scale else 0
            last, point, fresh = model, new, False
            if slow == 2:
                status, message = Status.CONVERGED, f"two steps brought less than {self.tolerance:g} of the cost each"
        self._reach = float(np.clip(reach, 0.05, self.reach))
        point = given if given.cost < point.cost else point
        return Solution(
            self.problem.plan(point.shares), point.rollout, point.terms, start, status, message, k,
            time.perf_counter() - begin, "sequential",
        )  # fmt: skip

    def _at(self, data: HorizonData, shares: FloatArray, near: Rollout | None = None) -> _Point:
        rollout = self.problem.predictor.rollout(data, self.problem.plan(shares), near)
        terms = self.problem.terms(data, rollout)
        return _Point(shares, rollout, terms, terms.total if rollout.finite else np.inf)

    def _off_plateaus(self, data: HorizonData, point: _Point) -> _Point:
        """Begin where setpoints are reached: beyond, the cost has no slope and the solve would stay."""
        if not np.isfinite(point.cost):
            return point
        plan = self.problem.predictor.reached(data, point.rollout)
        if np.array_equal(plan, point.rollout.plan):
            return point
        near = self._at(data, self.problem.admitted(data, self.problem.shares(plan)), point.rollout)
        return near if near.cost <= point.cost + self.tolerance * max(abs(point.cost), 1e-6) else point

    def _model(self, data: HorizonData, point: _Point, by_plan: Sensitivity, last: _Model | None) -> _Model:
        """Linearise around a point, with the curvature that the way from the last one has shown."""
        problem, span = self.problem, self.problem.span
        smooth = problem.energy_gradient(data, by_plan)
        zone_by_plan = by_plan.zone[1:].reshape(-1, span.size)
        if self._curvature is None:
            energy = abs(point.terms.electricity) + abs(point.terms.gas)
            self._curvature = max(energy, 1e-3) / problem.shape[0] * np.eye(span.size)
        if last is not None:
            felt = problem.penalty(data, point.rollout.zone[1:]).gradient.ravel()
            bent = felt @ (zone_by_plan - last.zone_by_plan) * span
            self._learn(point.shares - last.shares, smooth - last.smooth + bent, self._curvature)
        moves = 2.0 * problem.move_weight * (problem.differences.T @ problem.differences)
        return _Model(
            point.shares, point.rollout.zone[1:], zone_by_plan, zone_by_plan * span,
            data.peaks.means(point.rollout.electric), data.peaks.weights @ by_plan.electric * span, smooth,
            smooth + problem.move_gradient(data, point.shares), moves + self._curvature,
        )  # fmt: skip

    @staticmethod
    def _learn(s: FloatArray, y: FloatArray, curvature: FloatArray) -> None:
        """Update the curvature by the change of the gradient, of what the piecewise model does not have."""
        if s @ s < 1e-16:
            return
        bs = curvature @ s
        sbs, sy = float(s @ bs), float(s @ y)
        share = 1.0 if sy >= 0.2 * sbs else 0.8 * sbs / (sbs - sy)  # Powell (1978)
        y = share * y + (1.0 - share) * bs
        curvature += np.outer(y, y) / float(s @ y) - np.outer(bs, bs) / sbs

    def _value(self, data: HorizonData, model: _Model, step: FloatArray) -> float:
        """Cost of a step according to the model, but for what is constant."""
        highest = data.peaks.so_far.copy()
        np.maximum.at(highest, data.peaks.bucket, model.means + model.mean_jacobian @ step)
        comfort = float(self.problem.penalty(data, model.zone_at(step)).value.sum())
        peaks = float(data.peaks.rate @ highest) / KILOWATT
        return float(model.gradient @ step + 0.5 * step @ model.hessian @ step) + comfort + peaks

    def _step(self, data: HorizonData, point: _Point, model: _Model, reach: float) -> tuple[FloatArray, float, bool]:
        """Minimise the model: step, decrease that it promises, and whether the programmes were solved."""
        rows, lower, upper = self._limits(data, point, model, reach)
        n, n_peak = point.shares.size, data.peaks.rate.size
        step = np.zeros(n)
        first = value = self._value(data, model, step)
        for _ in range(_INNER):
            if time.perf_counter() > self._deadline:
                break
            penalty = self.problem.penalty(data, model.zone_at(step))
            curved = np.flatnonzero(penalty.curvature)
            part = model.zone_jacobian[curved]
            bowl = (part * penalty.curvature.ravel()[curved, None]).T @ part
            hessian = np.zeros((n + n_peak, n + n_peak))
            hessian[:n, :n] = model.hessian + bowl
            hessian[range(n), range(n)] += 1e-9 * (1.0 + np.trace(hessian) / n)
            gradient = model.gradient + penalty.gradient.ravel() @ model.zone_jacobian - bowl @ step
            found = solve_quadratic(
                hessian, np.concatenate([gradient, data.peaks.rate]), rows, lower, upper, self.quadratic
            )
            if not found.solved:
                return step, first - value, bool(value < first)
            towards = found.x[:n] - step
            length, trial = 1.0, np.inf
            while length >= _SHORTEST and (trial := self._value(data, model, step + length * towards)) > value:
                length *= 0.5
            if not trial <= value:
                break
            step, gained, value = step + length * towards, value - trial, trial
            if gained <= 0.02 * (first - value) or gained <= 0.1 * self.tolerance * max(abs(point.cost), 1e-6):
                break
        return step, first - value, True

    def _limits(
        self, data: HorizonData, point: _Point, model: _Model, reach: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Ranges, limits on changes, and peaks above the mean powers, as rows of a quadratic programme [- and kW]."""
        n, n_peak, problem = point.shares.size, data.peaks.rate.size, self.problem
        limited = np.flatnonzero(np.isfinite(problem.most_change))
        change = (problem.differences @ point.shares - problem.standing(data))[limited]
        most, means = problem.most_change[limited], model.means / KILOWATT
        rows = np.block([
            [np.eye(n), np.zeros((n, n_peak))],
            [problem.differences[limited], np.zeros((limited.size, n_peak))],
            [model.mean_jacobian / KILOWATT, -np.eye(n_peak)[data.peaks.bucket]],
            [np.zeros((n_peak, n)), np.eye(n_peak)],
        ])  # fmt: skip
        parts = (
            (np.maximum(-point.shares, -reach), np.minimum(1.0 - point.shares, reach)),
            (-most - change, most - change),
            (np.full(means.size, -np.inf), -means),
            (data.peaks.so_far / KILOWATT, np.full(n_peak, np.inf)),
        )
        lower, upper = (np.concatenate(ends) for ends in zip(*parts, strict=True))
        return rows, np.minimum(lower, upper), upper

    def _search(
        self, data: HorizonData, point: _Point, step: FloatArray, promised: float
    ) -> tuple[_Point | None, float]:
        """Walk along a step until the cost falls as it should: the new point, and the share of the step."""
        length = 1.0
        while length >= _SHORTEST and time.perf_counter() <= self._deadline:
            new = self._at(data, np.clip(point.shares + length * step, 0.0, 1.0), point.rollout)
            if new.cost <= point.cost - _SUFFICIENT * length * promised:
                return new, length
            length *= 0.5
        return None, 0.0
