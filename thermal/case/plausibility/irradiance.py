"""Irradiance against the sun's place: offsets at night, and clocks that are off, all the time or for a part of it."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.case.building import Location
from thermal.case.case import Case
from thermal.case.plausibility.anomaly import Anomaly, Certainty

GLOBAL, DIFFUSE = "global_horizontal_irradiance_sensor", "diffuse_horizontal_irradiance_sensor"
SOLAR = (GLOBAL, DIFFUSE, "direct_normal_irradiance_sensor")

#: Altitude of the sun below which it gives no light that a pyranometer sees [deg]: the end of civil twilight.
DARK = -6.0

#: Medians at night that a sound pyranometer reports [W/m2]: it cools to the sky and reads up to 7 W/m2 too little
#: (ISO 9060, zero offset A of class A); nothing makes it read more but its electronics, which resolve 1 to 2 W/m2.
LEAST_NIGHT, MOST_NIGHT = -7.0, 2.0

#: Least time of night [s].
LEAST_DARK = 6 * 3600.0

#: Errors of a clock that are looked for [h]: half hours up to three, whole hours up to twelve.
SHIFTS = tuple(sorted({0.5 * k for k in range(-6, 7)} | {float(h) for h in range(-12, 13)}))

#: Light that is too much: 1.3 times that of a clear sky (Haurwitz is good to 10 %; the edges of clouds add 10 to 20 %
#: to means over minutes) and 10 W/m2; beyond it by 50 W/m2 is a whole contradiction.
BRIGHTEST, SLACK, CONTRADICTION = 1.3, 10.0, 50.0

#: Light that is too little: under the thickest cloud a twentieth of that of a clear sky is left.
DARKEST = 0.05

#: Contradictions a change of the clock must explain [h], and a day [h]. One hour of error makes 0.6 to 1.9 hours of
#: them a day, which a change explains; of those of a sound clock it explains 0.02 (six buildings,
#: `docs/real_data.md`).
LEAST_EXPLAINED, LEAST_EXPLAINED_DAILY = 2.5, 0.35


def night_offsets(case: Case) -> Iterator[Anomaly]:
    """Find irradiance that is not zero at night.

    Parameters
    ----------
    case
        Case.

    Yields
    ------
    Anomaly
        ``night offset``, one a column.
    """
    weather = case.weather()
    present = [name for name in SOLAR if name in weather and weather[name].nunique() > 1]
    if not present:
        return
    night = _night(case)
    for name in present:
        dark = weather[name][night].dropna()
        offset = float(dark.median()) if len(dark) * case.step >= LEAST_DARK else 0.0
        if not LEAST_NIGHT <= offset <= MOST_NIGHT:
            column = f"{case.building.weather_station}/{name}"
            what = f"{column} is {offset:.1f} W/m2 at night (median of {len(dark) * case.step / 3600:.0f} h)"
            advice = f"take {offset:.1f} W/m2 off all of it, by day too"
            yield Anomaly("night offset", "warning", "certain", (column,), dark.index[0], dark.index[-1], what, advice)


def clock_errors(case: Case) -> Iterator[Anomaly]:
    """Find times when irradiance runs ahead of or behind the sun.

    Parameters
    ----------
    case
        Case.

    Yields
    ------
    Anomaly
        ``clock``, one a run of days with the same error.

    Notes
    -----
    For each error of `SHIFTS` and each day the hours are counted in which it is too light (above 1.3 times a clear
    sky) or too dark (below a twentieth of it) for that place of the sun: what clouds do by day explains neither. The
    errors of successive days that contradict the sun least, at `LEAST_EXPLAINED` a change, are found by dynamic
    programming, so that a slip in the middle of telemetry is seen as well as a wrong time zone. Clear sky: Haurwitz
    (1945) by pvlib.
    """
    weather = case.weather()
    name = next((n for n in (GLOBAL, DIFFUSE) if n in weather and weather[n].nunique() > 1), None)
    if name is None:
        return
    measured = weather[name]
    dark = measured[_night(case)].dropna()
    offset = float(dark.median()) if len(dark) else 0.0
    hours = contradictions(case.building.location, case.stamps, case.step, measured.to_numpy(dtype=float) - offset)
    days = pd.Index((case.stamps - pd.Timedelta(seconds=case.step / 2.0)).date)
    daily = pd.DataFrame(hours.T).groupby(days).sum().to_numpy()
    still = SHIFTS.index(0.0)
    path = _least_changes(daily, LEAST_EXPLAINED)
    cuts = np.flatnonzero(np.diff(path)) + 1
    dates = np.unique(days)
    for run in np.split(np.arange(len(path)), cuts):
        shift = SHIFTS[path[run[0]]]
        before, after = daily[run, still].sum(), daily[run, path[run[0]]].sum()
        explained = before - after
        enough = explained >= max(LEAST_EXPLAINED, LEAST_EXPLAINED_DAILY * len(run)) and after <= 0.5 * before
        if path[run[0]] == still or not enough:
            continue
        inside = case.stamps[(days >= dates[run[0]]) & (days <= dates[run[-1]])]
        whole = len(run) == len(path)
        where = "all the time" if whole else f"from {inside[0]:%Y-%m-%d} to {inside[-1]:%Y-%m-%d}"
        column = f"{case.building.weather_station}/{name}"
        what = (
            f"{column} fits the sun {where} if its stamps are moved by {shift:+g} h: as they are, it is light at night "
            f"or dark by day for {before:.1f} h, then for {after:.1f} h"
        )
        advice = "its time zone, or the end of the step that a stamp names, is wrong" if whole else (
            "a clock was put forward or back there (daylight-saving time): import it with --tz"
        )  # fmt: skip
        sure: Certainty = "certain" if explained >= 2.0 * LEAST_EXPLAINED_DAILY * len(run) else "likely"
        advice += "; see whether the other columns are off as well, and move the stamps"
        yield Anomaly("clock", "warning", sure, (column,), inside[0], inside[-1], what, advice, shift if whole else 0.0)


def contradictions(location: Location, stamps: pd.DatetimeIndex, step: float, measured: FloatArray) -> FloatArray:
    """Count how far irradiance contradicts the sun, for each error that its clock may have.

    Parameters
    ----------
    location
        Site.
    stamps
        Ends of the steps, shape (n_time,).
    step
        Their length [s].
    measured
        Global or diffuse horizontal irradiance, shape (n_time,) [W/m2]; NaN = missing.

    Returns
    -------
    ndarray
        Shape (n_shift, n_time) [h], errors as in `SHIFTS`: 0 to the length of a step.
    """
    margin = pd.Timedelta(seconds=max(map(abs, SHIFTS)) * 3600.0 + step)
    grid = pd.date_range(stamps[0] - margin, stamps[-1] + margin, freq="10min")
    clear = _clear_sky(location, grid)
    at = (grid - stamps[0]).total_seconds().to_numpy()
    sums = np.concatenate(([0.0], np.cumsum((clear[1:] + clear[:-1]) * 300.0)))
    ends = (stamps - stamps[0]).total_seconds().to_numpy()
    found = np.zeros((len(SHIFTS), len(stamps)))
    for k, shift in enumerate(SHIFTS):
        later = ends + 3600.0 * shift
        expected = (np.interp(later, at, sums) - np.interp(later - step, at, sums)) / step
        light = np.clip((measured - BRIGHTEST * expected - SLACK) / CONTRADICTION, 0.0, 1.0)
        least = np.maximum(DARKEST * expected, 1e-9)
        # A sky of under 50 W/m2 counts in proportion: there an error of the horizon is as large as the light.
        dark = np.clip(1.0 - measured / least, 0.0, 1.0) * np.clip(expected / CONTRADICTION, 0.0, 1.0)
        found[k] = np.nan_to_num(light + dark) * step / 3600.0
    return found


def _altitude(location: Location, times: pd.DatetimeIndex) -> FloatArray:
    from pvlib import solarposition  # here: pvlib takes a second to import

    place = solarposition.get_solarposition(times, location.latitude, location.longitude, location.elevation)
    return np.asarray(place["elevation"], dtype=float)


def _clear_sky(location: Location, times: pd.DatetimeIndex) -> FloatArray:
    from pvlib.clearsky import haurwitz

    return np.asarray(haurwitz(pd.Series(90.0 - _altitude(location, times)))["ghi"], dtype=float)


def _night(case: Case) -> np.ndarray:
    """Whether the sun is below `DARK` at both ends of each step."""
    ends = (_altitude(case.building.location, case.stamps - pd.Timedelta(seconds=s)) for s in (0.0, case.step))
    return np.asarray(np.maximum(*ends) < DARK)


def _least_changes(cost: FloatArray, change: float) -> list[int]:
    """Column for each row with the least sum of costs and changes (Viterbi)."""
    total, origins = cost[0], []
    for row in cost[1:]:
        best = int(np.argmin(total))
        moved = total[best] + change < total
        origins.append(np.where(moved, best, np.arange(len(total))))
        total = np.where(moved, total[best] + change, total) + row
    path = [int(np.argmin(total))]
    for origin in reversed(origins):
        path.append(int(origin[path[-1]]))
    return path[::-1]
