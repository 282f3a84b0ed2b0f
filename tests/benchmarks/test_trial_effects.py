"""Each effect changes its own part of the building or of what is reported, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import ModuleType

import numpy as np
import pandas as pd
import pytest

DAYS = 2
LEAK = {"ZoneInfiltration:DesignFlowRate", "ZoneInfiltration:EffectiveLeakageArea"}
LAYERS = {"Material", "Material:NoMass", "Construction"}
BACK = {*LAYERS, "BuildingSurface:Detailed", "SurfaceProperty:OtherSideCoefficients", "Schedule:Constant"}
# EnergyPlus classes that an effect may touch; the driven schedules, laws and weather are looked at beside them.
CLASSES: dict[str, set[str]] = {
    "solar_gain": {"WindowMaterial:Glazing"},
    "solar_behind_horizon": {"WindowMaterial:Glazing", "Shading:Site:Detailed"},
    "blinds": {"WindowMaterial:Glazing", "WindowMaterial:Shade", "WindowShadingControl"},
    "solar_opaque": LAYERS,
    "longwave_sky": set(),
    "wind_film": {"SurfaceProperty:ConvectionCoefficients:MultipleSurface", "Schedule:Constant"},
    "infiltration": LEAK | {"Schedule:Constant"},
    "infiltration_by_direction": LEAK | {"Schedule:Constant"},
    "internal_gains": {"OtherEquipment", "Schedule:Constant"},
    "gains_bimodal": {"OtherEquipment", "Schedule:Constant"},
    "interfloor_exchange": {*LAYERS, "BuildingSurface:Detailed"},
    "ground_exchange": BACK,
    "roof_exchange": {*LAYERS, "BuildingSurface:Detailed"},
    "hidden_mass": {*LAYERS, "InternalMass"},
    "zone_mixing": {"ZoneCrossMixing", "Schedule:Constant"},
    "movable_partition": {"ZoneCrossMixing", "Schedule:Constant"},
    "capacity_limit": {"ZoneHVAC:IdealLoadsAirSystem"},
    "valve_leak": {"OtherEquipment", "Schedule:Constant"},
    "thermal_bridge": {*LAYERS, "Door"},
    "neighbour": BACK,
    "window_opening": {"ZoneVentilation:WindandStackOpenArea", "Schedule:Constant"},
    "latent_load": {"OtherEquipment", "Schedule:Constant"},
    "night_ventilation": {"ZoneVentilation:DesignFlowRate", "Schedule:Constant"},
    "exhaust_fan": {"ZoneVentilation:DesignFlowRate", "Schedule:Constant"},
    "server_room": {"OtherEquipment", "Schedule:Constant"},
    "phase_change": {"OtherEquipment", "Schedule:Constant"},
    "unmetered_heating": {"OtherEquipment", "Schedule:Constant"},
}
SUNNY = {"solar_gain", "solar_behind_horizon", "blinds", "solar_opaque"}
LAWS = {"valve_leak", "phase_change"}
# Columns of the telemetry that an effect of sensors, meters and clocks changes by itself.
REPORTED: dict[str, set[str]] = {
    "sensor_bias": {"zone_air_temperature_sensor"},
    "sensor_lag": {"zone_air_temperature_sensor"},
    "stratification": {"zone_air_temperature_sensor"},
    "sunlit_sensor": {"zone_air_temperature_sensor"},
    "duct_loss": {"discharge_air_temperature_sensor"},
    "duct_loss_by_flow": {"discharge_air_temperature_sensor"},
    "flow_gain": {"supply_air_flowrate_sensor"},
    "meter_drift": {"supply_air_flowrate_sensor"},
    "capacity_limit": {"supply_air_flowrate_sensor"},
    "swapped_sensors": {"supply_air_flowrate_sensor", "discharge_air_temperature_sensor"},
    "clock_shift": {"station"},
    "wrong_station": {"station"},
}


@pytest.fixture(scope="module")
def trials(package: Callable[[str], ModuleType]) -> Callable[[str], ModuleType]:
    return lambda name: package(f"energyplus_trials.{name}")


@pytest.fixture(scope="module")
def null(trials):
    """Two floors, one blank facade, in generated weather, which needs no file of EnergyPlus's."""
    draw = trials("drawing").draw_spec
    specs = (draw(seed, "null", days=DAYS) for seed in range(200))
    spec = next(s for s in specs if s.layout.floors == 2 and 0.0 in s.layout.glazing.values())
    town = trials("sites").TOWNS[1]
    place = replace(
        spec.climate, source=town.source, latitude=town.latitude, longitude=town.longitude,
        elevation=town.elevation, utc_offset=town.utc_offset, start="2023-04-12",
    )  # fmt: skip
    return replace(spec, climate=place, use=replace(spec.use, excitation="schedule"))


