"""Small dense quadratic programmes by Clarabel or OSQP, the solvers that cvxpy brings."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp

from thermal._types import FloatArray

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
        Whether the solver reached its tolerance.
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
    half = sp.csc_matrix(np.triu(hessian / size))
    run = _clarabel if solver == "clarabel" else _osqp
    return run(half, gradient / size, rows, lower, upper)


def _clarabel(
    half: Any, gradient: FloatArray, rows: FloatArray, lower: FloatArray, upper: FloatArray
) -> QuadraticResult:
    import clarabel  # here: a second for whoever imports the package and solves nothing

    top, bottom = np.isfinite(upper), np.isfinite(lower)
    both = sp.csc_matrix(np.vstack([rows[top], -rows[bottom]]))
    limits = np.concatenate([upper[top], -lower[bottom]])
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads = False, 1
    found = clarabel.DefaultSolver(
        half, gradient, both, limits, [clarabel.NonnegativeConeT(len(limits))], settings
    ).solve()
    status = str(found.status)
    return QuadraticResult(np.asarray(found.x), status in ("Solved", "AlmostSolved"), status)


def _osqp(half: Any, gradient: FloatArray, rows: FloatArray, lower: FloatArray, upper: FloatArray) -> QuadraticResult:
    import osqp

    solver = osqp.OSQP()
    solver.setup(half, gradient, sp.csc_matrix(rows), lower, upper, **_OSQP)
    found = solver.solve(raise_error=False)
    return QuadraticResult(np.asarray(found.x), found.info.status == "solved", str(found.info.status))
