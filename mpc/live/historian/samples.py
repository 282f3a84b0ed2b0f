"""Samples: a point's name, a time and a value, many at a time."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mpc.errors import HistorianError
from thermal._types import FloatArray


@dataclass(frozen=True, eq=False)
class Samples:
    """Values of points at times.

    Parameters
    ----------
    names : sequence of str, length n
        Name of the point of each sample, ``ENTITY/POINT`` by custom.
    seconds : ndarray, shape (n,)
        Times since 1970 in UTC [s]; kept to the microsecond.
    values : ndarray, shape (n,)
        Values [library's unit of the point]; NaN where the point was asked and gave no number.

    Raises
    ------
    HistorianError
        When the three are not of one length, or a time is not finite.

    Examples
    --------
    >>> len(Samples(["hall/zone_air_temperature_sensor"], np.array([0.0]), np.array([293.15])))
    1
    """

    names: Sequence[str]
    seconds: FloatArray
    values: FloatArray

    def __post_init__(self) -> None:
        shapes = f"{len(self.names)} names, {len(self.seconds)} times, {len(self.values)} values"
        HistorianError.unless(
            len(self.names) == len(self.seconds) == len(self.values), "samples", "as many names as times and values",
            shapes,
        )  # fmt: skip
        HistorianError.unless(np.isfinite(self.seconds).all(), "samples", "finite times", "others")

    def __len__(self) -> int:
        return len(self.names)

    def to_line(self) -> str:
        """Write as a line of JSON, from which `from_line` makes the same bits; NaN is null."""
        values = [None if value != value else float(value) for value in self.values]
        return json.dumps({"names": list(self.names), "seconds": self.seconds.tolist(), "values": values})

    @classmethod
    def from_line(cls, line: str) -> Samples:
        """Read what `to_line` wrote.

        Parameters
        ----------
        line : str
            JSON.

        Raises
        ------
        HistorianError
            When it is something else.
        """
        try:
            found = json.loads(line)
            seconds, values = (np.array(found[key], dtype=float) for key in ("seconds", "values"))
            return cls([str(name) for name in found["names"]], seconds, values)
        except (ValueError, KeyError, TypeError) as error:
            raise HistorianError("line of samples", "JSON with names, seconds and values", f"{line[:60]!r}") from error