def with_effect(trials, null, name):
    effects = trials("draw_effects")
    if name == "blinds":
        null = effects.with_effect(null, "solar_gain", np.random.default_rng(1), 1.0)
    return effects.with_effect(null, name, np.random.default_rng(3), 1.0)


def changed(before, after) -> set[str]:
    return {kind for kind in before.keys() | after.keys() if before.get(kind) != after.get(kind)}


def test_the_null_has_walls_windows_slabs_furniture_and_heat_only(trials, null):
    plant = trials("trial").build(null)
    kinds = set(plant.objects)
    assert not {k for k in kinds if k.startswith(("ZoneInfiltration", "ZoneVentilation", "ZoneCross", "Zone:Mixing"))}
    assert not kinds & {"OtherEquipment", "People", "Lights", "ElectricEquipment", "Shading:Site:Detailed"}
    assert (plant.sun, plant.sky, plant.laws) == (False, 0.0, [])
    assert plant.objects["WindowMaterial:Glazing"]["glass"]["solar_transmittance_at_normal_incidence"] == 0.0
    conditions = {
        (s["surface_type"], s["outside_boundary_condition"]) for s in plant.objects["BuildingSurface:Detailed"].values()
    }
    assert conditions == {("Wall", "Outdoors"), ("Wall", "Surface"), ("Floor", "Adiabatic"), ("Ceiling", "Adiabatic")}
    assert set(plant.drive) == {f"{zone} {kind}" for zone in null.zone_names for kind in ("heating", "cooling")}


def test_without_sun_and_sky_the_weather_is_that_of_the_air(trials, null):
    climate = trials("climate")
    station = climate.station_weather(null.climate, 1, 2)
    assert station["direct_normal_irradiance_sensor"].max() > 50.0
    reaching = climate.building_weather(station, sun=False, sky=0.0)
    kelvin = reaching["outside_air_temperature_sensor"] + climate.FREEZING
    sky = reaching["horizontal_infrared_irradiance_sensor"]
    np.testing.assert_allclose(sky, climate.STEFAN_BOLTZMANN * kelvin**4, rtol=1e-12)
    assert reaching.filter(like="normal").to_numpy().max() == reaching.filter(like="diffuse").to_numpy().max() == 0.0
    whole = climate.building_weather(station, sun=True, sky=1.0)
    pd.testing.assert_frame_equal(whole, station, rtol=1e-12)


def test_the_weather_file_says_what_it_was_given(trials, null, tmp_path):
    climate = trials("climate")
    station = climate.station_weather(null.climate, 0, 1)
    climate.write_epw(tmp_path / "in.epw", station, null.climate)
    lines = (tmp_path / "in.epw").read_text().splitlines()
    assert lines[7] == "DATA PERIODS,1,12,Data,Wednesday,4/12,4/12"
    rows = np.array([[float(line.split(",")[k]) for k in (6, 21, 20, 12, 14, 15)] for line in lines[8:]])
    np.testing.assert_allclose(rows, station[list(climate.POINTS)].to_numpy(), atol=6e-3)
    assert lines[8].startswith("2023,4,12,1,5,") and lines[-1].startswith("2023,4,12,24,60,")


