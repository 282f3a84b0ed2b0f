"""Many free runs along one series of inputs, by superposition: what they share is stepped once.

From its start on, a run is the path of one long run plus the difference of their states, which decays by itself:
``ξ(s + k) = X(s + k) + end^k (ξ(s) - X(s))``. Hourly runs of a day share 23 of 24 steps.
"""

from __future__ import annotations

import numpy as np

from thermal._types import FloatArray, IntArray
from thermal.model.modal import ModalModel
from thermal.model.scheme import Scheme


def run_along(
    modes: ModalModel,
    states: FloatArray,
    boundary: FloatArray,
    heat: FloatArray,
    starts: IntArray,
    keep: IntArray,
    step: float,
    scheme: Scheme,
) -> FloatArray:
    """Zone means of free runs that start at several rows of one series of inputs.

    Parameters
    ----------
    modes : ModalModel
        Modes of the model.
    states : ndarray, shape (n, m)
        States of the reduced model at the starts [K].
    boundary : ndarray, shape (n_time, n_boundary)
        Boundary temperatures of each step [K].
    heat : ndarray, shape (n_time, n_zone)
        Heat given to the zones in each step [W].
    starts : ndarray of int, shape (m,)
        Rows at whose stamps the runs start; the first step is driven by the row that follows.
    keep : ndarray of int
        Steps whose means are returned, from 1 on.
    step : float
        Time step [s].
    scheme : Scheme
        Time stepping; ``EXACT`` too.

    Returns
    -------
    ndarray, shape (m, n_keep, n_zone)
        Zone means over the kept steps [K].
    """
    propagator, own = modes.propagator(step, scheme), (modes.coordinates @ states).T
    means = np.empty((starts.size, keep.size, modes.output.shape[0]))
    order, longest = np.argsort(starts, kind="stable"), int(keep.max())
    # what lies between runs is not stepped
    for together in np.split(order, np.flatnonzero(np.diff(starts[order]) > longest) + 1):
        first, last = int(starts[together[0]]), int(starts[together[-1]]) + longest
        rows = slice(first + 1, last + 1)
        pushed = boundary[rows] @ modes.boundary.T + heat[rows] @ modes.heating.T
        path = np.zeros((len(pushed) + 1, pushed.shape[1]))
        path[1:] = propagator.end_gain * pushed
        for k in range(len(pushed)):
            path[k + 1] += propagator.end * path[k]
        shared = (propagator.mean * path[:-1] + propagator.mean_gain * pushed) @ modes.output.T
        at = starts[together] - first
        behind = own[together] - path[at]
        for position, k in enumerate(keep):
            fading = modes.output * (propagator.mean * propagator.end ** (k - 1))
            means[together, position] = shared[at + k - 1] + behind @ fading.T
    return means
