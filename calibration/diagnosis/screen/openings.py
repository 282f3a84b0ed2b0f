"""Windows that people open: when one is seen to stand open in the heat that a zone loses beyond its model.

An open window is a conductance to outdoor that comes and goes at a stroke, a few times a day and while people are
there. The heat that a model of the case needs to follow the measured temperatures, step by step, is set against that
which was metered; a hidden Markov model of two states says when the difference is that of a window of one size.
"""

import numpy as np

from calibration.diagnosis.screen.two_states import likely_courses
from thermal._types import FloatArray

#: How often a window is opened while people are there and while nobody is, and shut again [1/h].
_OPENED, _OPENED_ALONE, _SHUT = 1.0 / 8.0, 1.0 / 200.0, 1.0

#: What changes slower is no opening [h]. What is seen by the first may be likelier by the second: in warm weather
#: windows stand open for hours, which a median over a third of a day takes for something slow.
_SLOW = (8.0, 24.0)

#: Areas that an opening may have [m2].
_AREAS = np.geomspace(0.1, 6.0, 14)

#: Gain in log-likelihood from which openings are there, the most of the time that they may last, and the least of it
#: that people are there [-].
_SEEN, _LONGEST, _PRESENT = 100.0, 0.25, 0.75


def opened_when(lost: FloatArray, unit: FloatArray, presence: FloatArray, step: float) -> FloatArray:
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
    there, opened, best = presence > 0.05, np.zeros(lost.shape), np.full(lost.shape[1], _SEEN)
    for hours in _SLOW:
        found = likely_courses(lost, unit, _AREAS, hours, step, np.where(there, _OPENED, _OPENED_ALONE), _SHUT)
        for k, mine, gained in zip(found.zones, np.moveaxis(found.paths, 1, 0), found.gains, strict=True):
            often = (mine.mean(axis=0) < _LONGEST) & (mine[there].sum(axis=0) > _PRESENT * mine.sum(axis=0))
            likely = np.where(often, gained, -np.inf)
            if likely.max() > best[k] and (hours == _SLOW[0] or best[k] > _SEEN):
                opened[:, k], best[k] = mine[:, np.argmax(likely)], likely.max()
    return opened
