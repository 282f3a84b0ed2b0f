"""Houses of blind trials: drawn from seeds, closed, told as their drawing has them, and balanced in EnergyPlus."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pandas as pd
import pytest
import yaml

from thermal import load_case

SEEDS = range(40)
LAYERS = {"Material", "Construction"}
HEAT = {"OtherEquipment", "Schedule:Constant"}
LEAK = {"ZoneInfiltration:DesignFlowRate", "ZoneInfiltration:EffectiveLeakageArea", "Schedule:Constant"}
OPEN = {"ZoneVentilation:WindandStackOpenArea", "Schedule:Constant"}
BACK = {"BuildingSurface:Detailed", "SurfaceProperty:OtherSideCoefficients", "Schedule:Constant"}
# EnergyPlus classes that an effect may touch; what thermostats, weather and telemetry get is looked at beside them.
CLASSES: dict[str, set[str]] = {
    "solar_gain": {"WindowMaterial:Glazing"},
    "solar_opaque": LAYERS,
    "longwave_sky": set(),
    "wind_film": {"SurfaceProperty:ConvectionCoefficients:MultipleSurface", "Schedule:Constant"},
    "infiltration": LEAK,
    "infiltration_by_direction": LEAK,
    "internal_gains": HEAT,
    "stove": HEAT,
    "bath": HEAT,
    "riser_pipe": HEAT,
    "ground_exchange": BACK,
    "neighbour": BACK | LAYERS,
    "hidden_mass": LAYERS | {"InternalMass"},
    "zone_mixing": {"ZoneCrossMixing", "Schedule:Constant"},
    "thermal_bridge": {"Material:NoMass", "Construction", "BuildingSurface:Detailed"},
    "window_opening": OPEN,
    "fireplace_flue": OPEN,
}
# What an effect of thermostats, sensors, meters and drawings changes instead, and which columns by itself.
HEATERS = {"sensor_bias", "capacity_limit", "meter_at_boiler"}
REPORTED: dict[str, str] = {
    "sensor_bias": "zone_air_temperature_sensor",
    "sensor_lag": "zone_air_temperature_sensor",
    "sunlit_sensor": "zone_air_temperature_sensor",
    "swapped_sensors": "zone_air_temperature_sensor",
    "flow_gain": "heating_power_sensor",
    "meter_drift": "heating_power_sensor",
    "meter_at_boiler": "heating_power_sensor",
    "wrong_station": "outside_air_temperature_sensor",
    "clock_shift": "",
}

needs_energyplus = pytest.mark.skipif(
    importlib.util.find_spec("pyenergyplus") is None, reason="needs EnergyPlus: pip install -e .[energyplus]"
)


@pytest.fixture(scope="module")
def trials(package: Callable[[str], ModuleType]) -> Callable[[str], ModuleType]:
    package("energyplus_trials.specification")
    return lambda name: package(f"house_trials.{name}")


@pytest.fixture(scope="module")
def draw(trials):
    return trials("drawing").draw_spec


@pytest.fixture(scope="module")
def null(draw, package):
    """Radiators, a meter a room, an attic, ground, a blank side; generated weather, which needs no file of EnergyPlus's."""
    spec = next(
        s
        for s in (draw(seed, "null", days=2) for seed in range(400))
        if s.heating.emitter == "radiator" and s.heating.meter == "room" and s.sensors.quality == "surveyed"
        and (s.house.top, s.house.bottom) == ("attic", "ground") and 0.0 in s.house.glazing.values()
    )  # fmt: skip
    town = package("energyplus_trials.sites").TOWNS[1]
    place = replace(
        spec.climate, source=town.source, latitude=town.latitude, longitude=town.longitude, elevation=town.elevation,
        utc_offset=town.utc_offset, start="2023-03-12", warmer=-9.0,
    )  # fmt: skip
    return replace(spec, climate=place)


def with_effect(trials, null, name, seed=3):
    return trials("draw_effects").with_effect(null, name, np.random.default_rng(seed), 1.0)


