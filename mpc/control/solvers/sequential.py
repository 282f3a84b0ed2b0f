"""Sequential quadratic programming on the single shooting: exact slopes, comfort kept piecewise, cost by BFGS."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mpc.control.predictor.predictor import Rollout, Sensitivity
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import ControlProblem, CostTerms
from mpc.control.solvers.convex import QuadraticSolver, solve_quadratic
from mpc.control.solvers.solution import Solution, Status
from thermal._types import FloatArray

_KILOWATT = 1000.0  # W
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

    zone: FloatArray
    zone_slope: FloatArray  # (N n_zone, D)
    means: FloatArray
    mean_slope: FloatArray  # (n_window, D)
    gradient: FloatArray
    hessian: FloatArray


@dataclass(eq=False)
class SequentialSolver:
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
        self._curvature: FloatArray | None = None
        self._reach = self.reach
        self._longest = 0.0  # s, that a step took: what is left of the time limit must hold another one
        self._deadline = np.inf

    def forget(self) -> None:
        """Drop the curvature and the length of steps of earlier solves."""
        self._curvature, self._reach = None, self.reach

    @property
    def memory(self) -> FloatArray | None:
        """Curvature and, below it, the length of the next first step, shape (D + 1, D) [currency, -]; None is none."""
        if self._curvature is None:
            return None
        return np.vstack([self._curvature, np.full(self._curvature.shape[0], self._reach)])

    @memory.setter
    def memory(self, kept: FloatArray | None) -> None:
        self.forget()
        if kept is not None:
            self._curvature, self._reach = np.array(kept[:-1]), float(kept[-1, 0])

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
        last: tuple[FloatArray, FloatArray, Sensitivity] | None = None
        reach, fresh, slow = self._reach, self._curvature is None, 0
        while status is not Status.FAILED and k < self.iterations:
            lap = time.perf_counter()
            if lap + self._longest > self._deadline:
                status, message = Status.TIME_LIMIT, f"after {k} steps, {time_limit:g} s allowed"
                break
            k += 1
            slopes = self.problem.predictor.sensitivity(data, point.rollout)
            smooth = self.problem.energy_gradient(data, slopes)
            self._learn(data, point, smooth, slopes, last)
            model = self._model(data, point, slopes, smooth)
            step, promised, solved = self._step(data, point, model, reach)
            scale = max(abs(point.cost), 1e-6)
            if not solved:
                status, message = Status.STALLED, f"quadratic programme of step {k} failed"
                break
            if promised <= self.tolerance * scale and not fresh:
                # curvature that was learned elsewhere may promise too little: ask again without it
                self._curvature = None
                self._learn(data, point, smooth, slopes, None)
                model, fresh = self._model(data, point, slopes, smooth), True
                step, promised, solved = self._step(data, point, model, reach)
            if time.perf_counter() > self._deadline:  # what was promised so far need not be all
                status, message = Status.TIME_LIMIT, f"within step {k}, {time_limit:g} s allowed"
                break
            if promised <= self.tolerance * scale:
                status, message = Status.CONVERGED, f"the next step promises {promised / scale:.1e} of the cost"
                break
            new, length = self._search(data, point, step, promised)
            self._longest = max(0.9 * self._longest, time.perf_counter() - lap)
            if new is None and time.perf_counter() > self._deadline:
                status, message = Status.TIME_LIMIT, f"within step {k}, {time_limit:g} s allowed"
                break
            if new is None:
                status, message = Status.STALLED, f"no decrease along step {k}"
                self._curvature = None
                break
            good = point.cost - new.cost > 0.75 * promised
            reach = min(2.0 * reach, self.reach) if good else reach if length == 1.0 else max(length * reach, 0.02)
            slow = slow + 1 if point.cost - new.cost <= self.tolerance * scale else 0
            last, point, fresh = (point.shares, smooth, slopes), new, False
            if slow == 2:
                status, message = Status.CONVERGED, f"two steps brought less than {self.tolerance:g} of the cost each"
                break
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

    def _learn(
        self,
        data: HorizonData,
        point: _Point,
        smooth: FloatArray,
        slopes: Sensitivity,
        last: tuple[FloatArray, FloatArray, Sensitivity] | None,
    ) -> None:
        """Update the curvature by the change of the gradient that the piecewise model does not have."""
        size = smooth.size
        if self._curvature is None:
            energy = abs(point.terms.electricity) + abs(point.terms.gas)
            self._curvature = max(energy, 1e-3) / self.problem.shape[0] * np.eye(size)
        if last is None:
            return
        s = point.shares - last[0]
        felt = self.problem.penalty(data, point.rollout.zone[1:]).slope.ravel()
        bent = felt @ (slopes.zone[1:] - last[2].zone[1:]).reshape(-1, size) * self.problem.span
        y, bs = smooth - last[1] + bent, self._curvature @ s
        if s @ s < 1e-16:
            return
        sbs, sy = float(s @ bs), float(s @ y)
        share = 1.0 if sy >= 0.2 * sbs else 0.8 * sbs / (sbs - sy)  # Powell (1978)
        y = share * y + (1.0 - share) * bs
        self._curvature += np.outer(y, y) / float(s @ y) - np.outer(bs, bs) / sbs

    def _model(self, data: HorizonData, point: _Point, slopes: Sensitivity, smooth: FloatArray) -> _Model:
        problem, span = self.problem, self.problem.span
        moves = 2.0 * problem.move_weight * (problem.differences.T @ problem.differences)
        curvature = np.zeros_like(moves) if self._curvature is None else self._curvature
        return _Model(
            point.rollout.zone[1:],
            slopes.zone[1:].reshape(-1, span.size) * span,
            data.peaks.means(point.rollout.electric),
            data.peaks.weights @ slopes.electric * span,
            smooth + problem.move_gradient(data, point.shares),
            moves + curvature,
        )

    def _value(self, data: HorizonData, model: _Model, step: FloatArray) -> float:
        """Cost of a step according to the model, but for what is constant."""
        zone = model.zone + (model.zone_slope @ step).reshape(model.zone.shape)
        highest = data.peaks.so_far.copy()
        np.maximum.at(highest, data.peaks.bucket, model.means + model.mean_slope @ step)
        comfort = float(self.problem.penalty(data, zone).value.sum())
        peaks = float(data.peaks.rate @ highest) / _KILOWATT
        return float(model.gradient @ step + 0.5 * step @ model.hessian @ step) + comfort + peaks

    def _step(self, data: HorizonData, point: _Point, model: _Model, reach: float) -> tuple[FloatArray, float, bool]:
        """Minimise the model: step, decrease that it promises, and whether the programmes were solved."""
        rows, lower, upper = self._limits(data, point, model, reach)
        step, value = np.zeros(point.shares.size), self._value(data, model, np.zeros(point.shares.size))
        first, n_peak = value, data.peaks.rate.size
        for _ in range(_INNER):
            if time.perf_counter() > self._deadline:
                break
            zone = model.zone + (model.zone_slope @ step).reshape(model.zone.shape)
            penalty = self.problem.penalty(data, zone)
            curved = np.flatnonzero(penalty.curvature)
            part = model.zone_slope[curved]
            bowl = (part * penalty.curvature.ravel()[curved, None]).T @ part
            hessian = model.hessian + bowl
            hessian[np.diag_indices_from(hessian)] += 1e-9 * (1.0 + np.trace(hessian) / step.size)
            gradient = model.gradient + penalty.slope.ravel() @ model.zone_slope - bowl @ step
            whole = np.zeros((step.size + n_peak, step.size + n_peak))
            whole[: step.size, : step.size] = hessian
            found = solve_quadratic(
                whole, np.concatenate([gradient, data.peaks.rate]), rows, lower, upper, self.quadratic
            )
            if not (found.solved and np.isfinite(found.x).all()):
                return step, first - value, bool(value < first)
            towards = found.x[: step.size] - step
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
        change = problem.differences @ point.shares - problem.standing(data)
        limited = np.flatnonzero(np.isfinite(problem.most_change))
        most = problem.most_change[limited]
        belongs = np.eye(n_peak)[data.peaks.bucket]
        rows = np.vstack([
            np.eye(n, n + n_peak),
            np.hstack([problem.differences[limited], np.zeros((limited.size, n_peak))]),
            np.hstack([model.mean_slope / _KILOWATT, -belongs]),
            np.eye(n_peak, n + n_peak, k=n),
        ])  # fmt: skip
        none = np.full(len(model.means), -np.inf)
        lower = np.concatenate(
            [np.maximum(-point.shares, -reach), -most - change[limited], none, data.peaks.so_far / _KILOWATT]
        )
        upper = np.concatenate(
            [
                np.minimum(1.0 - point.shares, reach),
                most - change[limited],
                -model.means / _KILOWATT,
                np.full(n_peak, np.inf),
            ]
        )
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
