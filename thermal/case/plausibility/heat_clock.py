"""Meters of heat whose clock is not that of the temperatures: zones answer to heat before it is told, or long after."""

from collections.abc import Iterator

import numpy as np

from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.case.metered_heat import HEAT_POINTS
from thermal.case.plausibility.anomaly import Anomaly

#: Errors of a clock that are looked for [s]; at least two steps.
MOST = 7200.0

#: Time after heat within which a zone may begin to warm up where no clock is wrong [s], and least number of steps. Not
#: fitted: means over a step answer half a step late, hot water takes minutes from its meter to a radiator, and of lags
#: one after another (a heater's body, a sensor in its case) the answer is largest up to 25 minutes late.
LATE, LEAST_LATE = 1800.0, 1

#: Least correlation of a zone's answer with heat [-], and times as much as without an error of the clock. Chosen on a
#: house whose clock is 36 minutes off (0.72 there, 0.12 as it is) and 168 cases without such an error, of five makers
#: and five measured buildings: elsewhere than after 0 or 1 steps they have at most 1.05 times as much, where a heater
#: goes on and off with a period of its own, but for a hotel (0.27 and 0.12), few of whose zones agree.
LEAST, TIMES = 0.2, 1.5

#: Steps that are needed [-]: two days of hours.
LEAST_STEPS = 48


def heat_clock_errors(case: Case) -> Iterator[Anomaly]:
    """Find meters of heat that all run ahead of or behind the zones' temperatures.

    Parameters
    ----------
    case
        Case.

    Yields
    ------
    Anomaly
        ``heat clock``, one at the most.

    Notes
    -----
    A change of heat bends the course of a temperature where it takes effect: the change of heat from a step to the next
    is correlated with the second difference of the zone's temperature, for each error of a clock, which neither sun
    nor weather nor the slow part of the answer disturb much. A first-order lag leaves the largest correlation where it
    is and lessens it; several of them move it by less than `LATE`.
    """
    answers = _answers(case)
    if not len(answers):
        return
    middle = answers.shape[1] // 2
    mean = answers.mean(axis=0)
    steps = int(np.argmax(mean)) - middle
    own = np.argmax(answers, axis=1) - middle
    natural = max(LEAST_LATE, round(LATE / case.step))
    as_it_is = mean[middle : middle + natural + 1].max()
    alike = 2 * int((np.abs(own - steps) <= 1).sum()) > len(own)
    if 0 <= steps <= natural or mean[middle + steps] < max(LEAST, TIMES * as_it_is) or not alike:
        return
    devices = {device.name for device in case.building.devices if device.zone}
    told = (c for c in map(str, case.telemetry.frame) if c.endswith(HEAT_POINTS))
    columns = tuple(c for c in told if c.partition("/")[0] in devices)
    minutes = steps * case.step / 60.0
    rooms = f"{len(answers)} zone{'s' * (len(answers) > 1)}"
    what = (
        f"zones answer to heat {abs(minutes):.0f} min {'after' if steps > 0 else 'before'} it is told: the correlation "
        f"is {mean[middle + steps]:.2f} there, {as_it_is:.2f} without an error of the clock (mean of {rooms})"
    )
    advice = f"see whether the clock of the meters is off, and move the stamps of heat by {minutes:+.0f} min"
    ends = case.stamps[0], case.stamps[-1]
    yield Anomaly("heat clock", "warning", "likely", columns, *ends, what, advice, minutes / 60.0)


def _answers(case: Case) -> FloatArray:
    """Correlation of zones' second differences with earlier and later changes of heat, shape (n_zone, n_error)."""
    temperatures, heat = case.zone_temperatures(), case.zone_heat()
    most = max(2, round(MOST / case.step))
    found = []
    for zone in temperatures:
        bends = np.diff(temperatures[zone].to_numpy(dtype=float), n=2)
        changes = np.diff(heat[zone].to_numpy(dtype=float))[1:]
        if len(bends) > 2 * most and np.nanmax(np.abs(changes), initial=0.0) > 0.0:
            found.append(_correlations(bends, changes, most))
    answers = np.array(found, dtype=float).reshape(len(found), 2 * most + 1)
    return np.asarray(answers[np.isfinite(answers).all(axis=1)])


def _correlations(late: FloatArray, early: FloatArray, most: int) -> FloatArray:
    """Correlation of a series with another, from `most` steps later to as many earlier; NaN where few steps have both.

    Sums over what both know at each distance are convolutions.
    """
    from scipy.signal import correlate  # here: scipy.signal takes a second to import

    known = [np.isfinite(series) for series in (late, early)]
    if min(map(np.sum, known)) < LEAST_STEPS:
        return np.full(2 * most + 1, np.nan)
    told = zip((late, early), known, strict=True)
    a, b = (np.where(k, series - series[k].mean(), 0.0) / max(series[k].std(), 1e-300) for series, k in told)
    here, there = (k.astype(float) for k in known)
    middle = len(late) - 1

    def sums(x: FloatArray, y: FloatArray) -> FloatArray:
        return np.asarray(correlate(x, y, method="fft")[middle - most : middle + most + 1])

    count = sums(here, there)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_a, mean_b = sums(a, there) / count, sums(here, b) / count
        spread_a, spread_b = sums(a * a, there) / count - mean_a**2, sums(here, b * b) / count - mean_b**2
        r = (sums(a, b) / count - mean_a * mean_b) / np.sqrt(spread_a * spread_b)
    return np.where(count > LEAST_STEPS - 0.5, r, np.nan)
