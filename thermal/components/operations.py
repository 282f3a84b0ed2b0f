"""The arithmetic that the equations are written in: floats, NumPy arrays or CasADi expressions, exact or smooth.

An equation takes its operations as first argument and uses them for everything that is not plain arithmetic, so it is
written once. Kinks (limits, switches) have a smoothing width: 0 leaves them exact, which is what the plant has; the
predictor of a controller takes a small one and has continuous derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from thermal.errors import ModelError

#: A float, an array or a CasADi expression: what an equation takes and gives.
Value = Any


class Operations:
    """What equations need beside plain arithmetic.

    Parameters
    ----------
    width : float
        Smoothing width as a share of each kink's own scale [-], 0 to 0.5; 0 is exact.

    Notes
    -----
    With ``w = width * scale``, after the hyperbola that has the kink's two sides as asymptotes:

    - ``maximum = (a + b + sqrt((a - b)^2 + w^2)) / 2``, above the exact one by at most w/2, where a = b;
    - ``minimum`` the same from below; ``lesser``, of positive values, has ``w^2 = 4 width^2 a b`` and stays positive;
      ``capped`` is ``a b / maximum(a, b)``;
    - ``clip = (lower + upper + sqrt((x - lower)^2 + w^2) - sqrt((x - upper)^2 + w^2)) / 2``, within its limits, off
      by at most w/2;
    - ``step = (1 + x / sqrt(x^2 + w^2)) / 2``, within 0 and 1, off by at most w^2 / (4 x^2).
    """

    exp: Callable[[Value], Value]
    expm1: Callable[[Value], Value]
    log: Callable[[Value], Value]
    sqrt: Callable[[Value], Value]
    arctan: Callable[[Value], Value]

    def __init__(self, width: float = 0.0) -> None:
        if not 0.0 <= width <= 0.5:
            expected = "a share from 0 (exact) to 0.5"
            raise ModelError("smoothing width", expected, repr(width), "0.02 is usual in a predictor")
        self.width = width
        if width == 0.0:
            self._make_exact()

    def _make_exact(self) -> None:
        """Put the exact functions in the place of the smooth ones: no branch is left for the plant to take."""
        raise NotImplementedError

    @property
    def scalar(self) -> Operations:
        """Operations of the same kind for what a building has one of, or a few."""
        return self

    def of(self, group: str) -> Operations:
        """Operations for a group of components, by its name.

        Parameters
        ----------
        group : str
            Name of the group.
        """
        return self

    def maximum(self, a: Value, b: Value, scale: Value = 1.0) -> Value:
        """Return the larger of two values; `scale` is what the smoothing width is a share of.

        Parameters
        ----------
        a, b : Value
            Values [any].
        scale : Value
            What the smoothing width is a share of [as the values].
        """
        return 0.5 * (a + b + self.sqrt((a - b) * (a - b) + (self.width * scale) ** 2))

    def minimum(self, a: Value, b: Value, scale: Value = 1.0) -> Value:
        """Return the smaller of two values.

        Parameters
        ----------
        a, b : Value
            Values [any].
        scale : Value
            What the smoothing width is a share of [as the values].
        """
        return 0.5 * (a + b - self.sqrt((a - b) * (a - b) + (self.width * scale) ** 2))

    def clip(self, x: Value, lower: Value, upper: Value, scale: Value = 1.0) -> Value:
        """Hold a value within limits.

        Parameters
        ----------
        x : Value
            A value [any].
        lower, upper : Value
            Limits [as the value].
        scale : Value
            What the smoothing width is a share of [as the values].
        """
        w2 = (self.width * scale) ** 2
        low, high = x - lower, x - upper
        return 0.5 * (lower + upper + self.sqrt(low * low + w2) - self.sqrt(high * high + w2))

    def positive(self, x: Value, scale: Value = 1.0) -> Value:
        """Return the larger of a value and 0.

        Parameters
        ----------
        x : Value
            A value [any].
        scale : Value
            What the smoothing width is a share of [as the values].
        """
        return self.maximum(x, 0.0, scale)

    def lesser(self, a: Value, b: Value) -> Value:
        """Return the smaller of two positive values, positive however smooth.

        Parameters
        ----------
        a, b : Value
            Values [any].
        """
        w2 = self.width * self.width
        # the other way round of the hyperbola's root: no cancellation where one is far larger
        return 2.0 * (1.0 - w2) * a * b / (a + b + self.sqrt((a - b) * (a - b) + 4.0 * w2 * a * b))

    def ordered(self, a: Value, b: Value) -> tuple[Value, Value]:
        """Return the smaller and the larger of two positive values; their sum is exact however smooth.

        Parameters
        ----------
        a, b : Value
            Values [any].
        """
        least = self.lesser(a, b)
        return least, a + b - least

    def capped(self, a: Value, b: Value, scale: Value = 1.0) -> Value:
        """Return the smaller of two values that are not negative, 0 where one is, however smooth.

        Parameters
        ----------
        a, b : Value
            Values [any].
        scale : Value
            What the smoothing width is a share of [as the values].
        """
        return a * b / self.maximum(a, b, scale)

    def unit(self, x: Value) -> Value:
        """Hold a share within 0 and 1.

        Parameters
        ----------
        x : Value
            A value [any].
        """
        return self.clip(x, 0.0, 1.0)

    def step(self, x: Value, scale: Value = 1.0) -> Value:
        """Return 1 where a value is above 0, else 0.

        Parameters
        ----------
        x : Value
            A value [any].
        scale : Value
            What the smoothing width is a share of [as the values].
        """
        return 0.5 * (1.0 + x / self.sqrt(x * x + (self.width * scale) ** 2))

    def surely_below(self, a: Value, b: Value) -> bool:
        """Tell whether a value is known not to be above another, so that a limit need not be looked for.

        Parameters
        ----------
        a, b : Value
            Values [any].
        """
        return False

    def sums(self, values: Value, members: NDArray[np.float64]) -> Sequence[Value]:
        """Sum the terminals of each group; `members` is (n_terminal, n_group) of 0 and 1.

        Parameters
        ----------
        values : Value
            Values [any].
        members : ndarray
            Shape (n_terminal, n_group), of 0 and 1 [-].
        """
        raise NotImplementedError

    def spread(self, values: Sequence[Value], index: NDArray[np.intp]) -> Value:
        """Give each terminal its group's value.

        Parameters
        ----------
        values : sequence of Value
            One a group [any].
        index : ndarray of int
            Positions [-].
        """
        raise NotImplementedError

    def pick(self, values: Value, index: NDArray[np.intp]) -> Value:
        """Give each terminal its zone's value.

        Parameters
        ----------
        values : Value
            Values [any].
        index : ndarray of int
            Positions [-].
        """
        raise NotImplementedError

    def dot(self, a: Value, b: Value) -> Value:
        """Sum products over the terminals.

        Parameters
        ----------
        a, b : Value
            Values [any].
        """
        raise NotImplementedError

    def empty(self, count: int) -> Value:
        """Make an array to be filled.

        Parameters
        ----------
        count : int
            Its length.
        """
        return np.empty(count)

    def gather(self, values: Value, members: NDArray[np.float64]) -> Value:
        """Sum the elements of each zone, which see no other zone; `members` is (n_element, n_zone) of 0 and 1.

        Parameters
        ----------
        values : Value
            Values [any].
        members : ndarray
            Shape (n_terminal, n_group), of 0 and 1 [-].
        """
        return values @ members


class FloatOperations(Operations):
    """Python floats: for what there is one of, ten times faster than arrays of one element."""

    exp = staticmethod(math.exp)
    expm1 = staticmethod(math.expm1)
    log = staticmethod(math.log)
    sqrt = staticmethod(math.sqrt)
    arctan = staticmethod(math.atan)

    def _make_exact(self) -> None:
        self.maximum = lambda a, b, scale=1.0: a if a >= b else b  # type: ignore[method-assign]
        self.minimum = lambda a, b, scale=1.0: a if a <= b else b  # type: ignore[method-assign]
        self.clip = lambda x, lower, upper, scale=1.0: (  # type: ignore[method-assign]
            lower if x < lower else upper if x > upper else x
        )
        self.step = lambda x, scale=1.0: 1.0 if x > 0.0 else 0.0  # type: ignore[method-assign]
        self.positive = lambda x, scale=1.0: x if x >= 0.0 else 0.0  # type: ignore[method-assign]
        self.lesser = lambda a, b: a if a <= b else b  # type: ignore[method-assign]
        self.ordered = lambda a, b: (a, b) if a <= b else (b, a)  # type: ignore[method-assign]
        self.capped = lambda a, b, scale=1.0: a if a <= b else b  # type: ignore[method-assign]
        self.surely_below = lambda a, b: bool(a <= b)  # type: ignore[method-assign]


class NumpyOperations(Operations):
    """Arrays over terminals, or over times and terminals; a time axis stands first."""

    exp = staticmethod(np.exp)
    expm1 = staticmethod(np.expm1)
    log = staticmethod(np.log)
    sqrt = staticmethod(np.sqrt)
    arctan = staticmethod(np.arctan)

    def _make_exact(self) -> None:
        larger, smaller = np.maximum, np.minimum
        zero, one = np.zeros(()), np.ones(())  # arrays: a float would be made one at each call
        self.positive = lambda x, scale=1.0: larger(x, zero)  # type: ignore[method-assign]
        self.unit = lambda x: smaller(larger(x, zero), one)  # type: ignore[method-assign]
        self.lesser = lambda a, b: smaller(a, b)  # type: ignore[method-assign]
        self.ordered = lambda a, b: (smaller(a, b), larger(a, b))  # type: ignore[method-assign]
        self.capped = lambda a, b, scale=1.0: smaller(a, b)  # type: ignore[method-assign]
        self.maximum = lambda a, b, scale=1.0: larger(a, b)  # type: ignore[method-assign]
        self.minimum = lambda a, b, scale=1.0: smaller(a, b)  # type: ignore[method-assign]
        self.clip = lambda x, lower, upper, scale=1.0: smaller(larger(x, lower), upper)  # type: ignore[method-assign]
        self.step = lambda x, scale=1.0: np.where(np.asarray(x) > 0.0, 1.0, 0.0)  # type: ignore[method-assign]

    def sums(self, values: Value, members: NDArray[np.float64]) -> Sequence[Value]:
        """Sum the terminals of each group, a time series each."""
        return list((values @ members).T)

    def spread(self, values: Sequence[Value], index: NDArray[np.intp]) -> Value:
        """Give each terminal its group's value."""
        return np.stack(np.broadcast_arrays(*values), axis=-1)[..., index]

    def pick(self, values: Value, index: NDArray[np.intp]) -> Value:
        """Give each terminal its zone's value."""
        return values[..., index]

    def dot(self, a: Value, b: Value) -> Value:
        """Sum products over the terminals."""
        return (a * b).sum(axis=-1)


