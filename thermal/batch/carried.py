"""What instructions carry out beside NumPy's own functions, each on all members at once."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from thermal._types import FloatArray


def copied(value: Any, out: FloatArray) -> None:
    """Copy a value.

    Parameters
    ----------
    value : ndarray or float
        Any [any].
    out : ndarray
        Filled [any].
    """
    np.copyto(out, value)


def where(mask: Any, first: Any, second: Any, out: FloatArray) -> None:
    """Take the first value where the mask is true, the second elsewhere.

    Parameters
    ----------
    mask, first, second : ndarray or float
        Truth values [-], and any [any].
    out : ndarray
        Filled [any].
    """
    np.copyto(out, second)
    np.copyto(out, first, where=mask)


def product(matrix: Any, vector: Any, out: FloatArray) -> None:
    """Multiply a matrix of each member by a vector.

    Parameters
    ----------
    matrix : ndarray, shape (m, n, member)
        Any [any].
    vector : ndarray, shape (n, member or 1)
        Any [any].
    out : ndarray, shape (m, member)
        Filled [any].
    """
    np.einsum("ijk,jk->ik", matrix, vector, out=out)


class Reduce(NamedTuple):
    """A reduction over an axis, such as a sum.

    Parameters
    ----------
    function : numpy.ufunc
        Of two values.
    axis : int
        Of one member's values.
    """

    function: Any
    axis: int

    def __call__(self, values: FloatArray, out: FloatArray) -> None:
        """Carry it out; see `Instruction`."""
        self.function.reduce(values, axis=self.axis, out=out)


class Take(NamedTuple):
    """Rows by number.

    Parameters
    ----------
    rows : tuple of int
        Which.
    """

    rows: tuple[int, ...]

    def __call__(self, values: FloatArray, out: FloatArray) -> None:
        """Carry it out; see `Instruction`."""
        np.take(values, self.rows, axis=0, out=out, mode="clip")
