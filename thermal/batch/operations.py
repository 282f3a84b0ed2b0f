"""Operations on traced values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from thermal._types import FloatArray
from thermal.batch.trace import Tape
from thermal.components.operations import NumpyOperations, Value


class TracedOperations(NumpyOperations):
    """Exact operations on traced values: arrays over terminals, numbers for air handlers and the boiler.

    Parameters
    ----------
    tape : Tape
        Where they are noted.
    """

    def __init__(self, tape: Tape) -> None:
        super().__init__()
        self._tape = tape

    def _make_exact(self) -> None:
        super()._make_exact()
        self.step = lambda x, scale=1.0: (x > 0.0).number()  # type: ignore[method-assign]

    def empty(self, count: int) -> Value:
        """Make an array to be filled.

        Parameters
        ----------
        count : int
            Its length.
        """
        return self._tape.value(count, kept=False)

    def sums(self, values: Value, members: FloatArray) -> Sequence[Value]:
        """Sum the terminals of each group, a number each.

        Parameters
        ----------
        values : Value
            Values [any].
        members : ndarray
            Shape (n_terminal, n_group), of 0 and 1 [-].
        """
        totals = values @ members
        return [totals[k] for k in range(members.shape[1])]

    def spread(self, values: Sequence[Value], index: Any) -> Value:
        """Give each terminal its group's value.

        Parameters
        ----------
        values : sequence of Value
            One a group [any].
        index : ndarray of int
            Positions [-].
        """
        return np.stack(values)[index]

    def pick(self, values: Value, index: Any) -> Value:
        """Give each terminal its zone's value.

        Parameters
        ----------
        values : Value
            Values [any].
        index : ndarray of int
            Positions [-].
        """
        return values[index]

    def dot(self, a: Value, b: Value) -> Value:
        """Sum products over the terminals, to a number.

        Parameters
        ----------
        a, b : Value
            Values [any].
        """
        return a @ b
