"""Hidden Markov models of two states: when heat beyond a model is that of something which is on or off."""

from typing import NamedTuple

import numpy as np
import pandas as pd

from thermal._types import BoolArray, FloatArray, IntArray

#: Deviations within which 90 % of a normal distribution are [-].
_NINETY = 1.645

#: Most that one step may say for either state [-]: what lasts one step is noise of another kind.
_MOST = 6.0

#: Degrees of freedom of the noise as Student's t [-]: heat differs from its law by far more than noise does.
_FREEDOM = 3.0


def sudden_part(heat: FloatArray, known: BoolArray, hours: float, step: float) -> FloatArray:
    """Heat less its running median, 0 where it is not known, shape (n_time, n_zone) [W].

    Parameters
    ----------
    heat : ndarray, shape (n_time, n_zone)
        Beyond a model [W].
    known : ndarray of bool, shape (n_time, n_zone)
        Where it is.
    hours : float
        Of the median [h].
    step : float
        Of the telemetry [s].
    """
    slow = pd.DataFrame(heat).rolling(max(3, round(hours * 3600.0 / step)), center=True, min_periods=1).median()
    return np.where(known, heat - slow.to_numpy(), 0.0)


def noise_of(sudden: FloatArray, unit: FloatArray) -> float:
    """Size of what is sudden and no member's of a family: of that which has the other sign [W].

    Parameters
    ----------
    sudden : ndarray, shape (n_known,)
        Heat of a zone less what is slow [W].
    unit : ndarray, shape (n_known,)
        Heat of a member of size 1 [W per size].
    """
    size = np.abs(sudden[sudden * unit < 0.0])
    if not size.size:
        return 1e-6
    return max(1.4826 * float(np.median(size)), float(np.quantile(size, 0.9)) / _NINETY, 1e-6)


def log_odds(sudden: FloatArray, known: BoolArray, unit: FloatArray, sizes: FloatArray, noise: float) -> FloatArray:
    """Logarithm of the likelihood of being on over that of being off, by step and size, (n_time, n_size) [-].

    Parameters
    ----------
    sudden : ndarray, shape (n_time,)
        Heat of a zone less what is slow [W].
    unit : ndarray, shape (n_time,)
        Heat of a member of size 1 [W per size].
    known : ndarray of bool, shape (n_time,)
        Where the heat is.
    sizes : ndarray, shape (n_size,)
        That are tried [-].
    noise : float
        Deviation of what is sudden [W].
    """
    first = sudden[:, None]
    off, on = (1.0 + (e / noise) ** 2 / _FREEDOM for e in (first, first - sizes * unit[:, None]))
    more = 0.5 * (_FREEDOM + 1.0) * np.log(off / on)
    return np.where(known[:, None], np.clip(more, -_MOST, _MOST), 0.0)


class Courses(NamedTuple):
    """Most likely courses of each zone whose heat is known for a day at least.

    Parameters
    ----------
    zones : ndarray of int, shape (n_zone,)
        Which.
    sudden : ndarray, shape (n_time, n_all)
        Heat of all zones less what is slow [W].
    noise : ndarray, shape (n_zone,)
        Deviation of what is sudden [W].
    paths : ndarray, shape (n_time, n_zone, n_size)
        The courses, 1 while on [-].
    gains : ndarray, shape (n_zone, n_size)
        What each gains in log-likelihood over one that stays 0 [-].
    """

    zones: IntArray
    sudden: FloatArray
    noise: FloatArray
    paths: FloatArray
    gains: FloatArray


def likely_courses(
    heat: FloatArray, unit: FloatArray, sizes: FloatArray, hours: float, step: float, on: FloatArray, off: float
) -> Courses:
    """Find when heat of each zone is on, for each of some sizes that it may have.

    Parameters
    ----------
    heat : ndarray, shape (n_time, n_all)
        Beyond a model [W]; NaN where it is not known.
    unit : ndarray, shape (n_time, n_all)
        Heat of a member of size 1 [W per size].
    sizes : ndarray, shape (n_size,)
        That are tried [-].
    hours : float
        Of the running median that is slow [h].
    step : float
        Of the telemetry [s].
    on : ndarray, shape (n_time,)
        How often it is switched on [1/h].
    off : float
        How often it is switched off [1/h].
    """
    hour, known = max(1.0, 3600.0 / step), np.isfinite(heat)
    sudden, zones = sudden_part(heat, known, hours, step), np.flatnonzero(known.sum(axis=0) >= 24 * hour)
    noise = np.array([noise_of(sudden[known[:, k], k], unit[known[:, k], k]) for k in zones])
    odds = [log_odds(sudden[:, k], known[:, k], unit[:, k], sizes, n) for k, n in zip(zones, noise, strict=True)]
    none = np.empty((len(heat), 0))
    paths, gains = most_likely_paths(np.hstack([none, *odds]), on / hour, min(off / hour, 0.5))
    shape = zones.size, sizes.size
    return Courses(zones, sudden, noise, paths.reshape(len(heat), *shape), gains.reshape(shape))


def most_likely_paths(odds: FloatArray, opens: FloatArray, shuts: float) -> tuple[FloatArray, FloatArray]:
    """Most likely courses of hidden states that are 0 or 1 each (Viterbi 1967).

    Parameters
    ----------
    odds : ndarray, shape (n_time, m)
        Logarithm of the likelihood of state 1 over that of state 0, step by step [-].
    opens : ndarray, shape (n_time,)
        Probability of the change from 0 to 1 [-].
    shuts : float
        Probability of the change from 1 to 0 [-].

    Returns
    -------
    tuple
        The courses, shape (n_time, m); and what each gains in log-likelihood over a state that stays 0, (m,) [-].
    """
    to_open, stay_shut, to_shut, stay_open = np.log(opens), np.log1p(-opens), np.log(shuts), np.log1p(-shuts)
    previous = np.zeros((2, *odds.shape), dtype=bool)
    shut, open_ = np.zeros(odds.shape[1]), np.full(odds.shape[1], -np.inf)
    for k in range(len(odds)):
        from_shut, from_open = shut + stay_shut[k], open_ + to_shut
        opening, staying = shut + to_open[k], open_ + stay_open
        previous[0, k], previous[1, k] = from_open > from_shut, staying > opening
        shut, open_ = np.maximum(from_shut, from_open), np.maximum(opening, staying) + odds[k]
    state = open_ > shut
    paths = np.zeros(odds.shape)
    for k in range(len(odds) - 1, -1, -1):
        paths[k] = state
        state = np.where(state, previous[1, k], previous[0, k])
    return paths, np.maximum(shut, open_) - stay_shut.sum()
