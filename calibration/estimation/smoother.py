"""Smoother: unmeasured heat of every zone with its band, and derivatives of the likelihood, by one pass backwards."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtri

from calibration.errors import FilterError
from calibration.estimation.disturbance import DisturbedSpace, summed_stein
from calibration.estimation.gains import Gain, pays_off, runs
from calibration.estimation.kalman import Filtered
from thermal._types import FloatArray

#: Derivatives with respect to the variance of each zone's w, to φ, and to the variance of each sensor.
Slopes = tuple[FloatArray, float, FloatArray]


@dataclass(frozen=True)
class Smoothed:
    """Missing watts of every zone, and its temperature, from all of an interval of telemetry.

    Parameters
    ----------
    stamps : DatetimeIndex, length n_time
        Ends of the steps.
    disturbance, disturbance_deviation : ndarray, shape (n_time, n_zone)
        Unmeasured heat during each step and its standard deviation [W].
    zone, zone_deviation : ndarray, shape (n_time, n_zone)
        Zone temperatures without the sensors' noise, also where not measured, and their standard deviation [K].
    """

    stamps: pd.DatetimeIndex
    disturbance: FloatArray
    disturbance_deviation: FloatArray
    zone: FloatArray
    zone_deviation: FloatArray

    def band(self, level: float = 0.9) -> tuple[FloatArray, FloatArray]:
        """Lower and upper edge of the unmeasured heat, each of shape (n_time, n_zone) [W].

        Parameters
        ----------
        level : float
            Probability that the heat lies within [-], between 0 and 1; it holds stamp by stamp.

        Raises
        ------
        FilterError
            When the level is not between 0 and 1.
        """
        FilterError.unless(0.0 < level < 1.0, "level", "a probability between 0 and 1", level)
        half = float(ndtri(0.5 * (1.0 + level))) * self.disturbance_deviation
        return self.disturbance - half, self.disturbance + half


def smooth(filtered: Filtered) -> Smoothed:
    """Estimate unmeasured heat and zone temperatures of every step from all measurements.

    Fixed-interval smoothing without inverses of covariances (de Jong 1989; Durbin and Koopman 2012, Time Series
    Analysis by State Space Methods, ch. 4.4): ``ẑ = z + P ρ``, ``Var = P - P N P``, with ρ and N run backwards.

    Parameters
    ----------
    filtered : Filtered
        From `KalmanFilter.filter`.

    Returns
    -------
    Smoothed
        Missing watts per zone over time, with their band.

    Examples
    --------
    >>> from calibration.estimation.disturbance import DisturbanceModel
    >>> from calibration.estimation.filtered import filter_interval
    >>> from calibration.evaluation.intervals import Interval
    >>> from thermal.data import load_bundled_case
    >>> from thermal.model.reduce import reduced_model
    >>> from thermal.model.case_replay import replay_inputs
    >>> from thermal.model.matrices import SymbolicModel
    >>> from thermal.network.build import build_network
    >>> grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
    >>> inputs, theta = replay_inputs(load_bundled_case(), grid.network), grid.network.start()
    >>> small = reduced_model(grid, [theta])
    >>> week = Interval(inputs.stamps[600], inputs.stamps[900])
    >>> found = smooth(filter_interval(small, theta, inputs, week, DisturbanceModel(100.0, 3600.0, 0.05)))
    >>> low, high = found.band(0.9)
    >>> bool((low < high).all())
    True
    """
    heat, zone = smoothed_zones(filtered, costates(filtered)[0])
    if filtered.kalman.covariance == "steady":
        variances = _steady_variances(filtered)
    else:
        found, index, _ = spreads(filtered)
        variances = found[index, :2]
    deviations = np.sqrt(np.maximum(variances, 0.0))
    return Smoothed(filtered.stamps, heat, deviations[:, 0], zone, deviations[:, 1])


def smoothed_zones(filtered: Filtered, slopes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Correct disturbances [W] and zone temperatures [K], each of shape (n_time, n_zone).

    Parameters
    ----------
    filtered : Filtered
        From `KalmanFilter.filter`.
    slopes : ndarray, shape (n_time + 1, n)
        From `costates` [1 per unit of the state].
    """
    r, count = filtered.kalman.space.order, len(filtered.stamps)
    heat, zone = filtered.states[:count, r:].copy(), filtered.predicted.copy()
    order = np.argsort(filtered.gain_of, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(filtered.gain_of[order])) + 1):
        gain = filtered.gains[filtered.gain_of[rows[0]]]
        heat[rows] += slopes[rows] @ gain.heat.T
        zone[rows] += slopes[rows] @ gain.reach
    return heat, zone


