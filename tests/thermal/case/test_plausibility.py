"""Each way of spoiling a case is found and named; the unspoiled case is clean, or odd in a way that is real."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from calibration import calibrate, diagnose
from mpc.cli.app import app
from thermal import load_bundled_case
from thermal.case.building import Device
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.plausibility.anomaly import Anomaly
from thermal.case.plausibility.examine import check_calibratable, examine
from thermal.case.save import save_case
from thermal.case.telemetry import Telemetry
from thermal.errors import CaseError

SHARED = Path(__file__).parents[3].parent / "shared" / "cases"
OUTDOOR = "weather_station/outside_air_temperature_sensor"
Spoil = Callable[[pd.DataFrame, Case], pd.DataFrame]

#: What is odd in measured cases: night offset of the pyranometer, stamps an hour late.
REAL = {"measured_armadillo": {"night offset"}, "measured_lboro": {"clock"}}


@cache
def case_of(name: str) -> Case:
    if name == "bundled":
        return load_bundled_case()
    if not (SHARED / name).is_dir():
        pytest.skip(f"{name} is not here")
    return load_case(SHARED / name)


def spoilt(name: str, spoil: Spoil) -> tuple[Anomaly, ...]:
    case = case_of(name)
    building = case.building
    frame = spoil(case.telemetry.frame.copy(), case)
    if "AHU2/outside_air_temperature_sensor" in frame:
        building = replace(building, devices=(*building.devices, Device(name="AHU2", type="ahu")))
    return examine(Case(building, Telemetry.from_frame(frame)))


def columns(frame: pd.DataFrame, *parts: str) -> list[str]:
    return [c for c in map(str, frame) if any(part in c for part in parts)]


def scaled(part: str, factor: float) -> Spoil:
    def spoil(frame: pd.DataFrame, _: Case) -> pd.DataFrame:
        frame[columns(frame, part)] *= factor
        return frame

    return spoil


def without(*parts: str) -> Spoil:
    return lambda frame, _: frame.drop(columns=columns(frame, *parts))


def set_to(values: Callable[[pd.DataFrame], pd.Series | pd.DataFrame | np.ndarray], name: str) -> Spoil:
    def spoil(frame: pd.DataFrame, case: Case) -> pd.DataFrame:
        frame[name.format(zone=case.building.zone_names[0])] = values(frame)
        return frame

    return spoil


def exchanged(frame: pd.DataFrame, case: Case) -> pd.DataFrame:
    zones = [
        c for c in columns(frame, "zone_air_temperature") if c.split("/")[0] not in case.building.measured_boundaries
    ]
    pair = zones[:2] if len(case.building.zone_names) == 9 else [zones[0], zones[2]]
    pair = ["T01/zone_air_temperature_sensor", "T03/zone_air_temperature_sensor"] if "T01" in zones[0] else pair
    frame[pair] = frame[pair[::-1]].to_numpy()
    return frame


def with_outdoors(frame: pd.DataFrame, _: Case) -> pd.DataFrame:
    pair = [columns(frame, "zone_air_temperature")[0], OUTDOOR]
    frame[pair] = frame[pair[::-1]].to_numpy()
    return frame


def constant(frame: pd.DataFrame, _: Case) -> pd.DataFrame:
    return frame * 0.0 + frame.mean()


def later(hours: float) -> Spoil:
    return lambda frame, _: frame.set_axis(frame.index + pd.Timedelta(hours=hours), axis=0)


def slipped(frame: pd.DataFrame, case: Case) -> pd.DataFrame:
    half = len(frame) // 2
    frame.iloc[half:] = frame.shift(round(3600.0 / case.step)).iloc[half:].to_numpy()
    return frame


def at_night(frame: pd.DataFrame, _: Case) -> pd.DataFrame:
    frame[columns(frame, "normal_irradiance", "horizontal_irradiance")] += 6.0
    return frame


def no_sun(frame: pd.DataFrame, _: Case) -> pd.DataFrame:
    frame[columns(frame, "normal_irradiance", "horizontal_irradiance")] = 0.0
    return frame


def repeated(frame: pd.DataFrame, case: Case) -> pd.DataFrame:
    first = len(frame) // 3
    frame.iloc[first : first + round(20 * 3600.0 / case.step)] = frame.iloc[first].to_numpy()
    return frame


def stuck(frame: pd.DataFrame, _: Case) -> pd.DataFrame:
    column, third = columns(frame, "zone_air_temperature")[0], len(frame) // 3
    frame.loc[frame.index[third : 2 * third], column] = frame[column].iloc[third]
    return frame


def in_fahrenheit(frame: pd.DataFrame, _: Case) -> pd.DataFrame:
    zones = columns(frame, "zone_air_temperature")
    frame[zones] = (frame[zones] - 273.15) * 1.8 + 32.0 + 273.15
    return frame


def noise(frame: pd.DataFrame) -> np.ndarray:
    return np.random.default_rng(0).random(len(frame))


SPOILS: dict[str, tuple[Spoil, str, str]] = {
    "exchanged": (exchanged, "exchanged", "warning"),
    "exchanged with the outdoors": (with_outdoors, "exchanged", "warning"),
    "constant": (constant, "standstill", "error"),
    "an hour late": (later(1.0), "clock", "warning"),
    "an hour early": (later(-1.0), "clock", "warning"),
    "slipped in the middle": (slipped, "clock", "warning"),
    "6 W/m2 at night": (at_night, "night offset", "warning"),
    "no sun": (no_sun, "standstill", "warning"),
    "logger repeats": (repeated, "standstill", "warning"),
    "stuck sensor": (stuck, "standstill", "warning"),
    "degF": (in_fahrenheit, "unit", "warning"),
    "CO2": (set_to(lambda f: (237.0 + 200.0 * noise(f)) * 1e-6, "{zone}/zone_air_co2_concentration_sensor"), "range", "warning"),
    "humidity": (set_to(lambda f: 0.003 + 0.001 * noise(f), "{zone}/zone_air_relative_humidity_sensor"), "unit", "warning"),
    "two outdoor sensors": (
        set_to(lambda f: f[OUTDOOR] + 2.9, "AHU2/outside_air_temperature_sensor"), "disagreement", "warning",
    ),
    "no heat": (without("flowrate", "heating_power"), "no heat", "error"),
    "no outdoor temperature": (without("outside_air"), "no outdoor temperature", "error"),
    "no zone temperature": (without("zone_air_temperature"), "no zone temperature", "error"),
}  # fmt: skip
UNITS: dict[str, tuple[str, Spoil, str, str]] = {
    "flows x 3600": ("bundled", scaled("flowrate", 3600.0), "unit", "error"),
    "flows / 3600": ("bundled", scaled("flowrate", 1 / 3600.0), "unit", "warning"),
    "flows x 3600, one device": ("twinhouse_N2_exp1", scaled("flowrate", 3600.0), "unit", "error"),
    "kW": ("measured_lboro", scaled("heating_power", 1e-3), "heat", "warning"),
    "W as kW": ("measured_quebec9zone", scaled("heating_power", 1e3), "heat", "error"),
}


@pytest.mark.parametrize("name", ["bundled", "measured_quebec9zone"])
@pytest.mark.parametrize("spoil", SPOILS)
def test_each_spoil_is_found(name: str, spoil: str) -> None:
    change, kind, severity = SPOILS[spoil]
    if spoil == "no zone temperature" and name == "measured_quebec9zone":
        pytest.skip("one case is enough")
    found = spoilt(name, change)
    named = [anomaly for anomaly in found if anomaly.kind == kind]
    assert named, found
    assert severity in {anomaly.severity for anomaly in named}
    for anomaly in named:
        assert anomaly.what and anomaly.advice and anomaly.start <= anomaly.end


@pytest.mark.parametrize("spoil", UNITS)
def test_each_wrong_unit_is_found(spoil: str) -> None:
    name, change, kind, severity = UNITS[spoil]
    assert (kind, severity) in {(anomaly.kind, anomaly.severity) for anomaly in spoilt(name, change)}


def test_the_bundled_case_is_clean() -> None:
    assert examine(case_of("bundled")) == ()


@pytest.mark.parametrize("name", sorted(p.name for p in SHARED.glob("*") if p.is_dir()) or ["none"])
def test_shared_cases_are_clean_but_for_what_is_real(name: str) -> None:
    found = examine(case_of(name))
    assert {anomaly.kind for anomaly in found} == REAL.get(name, set())


def test_a_slip_is_placed_where_it_is() -> None:
    case = case_of("bundled")
    (clock,) = [anomaly for anomaly in spoilt("bundled", slipped) if anomaly.kind == "clock"]
    middle = case.stamps[len(case.stamps) // 2]
    assert abs(clock.start - middle) <= pd.Timedelta(days=1) and clock.end == case.stamps[-1]
    assert "moved by -1 h" in clock.what and clock.certainty == "certain"


def test_check_and_calibrate_say_what_cannot_be_fitted(tmp_path: Path) -> None:
    case = case_of("bundled")
    frame = scaled("flowrate", 3600.0)(case.telemetry.frame.copy(), case)
    folder = save_case(Case(case.building, Telemetry.from_frame(frame)), tmp_path / "kgh")
    answer = CliRunner().invoke(app, ["check", str(folder)])
    assert answer.exit_code == 0 and "not valid for calibration" in answer.stdout and "kg/h" in answer.stdout
    answer = CliRunner().invoke(app, ["calibrate", str(folder), "--out", str(tmp_path / "out")])
    assert answer.exit_code == 2 and "valid for calibration" in answer.stderr
    for refuse in (check_calibratable, calibrate, diagnose):
        with pytest.raises(CaseError, match="valid for calibration"):
            refuse(load_case(folder))
