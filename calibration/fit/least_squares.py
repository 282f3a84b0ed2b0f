"""Nonlinear least squares within bounds.

By Ipopt, Gauss-Newton with a secant term for the residuals' curvature; and by damped Gauss-Newton steps from a start
that is close.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import lsq_linear

from thermal._types import FloatArray
from thermal.callback import ArrayFunction

#: Residuals (m,) and Jacobian (m, p) at a point (p,).
ResidualFunction = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class LeastSquaresResult:
    """Outcome of a least-squares solve.

    Parameters
    ----------
    x : ndarray, shape (p,)
        Best point found, also when the solver failed [as the caller's x].
    cost : float
        ``½ Σ r²`` there [-].
    jacobian : ndarray, shape (m, p)
        Jacobian of the residuals there [per unit of x].
    status : str
        Ipopt's return status, such as ``Solve_Succeeded``.
    success : bool
        Whether Ipopt converged.
    iterations : int
        Number of Ipopt iterations.
    interrupted : bool
        Whether Ctrl-C ended it.
    """

    x: FloatArray
    cost: float
    jacobian: FloatArray
    status: str
    success: bool
    iterations: int
    interrupted: bool = False


#: Status of a solve that Ctrl-C ended, as Ipopt has it.
INTERRUPTED = "User_Requested_Stop"

#: Status of a solve that converged, as Ipopt has it.
SOLVED = "Solve_Succeeded"

#: Ipopt's options beside its tolerances: quiet, and with a small barrier from close to the bounds, since the start is
#: usually good.
_IPOPT = {
    "print_level": 0,
    "sb": "yes",
    "acceptable_iter": 4,
    "mu_init": 1e-4,
    "bound_push": 1e-4,
    "bound_frac": 1e-4,
    "nlp_scaling_method": "none",
}


#: Damping of the first step [per square of a prior deviation], and the factors by which it is eased and tightened when
#: a step gains as much as expected or less than half: it stands for the residuals' curvature.
DAMPING, EASED, TIGHTENED = 0.1, 0.25, 6.0

#: Steps after which a solve is left to Ipopt.
MOST_STEPS = 15


class _Cache:
    """The residual function with its last few values kept, and the best point seen."""

    def __init__(self, function: ResidualFunction) -> None:
        self.function = function
        self.values: dict[bytes, tuple[FloatArray, FloatArray]] = {}
        self.best: tuple[float, FloatArray] | None = None
        self.size = 0
        self.error: BaseException | None = None

    def __call__(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        if self.error is not None:  # Ipopt would go on trying shorter steps: a stationary point ends it
            return np.zeros(self.size), np.zeros((self.size, x.size))
        key = x.tobytes()
        if key not in self.values:
            if len(self.values) > 3:
                self.values.pop(next(iter(self.values)))
            try:
                self.values[key] = self.function(x)
            except BaseException as error:  # kept: CasADi reports only that a callback failed
                self.error = error
                raise
            r = self.values[key][0]
            self.size = r.size
            cost = 0.5 * float(r @ r)
            if np.isfinite(cost) and (self.best is None or cost < self.best[0]):
                self.best = (cost, x.copy())
        return self.values[key]


class _Hessian:
    """Gauss-Newton ``J'J`` plus the structured secant estimate of ``Σ r_i ∇²r_i``.

    Where residuals stay large Gauss-Newton overshoots and its line search crawls (measured on an office with slabs and
    furniture: 60
    iterations and 337 evaluations against 12 and 14). Dennis, Gay & Welsch (1981), doi:10.1145/355958.355965, eqs.
    1.2-1.4, with their sizing.
    """

    def __init__(self, p: int) -> None:
        self.curvature = np.zeros((p, p))
        self.last: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def __call__(self, x: FloatArray, residual: FloatArray, jacobian: FloatArray) -> FloatArray:
        gradient = jacobian.T @ residual
        if self.last is not None and not np.array_equal(x, self.last[0]):
            s = x - self.last[0]
            y = gradient - self.last[2]
            wanted = gradient - self.last[1].T @ residual
            if s @ y > 0.0:
                size = float(abs(s @ self.curvature @ s))
                self.curvature *= min(1.0, float(abs(s @ wanted)) / size) if size > 0.0 else 1.0
                miss = wanted - self.curvature @ s
                self.curvature += (np.outer(miss, y) + np.outer(y, miss)) / (s @ y)
                self.curvature -= (s @ miss) * np.outer(y, y) / (s @ y) ** 2
        self.last = (x.copy(), jacobian, gradient)
        return np.asarray(jacobian.T @ jacobian + self.curvature)


def solve_least_squares(
    function: ResidualFunction,
    start: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    tolerance: float = 1e-3,
    iterations: int = 60,
) -> LeastSquaresResult:
    """Minimise ``½ Σ r(x)²`` within bounds by Ipopt.

    Parameters
    ----------
    function : callable
        Residuals (m,) and their Jacobian (m, p) at x.
    start, lower, upper : ndarray, shape (p,)
        Start and bounds; the start is moved inside [as the caller's x].
    tolerance : float
        Largest component of the gradient at convergence [per unit of x].
    iterations : int
        Most iterations.

    Returns
    -------
    LeastSquaresResult
        With Ipopt's status; the best point seen when it stops early, also by Ctrl-C.

    Raises
    ------
    BaseException
        Whatever ``function`` raises, unchanged.
    """
    p = start.size
    cache = _Cache(function)
    inside = np.clip(start, lower, upper)
    cache(inside)
    curved = _Hessian(p)
    value = ArrayFunction("value", lambda x: 0.5 * (cache(x)[0] @ cache(x)[0]), p, (1, 1))
    gradient = ArrayFunction("gradient", lambda x: cache(x)[1].T @ cache(x)[0], p, (p, 1))
    hessian = ArrayFunction("hessian", lambda x: curved(x, *cache(x)), p, (p, p))
    x, scale, empty = ca.MX.sym("x", p), ca.MX.sym("lam_f"), ca.MX.sym("p", 0)
    lagrangian = ca.Function(
        "nlp_hess_l",
        [x, empty, scale, ca.MX.sym("lam_g", 0)],
        [ca.triu(scale * hessian(x))],
        ["x", "p", "lam_f", "lam_g"],
        ["triu_hess_gamma_x_x"],
    )
    slope = ca.Function("nlp_grad_f", [x, empty], [value(x), gradient(x)], ["x", "p"], ["f", "grad_f_x"])
    problem: dict[str, Any] = {"x": x, "f": value(x)}
    ipopt = {**_IPOPT, "tol": tolerance, "compl_inf_tol": tolerance, "acceptable_tol": 10 * tolerance}
    options: dict[str, Any] = {
        "print_time": False, "no_nlp_grad": True, "grad_f": slope, "hess_lag": lagrangian,
        "ipopt": {**ipopt, "max_iter": iterations},
    }  # fmt: skip
    solver = ca.nlpsol("least_squares", "ipopt", problem, options)
    try:
        solver(x0=start, lbx=lower, ubx=upper)
    except Exception:
        if cache.error is None:
            raise
    interrupted = isinstance(cache.error, KeyboardInterrupt)
    if cache.error is not None and not (interrupted and cache.best is not None):
        raise cache.error
    stats = solver.stats()
    interrupted |= stats["return_status"] == INTERRUPTED  # how CasADi ends a solve on Ctrl-C
    cost, best = cache.best if cache.best is not None else (np.nan, inside)
    cache.error = None
    return LeastSquaresResult(
        x=best,
        cost=cost,
        jacobian=cache(best)[1],
        status=INTERRUPTED if interrupted else str(stats["return_status"]),
        success=bool(stats["success"]) and not interrupted,
        iterations=int(stats["iter_count"]),
        interrupted=interrupted,
    )


def bounded_step(
    residual: FloatArray, jacobian: FloatArray, lower: FloatArray, upper: FloatArray, damping: FloatArray | None = None
) -> FloatArray:
    """Minimise the linearised residuals ``|r + J s|²`` within bounds of the step s.

    Parameters
    ----------
    residual : ndarray, shape (m,)
        r [-].
    jacobian : ndarray, shape (m, p)
        J [per unit of x].
    lower, upper : ndarray, shape (p,)
        Bounds of the step, about zero [as the caller's x].
    damping : ndarray, shape (p,), optional
        D of ``|D s|²``, which is added [per unit of x].

    Returns
    -------
    ndarray, shape (p,)
        The step [as the caller's x].
    """
    # as many rows as columns: a tenth of the work; the last column is Q' of the target, so that Q itself is not needed
    whole = np.asarray(np.linalg.qr(np.column_stack([jacobian, -residual]), mode="r"))[: lower.size]
    r, turned = whole[:, :-1], whole[:, -1]
    if damping is None:
        bounds = np.minimum(lower, -1e-12), np.maximum(upper, 1e-12)
        return np.asarray(lsq_linear(r, turned, bounds).x)
    target = np.concatenate([turned, np.zeros(damping.size)])
    found = lsq_linear(np.vstack([r, np.diag(damping)]), target, (lower, upper), method="bvls").x
    return np.asarray(np.clip(found, lower, upper))


def solve_damped(
    function: ResidualFunction,
    start: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
    spread: FloatArray,
    tolerance: float,
    share: float = 0.0,
) -> LeastSquaresResult:
    """Minimise ``½ Σ r(x)²`` by damped Gauss-Newton steps within bounds, and by Ipopt where these go on for long.

    Started close to the minimum two steps are enough; Ipopt takes at least six for its barrier.

    Parameters
    ----------
    function : callable
        Residuals (m,) and their Jacobian (m, p) at x.
    start : ndarray, shape (p,)
        Within the bounds [as the caller's x].
    bounds : tuple of ndarray, shape (p,)
        Lower and upper bounds; x is held where they are equal [as the caller's x].
    spread : ndarray, shape (p,)
        Deviations in which steps are damped [as the caller's x].
    tolerance : float
        It is solved when a step lowers ``Σ r²``, or could, by no more than this [-]. A gradient does not say that where
        the data leave a direction open.
    share : float
        It is also solved when that is no more than this share of what all steps have gained [-]: enough where another
        solve with other weights follows.
    """
    (lower, upper), x, damping = bounds, start, DAMPING
    free = lower < upper
    residual, jacobian = function(x)
    first = float(residual @ residual)
    for number in range(MOST_STEPS):
        step = np.zeros_like(x)
        if free.any():
            ends = (lower - x)[free], (upper - x)[free]
            step[free] = bounded_step(residual, jacobian[:, free], *ends, np.sqrt(damping) / spread[free])
        expected = float(residual @ residual - np.sum((residual + jacobian @ step) ** 2))
        gained = 0.0
        if expected >= tolerance:
            there = function(x + step)
            gained = float(residual @ residual - there[0] @ there[0])
            damping *= EASED if gained > 0.8 * expected else TIGHTENED if gained < 0.5 * expected else 1.0
        if gained > 0.0:
            x, (residual, jacobian) = x + step, there
        enough = max(tolerance, share * (first - float(residual @ residual)))
        if expected < enough or 0.0 < gained < enough:
            return LeastSquaresResult(x, 0.5 * float(residual @ residual), jacobian, SOLVED, True, number + 1)

    def filled(y: FloatArray) -> FloatArray:
        whole = x.copy()
        whole[free] = y
        return whole

    def reduced(y: FloatArray) -> tuple[FloatArray, FloatArray]:
        residual, jacobian = function(filled(y))
        return residual, jacobian[:, free]

    found = solve_least_squares(reduced, x[free], lower[free], upper[free])
    return replace(found, x=filled(found.x), jacobian=function(filled(found.x))[1])