def costates(filtered: Filtered) -> tuple[FloatArray, FloatArray]:
    """Run derivatives of the log-likelihood backwards.

    Parameters
    ----------
    filtered : Filtered
        From `KalmanFilter.filter`.

    Returns
    -------
    tuple
        Derivatives with respect to the predicted states (n_time + 1, n) [1 per unit of the state], the last zero, and
        to the predicted zone temperatures of each step (n_time, n_zone) [1/K], zero where not measured.
    """
    whole, count = filtered.kalman.whole, len(filtered.stamps)
    observe, gains, gain_of = whole.observation, filtered.gains, filtered.gain_of
    slopes, noise = np.zeros((count + 1, whole.n)), np.empty((count, whole.space.n_zone))
    for at, gain in reversed(list(runs(gains, gain_of))):
        errors = filtered.errors[at]
        if not pays_off(at, whole):
            for k in range(at.stop - 1, at.start - 1, -1):
                carried = whole.retreat(slopes[k + 1])
                noise[k] = gain.weight @ (filtered.errors[k] - carried @ gain.reach)
                slopes[k] = carried + noise[k] @ observe
            continue
        loop, pull = np.ascontiguousarray(whole.corrected(gain.reach, gain.weight).T), errors @ gain.weight @ observe
        for k, pulled in zip(range(at.stop - 1, at.start - 1, -1), pull[::-1], strict=True):
            slopes[k] = loop @ slopes[k + 1] + pulled
        carried = whole.retreat(np.ascontiguousarray(slopes[at.start + 1 : at.stop + 1].T)).T
        noise[at] = (errors - carried @ gain.reach) @ gain.weight
    return slopes, noise


def spreads(filtered: Filtered) -> tuple[FloatArray, NDArray[np.int64], FloatArray]:
    """Run N, the variance of the costates, backwards; a new one only until it is steady under the gain of its steps.

    What a step's smoothing owes to covariances alone, not to the data, are five rows over the zones: variances of the
    smoothed disturbance [W²] and zone temperature [K²]; N at the disturbances [1/W²]; ``N' L P`` there, N' that of the
    next step [-]; and the variance of the smoothed noise over that of the noise squared [1/K²].

    Parameters
    ----------
    filtered : Filtered
        From `KalmanFilter.filter`, with ``covariance="exact"``.

    Returns
    -------
    tuple
        The rows (n_found, 5, n_zone), which of these each step has (n_time,), and N of the first state (n, n).
    """
    kalman, gain_of = filtered.kalman, filtered.gain_of
    found: list[FloatArray] = []
    index = np.empty(len(gain_of), dtype=np.int64)
    precision, settled, last = np.zeros((kalman.whole.n, kalman.whole.n)), False, -1
    for k in range(len(gain_of) - 1, -1, -1):
        if not (settled and gain_of[k] == last):
            spread, precision = _step(kalman.whole, filtered.gains[gain_of[k]], precision)
            settled = gain_of[k] == last and np.allclose(spread[:3], found[-1][:3], rtol=kalman.tolerance, atol=0.0)
            found.append(spread)
            last = gain_of[k]
        index[k] = len(found) - 1
    return np.array(found), index, precision


def averaged_deviation(filtered: Filtered, steps: int) -> FloatArray:
    """Deviation of the unmeasured heat's mean over several steps, over that of a single step, shape (n_zone,) [-].

    Errors of smoothed steps that follow one another are not independent: noise of a sensor that makes one step's heat
    too large makes the next one's too small. With steady P and N, and ``L = Ā (I - P C̄' F^-1 C̄)``, the covariance of
    errors l steps apart is ``P L'^l (I - N P)`` (de Jong and Mackinnon 1988, doi:10.1093/biomet/75.3.601).

    Parameters
    ----------
    filtered : Filtered
        From `KalmanFilter.filter`; its steady gain counts, of all sensors that report at all.
    steps : int
        Length of the mean, 1 or more.

    Examples
    --------
    >>> from calibration.estimation.disturbance import DisturbanceModel
    >>> from calibration.estimation.filtered import filter_interval
    >>> from calibration.evaluation.intervals import Interval
    >>> from thermal.data import load_bundled_case
    >>> from thermal.model.reduce import reduced_model
    >>> from thermal.model.case_replay import replay_inputs
    >>> from thermal.model.matrices import SymbolicModel
    >>> from thermal.network.build import build_network
    >>> grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
    >>> inputs, theta = replay_inputs(load_bundled_case(), grid.network), grid.network.start()
    >>> small = reduced_model(grid, [theta])
    >>> week = Interval(inputs.stamps[600], inputs.stamps[900])
    >>> found = filter_interval(small, theta, inputs, week, DisturbanceModel(100.0, 3600.0, 0.05))
    >>> bool((averaged_deviation(found, 12) < 1.0).all())
    True
    """
    whole, gain, r = filtered.kalman.whole, filtered.gains[0], filtered.kalman.space.order
    behind = _steady_precision(filtered) @ gain.heat.T
    apart, gained = np.ascontiguousarray(gain.heat.T), gain.reach @ gain.weight
    covariance = np.empty((steps, whole.space.n_zone))
    for lag in range(steps):
        covariance[lag] = np.diag(apart[r:]) - _rows(apart.T, behind.T)
        apart = whole.advance(apart - gained @ (whole.observation @ apart))
    pairs = np.where(np.arange(steps) > 0, 2.0, 1.0) * (steps - np.arange(steps))
    return np.asarray(np.sqrt(np.maximum(pairs @ covariance, 0.0) / np.maximum(covariance[0], 1e-30)) / steps)


