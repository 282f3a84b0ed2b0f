"""Errors of a grey box on days that it was not fitted to, beside those of simple models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calibration.grey_box.fit import GreyBoxData, follow, predict, run_starts
from calibration.grey_box.network import GreyBox
from calibration.results import Plain
from thermal._types import FloatArray, IntArray

#: Leads that errors are told for [s].
LEADS = (3600.0, 6 * 3600.0, 86_400.0)

#: Time between the starts of judged runs [s], and past that a regression sees [s].
_EVERY, _PAST = 3600.0, (3600.0, 10_800.0)

#: Strength of the ridge, over the number of runs [-].
_RIDGE = 1e-3


@dataclass(frozen=True)
class LeadError(Plain):
    """Mean absolute errors at one lead, mean of the zones.

    Parameters
    ----------
    lead : float
        Time ahead [s].
    grey_box, persistence, arx : float
        Of the grey box, of zones that keep their temperature, and of a ridge regression of the change on temperatures,
        heat and weather [K].
    bias : float
        Mean error of the grey box [K].
    count : int
        Runs.
    """

    lead: float
    grey_box: float
    persistence: float
    arx: float
    bias: float
    count: int


def judge(box: GreyBox, data: GreyBoxData, split: int, leads: Sequence[float] = LEADS) -> list[LeadError]:
    """Judge a network that was fitted to the steps before ``split`` on those from it on, inputs as they came.

    Parameters
    ----------
    box : GreyBox
        Fitted to ``data.rows(0, split)``.
    data : GreyBoxData
        All telemetry.
    split : int
        First held-out step.
    leads : sequence of float
        Time ahead [s].

    Returns
    -------
    list of LeadError
        Of the leads for which there is a run.
    """
    followed, found = follow(box, data), []
    for lead in leads:
        steps = round(lead / data.step)
        if len(data.zone) - steps <= split:
            continue
        every = run_starts(data, steps, _EVERY)
        starts, tuned = every[every >= split], every[every + steps <= split]
        if not len(starts) or len(tuned) < 8:
            continue
        ends = starts + steps - 1
        target = data.zone[ends]
        errors = predict(box, data, followed.states, starts, steps)[:, -1] - target
        kept = data.zone[starts - 1] - target
        arx = _arx(data, tuned, starts, steps) - target
        mae, persistence, ridge = (float(np.nanmean(np.abs(e))) for e in (errors, kept, arx))
        found.append(LeadError(lead, mae, persistence, ridge, float(np.nanmean(errors)), len(starts)))
    return found


def _arx(data: GreyBoxData, tuned: IntArray, starts: IntArray, steps: int) -> FloatArray:
    """Ridge regression of the change of temperature over the lead, shape (n_run, n_zone) [K]."""
    from statsmodels.regression.linear_model import OLS

    zone = data.zone.copy()
    for column in zone.T:  # a regression bears no gaps
        known = np.isfinite(column)
        column[~known] = np.interp(np.flatnonzero(~known), np.flatnonzero(known), column[known])
    driven = np.column_stack([data.outdoor, data.sun, data.heat, data.gain])
    total = np.vstack([np.zeros(driven.shape[1]), np.cumsum(driven, axis=0)])

    def features(first: IntArray) -> FloatArray:
        now = zone[first - 1]
        risen = [now - zone[np.maximum(first - 1 - max(round(s / data.step), 1), 0)] for s in _PAST]
        back = np.maximum(first - round(86_400.0 / data.step), 0)
        ahead = (total[first + steps] - total[first]) / steps
        return np.hstack([now, *risen, ahead, (total[first] - total[back]) / np.maximum(first - back, 1)[:, None]])

    x, y = features(tuned), zone[tuned + steps - 1] - zone[tuned - 1]
    centre, spread = x.mean(axis=0), x.std(axis=0)
    spread[spread < 1e-9 * np.maximum(1.0, np.abs(centre))] = np.inf
    middle = y.mean(axis=0)
    model = [
        OLS(column, (x - centre) / spread).fit_regularized(alpha=_RIDGE, L1_wt=0.0).params for column in (y - middle).T
    ]
    return np.asarray(zone[starts - 1] + middle + (features(starts) - centre) / spread @ np.column_stack(model))
