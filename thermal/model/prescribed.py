"""A reduced model while some of its zones are held: their means are a constraint, the rest decouples in turn."""

from __future__ import annotations

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.model.modal import SHIFT, ModalModel


class HeldFrame:
    """States with given means of the held zones, ``ξ = lift y + basis ζ``, where C is diagonal in ζ."""

    def __init__(self, modes: ModalModel, held: NDArray[np.bool_]) -> None:
        observe = modes.observation[held]
        count = observe.shape[0]
        q, upper = sl.qr(observe.T)
        self.lift = sl.solve_triangular(upper[:count], q[:, :count].T).T if count else observe.T
        null = q[:, count:]
        self.capacity, turn = np.linalg.eigh(null.T @ (modes.capacity[:, None] * null))
        self.basis = null @ turn
        self.coupling = self.basis.T @ (modes.capacity[:, None] * self.lift)


def scan(capacity: FloatArray, step: float, start: FloatArray, push: FloatArray) -> FloatArray:
    """``c (ζ' - ζ) + Δt k ζ' = push`` over all steps, (r, n_time + 1)."""
    system = capacity + step * (1.0 - SHIFT * capacity)
    stay, gain = capacity / system, push.T / system
    path = np.empty((push.shape[1] + 1, start.size))
    path[0] = start
    for k in range(push.shape[1]):
        path[k + 1] = stay * path[k] + gain[k]
    return path.T
