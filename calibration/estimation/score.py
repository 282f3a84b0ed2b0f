"""Derivatives of the innovations' likelihood with respect to the numbers of the disturbance."""

from __future__ import annotations

import numpy as np

from calibration.estimation.kalman import Filtered
from calibration.estimation.riccati import summed_stein
from calibration.estimation.smoother import costates, smoothed_zones, spreads
from thermal._types import FloatArray

Slopes = tuple[FloatArray, float, FloatArray]


def log_likelihood_slopes(filtered: Filtered) -> Slopes:
    """Differentiate the log-likelihood with respect to the numbers of the disturbance.

    Parameters
    ----------
    filtered : Filtered
        From `KalmanFilter.filter`.

    Returns
    -------
    tuple
        Derivatives with respect to the variance of each zone's w (n_zone,) [1/W²], to φ [-], and to the variance of
        each sensor (n_zone,) [1/K²].

    Notes
    -----
    Directed airflows that change are taken as given, though their heat follows the filtered temperatures.
    """
    path = _steady_slopes if filtered.kalman.covariance == "steady" else _exact_slopes
    (by_drive, by_keep, by_noise), by_steady = path(filtered)
    more = _through_steady(filtered, by_steady)
    return by_drive + more[0], by_keep + more[1], by_noise + more[2]


def _exact_slopes(filtered: Filtered) -> tuple[Slopes, FloatArray]:
    """Score of a state space model whose covariance is exact, and what the steady one at its start adds to it.

    From one pass backwards (Koopman and Shephard 1992, doi:10.1093/biomet/79.4.823).
    """
    slopes, noise = costates(filtered)
    found, index, first = spreads(filtered)
    heat = slice(filtered.kalman.space.order, None)
    drives, carried, noises = (np.array([getattr(s, n) for s in found])[index] for n in ("drive", "carried", "noise"))
    smoothed = smoothed_zones(filtered, slopes)[0]
    by_drive = 0.5 * (slopes[1:-1, heat] ** 2 - drives[1:]).sum(axis=0)
    by_keep = (slopes[1:-1, heat] * smoothed[:-1] - carried[:-1]).sum()
    by_noise = 0.5 * (noise**2 - noises).sum(axis=0)
    return (by_drive, float(by_keep), by_noise), 0.5 * (np.outer(slopes[0], slopes[0]) - first)


def _steady_slopes(filtered: Filtered) -> tuple[Slopes, FloatArray]:
    """Differentiate by the steady covariance that every step has, and by what acts beside it."""
    slopes, noise = costates(filtered)
    gains, index, heat = filtered.gains, filtered.gain_of, slice(filtered.kalman.space.order, None)
    observe = filtered.kalman.whole.observation
    corrections = np.array([gains[g].weight @ e for g, e in zip(index, filtered.errors, strict=True)])
    before = slopes[:-1] - corrections @ observe
    weight = np.tensordot(np.bincount(index, minlength=len(gains)), np.array([g.weight for g in gains]), axes=1)
    by_covariance = 0.5 * (slopes.T @ slopes - before.T @ before - observe.T @ weight @ observe)
    by_keep = (slopes[1:-1, heat] * filtered.disturbance[:-1]).sum()
    by_noise = 0.5 * ((2.0 * noise - corrections) * corrections).sum(axis=0) - 0.5 * np.diag(weight)
    return (np.zeros(len(weight)), float(by_keep), by_noise), by_covariance


def _through_steady(filtered: Filtered, slopes: FloatArray) -> Slopes:
    """Pass through the steady covariance P, of which ``dP = L dP L' + dQ + K dR K' + dA P_f A' + A P_f dA'``."""
    whole, gain = filtered.kalman.whole, filtered.gains[0]
    heat, gained = slice(filtered.kalman.space.order, None), gain.reach @ gain.weight
    adjoint = summed_stein(whole.advance(np.eye(whole.n) - gained @ whole.observation), slopes)
    corrected = filtered.kalman.steady(filtered.measured)[0] - gained @ gain.reach.T
    predictor = whole.advance(gained)
    by_keep = 2.0 * np.einsum("ij,ji->", adjoint[heat], whole.advance(corrected[:, heat]))
    return np.diag(adjoint)[heat].copy(), float(by_keep), np.einsum("ij,ij->j", predictor, adjoint @ predictor)
