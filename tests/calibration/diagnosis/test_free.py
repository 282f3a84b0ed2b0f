"""Diagnosis of a building whose drawing is wrong: sought about a free structure, which needs no name for that."""

import re
from contextlib import suppress
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from calibration.diagnosis.decide.verdict import chance_of, judge
from calibration.diagnosis.diagnosis import Diagnosis, baseline_gap, diagnose
from calibration.diagnosis.faults import Errors, Fault
from calibration.diagnosis.free import (
    Free,
    drawing_fails,
    held_against,
    must_be_better_by,
    only_beside_a_free_structure,
    recurs,
    with_recurring,
)
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.search import Round
from calibration.diagnosis.screen.regular import Regular, regular
from calibration.evaluation.settings import ModelSettings
from calibration.fit.fitted_case import FittedCase
from calibration.fit.result import Rung
from calibration.results import to_json
from calibration.stages import stages_kept
from mpc.reports.diagnosis_words import diagnosis_verdict
from thermal import Case, Telemetry
from thermal.case.building import GROUND, OUTDOOR, Building, Layer, Surface, ZoneEntry, ZoneTable
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin

#: A wall that no building has.
THIN = (Layer(thickness=0.1, conductivity=0.5, density=300.0, heat_capacity=800.0),)


@cache
def twin() -> Case:
    """Half a month of an office of four zones, quiet but for its thermostats."""
    building = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    quiet = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.005, 0.01))
    settings = TwinSettings(days=15.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=quiet)
    return generate_twin(building, 3, settings)[0]


def drawn_wrongly(building: Building) -> Building:
    """The same zones, a quarter as large behind walls of 120 m2, joined to nothing but outdoor and ground."""
    rooms = ModelSettings(dx=1.0).network(building).anatomy.rooms
    zones, surfaces = [], []
    for name in building.zone_names:
        area = rooms[name].floor_area / 4.0
        zones.append(ZoneEntry(name=name, volume=2.7 * area, floor_area=area))
        wall = {"kind": "wall", "other": OUTDOOR, "area": 120.0, "azimuth": 0.0}
        floor = {"kind": "floor", "other": GROUND, "area": area}
        for part in (wall, floor):
            surfaces.append(Surface(name=f"{part['kind']} {name}", zone=name, construction="thin", **part))
    return replace(building, geometry=ZoneTable(tuple(zones), tuple(surfaces), {"thin": THIN}))


@cache
def diagnosed() -> Diagnosis:
    return diagnose(Case(drawn_wrongly(twin().building), twin().telemetry))


@pytest.mark.long
def test_a_wrong_drawing_is_said_to_be_wrong_and_the_search_goes_on_without_it() -> None:
    found = diagnosed()
    drawn, *others = found.rungs
    assert next(r for r in others if r.chosen).left_out_mae < 0.8 * drawn.left_out_mae
    assert found.settings.structure.lumped
    assert found.left_over is not None and not found.left_over.counts
    assert found.verdict.name != "unexplained"
    assert found.gap < 0.3 < baseline_gap(Case(drawn_wrongly(twin().building), twin().telemetry))
    assert found.better is not None and found.better.settings.structure.lumped
    assert dict(found.better.settings.effects) == found.final.effects
    assert found.predicts <= found.gap
    content = found.to_dict()
    assert content["left_over"]["shares"].keys() == found.left_over.shares.keys()
    assert content["gap"]["p_value"] == chance_of(found.rounds[0])
    assert diagnosis_verdict(found).startswith("The drawing does not hold")


class OneMore(dict[str, bytes]):
    """Keeps one stage more than the attempt before, which ends with it."""

    def read(self, name: str) -> bytes:
        return self[name]

    def write(self, name: str, content: bytes) -> None:
        self[name] = content
        raise KeyboardInterrupt


