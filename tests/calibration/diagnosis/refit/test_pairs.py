"""Pairs of effects: two that hide each other are found together where the best single effect is neither."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration.diagnosis.decide.levels import SMALL
from calibration.diagnosis.decide.verdict import gains_of
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import ACCEPTED, Work, held_out, promising
from calibration.diagnosis.refit.search import Round, _best_pair, _exchanged, _refits, nominate
from calibration.diagnosis.screen.gains import MATTERS, Gain, choice_of
from calibration.diagnosis.screen.own_nulls import OwnNulls
from calibration.diagnosis.screen.screen import Screening
from calibration.evaluation.settings import ModelSettings
from thermal import Case, FloorPlans, Telemetry
from thermal.case.plan import zone_floor_areas
from thermal.effects.catalogue import CATALOGUE
from thermal.effects.effect import ALIKE
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin
from thermal.units import AIR_HEAT_CAPACITY

FloatArray = NDArray[np.float64]

#: Effects with one strength each, of which the third will look like what is left of the first two.
NAMES = ("roof_exchange", "ground_exchange", "interfloor_exchange", "infiltration")

#: Share by which a meter reads too low, and by how much a sensor reads too high [-, K]: each is hardly seen alone.
ERROR, BIAS = 0.21, 0.48

#: Own nulls that show nothing.
NONE = OwnNulls(np.zeros(1), {}, np.zeros(1))

#: Errors, and their deviation [K].
COUNT, NOISE = 300, 0.1


def screening(signatures: FloatArray, errors: FloatArray, fitted: Mapping[str, float] | None = None) -> Screening:
    """A screening of a model that is linear in its strengths, of which it has some already."""
    made = Screening.__new__(Screening)
    made.parameters = tuple(CATALOGUE[name].parameters[0] for name in NAMES)
    made.count, made.scale = float(len(errors)), float(len(errors) / np.sum(errors**2))
    made.prior = np.array([p.prior_deviation for p in made.parameters])
    made.lower = np.array([p.lower for p in made.parameters])
    made.upper = np.array([p.upper for p in made.parameters])
    made.elsewhere = 0
    made._levels, made._twins, made._tied = {}, {}, range(0)
    made._whole, made._slope = made.scale * signatures.T @ signatures, -made.scale * signatures.T @ errors
    made._start, made._point = np.zeros(len(NAMES)), np.array([(fitted or {}).get(name, 0.0) for name in NAMES])
    made._project(np.array([name in (fitted or {}) for name in NAMES]))
    return made


def planted(strengths: tuple[float, float], seed: int = 4) -> Screening:
    """Errors of the first two effects, which cancel but for an eighth of their size, and of which the third has half."""
    rng = np.random.default_rng(seed)
    shared, own, other, third = rng.standard_normal((4, COUNT))
    signatures = np.column_stack([
        shared + 0.125 * own, -shared + 0.125 * other, 0.1 * (own + other + 0.5 * third), rng.standard_normal(COUNT),
    ])  # fmt: skip
    true = np.array([*strengths, 0.0, 0.0])
    return screening(signatures, NOISE * rng.standard_normal(COUNT) - signatures @ true)


def test_a_pair_that_cancels_is_found_where_two_best_singles_are_not_it() -> None:
    made = planted((0.8, 0.8))
    gains = sorted((made.of(name) for name in NAMES), key=lambda g: -g.gain)
    assert gains[0].effect == "interfloor_exchange"
    assert {g.effect for g in gains[:2]} != {"roof_exchange", "ground_exchange"}
    best, *_ = nominate(made, gains, 3.0)
    assert {best.first.effect, best.second.effect} == {"roof_exchange", "ground_exchange"}
    for g in (best.first, best.second):
        assert list(g.strengths.values()) == pytest.approx([0.8], abs=0.2)
    assert best.gain > gains[0].gain + 6.0


def test_what_one_effect_explains_nominates_no_pair() -> None:
    made = planted((0.8, 0.0))
    gains = sorted((made.of(name) for name in NAMES), key=lambda g: -g.gain)
    assert gains[0].effect == "roof_exchange"
    assert nominate(made, gains, 3.0) == []
    assert nominate(made, gains[:1], 3.0) == []


def test_a_pair_s_gain_is_the_evidence_of_both() -> None:
    """Against the determinant form for Gaussian errors of known size, with strengths well inside their ranges."""
    made = planted((0.5, 0.5))
    first, second = made.of("roof_exchange"), made.of("ground_exchange")
    one, other, gain, explained = made.together(first, second)
    x = np.array([*one.strengths.values(), *other.strengths.values()])
    gram, score, prior = made.gram[:2, :2], made.score[:2], np.diag(made.prior[:2] ** -2.0)
    share = (2.0 * score @ x - x @ gram @ x) / made.count
    assert explained == pytest.approx(share, rel=1e-9)
    sharper = gram / (1.0 - share)
    exact = -0.5 * made.count * np.log1p(-share) - 0.5 * x @ prior @ x + 2.0 * np.log(2.0)
    exact += 0.5 * (np.linalg.slogdet(prior)[1] - np.linalg.slogdet(sharper + prior)[1])
    assert gain == pytest.approx(exact, rel=1e-9)
    assert made.reach(first, second) == pytest.approx(gain, abs=0.5)


def test_a_screening_less_an_effect_is_that_of_the_model_without_it() -> None:
    """Exactly where errors are linear and priors say nothing of what is fitted."""
    rng = np.random.default_rng(8)
    signatures = rng.standard_normal((COUNT, 4)) + 0.5 * rng.standard_normal((COUNT, 1))
    errors = NOISE * rng.standard_normal(COUNT) - signatures @ np.array([0.5, 0.3, 0.0, 0.4])

    def fitted(*names: str) -> Screening:
        at = [NAMES.index(name) for name in names]
        best = -np.linalg.lstsq(signatures[:, at], errors, rcond=None)[0]
        made = screening(signatures, errors + signatures[:, at] @ best, dict(zip(names, best.tolist(), strict=True)))
        made.prior = np.where(np.isin(np.arange(4), at), 1e6, made.prior)
        made._project(made._known)
        return made

    alone, less = fitted("infiltration"), fitted("roof_exchange", "infiltration").without("roof_exchange")
    less.prior = alone.prior
    for name in ("roof_exchange", "ground_exchange", "interfloor_exchange"):
        one, other = less.of(name), alone.of(name)
        assert one.gain == pytest.approx(other.gain, rel=1e-8)
        assert one.strengths == pytest.approx(other.strengths, rel=1e-8)
        assert less.promised(one) == pytest.approx(alone.promised(other), rel=1e-6)


def quiet_twin() -> Case:
    """A twin that lacks nothing."""
    building = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    quiet = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.005, 0.01))
    settings = TwinSettings(days=15.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=quiet)
    return generate_twin(building, 3, settings)[0]


def biased_and_misread() -> tuple[ModelComparison, str, str]:
    """A twin whose meter of one zone reads low and whose sensor of another reads high; the two zones."""
    case = quiet_twin()
    building = case.building
    low, high = building.zone_names[1], building.zone_names[3]
    frame = case.telemetry.frame.copy()
    (device,) = building.devices_of(low)
    frame[f"{device.name}/supply_air_flowrate_sensor"] /= 1.0 + ERROR
    (device,) = building.devices_of(high)
    frame[f"{device.name}/zone_air_temperature_sensor"] += BIAS
    return ModelComparison(Case(building, Telemetry.from_frame(frame)), ModelSettings(dx=1.0)), low, high


def test_a_screening_sees_the_tangents_of_the_grid(monkeypatch: pytest.MonkeyPatch) -> None:
    """A basis that was made where no effect is at work serves the tangents to all of them."""
    models, _, high = biased_and_misread()
    names = ("flow_gain", "sensor_bias", "infiltration", "internal_gains", "hidden_mass", "zone_mixing")
    for effects in ({}, {"sensor_bias": (high,)}):
        fit = models.fit(effects, [{}])
        reduced = Screening(models, fit, names)
        with monkeypatch.context() as patch:
            patch.setattr("calibration.diagnosis.screen.screen.reduced_model", lambda grid, *_, **__: grid)
            whole = Screening(models, fit, names)
        for name in set(names) - set(effects):
            one, other = reduced.of(name), whole.of(name)
            assert one.gain == pytest.approx(other.gain, abs=0.05), name
            assert one.zones == other.zones, name
            assert one.direction / reduced.prior == pytest.approx(other.direction / whole.prior, abs=0.01), name


def test_tangents_know_both_ends_of_the_ground_temperature() -> None:
    """Columns of the Gram matrix are those of differences of runs; their mixture is U times the distance to T_g."""
    models, *_ = biased_and_misread()
    fit = models.fit({}, [{}])
    made = Screening(models, fit, ("ground_exchange",))
    names = [p.name for p in made.parameters]
    level = next(p for p in made.parameters if p.name == "ground_temperature")
    columns = [names.index("ground_u_value"), len(names) - 1]
    built = models.build({"ground_exchange": ()})

    def errors(u_value: float, temperature: float) -> FloatArray:
        theta = built.theta({**fit.values, "ground_u_value": u_value, "ground_temperature": temperature})
        problem = models.problem(built, theta)
        return np.concatenate([problem.errors(built.grid, theta, r, slopes=False)[0].ravel() for r in problem.runs])

    away = 1e-3
    none, middle = errors(0.0, level.start), 0.25 * level.lower + 0.75 * level.upper
    low, high, between = ((errors(away, t) - none) / away for t in (level.lower, level.upper, middle))
    assert between == pytest.approx(0.25 * low + 0.75 * high, abs=1e-3 * np.abs(high).max())
    wanted = made.scale * np.array([[low @ low, low @ high], [low @ high, high @ high]])
    assert made._whole[np.ix_(columns, columns)] == pytest.approx(wanted, rel=0.02)
    values, errors_of = made._named("ground_exchange", np.array(columns), np.array([0.1, 0.3]), 1e-4 * np.eye(2))
    assert values == pytest.approx({"ground_u_value": 0.4, "ground_temperature": middle})
    assert errors_of["ground_u_value"] == pytest.approx(0.01 * np.sqrt(2.0))
    span = level.upper - level.lower
    assert errors_of["ground_temperature"] == pytest.approx(0.01 * span * np.hypot(0.75, 0.25) / 0.4)


def in_zone(made: Screening, effect: str, zone: str) -> Gain:
    index = np.array([k for k, p in enumerate(made.parameters) if p.name == f"{effect}@{zone}"])
    return made._gain(effect, index, (zone,), choice_of(1, 4), 4)


def test_a_pair_is_accepted_where_neither_member_would_be() -> None:
    """Each is hardly seen alone."""
    models, low, high = biased_and_misread()
    baseline = models.fit({}, [{}])
    made = Screening(models, baseline, ("flow_gain", "sensor_bias"))
    gains = sorted((in_zone(made, "flow_gain", low), in_zone(made, "sensor_bias", high)), key=lambda g: -g.gain)
    assert all(g.gain < ACCEPTED for g in gains)
    found = _best_pair(Work(models, baseline, held_out(models, baseline), made), gains, (), None)
    assert found is not None
    first, both = found
    assert not first.counts and both.counts
    assert both.gain > 2.0 * ACCEPTED > first.gain
    assert both.fit.values[f"flow_gain@{low}"] == pytest.approx(ERROR, abs=0.05)
    assert both.fit.values[f"sensor_bias@{high}"] == pytest.approx(BIAS, abs=0.1)


def test_zones_that_differ_are_tried_everywhere_and_told_where_it_is() -> None:
    """A meter reads wrong in one zone of four: a strength each costs but its share everywhere, and one is told."""
    models, low, _ = biased_and_misread()
    baseline = models.fit({}, [{}])
    made = Screening(models, baseline, ("flow_gain",))
    some, everywhere = made.apart("flow_gain")
    zones = set(models.case.building.zone_names)
    assert low in some.zones and set(some.zones) < zones == set(everywhere.zones)
    assert everywhere.choice == pytest.approx(np.log(2.0)) and everywhere.places == len(zones)
    assert set(everywhere.strengths) == {f"flow_gain@{zone}" for zone in zones}
    found = Work(models, baseline, held_out(models, baseline), made).refit([everywhere], made.promised(everywhere))
    assert found is not None
    assert set(found.screened.zones) == zones and low in found.zones and set(found.zones) < zones


def test_what_all_zones_have_alike_is_one_strength(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every valve leaks as much that no meter sees: a strength a zone is too dear, one for all is found and fitted."""
    monkeypatch.setitem(CATALOGUE, "valve_leak", replace(CATALOGUE["valve_leak"], alike=True))
    clean, leak = quiet_twin(), 4.0
    frame, building = clean.telemetry.frame.copy(), clean.building
    assert isinstance(building.geometry, FloorPlans)
    areas = zone_floor_areas(building.geometry)
    for zone in building.zone_names:
        (device,) = building.devices_of(zone)
        flow = frame[f"{device.name}/supply_air_flowrate_sensor"]
        heat = AIR_HEAT_CAPACITY * flow.where(flow > 0.0, np.inf)
        frame[f"{device.name}/discharge_air_temperature_sensor"] -= leak * areas[zone] / heat
    models = ModelComparison(Case(building, Telemetry.from_frame(frame)), ModelSettings(dx=1.0))
    baseline = models.fit({}, [{}])
    made = Screening(models, baseline, ("valve_leak",))
    members, everywhere = made.members_of("valve_leak")
    columns = np.concatenate(list(members.values()))
    assert made.jacobian is not None
    assert made.jacobian[:, everywhere[ALIKE]][:, 0] == pytest.approx(made.jacobian[:, columns].sum(axis=1))
    gain = made.of("valve_leak")
    assert gain.zones == ALIKE and list(gain.strengths) == ["valve_leak"]
    assert gain.gain > made._grow("valve_leak", members).gain
    found = Work(models, baseline, held_out(models, baseline), made).refit([gain], made.promised(gain))
    assert found is not None and found.fit.effects == {"valve_leak": ALIKE} and found.counts
    assert found.fit.values["valve_leak"] == pytest.approx(leak, rel=0.2)


