"""Profile likelihood: how far one parameter may move while all others follow to keep up with the data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from scipy.stats import chi2

from calibration.errors import CalibrationError
from calibration.fit.estimate import Estimate
from calibration.fit.least_squares import solve_damped
from calibration.progress import Progress
from calibration.results import Axes, Result, plain
from thermal._types import FloatArray
from thermal.errors import nearest
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import ReducedModel, reduced_model
from thermal.parameters import Parameter

#: Confidence levels of the intervals [-].
LEVELS = (0.90, 0.95)

#: A crossing counts as found when a point lies this near to it in the root of the deviance [-]; the rest is a straight
#: line, which is exact for a linear model.
ROOT_TOLERANCE = 0.05

#: A point is solved on the model reduced where it starts, then judged by the one reduced where it ends; when that moves
#: the deviance by more than this [-], it is solved again, with this many models at most.
MODEL_TOLERANCE, MOST_MODELS = 0.1, 4

#: A point is solved when a step lowers the deviance, or could, by no more than this [-].
STEP_TOLERANCE = 0.05

#: Most points that one side adds to find a root, and most times that a lower optimum met on the way is taken for the
#: new one.
MOST_POINTS, MOST_OPTIMA = 12, 3


@dataclass(frozen=True)
class ProfileInterval:
    """Values that a profile does not exclude at one level of confidence.

    Parameters
    ----------
    level : float
        Confidence [-].
    lower, upper : float
        Ends; the bound of the physical range where open [parameter units].
    open_lower, open_upper : bool
        Whether nothing within the physical range is excluded on that side.
    """

    level: float
    lower: float
    upper: float
    open_lower: bool
    open_upper: bool


@dataclass(frozen=True, repr=False)
class Profile(Result):
    """Profile of one parameter.

    Parameters
    ----------
    parameter : Parameter
        Which one.
    with_prior : bool
        Whether it is of the posterior, or of the data alone.
    estimate : float
        Value at the minimum [parameter units].
    values : ndarray, shape (n,)
        Where the parameter was held, increasing [parameter units].
    deviance : ndarray, shape (n,)
        Twice the rise of the negative logarithm above its minimum [-].
    thetas : ndarray, shape (n, n_parameter)
        θ there, the other parameters estimated anew [parameter units].
    intervals : tuple of ProfileInterval
        One a level.
    estimate_deviance : float
        Deviance of the estimate that it started from [-]: well above zero when a lower optimum was met on the way, and
        always with the data alone.
    unconverged : int
        Points whose solver stopped early: their deviance may be too large.
    """

    parameter: Parameter
    with_prior: bool
    estimate: float
    values: FloatArray
    deviance: FloatArray
    thetas: FloatArray
    intervals: tuple[ProfileInterval, ...]
    estimate_deviance: float
    unconverged: int

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return self.parameter.name

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and texts, ready for JSON."""
        names = ("with_prior", "estimate", "estimate_deviance", "unconverged", "values", "deviance", "intervals")
        named = {"name": self.name, "unit": self.parameter.unit}
        return {**named, **{k: plain(getattr(self, k)) for k in names}}

    def to_frame(self) -> pd.DataFrame:
        """Deviance at each value [-]."""
        return pd.DataFrame({"deviance": self.deviance}, pd.Index(self.values, name=self.name))

    def _summary(self) -> str:
        first = self.intervals[0]
        ends = f"{first.lower:.4g} to {first.upper:.4g} at {100 * first.level:g} %"
        return f"{self.name} {self.estimate:.4g} [{self.parameter.unit}], {ends}"

    def _draw(self, axes: Axes) -> None:
        axes.plot(self.values, self.deviance, marker="o")
        for interval in self.intervals:
            axes.axhline(float(chi2.ppf(interval.level, 1)), linestyle="--", color="grey")
        axes.set(xlabel=f"{self.name} [{self.parameter.unit}]", ylabel="deviance [-]")


