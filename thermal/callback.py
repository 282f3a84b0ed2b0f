"""Functions of NumPy arrays as CasADi calls them, with their Jacobian."""

from collections.abc import Callable, Mapping, Sequence
from typing import cast

import casadi as ca
import numpy as np

from thermal._types import FloatArray

_Function = Callable[[FloatArray], FloatArray]


class ArrayFunction(ca.Callback):
    """A function of one column, and its Jacobian where it is given, as a CasADi function.

    Parameters
    ----------
    name : str
        What CasADi calls it.
    value : callable
        Takes a column of shape (n,), returns an array of `shape`.
    n : int
        Length of the column.
    shape : tuple of int
        Rows and columns of the value.
    jacobian : callable, optional
        Of the value's columns on top of each other, shape (rows columns, n).
    nominal : casadi.Sparsity, optional
        Pattern of a second input that is not looked at: CasADi hands a Jacobian the value as well.

    Examples
    --------
    >>> square = ArrayFunction("square", lambda x: x**2, 2, (2, 1), lambda x: np.diag(2.0 * x))
    >>> x = ca.MX.sym("x", 2)
    >>> ca.Function("slope", [x], [ca.jacobian(square(x), x)])([1.0, 3.0]).full().tolist()
    [[2.0, 0.0], [0.0, 6.0]]
    """

    def __init__(
        self,
        name: str,
        value: _Function,
        n: int,
        shape: tuple[int, int],
        jacobian: _Function | None = None,
        nominal: ca.Sparsity | None = None,
    ) -> None:
        ca.Callback.__init__(self)
        self._value, self._n, self._shape, self._jacobian, self._nominal = value, n, shape, jacobian, nominal
        self._kept: list[ca.Callback] = []  # CasADi holds no reference to the Jacobian that it is handed
        self.construct(name, {})

    def get_n_in(self) -> int:
        """One input, and the value for a Jacobian."""
        return 1 if self._nominal is None else 2

    def get_n_out(self) -> int:
        """One output."""
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        """Pattern of an input: a dense column first."""
        return ca.Sparsity.dense(self._n, 1) if i == 0 or self._nominal is None else self._nominal

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        """Dense."""
        return ca.Sparsity.dense(*self._shape)

    def eval(self, arg: Sequence[ca.DM]) -> list[ca.DM]:
        """Call the function."""
        return [ca.DM(self._value(np.array(arg[0], dtype=float).ravel()))]

    def has_jacobian(self) -> bool:
        """Whether it was given one."""
        return self._jacobian is not None

    def get_jacobian(
        self, name: str, inames: Sequence[str], onames: Sequence[str], opts: Mapping[str, object]
    ) -> ca.Function:
        """Jacobian as CasADi asks for it."""
        shape, value = (self._shape[0] * self._shape[1], self._n), cast(_Function, self._jacobian)
        self._kept.append(ArrayFunction(name, value, self._n, shape, nominal=self.get_sparsity_out(0)))
        return self._kept[-1]