def test_what_promises_to_matter_little_is_not_fitted() -> None:
    """Falls of the root mean square by closed form; the pair that is fitted above is not where errors are tiny."""
    models, low, high = biased_and_misread()
    baseline = models.fit({}, [{}])
    made = Screening(models, baseline, ("flow_gain", "sensor_bias"))
    gains = sorted((in_zone(made, "flow_gain", low), in_zone(made, "sensor_bias", high)), key=lambda g: -g.gain)
    for rms in (0.005, 0.2, 2.0):
        found = replace(baseline.found, mean_square=rms**2)
        work = Work(models, replace(baseline, found=found), held_out(models, baseline), made)
        for share in (0.0, 0.01, 0.1, 0.5):
            assert promising(work.fit, share) == (rms - np.sqrt((1.0 - share) * rms**2) > 0.25 * MATTERS)
        if rms == 0.005:
            assert _best_pair(work, gains, (), None) is None
            surely = tuple(replace(g, gain=50.0) for g in gains)
            assert _refits(work, surely, None) == []
            told = Round(work.fit, work.held_out, made, surely, surely[0], (), None, NONE)
            assert set(gains_of(told).values()) == {SMALL}


def test_what_stood_for_another_effect_is_exchanged_once_the_second_is_in_the_model() -> None:
    models, low, high = biased_and_misread()
    baseline = models.fit({}, [{}])
    names = ("flow_gain", "sensor_bias", "valve_leak")

    def searched(first: str) -> tuple[list[Round], Screening]:
        """Two rounds of which the first accepts an effect in the zone whose meter is wrong, the second the bias."""
        fit, rounds = baseline, []
        for effect, zone in ((first, low), ("sensor_bias", high)):
            made = Screening(models, fit, [n for n in names if n not in fit.effects])
            work = Work(models, fit, held_out(models, fit), made)
            gain = in_zone(made, effect, zone)
            refit = work.refit([gain], made.promised(gain))
            assert refit is not None
            generic = replace(gain, effect="generic")
            rounds.append(Round(fit, work.held_out, made, (gain,), generic, (refit,), refit, NONE))
            fit = refit.fit
        return rounds, Screening(models, fit, [n for n in names if n not in fit.effects])

    rounds, made = searched("valve_leak")
    found = _exchanged(models, rounds, made, names)
    assert found is not None and found.accepted is not None and found.pair is not None
    assert found.before is baseline
    assert (found.accepted.screened.effect, found.pair.screened.effect) == ("sensor_bias", "flow_gain")
    assert list(found.accepted.fit.effects) == ["sensor_bias"]
    assert found.pair.fit.effects == {"sensor_bias": (high,), "flow_gain": (low,)}
    assert found.pair.fit.found.mean_square < rounds[-1].after.found.mean_square
    rounds, made = searched("flow_gain")
    assert _exchanged(models, rounds, made, names) is None
    assert _exchanged(models, rounds[:1], made, names) is None


def test_an_effect_in_more_zones_than_the_tangents_saw_is_everywhere() -> None:
    assert choice_of(5, 4) == choice_of(5, 5) == pytest.approx(np.log(2.0))
    assert choice_of(2, 4) == pytest.approx(3.0 * np.log(2.0) + np.log(6.0))
