"""Error of forecast outdoor air, learned from the forecasts that were made."""

from __future__ import annotations

from collections import deque

import numpy as np

from thermal._types import FloatArray

_DAY = 86_400.0

#: Standard deviation a day ahead before anything was seen [K]: what weather services reach.
_PRIOR = 2.0

#: Leads that are compared with what came [s]: shorter ones are as good as measured. Errors hang together over the
#: shortest of them, so that it is the time of one independent reading; the prior is that of two days.
_LEADS = np.arange(6.0, 25.0, 6.0) * 3600.0
_READINGS = 2.0 * _DAY / _LEADS[0]


class ForecastError:
    """Standard deviation of forecast outdoor air, which grows with the root of the time ahead.

    Parameters
    ----------
    step : float
        Control step [s].

    Examples
    --------
    >>> import numpy as np
    >>> error = ForecastError(900.0)
    >>> error.ahead(96)[[0, 95]].round(2).tolist()
    [0.0, 1.99]
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._ages = np.round(_LEADS / step).astype(int)
        self._made: deque[FloatArray] = deque(maxlen=int(self._ages[-1]) + 1)
        self._sum, self._weight = _READINGS * _PRIOR**2, _READINGS

    def made(self, outdoor: FloatArray) -> None:
        """Take a forecast.

        Parameters
        ----------
        outdoor : ndarray, shape (N,)
            Of the coming steps [K].
        """
        self._made.appendleft(outdoor)

    def came(self, outdoor: float) -> None:
        """Take the step that the last forecast begins with.

        Parameters
        ----------
        outdoor : float
            Outdoor air over it [K].
        """
        found = [
            (self._made[age][age] - outdoor) ** 2 * _DAY / (age * self._step)
            for age in self._ages
            if age < len(self._made) and age < len(self._made[age])
        ]
        if found and np.isfinite(outdoor):
            weight = self._step / _LEADS[0]
            self._sum += weight * float(np.mean(found))
            self._weight += weight

    def ahead(self, count: int) -> FloatArray:
        """Give standard deviations of the coming steps, shape (count,) [K].

        Parameters
        ----------
        count : int
            Number of steps.
        """
        return np.asarray(np.sqrt(self._sum / self._weight * np.arange(count) * self._step / _DAY))