def test_a_seed_says_everything_and_the_null_is_its_twin(draw):
    for kind in ("null", "single", "pair", "outside"):
        for seed in range(20):
            spec = draw(seed, kind)
            assert spec == draw(seed, kind) and spec.twin() == draw(seed, "null")
            assert json.loads(spec.to_json())["seed"] == seed
            assert spec.name.startswith("trial_") and len(spec.name) == 16
    with pytest.raises(ValueError, match="kind"):
        draw(0, "everything")


def test_streams_and_worlds_share_nothing(draw, package):
    office = package("energyplus_trials.drawing").draw_spec
    ours = {draw(seed, "null", confirmation=c).climate.seed for seed in SEEDS for c in (False, True)}
    assert len(ours) == 2 * len(SEEDS)
    assert not ours & {office(seed, "null").climate.seed for seed in SEEDS}
    assert draw(1, "null").name != office(1, "null").name


def test_effects_are_those_that_the_house_can_have(draw, trials):
    effects, seen = trials("draw_effects"), set()
    for kind, allowed in {"null": {0}, "single": {1}, "pair": {2, 3}, "outside": {1}}.items():
        for seed in range(250 if kind == "single" else 60):
            spec = draw(seed, kind)
            assert len(spec.effects) in allowed and len({e.name for e in spec.effects}) == len(spec.effects)
            for effect in spec.effects:
                assert set(effect.zones) <= set(spec.zone_names) and effect.answers
                assert effect.unexplained_is_right == (kind == "outside")
                assert effects.STRENGTHS[0] - 1e-3 <= effect.strength <= effects.STRENGTHS[1] + 1e-3
                seen |= {effect.name} if kind == "single" else set()
    assert seen == set(effects.CATALOGUE)


def test_all_kinds_of_house_are_drawn(draw):
    specs = [draw(seed, "null") for seed in range(200)]
    assert {s.house.floors for s in specs} == {1, 2, 3}
    assert {len(s.house.rooms) for s in specs} == set(range(3, 9))
    assert {s.heating.emitter for s in specs} == {"electric", "radiator", "floor"}
    assert {s.sensors.quality for s in specs} == {"surveyed", "approximate", "generic"}
    assert {s.sensors.minutes for s in specs} == {5, 10, 15}
    assert {s.fabric.wall for s in specs} == {"brick", "cavity", "block", "timber"}
    assert len({s.climate.source for s in specs}) == 16
    assert {s.climate.start[5:7] for s in specs} <= {"01", "02", "03", "04", "10", "11", "12"}
    assert min(room.area for s in specs for room in s.house.rooms) > 5.0


def test_rooms_are_closed_and_seen_alike_from_both_sides(draw, trials):
    faces = trials("faces")
    for seed in SEEDS:
        house = draw(seed, "null").house
        found = {face.name: face for face in faces.faces(house)}
        assert len(found) == len(faces.faces(house))
        for room in house.rooms:
            mine = [face for face in found.values() if face.room == room.name]
            walls = 2.0 * (room.east - room.west + room.north - room.south) * house.height
            area = {kind: sum(f.area for f in mine if f.kind == kind) for kind in ("floor", "ceiling", "wall")}
            assert area == pytest.approx({"floor": room.area, "ceiling": room.area, "wall": walls})
            # the outward normals of a closed body, each as long as its face is large, add up to nothing
            normals = [0.5 * sum(np.cross(p, q) for p, q in zip(f.corners, f.corners[1:] + f.corners[:1], strict=True))
                       for f in mine]  # fmt: skip
            assert np.sum(normals, axis=0) == pytest.approx(np.zeros(3), abs=1e-9)
        for face in found.values():
            if face.other in {room.name for room in house.rooms}:
                assert found[faces.partner(face)].area == pytest.approx(face.area)
                assert found[faces.partner(face)].other == face.room


