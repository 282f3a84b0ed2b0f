"""Exact integrals of what a zone's temperature is beyond a limit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def excess(start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of the positive part of a straight line over a step, and the share of the step in which it is positive.

    With both ends positive the mean is ``(a + b) / 2``; with one of them, h, positive and the other, l, negative it is
    ``h² / (2 (h - l))`` over the share ``h / (h - l)``. So a step in two halves gives the same integral as the whole,
    which the trapezoid of clipped values does not.

    Parameters
    ----------
    start, end : ndarray
        Excess over a limit at the ends of each step, negative within it [any].

    Returns
    -------
    mean : ndarray
        0 or more [as given].
    share : ndarray
        0 to 1 [-].
    """
    high, low = np.maximum(start, end), np.minimum(start, end)
    crossing = (high > 0.0) & (low < 0.0)
    span = np.where(crossing, high - low, 1.0)
    share = np.where(crossing, high / span, (high > 0.0).astype(float))
    mean = np.where(crossing, 0.5 * high * share, np.maximum(0.5 * (start + end), 0.0))
    return np.asarray(mean), np.asarray(share)
