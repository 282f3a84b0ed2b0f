"""Exact integrals of what a zone's temperature is beyond a limit."""

from __future__ import annotations

import numpy as np

from thermal._types import FloatArray


def excess(start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of the positive part of a straight line over a step, and the share of the step in which it is positive.

    With a⁺ and b⁺ the positive parts of the ends, the line is positive over the share ``(a⁺ - b⁺) / (a - b)``, and its
    positive part has the mean ``(a⁺ + b⁺) / 2`` times that share. So a step in two halves gives the same integral as
    the whole, which the trapezoid of clipped values does not.

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
    first, last, span = np.maximum(start, 0.0), np.maximum(end, 0.0), start - end
    share = np.divide(first - last, span, out=(first > 0.0).astype(float), where=span != 0.0)
    return 0.5 * (first + last) * share, share
