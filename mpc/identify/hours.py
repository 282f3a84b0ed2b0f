"""Hours in which machines give heat when they are asked for it: air handlers and boilers stand still by a clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import pandas as pd

from thermal._types import BoolArray, FloatArray, IntArray

#: Hours that are told apart: those of working days, then those of week-ends.
HOURS = 48

#: Time for which a machine has to have been asked in an hour of the day without ever giving anything, for it to be none
#: of its hours [s]: longer than a thermostat's difference lasts.
_ASKED = 7200.0


def hours_of(index: pd.Index, step: float, timezone: str) -> IntArray:
    """Tell which of `HOURS` steps begin in, by the local clock, shape (n_time,).

    Parameters
    ----------
    index : DatetimeIndex
        Ends of the steps.
    step : float
        Of the control [s].
    timezone : str
        Of the plant.

    Examples
    --------
    >>> ends = pd.DatetimeIndex(["2023-01-09 07:15", "2023-01-14 00:00", "2023-01-14 00:15"], tz="Etc/GMT-1")
    >>> hours_of(ends, 900.0, "Etc/GMT-1").tolist()
    [7, 23, 24]
    """
    begins = (pd.DatetimeIndex(index) - pd.Timedelta(seconds=step)).tz_convert(timezone)
    return np.asarray(begins.hour + 24 * (begins.day_of_week >= 5), dtype=int)


@dataclass
class RunningHours:
    """Hours in which machines that setpoints lead give heat, by what they gave when setpoints were out of reach.

    An hour of working days, or of week-ends, in which a machine was asked for two hours in all and never gave anything
    is none of its hours, until it gives something. Hours of which nothing is known are its hours.

    Parameters
    ----------
    step : float
        Of the control [s].
    asked, given : ndarray, shape (n_machine, `HOURS`)
        Steps in which it was asked, and those of them in which it gave heat [-].
    """

    step: float
    asked: FloatArray
    given: FloatArray

    @classmethod
    def of(cls, step: float, counts: Sequence[Sequence[Sequence[float]]], machines: int) -> Self:
        """Make one of `counts`, or one that knows nothing.

        Parameters
        ----------
        step : float
            Of the control [s].
        counts : sequence, shape (n_machine, 2, `HOURS`)
            As `counts` gives them; empty where nothing is known [-].
        machines : int
            Number of machines.
        """
        known = np.array(counts, dtype=float) if len(counts) else np.zeros((machines, 2, HOURS))
        return cls(step, known[:, 0].copy(), known[:, 1].copy())

    @property
    def counts(self) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Steps asked and given of each machine by hour, shape (n_machine, 2, `HOURS`) [-]."""
        return tuple((tuple(a), tuple(g)) for a, g in zip(self.asked.tolist(), self.given.tolist(), strict=True))

    def learn(self, hours: IntArray, asked: BoolArray, given: BoolArray) -> None:
        """Take steps.

        Parameters
        ----------
        hours : ndarray, shape (n_time,)
            As of `hours_of`.
        asked, given : ndarray of bool, shape (n_time, n_machine)
            Whether setpoints were out of reach, and heat was given.
        """
        for k in range(asked.shape[1]):
            np.add.at(self.asked[k], hours, asked[:, k])
            np.add.at(self.given[k], hours, asked[:, k] & given[:, k])

    @property
    def closed(self) -> BoolArray:
        """Hours that are none of a machine's, shape (n_machine, `HOURS`)."""
        return np.asarray((self.asked * self.step >= _ASKED) & (self.given == 0.0))

    def running(self, hours: IntArray) -> BoolArray:
        """Whether machines give heat, shape (n_time, n_machine).

        Parameters
        ----------
        hours : ndarray, shape (n_time,)
            As of `hours_of`.
        """
        return ~self.closed[:, hours].T