def test_every_effect_is_covered_here(trials):
    effects = trials("draw_effects")
    assert set(CLASSES) | set(REPORTED) | {"sensor_bias"} == set(effects.CATALOGUE) | set(effects.OUTSIDE)
    known = set(trials("changes").CHANGES) | set(trials("faults").FAULTS)
    drawn = {draw for draw in CLASSES | REPORTED if not draw.startswith(("solar_behind", "gains_", "infiltration_by"))}
    assert drawn - {"duct_loss_by_flow"} <= known


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_an_effect_of_the_building_touches_its_own_objects(trials, null, name):
    build = trials("trial").build
    before, after = build(null), build(with_effect(trials, null, name))
    touched = changed(before.objects, after.objects)
    assert touched <= CLASSES[name]
    assert touched or name == "longwave_sky"
    assert after.sun == (name in SUNNY)
    assert (after.sky > 0.0) == (name == "longwave_sky")
    assert bool(after.laws) == (name in LAWS)
    assert all(np.array_equal(after.drive[key], series) for key, series in before.drive.items())
    pd.testing.assert_frame_equal(before.station, after.station)


def test_a_party_wall_has_no_bridge_to_outdoors(trials, null):
    effects, build = trials("draw_effects"), trials("trial").build
    bridged = with_effect(trials, null, "thermal_bridge")
    both = effects.with_effect(bridged, "neighbour", np.random.default_rng(3), 1.0)
    doors, left = (set(build(spec).objects["Door"]) for spec in (bridged, both))
    side = both.effects[1].parameters["side"]
    assert doors - left == {f"{zone} {side} bridge" for zone in both.effects[1].zones}


def test_a_biased_thermostat_keeps_its_reading_at_the_set_point(trials, null):
    build = trials("trial").build
    spec = with_effect(trials, null, "sensor_bias")
    before, after = build(null), build(spec)
    for zone, bias in spec.effects[0].parameters["bias_K"].items():
        for kind in ("heating", "cooling"):
            np.testing.assert_allclose(after.drive[f"{zone} {kind}"] + bias, before.drive[f"{zone} {kind}"])
    assert not changed(before.objects, after.objects)


def results_of(trials, spec) -> pd.DataFrame:
    """What a plant might have computed."""
    station = trials("climate").station_weather(spec.climate, trials("plant").RUN_IN_DAYS, spec.days)
    rng, n = np.random.default_rng(0), len(station)
    columns = {}
    for zone in spec.zone_names:
        limit = trials("model").design_flow(spec, zone)
        columns[zone, "temperature"] = 20.0 + np.cumsum(rng.normal(0.0, 0.03, n))
        columns[zone, "flow"] = limit * np.clip(rng.uniform(-0.5, 1.5, n), 0.0, 1.0)
        columns[zone, "discharge"] = 35.0
    return pd.DataFrame(columns, index=station.index)


def reported(trials, spec, results):
    station = trials("climate").station_weather(spec.climate, trials("plant").RUN_IN_DAYS, spec.days)
    readings = trials("readings").Readings(spec, results, station)
    trials("faults").apply_faults(readings)
    return readings


@pytest.mark.parametrize("name", sorted(REPORTED))
def test_an_effect_of_sensors_changes_its_own_columns(trials, null, name):
    results = results_of(trials, null)
    spec = with_effect(trials, null, name)
    before, after = (reported(trials, s, results).telemetry() for s in (null, spec))
    differing = {c for c in before if not np.allclose(before[c], after[c], rtol=1e-6, atol=1e-6)}
    expected = {c for c in before if ("station" if c.startswith("weather") else c.partition("/")[2]) in REPORTED[name]}
    assert differing and differing <= expected
    zones = {c.partition("/")[0].removeprefix("VAV_") for c in differing} - {"weather_station"}
    assert zones <= set(spec.effects[0].zones or spec.zone_names)


