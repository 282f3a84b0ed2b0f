"""How much more a case's own days vary in the direction of each change than the filter's noise says."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from calibration.monitoring.filter import Innovation
from thermal._types import FloatArray

#: Days over which scores are correlated, days that have no say yet [d], and what a ratio of variances is taken for
#: before there are days, with the number of days that this counts for [-, d].
_LAGS, _UNSEEN, _AT_FIRST = 14, 14, (3.0, 14)


class Dispersion:
    """How much more the days vary in the direction of each change than the filter's noise says: the case's own level.

    A model that lacks how people come and go, or a season, errs in these directions day after day. With the score u_d
    and the information i_d of a change that begins on day d, both of one day, the variance of their sum is
    ``Σ_d Σ_l w_l u_d u_d-l`` with Bartlett's weights (Newey and West 1987, doi:10.2307/1913610). The noise says that it
    is ``Σ_d i_d``. Scores and information of the watch are divided by the ratio, 1 at least: a quasi-likelihood.

    Parameters
    ----------
    n_day, n_sought : int
        Days of the telemetry, and what may change.
    """

    def __init__(self, n_day: int, n_sought: int) -> None:
        self.score, self.information = np.zeros((n_day, n_sought)), np.zeros((n_day, n_sought))

    def put(self, day: int, own: FloatArray, innovation: Innovation) -> None:
        """Keep what a day says of changes that begin on it; a day that is filtered anew is replaced.

        Parameters
        ----------
        day : int
            Its number.
        own : ndarray, shape (n_seen, n_sought)
            What a unit of each change does to its errors [K].
        innovation : Innovation
            Of the filter.
        """
        white = solve_triangular(innovation.root, own, lower=True)
        self.score[day], self.information[day] = innovation.white @ white, (white**2).sum(axis=0)

    def at(self, day: int) -> FloatArray:
        """Ratio of the variances by the days up to two weeks before, shape (n_sought,) [-].

        Parameters
        ----------
        day : int
            Whose changes of the last two weeks have no say.
        """
        last = max(0, day - _UNSEEN)
        u, i = self.score[:last], self.information[:last]
        variance = (u**2).sum(axis=0)
        for lag in range(1, min(_LAGS, last - 1) + 1):
            variance = variance + 2.0 * (1.0 - lag / (_LAGS + 1.0)) * (u[lag:] * u[:-lag]).sum(axis=0)
        usual = i.sum(axis=0) / max(1, last)
        return np.asarray(np.maximum(1.0, (variance + _AT_FIRST[0] * _AT_FIRST[1] * usual)
                                     / np.maximum(i.sum(axis=0) + _AT_FIRST[1] * usual, 1e-12)))  # fmt: skip
