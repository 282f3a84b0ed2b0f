"""Points of a profile: one coordinate held, all others at their minimum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from calibration.fit.estimate import Estimate
from calibration.fit.least_squares import solve_least_squares
from thermal._types import FloatArray
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import ReducedModel, reduced_model
from thermal.parameters import Parameter

#: A crossing counts as found when a point lies this near to it in the root of the deviance [-]; the rest is a straight
#: line, which is exact for a linear model.
ROOT_TOLERANCE = 0.05

#: A point is solved on the model reduced where it starts, then judged by the one reduced where it ends; when that moves
#: the deviance by more than this [-], it is solved again, with this many models at most.
MODEL_TOLERANCE, MOST_MODELS = 0.1, 4

#: A point is solved when a step lowers the deviance, or could, by no more than this [-]. A gradient does not say that
#: where the data leave a direction open.
STEP_TOLERANCE = 0.05

#: Damping of the first step [per square of a prior deviation], and the factors by which it is eased and tightened when
#: a step gains as much as expected or less than half: it stands for the residuals' curvature.
DAMPING, EASED, TIGHTENED = 0.1, 0.25, 6.0

#: Steps after which a point is left to Ipopt.
MOST_STEPS = 15

#: Most points that one side adds to find a root, and most times that a lower optimum met on the way is taken for the
#: new one.
MOST_POINTS, MOST_OPTIMA = 12, 3


@dataclass(frozen=True)
class _Point:
    """A point of a profile: the cost is a minimum over all coordinates but one.

    Parameters
    ----------
    z : ndarray, shape (p,)
        On the estimation scale [-].
    cost : float
        ``½ Σ r²`` [-].
    triangle : ndarray, shape (k, p)
        Triangular factor of the Jacobian, which knows all that is asked of it [-].
    model : SymbolicModel
        Reduced near the point.
    converged : bool
        Whether the solver thought so.
    """

    z: FloatArray
    cost: float
    triangle: FloatArray
    model: SymbolicModel
    converged: bool


class ProfileSection:
    """Points of the profile of one parameter, on the estimation scale.

    Parameters
    ----------
    found : Estimate
        Where to start.
    held : int
        Number of the parameter among the estimated ones.
    with_prior : bool
        Whether the priors count.
    optimum : _Point, optional
        The minimum over all coordinates, where an earlier section has found it.
    """

    def __init__(self, found: Estimate, held: int, with_prior: bool, optimum: _Point | None = None) -> None:
        self.problem, self.held, self.with_prior = found.problem, held, with_prior
        self.parameters = found.problem.parameters
        self.lower, self.upper = self.problem.bounds
        self.spread = np.array([p.prior_deviation for p in self.parameters])
        self.data = self.problem.residuals_only(found.model, found.theta).size  # priors follow the data
        everything = np.ones(self.spread.size, dtype=bool)
        self.points = [optimum or self._solved(self.problem.point(found.theta), everything, found.model)]

    @property
    def parameter(self) -> Parameter:
        """The parameter that is held."""
        return self.parameters[self.held]

    @property
    def best(self) -> _Point:
        """The point of the least cost."""
        return min(self.points, key=lambda point: point.cost)

    def x(self, point: _Point) -> float:
        """Coordinate of the held parameter."""
        return float(point.z[self.held])

    def root(self, point: _Point) -> float:
        """Root of the deviance: of a parabola, a straight line on each side."""
        return float(np.sqrt(max(0.0, 2.0 * (point.cost - self.best.cost))))

    def crossing(self, side: float, root: float) -> tuple[float, bool]:
        """Where the profile crosses a root, or the bound where it does not, and whether it is the bound."""
        before, after = self._bracket(side, root)
        if after is None:
            return float((self.upper if side > 0 else self.lower)[self.held]), True
        low, high = self.root(before), self.root(after)
        return self.x(before) + (root - low) / (high - low) * (self.x(after) - self.x(before)), False

    def complete(self, roots: Sequence[float], optimum: _Point | None = None) -> None:
        """Find where both sides cross the roots; again from a lower optimum when one is met on the way, or given."""
        if optimum is not None and 2.0 * (self.best.cost - optimum.cost) > MODEL_TOLERANCE:
            self.points.append(optimum)
        for _ in range(MOST_OPTIMA):
            base = self.best
            for side in (-1.0, 1.0):
                for root in roots:
                    self._approach(side, root)
            if self.best is base:
                return

    def _side(self, side: float) -> list[_Point]:
        """Points from the best on outwards."""
        outside = [p for p in self.points if side * (self.x(p) - self.x(self.best)) > 0.0]
        return [self.best, *sorted(outside, key=lambda p: side * self.x(p))]

    def _bracket(self, side: float, root: float) -> tuple[_Point, _Point | None]:
        """Last point before the profile first crosses a root, and the one after; None when it has not crossed."""
        before, *rest = self._side(side)
        for point in rest:
            if self.root(point) >= root:
                return before, point
            before = point
        return before, None

    def _at_bound(self, side: float, point: _Point) -> bool:
        bound = self.upper[self.held] if side > 0 else self.lower[self.held]
        return bool(side * (bound - self.x(point)) <= 1e-6 * self.spread[self.held])

    def _approach(self, side: float, root: float) -> None:
        """Add points until one lies near enough to where the profile crosses a root, or at the bound."""
        for _ in range(MOST_POINTS):
            before, after = self._bracket(side, root)
            low, high = self.root(before), self.root(after) if after is not None else np.inf
            if min(root - low, high - root) < ROOT_TOLERANCE or (after is None and self._at_bound(side, before)):
                return
            if after is None:
                x = self.x(before) + side * 1.1 * (root - low) * self._pace(side, before)
            else:
                share = (root - low) / (high - low)
                x = self.x(before) + float(np.clip(share, 0.1, 0.9)) * (self.x(after) - self.x(before))
            self._add(float(np.clip(x, self.lower[self.held], self.upper[self.held])))

    def _pace(self, side: float, point: _Point) -> float:
        """Distance that raises the root by one: by the last two points, by the curvature from the best one."""
        inner = [p for p in self._side(side) if side * (self.x(p) - self.x(point)) < 0.0]
        if inner:
            rise = self.root(point) - self.root(inner[-1])
            pace = abs(self.x(point) - self.x(inner[-1])) / rise if rise > 0.0 else np.inf
        else:
            pace = 1.0 / max(float(np.linalg.norm(point.triangle @ self._tangent(point))), 1e-12)
        return float(min(pace, self.spread[self.held]))  # a line is no guide further than that

    def _tangent(self, point: _Point) -> FloatArray:
        """How all parameters move with the held one along the profile, by the linearised residuals."""
        others = np.arange(self.spread.size) != self.held
        scaled = point.triangle[:, others] * self.spread[others]
        moved = np.linalg.lstsq(scaled, -point.triangle[:, self.held], rcond=1e-4)[0]
        tangent = np.ones(self.spread.size)
        tangent[others] = moved * self.spread[others]
        return tangent

    def _add(self, x: float) -> None:
        """Solve at one value, from the nearest point and its tangent."""
        near = min(self.points, key=lambda p: abs(self.x(p) - x))
        start = np.clip(near.z + (x - self.x(near)) * self._tangent(near), self.lower, self.upper)
        start[self.held] = x
        self.points.append(self._solved(start, np.arange(start.size) != self.held, near.model))

    def _solved(self, z: FloatArray, free: NDArray[np.bool_], model: SymbolicModel) -> _Point:
        """Minimise over the free coordinates, with models reduced ever nearer to the minimum."""
        cost = np.inf
        for _ in range(MOST_MODELS):
            model = self._local(model, z)
            point = self._descended(z, free, model)
            if not isinstance(model, ReducedModel) or abs(2.0 * (cost - point.cost)) < MODEL_TOLERANCE:
                break
            cost, z = point.cost, point.z
        return point

    def _local(self, model: SymbolicModel, z: FloatArray) -> SymbolicModel:
        """Reduce the grid at a point; what is not reduced serves everywhere."""
        return reduced_model(self.problem.grid, [self.problem.theta(z)]) if isinstance(model, ReducedModel) else model

    def _descended(self, z: FloatArray, free: NDArray[np.bool_], model: SymbolicModel) -> _Point:
        """Minimise on one model: damped Gauss-Newton steps within the bounds, and Ipopt where these go on for long.

        Started from the tangent two steps are enough; Ipopt takes at least six for its barrier.
        """
        damping, tolerance = (
            DAMPING,
            STEP_TOLERANCE * (0.2 if free.all() else 1.0),
        )  # all roots are taken from the optimum
        residual, jacobian = self._weighted(model, z)
        for _ in range(MOST_STEPS):
            step = self._step(z, residual, jacobian, free, damping)
            expected = float(residual @ residual - np.sum((residual + jacobian @ step) ** 2))
            gained = 0.0
            if expected >= tolerance:
                there = self._weighted(model, z + step)
                gained = float(residual @ residual - there[0] @ there[0])
                damping *= EASED if gained > 0.8 * expected else TIGHTENED if gained < 0.5 * expected else 1.0
            if gained > 0.0:
                z, (residual, jacobian) = z + step, there
            if expected < tolerance or 0.0 < gained < tolerance:
                return _Point(z, 0.5 * float(residual @ residual), np.linalg.qr(jacobian)[1], model, True)

        def weighted(y: FloatArray) -> tuple[FloatArray, FloatArray]:
            residual, jacobian = self._weighted(model, _filled(z, free, y))
            return residual, jacobian[:, free]

        solve = solve_least_squares(weighted, z[free], self.lower[free], self.upper[free])
        if solve.interrupted:
            raise KeyboardInterrupt
        z = _filled(z, free, solve.x)
        return _Point(z, solve.cost, np.linalg.qr(self._weighted(model, z)[1])[1], model, solve.success)

    def _step(
        self, z: FloatArray, residual: FloatArray, jacobian: FloatArray, free: NDArray[np.bool_], damping: float
    ) -> FloatArray:
        """Minimise the linearised residuals within the bounds, damped in units of the prior."""
        step = np.zeros_like(z)
        if free.any():
            q, r = np.linalg.qr(jacobian[:, free])
            matrix = np.vstack([r, np.diag(np.sqrt(damping) / self.spread[free])])
            target = np.concatenate([-q.T @ residual, np.zeros(int(free.sum()))])
            bounds = (self.lower - z)[free], (self.upper - z)[free]
            step[free] = np.clip(lsq_linear(matrix, target, bounds, method="bvls").x, *bounds)
        return step

    def _weighted(self, model: SymbolicModel, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        residual, jacobian = self.problem.weighted(model, z)
        rows = None if self.with_prior else self.data
        return residual[:rows], jacobian[:rows]


def _filled(z: FloatArray, free: NDArray[np.bool_], y: FloatArray) -> FloatArray:
    whole = z.copy()
    whole[free] = y
    return whole