def test_a_lagged_sensor_reaches_63_percent_after_its_time_constant(trials, null):
    spec = with_effect(trials, null, "sensor_lag")
    results, zone = results_of(trials, null), null.zone_names[0]
    step = np.where(np.arange(len(results)) < 1000, 20.0, 21.0)
    results[zone, "temperature"] = step
    read = reported(trials, spec, results).temperature[zone].to_numpy()
    time = spec.effects[0].parameters["time_constant_s"] / 300.0
    at = np.interp(20.0 + 1.0 - np.exp(-1.0), read[999:1040], np.arange(41))
    assert at == pytest.approx(time, abs=1.0)  # the step's own mean takes half a step, the stamp the other


def test_the_heat_behind_a_leaking_duct_is_the_room_s(trials, null):
    spec = with_effect(trials, null, "duct_loss")
    results = results_of(trials, null)
    true, read = reported(trials, null, results), reported(trials, spec, results)
    ntu = spec.effects[0].parameters["ntu"]
    for zone in spec.effects[0].zones:
        floor = [z for z in spec.zone_names if z[:2] == zone[:2]]
        void = true.temperature[floor].mean(axis=1)
        arrives = void + (read.discharge[zone] - void) * np.exp(-ntu)
        flowing = true.on[zone]
        np.testing.assert_allclose(arrives[flowing], true.discharge[zone][flowing])


def test_a_stuck_damper_reports_what_it_is_told(trials, null):
    spec = with_effect(trials, null, "capacity_limit")
    results, lost = results_of(trials, null), spec.effects[0].parameters["lost_share"]
    for zone in spec.effects[0].zones:
        limit = trials("model").design_flow(spec, zone)
        results[zone, "flow"] = np.minimum(results[zone, "flow"], (1.0 - lost) * limit)
    flows = reported(trials, spec, results).flow
    for zone in spec.effects[0].zones:
        limit = trials("model").design_flow(spec, zone)
        told, given = flows[zone], results[zone, "flow"]
        full = given >= 0.99 * (1.0 - lost) * limit
        assert full.any() and not full.all()
        np.testing.assert_allclose(told[full], limit, rtol=0.011)
        np.testing.assert_array_equal(told[~full], given[~full])


def test_a_store_of_latent_heat_gives_back_what_it_took(trials):
    law = {"law": "phase_change", "device": "d", "zone": "z", "coupling": 100.0, "capacity": 1e6, "latent": 1e7,
           "melting": 21.0, "width": 1.0}  # fmt: skip
    store = trials("laws").make_law(law, lambda zone, output: 0)
    hours = np.arange(0.0, 24.0 * 40.0, 1.0 / 12.0)
    heat = np.array([store.watts(np.array([21.0 + 3.0 * np.sin(2.0 * np.pi * h / 24.0)])) for h in hours])
    taken = np.cumsum(heat)[288 * 20 - 1 :: 288] * 300.0
    assert np.ptp(taken) < 1e-3 * np.abs(heat).sum() * 300.0  # the same at the end of each day
    assert heat.max() > 100.0 and heat.min() < -100.0
    steady = trials("laws").make_law(law, lambda zone, output: 0)
    assert steady.watts(np.array([20.0])) == 0.0
    melting = [steady.watts(np.array([26.0])) for _ in range(20000)]
    expected = 1e7 + 1e6 * 6.0
    assert -sum(melting) * 300.0 == pytest.approx(expected, rel=1e-3)
    assert melting[-1] == pytest.approx(0.0, abs=1e-3)


def test_a_leak_flows_with_the_air(trials):
    leak = trials("laws").make_law({"law": "leak", "device": "d", "zone": "z", "watts": 40.0}, lambda z, o: 1)
    assert leak.watts(np.array([20.0, 0.1])) == 40.0
    assert leak.watts(np.array([20.0, 0.0])) == 0.0
