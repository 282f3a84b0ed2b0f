"""Gains of a filter: one for each step whose sensors or covariance differ from those of the step before."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from calibration.estimation.disturbance import DisturbedSpace
from thermal._types import BoolArray, FloatArray

#: Whether the covariance follows every missing value, or the gains are those of the steady covariance throughout.
Covariance = Literal["exact", "steady"]

#: Relative change in a step of the variances of zones and disturbances below which the covariance counts as steady
#: again [-]; estimates are then right to a microkelvin and a hundredth of a watt.
TOLERANCE = 1e-8

#: Relative distance of the variances from the steady ones at which steady gains are taken up again after a step whose
#: inputs were incomplete [-].
_CLOSE = 0.05

#: What a step by the matrix of all of it saves, in products that making the matrix takes: 18 µs of one core with 91
#: states in 12 zones, where making takes 270 µs [-].
_SAVED = 6000.0


@dataclass(frozen=True)
class Gain:
    """What one pattern of sensors and one covariance P make of a step's innovations e.

    Parameters
    ----------
    weight : ndarray, shape (n_zone, n_zone)
        Inverse of the innovations' covariance, zero where nothing is measured [1/K²].
    reach : ndarray, shape (n, n_zone)
        ``P C̄'``: the filtered state is ``z + reach weight e`` [states times K].
    seen : ndarray, shape (n_zone, n_zone)
        ``C̄ P C̄'``, covariance of the predicted zone temperatures [K²].
    heat : ndarray, shape (n_zone, n)
        Rows of P that belong to the disturbances [W times states].
    log_determinant : float
        Of the innovations' covariance [-].
    """

    weight: FloatArray
    reach: FloatArray
    seen: FloatArray
    heat: FloatArray
    log_determinant: float


def _make_gain(whole: DisturbedSpace, covariance: FloatArray, measured: BoolArray) -> Gain:
    """Gain of a covariance and a pattern of sensors.

    Parameters
    ----------
    whole : DisturbedSpace
        Building and disturbances.
    covariance : ndarray, shape (n, n)
        P, of the prediction [products of states].
    measured : ndarray of bool, shape (n_zone,)
        Zones that the step measures.
    """
    reach = covariance @ whole.observation.T
    seen = whole.observation @ reach
    heat = covariance[whole.space.order :].copy()
    return _weighed(Gain(seen, reach, 0.5 * (seen + seen.T), heat, 0.0), measured, whole.noise_variance)


def _weighed(gain: Gain, measured: BoolArray, noise: FloatArray) -> Gain:
    """Weigh other sensors with the same covariance."""
    chosen = np.flatnonzero(measured)
    rows, columns = chosen[:, None], chosen[None, :]
    spread = gain.seen[rows, columns]
    spread[np.diag_indices(chosen.size)] += noise[chosen]
    weight = np.zeros(gain.seen.shape)
    weight[rows, columns] = np.linalg.inv(spread)
    root = np.linalg.cholesky(spread)
    return replace(gain, weight=0.5 * (weight + weight.T), log_determinant=2.0 * float(np.log(root.diagonal()).sum()))


def runs(gains: Sequence[Gain], gain_of: NDArray[np.int64]) -> Iterator[tuple[slice, Gain]]:
    """Give the runs of steps that follow one another with one gain, in their order.

    Parameters
    ----------
    gains : sequence of Gain
        All of an interval.
    gain_of : ndarray of int, shape (n_time,)
        Which of them each step uses.
    """
    edges = [0, *(np.flatnonzero(np.diff(gain_of)) + 1).tolist(), len(gain_of)]
    for start, stop in itertools.pairwise(edges):
        yield slice(start, stop), gains[gain_of[start]]


def pays_off(run: slice, whole: DisturbedSpace) -> bool:
    """Whether a run is long enough to make the matrix that takes a state from one step to the next.

    Parameters
    ----------
    run : slice
        Its steps.
    whole : DisturbedSpace
        Building and disturbances.
    """
    return bool((run.stop - run.start - 1) * _SAVED > whole.n**2 * whole.space.n_zone)


def exact_gains(
    whole: DisturbedSpace,
    steady: FloatArray,
    start: FloatArray,
    measured: BoolArray,
    known: BoolArray,
    unknown: FloatArray,
    tolerance: float,
) -> tuple[list[Gain], list[int]]:
    """Gains that follow the covariance wherever it is not steady.

    Parameters
    ----------
    whole : DisturbedSpace
        Building and disturbances.
    steady : ndarray, shape (n, n)
        Steady P of all sensors that report at all [products of states].
    start : ndarray, shape (r, m)
        Columns whose outer products add to it at the first step [(W K)^0.5].
    measured : ndarray of bool, shape (n_time, n_zone)
        What is measured.
    known : ndarray of bool, shape (n_time,)
        Whether a step's inputs are complete.
    unknown : ndarray, shape (n_zone,)
        Deviation of the heat of a step whose inputs are not [W].
    tolerance : float
        Relative change in a step of the variances of zones and disturbances below which they count as steady [-].

    Returns
    -------
    tuple
        Gains, the steady one first, and which of them each step uses.
    """
    pattern, covariance = np.asarray(measured.any(axis=0)), steady.copy()
    gains, gain_of, settled = [_make_gain(whole, steady, pattern)], [], start.size == 0
    covariance[: whole.space.order, : whole.space.order] += start @ start.T
    for seen, complete in zip(measured, known, strict=True):
        same = np.array_equal(seen, pattern)
        if not (settled and complete and same):
            gain, covariance = _follow(whole, covariance, seen, None if complete else unknown)
            settled = bool(complete) and same and len(gains) > 1 and _near(gain, gains[-1], tolerance)
            gains.append(gain)
            pattern = seen
        gain_of.append(len(gains) - 1)
    return gains, gain_of


def steady_gains(
    whole: DisturbedSpace, covariance: FloatArray, measured: BoolArray, known: BoolArray, unknown: FloatArray
) -> tuple[list[Gain], list[int]]:
    """Gains of the steady covariance, one a pattern of sensors; it is left only where inputs are incomplete.

    Parameters
    ----------
    whole : DisturbedSpace
        Building and disturbances.
    covariance : ndarray, shape (n, n)
        Steady P of all sensors that report at all [products of states].
    measured : ndarray of bool, shape (n_time, n_zone)
        What is measured.
    known : ndarray of bool, shape (n_time,)
        Whether a step's inputs are complete.
    unknown : ndarray, shape (n_zone,)
        Deviation of the heat of a step whose inputs are not [W].

    Returns
    -------
    tuple
        Gains, that of all sensors first, and which of them each step uses.
    """
    ever = np.asarray(measured.any(axis=0))
    gains, gain_of, by_pattern = [_make_gain(whole, covariance, ever)], [], {ever.tobytes(): 0}
    away: FloatArray | None = None
    for seen, complete in zip(measured, known, strict=True):
        if complete and away is None:
            if (key := seen.tobytes()) not in by_pattern:
                by_pattern[key] = len(gains)
                gains.append(_weighed(gains[0], seen, whole.noise_variance))
            gain_of.append(by_pattern[key])
            continue
        gain, after = _follow(whole, covariance if away is None else away, seen, None if complete else unknown)
        gains.append(gain)
        gain_of.append(len(gains) - 1)
        away = None if complete and _near(gain, gains[0], _CLOSE) else after
    return gains, gain_of


def _follow(
    whole: DisturbedSpace, covariance: FloatArray, seen: BoolArray, unknown: FloatArray | None
) -> tuple[Gain, FloatArray]:
    """Gain of a step, and the covariance of the next."""
    if unknown is not None:
        covariance, heat = covariance.copy(), np.arange(whole.space.order, whole.n)
        covariance[heat, heat] += unknown**2
    gain = _make_gain(whole, covariance, seen)
    after = whole.propagate(covariance - gain.reach @ (gain.weight @ gain.reach.T))
    return gain, 0.5 * (after + after.T)


def _near(gain: Gain, other: Gain, limit: float) -> bool:
    """Whether all variances of zones and disturbances are within a share of another gain's."""
    r = gain.heat.shape[1] - gain.heat.shape[0]
    variances = [np.concatenate([np.diag(g.seen), np.diag(g.heat[:, r:])]) for g in (gain, other)]
    return bool((np.abs(variances[0] - variances[1]) <= limit * variances[1]).all())
