"""The command that makes blind trials: seeds, seals, resuming, and whole trials where EnergyPlus is installed."""

from __future__ import annotations

import argparse
import importlib.util
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from thermal import load_case

needs_energyplus = pytest.mark.skipif(
    importlib.util.find_spec("pyenergyplus") is None, reason="needs EnergyPlus: pip install -e .[energyplus]"
)


@pytest.fixture(scope="module")
def trials(package: Callable[[str], ModuleType]) -> Callable[[str], ModuleType]:
    return lambda name: package(f"energyplus_trials.{name}")


@pytest.fixture(scope="module")
def command(trials, script: Callable[[str], ModuleType]) -> ModuleType:
    trials("world")
    helpers = ("_table", "_code", "_seeds", "_trial_scores", "_trial_answers", "_leave_one_out", "spoilt_buildings")
    for name in (*helpers, "_trial_worlds", "_worlds"):
        script(name)
    return script("blind_trials")


@pytest.fixture(scope="module")
def small(trials):
    """A building of one floor, two days of it in January."""
    draw = trials("drawing").draw_spec
    specs = (draw(seed, "null", days=2) for seed in range(200))
    spec = next(s for s in specs if s.layout.floors == 1 and len(s.layout.zones) == 4)
    newark = next(s for s in trials("sites").WEATHER_FILES if "Newark" in s.source)
    place = replace(
        spec.climate, source=newark.source, latitude=newark.latitude, longitude=newark.longitude,
        elevation=newark.elevation, utc_offset=newark.utc_offset, start="2023-01-18",
    )  # fmt: skip
    return replace(spec, climate=place, use=replace(spec.use, excitation="schedule"))


def test_seeds_are_a_range(command):
    assert list(command.seed_range("3-5")) == [3, 4, 5]
    assert list(command.seed_range("7")) == [7]
    for text in ("5-3", "a-b", ""):
        with pytest.raises(argparse.ArgumentTypeError, match="expected seeds such as"):
            command.seed_range(text)


def test_labels_are_not_put_where_the_diagnosis_looks(trials, small, tmp_path):
    for sealed in (tmp_path / "cases", tmp_path / "cases" / "sealed"):
        with pytest.raises(ValueError, match="outside of the cases"):
            trials("world").WORLD.make(small, tmp_path / "cases", sealed)


def test_a_trial_that_is_there_is_left_alone(trials, small, script, tmp_path):
    case, label = script("_sealed").places(small.name, tmp_path / "cases", tmp_path / "sealed")
    case.mkdir(parents=True)
    script("_sealed").seal(label, {})
    assert not trials("world").WORLD.make(small, tmp_path / "cases", tmp_path / "sealed")


def test_the_label_holds_the_whole_truth(trials, small, script, tmp_path):
    spec = trials("draw_effects").with_effect(small, "sensor_bias", np.random.default_rng(0), 1.0)
    script("_sealed").seal(tmp_path / "label.json", trials("folder").label(spec, {"seconds": 1.0}))
    label = json.loads((tmp_path / "label.json").read_text())
    assert label["name"] == spec.name
    assert label["effects"][0]["name"] == "sensor_bias"
    assert label["effects"][0]["parameters"]["bias_K"] == dict(spec.effects[0].parameters["bias_K"])
    assert label["world"] == "office" and label["twins"] == [small.twin().name]
    assert label["layout"]["floors"] == 1 and label["run"] == {"seconds": 1.0}