def profile_likelihood(
    found: Estimate,
    names: Sequence[str] | None = None,
    *,
    with_prior: bool = True,
    levels: Sequence[float] = LEVELS,
    progress: Progress | None = None,
) -> tuple[Profile, ...]:
    """Hold a parameter at values around its estimate, estimate all others anew, and see what the fit loses.

    By Wilks (1938) the deviance ``D(x) = 2 min_z [ℓ(x, z) - ℓ_min]`` of the true value is chi-square with one degree
    of freedom, so the values with ``D`` below its quantile are an interval that, other than a standard error, follows
    a curved or one-sided likelihood. Errors of a run are strongly correlated in time, and ``D`` would be far too large
    if each counted; the weights of `Problem.weighted` count them as its effective number of observations, at the
    deviation that was found, and so does ``D``.

    Parameters
    ----------
    found : Estimate
        From `estimate`: where to start. Each point has a reduced model of its own.
    names : sequence of str, optional
        Estimated parameters; all by default.
    with_prior : bool
        Profile of the posterior; else of the data alone, where what they leave open runs on to its physical range.
    levels : sequence of float
        Confidence levels, between 0 and 1 [-].
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    tuple of Profile
        One a name.

    Raises
    ------
    CalibrationError
        When a name is not an estimated parameter, or a level not between 0 and 1.
    """
    known = [p.name for p in found.problem.parameters]
    for name in names or ():
        if name not in known:
            raise CalibrationError(f"profile: {name!r} is not estimated; {nearest(name, known)}")
    if not levels or not all(0.0 < level < 1.0 for level in levels):
        raise CalibrationError(f"levels: expected confidence levels between 0 and 1, got {list(levels)}")
    roots = {float(level): float(np.sqrt(chi2.ppf(level, 1))) for level in levels}
    chosen = list(known if names is None else names)
    sections: list[_Section] = []
    residual = found.problem.weighted(found.model, found.problem.point(found.theta))[0]
    first = 0.5 * float(np.sum(residual[: None if with_prior else -len(known)] ** 2))
    for done, name in enumerate(chosen, 1):
        optimum = sections[-1].best if sections else None
        sections.append(_Section(found, known.index(name), with_prior, optimum))
        sections[-1].complete(sorted(roots.values()))
        if progress is not None:
            progress("profile", done, len(chosen))
    for section in sections:  # all count from the least optimum that any of them has met
        section.complete(sorted(roots.values()), sections[-1].best)
    return tuple(_profile(section, roots, first) for section in sections)


def _profile(section: _Section, roots: Mapping[float, float], first: float) -> Profile:
    """Collect points and crossings in the units of the parameter."""
    parameter = section.parameter
    points = sorted(section.points, key=section.x)
    intervals = []
    for level, root in roots.items():
        (low, low_open), (high, high_open) = (section.crossing(side, root) for side in (-1.0, 1.0))
        intervals.append(ProfileInterval(level, parameter.inverse(low), parameter.inverse(high), low_open, high_open))
    return Profile(
        parameter=parameter,
        with_prior=section.with_prior,
        estimate=parameter.inverse(section.x(section.best)),
        values=np.array([parameter.inverse(section.x(p)) for p in points]),
        deviance=np.array([section.root(p) ** 2 for p in points]),
        thetas=np.array([section.problem.theta(p.z) for p in points]),
        intervals=tuple(intervals),
        estimate_deviance=2.0 * (first - section.best.cost),
        unconverged=sum(not p.converged for p in points),
    )


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


class _Section:
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
        self.parameter = found.problem.parameters[held]
        self.lower, self.upper = self.problem.bounds
        self.spread = np.array([p.prior_deviation for p in found.problem.parameters])
        self.rows = slice(None if with_prior else -self.spread.size)  # priors follow the data
        self.points = [optimum or self._solved(self.problem.point(found.theta), False, found.model)]

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
        self.points.append(self._solved(start, True, near.model))

    def _solved(self, z: FloatArray, held: bool, model: SymbolicModel) -> _Point:
        """Minimise over the coordinates that are not held, with models reduced ever nearer to the minimum."""
        cost = np.inf
        for _ in range(MOST_MODELS):
            if isinstance(model, ReducedModel):  # what is not reduced is accurate everywhere
                model = reduced_model(self.problem.grid, [self.problem.theta(z)])
            point = self._descended(z, held, model)
            if not isinstance(model, ReducedModel) or abs(2.0 * (cost - point.cost)) < MODEL_TOLERANCE:
                break
            cost, z = point.cost, point.z
        return point

    def _descended(self, z: FloatArray, held: bool, model: SymbolicModel) -> _Point:
        """Minimise on one model."""
        lower, upper = self.lower.copy(), self.upper.copy()
        if held:
            lower[self.held] = upper[self.held] = z[self.held]

        def weighted(y: FloatArray) -> tuple[FloatArray, FloatArray]:
            residual, jacobian = self.problem.weighted(model, y)
            return residual[self.rows], jacobian[self.rows]

        tolerance = STEP_TOLERANCE * (1.0 if held else 0.2)  # all roots are taken from the optimum
        solve = solve_damped(weighted, z, (lower, upper), self.spread, tolerance)
        if solve.interrupted:
            raise KeyboardInterrupt
        return _Point(solve.x, solve.cost, np.linalg.qr(solve.jacobian)[1], model, solve.success)
