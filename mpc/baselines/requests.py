"""Requests of zones and valves, ASHRAE Guideline 36-2021, 5.6.8."""

from __future__ import annotations

import numpy as np

from thermal._types import FloatArray, IntArray

#: Share of a loop or valve above which it asks once, and below which it stops asking [-] (5.6.8.1.c, 5.6.8.3.c).
ASKING, CONTENT = 0.95, 0.85

#: Suppression after a change of a setpoint (5.1.20): time per kelvin [s/K], and the longest [s].
SUPPRESSION, LONGEST_SUPPRESSION = 540.0, 1800.0


class HysteresisRequests:
    """One request each from above 95 % until below 85 %; two and three for distances that last.

    Parameters
    ----------
    count : int
        Number of loops or valves.
    two, three : float
        Distances from the setpoint that are worth two and three requests [K].
    lasting : float
        How long such a distance must last [s].
    """

    def __init__(self, count: int, two: float, three: float, lasting: float) -> None:
        self.two, self.three, self.lasting = two, three, lasting
        self._asking = np.zeros(count, dtype=bool)
        self._since = np.zeros((2, count))

    def count(self, share: FloatArray, distance: FloatArray, seconds: float) -> IntArray:
        """Count the requests of each, shape (n,); what is not known asks for nothing.

        Parameters
        ----------
        share : ndarray, shape (n,)
            Output of the loop, or position of the valve [-].
        distance : ndarray, shape (n,)
            From the setpoint, positive where it is missed [K].
        seconds : float
            Time over which they were measured [s].
        """
        self._asking = np.where(share > ASKING, True, self._asking & (share >= CONTENT))
        beyond = np.stack([distance > self.two, distance > self.three])
        self._since = np.where(beyond, self._since + seconds, 0.0)
        lasts = self._since >= self.lasting
        return np.where(lasts[1], 3, np.where(lasts[0], 2, self._asking.astype(int))).astype(np.int64)


class SuppressedRequests:
    """Keeps distances quiet for a while after a setpoint has changed: 9 minutes a kelvin, up to half an hour.

    Parameters
    ----------
    count : int
        Number of setpoints.
    """

    def __init__(self, count: int) -> None:
        self._before = np.full(count, np.nan)
        self._quiet = np.zeros(count)

    def distance(self, distance: FloatArray, setpoint: FloatArray, seconds: float) -> FloatArray:
        """Give the distances that count, shape (n,) [K]: zero where a setpoint has just changed.

        Parameters
        ----------
        distance : ndarray, shape (n,)
            From the setpoint [K].
        setpoint : ndarray, shape (n,)
            Now [K].
        seconds : float
            Time since the last call [s].
        """
        change = np.nan_to_num(np.abs(setpoint - self._before))
        fresh = np.minimum(SUPPRESSION * change, LONGEST_SUPPRESSION)
        self._quiet = np.where(change > 0.0, fresh, np.maximum(self._quiet - seconds, 0.0))
        self._before = setpoint.copy()
        return np.where(self._quiet > 0.0, 0.0, distance)