@pytest.mark.long
def test_an_attempt_after_others_were_killed_answers_the_same() -> None:
    """Of every stage with the one before taken over from a copy."""
    kept, attempts, answer = OneMore(), 0, None
    while answer is None:
        attempts += 1
        with suppress(KeyboardInterrupt), stages_kept(kept, every=0.0):
            answer = diagnose(Case(drawn_wrongly(twin().building), twin().telemetry))
    assert attempts == len(kept) + 1 > 6
    texts = (to_json(found.to_dict() | found.calibration()) for found in (answer, diagnosed()))
    one, other = (re.sub(r'"seconds": [\d.e-]+', "", text) for text in texts)
    assert one == other


@pytest.mark.long
def test_what_is_left_is_said_to_come_back_or_not() -> None:
    found = replace(diagnosed(), rounds=diagnosed().rounds[-1:])
    nothing = replace(found, verdict=replace(found.verdict, name="no_gap"))
    assert "does not come back" in diagnosis_verdict(nothing)
    back = Regular(fall=0.2, sure=5.0, explains=0.1, shares={"sun": 0.5, "wind": 0.01})
    shown = replace(found, verdict=replace(found.verdict, name="unexplained"), left_over=back)
    assert "0.20 K of what is left come back on days that were left out, most of all with sun." in diagnosis_verdict(
        shown
    )


def test_what_is_part_of_a_structure_was_not_found_and_faults_were() -> None:
    last = replace(diagnosed().rounds[-1], accepted=None)
    structures = replace(last, before=replace(last.before, effects={"clock_shift": ()}))
    steps = (replace(diagnosed().steps[-1], after=0.25),)
    found = replace(diagnosed(), rounds=(structures,), steps=steps)
    assert found.found == () and "with" not in repr(found)
    fault = cast(Fault, SimpleNamespace(effect="swapped_sensors", before=Errors(0.8, 0.6)))
    assert "error 0.600 K, with swapped_sensors 0.250 K" in repr(replace(found, faults=(fault,)))
    assert replace(found, faults=(fault,)).found == ("swapped_sensors",)
    assert (found.gap_as_read, replace(found, faults=(fault,)).gap_as_read) == (found.gap, 0.6)
    beyond = replace(last, before=replace(last.before, effects={"solar_gain": ()}))
    assert replace(found, rounds=(replace(last, before=replace(last.before, effects={})), beyond)).found == ("solar_gain",)


def test_the_chance_of_a_gain_is_that_of_bayes_factors() -> None:
    (r, *_) = diagnosed().rounds
    most = max(g.gain for g in r.gains)
    assert chance_of(r) == pytest.approx(min(1.0, len(r.gains) * np.exp(-most)), rel=0.5)
    strong = replace(r, gains=tuple(replace(g, gain=12.0) for g in r.gains[:1]), refits=())
    assert chance_of(strong) <= np.exp(-3.0)


def test_what_is_left_over_decides_where_it_was_judged() -> None:
    rounds = diagnosed().rounds[-1:]
    shows = Regular(fall=0.2, sure=5.0, explains=0.1, shares={"sun": 0.5})
    assert judge(rounds, {}, shows).name == "unexplained"
    assert judge(rounds, {}, replace(shows, sure=1.0)).name == "no_gap"
    assert judge(rounds, {}, replace(shows, fall=0.01)).name == "no_gap"


def test_a_structure_that_is_hardly_better_leaves_the_drawing_in_place() -> None:
    kept = SimpleNamespace(settings=SimpleNamespace(structure=SimpleNamespace(lumped=True)))
    sun, mixing, bias = ["solar_gain"], ["solar_gain", "zone_mixing"], ["solar_gain", "sensor_bias"]
    for found, better, fails in (
        (sun, 0.17, False), (sun, 0.15, True), (mixing, 0.17, True), (mixing, 0.185, False),
        (bias, 0.199, True), (bias, 0.2, False),
    ):  # fmt: skip
        rungs = (Rung("named", 0.2, 13, False), Rung("lumped", better, 100, True))
        least = must_be_better_by(found)
        assert drawing_fails(rungs, cast("FittedCase", kept), least) == fails
        assert not drawing_fails(rungs, None, least)


