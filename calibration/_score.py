"""Derivatives of the innovations' likelihood with respect to the numbers of the disturbance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from calibration._kalman import Filtered
from calibration._riccati import summed_stein
from calibration._smoother import backward, smoothed_zones

FloatArray = NDArray[np.float64]


def log_likelihood_slopes(filtered: Filtered) -> tuple[FloatArray, float, FloatArray]:
    """Differentiate the log-likelihood with respect to the numbers of the disturbance.

    The score of a state space model from one pass backwards (Koopman and Shephard 1992, doi:10.1093/biomet/79.4.823),
    and what the steady covariance at the start, which moves with the numbers, adds to it.

    Parameters
    ----------
    filtered : Filtered
        From `KalmanFilter.filter`.

    Returns
    -------
    tuple
        Derivatives with respect to the variance of each zone's w (n_zone,) [1/W²], to φ [-], and to the variance of
        each sensor (n_zone,) [1/K²].
    """
    back, whole, r = backward(filtered), filtered.kalman.whole, filtered.kalman.space.order
    heat, spreads = slice(r, None), back.spreads
    drives = np.array([s.drive for s in spreads])[back.spread_of]
    carried = np.array([s.carried for s in spreads])[back.spread_of[:-1]]
    noises = np.array([s.noise for s in spreads])[back.spread_of]
    smoothed = smoothed_zones(filtered, back.costates)[0]
    by_drive = 0.5 * (back.costates[1:-1, heat] ** 2 - drives[1:]).sum(axis=0)
    by_keep = (back.costates[1:-1, heat] * smoothed[:-1] - carried).sum(axis=0)
    by_noise = 0.5 * (back.noise**2 - noises).sum(axis=0)
    covariance = filtered.kalman.steady(filtered.measured)[0]
    gain = filtered.gains[0]
    gained = gain.reach @ gain.weight
    loop = whole.advance(np.eye(whole.n) - gained @ whole.observation)
    adjoint = summed_stein(loop, np.outer(back.costates[0], back.costates[0]) - back.first)
    corrected = covariance - gained @ gain.reach.T
    by_drive += 0.5 * np.diag(adjoint)[heat]
    by_keep += np.einsum("ij,ji->i", adjoint[heat], whole.advance(corrected[:, heat]))
    predictor = whole.advance(gained)
    by_noise += 0.5 * np.einsum("ij,ij->j", predictor, adjoint @ predictor)
    return by_drive, float(by_keep.sum()), by_noise
