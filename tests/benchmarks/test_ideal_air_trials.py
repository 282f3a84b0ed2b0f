"""Offices with ideal air of blind trials: drawn from seeds, closed, and balanced by EnergyPlus' own account."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from dataclasses import replace
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest

from thermal import load_case
from thermal.case.plan import zone_floor_areas

SEEDS = range(60)
LAYERS = {"BuildingSurface:Detailed", "Construction"}
HEAT = {"ElectricEquipment", "Schedule:Compact"}
AIR = {"ZoneVentilation:DesignFlowRate", "Schedule:Compact"}
# EnergyPlus classes that an effect may touch; what weather, thermostats and telemetry get is looked at beside them.
CLASSES: dict[str, set[str]] = {
    "solar_gain": {"WindowMaterial:Glazing"},
    "solar_opaque": {"Material"},
    "longwave_sky": set(),
    "infiltration": {"ZoneInfiltration:DesignFlowRate"},
    "internal_gains": HEAT,
    "interfloor_exchange": LAYERS | {"Material"},
    "ground_exchange": LAYERS | {"Material:NoMass", "Site:GroundTemperature:BuildingSurface"},
    "roof_exchange": LAYERS | {"Material:NoMass"},
    "zone_mixing": {"ZoneMixing", "Schedule:Compact"},
    "hidden_mass": {"Material", "Construction", "InternalMass"},
    "sensor_bias": set(),
    "neighbour": LAYERS | {"Material", "Material:NoMass", "SurfaceProperty:OtherSideCoefficients", "Schedule:Compact"},
    "valve_leak": {"OtherEquipment", "EnergyManagementSystem:Sensor", "EnergyManagementSystem:Actuator",
                   "EnergyManagementSystem:Program", "EnergyManagementSystem:ProgramCallingManager"},
    "capacity_limit": {"ZoneHVAC:IdealLoadsAirSystem"},
    "window_opening": AIR,
    "server_room": HEAT,
    "stove": HEAT,
    "night_ventilation": AIR,
}  # fmt: skip
# Columns that an effect of sensors and meters changes by itself.
REPORTED: dict[str, str] = {
    "sensor_bias": "zone_air_temperature_sensor",
    "sensor_lag": "zone_air_temperature_sensor",
    "stratified_room": "zone_air_temperature_sensor",
    "flow_gain": "supply_air_flowrate_sensor",
    "duct_loss": "discharge_air_temperature_sensor",
    "clock_shift": "weather_station",
}
EFFECTS = sorted(set(CLASSES) | set(REPORTED))

needs_energyplus = pytest.mark.skipif(
    importlib.util.find_spec("pyenergyplus") is None, reason="needs EnergyPlus: pip install -e .[energyplus]"
)


@pytest.fixture(scope="module")
def trials(package: Callable[[str], ModuleType]) -> Callable[[str], ModuleType]:
    return lambda name: package(f"ideal_air_trials.{name}")


@pytest.fixture(scope="module")
def draw(trials):
    return trials("drawing").draw_spec


@pytest.fixture(scope="module")
def null(draw):
    """Two days of two floors with a blank facade, which can have each effect; films of one law."""
    found = next(
        spec
        for spec in (draw(seed, "null", days=2) for seed in range(400))
        if spec.layout.floors == 2 and spec.layout.blank and spec.fabric.inside_convection == "TARP"
    )
    # a whole slab whose transfer functions make no heat
    slab = {"slab_thickness": 0.0923, "slab_conductivity": 1.86, "slab_density": 2240.0}
    return replace(found, fabric=replace(found.fabric, **slab))


@pytest.fixture(scope="module")
def weather(trials):
    """Weather of no file."""
    hour, points = np.arange(1.0, 8761.0), trials("weather").POINTS
    hourly = pd.DataFrame({point: 100.0 + 50.0 * np.sin(hour / 12.0 * np.pi + k) for k, point in enumerate(points)})
    hourly["outside_air_temperature_sensor"] = 10.0 - 5.0 * np.cos(hour / 12.0 * np.pi)
    hourly["dew_point"] = 8.0
    head = [f"head {k}" for k in range(8)]
    lines = [",".join(f"{100 * hour + k}" for k in range(30)) for hour in range(8760)]
    return trials("weather").Weather(hourly, 40.0, -105.0, 1600.0, -7, (*head, *lines))


def with_effect(trials, null, name: str, seed: int = 3):
    effect = trials("draw_effects").draw_effect(name, null, np.random.default_rng(seed), 1.0)
    return replace(null, kind="single", effects=(effect,))


def plant(trials, spec, weather):
    made = trials("plant").Plant(spec, weather, trials("operation").setpoints(spec), trials("model").null_model(spec))
    trials("changes").apply_changes(made)
    return made


def reported(trials, spec, weather) -> pd.DataFrame:
    """What sensors would report of a run that a building might have given."""
    rng, zones, starts = np.random.default_rng(0), list(spec.zone_names), spec.starts
    shape = len(starts), len(zones)
    temperature = pd.DataFrame(21.0 + np.cumsum(rng.normal(0.0, 0.03, shape), axis=0), starts, zones)
    heat = pd.DataFrame(rng.normal(0.0, 500.0, shape).clip(-900.0, 900.0), starts, zones)
    run = trials("plant").Run(temperature, heat, heat, heat, pd.DataFrame(), 0.0)
    readings = trials("readings").Readings(plant(trials, spec, weather), run)
    trials("faults").apply_faults(readings)
    return readings.telemetry()


def test_a_seed_says_everything_and_the_null_is_its_twin(draw):
    for kind, count in (("null", 0), ("single", 1), ("outside", 1), ("pair", 2)):
        for seed in range(20):
            spec = draw(seed, kind)
            assert spec == draw(seed, kind) and len(spec.effects) == count and spec.kind == kind
            assert replace(spec, kind="null", effects=()) == draw(seed, "null")
            assert spec.name.startswith("trial_") and len(spec.name) == 16
    for seed, kind, days in ((0, "triple", 21), (-1, "null", 21), (0, "null", 0), (0, "null", 90)):
        with pytest.raises(ValueError, match="expected a seed"):
            draw(seed, kind, days=days)


def test_twins_lack_one_effect_each(draw, package):
    without = package("ideal_air_trials.world").WORLD.draw(4, "without")
    for seed in range(40):
        null, single, pair = (draw(seed, kind) for kind in ("null", "single", "pair"))
        assert single.twins() == (null,) and null.twins() == ()
        first, second = pair.effects
        assert single.effects[0] in pair.effects and first.name != second.name
        assert [twin.effects for twin in pair.twins()] == [(second,), (first,)]
        assert len({pair.name, single.name, *(twin.name for twin in pair.twins())}) == 4
        assert "neighbour" not in {e.name for e in pair.effects} or pair.layout.blank
    assert without == draw(4, "pair").twins()


def test_streams_share_nothing(draw):
    ours = [draw(seed, "null", confirmation=c) for seed in SEEDS for c in (False, True)]
    assert len({spec.name for spec in ours}) == len({spec.climate.warmer for spec in ours}) == 2 * len(SEEDS)
    effects = [[draw(seed, "single", confirmation=c).effects[0].name for seed in range(19)] for c in (False, True)]
    assert effects[0] != effects[1]


def test_effects_take_turns_in_offices_that_can_have_them(draw, trials):
    drawing = trials("draw_effects")
    for kind, names in (("single", drawing.CATALOGUE), ("outside", drawing.OUTSIDE_CATALOGUE)):
        for confirmation in (False, True):
            specs = [draw(seed, kind, confirmation=confirmation) for seed in range(2 * len(names))]
            for block in (specs[: len(names)], specs[len(names) :]):
                assert {spec.effects[0].name for spec in block} == set(names)
            for spec in specs:
                (effect,) = spec.effects
                assert set(effect.zones) <= set(spec.zone_names) and effect.name in effect.answers
                assert effect.unexplained_is_right == (kind == "outside")
                assert drawing.STRENGTHS[0] <= effect.strength <= drawing.STRENGTHS[1]
                assert effect.name != "interfloor_exchange" or spec.layout.floors == 2
                assert effect.name != "neighbour" or effect.zones


def test_all_kinds_of_office_are_drawn(draw, trials):
    specs = [draw(seed, "null") for seed in range(200)]
    assert {s.layout.kind for s in specs} == {kind for kinds in trials("cuts").KINDS.values() for kind in kinds}
    assert {s.fabric.wall for s in specs} == set(trials("fabric").WALLS)
    assert {s.climate.season for s in specs} == set(trials("drawing").SEASONS)
    assert len({s.climate.source for s in specs}) == 16
    assert {pd.Timestamp(s.climate.start).day_name() for s in specs} == {"Monday"}
    assert {s.excitation for s in specs} == {"schedule", "prbs"}


def test_zones_are_closed_and_partitions_are_seen_from_both_sides(draw, trials):
    plan = trials("plan")
    for seed in SEEDS:
        layout = draw(seed, "null").layout
        walls, boxes = plan.walls(layout), layout.boxes()
        for name, box in boxes.items():
            for side in plan.SIDES:
                low, high = box.along(side)
                assert sum(w.length for w in walls if (w.zone, w.side) == (name, side)) == pytest.approx(high - low)
        between = {(w.zone, w.other): w.length for w in walls if w.other}
        assert all(between[other, zone] == pytest.approx(length) for (zone, other), length in between.items())
        outer = layout.columns * layout.rows * plan.CELL**2
        assert sum(box.area for box in boxes.values()) == pytest.approx(outer)
        facades = 2.0 * (layout.columns + layout.rows) * plan.CELL
        assert sum(w.length for w in walls if w.other is None) == pytest.approx(facades)
        for wall in (w for w in walls if w.other is None and layout.glazing[w.side] > 0.0):
            low, high = plan.pane(layout, wall)
            area = plan.PANE_SHARE * wall.length * (high - low)
            assert area == pytest.approx(layout.glazing[wall.side] * wall.length * layout.height)
            assert 0.0 < low < high < layout.height


def test_setpoints_keep_apart_and_move_as_the_label_says(draw, trials):
    for seed in range(12):
        spec = draw(seed, "null", days=7)
        heating, cooling = trials("operation").setpoints(spec)
        assert list(heating) == list(spec.zone_names) and len(heating) == 10 * 288
        assert ((cooling - heating) > 0.399).all(axis=None) and heating.min(axis=None) >= 16.5
        values = heating.iloc[:, 0].nunique()
        assert values == 2
        weekend = heating[spec.starts.day_of_week >= 5]
        assert (weekend.nunique() == 1).all() == (spec.excitation == "schedule")


def test_schedules_hold_what_they_follow(trials):
    starts = pd.date_range("2023-01-06", periods=2 * 288, freq="5min")
    values = np.where(starts < "2023-01-06 07:05", 18.0, 21.5)
    fields = [entry["field"] for entry in trials("settings").schedule(values, starts)["data"]]
    assert fields == [
        "Through: 1/5", "For: AllDays", "Until: 24:00", 18.0,
        "Through: 1/6", "For: AllDays", "Until: 07:05", 18.0, "Until: 24:00", 21.5,
        "Through: 1/7", "For: AllDays", "Until: 24:00", 21.5,
        "Through: 12/31", "For: AllDays", "Until: 24:00", 21.5,
    ]  # fmt: skip


def test_weather_lies_between_its_hours_and_the_null_gets_neither_sun_nor_sky(trials, weather, tmp_path):
    start, hourly = pd.Timestamp("2023-03-01"), weather.hourly
    air, sun = (
        weather.at(f"{point}_sensor", start, 24) for point in ("outside_air_temperature", "direct_normal_irradiance")
    )
    first = 59 * 24  # hours before 1 March; the record of an hour stands for its end, that of the sun for its middle
    assert air[11] == pytest.approx(hourly["outside_air_temperature_sensor"][first])
    assert sun[5] == pytest.approx(hourly["direct_normal_irradiance_sensor"][first])
    late = weather.station(start - pd.Timedelta(minutes=40), 24)
    np.testing.assert_allclose(late["outside_air_temperature_sensor"][8:], air[:16])
    for share in (False, True):
        trials("weather").write_weather(tmp_path / "site.epw", weather, sun=share, sky=float(share))
        row = (tmp_path / "site.epw").read_text().splitlines()[8 + 5].split(",")
        assert (row[14] == "0") != share and row[20] == "520"
        emitted = 5.670374e-8 * (float(row[6]) + 273.15) ** 4
        true = hourly["horizontal_infrared_irradiance_sensor"][5]
        assert float(row[12]) == pytest.approx(true if share else emitted, rel=1e-3)


def test_transfer_functions_that_make_heat_are_seen(trials):
    text = (
        " Construction CTF,GOOD,   1,   2\n CTF,   1,   0.5,   0.25,   0.5,   0.5\n CTF,   0,   1.5,   1.75,   1.5\n"
        " Construction CTF,BAD,   2,   2\n CTF,   1,   0.5,   0.25,   0.5,   0.5\n CTF,   0,   1.5,   1.8,   1.5\n"
    )
    assert trials("plant").heat_made(text) == pytest.approx({"GOOD": 0.0, "BAD": 22.0 * 0.05 / 0.5})


def test_every_effect_is_covered_here(trials):
    effects = trials("draw_effects")
    assert set(EFFECTS) == set(effects.CATALOGUE) | set(effects.OUTSIDE_CATALOGUE)


def test_the_null_has_walls_windows_slabs_and_ideal_air_only(trials, null, weather):
    made = plant(trials, null, weather)
    assert (made.sun, made.sky) == (False, 0.0)
    extra = ("ZoneInfiltration", "ZoneVentilation", "ZoneMixing", "InternalMass", "ElectricEquipment", "OtherEquipment")
    assert not [kind for kind in made.objects if kind.startswith(extra)]
    behind = {
        (s["surface_type"], s["outside_boundary_condition"]) for s in made.objects["BuildingSurface:Detailed"].values()
    }
    assert behind == {("Wall", "Outdoors"), ("Wall", "Surface"), ("Floor", "OtherSideCoefficients"),
                      ("Ceiling", "OtherSideCoefficients")}  # fmt: skip


@pytest.mark.parametrize("name", sorted(CLASSES))
def test_an_effect_of_the_building_touches_its_own_objects(trials, null, weather, name):
    before, after = plant(trials, null, weather), plant(trials, with_effect(trials, null, name), weather)
    touched = {k for k in before.objects | after.objects if before.objects.get(k) != after.objects.get(k)}
    assert touched == CLASSES[name]
    assert after.sun == (name in ("solar_gain", "solar_opaque")) and (after.sky > 0.0) == (name == "longwave_sky")
    moved = [not b.equals(a) for b, a in zip(before.setpoints, after.setpoints, strict=True)]
    assert moved == [name == "sensor_bias"] * 2


@pytest.mark.parametrize("name", sorted(REPORTED))
def test_a_fault_changes_its_own_columns(trials, null, weather, name):
    spec = with_effect(trials, null, name)
    before, after = reported(trials, null, weather), reported(trials, spec, weather)
    differing = {str(c) for c in before if not np.allclose(before[c], after[c], rtol=1e-6, atol=1e-6)}
    assert differing and all(REPORTED[name] in column for column in differing)
    (effect,) = spec.effects
    where = {c.partition("/")[0].removeprefix("VAV_") for c in differing} - {"weather_station"}
    assert where <= set(effect.zones or spec.zone_names)
    if name in ("sensor_bias", "flow_gain"):
        zone, number = next(iter(effect.parameters["bias_K" if name == "sensor_bias" else "gain"].items()))
        one, two = (table[f"VAV_{zone}/{REPORTED[name]}"].astype(float) for table in (before, after))
        on = one > 0.01
        shift = (two - one).mean() if name == "sensor_bias" else (two[on] / one[on]).mean() - 1.0
        assert shift == pytest.approx(number, abs=2e-3)


def test_metered_heat_is_that_of_the_terminal_or_what_it_believes_to_give(trials, null, weather):
    spec = with_effect(trials, null, "capacity_limit")
    (effect,) = spec.effects
    zone = effect.zones[0]
    full = spec.terminal.heating_power * spec.layout.areas()[zone]
    left = (1.0 - effect.parameters["lost_share"]) * full

    def alike(values: list[float]) -> pd.DataFrame:
        return pd.DataFrame({z: values for z in spec.zone_names})

    heat, wanted = alike([left, left, 0.5 * left, 0.0]), alike([2.0 * full, 1.1 * left, 0.5 * left, 0.0])
    air = alike([20.0] * 4)
    run = trials("plant").Run(air, heat, heat, wanted, pd.DataFrame(), 0.0)
    readings = trials("readings").Readings(plant(trials, spec, weather), run)
    metered = 1006.0 * readings.flow * (readings.discharge - readings.temperature)
    np.testing.assert_allclose(metered[zone], [full, 1.1 * left, 0.5 * left, 0.0])
    other = next(z for z in spec.zone_names if z not in effect.zones)
    np.testing.assert_allclose(metered[other], heat[other])


def test_labels_hold_what_scores_read(trials, draw, script):
    for kind in ("null", "single", "outside", "pair"):
        spec = draw(4, kind)
        label = json.loads(json.dumps(spec.label({"seconds": 1.0})))
        assert label["twins"] == [twin.name for twin in spec.twins()] and label["world"] == "ideal_air"
        answer: dict[str, Any] = {"verdict": "named", "which": [], "gap": {"mae": 0.3}}
        trial = script("_trial_scores").trial_of(spec.name, label, answer, [0.1] * len(spec.effects))
        assert trial.kind == kind and trial.building.endswith("zones") and trial.counted
        assert trial.unexplained_is_right == (kind == "outside")


@pytest.mark.energyplus
@needs_energyplus
def test_air_balances_and_nothing_else_heats_it_in_energyplus(trials, null):
    account = {name: f"Zone Air Heat Balance {name} Rate" for name in (
        "Internal Convective Heat Gain", "Surface Convection", "Interzone Air Transfer", "Outdoor Air Transfer",
        "Air Energy Storage")}  # fmt: skip
    outside, sun = (
        "Surface Outside Face Conduction Heat Transfer Rate",
        "Surface Outside Face Solar Radiation Heat Gain Rate",
    )
    run = trials("plant").simulate(trials("trial").build(null), [*account.values(), outside, sun])
    zones = [zone.upper() for zone in null.zone_names]
    terms = {name: run.outputs.xs(variable, axis=1, level=1)[zones].to_numpy() for name, variable in account.items()}
    delivered, storage = run.delivered.to_numpy(), terms.pop("Air Energy Storage")
    scale = np.abs(delivered).mean()
    assert scale > 50.0
    # EnergyPlus' storage is a backward difference of third order; where set points jump, it cuts its steps
    left, told = np.abs(sum(terms.values()) + delivered - storage), np.abs(run.heat.to_numpy() - delivered)
    assert np.quantile(left, 0.9) < 5e-3 * scale and left.mean() < 0.1 * scale
    assert np.quantile(told, 0.9) < 1e-3 * scale and run.heat_deviation < 0.1
    for name in ("Internal Convective Heat Gain", "Interzone Air Transfer", "Outdoor Air Transfer"):
        assert np.abs(terms[name]).max() < 1e-9 * scale
    behind = run.outputs.xs(outside, axis=1, level=1)
    slabs = [name for name in behind if name.endswith((" FLOOR", " CEILING"))]
    assert behind[slabs].abs().mean(axis=None) < 1e-3 * scale  # faces without flow
    assert run.outputs.xs(sun, axis=1, level=1).abs().max(axis=None) < 1e-6
    assert run.heat_made < 0.06


@pytest.mark.energyplus
@needs_energyplus
def test_a_trial_is_the_same_twice_and_tells_nothing(trials, draw, tmp_path):
    world, spec = trials("world").WORLD, draw(0, "single", days=1)
    with pytest.raises(ValueError, match="outside of the cases"):
        world.make(spec, tmp_path / "cases", tmp_path / "cases" / "sealed")
    made = []
    for again in ("one", "two"):
        cases, sealed = tmp_path / again / "cases", tmp_path / again / "sealed"
        assert world.make(spec, cases, sealed) and not world.make(spec, cases, sealed)
        made.append(load_case(cases / spec.name))
    pd.testing.assert_frame_equal(made[0].telemetry.frame, made[1].telemetry.frame)
    assert set(made[0].building.zone_names) == set(spec.zone_names) and len(made[0].telemetry.frame) == 288
    assert not made[0].zone_heat().isna().any(axis=None)
    for zone, area in zone_floor_areas(made[0].building.geometry).items():
        assert area == pytest.approx(spec.layout.areas()[zone], rel=0.02)  # where walls meet, the case counts cells
    for path in (tmp_path / "one" / "cases" / spec.name).iterdir():
        assert not [name for name in EFFECTS if name.encode() in path.read_bytes()]


@pytest.mark.long
@pytest.mark.energyplus
@needs_energyplus
@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_is_made_and_changes_the_telemetry(trials, null, name, tmp_path):
    spec = with_effect(trials, null, name)
    world = trials("world").WORLD
    for one in (null, spec):
        world.make(one, tmp_path / "cases", tmp_path / "sealed")
    frames = [load_case(tmp_path / "cases" / one.name).telemetry.frame for one in (null, spec)]
    assert not np.allclose(*frames, rtol=1e-4, atol=1e-4)  # noise is the same
