"""Weights by which effects are spread: between two sets of volumes, and between knots."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from thermal._types import FloatArray, IntArray

_Part = tuple[IntArray, FloatArray]


def paired(first: _Part, second: _Part) -> tuple[IntArray, IntArray, FloatArray]:
    """Faces between two sets of volumes whose flow is that between their means, in as few as can be.

    Every volume takes part by its share on both sides: the north-west corner of a transport problem (Dantzig 1951).

    Parameters
    ----------
    first, second : tuple of ndarray
        Nodes and their shares, which sum to 1 [-].

    Returns
    -------
    tuple of ndarray
        Nodes of the first set, nodes of the second, shares that sum to 1 [-].
    """
    ends = [np.cumsum(share) / np.sum(share) for _, share in (first, second)]
    cuts = np.union1d(*ends)
    cuts = cuts[np.append(np.diff(cuts) > 1e-12, True)]
    middle = cuts - np.diff(cuts, prepend=0.0) / 2.0
    numbers = [np.minimum(np.searchsorted(e, middle), e.size - 1) for e in ends]
    return first[0][numbers[0]], second[0][numbers[1]], np.diff(cuts, prepend=0.0)


def hat(value: ca.SX, knots: Sequence[float], number: int, signed: bool = False) -> ca.SX:
    """Weight of one knot in a linear interpolation between knots; flat beyond the ends.

    Parameters
    ----------
    value : casadi.SX
        Where.
    knots : sequence of float
        Increasing, in the value's unit [parameter unit].
    number : int
        Which of them.
    signed : bool
        Whether the line from the first to the second knot goes on below the first: at a strength of zero an
        interpolation that is flat on one side has half a slope.
    """
    last = number + 1 == len(knots)
    rise = (value - knots[number - 1]) / (knots[number] - knots[number - 1]) if number else ca.SX(1.0)
    fall = ca.SX(1.0) if last else (knots[number + 1] - value) / (knots[number + 1] - knots[number])
    if signed and number == 1:
        return ca.fmin(rise, ca.fmax(0.0, fall))
    return ca.fmax(0.0, ca.fmin(rise, fall))
