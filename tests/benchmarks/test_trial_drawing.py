"""Trials are drawn from their seeds: reproducible, streams apart, twins alike, plans that the library accepts."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pandas as pd
import pytest

from thermal.case.building import FloorPlan, FloorPlans
from thermal.case.plan import check_plan, facade_areas, zone_floor_areas

SEEDS = range(60)


@pytest.fixture(scope="module")
def drawing(package: Callable[[str], ModuleType]) -> ModuleType:
    return package("energyplus_trials.drawing")


@pytest.fixture(scope="module")
def plan(package: Callable[[str], ModuleType]) -> ModuleType:
    return package("energyplus_trials.plan")


@pytest.fixture(scope="module")
def model(package: Callable[[str], ModuleType]) -> ModuleType:
    return package("energyplus_trials.model")


@pytest.fixture(scope="module")
def effects(package: Callable[[str], ModuleType]) -> ModuleType:
    return package("energyplus_trials.draw_effects")


def test_a_seed_says_everything(drawing):
    for kind in ("null", "single", "pair", "outside"):
        assert drawing.draw_spec(5, kind) == drawing.draw_spec(5, kind)
        assert json.loads(drawing.draw_spec(5, kind).to_json())["seed"] == 5


def test_development_and_confirmation_share_nothing(drawing):
    drawn = [[drawing.draw_spec(seed, "single", confirmation=c) for seed in SEEDS] for c in (False, True)]
    names = [{spec.name for spec in specs} for specs in drawn]
    assert not names[0] & names[1]
    assert not {s.climate.seed for s in drawn[0]} & {s.climate.seed for s in drawn[1]}
    assert not {s.use.seed for s in drawn[0]} & {s.use.seed for s in drawn[1]}
    assert len(names[0] | names[1]) == 2 * len(SEEDS)


@pytest.mark.parametrize("kind", ["single", "pair", "outside"])
def test_the_null_of_a_seed_is_the_twin_of_its_other_trials(drawing, kind):
    for seed in SEEDS:
        assert drawing.draw_spec(seed, kind).twin() == drawing.draw_spec(seed, "null")


def test_names_say_nothing(drawing):
    for kind in ("null", "single", "pair", "outside"):
        name = drawing.draw_spec(1, kind).name
        assert name.startswith("trial_") and len(name) == 16 and kind not in name


def test_effects_are_as_many_and_as_strong_as_their_kind_says(drawing, effects):
    counts = {"null": {0}, "single": {1}, "pair": {2, 3}, "outside": {1}}
    seen = set()
    for kind, allowed in counts.items():
        for seed in SEEDS:
            spec = drawing.draw_spec(seed, kind)
            assert len(spec.effects) in allowed
            assert len({e.name for e in spec.effects}) == len(spec.effects)
            for effect in spec.effects:
                assert effects.STRENGTHS[0] - 1e-3 <= effect.strength <= effects.STRENGTHS[1] + 1e-3
                assert set(effect.zones) <= set(spec.zone_names)
                assert effect.unexplained_is_right == (kind == "outside")
                assert kind == "outside" or effect.answers == (effect.name,)
                assert effects.possible(spec, effect.name) or kind == "outside"
                seen.add(effect.name)
            assert not spec.has("blinds") or spec.has("solar_gain")
    assert seen >= set(effects.CATALOGUE)


def test_an_unknown_kind_is_refused(drawing):
    with pytest.raises(ValueError, match="kind"):
        drawing.draw_spec(0, "everything")
    with pytest.raises(ValueError, match="seed of 0 or more"):
        drawing.draw_spec(-1, "null")


def test_all_kinds_of_building_are_drawn(drawing):
    specs = [drawing.draw_spec(seed, "null") for seed in range(200)]
    assert {s.layout.floors for s in specs} == {1, 2, 3}
    assert {len(s.layout.zones) for s in specs} == {3, 4, 5, 6, 7, 8}
    assert {s.fabric.wall for s in specs} == {"mass_inside", "mass_outside", "light"}
    assert {s.use.excitation for s in specs} == {"schedule", "prbs", "float"}
    assert len({s.climate.source for s in specs}) == 17
    assert {s.climate.start[5:7] for s in specs} == {f"{month:02d}" for month in range(1, 13)} - {"12"}


def _plans(spec, plan) -> FloorPlans:
    floors = [
        FloorPlan(f"F{f + 1}", spec.layout.height, plan.tokens(spec.layout.zones, f)) for f in range(spec.layout.floors)
    ]
    return FloorPlans(plan.CELL_SIZE, tuple(floors), plan.glazing(spec.layout))


def test_the_plan_is_the_plant_s(drawing, plan):
    """Areas of the case format (cells) against those of EnergyPlus (rectangles), and facades against panes."""
    for seed in SEEDS:
        spec = drawing.draw_spec(seed, "null")
        plans = _plans(spec, plan)
        check_plan(plans.floors[0].tokens, "plan")
        areas, facades = zone_floor_areas(plans), facade_areas(plans)
        for zone, outline in plan.rectangles(spec.layout.zones).items():
            assert areas[f"F1_{zone}"] == pytest.approx(outline.area, rel=0.015)
        for segment in plan.segments(spec.layout.zones):
            if segment.other is None:
                expected = facades[f"F1_{segment.zone}"][segment.side]
                assert segment.length * spec.layout.height == pytest.approx(expected, abs=spec.layout.height * 0.26)
        for zone, panes in plan.glazing(spec.layout).items():
            assert all(0.0 < area < facades[zone][side] for side, area in panes.items())


def test_partitions_match_from_both_sides(drawing, plan):
    for seed in SEEDS:
        pieces = plan.segments(drawing.draw_spec(seed, "null").layout.zones)
        lengths = {(s.zone, s.other): s.length for s in pieces if s.other}
        assert lengths and all(lengths[b, a] == pytest.approx(length) for (a, b), length in lengths.items())


def test_an_outline_is_closed(drawing, plan):
    """Outward normals times lengths of a zone's walls add up to nothing."""
    normals = {"north": (0, 1), "south": (0, -1), "east": (1, 0), "west": (-1, 0)}
    for seed in SEEDS:
        layout = drawing.draw_spec(seed, "null").layout
        total = {z.name: np.zeros(2) for z in layout.zones}
        for s in plan.segments(layout.zones):
            total[s.zone] += s.length * np.array(normals[s.side])
        assert all(np.abs(rest).max() <= plan.CELL_SIZE + 1e-9 for rest in total.values())