def test_thermostats_switch_within_their_band_and_heaters_keep_energy(trials):
    law = {"power": 1000.0, "lag": 900.0, "control": "on_off", "band": 0.6, "bias": 0.5, "limit": 1.0}
    heater = trials("worker").Heater(law)
    # the sensor reads 0.5 K too much: on below 19.2, off above 19.8 of true temperature
    asked = [heater.step(air, 20.0, 0)[0] for air in (19.25, 19.15, 19.5, 19.75, 19.85, 19.5, 19.25)]
    assert asked == [0.0, 1000.0, 1000.0, 1000.0, 0.0, 0.0, 0.0]
    rng, heater = np.random.default_rng(0), trials("worker").Heater(law | {"control": "proportional", "limit": 0.6})
    steps = np.array(
        [heater.step(air, 20.0, 0) for air in np.concatenate([rng.uniform(18.5, 21.0, 500), np.full(100, 25.0)])]
    )
    given = np.minimum(steps[:, 0], 600.0)
    assert steps[:, 1].sum() == pytest.approx(given.sum(), rel=1e-9) and steps[:, 1].max() < 600.0
    np.testing.assert_allclose(trials("readings").emitted(given, 900.0), steps[:, 1], atol=1e-9)
    limited = trials("worker").Heater(law | {"lag": 0.0, "limit": 0.6, "limited": [5, 8]})
    assert [limited.step(15.0, 20.0, row)[1] for row in (4, 5, 7, 8)] == [1000.0, 600.0, 600.0, 1000.0]


def test_people_leave_and_come_back_and_windows_are_opened_by_them(trials, draw):
    people, starts = trials("people"), pd.date_range("2023-01-02", periods=28 * 288, freq="5min")
    for seed in range(5):
        who = people.household(draw(seed, "null"), starts)
        assert who.home.max() == who.count and who.home.min() >= 0.0
        assert not who.awake[who.home == 0.0].any()
        night = np.asarray(starts.hour == 3)
        assert (who.home[night] == who.count).all() and not who.awake[night].any()
        shut = people.openings(replace(who, awake=np.zeros(len(starts))), np.random.default_rng(seed))
        assert not shut.any()
        assert 0.005 < (people.openings(who, np.random.default_rng(seed)) > 0.0).mean() < 0.2


def test_a_surveyed_drawing_is_right_and_others_are_off(trials, null):
    drawn, truth = trials("drawn").zone_table, trials("drawn").zone_table(null)
    area = sum(room.area for room in null.house.rooms)
    assert sum(zone["floor_area"] for zone in truth["zones"]) == pytest.approx(area)
    outer = [f for f in trials("faces").faces(null.house) if f.side]
    told = [row for row in truth["surfaces"] if row["other"] == "outdoor"]
    assert sum(row["area"] for row in told) == pytest.approx(sum(f.area for f in outer))
    blurred = drawn(replace(null, sensors=replace(null.sensors, quality="approximate")))
    ratios = [b["area"] / t["area"] for b, t in zip(blurred["surfaces"], truth["surfaces"], strict=True)]
    assert 0.03 < np.std(np.log(ratios)) < 0.2
    generic = drawn(replace(null, sensors=replace(null.sensors, quality="generic")))
    assert len({zone["floor_area"] for zone in generic["zones"]}) == 1
    assert sum(zone["floor_area"] for zone in generic["zones"]) == pytest.approx(area)
    lumped = drawn(replace(null, heating=replace(null.heating, meter="house")))
    assert [zone["name"] for zone in lumped["zones"]] == ["house"]
    assert {row["other"] for row in lumped["surfaces"]} == {"house", "outdoor", "attic", "ground"}
    rows = drawn(with_effect(trials, null, "unmeasured_attic"))["surfaces"]
    assert truth["surfaces"] != rows and all(row in truth["surfaces"] for row in rows)


def results_of(trials, house):
    """What a run might have given."""
    rng, n = np.random.default_rng(0), len(house.station)
    rooms, index = list(house.spec.zone_names), house.station.index
    columns = {(room, "temperature"): 20.0 + np.cumsum(rng.normal(0.0, 0.05, n)) for room in rooms}
    asked = pd.DataFrame({r: law["power"] * rng.integers(0, 2, n) for r, law in house.heaters.items()}, index)
    given = pd.DataFrame(
        {r: trials("readings").emitted(np.minimum(asked[r], law["limit"] * law["power"]).to_numpy(), law["lag"])
         for r, law in house.heaters.items()}, index)  # fmt: skip
    return trials("plant").Results(pd.DataFrame(columns, index), asked, given, [])


