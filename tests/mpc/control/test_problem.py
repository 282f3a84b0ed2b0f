"""Cost terms by hand, and the gradient against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.control.problem.channels import Channel
from mpc.control.problem.horizon import PeakData


def test_terms_are_what_they_say(make_problem, make_data) -> None:
    problem = make_problem(softness=0.5, terminal_time=3600.0, move_weight=2.0)
    data = make_data(problem, heat_value=0.02)
    plan = np.array([[288.0, 330.0], [290.0, 345.0], [286.0, 320.0], [292.0, 335.0]])
    rollout = problem.predictor.rollout(data, plan)
    terms, hours = problem.terms(data, rollout), problem.predictor.horizon.steps / 3600.0
    assert terms.electricity == pytest.approx((data.electricity_price * hours * rollout.electric / 1000.0).sum())
    assert terms.gas == pytest.approx((0.05 * hours * rollout.fuel / 1000.0).sum())
    hours[-1] += 1.0
    out = np.maximum(294.15 - rollout.zone[1:], 0.0) + np.maximum(rollout.zone[1:] - 297.15, 0.0)
    penalty = np.where(out < 0.5, out**2, out - 0.25)
    assert terms.comfort == pytest.approx(float((0.3 * hours[:, None] * penalty).sum()))
    changes = np.diff(np.vstack([[288.0, 330.0], plan]), axis=0) / [15.0, 45.0]
    assert terms.moves == pytest.approx(2.0 * (changes**2).sum())
    assert terms.total == pytest.approx(sum(terms))


def test_the_gradient_is_that_of_finite_differences(make_problem, make_data) -> None:
    problem = make_problem()
    data = make_data(problem, heat_value=0.02)
    shares = np.linspace(0.2, 0.8, problem.span.size)
    rollout = problem.predictor.rollout(data, problem.plan(shares))
    found = problem.gradient(data, rollout, problem.predictor.sensitivity(data, rollout))
    for j in range(shares.size):
        step = np.eye(shares.size)[j] * 1e-4
        sides = [
            problem.terms(data, problem.predictor.rollout(data, problem.plan(shares + s))).total for s in (step, -step)
        ]
        assert found[j] == pytest.approx((sides[0] - sides[1]) / 2e-4, rel=2e-3, abs=2e-4)


def test_peaks_below_those_of_the_month_are_free() -> None:
    peaks = PeakData(
        np.array([[0.5, 0.5, 0.0]]), np.zeros(1), np.zeros(1, dtype=int), np.array([10.0]), np.array([4e3])
    )
    assert peaks.peaks(np.array([1e3, 3e3, 9e3])).tolist() == [4000.0]
    assert peaks.peaks(np.array([1e4, 2e3, 0.0])).tolist() == [6000.0]


def test_limits_on_changes(make_problem, make_data) -> None:
    channels = (
        Channel("supply_air_temperature_setpoint", 285.0, 300.0, 6.0),
        Channel("supply_water_temperature_setpoint", 310.0, 355.0),
    )
    problem = make_problem(channels=channels)
    most = problem.most_change.reshape(4, 2) * [15.0, 45.0]
    np.testing.assert_allclose(most[:, 0], [0.5, 3.0, 3.0, 6.0])  # 5 minutes, then the lengths of the blocks
    assert np.isinf(most[:, 1]).all()
    said = problem.explain_limits(make_data(problem, previous=np.array([280.0, 330.0])))
    assert len(said) == 1 and "280 K, outside of its range" in said[0]
