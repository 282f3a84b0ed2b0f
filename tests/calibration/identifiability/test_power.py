"""Power of the data: it is the information of the problem at the start, and does not know the errors."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from calibration import CalibrationError, Interval, Power, fisher_information, power_of_data
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.problem import Problem, tuning_problem
from calibration.identifiability.power import _information, _zones_of_rows
from mpc.reports.identifiability import information_sentences, power_sentences
from thermal import load_bundled_case, reduced_model

COARSE = CalibrationSettings(dx=1.5)


@cache
def problem() -> Problem:
    return tuning_problem(load_bundled_case(), settings=COARSE)


@cache
def power() -> Power:
    return power_of_data(load_bundled_case(), settings=COARSE, draws=2)


def test_problem_is_that_of_the_first_two_thirds() -> None:
    """Runs tile the tuning interval: no residual outside of it, none counted twice."""
    p, stamps = problem(), load_bundled_case().stamps
    starts = np.concatenate([r.starts for r in p.runs])
    assert (np.diff(starts) >= p.steps).all()
    assert starts[-1] + p.steps < (2 * len(stamps)) // 3
    assert len(p.free) == len(p.grid.network.parameters)


def test_problem_keeps_what_is_fixed() -> None:
    part = Interval(load_bundled_case().stamps[300], load_bundled_case().stamps[900])
    p = tuning_problem(load_bundled_case(), [part], replace(COARSE, fixed={"window_u_value": 1.7}, horizon="3h"))
    names = [q.name for q in p.parameters]
    assert "window_u_value" not in names
    assert p.theta(p.point(p.start))[[q.name for q in p.grid.network.parameters].index("window_u_value")] == 1.7
    assert p.steps == 36
    assert all(300 <= r.starts.min() and r.starts.max() + 36 <= 900 for r in p.runs)


def test_at_the_start_it_is_the_information_of_the_problem() -> None:
    p = problem()
    z, model = p.point(p.start), reduced_model(p.grid, [p.start])
    jacobian = p.weighted(model, z)[1]
    data = p.residuals_only(model, p.start).size
    prior = jacobian[data:].T @ jacobian[data:]
    wanted = fisher_information(p.parameters, jacobian[:data], prior)
    assert [q.ratio for q in power().parameters] == pytest.approx([q.ratio for q in wanted.parameters], rel=1e-6)


def test_errors_do_not_enter() -> None:
    """Other measured temperatures at the targets, as steady, the same starts: the answer is the same to round-off."""
    p = problem()
    rng = np.random.default_rng(0)
    noisy = replace(p, inputs=replace(p.inputs, zone=p.inputs.zone + rng.standard_normal(p.inputs.zone.shape[1])))
    z, deviation = p.point(p.start), np.full(p.inputs.zone.shape[1], 0.3)
    one, other = (_information(q, z, deviation) for q in (p, noisy))
    assert [q.ratio for q in one.parameters] == pytest.approx([q.ratio for q in other.parameters], rel=1e-12)


def test_rows_are_told_apart_by_zone() -> None:
    p = problem()
    zone = p.inputs.zone.copy()
    zone[p.runs[0].starts[0] + p.keep[2], 1] = np.nan
    gappy = replace(p, inputs=replace(p.inputs, zone=zone))
    model = reduced_model(p.grid, [p.start])
    found = _zones_of_rows(gappy, model, p.point(p.start))
    whole = np.bincount(_zones_of_rows(p, model, p.point(p.start)))
    assert (whole - np.bincount(found)).tolist() == [0, 1, 0, 0, 0]
    most = sum(r.starts.size for r in p.runs) * p.keep.size
    assert np.all((0.98 * most < whole) & (whole <= most))  # but for steps that change too fast to be told


def test_twice_the_error_is_a_quarter_of_the_information() -> None:
    p = problem()
    z, zones = p.point(p.start), p.inputs.zone.shape[1]
    shares = [[d.share for d in _information(p, z, np.full(zones, s)).directions] for s in (0.3, 0.6)]
    odds = [np.array(s) / (1.0 - np.array(s)) for s in shares]
    np.testing.assert_allclose(odds[0][:6], 4.0 * odds[1][:6], rtol=1e-6)


def test_a_zone_that_is_hardly_measured_tells_nothing() -> None:
    """A zone with an error of 1000 K adds what it would add unmeasured, up to how many observations all count for:
    of its rows a few less are left out as too fast.
    """
    p = problem()
    z, zones = p.point(p.start), p.inputs.zone.shape[1]
    given = np.full(zones, 0.3)
    given[2] = 1e3
    zone = p.inputs.zone.copy()
    zone[:, 2] = np.nan
    without = replace(p, inputs=replace(p.inputs, zone=zone))
    one, other = _information(p, z, given), _information(without, z, np.full(zones, 0.3))
    assert [q.ratio for q in one.parameters] == pytest.approx([q.ratio for q in other.parameters], rel=1e-3)


def test_least_and_most_hold_the_start_and_sentences_say_it() -> None:
    found = power()
    assert all(p.least <= p.ratio <= p.most for p in found.parameters)
    told = {p.name: p for p in found.parameters}
    assert told["shuffle_probability"].told == "no"
    assert told["slab_heat_capacity"].told == "yes"
    sentences = power_sentences(found)
    spoken = dict(zip(told, sentences, strict=False))
    assert spoken["shuffle_probability"].startswith("These data will not tell the shuffle probability: ")
    assert "over the prior" in spoken["slab_heat_capacity"]
    assert sentences[len(found.parameters) :] == information_sentences(found.information)
    assert set(found.deviation.values()) == {0.3}
    assert json.loads(json.dumps(found.to_dict()))["parameters"]["window_u_value"]["told"] in {"yes", "perhaps", "no"}


def test_progress_and_seed() -> None:
    told: list[Any] = []
    one = power_of_data(load_bundled_case(), settings=COARSE, draws=1, progress=lambda *a: told.append(a))
    other = power_of_data(load_bundled_case(), settings=replace(COARSE, seed=1), draws=1)
    assert told == [("power", 1, 2), ("power", 2, 2)]
    assert [p.ratio for p in one.parameters] == [p.ratio for p in other.parameters]
    assert [p.most for p in one.parameters] != [p.most for p in other.parameters]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"deviation": 0.0}, "expected a positive number of kelvin"),
        ({"deviation": {"attic": 0.1}}, "no zone 'attic' in the building"),
        ({"draws": -1}, "draws: expected at least 0"),
    ],
)
def test_bad_input_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        power_of_data(load_bundled_case(), settings=COARSE, **given)