def test_twins_of_a_pair_lack_one_effect_each(drawing):
    for seed in range(6):
        spec = drawing.draw_spec(seed, "pair")
        twins = drawing.without(spec)
        assert len({t.name for t in twins} | {spec.name}) == len(spec.effects) + 1
        for effect, twin in zip(spec.effects, twins, strict=True):
            assert [e for e in spec.effects if e is not effect] == list(twin.effects)
            assert twin.twin() == spec.twin()


def test_uneven_offices_are_the_same_but_for_films_and_furniture(drawing: ModuleType, model: ModuleType) -> None:
    even, uneven = (drawing.draw_spec(7, "null", uneven=k) for k in (False, True))
    assert even.name != uneven.name
    assert dataclasses.replace(uneven, fabric=dataclasses.replace(uneven.fabric, uneven=False)) == even
    plain, other = (model.null_model(s, pd.Timestamp("2017-01-02"), pd.Timestamp("2017-01-03")) for s in (even, uneven))
    assert "SurfaceProperty:ConvectionCoefficients:MultipleSurface" not in other
    assert other["SurfaceConvectionAlgorithm:Outside"]["outside"]["algorithm"] == "DOE-2"
    areas = [[m["surface_area"] for m in o["InternalMass"].values()] for o in (plain, other)]
    shares = np.array(areas[1]) / np.array(areas[0])
    assert len(shares) == len(even.zone_names) and 0.1 < np.std(np.log(shares)) < 1.0
    changed = {kind for kind in plain if plain[kind] != other.get(kind)} | (set(other) - set(plain))
    assert changed <= {"InternalMass", "SurfaceConvectionAlgorithm:Inside", "SurfaceConvectionAlgorithm:Outside",
                       "SurfaceProperty:ConvectionCoefficients:MultipleSurface"}  # fmt: skip
