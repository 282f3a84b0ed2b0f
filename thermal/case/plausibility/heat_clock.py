"""Meters of heat whose clock is not that of the temperatures: zones answer to heat before it is told, or long after."""

from collections.abc import Iterator

import numpy as np

from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.case.emitters import is_heater
from thermal.case.plausibility.anomaly import Anomaly
from thermal.case.points import DISCHARGE_TEMPERATURE, HEATING_POWER, SUPPLY_FLOW

#: Errors of a clock that are looked for [s]; at least two steps.
MOST = 7200.0

#: Steps after heat up to which a zone may begin to warm up where no clock is wrong [-]: means over a step answer half a
#: step late, and a sensor, a radiator or a slab that lags answers at once, if only in part.
NATURAL = 1

#: Time that hot water may take from a meter to what it heats [s], where devices do not say that they are electric or
#: bring air. Not fitted: a litre for a metre of pipe and a radiator's least flow of 1 to 2 l/min make minutes.
BY_WATER = 1800.0

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
    is and lessens it.
    """
    answers = _answers(case)
    if not len(answers):
        return
    middle = answers.shape[1] // 2
    mean = answers.mean(axis=0)
    steps = int(np.argmax(mean)) - middle
    own = np.argmax(answers, axis=1) - middle
    water = any(is_heater(device) and not device.type.startswith("electric") for device in case.building.devices)
    natural = max(NATURAL, round(BY_WATER / case.step) if water else 0)
    as_it_is = mean[middle : middle + natural + 1].max()
    alike = 2 * int((np.abs(own - steps) <= 1).sum()) > len(own)
    if 0 <= steps <= natural or mean[middle + steps] < max(LEAST, TIMES * as_it_is) or not alike:
        return
    points = (HEATING_POWER, SUPPLY_FLOW, DISCHARGE_TEMPERATURE)
    devices = {device.name for device in case.building.devices if device.zone}
    columns = tuple(c for c in map(str, case.telemetry.frame) if c.partition("/")[0] in devices and c.endswith(points))
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
        bends = np.diff(temperatures[zone].to_numpy(dtype=float), n=2)[most:-most]
        changes = np.diff(heat[zone].to_numpy(dtype=float))[1:]
        if len(bends) < LEAST_STEPS or not np.nanmax(np.abs(changes), initial=0.0) > 0.0:
            continue
        told = np.lib.stride_tricks.sliding_window_view(changes, len(bends))[::-1]  # a row an error, from -most on
        found.append([_correlation(bends, row) for row in told])
    answers = np.array(found, dtype=float).reshape(len(found), 2 * most + 1)
    return np.asarray(answers[np.isfinite(answers).all(axis=1)])


def _correlation(a: FloatArray, b: FloatArray) -> float:
    known = np.isfinite(a) & np.isfinite(b)
    if known.sum() < LEAST_STEPS:
        return float("nan")
    a, b = a[known] - a[known].mean(), b[known] - b[known].mean()
    scale = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / scale if scale > 0.0 else float("nan")
