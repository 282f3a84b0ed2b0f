"""Windows that people open: when one is seen to stand open in the heat that a zone loses beyond its model.

An open window is a conductance to outdoor that comes and goes at a stroke, a few times a day and while people are
there. The heat that a model of the case needs to follow the measured temperatures, step by step, is set against that
which was metered; a hidden Markov model of two states says when the difference is that of a window of one size.
"""

import numpy as np
import pandas as pd

from calibration.estimation.heat_balance import step_balance
from calibration.evaluation.settings import ModelSettings
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.inputs.provider import InputProvider
from thermal.model.case_replay import Inputs, replay_inputs
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import reduced_model

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

#: Degrees of freedom of the noise as Student's t [-]: a window's heat differs from its law by far more than noise does.
_FREEDOM = 3.0

#: Gain in log-likelihood from which openings are there, the most of the time that they may last, and the least of it
#: that people are there [-].
_SEEN, _LONGEST, _PRESENT = 100.0, 0.25, 0.75


def seen_openings(case: Case, drivers: InputProvider, settings: ModelSettings) -> FloatArray:
    """When a window is seen to stand open before anything is fitted, shape (n_time, n_zone): 1 where one is.

    Parameters
    ----------
    case : Case
        With telemetry.
    drivers : InputProvider
        Its inputs.
    settings : ModelSettings
        How its model is built.
    """
    if len(drivers.zones) > _MOST_ZONES:
        return np.zeros((len(drivers.stamps), len(drivers.zones)))
    network = settings.network(case.building)
    theta = np.array([p.start for p in network.parameters])
    return openings_beyond(SymbolicModel(network), theta, drivers, replay_inputs(case, network, drivers))


def openings_beyond(grid: SymbolicModel, theta: FloatArray, drivers: InputProvider, inputs: Inputs) -> FloatArray:
    """When a window is seen to stand open in heat that is lost beyond a model, shape (n_time, n_zone): 1 where one is.

    Parameters
    ----------
    grid : SymbolicModel
        The model, whose windows are shut.
    theta : ndarray, shape (n_parameter,)
        Its parameters [parameter units].
    drivers : InputProvider
        Of the case.
    inputs : Inputs
        Its telemetry, as the model takes it.
    """
    opened = np.zeros((len(drivers.stamps), len(drivers.zones)))
    if len(drivers.zones) > _MOST_ZONES:
        return opened
    model = reduced_model(grid, [theta])
    rows, metered, needed = step_balance(model, theta, inputs)
    unit = -model.network.anatomy.air_heat_capacity * drivers.through_windows[rows]
    opened[rows] = _opened_when(metered - needed, unit, drivers.awake[rows], inputs.step)
    return opened


def _opened_when(lost: FloatArray, unit: FloatArray, presence: FloatArray, step: float) -> FloatArray:
    """When a window of a zone stands open; never where what is lost does not look like one that people open.

    Parameters
    ----------
    lost : ndarray, shape (n_time, n_zone)
        Metered heat less that which the zones' model needs [W]; NaN where it is not known.
    unit : ndarray, shape (n_time, n_zone)
        Heat that a window of 1 m2 lets out [W/m2].
    presence : ndarray, shape (n_time,)
        Of people, between 0 and 1 [-].
    step : float
        Of the telemetry [s].

    Returns
    -------
    ndarray, shape (n_time, n_zone)
        1 where one stands open [-].
    """
    hour = max(1.0, 3600.0 / step)
    known = np.isfinite(lost)
    slow = pd.DataFrame(lost).rolling(max(3, round(_SLOW * hour)), center=True, min_periods=1).median()
    sudden = np.where(known, lost - slow.to_numpy(), 0.0)
    opened = np.zeros(lost.shape)
    sought = np.flatnonzero(known.sum(axis=0) >= 24 * hour)
    if not sought.size:
        return opened
    there = presence > 0.05
    opens, shuts = np.where(there, _OPENED, _OPENED_ALONE) / hour, min(_SHUT / hour, 0.5)
    odds = []
    for k in sought:
        noise = _noise(sudden[known[:, k], k], unit[known[:, k], k])
        first = sudden[:, [k]]
        shut, open_ = (1.0 + (e / noise) ** 2 / _FREEDOM for e in (first, first - _AREAS * unit[:, [k]]))
        more = 0.5 * (_FREEDOM + 1.0) * np.log(shut / open_)
        odds.append(np.where(known[:, [k]], np.clip(more, -_MOST, _MOST), 0.0))
    paths, gains = _most_likely_paths(np.hstack(odds), opens, shuts)
    for k, mine, gained in zip(sought, np.split(paths, sought.size, axis=1), np.split(gains, sought.size), strict=True):
        often = (mine.mean(axis=0) < _LONGEST) & (mine[there].sum(axis=0) > _PRESENT * mine.sum(axis=0))
        likely = np.where(often, gained, -np.inf)
        if likely.max() > _SEEN:
            opened[:, k] = mine[:, np.argmax(likely)]
    return opened


def _noise(sudden: FloatArray, unit: FloatArray) -> float:
    """Size of what is sudden and no window's: of that which has the other sign [W]."""
    size = np.abs(sudden[sudden * unit < 0.0])
    if not size.size:
        return 1e-6
    return max(1.4826 * float(np.median(size)), float(np.quantile(size, 0.9)) / _NINETY, 1e-6)


def _most_likely_paths(odds: FloatArray, opens: FloatArray, shuts: float) -> tuple[FloatArray, FloatArray]:
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