def test_only_trials_of_which_two_effects_show_are_asked_for(trials, script, command, tmp_path):
    """Three pairs: both effects leave a gap, one does, and one whose twin was not measured."""
    answers = script("_trial_answers")
    office = command.world("office")
    specs = [spec for seed in range(3) for spec in office.draw(seed, "pair")]
    pairs_less_one = [spec for seed in range(3) for spec in office.draw(seed, "without")]
    assert pairs_less_one == [twin for spec in specs for twin in trials("drawing").without(spec)]
    (tmp_path / "gaps").mkdir()
    for spec, least in zip(specs, (0.06, 0.04, None), strict=True):
        script("_sealed").seal(tmp_path / "sealed" / f"{spec.name}.json", trials("folder").label(spec, {}))
        twins = trials("drawing").without(spec)
        gaps = {spec.name: 0.5, **{t.name: 0.5 - 0.06 for t in twins[:1]}}
        gaps |= {t.name: 0.5 - least for t in twins[1:] if least is not None}
        for name, gap in gaps.items():
            (tmp_path / "gaps" / f"{name}.json").write_text(json.dumps({"gap": {"mae": gap}}))
    with pytest.raises(SystemExit, match="expected the gap of"):
        answers._of_several_that_show(tmp_path)
    (tmp_path / "sealed" / f"{specs[2].name}.json").unlink()
    assert answers._of_several_that_show(tmp_path) == {specs[0].name}


@pytest.mark.energyplus
@needs_energyplus
def test_a_trial_is_a_case_that_tells_nothing(trials, command, small, tmp_path):
    spec = trials("draw_effects").with_effect(small, "internal_gains", np.random.default_rng(0), 1.0)
    assert command.make(command.world("office"), [spec], tmp_path, 1) == []
    folder: Path = tmp_path / "cases" / spec.name
    case = load_case(folder)
    assert set(case.building.zone_names) == set(spec.zone_names) and case.step == 300.0
    assert len(case.telemetry.frame) == 2 * 288
    assert not case.zone_heat().isna().any(axis=None)
    assert {path.name for path in folder.iterdir()} == {"building.yaml", "plan_F1.csv", "telemetry.parquet"}
    effects = trials("draw_effects")
    for path in folder.iterdir():
        found = path.read_bytes()
        assert not [name for name in effects.CATALOGUE | effects.OUTSIDE if name.encode() in found]
    label = json.loads((tmp_path / "sealed" / f"{spec.name}.json").read_text())
    assert label["run"]["warnings"] == [] and label["run"]["heat_deviation"] < 1e-3
    assert not trials("world").WORLD.make(spec, tmp_path / "cases", tmp_path / "sealed")


@pytest.mark.energyplus
@needs_energyplus
def test_the_null_balances_and_holds_nothing_else(trials, small):
    account = trials("audit").audit(trials("trial").build(replace(small, days=7)))
    assert account.air < 1e-6
    assert account.building < 5e-3
    off = {name: account.terms[name] for name in ("gains", "zones", "outdoor_air", "sun_through_glass", "sun_on_walls")}
    assert off == dict.fromkeys(off, 0.0)
    assert account.terms["film"] < 1e-9 and account.terms["sky"] < 1e-3
    assert account.terms["heat"] > 300.0


@pytest.mark.long
@pytest.mark.energyplus
@needs_energyplus
@pytest.mark.parametrize(
    ("name", "own"),
    [
        ("solar_gain", "sun_through_glass"),
        ("solar_opaque", "sun_on_walls"),
        ("longwave_sky", "sky"),
        ("wind_film", "film"),
        ("infiltration", "outdoor_air"),
        ("internal_gains", "gains"),
        ("zone_mixing", "zones"),
    ],
)
def test_an_effect_adds_its_own_term(trials, small, name, own):
    spec = trials("draw_effects").with_effect(small, name, np.random.default_rng(0), 1.0)
    terms = trials("audit").audit(trials("trial").build(spec)).terms
    least = {"film": 0.5, "sky": 2.0}
    # 0.1 % of the sun is absorbed by walls that should take none, and 1 % by panes that should let none through
    off = {"sun_through_glass": 1.0, "sun_on_walls": 4.0, "sky": 1e-3, "film": 1e-9}
    assert terms[own] > least.get(own, 20.0)
    for other in {"gains", "zones", "outdoor_air", *off} - {own}:
        assert terms[other] <= off.get(other, 0.0), other


@pytest.mark.energyplus
@needs_energyplus
def test_a_building_that_energyplus_refuses_is_an_error(trials, small):
    building = trials("trial").build(small)
    building.objects["Material"]["brick 0 mm"] = {"thickness": -1.0}
    with pytest.raises(trials("errors").EnergyPlusRunError, match="without severe errors"):
        trials("plant").simulate(building)
