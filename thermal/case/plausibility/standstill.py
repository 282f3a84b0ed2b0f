"""Telemetry that stands still: columns that never change, or do not for longer than what they measure can."""

from collections.abc import Iterator

import numpy as np

from thermal.case.case import Case
from thermal.case.plausibility.anomaly import Anomaly, Certainty, Severity
from thermal.case.points import HEATING_POWER, OUTDOOR_TEMPERATURE, SUPPLY_FLOW, ZONE_TEMPERATURE
from thermal.case.quality import FLAT
from thermal.case.signal_faults import runs
from thermal.errors import some_of

#: What moves from hour to hour, out of doors and where people breathe: a day at one value, to the last digit, is no
#: measurement. Sun at night and calm are excepted by what they are: a whole day holds a noon, and calm is zero.
LIVELY = (
    OUTDOOR_TEMPERATURE, "wind_speed_sensor", "horizontal_infrared_irradiance_sensor",
    "global_horizontal_irradiance_sensor", "diffuse_horizontal_irradiance_sensor", "zone_air_co2_concentration_sensor",
    "zone_air_relative_humidity_sensor", "outside_air_relative_humidity_sensor",
)  # fmt: skip
LIVELY_SECONDS = 24 * 3600.0

#: Heat and flows can be held constant; three days at one value other than zero are worth a remark.
STEADY, STEADY_SECONDS = (HEATING_POWER, SUPPLY_FLOW), 72 * 3600.0

#: A logger that repeats its last row: no sensor of at least two changes for four hours, which a quiet night with
#: sensors of 0.5 K can have for one or two.
ROW_SECONDS, ROW_SENSORS = 4 * 3600.0, 2

#: Flat lines of a temperature (`thermal.case.signal_faults`) are named here when they are a day long together [s].
FLAT_SECONDS = 24 * 3600.0


def standstills(case: Case) -> Iterator[Anomaly]:
    """Find columns, and rows, that stand still.

    Parameters
    ----------
    case
        Case.

    Yields
    ------
    Anomaly
        ``standstill``: of all the telemetry, of a logger for some time, or of a column.
    """
    frame, step, stamps = case.telemetry.frame, case.step, case.stamps
    if len(stamps) * step < LIVELY_SECONDS:
        return
    seen = {str(c): frame[c].dropna().to_numpy(dtype=float) for c in frame}
    constant = [c for c, values in seen.items() if values.size and np.ptp(values) == 0.0]
    temperatures = [c for c in seen if c.endswith((f"/{ZONE_TEMPERATURE}", f"/{OUTDOOR_TEMPERATURE}")) and seen[c].size]
    if temperatures and {*temperatures} <= {*constant}:
        what = f"all temperatures stand still: {some_of(temperatures)} never change"
        advice = "export the telemetry anew: there is nothing to fit"
        yield Anomaly("standstill", "error", "certain", tuple(constant), stamps[0], stamps[-1], what, advice)
        return
    yield from _repeated_rows(case, [c for c in temperatures if c not in constant])
    for column, values in seen.items():
        point = column.rpartition("/")[2]
        limit = LIVELY_SECONDS if point in LIVELY else STEADY_SECONDS if point in STEADY else np.inf
        if point == ZONE_TEMPERATURE:
            yield from _flat_temperature(case, column, column in constant)
        elif values.size and np.isfinite(limit):
            series = frame[column].to_numpy(dtype=float)
            held = np.concatenate(([False], series[1:] == series[:-1]))
            calm = (series == 0.0) & (point in STEADY or point == "wind_speed_sensor")
            found = [(a - 1, b) for a, b in runs(held & ~calm) if (b - a + 2) * step >= limit]
            if found:
                first, last = max(found, key=lambda ends: ends[1] - ends[0])
                outdoor = point == OUTDOOR_TEMPERATURE and column in constant
                hours = (last - first + 1) * step / 3600.0
                what = f"{column} stands at one value for {hours:.0f} h" + (", all the telemetry" if outdoor else "")
                severity: Severity = "error" if outdoor else "remark" if point in STEADY else "warning"
                sure: Certainty = "certain" if point in LIVELY else "possible"
                advice = "blank that time" if point in LIVELY else "see whether it is measured or assumed"
                yield Anomaly("standstill", severity, sure, (column,), stamps[first], stamps[last], what, advice)


def _repeated_rows(case: Case, sensors: list[str]) -> Iterator[Anomaly]:
    """Find times when a logger wrote the same row again and again."""
    if len(sensors) < ROW_SENSORS:
        return
    values = case.telemetry.frame[sensors].to_numpy(dtype=float)
    present = np.isfinite(values).sum(axis=1) >= ROW_SENSORS
    same = ((values[1:] == values[:-1]) | ~np.isfinite(values[1:])).all(axis=1) & present[1:] & present[:-1]
    for first, last in runs(np.concatenate(([False], same))):
        seconds = (last - first + 1) * case.step
        if seconds >= ROW_SECONDS:
            start, end = case.stamps[first - 1], case.stamps[last]
            what = f"all {len(sensors)} temperatures repeat themselves for {seconds / 3600:.0f} h"
            advice = "the logger stood still, or gaps were filled: blank that time"
            yield Anomaly("standstill", "warning", "certain", tuple(sensors), start, end, what, advice)


def _flat_temperature(case: Case, column: str, constant: bool) -> Iterator[Anomaly]:
    """Find a zone's temperature that is stuck, all the time or for a day together."""
    flats = [f for name, f in case.quality if name == column and f.kind == FLAT]
    hours = sum(f.steps for f in flats) * case.step / 3600.0
    stamps, advice = case.stamps, "look at the sensor; those times are left out of fits"
    if constant:
        what = f"{column} never changes"
        yield Anomaly("standstill", "warning", "certain", (column,), stamps[0], stamps[-1], what, advice)
    elif hours * 3600.0 >= FLAT_SECONDS:
        longest = max(flats, key=lambda f: f.steps)
        what = f"{column} is stuck for {hours:.0f} h, in {len(flats)} parts of which this is the longest"
        yield Anomaly("standstill", "warning", "likely", (column,), longest.start, longest.end, what, advice)