class StepOperations(NumpyOperations):
    """One step of the plant: arrays over terminals, floats for air handlers and the boiler."""

    def __init__(self, width: float = 0.0) -> None:
        super().__init__(width)
        self._scalar = FloatOperations(width)

    def surely_below(self, a: Value, b: Value) -> bool:
        """Tell whether no element is above a value."""
        return bool(a.item(a.argmax()) <= b)

    @property
    def scalar(self) -> Operations:
        """Operations on floats."""
        return self._scalar

    def sums(self, values: Value, members: NDArray[np.float64]) -> Sequence[Value]:
        """Sum the terminals of each group, to floats."""
        totals: list[float] = values.dot(members).tolist()
        return totals

    def spread(self, values: Sequence[Value], index: NDArray[np.intp]) -> Value:
        """Give each terminal its group's value."""
        return np.array(values)[index]

    def pick(self, values: Value, index: NDArray[np.intp]) -> Value:
        """Give each terminal its zone's value."""
        return values[index]

    def dot(self, a: Value, b: Value) -> Value:
        """Sum products over the terminals, to a float."""
        return float(a.dot(b))


class CasadiOperations(Operations):
    """CasADi expressions, SX or MX: columns over terminals."""

    exp = staticmethod(casadi.exp)
    expm1 = staticmethod(casadi.expm1)
    log = staticmethod(casadi.log)
    sqrt = staticmethod(casadi.sqrt)
    arctan = staticmethod(casadi.atan)

    def _make_exact(self) -> None:
        larger, smaller = casadi.fmax, casadi.fmin
        self.lesser = lambda a, b: smaller(a, b)  # type: ignore[method-assign]
        self.capped = lambda a, b, scale=1.0: smaller(a, b)  # type: ignore[method-assign]
        self.maximum = lambda a, b, scale=1.0: larger(a, b)  # type: ignore[method-assign]
        self.minimum = lambda a, b, scale=1.0: smaller(a, b)  # type: ignore[method-assign]
        self.clip = lambda x, lower, upper, scale=1.0: smaller(larger(x, lower), upper)  # type: ignore[method-assign]
        self.step = lambda x, scale=1.0: casadi.if_else(x > 0.0, 1.0, 0.0)  # type: ignore[method-assign]

    def sums(self, values: Value, members: NDArray[np.float64]) -> Sequence[Value]:
        """Sum the terminals of each group."""
        return list(casadi.vertsplit(self.gather(values, members)))

    def spread(self, values: Sequence[Value], index: NDArray[np.intp]) -> Value:
        """Give each terminal its group's value."""
        return self.pick(casadi.vertcat(*values), index)

    def pick(self, values: Value, index: NDArray[np.intp]) -> Value:
        """Give each terminal its zone's value."""
        return casadi.vec(values[index.tolist()])  # a single value picked many times comes as a row

    def dot(self, a: Value, b: Value) -> Value:
        """Sum products over the terminals."""
        return casadi.sum1(a * b)

    def gather(self, values: Value, members: NDArray[np.float64]) -> Value:
        """Sum the elements of each zone."""
        return casadi.mtimes(casadi.sparsify(casadi.DM(members.T)), values)
