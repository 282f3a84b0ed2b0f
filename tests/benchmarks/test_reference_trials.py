"""Trials of EnergyPlus' reference buildings: draws, variants and faults, and a whole trial where EnergyPlus is there."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mpc.adapters.energyplus.input import InputFile
from thermal import load_case

needs_energyplus = pytest.mark.skipif(
    importlib.util.find_spec("pyenergyplus") is None, reason="needs EnergyPlus: pip install -e .[energyplus]"
)


@pytest.fixture(scope="module")
def trials(package: Callable[[str], ModuleType]) -> Callable[[str], ModuleType]:
    return lambda name: package(f"reference_trials.{name}")


@pytest.fixture
def small() -> InputFile:
    """One zone with a wall, a window, people, a leak and a floor on the ground."""
    wall = {"surface_type": "Wall", "construction_name": "OUTER", "outside_boundary_condition": "Outdoors",
            "sun_exposure": "SunExposed", "zone_name": "room"}  # fmt: skip
    floor = wall | {"surface_type": "Floor", "construction_name": "slab", "outside_boundary_condition": "Ground"}
    content: dict[str, dict[str, dict[str, Any]]] = {
        "Zone": {"room": {}},
        "BuildingSurface:Detailed": {"wall": wall, "floor": floor},
        "Construction": {"outer": {"outside_layer": "Brick"}, "slab": {"layer_2": "carpet", "outside_layer": "brick"}},
        "Material": {"brick": {"solar_absorptance": 0.6}},
        "WindowMaterial:SimpleGlazingSystem": {"glass": {"u_factor": 2.0, "solar_heat_gain_coefficient": 0.4}},
        "People": {"some": {"number_of_people_schedule_name": "day", "floor_area_per_person": 10.0}},
        "Lights": {"some": {"schedule_name": "day", "watts_per_floor_area": 8.0}},
        "ZoneInfiltration:DesignFlowRate": {"leak": {"schedule_name": "day", "air_changes_per_hour": 0.5}},
        "ZoneMixing": {"kitchen": {"schedule_name": "day"}},
    }
    return InputFile(content, "small")


def test_air_is_metered_where_it_enters_and_followed_into_a_plenum(trials):
    content: dict[str, dict[str, dict[str, Any]]] = {
        "Zone": {"Room": {}, "plenum": {}},
        "NodeList": {"room inlets": {"nodes": [{"node_name": "box out"}, {"node_name": "coil out"}]}},
        "ZoneHVAC:EquipmentConnections": {"1": {
            "zone_name": "ROOM", "zone_air_inlet_node_or_nodelist_name": "room inlets",
            "zone_return_air_node_or_nodelist_name": "room return",
        }},
        "AirTerminal:SingleDuct:VAV:Reheat": {"box": {"air_outlet_node_name": "BOX OUT"}},
        "ZoneHVAC:FourPipeFanCoil": {"coil": {"air_outlet_node_name": "coil out"}},
        "AirLoopHVAC:ReturnPlenum": {"p": {"zone_name": "plenum", "nodes": [{"inlet_node_name": "Room return"}]}},
    }  # fmt: skip
    buildings, building = trials("buildings"), InputFile(content, "made up")
    assert [(i.device, i.kind, i.node) for i in buildings.inlets(building)] == [
        ("VAV_Room", "vav", "box out"), ("FCU_Room", "fan_coil", "coil out")
    ]  # fmt: skip
    assert buildings.served(building) == ("Room",)
    assert [(a.source, a.target, a.device, a.fraction) for a in buildings.airflows(building)] == [
        ("Room", "plenum", "VAV_Room", 1.0), ("Room", "plenum", "FCU_Room", 1.0)
    ]  # fmt: skip
    del content["ZoneHVAC:FourPipeFanCoil"]
    with pytest.raises(trials("buildings").TrialError, match="expected a device whose air enters Room at 'coil out'"):
        buildings.inlets(building)


def test_building_weather_and_sensors_depend_on_the_seed_alone(trials):
    draw = trials("specification").draw_spec
    for seed in range(16):
        null, single = draw(seed, "null"), draw(seed, "single")
        assert single.twin() == null and null.wanted == () and len(single.wanted) == 1
        assert null.name != single.name != draw(seed, "single", confirmation=True).name
    assert {draw(seed, "null").building for seed in range(8)} == set(trials("buildings").REFERENCES)
    with pytest.raises(ValueError, match="expected a seed"):
        draw(0, "pair")


def test_effects_that_a_building_cannot_have_are_not_drawn(trials):
    specs = [trials("specification").draw_spec(seed, "single") for seed in range(400)]
    leaks = {s.building for s in specs if s.wanted[0][0] == "valve_leak"}
    assert leaks == {"medium_office", "hotel", "school"}
    assert {s.wanted[0][0] for s in specs} == set(trials("specification").EFFECTS)


def test_a_label_has_what_scoring_reads(trials, script):
    spec = trials("specification").draw_spec(3, "single")
    effect = trials("specification").Effect("flow_gain", 1.2, ("a",), {"gain": 0.2})
    label = json.loads(json.dumps(spec.label((effect,), {"seconds": 1.0})))
    assert label["twins"] == [spec.twin().name] and label["world"] == "reference"
    answer = {"verdict": "named", "which": [], "gap": {"mae": 0.3}}
    trial = script("_trial_scores").trial_of(spec.name, label, answer, [0.1])
    assert trial.truths == (frozenset({"flow_gain"}),) and trial.zones == {"a"} and trial.counted


def test_a_null_has_nothing_that_the_baseline_leaves_out(trials, small):
    null = trials("variant").variant(small, ())
    wall, floor = (null["BuildingSurface:Detailed"][name] for name in ("wall", "floor"))
    assert null["WindowMaterial:SimpleGlazingSystem"]["glass"]["solar_heat_gain_coefficient"] == 0.01
    outer = null["Construction"][wall["construction_name"]]["outside_layer"]
    assert null["Material"][outer]["solar_absorptance"] == 0.001
    assert null["Construction"][floor["construction_name"]] == {
        "outside_layer": "trial insulation", "layer_2": "brick", "layer_3": "carpet"
    }  # fmt: skip
    only_design = trials("variant").DESIGN_ONLY
    assert null["People"]["some"]["number_of_people_schedule_name"] == only_design
    assert null["Lights"]["some"]["schedule_name"] == only_design
    assert null["ZoneInfiltration:DesignFlowRate"]["leak"]["schedule_name"] == only_design
    assert "ZoneMixing" not in null and "WeatherProperty:SkyTemperature" in null
    assert small.content["People"]["some"]["number_of_people_schedule_name"] == "day"  # the source is left alone


def test_an_effect_is_the_buildings_own_times_its_strength(trials, small):
    variant, effect = trials("variant").variant, trials("specification").Effect
    gains = variant(small, (effect("internal_gains", 0.5),))
    assert gains["People"]["some"] == {"number_of_people_schedule_name": "day", "floor_area_per_person": 20.0}
    assert gains["Lights"]["some"] == {"schedule_name": "day", "watts_per_floor_area": 4.0}
    assert variant(small, (effect("infiltration", 1.5),))["ZoneInfiltration:DesignFlowRate"]["leak"] == {
        "schedule_name": "day", "air_changes_per_hour": 0.75
    }  # fmt: skip
    grounded = variant(small, (effect("ground_exchange", 1.0),))
    assert grounded["BuildingSurface:Detailed"]["floor"]["construction_name"] == "slab"


@pytest.mark.parametrize(("name", "glass", "wall"), [("solar_gain", 0.2, 0.001), ("solar_opaque", 0.01, 0.3)])
def test_the_sun_goes_where_the_effect_is(trials, small, name, glass, wall):
    made = trials("variant").variant(small, (trials("specification").Effect(name, 0.5),))
    assert made["WindowMaterial:SimpleGlazingSystem"]["glass"]["solar_heat_gain_coefficient"] == glass
    surface = made["BuildingSurface:Detailed"]["wall"]
    layer = made["Construction"][surface["construction_name"]]["outside_layer"]
    assert made["Material"][layer]["solar_absorptance"] == wall and surface["sun_exposure"] == "SunExposed"
    assert made["Material"]["brick"]["solar_absorptance"] == 0.6  # what looks inside keeps its own
    assert made["BuildingSurface:Detailed"]["floor"]["construction_name"] == "slab insulated"


def test_faults_change_what_is_reported_by_what_the_label_says(trials):
    effects, spec = trials("effects"), trials("specification")
    stamps = pd.date_range("2023-01-01", periods=4, freq="10min")
    run = trials("plant").Run(
        temperature=pd.DataFrame({"a": 20.0, "b": [10.0, 12.0, 12.0, 12.0]}, stamps),
        flow=pd.DataFrame({"VAV_a": [0.0, 0.1, 0.1, 0.1]}, stamps),
        discharge=pd.DataFrame({"VAV_a": [20.0, 40.0, 40.0, 40.0]}, stamps),
        heating=pd.DataFrame(), cooling=pd.DataFrame(), balance={},
        station=pd.DataFrame({"wind_speed_sensor": [1.0, 2.0, 3.0, 4.0]}, stamps),
    )  # fmt: skip

    def read(name: str, zones: tuple[str, ...] = ("a",), **numbers: Any) -> Any:
        readings = effects.Readings(run, {"VAV_a": "a"}, {"a": 50.0, "b": 50.0}, 600.0)
        effects.apply_faults(readings, [spec.Effect(name, 1.0, zones, numbers)])
        return readings

    np.testing.assert_allclose(read("sensor_bias", bias_K={"a": 0.5}).temperature["a"], 20.5)
    lagged = read("sensor_lag", (), time_constant_s=600.0).temperature["b"]
    np.testing.assert_allclose(lagged, 12.0 - 2.0 * np.exp([-0.0, -1.0, -2.0, -3.0]) * [1, 1, 1, 1])
    np.testing.assert_allclose(read("flow_gain", gain=0.2).flow["VAV_a"], [0.0, 0.12, 0.12, 0.12])
    leaked = read("valve_leak", power_W_m2=10.06).discharge["VAV_a"]  # 503 W in 100.6 W/K: 5 K
    np.testing.assert_allclose(leaked, [20.0, 35.0, 35.0, 35.0])
    ducted = read("duct_loss", ntu=np.log(2.0)).discharge["VAV_a"]  # the void is at 16 degC
    np.testing.assert_allclose(ducted, [20.0, 64.0, 64.0, 64.0])
    np.testing.assert_allclose(read("clock_shift", (), steps=1).station["wind_speed_sensor"], [1.0, 1.0, 2.0, 3.0])


@pytest.mark.energyplus
@needs_energyplus
def test_what_is_asked_for_changes_nothing(trials, monkeypatch):
    """Windows without sun made heat come and go with the outputs that were asked for."""
    spec = trials("specification").replace(
        trials("specification").draw_spec(5, "null", days=2),
        steps_per_hour=4,
        weather=trials("specification").WEATHER[0],
    )
    plant, building = trials("plant"), trials("buildings").source("restaurant")
    content = trials("variant").variant(building, ())
    whole = plant.simulate(spec, content)
    monkeypatch.setattr(plant, "BALANCE", {"delivered": plant.BALANCE["delivered"]})
    fewer = plant.simulate(spec, content)
    pd.testing.assert_frame_equal(whole.balance["delivered"], fewer.balance["delivered"], rtol=1e-6)
    pd.testing.assert_frame_equal(whole.temperature, fewer.temperature, rtol=1e-9)


@pytest.mark.energyplus
@needs_energyplus
def test_a_trial_is_a_case_that_tells_nothing(trials, tmp_path):
    world, spec = trials("world").WORLD, trials("specification").draw_spec(5, "single", days=2)
    spec = trials("specification").replace(spec, wanted=(("infiltration", 1.0),), steps_per_hour=4)
    with pytest.raises(ValueError, match="outside of the cases"):
        world.make(spec, tmp_path / "cases", tmp_path / "cases" / "sealed")
    assert world.make(spec, tmp_path / "cases", tmp_path / "sealed")
    case = load_case(tmp_path / "cases" / spec.name)
    assert case.building.zone_names == ("Dining", "Kitchen") and case.building.measured_boundaries == ("attic",)
    assert case.building.geometry_quality == "surveyed" and case.step == 900.0 and len(case.telemetry.frame) == 192
    assert not case.zone_heat().isna().any(axis=None)
    for path in (tmp_path / "cases" / spec.name).iterdir():
        assert not [name for name in trials("specification").EFFECTS if name.encode() in path.read_bytes()]
    run = json.loads((tmp_path / "sealed" / f"{spec.name}.json").read_text())["run"]
    # the account closes, heat is metered, and there is what the trial holds and nothing else
    assert run["left"] < 1e-3 and run["heat_deviation"] < 0.02
    assert run["terms"]["outdoor_air"] > 50.0 and run["terms"]["gains"] == run["terms"]["zones"] == 0.0
    assert not world.make(spec, tmp_path / "cases", tmp_path / "sealed")
