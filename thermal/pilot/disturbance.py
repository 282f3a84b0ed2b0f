"""Heat that nobody measures: an autocorrelated process in each zone."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from thermal.errors import ThermalError

Series = npt.NDArray[np.float64]

_STREAM = 4  # of random numbers of a seed


def draw_disturbance(
    seed: int, n_time: int, deviation: Series, time_constant: float, step_seconds: float = 300.0
) -> Series:
    """Draw the unmeasured heat of zones: an Ornstein-Uhlenbeck process each, sampled exactly, stationary at once.

    ``d_{k+1} = φ d_k + σ sqrt(1 − φ²) w_k`` with ``φ = exp(−Δt / τ)`` and ``d_0 ~ N(0, σ²)``, so that the
    autocovariance is ``σ² exp(−|t| / τ)`` at any step (Gillespie 1996, doi:10.1103/PhysRevE.54.2084).

    Parameters
    ----------
    seed : int
        Same seed, same heat; 0 or more.
    n_time : int
        Number of steps, at least 1.
    deviation : numpy.ndarray, shape (n_zone,)
        Stationary standard deviation σ of each zone [W], 0 or more.
    time_constant : float
        Correlation time τ [s], positive.
    step_seconds : float
        Length of a step Δt [s], positive.

    Returns
    -------
    numpy.ndarray, shape (n_time, n_zone)
        Heat during each step [W], independent between zones.

    Examples
    --------
    >>> draw_disturbance(0, 288, np.array([100.0, 50.0]), 3600.0).shape
    (288, 2)
    """
    if seed < 0 or n_time < 1 or not np.all(np.asarray(deviation) >= 0.0) or min(time_constant, step_seconds) <= 0.0:
        raise ThermalError(
            "disturbance: expected a seed of 0 or more, a step, deviations of 0 or more and positive times, found "
            f"{seed}, {n_time} steps, {np.min(deviation)} W, {time_constant} s and {step_seconds} s"
        )
    keep = np.exp(-step_seconds / time_constant)
    drive = np.random.default_rng([seed, _STREAM]).standard_normal((n_time, len(deviation)))
    drive[1:] *= np.sqrt(1.0 - keep**2)
    return np.asarray(deviation * lfilter([1.0], [1.0, -keep], drive, axis=0), dtype=float)
