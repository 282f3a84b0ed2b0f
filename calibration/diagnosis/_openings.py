"""Windows that people open: when one is seen to stand open in the heat that a zone loses beyond its model.

An open window is a conductance to outdoor that comes and goes at a stroke, a few times a day and while people are
there. The heat that the model of the case needs to follow the measured temperatures, step by step and with every
parameter at its start (calibration would hide part of it), is set against that which was metered; a hidden Markov model
of two states says when the difference is that of a window of one size.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from calibration._heat_balance import step_balance
from calibration._settings import ModelSettings
from thermal import SymbolicModel, reduced_model, replay_inputs
from thermal.signals import Drivers

FloatArray = NDArray[np.float64]

#: Deviations within which 90 % of a normal distribution are [-].
_NINETY = 1.645

#: Zones beyond which none is sought: one more model of a large building would take its time.
_MOST_ZONES = 40

#: How often a window is opened while people are there and while nobody is, and shut again [1/h].
_OPENED, _OPENED_ALONE, _SHUT = 1.0 / 8.0, 1.0 / 200.0, 1.0

#: What changes slower is no opening [h].
_SLOW = 8.0

#: Areas that an opening may have [m2].
_AREAS = np.geomspace(0.1, 6.0, 14)

#: Most that one step may say for either state [-]: what lasts one step is noise of another kind.
_MOST = 6.0

#: Gain in log-likelihood from which openings are there, the most of the time that they may last, and the least of it
#: that people are there [-].
_SEEN, _LONGEST, _PRESENT = 100.0, 0.25, 0.75


def seen_openings(drivers: Drivers, settings: ModelSettings) -> FloatArray:
    """When a window is seen to stand open, shape (n_time, n_zone): 1 where one is.

    Parameters
    ----------
    drivers : Drivers
        Of the case.
    settings : ModelSettings
        How its model is built.
    """
    opened = np.zeros((len(drivers.stamps), len(drivers.zones)))
    if len(drivers.zones) > _MOST_ZONES:
        return opened
    network = settings.network(drivers.case.building)
    theta = np.array([p.start for p in network.parameters])
    inputs = replay_inputs(drivers.case, network, drivers)
    model = reduced_model(SymbolicModel(network), [theta])
    rows, metered, needed = step_balance(model, theta, inputs)
    unit = -network.anatomy.air_heat_capacity * drivers.through_windows[rows]
    for k in range(len(drivers.zones)):
        opened[rows, k] = _opened_when((metered - needed)[:, k], unit[:, k], drivers.occupancy[rows], inputs.step)
    return opened


def _opened_when(lost: FloatArray, unit: FloatArray, presence: FloatArray, step: float) -> FloatArray:
    """When a window of one zone stands open; never where what is lost does not look like one that people open.

    Parameters
    ----------
    lost : ndarray, shape (n_time,)
        Metered heat less that which the zone's model needs [W]; NaN where it is not known.
    unit : ndarray, shape (n_time,)
        Heat that a window of 1 m2 lets out [W/m2].
    presence : ndarray, shape (n_time,)
        Of people, between 0 and 1 [-].
    step : float
        Of the telemetry [s].

    Returns
    -------
    ndarray, shape (n_time,)
        1 where one stands open [-].
    """
    hour = max(1.0, 3600.0 / step)
    known = np.isfinite(lost)
    slow = pd.Series(lost).rolling(max(3, round(_SLOW * hour)), center=True, min_periods=1).median()
    sudden = np.where(known, lost - slow.to_numpy(), 0.0)
    size = np.abs(sudden[known])
    never = np.zeros(len(lost))
    if size.size < 24 * hour:
        return never
    noise = max(1.4826 * float(np.median(size)), float(np.quantile(size, 0.9)) / _NINETY, 1e-6)
    there = presence > 0.05
    opens, shuts = np.where(there, _OPENED, _OPENED_ALONE) / hour, min(_SHUT / hour, 0.5)
    best, most = never, _SEEN
    for area in _AREAS:
        odds = (sudden**2 - (sudden - area * unit) ** 2) / (2.0 * noise**2)
        path, gain = _most_likely_path(np.where(known, np.clip(odds, -_MOST, _MOST), 0.0), opens, shuts)
        if gain > most and path.mean() < _LONGEST and path[there].sum() > _PRESENT * path.sum():
            best, most = path, gain
    return best


def _most_likely_path(odds: FloatArray, opens: FloatArray, shuts: float) -> tuple[FloatArray, float]:
    """Most likely course of a hidden state that is 0 or 1 (Viterbi 1967).

    Parameters
    ----------
    odds : ndarray, shape (n_time,)
        Logarithm of the likelihood of state 1 over that of state 0, step by step [-].
    opens : ndarray, shape (n_time,)
        Probability of the change from 0 to 1 [-].
    shuts : float
        Probability of the change from 1 to 0 [-].

    Returns
    -------
    tuple
        The course, shape (n_time,); and what it gains in log-likelihood over a state that stays 0 [-].
    """
    to_open, stay_shut, to_shut, stay_open = np.log(opens), np.log1p(-opens), np.log(shuts), np.log1p(-shuts)
    came = np.zeros((len(odds), 2), dtype=np.int8)
    shut, open_ = 0.0, -np.inf
    for k in range(len(odds)):
        from_shut, from_open = shut + stay_shut[k], open_ + to_shut
        opening, staying = shut + to_open[k], open_ + stay_open
        came[k] = from_open > from_shut, staying > opening
        shut, open_ = max(from_shut, from_open), max(opening, staying) + odds[k]
    state = int(open_ > shut)
    gain = max(shut, open_) - float(stay_shut.sum())
    path = np.zeros(len(odds))
    for k in range(len(odds) - 1, -1, -1):
        path[k] = state
        state = int(came[k, state])
    return path, float(gain)
