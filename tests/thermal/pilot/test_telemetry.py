"""The closed loop, on a plant of two nodes a zone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from thermal.case.building import Building, FloorPlans
from thermal.case.case import Case
from thermal.case.plan import zone_floor_areas
from thermal.case.telemetry import Telemetry
from thermal.errors import ThermalError
from thermal.pilot.building import devices, generate_office
from thermal.pilot.telemetry import TelemetrySettings, generate_telemetry
from thermal.pilot.thermostat import draw_thermostats
from thermal.pilot.weather import MOUNTAIN_VIEW, generate_weather

STATION = "weather_station/outside_air_temperature_sensor"


class TwoNodePlant:
    """Air and mass of each zone, implicit Euler; keeps the heat that it was given.

    Per floor area: 4 kJ/K/m2 of air, 150 kJ/K/m2 of mass, 9 W/K/m2 between them, 1 W/K/m2 from the air to outdoor.
    """

    def __init__(self, plans: FloorPlans, step_seconds: float = 300.0) -> None:
        areas = zone_floor_areas(plans)
        self.step_seconds = step_seconds
        self.zone_names = tuple(areas)
        self.area = np.array(list(areas.values()))
        self.given: list[np.ndarray] = []

    def reset(self, zone_temperatures: np.ndarray, /) -> np.ndarray:
        self.air, self.mass = zone_temperatures.copy(), zone_temperatures.copy()
        return self.air.copy()

    def step(self, zone_heat: np.ndarray, boundary_temperatures: np.ndarray, /) -> np.ndarray:
        self.given.append(zone_heat.copy())
        air, mass, link, loss = 4e3 / self.step_seconds, 1.5e5 / self.step_seconds, 9.0, 1.0
        through = link * mass / (mass + link)  # mass of the next step eliminated
        gain = zone_heat / self.area + loss * boundary_temperatures[0] + through * self.mass
        self.air = (air * self.air + gain) / (air + loss + through)
        self.mass = (mass * self.mass + link * self.air) / (mass + link)
        return self.air.copy()


@pytest.fixture(scope="module")
def plans() -> FloorPlans:
    return generate_office(2, floor_area=600.0, zones=12)


@pytest.fixture(scope="module")
def weather() -> pd.DataFrame:
    return generate_weather(2, start="2023-10-01", days=8)


@pytest.fixture(scope="module")
def exact(plans: FloorPlans, weather: pd.DataFrame) -> tuple[TwoNodePlant, Telemetry]:
    plant = TwoNodePlant(plans)
    return plant, generate_telemetry(
        plant, plans, weather, TelemetrySettings(seed=5, spin_up_days=1.0, noise=0.0, resolution=0.0)
    )


@pytest.fixture(scope="module")
def measured(plans: FloorPlans, weather: pd.DataFrame) -> tuple[TwoNodePlant, Telemetry]:
    plant = TwoNodePlant(plans)
    return plant, generate_telemetry(plant, plans, weather, TelemetrySettings(seed=5, spin_up_days=1.0))


def case_of(plans: FloorPlans, telemetry: Telemetry) -> Case:
    return Case(Building("test", MOUNTAIN_VIEW, 0.0, plans, devices(plans)), telemetry)


def points(telemetry: Telemetry, point: str) -> np.ndarray:
    return telemetry.frame.filter(regex=f"VAV_.*/{point}$").to_numpy()


def test_columns_and_clock(plans: FloorPlans, weather: pd.DataFrame, measured: tuple[TwoNodePlant, Telemetry]) -> None:
    plant, telemetry = measured
    assert telemetry.step == 300.0
    assert telemetry.frame.shape == (7 * 288, 7 + 5 * 12)
    assert len(plant.given) == 8 * 288
    assert str(telemetry.frame.index[0]) == "2023-10-02 00:05:00-08:00"
    assert not telemetry.frame.isna().any().any()
    for zone in plant.zone_names:
        assert {name.split("/")[1] for name in telemetry.frame if name.startswith(f"VAV_{zone}/")} == {
            "zone_air_temperature_sensor",
            "supply_air_flowrate_sensor",
            "discharge_air_temperature_sensor",
            "zone_air_heating_temperature_setpoint",
            "zone_air_cooling_temperature_setpoint",
        }
    pd.testing.assert_frame_equal(
        telemetry.frame[list(weather)], weather.iloc[288:], check_freq=False, check_index_type=False
    )


def test_metered_heat_is_the_plants_heat(plans: FloorPlans, exact: tuple[TwoNodePlant, Telemetry]) -> None:
    plant, telemetry = exact
    heat = case_of(plans, telemetry).zone_heat().to_numpy()
    assert np.allclose(heat, plant.given[288:], atol=2e-3)


def test_metered_heat_of_noisy_sensors_is_within_noise(
    plans: FloorPlans, measured: tuple[TwoNodePlant, Telemetry]
) -> None:
    plant, telemetry = measured
    case = case_of(plans, telemetry)
    error = case.zone_heat().to_numpy() - plant.given[288:]
    kelvin = error / (1006.0 * points(telemetry, "supply_air_flowrate_sensor"))
    # Two sensors of 0.03 K, each rounded to 0.02 K (uniform, 0.02/sqrt(12)).
    assert kelvin.std() == pytest.approx(np.sqrt(2.0 * (0.03**2 + 0.02**2 / 12.0)), rel=0.03)
    assert abs(kelvin.mean()) < 1e-3


def test_sensors(exact: tuple[TwoNodePlant, Telemetry], measured: tuple[TwoNodePlant, Telemetry]) -> None:
    """Noise is on what is reported only: the building itself goes the same way with and without."""
    assert np.array_equal(exact[0].given, measured[0].given)
    true, seen = (points(run[1], "zone_air_temperature_sensor") for run in (exact, measured))
    assert (seen - true).std() == pytest.approx(np.sqrt(0.03**2 + 0.02**2 / 12.0), rel=0.03)
    steps = (seen - 273.15) / 0.02
    assert np.allclose(steps, np.round(steps), atol=1e-6)
    for point in ("supply_air_flowrate_sensor", "zone_air_heating_temperature_setpoint"):
        assert np.array_equal(points(exact[1], point), points(measured[1], point))


def test_the_terminals_keep_to_their_ranges(plans: FloorPlans, exact: tuple[TwoNodePlant, Telemetry]) -> None:
    plant, telemetry = exact
    flow = points(telemetry, "supply_air_flowrate_sensor")
    area = np.array(list(zone_floor_areas(plans).values()))
    design = flow.max(axis=0)
    assert np.allclose(flow.min(axis=0) / area * 1006.0 * 14.0, 12.0, rtol=0.16)  # a fifth of 60 W/m2, within 15 %
    assert (design * 1006.0 * 14.0 / area < 60.0 * 1.15 + 1e-6).all()
    discharge = points(telemetry, "discharge_air_temperature_sensor") - 273.15
    assert discharge.min() >= 12.0
    assert discharge.max() <= 35.0
    assert discharge.max() > 33.0
    assert (np.abs(plant.given) / area < 60.0 * 1.15 + 1e-6).all()


def test_zones_hold_their_setpoints_and_drift_at_night(
    plans: FloorPlans, weather: pd.DataFrame, exact: tuple[TwoNodePlant, Telemetry]
) -> None:
    plant, telemetry = exact
    zone = points(telemetry, "zone_air_temperature_sensor")
    occupied = draw_thermostats(5, 12).occupied(telemetry.frame.index - pd.Timedelta(seconds=300))
    heating = points(telemetry, "zone_air_heating_temperature_setpoint")
    cooling = points(telemetry, "zone_air_cooling_temperature_setpoint")
    late = occupied & (telemetry.frame.index.hour.to_numpy() >= 14)[:, np.newaxis]
    assert (zone - heating)[late].min() > -0.25
    assert (zone - cooling)[late].max() < 0.25
    assert np.ptp(zone, axis=0).min() > 0.5
    assert np.abs(np.diff(zone, axis=0))[late[1:]].max() < 0.3, "the loop hunts"
    means = zone.mean(axis=0)
    assert np.ptp(means) > 0.3, "unequal zones"
    assert np.abs(plant.given).max() > 0.0


def test_the_loop_is_stable_on_air_alone(plans: FloorPlans, weather: pd.DataFrame) -> None:
    """The worst plant: nothing but the air's heat, 3.6 kJ/K/m2, behind a loss of 3 W/K/m2."""

    class AirPlant(TwoNodePlant):
        def step(self, zone_heat: np.ndarray, boundary_temperatures: np.ndarray, /) -> np.ndarray:
            gain = zone_heat / self.area + 3.0 * boundary_temperatures[0]
            self.air = (3600.0 / 300.0 * self.air + gain) / (3600.0 / 300.0 + 3.0)
            return self.air.copy()

    telemetry = generate_telemetry(AirPlant(plans), plans, weather, TelemetrySettings(noise=0.0, resolution=0.0))
    zone, heating = (
        points(telemetry, point) for point in ("zone_air_temperature_sensor", "zone_air_heating_temperature_setpoint")
    )
    steady = (heating == np.roll(heating, 24, axis=0)) & (telemetry.frame.index.hour.to_numpy() == 11)[:, np.newaxis]
    assert np.abs(zone - heating)[steady & (heating > 292.0)].max() < 0.3


