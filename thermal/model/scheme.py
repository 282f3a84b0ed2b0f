"""Time stepping: implicit Euler (as in the paper) and TR-BDF2, as stages of one form.

Every stage solves ``(C + a Δt K) T = C (Σ_i w_i T_i) + a Δt (flow-in of the inputs) - b Δt K T_0 ...``; see `Stage`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

SchemeName = Literal["implicit_euler", "tr_bdf2", "exact"]

_GAMMA = 2.0 - np.sqrt(2.0)


@dataclass(frozen=True)
class Stage:
    """``C (T - Σ w_i T_i) = Δt (implicit F(T) + explicit F(T_0))`` with ``F(T) = B u + H q - K T``.

    Parameters
    ----------
    weights : tuple of float
        ``w_i`` of the earlier states (the step's start, then earlier stages); they sum to 1 [-].
    implicit, explicit : float
        Coefficients [-].
    """

    weights: tuple[float, ...]
    implicit: float
    explicit: float


@dataclass(frozen=True)
class Scheme:
    """A one-step method whose stages share one matrix.

    Parameters
    ----------
    name : str
        ``implicit_euler`` (first order), ``tr_bdf2`` (second order, L-stable; Bank et al. 1985,
        doi:10.1109/T-ED.1985.22232) or ``exact`` (zero-order hold of a reduced model's modes).
    stages : tuple of Stage
        In order; the last gives the state at the end of the step. None for ``exact``.
    mean : tuple of float
        Quadrature weights of the step's mean over start and stages [-]; they sum to 1. None for ``exact``.
    """

    name: SchemeName
    stages: tuple[Stage, ...]
    mean: tuple[float, ...]

    @property
    def implicit(self) -> float:
        """Coefficient of the matrix ``C + implicit Δt K`` [-]."""
        return self.stages[0].implicit


#: First order, as in the paper; with piecewise constant inputs its mean over a step is the trapezoid's.
IMPLICIT_EULER = Scheme("implicit_euler", (Stage((1.0,), 1.0, 0.0),), (0.5, 0.5))

#: Second order and L-stable.
TR_BDF2 = Scheme(
    "tr_bdf2",
    (
        Stage((1.0,), _GAMMA / 2.0, _GAMMA / 2.0),
        Stage((-((1.0 - _GAMMA) ** 2) / (_GAMMA * (2.0 - _GAMMA)), 1.0 / (_GAMMA * (2.0 - _GAMMA))), _GAMMA / 2.0, 0.0),
    ),
    (_GAMMA / 2.0, 0.5, (1.0 - _GAMMA) / 2.0),
)

#: Zero-order hold without any error of time stepping: for the modes of a reduced model, not on the grid.
EXACT = Scheme("exact", (), ())

#: Schemes of the grid by name.
SCHEMES: dict[str, Scheme] = {s.name: s for s in (IMPLICIT_EULER, TR_BDF2)}
