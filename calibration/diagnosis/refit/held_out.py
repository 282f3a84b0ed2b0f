"""Held-out errors of one model, by day."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from calibration.diagnosis.refit.comparison import Bench, Fit
from thermal._types import FloatArray

#: Held-out mean absolute error over the root mean square of the tuning errors above which they are errors of other
#: days [-]; 0.7 is usual.
_ELSEWHERE = 1.2


@dataclass(frozen=True)
class HeldOut:
    """Held-out errors of the N-step predictions of one model.

    Parameters
    ----------
    days : ndarray of int, shape (n_day,)
        Midnights, as numbers that grow with time [-].
    daily : ndarray, shape (n_day,)
        Mean over runs and zones of their size, by day [K].
    weight : ndarray, shape (n_day,)
        Number of runs of each day.
    """

    days: NDArray[np.int64]
    daily: FloatArray
    weight: FloatArray

    @property
    def mae(self) -> float:
        """Mean absolute error [K]."""
        return float(np.average(self.daily, weights=self.weight))


def held_out(bench: Bench, fit: Fit, horizon: str | None = None) -> HeldOut:
    """Held-out errors of a fitted model, by day.

    Parameters
    ----------
    bench : Bench
        The case.
    fit : Fit
        The model.
    horizon : str, optional
        The bench's own by default.
    """
    size, day = [], []
    for p in bench.predictions(fit, horizon=horizon):
        step = pd.Timedelta(seconds=fit.built.inputs.step)
        size.append(np.nanmean(np.abs(p.error), axis=1))
        day.append((p.start + (int(p.steps[-1]) - 1) * step).normalize().asi8)  # a stamp ends its step
    sizes, days = np.concatenate(size), np.concatenate(day)
    known = np.isfinite(sizes)
    there, index = np.unique(days[known], return_inverse=True)
    weight = np.bincount(index).astype(float)
    return HeldOut(there, np.bincount(index, sizes[known]) / weight, weight)


def elsewhere(fit: Fit, errors: HeldOut) -> bool:
    """Whether a model errs so much more where it is held out than where it was fitted that it was fitted elsewhere.

    What is missing then acts in the weather or the use of the held-out days, and hardly in those that could show it.

    Parameters
    ----------
    fit : Fit
        The calibrated baseline.
    errors : HeldOut
        Its held-out errors.
    """
    return errors.mae > _ELSEWHERE * float(np.sqrt(fit.found.mean_square))


def growth(before: HeldOut, after: HeldOut) -> tuple[float, float]:
    """How far a mean absolute error grows from one model to another on the same days, and the standard error of that.

    Parameters
    ----------
    before, after : HeldOut
        Errors of the two models.

    Returns
    -------
    tuple of float
        Growth, and its standard error from the differences of days [K]; 0 where there is one day only.
    """
    _, one, other = np.intersect1d(before.days, after.days, return_indices=True)
    change, share = after.daily[other] - before.daily[one], before.weight[one] / before.weight[one].sum()
    mean = float(share @ change)
    if change.size < 2:
        return mean, 0.0
    return mean, float(np.sqrt(change.size / (change.size - 1) * share**2 @ (change - mean) ** 2))