def _steady_precision(filtered: Filtered) -> FloatArray:
    """N, the variance of the costates, where it is steady, shape (n, n)."""
    covariance, dual = filtered.kalman.steady(filtered.measured)
    precision = np.linalg.solve(np.eye(len(dual)) + dual @ covariance, dual)
    return np.asarray(0.5 * (precision + precision.T))


def _steady_variances(filtered: Filtered) -> FloatArray:
    """Variances of smoothed disturbances and zones where N is steady after every step, (n_time, 2, n_zone).

    Gains of one covariance share all large products.
    """
    whole, first, r = filtered.kalman.whole, filtered.gains[0], filtered.kalman.space.order
    precision = _steady_precision(filtered)
    heat, observed = np.ascontiguousarray(first.heat.T), first.reach[r:]
    behind = whole.retreat(np.ascontiguousarray(whole.retreat(precision).T))
    from_heat, from_zone = behind @ heat, behind @ first.reach
    across, inner = first.heat @ from_zone, first.reach.T @ from_zone
    plain = np.diag(first.heat[:, r:]) - _rows(first.heat, from_heat.T)
    variances = []
    for gain in filtered.gains:
        if gain.reach is not first.reach:
            variances.append(_step(whole, gain, precision)[0][:2])
            continue
        weight, seen = gain.weight, gain.seen
        middle = weight + weight @ inner @ weight
        informed = inner - 2.0 * inner @ weight @ seen + seen @ middle @ seen
        known = plain + 2.0 * _rows(across @ weight, observed) - _rows(observed @ middle, observed)
        variances.append(np.array([known, np.diag(seen) - np.diag(informed)]))
    return np.array(variances)[filtered.gain_of]


def _rows(first: FloatArray, second: FloatArray) -> FloatArray:
    """Products of the rows of two matrices, the diagonal of ``first second'``."""
    return np.asarray(np.einsum("ij,ij->i", first, second))


def _step(whole: DisturbedSpace, gain: Gain, after: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rows of a step, see `spreads`, and its N from that of the next step."""
    r, observe = whole.space.order, whole.observation
    carried = whole.retreat(np.ascontiguousarray(whole.retreat(after).T))
    gained = gain.reach @ gain.weight
    across = carried @ gained
    # a congruence, one side after the other, so that round-off dies out as N itself does
    before = carried - across @ observe
    before += observe.T @ (gain.weight @ observe - gained.T @ before)
    before = 0.5 * (before + before.T)
    filtered = gain.heat.T - gained @ gain.reach[r:].T
    rows = [
        np.diag(gain.heat[:, r:]) - _rows(gain.heat @ before, gain.heat),
        np.diag(gain.seen) - _rows((before @ gain.reach).T, gain.reach.T),
        np.diag(before)[r:],
        _rows(after[r:], whole.advance(filtered).T),
        np.diag(gain.weight) + _rows(gained.T, across.T),
    ]
    return np.array(rows), before


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
    drives, carried, noises = found[index, 2:].transpose(1, 0, 2)
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
    corrections = np.concatenate([filtered.errors[at] @ gain.weight for at, gain in runs(gains, index)])
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
    adjoint = summed_stein(whole.corrected(gain.reach, gain.weight), slopes)
    corrected = filtered.kalman.steady(filtered.measured)[0] - gained @ gain.reach.T
    predictor = whole.advance(gained)
    by_keep = 2.0 * np.einsum("ij,ji->", adjoint[heat], whole.advance(corrected[:, heat]))
    return np.diag(adjoint)[heat].copy(), float(by_keep), np.einsum("ij,ij->j", predictor, adjoint @ predictor)
