"""Back-off: deviations against the filter's own and against draws; the violation rate that was asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, norm

from calibration import DisturbanceModel, KalmanFilter
from calibration.estimation.state_space import state_space
from mpc.control.predictor.heat import HeatChannel, HeatPredictor
from mpc.control.problem.horizon import Horizon
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.convex import LinearSolver
from mpc.control.solvers.uncertainty import BackOff, Margin
from mpc.errors import ControlError
from mpc.scenario.forecast import ErrorGrowth
from thermal.model.step import IMPLICIT_EULER

HORIZON = Horizon.regular(2.0, 600.0, 12)
DRAWS = 500


@pytest.fixture(scope="module")
def kalman(modes) -> KalmanFilter:
    return KalmanFilter(state_space(modes, 600.0), DisturbanceModel(150.0, 3 * 3600.0, 0.1))


def drawn(kalman, modes, growth: ErrorGrowth, plan_heat: np.ndarray, data, rng) -> np.ndarray:
    """Zones at the ends of the steps in draws of state, heat and weather, shape (DRAWS, N, n_zone) [K]."""
    r, step = kalman.space.order, modes.propagator(600.0, IMPLICIT_EULER)
    values, vectors = np.linalg.eigh(kalman.steady(np.ones(5, dtype=bool))[0])
    z = rng.standard_normal((DRAWS, values.size)) @ (vectors * np.sqrt(values.clip(0.0))).T
    x, d, e, found = data.state + z[:, :r], data.disturbance + z[:, r:], np.zeros(DRAWS), []
    keep, added = kalman.disturbance.discrete(600.0)
    fading = np.exp(-600.0 / growth.time_constant)
    for k in range(len(HORIZON)):
        e = fading * e + growth.deviation * np.sqrt(1.0 - fading**2) * rng.standard_normal(DRAWS)
        push = (data.boundary[k, 0] + e - 293.15)[:, None] * modes.boundary[:, 0]
        push += (plan_heat[k] + data.gains[k] + d) @ modes.heating.T
        x = step.end * x + step.end_gain * push
        d = keep * d + added * rng.standard_normal(d.shape)
        found.append(x @ modes.output.T + 293.15)
    return np.stack(found, axis=1)


def test_deviations_are_those_of_draws(kalman, modes, make_data) -> None:
    growth, rng = ErrorGrowth(2.0, 6 * 3600.0), np.random.default_rng(0)
    problem = ControlProblem(HeatPredictor(modes, HORIZON, [HeatChannel("heating", z, 3e3) for z in range(5)]))
    data = make_data(problem, previous=np.zeros(5), disturbance=np.zeros(5))
    deviation = BackOff(kalman, modes, HORIZON, 0.1, outdoor=growth).deviation
    zones = drawn(kalman, modes, growth, np.zeros((12, 5)), data, rng)
    np.testing.assert_allclose(zones.std(axis=0), deviation, rtol=0.12)  # 3.5 deviations of a deviation of 500 draws
    assert (np.diff(deviation, axis=0) > 0.0).all()


def test_later_actions_stop_its_growth(kalman, modes) -> None:
    open_loop = BackOff(kalman, modes, HORIZON, 0.1).deviation
    closed = BackOff(kalman, modes, HORIZON, 0.1, recourse=1800.0).deviation
    np.testing.assert_array_equal(closed[:3], open_loop[:3])
    np.testing.assert_array_equal(closed[3:], np.tile(open_loop[2], (9, 1)))
    blind = BackOff(kalman, modes, HORIZON, 0.1).deviations(np.arange(5) > 0)
    assert (blind[:, 0] > 1.5 * open_loop[:, 0]).all()


@pytest.mark.parametrize("violation", [0.05, 0.2])
def test_bands_are_missed_as_often_as_was_asked_for(kalman, modes, make_data, violation) -> None:
    """Dear comfort and a heater just strong enough: zones sit on the narrowed edge, 500 futures miss the true one."""
    growth, rng = ErrorGrowth(2.0, 6 * 3600.0), np.random.default_rng(1)
    predictor = HeatPredictor(
        modes, HORIZON, [HeatChannel("heating", z, 2e4) for z in range(5)], disturbance_time=3 * 3600.0
    )
    problem = ControlProblem(predictor, softness=0.005, terminal_time=0.0)
    data = make_data(problem, 270.0, 293.8, previous=np.zeros(5), comfort_price=np.full((12, 5), 100.0))
    data = replace(data, disturbance=np.zeros(5))
    off = BackOff(kalman, modes, HORIZON, violation, outdoor=growth)
    narrowed = off.narrow(data)
    found = LinearSolver(problem).solve(narrowed, np.zeros(problem.shape))
    active = np.abs(found.rollout.zone[1:] - narrowed.lower) < 0.02 * off.deviation
    assert active.mean() > 0.6
    zones = drawn(kalman, modes, growth, found.rollout.heat, data, rng)
    missed = (zones < data.lower).sum(axis=0)[active]
    # each zone and step by itself: a band that one in ten thousand would leave, for some fifty of them
    low, high = binom.ppf([5e-5, 1.0 - 5e-5], DRAWS, violation)
    assert (missed >= low).all() and (missed <= high).all()
    assert abs(missed.mean() / DRAWS - violation) < 0.3 * violation
    plain = LinearSolver(problem).solve(data, np.zeros(problem.shape))
    assert (drawn(kalman, modes, growth, plain.rollout.heat, data, rng) < data.lower).mean() > 2.0 * violation


def test_too_narrow_a_band_shrinks_to_its_middle(kalman, modes, make_data) -> None:
    problem = ControlProblem(HeatPredictor(modes, HORIZON, [HeatChannel("heating", z, 3e3) for z in range(5)]))
    data = make_data(problem, previous=np.zeros(5), upper=np.full((12, 5), 294.16))
    narrowed = BackOff(kalman, modes, HORIZON, 0.01).narrow(data)
    np.testing.assert_allclose(narrowed.lower, 294.155)
    np.testing.assert_allclose(narrowed.upper, 294.155)
    with pytest.raises(ControlError, match="up to 0.5"):
        BackOff(kalman, modes, HORIZON, 0.7)


def test_a_margin_prices_the_expected_excess(modes, make_data) -> None:
    """With a softness of twice its width it is the mean penalty of a zone whose prediction has a normal error."""
    channels = [HeatChannel("heating", z, 3e3) for z in range(5)]
    deviation = 0.2
    width = 1.5 * deviation
    problem = ControlProblem(HeatPredictor(modes, HORIZON, channels), softness=2.0 * width, terminal_time=0.0)
    data = make_data(problem, previous=np.zeros(5), disturbance=np.zeros(5))
    narrowed = Margin(width).narrow(data)
    price = data.comfort_price[0, 0] * HORIZON.steps[0] / 3600.0
    for excess in np.linspace(-1.0, 1.0, 21):
        zone = np.full(data.upper.shape, data.upper[0, 0] + excess)
        expected = deviation * norm.pdf(excess / deviation) + excess * norm.cdf(excess / deviation)
        found = problem.penalty(narrowed, zone).value[0, 0] / price
        assert found == pytest.approx(expected, abs=0.05 * deviation)
    tight = Margin(5.0).narrow(data)
    np.testing.assert_array_equal(tight.lower, 0.5 * (data.lower + data.upper))
    np.testing.assert_array_equal(tight.lower, tight.upper)
    with pytest.raises(ControlError, match="0 K or more"):
        Margin(-0.1)
