"""A clock of heat's meters is found from when zones answer; a lag is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from thermal import load_bundled_case
from thermal.case.building import Device
from thermal.case.case import Case
from thermal.case.plausibility.examine import examine
from thermal.case.plausibility.heat_clock import heat_clock_errors
from thermal.case.points import HEATING_POWER, ZONE_TEMPERATURE
from thermal.case.telemetry import Telemetry


def changed(case: Case, frame: pd.DataFrame) -> Case:
    return Case(case.building, replace(case.telemetry, frame=frame))


def temperatures(case: Case) -> list[str]:
    return [c for c in case.telemetry.frame if c.endswith(f"/{ZONE_TEMPERATURE}")]


@pytest.mark.parametrize("hours", [-1.5, -1.0, -0.75, 0.25, 0.5, 1.0, 1.5])
def test_a_clock_of_heat_that_is_off_is_found_to_the_step_and_put_right(hours: float) -> None:
    case = load_bundled_case()
    (seen,) = heat_clock_errors(case.with_heat_moved(hours))
    # what stamps have to be moved by is the error back; a step less where means over steps answer half a step late
    assert -hours - case.step / 3600.0 - 1e-9 <= seen.moved <= -hours + case.step / 3600.0 + 1e-9
    assert seen.certainty == "likely" and {c.partition("/")[0] for c in seen.columns} <= {
        d.name for d in case.building.devices
    }
    assert not list(heat_clock_errors(case.with_heat_moved(hours).with_heat_moved(-hours)))
    assert [a.kind for a in examine(case.with_heat_moved(hours)) if a.kind == "heat clock"] == ["heat clock"]


def test_nothing_is_found_where_no_clock_is_off() -> None:
    assert not list(heat_clock_errors(load_bundled_case()))


@pytest.mark.parametrize("minutes", [10.0, 25.0, 30.0])
def test_heat_may_take_half_an_hour_from_its_meter(minutes: float) -> None:
    assert not list(heat_clock_errors(load_bundled_case().with_heat_moved(-minutes / 60.0)))


@pytest.mark.parametrize(("each", "lags"), [(15.0, 2), (10.0, 3), (15.0, 3)])
def test_lags_one_after_another_are_no_clock(each: float, lags: int) -> None:
    """A heater's body and a sensor in its case, by closed form: a zone that answers to random heat, on exact clocks."""
    case = load_bundled_case()
    step, n = case.step, len(case.telemetry.frame)
    heat = 1500.0 * (np.random.default_rng(0).random(n // 9 + 1).repeat(9)[:n] < 0.5)
    answer = pd.Series(lfilter([step / 2e6], [1.0, -(1.0 - step / 4e4)], heat))
    for _ in range(lags):
        answer = answer.ewm(alpha=1.0 - np.exp(-step / (60.0 * each))).mean()
    devices = tuple(Device(name=f"HEATER_{z}", type="electric_heater", zone=z) for z in case.building.zone_names)
    kept = case.telemetry.frame[[c for c in case.telemetry.frame if c.startswith("weather_station/")]]
    told = {f"HEATER_{z}/{HEATING_POWER}": heat for z in case.building.zone_names}
    rooms = {f"{z}/{ZONE_TEMPERATURE}": 293.0 + answer.to_numpy() for z in case.building.zone_names}
    own = changed(replace(case, building=replace(case.building, devices=devices)), kept.assign(**told, **rooms))
    assert not list(heat_clock_errors(own))
    assert [a.moved for a in heat_clock_errors(own.with_heat_moved(1.0))]


def test_what_is_moved_is_heat_alone() -> None:
    case = load_bundled_case()
    before, after = case.telemetry.frame, case.with_heat_moved(-1.0).telemetry.frame
    moved = {str(c) for c in before if not before[c].equals(after[c])}
    assert moved and all(c.partition("/")[0] in {d.name for d in case.building.devices} for c in moved)
    assert not {c for c in moved if c.rpartition("/")[2].startswith("zone_") or c.endswith("_setpoint")}
    assert not {c for c in moved if c.rpartition("/")[2].startswith("outside_")}
    column, steps = sorted(moved)[0], round(3600.0 / case.step)
    np.testing.assert_array_equal(after[column].to_numpy()[:-steps], before[column].to_numpy()[steps:])


@pytest.mark.parametrize("minutes", [5.0, 10.0, 20.0, 40.0])
def test_a_lag_of_all_sensors_is_no_clock(minutes: float) -> None:
    case = load_bundled_case()
    frame, columns = case.telemetry.frame.copy(), temperatures(case)
    frame[columns] = frame[columns].ewm(alpha=1.0 - np.exp(-case.step / (60.0 * minutes))).mean()
    assert not list(heat_clock_errors(changed(case, frame)))


def test_one_meter_of_many_is_no_clock_of_all() -> None:
    case = load_bundled_case()
    frame, moved = case.telemetry.frame.copy(), case.with_heat_moved(-1.0).telemetry.frame
    one = next(d.name for d in case.building.devices if d.zone)
    own = [c for c in frame if c.startswith(f"{one}/")]
    frame[own] = moved[own]
    assert not list(heat_clock_errors(changed(case, frame)))


def test_heat_that_never_changes_and_short_telemetry_tell_nothing() -> None:
    case = load_bundled_case()
    frame = case.telemetry.frame.copy()
    told = [c for c in frame if c.endswith(("supply_air_flowrate_sensor", HEATING_POWER))]
    assert told
    still = frame.assign(**dict.fromkeys(told, 0.0))
    assert not list(heat_clock_errors(changed(case, still)))
    short = Telemetry(frame.iloc[:60], case.step, ())
    assert not list(heat_clock_errors(Case(case.building, short).with_heat_moved(-1.0)))