def reported(trials, spec):
    house = trials("trial").build(spec)
    readings = trials("readings").Readings(house, results_of(trials, house))
    trials("faults").apply_faults(readings)
    return readings.telemetry()


def test_every_effect_is_covered_here(trials):
    effects = trials("draw_effects")
    assert set(CLASSES) | set(REPORTED) | HEATERS | {"unmeasured_attic"} == set(effects.CATALOGUE) | set(
        effects.OUTSIDE
    )


def test_the_null_has_walls_windows_slabs_furniture_and_heat_only(trials, null):
    house = trials("trial").build(replace(null, house=replace(null.house, doorway=())))
    kinds = set(house.objects)
    assert not {k for k in kinds if k.startswith(("ZoneInfiltration", "ZoneVentilation", "ZoneCross", "ZoneMixing"))}
    assert set(house.objects["OtherEquipment"]) == {f"{room} radiator" for room in house.heaters}
    assert (house.sun, house.sky, house.gains) == (False, 0.0, {})
    assert house.objects["WindowMaterial:Glazing"]["glass"]["solar_transmittance_at_normal_incidence"] == 0.0
    behind = {
        (s["surface_type"], s["outside_boundary_condition"]) for s in house.objects["BuildingSurface:Detailed"].values()
    }
    assert {b for b in behind if b[1] != "Surface"} == {
        ("Wall", "Outdoors"), ("Floor", "Adiabatic"), ("Ceiling", "OtherSideCoefficients"),
    }  # fmt: skip
    # mirrored, so that no heat passes its middle
    layers = list(house.objects["Construction"]["floor on ground"].values())
    assert layers == layers[::-1] and len(layers) > 4


@pytest.mark.parametrize("name", sorted(set(CLASSES) | HEATERS))
def test_an_effect_of_the_house_touches_its_own_objects(trials, null, name):
    build = trials("trial").build
    before, after = build(null), build(with_effect(trials, null, name))
    touched = {k for k in before.objects | after.objects if before.objects.get(k) != after.objects.get(k)}
    assert touched <= CLASSES.get(name, set())
    assert touched or name in HEATERS | {"longwave_sky"}
    assert after.sun == (name in ("solar_gain", "solar_opaque")) and (after.sky > 0.0) == (name == "longwave_sky")
    assert (before.heaters != after.heaters) == (name in HEATERS)
    assert bool(after.gains) == (CLASSES.get(name) == HEAT)
    assert all(np.array_equal(after.drive[key], series) for key, series in before.drive.items())
    assert np.array_equal(before.set_points, after.set_points)
    pd.testing.assert_frame_equal(before.station, after.station)


@pytest.mark.parametrize("name", sorted(REPORTED))
def test_a_fault_changes_its_own_columns(trials, null, name):
    spec = with_effect(trials, null, name)
    before, after = reported(trials, null), reported(trials, spec)
    differing = {str(c) for c in before if not np.allclose(before[c], after[c], rtol=1e-6, atol=1e-6)}
    assert differing and all(REPORTED[name] in c for c in differing)
    if name == "clock_shift":
        station = spec.effects[0].form == "station"
        assert all(c.startswith("weather_station/") == station for c in differing)


def test_a_limited_heater_says_what_it_would_have_given(trials, null):
    before, after = reported(trials, null), reported(trials, with_effect(trials, null, "capacity_limit"))
    pd.testing.assert_frame_equal(before, after)  # the synthetic run asks for the same


def test_a_house_that_is_lived_in_has_sun_and_leakage_that_are_known(draw, trials):
    for seed in range(20):
        spec = draw(seed, "single", lived_in=True)
        assert [e.name for e in spec.known] == ["solar_gain", "infiltration"] and spec.name != draw(seed, "single").name
        assert spec.twin() == draw(seed, "null", lived_in=True) and spec.twin().known == spec.known
        assert not {e.name for e in spec.effects} & {"solar_gain", "infiltration"}
        assert replace(spec.twin(), known=()) == draw(seed, "null")


