"""What a diagnosis leaves possible: sets of effects by their probability, parameters by their covariance."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from calibration.diagnosis.baseline import fit_baseline
from calibration.diagnosis.decide.verdict import judge
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.posterior import Posterior, posterior_of, read_posterior
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.refit import Refit, held_out
from calibration.diagnosis.refit.search import Round, search
from calibration.errors import CalibrationError
from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.settings import ModelSettings
from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from thermal import Case
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin

SUN, AIR = "solar_gain", "infiltration"


@cache
def office() -> Case:
    """A week of an office of one zone."""
    building = pilot_building(3, floor_area=40.0, zones=1, floors=1, name="office")
    settings = TwinSettings(days=9.0, step_seconds=1800.0, dx=1.0, meter="exact", ranges=TwinRanges())
    return generate_twin(building, 3, settings)[0]


@cache
def round_of() -> Round:
    """What a search for two effects begins with."""
    models, baseline = fit_baseline(ModelComparison(office(), ModelSettings(dx=1.0)), {})
    return search(models, baseline, held_out(models, baseline), [SUN, AIR])[0]


def refit(effect: str, gain: float) -> Refit:
    """An effect that was fitted, with a gain."""
    first = round_of()
    screened = next(g for g in first.gains if g.effect == effect)
    return Refit(screened, with_effect(effect), gain, 0.1, first.held_out, worse=False, counts=True)


def left_possible(refits: tuple[Refit, ...], judged: Mapping[str, float]) -> Posterior:
    """What is left possible where a round accepted the first of some refits, and effects were judged so likely."""
    first, after = round_of(), replace(round_of(), before=refits[0].fit, accepted=None)
    rounds = (replace(first, refits=refits, accepted=refits[0]), after)
    verdict = judge(rounds, {})
    told = tuple(replace(c, probability=judged.get(c.effect, 0.0)) for c in verdict.candidates)
    found = SimpleNamespace(
        better=None, rounds=rounds, verdict=replace(verdict, candidates=told), settings=first.before.settings,
        disturbance=None, final=refits[0].fit, taken=refits[0].fit,
    )  # fmt: skip
    return posterior_of(cast(Diagnosis, found), office().building)


@cache
def with_effect(effect: str) -> Fit:
    """A fit with an effect, after a step or two."""
    models = ModelComparison(office(), ModelSettings(dx=1.0))
    return models.fit({effect: ()}, [{}], evaluations=2)


def torn(sure: float, other: float) -> Posterior:
    """Where the sun was accepted and leakage fitted too, with gains."""
    return left_possible((refit(SUN, sure), refit(AIR, other)), {SUN: 1.0, AIR: 1.0})


def chances(posterior: Posterior) -> dict[tuple[str, ...], float]:
    return {tuple(one.settings.effects): one.probability for one in posterior.models}


def test_sets_of_effects_have_the_probability_of_the_search() -> None:
    assert chances(torn(60.0, 10.0)) == {(SUN,): pytest.approx(1.0)}
    found = chances(torn(60.0, 60.0))
    assert found == {(SUN,): pytest.approx(0.5), (AIR,): pytest.approx(0.5)}
    draws = torn(60.0, 60.0).draw(office().building, 200, seed=1)
    assert 0.4 < np.mean([SUN in one.settings.effects for one in draws]) < 0.6


def test_what_other_days_doubt_may_not_be_there() -> None:
    doubted = left_possible((refit(SUN, 60.0),), {SUN: 0.3})
    assert chances(doubted) == {(): pytest.approx(0.7), (SUN,): pytest.approx(0.3)}
    # what another round is sure of, and this one hardly gains by, does not make up for that
    beside = left_possible((refit(SUN, 60.0), refit(AIR, 10.0)), {SUN: 0.3, AIR: 1.0})
    assert chances(beside) == {(): pytest.approx(0.7), (SUN,): pytest.approx(0.3)}


def test_draws_are_as_wide_as_the_data_leave_them_and_within_their_ranges() -> None:
    one = torn(60.0, 10.0).models[0]
    only = Posterior((one,), None, office().building.zone_names)
    values = [m.values for m in only.draw(office().building, 400, seed=2)]
    parameters = {p.name: p for p in one.settings.network(office().building).parameters}
    for name in one.estimated:
        drawn = [v[name] for v in values]
        assert parameters[name].lower < min(drawn) and max(drawn) < parameters[name].upper
    known = replace(one, covariance=one.covariance / 100.0)  # so well that no range cuts it
    draws = known.draw(office().building, 400, np.random.default_rng(2))
    scaled = np.array([[parameters[name].transform(v[name]) for v in draws] for name in one.estimated])
    errors = np.sqrt(np.diag(known.covariance))
    assert scaled.std(axis=1) == pytest.approx(errors, rel=0.15)
    assert np.corrcoef(scaled) == pytest.approx(known.covariance / np.outer(errors, errors), abs=0.2)
    first = only.draw(office().building, 1, seed=2)[0]
    settings = PlantSettings(parameters=first, unmeasured=DisturbanceModel(30.0, 3600.0, 0.03))
    plant = simulated_plant(office().building, pilot_weather(1, "2023-01-09", 2.0), "2023-01-09", "2023-01-10", settings)
    assert dict(zip(parameters, plant.model.theta.tolist(), strict=True)) == first.values
    assert SUN in [p.effect for p in plant.model.network.parameters]
    again = [m.values for m in only.draw(office().building, 400, seed=2)]
    assert values == again


def test_draws_do_not_pile_up_on_a_bound() -> None:
    one = torn(60.0, 10.0).models[0]
    parameters = one.settings.network(office().building).parameters
    k, p = next((k, p) for k, n in enumerate(one.estimated) for p in parameters
                if p.name == n and np.isfinite(p.transform(p.upper)))  # fmt: skip
    wide = one.covariance.copy()
    wide[k, :] = wide[:, k] = 0.0
    wide[k, k] = 0.25
    at_bound = replace(one, values=dict(one.values) | {p.name: p.upper}, covariance=wide)
    drawn = np.array([v[p.name] for v in at_bound.draw(office().building, 200, np.random.default_rng(3))])
    assert p.lower < drawn.min() and drawn.max() < p.upper
    below = np.array([p.transform(p.upper) - p.transform(float(v)) for v in drawn])
    assert np.mean(below) == pytest.approx(0.5 * np.sqrt(2.0 / np.pi), rel=0.15)  # half a normal distribution


def test_a_file_holds_all_of_it(tmp_path: Path) -> None:
    heat = DisturbanceModel([30.0], 3600.0, 0.03)  # type: ignore[arg-type]
    made = replace(torn(60.0, 60.0), disturbance=heat)
    path = tmp_path / "posterior.json"
    path.write_text(json.dumps(made.to_dict()), encoding="utf-8")
    read = read_posterior(path)
    assert read.to_dict() == made.to_dict()
    mine, theirs = (p.draw(office().building, 3, seed=5) for p in (made, read))
    assert [m.values for m in mine] == [t.values for t in theirs] and theirs[0].disturbance is not None
    other = pilot_building(1, floor_area=200.0, zones=4, name="other")
    with pytest.raises(CalibrationError, match="posterior: expected a building with the zones .*, found other with"):
        read.draw(other, 1)
    with pytest.raises(CalibrationError, match="those of another: .* more"):
        replace(read, models=tuple(replace(m, values={"nothing": 1.0}) for m in read.models)).draw(office().building, 1)
    spoilt = ({"probability": 0.9}, {"probability": -1.0}, {"covariance": None}, {"estimated": ["nothing"]},
              {"values": {name: None for name in read.models[0].values}})  # fmt: skip
    told = made.to_dict()
    texts = [json.dumps(told | {"models": [told["models"][0] | one, told["models"][1]]}) for one in spoilt]
    for text in (*texts, "{", "[]", '{"models": [{}], "disturbance": null}', '{"models": []}'):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(CalibrationError, match="expected a posterior"):
            read_posterior(path)
