"""Diagnosis on twins: our own plant with nothing missing, and with one thing changed in its telemetry or in it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from calibration.diagnosis.decide.levels import Levels
from calibration.diagnosis.decide.verdict import judge, summarised
from calibration.diagnosis.diagnosis import Diagnosis, baseline_gap, diagnose
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.how_far import _permutation_test
from calibration.diagnosis.refit.refit import ACCEPTED, CHANCE, Refit, Work, beyond_a_step, held_out
from calibration.diagnosis.refit.repeat import DISAGREE, Repeats, agreement
from calibration.diagnosis.refit.search import _first
from calibration.diagnosis.screen.gains import MATTERS
from calibration.diagnosis.screen.regular import Regular
from calibration.diagnosis.screen.screen import Screening
from calibration.diagnosis.seek import seek
from calibration.evaluation.settings import ModelSettings
from calibration.fit.least_squares import bounded_step
from calibration.results import plain
from mpc.reports.diagnosis_words import where_sentence
from thermal import Case, Telemetry
from thermal.data import load_bundled_case
from thermal.effects.catalogue import CATALOGUE
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin

#: Share by which the flow of one zone is under-reported [-].
ERROR = 0.25


@cache
def twin() -> Case:
    """Three weeks of an office of four zones, quiet but for its thermostats."""
    building = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    quiet = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.005, 0.01))
    return generate_twin(building, 3, TwinSettings(days=15.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=quiet))[
        0
    ]


def changed(zone: str) -> Case:
    """The same telemetry with the air of one zone read too low."""
    case = twin()
    frame = case.telemetry.frame.copy()
    (device,) = case.building.devices_of(zone)
    frame[f"{device.name}/supply_air_flowrate_sensor"] /= 1.0 + ERROR
    return Case(case.building, Telemetry.from_frame(frame))


@cache
def diagnosed(zone: str | None) -> Diagnosis:
    return diagnose(twin() if zone is None else changed(zone), dx=1.0)


@pytest.mark.long
def test_nothing_is_found_where_nothing_is_missing() -> None:
    found = diagnosed(None)
    assert found.verdict.name == "no_gap"
    assert baseline_gap(twin(), dx=1.0) == found.gap
    assert found.steps == ()
    assert found.verdict.set90 == ()
    assert max(g.gain for g in found.rounds[0].gains) < ACCEPTED
    assert found.final.effects == {}


@pytest.mark.long
def test_the_answer_is_that_of_the_whole_diagnosis() -> None:
    answer, whole = plain(seek(twin(), dx=1.0).to_dict()), plain(diagnosed(None).to_dict())
    assert answer["gap"].items() <= whole["gap"].items()
    for key in answer.keys() - {"gap", "seconds", "intervals"}:
        assert answer[key] == whole[key], key
    assert {"verdict", "which", "rounds"} <= answer.keys()


@pytest.mark.parametrize("number", [1, pytest.param(3, marks=pytest.mark.long)])
def test_a_meter_that_reads_too_low_is_named_with_its_zone_and_its_error(number: int) -> None:
    zone = twin().building.zone_names[number]
    found = diagnosed(zone)
    best = found.verdict.candidates[0]
    assert found.verdict.name in ("named", "group")
    assert best.effect in ("flow_gain", "duct_loss")
    assert "flow_gain" in best.group or best.effect == "flow_gain"
    assert best.zones == (zone,)
    if best.effect == "flow_gain":
        value, _, (low, high) = best.parameters[f"flow_gain@{zone}"]
        assert low < ERROR < high or abs(value - ERROR) < 0.06
    assert best.probability > 0.5
    assert zone in where_sentence(found.where)
    assert max(found.where.zones, key=lambda s: s.share).name == zone


def test_how_far_closes_the_gap_and_permuted_signals_do_not() -> None:
    found = diagnosed(twin().building.zone_names[1])
    (step, *_) = found.steps
    assert step.share_closed is not None and step.interval is not None
    assert step.share_closed > 0.7
    assert step.interval[0] <= step.share_closed <= step.interval[1] + 1e-9
    assert step.floor <= step.after < step.before == found.gap
    assert step.shuffled is not None and step.shuffled > step.after
    assert step.repeats and not step.void
    assert replace(step, shuffled=step.after).void and replace(step, halves=Repeats(0.001, ({}, {}))).void


def test_a_meter_that_is_wrong_all_the_time_repeats_and_one_that_is_wrong_for_a_week_does_not() -> None:
    always = diagnosed(twin().building.zone_names[1]).final
    effect = next(iter(always.effects))
    found = agreement(always)[effect]
    assert found.probability > 0.05 and found.agrees
    whole = {name: always.values[name] for name in found.estimates[0]}
    assert all(each == pytest.approx(whole, abs=0.1) for each in found.estimates) and whole
    frame = changed(twin().building.zone_names[1]).telemetry.frame.copy()
    late = frame.index > frame.index[len(frame) // 3]
    frame.loc[late] = twin().telemetry.frame.loc[late]
    models = ModelComparison(Case(twin().building, Telemetry.from_frame(frame)), ModelSettings(dx=1.0))
    assert agreement(models.fit(always.effects, [{}]))[effect].probability < DISAGREE


def test_the_file_holds_every_effect_and_what_the_contract_asks() -> None:
    content = diagnosed(twin().building.zone_names[1]).to_dict()
    assert {s["effect"] for s in content["which"]} == set(CATALOGUE)
    keys = (
        "effect",
        "probability",
        "score",
        "group",
        "zones",
        "parameters",
        "retained_share",
        "separate_by",
        "testable",
    )
    for candidate in content["which"]:
        assert set(keys) <= set(candidate)
        assert 0.0 <= candidate["probability"] <= 1.0
        assert candidate["testable"] or candidate["reason"]
        assert len(candidate["group"]) <= 4
    assert [s["probability"] for s in content["which"]] == sorted(
        (s["probability"] for s in content["which"]), reverse=True
    )
    assert sum(content["where"]["hours"]) == pytest.approx(1.0)
    assert sum(z["share"] for z in content["where"]["zones"]) == pytest.approx(1.0)
    assert set(content["gap"]["smallest_detectable_watts"]) == set(twin().building.zone_names)


def test_a_diagnosis_shows_itself() -> None:
    found = diagnosed(twin().building.zone_names[1])
    table = found.to_frame()
    assert list(table.index) == [c.effect for c in found.verdict.candidates]
    assert set(table.index) == set(CATALOGUE)
    assert table["probability"].iloc[0] == found.verdict.candidates[0].probability
    assert len(repr(found)) < 160 and found.verdict.name in repr(found) and f"{found.gap:.3f} K" in repr(found)
    assert "<table" in found._repr_html_() and found.verdict.candidates[0].effect in found._repr_html_()
    axes = found.plot()
    assert len(axes.patches) == table["testable"].sum()


def test_what_counts_for_little_is_ranked_by_what_it_gains_and_what_predicts_worse_is_not() -> None:
    """Two fits that gain much and are too small to matter, and one that gains more and predicts worse."""
    r = diagnosed(None).rounds[0]
    by_name = {g.effect: g for g in r.gains}

    def refit(effect: str, gain: float, worse: bool) -> Refit:
        return Refit(by_name[effect], r.before, gain, 0.01, r.held_out, worse, counts=False)

    doubtful = (refit("infiltration", 40.0, True), refit("duct_loss", 20.0, False), refit("sensor_bias", 12.0, False))
    found = judge((replace(r, refits=doubtful, accepted=None),), {})
    assert [s.effect for s in found.candidates[:2]] == ["duct_loss", "sensor_bias"]
    worse = next(s for s in found.candidates if s.effect == "infiltration")
    assert worse.probability < found.candidates[1].probability < 0.3
    assert found.name == "no_gap"


def test_held_out_days_decide_between_what_gains_alike() -> None:
    r = diagnosed(None).rounds[0]
    by_name = {g.effect: g for g in r.gains}

    def refit(effect: str, gain: float, left: float) -> Refit:
        errors = replace(r.held_out, daily=left * r.held_out.daily)
        return Refit(by_name[effect], r.before, gain, 0.1, errors, worse=False, counts=True)

    most, other = refit("duct_loss", 20.0, 0.8), refit("flow_gain", 18.5, 0.6)
    assert _first(r.held_out, [most, other]) is other
    assert _first(r.held_out, [most, refit("flow_gain", 16.0, 0.6)]) is most  # gains can tell
    assert _first(r.held_out, [most, refit("flow_gain", 18.5, 0.79)]) is most  # held-out days cannot
    assert _first(r.held_out, [replace(most, counts=False)]) is None
    found = judge((replace(r, refits=(most, other), accepted=other),), {})
    assert [s.effect for s in found.candidates[:2]] == ["flow_gain", "duct_loss"]
    assert set(found.candidates[0].group) >= {"flow_gain", "duct_loss"}


def test_what_explains_a_part_of_large_errors_is_not_named() -> None:
    """A fit that leaves half of a large squared error, and a first model that has that error."""
    r = diagnosed(None).rounds[0]
    gain = next(g for g in r.gains if g.effect == "duct_loss")

    def with_error(left: float) -> Fit:
        return replace(r.before, found=replace(r.before.found, mean_square=left))

    large, half, little = with_error(1.0), with_error(0.5), with_error(0.05)
    verdicts = []
    for fit in (half, little):
        accepted = Refit(gain, fit, 40.0, 0.3, r.held_out, worse=False, counts=True)
        rounds = (replace(r, before=large, refits=(accepted,), accepted=accepted), replace(r, before=fit))
        verdicts.append(judge(rounds, {}))
    assert [v.name for v in verdicts] == ["unexplained", "named"]
    assert verdicts[0].candidates[0].probability == pytest.approx(0.5, abs=0.01)
    assert verdicts[1].candidates[0].probability > 0.99
    half_left = replace(rounds[0], refits=(), accepted=replace(accepted, fit=half)), replace(r, before=half)
    chance = Regular(fall=0.0, sure=0.0, explains=0.0, shares={})  # the half that is left is another one every day
    comes_back = Regular(fall=0.3, sure=5.0, explains=0.5, shares={})
    assert [judge(half_left, {}, left).name for left in (chance, comes_back)] == ["named", "unexplained"]


def test_telemetry_is_shifted_only_by_more_than_one_of_its_steps() -> None:
    """However much it gains: a shift within a step says how a value is spread over that."""
    models = ModelComparison(twin(), ModelSettings(dx=1.0))
    baseline = models.fit({}, [{}])
    work = Work(models, baseline, held_out(models, baseline), Screening(models, baseline, ["clock_shift"]))
    gain = work.made.of("clock_shift")
    found = work.refit([gain], work.made.promised(gain))
    assert found is not None
    names = [p.name for p in found.fit.problem.parameters]
    heat, weather = (names.index(f"{what}_clock_shift") for what in ("heat", "weather"))
    step, error = twin().step / 3600.0, CHANCE * found.fit.deviations

    def moved(by_heat: float, by_weather: float) -> Fit:
        point = found.fit.found.point.copy()
        point[[heat, weather]] = by_heat, by_weather
        return replace(found.fit, found=replace(found.fit.found, point=point))

    def beyond(fit: Fit, effect: str = "clock_shift") -> bool:
        return beyond_a_step(fit.problem, fit.theta, found.fit.deviations, CATALOGUE[effect].shifts)

    assert not beyond(moved(0.9 * step, 0.0))
    assert not beyond(moved(0.0, -step - 0.9 * error[weather]))
    assert not beyond(moved(4.0 * step, 0.9 * step))  # heat that comes late is how floors and boilers are
    assert beyond(moved(0.0, step + 1.1 * error[weather]))
    assert beyond(baseline, "solar_gain")  # moves nothing in time
    evident = replace(found.fit, evidence=baseline.evidence + 50.0, found=replace(found.fit.found, mean_square=0.0))
    weighed = work.weighed([gain], evident)
    assert weighed.gain > ACCEPTED
    assert weighed.fall > MATTERS
    assert not weighed.worse
    assert not weighed.counts


def test_what_may_be_left_over_grows_with_how_far_temperatures_change() -> None:
    result = diagnosed(None)
    fit, told = result.final, summarised(result.rounds)
    zone = fit.built.inputs.zone
    changes = zone[fit.problem.steps :] - zone[: -fit.problem.steps]
    assert told.change == fit.change == pytest.approx(np.sqrt(np.nanmean(changes**2)))
    assert told.left == pytest.approx(np.sqrt(fit.found.mean_square))
    assert 1.0 <= told.peak == pytest.approx(fit.by_zone.max() / fit.by_zone.mean())

    def left(rms: float, driven: float) -> bool:
        return replace(told, left=rms, change=driven, peak=1.0).much(Levels(left_over=0.2, left_of_change=0.1))

    assert (left(0.198, 1.0), left(0.202, 1.0)) == (False, True)
    assert (left(0.398, 4.0), left(0.402, 4.0)) == (False, True)
    assert replace(told, left=0.15, change=1.0, peak=4.0).much(Levels(left_in_a_zone=0.1, concentrated=3.5))


def test_tangents_promise_what_a_fit_keeps() -> None:
    """Gain and strength of the one true effect, by tangents at the baseline and fitted anew."""
    zone = twin().building.zone_names[1]
    first = diagnosed(zone).rounds[0]
    refit = next(r for r in first.refits if r.screened.effect == "flow_gain")
    assert refit.gain == pytest.approx(refit.screened.gain, rel=0.5)
    name = f"flow_gain@{zone}"
    assert refit.fit.values[name] == pytest.approx(refit.screened.strengths[name], abs=0.1)


def test_screening_is_about_the_estimate() -> None:
    """An effect without strength gains nothing; cosines are those of a Gram matrix; detectable heat grows with gain."""
    models = ModelComparison(twin(), tune=(), hold_out=())
    made = diagnosed(None).rounds[0].screening
    gains = [made.of(e) for e in ("flow_gain", "duct_loss", "internal_gains")]
    for g in gains:
        assert 0.0 <= g.retained <= 1.0 + 1e-9
        assert 0.0 <= g.share < 1.0
    assert abs(made.cosine(gains[0], gains[1])) <= 1.0 + 1e-9
    small, large = made.detectable(3.0), made.detectable(12.0)
    assert all(0.0 < small[z] < large[z] for z in models.case.building.zone_names)
    assert np.all(np.linalg.eigvalsh(made.gram) > -1e-6 * np.abs(made.gram).max())
    assert isinstance(made, Screening)


def test_left_out_days_are_those_of_the_model_that_is_handed_on() -> None:
    """The weights that other structures are judged by are those at which the final model is an optimum."""
    final = diagnosed(None).final
    problem = replace(final.problem, deviation=float(np.sqrt(final.found.mean_square)))
    residual, jacobian = problem.weighted(final.model, final.point)
    lower, upper = problem.bounds
    step = bounded_step(residual, jacobian, lower - final.point, upper - final.point)
    assert np.linalg.norm(jacobian @ step) < 0.1 * np.sqrt(step.size)


def test_what_acts_by_conductances_is_not_put_on_other_days() -> None:
    """Loss to the ground is there on any day, so that other days say nothing of it; the sun is not."""
    models = ModelComparison(load_bundled_case(), ModelSettings(dx=2.0))
    before = models.fit({}, [{}])
    for effect, tested in (("ground_exchange", False), ("solar_gain", True)):
        fit = models.fit({effect: ()}, [before.values], evaluations=2)
        shuffled = _permutation_test(models, SimpleNamespace(before=before), fit)  # type: ignore[arg-type]
        assert (shuffled is not None) == tested