def baseline(case: Case) -> tuple[ModelComparison, Fit]:
    models = ModelComparison(case, ModelSettings(dx=1.0))
    return models, models.fit({}, [{}])


def test_a_guessed_drawing_may_not_defend_itself_by_what_was_found() -> None:
    first = SimpleNamespace(before="drawn", after="with one", accepted="one")
    rounds = cast(list[Round], [first, SimpleNamespace(before="with one", after="with two", accepted="two")])
    assert held_against(rounds, "surveyed") == held_against(rounds, "approximate") == ("with two",)
    assert held_against(rounds, "generic") == ("drawn", "with two")
    nothing = cast(list[Round], [SimpleNamespace(before="drawn", after="drawn", accepted=None)])
    assert held_against(nothing, "generic") == ("drawn",)


def test_nothing_comes_back_where_nothing_is_missing() -> None:
    found = regular(*baseline(twin()))
    assert not found.counts
    assert found.fall < 0.01


def test_heat_that_is_missing_at_night_comes_back_with_the_time_of_day() -> None:
    frame = twin().telemetry.frame.copy()
    flows = [c for c in frame if c.endswith("/supply_air_flowrate_sensor")]
    hours = np.asarray(frame.index.hour)
    frame.loc[(hours >= 3) & (hours < 6), flows] = 0.0
    found = regular(*baseline(Case(twin().building, Telemetry.from_frame(frame))))
    assert found.counts
    assert max(found.shares, key=lambda kind: found.shares[kind]) == "time of day"
    assert found.shares["time of day"] > 0.3


@pytest.mark.parametrize(("recurring", "named"), [(0.5, True), (0.61, False)])
def test_heat_that_recurs_in_each_zone_is_peoples_where_it_takes_much_of_the_error_away(
    recurring: float, named: bool
) -> None:
    found = replace(diagnosed(), rounds=diagnosed().rounds[-1:])
    verdict = judge(found.rounds, {}, found.left_over)
    structure = SimpleNamespace(settings=SimpleNamespace(structure=SimpleNamespace(recurring=True)))
    free = cast(Free, SimpleNamespace(kept=structure, rounds=found.rounds))
    rungs = [Rung(n, e, 10, n == "recurring") for n, e in (("drawn", 2.0), ("lumped", 1.0), ("recurring", recurring))]
    assert recurs(rungs) == ((1.0, recurring) if named else None)
    told = with_recurring(verdict, free, rungs)
    first = told.candidates[0]
    assert (first.effect == "internal_gains" and first.probability > 0.5) == named
    assert (told.name == "named") == named
    assert {c.effect for c in told.candidates} == {c.effect for c in verdict.candidates}
    structure.settings.structure.recurring = False  # another structure predicts better
    assert with_recurring(verdict, free, rungs) == verdict


def test_what_explains_nothing_beside_the_drawing_is_not_sought_beside_a_free_structure() -> None:
    (r, *_) = diagnosed().rounds
    assert r.accepted is not None

    def of(**gains: float) -> Round:
        return replace(r, gains=tuple(replace(r.gains[0], effect=e, gain=g) for e, g in gains.items()), refits=())

    less = {"internal_gains": -2.0, "valve_leak": -5.0, "window_opening": 0.0}  # a gain that recurs is the structure's
    rounds = [of(solar_opaque=-0.5, **less), of(solar_opaque=2.0, valve_leak=-1.0)]
    without = [replace(each, accepted=None, pair=None) for each in rounds]
    assert only_beside_a_free_structure(without) == {"valve_leak"}
    fitted = replace(r.accepted, screened=replace(r.gains[0], effect="valve_leak", gain=-5.0), gain=20.0, counts=True)
    assert only_beside_a_free_structure([replace(each, refits=(fitted,)) for each in without]) == set()