def test_gains_have_the_mean_that_the_label_says(trials, null):
    spec = with_effect(trials, null, "internal_gains")
    house = trials("trial").build(spec)
    given = sum(float(watts.mean()) for watts in house.gains.values()) / 0.6  # the rest is radiant
    area = sum(room.area for room in spec.house.rooms)
    assert given / area == pytest.approx(spec.effects[0].parameters["mean_W_m2"])


@pytest.mark.parametrize("meter", ["room", "house"])
def test_a_case_loads_and_tells_nothing(trials, null, tmp_path, meter):
    spec = with_effect(trials, replace(null, heating=replace(null.heating, meter=meter)), "sensor_bias")
    trials("folder").write_case(tmp_path / spec.name, spec, reported(trials, spec))
    case = load_case(tmp_path / spec.name)
    assert case.building.zone_names == (("house",) if meter == "house" else spec.zone_names)
    assert len(case.telemetry.frame) == 2 * 24 * 60 // spec.sensors.minutes
    text = (tmp_path / spec.name / "building.yaml").read_text()
    assert yaml.safe_load(text)["geometry_quality"] == "surveyed"
    effects = trials("draw_effects")
    assert not [name for name in effects.CATALOGUE | effects.OUTSIDE if name in text]
    label = trials("folder").label(spec, trials("trial").twin_names(spec), {})
    assert label["world"] == "house" and label["twins"] == [null.twin().name]
    assert set(label["effects"][0]["zones"]) <= set(case.building.zone_names)


def test_labels_are_not_put_where_the_diagnosis_looks(trials, null, tmp_path):
    with pytest.raises(ValueError, match="outside of the cases"):
        trials("world").WORLD.make(null, tmp_path / "cases", tmp_path / "cases" / "sealed")


def test_heat_that_is_not_what_was_given_is_refused(trials, null, package):
    house, readings = trials("trial").build(null), trials("readings")
    results = results_of(trials, house)
    weather = package("energyplus_trials.climate").building_weather(house.station, sun=False, sky=0.0)
    for point in weather:
        results.outputs["site", point] = weather[point]
    for room in null.zone_names:
        convective = (1.0 - null.heating.radiant) * results.given[room] if room in results.given else 0.0
        results.outputs[room, "convective"] = convective
    assert readings.check_run(house, results) < 1e-12
    results.outputs[null.zone_names[0], "convective"] *= 1.05
    with pytest.raises(Exception, match="heat of .* is off by 5"):
        readings.check_run(house, results)


@pytest.mark.long
@pytest.mark.energyplus
@needs_energyplus
@pytest.mark.parametrize("emitter", ["radiator", "floor"])
def test_heat_balances_room_by_room_in_energyplus(trials, null, emitter):
    spec = null
    if emitter == "floor":
        spec = replace(null, heating=replace(null.heating, emitter="floor"), house=replace(null.house, bottom="cellar"))
    found = trials("audit").audit(trials("trial").build(spec))
    assert max(found.air.values()) < 1e-9
    assert found.house < 5e-3
    assert found.terms["heat"] > 50.0 and found.terms["outdoor_air"] == 0.0
    assert found.terms["sun_through_glass"] < 1e-6 and found.terms["sun_on_walls"] < 1e-6
    assert found.terms["film"] < 1e-6 and found.terms["sky"] < 1e-2


@pytest.mark.energyplus
@needs_energyplus
def test_a_trial_is_made_once(trials, null, tmp_path):
    spec = with_effect(trials, null, "window_opening")
    cases, sealed = tmp_path / "cases", tmp_path / "sealed"
    assert trials("world").WORLD.make(spec, cases, sealed) and not trials("world").WORLD.make(spec, cases, sealed)
    label = json.loads((sealed / f"{spec.name}.json").read_text())
    assert label["run"]["warnings"] == [] and label["run"]["heat_deviation"] < 1e-9
    folder: Path = cases / spec.name
    assert {path.name for path in folder.iterdir()} == {"building.yaml", "telemetry.parquet"}
    case = load_case(folder)
    assert not case.zone_heat()[list(trials("draw_effects").heated(spec))].isna().any(axis=None)
