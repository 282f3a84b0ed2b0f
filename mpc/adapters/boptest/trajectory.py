"""What a test remembers of its run: outputs and inputs, a row a step of the plant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_BLOCK = 512  # rows that room is made for at once


class Trajectory:
    """Rows of values by time, in an array that grows.

    Parameters
    ----------
    names : sequence of str
        Of the values.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self.names = tuple(names)
        self._position = {name: k for k, name in enumerate(self.names)}
        self._rows = np.zeros((_BLOCK, len(self.names) + 1))
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def append(self, time: float, values: Sequence[float]) -> None:
        """Add a row.

        Parameters
        ----------
        time : float
            BOPTEST's [s], after that of the row before.
        values : sequence of float
            In the order of the names [their units].
        """
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.zeros_like(self._rows)])
        self._rows[self._count, 0] = time
        self._rows[self._count, 1:] = values
        self._count += 1

    def copy(self) -> Trajectory:
        """Give the same rows, to go on from."""
        other = Trajectory(self.names)
        other._rows, other._count = self._rows.copy(), self._count
        return other

    def last(self) -> dict[str, float]:
        """Give the last row, by name, with its time."""
        row = self._rows[self._count - 1].tolist()
        return {"time": row[0], **dict(zip(self.names, row[1:], strict=True))}

    def between(self, names: Sequence[str], start: float, end: float) -> dict[str, list[float]]:
        """Rows of a time, column by column.

        Parameters
        ----------
        names : sequence of str
            Which values.
        start, end : float
            BOPTEST's times, both included [s].
        """
        times = self._rows[: self._count, 0]
        first, last = np.searchsorted(times, start, side="left"), np.searchsorted(times, end, side="right")
        columns = {"time": 0, **{name: self._position[name] + 1 for name in names}}
        return {name: self._rows[first:last, k].tolist() for name, k in columns.items()}