def test_same_seed_same_telemetry(plans: FloorPlans, weather: pd.DataFrame) -> None:
    day = weather.iloc[:288]
    runs = [
        generate_telemetry(TwoNodePlant(plans), plans, day, TelemetrySettings(seed=seed)).frame for seed in (1, 1, 2)
    ]
    pd.testing.assert_frame_equal(runs[0], runs[1])
    assert not runs[0].equals(runs[2])


def test_progress(plans: FloorPlans, weather: pd.DataFrame) -> None:
    calls: list[tuple[int, int]] = []
    generate_telemetry(
        TwoNodePlant(plans), plans, weather.iloc[:5], progress=lambda done, steps: calls.append((done, steps))
    )
    assert calls == [(1, 5), (2, 5), (3, 5), (4, 5), (5, 5)]


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"seed": -1}, "seed"),
        ({"spin_up_days": -1.0}, "spin_up_days"),
        ({"spin_up_days": 8.0}, "at least 2306 steps"),
        ({"noise": -0.1}, "noise"),
        ({"resolution": -0.1}, "resolution"),
        ({"station": "roof"}, "roof/outside_air_temperature_sensor"),
    ],
)
def test_bad_arguments_are_refused(
    plans: FloorPlans, weather: pd.DataFrame, arguments: dict[str, Any], named: str
) -> None:
    with pytest.raises(ThermalError, match=named):
        generate_telemetry(TwoNodePlant(plans), plans, weather, TelemetrySettings(**arguments))


def test_what_does_not_fit_is_refused(plans: FloorPlans, weather: pd.DataFrame) -> None:
    other = TwoNodePlant(plans)
    other.zone_names = ("attic", *other.zone_names[1:])
    with pytest.raises(ThermalError, match=r"difference in .*attic"):
        generate_telemetry(other, plans, weather)
    with pytest.raises(ThermalError, match=r"plant's 600\.0 s"):
        generate_telemetry(TwoNodePlant(plans, 600.0), plans, weather)
    with pytest.raises(ThermalError, match="tz-aware"):
        generate_telemetry(TwoNodePlant(plans), plans, weather.tz_localize(None))
    with pytest.raises(ThermalError, match="gaps"):
        generate_telemetry(TwoNodePlant(plans), plans, weather.assign(**{STATION: np.nan}))
    with pytest.raises(ThermalError, match="finite temperatures from step 0"):
        broken = TwoNodePlant(plans)
        broken.area = broken.area * 0.0
        with np.errstate(all="ignore"):
            generate_telemetry(broken, plans, weather)
