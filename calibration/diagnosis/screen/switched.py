"""Heat that is switched on and off in a zone: a stove, a machine, a heater that nobody meters.

Such heat comes at a stroke, for a part of the day, at no hour of its own and in its own zone alone. What a model does
wrong comes by the clock, as set-backs do, and in many zones at a time.
"""

import numpy as np

from calibration.diagnosis.screen.two_states import likely_courses
from thermal._types import BoolArray, FloatArray

#: Step that the limits are for: finer telemetry is averaged [s]. Coarser says less, and by the hour nearly nothing.
_STEP = 300.0

#: What changes slower is not switched [h].
_SLOW = 24.0

#: How often heat is switched on, and off again [1/h].
_ON, _OFF = 1.0 / 24.0, 1.0 / 4.0

#: Powers that it may have [W].
_POWERS = np.geomspace(100.0, 6000.0, 14)

#: Gain in log-likelihood from which it is there, the most of the time that it may last, and its least size over the
#: noise of its zone [-]. Stoves in offices of a maker of its own gain from 700 on and have 2.9 and more of the noise;
#: 49 nulls of four makers have 329 at most, but for a house with up to 969 in three rooms at a time.
_SEEN, _LONGEST, _CLEAR = 400.0, 0.4, 2.5

#: Most of its course that the hour may tell, of any day or of the same weekday, and of its time that another zone may
#: share [-]: stoves have up to 0.08 and 0.19; what a wrong model needs by the clock, more.
_BY_CLOCK, _SHARED = 0.15, 0.25


def switched_when(brought: FloatArray, step: float) -> FloatArray:
    """When heat of a zone is on that its model does not know; never where it does not look switched.

    Parameters
    ----------
    brought : ndarray, shape (n_time, n_zone)
        Heat that the zones' model needs less that which is metered [W]; NaN where it is not known.
    step : float
        Of the telemetry [s].

    Returns
    -------
    ndarray, shape (n_time, n_zone)
        1 while it is on [-].
    """
    each = max(1, round(_STEP / step))
    if each > 1:  # the evidence of a step is that of five minutes
        whole = len(brought) // each * each
        on = switched_when(brought[:whole].reshape(-1, each, brought.shape[1]).mean(axis=1), each * step)
        return np.vstack([np.repeat(on, each, axis=0), np.zeros((len(brought) - whole, brought.shape[1]))])
    found = likely_courses(brought, np.ones(brought.shape), _POWERS, _SLOW, step, np.full(len(brought), _ON), _OFF)
    gains, on = np.where(found.paths.mean(axis=0) < _LONGEST, found.gains, -np.inf), np.zeros(brought.shape)
    best, every = np.argmax(gains, axis=1), np.arange(found.zones.size)
    likely, courses = gains[every, best], found.paths[:, every, best]
    for k, zone in enumerate(found.zones):
        course, own = courses[:, k] > 0.0, found.sudden[:, zone]
        if likely[k] > _SEEN and own[course].mean() - own[~course].mean() > _CLEAR * found.noise[k]:
            others = np.delete(courses, k, axis=1) > 0.0
            if _told_by_clock(courses[:, k], step) < _BY_CLOCK and _shared(course, others) < _SHARED:
                on[:, zone] = courses[:, k]
    return on


def _told_by_clock(course: FloatArray, step: float) -> float:
    """Share of a course's variance that the hour tells on other days, all or those a week apart, the larger [-]."""
    steps, hour = max(1, round(86400.0 / step)), max(1, round(3600.0 / step))
    days = course[: len(course) // steps * steps].reshape(-1, steps)
    found = [1.0] if len(days) < 2 else []
    for apart in (1, 7):
        groups = [days[k::apart] for k in range(apart)]
        groups = [group for group in groups if len(group) > 1]
        if groups:
            of = np.vstack(groups)
            others = np.vstack([(group.sum(axis=0) - group) / (len(group) - 1) for group in groups])
            told = np.array([np.convolve(day, np.full(hour, 1.0 / hour), "same") for day in others])
            found.append(1.0 - float(((of - told) ** 2).sum()) / max(float(((of - of.mean()) ** 2).sum()), 1e-12))
    return max(found)


def _shared(course: BoolArray, others: BoolArray) -> float:
    """Time that a course has in common with another over that of either, the most of all others [-]."""
    both, either = (np.sum(f(course[:, None], others), axis=0) for f in (np.logical_and, np.logical_or))
    return float(np.max(both / np.maximum(either, 1), initial=0.0))
