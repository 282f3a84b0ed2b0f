"""Smoother: against a textbook smoother written here and statsmodels, and the coverage of its band."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother as Reference

from calibration import DisturbanceModel, KalmanFilter, StateSpace, smooth
from calibration.errors import FilterError
from calibration.estimation.kalman import Filtered
from calibration.estimation.smoother import averaged_deviation
from thermal import Inputs

FloatArray = NDArray[np.float64]

REFERENCE = 293.15
STEP = 300.0
START = np.full((9, 1), REFERENCE)


Simulate = Callable[..., tuple[Inputs, FloatArray]]
Gaps = Callable[[Inputs], Inputs]

DISTURBANCE = DisturbanceModel(np.array([150.0, 60.0, 100.0]), 3600.0, np.array([0.05, 0.1, 0.07]))


def textbook(found: Filtered, inputs: Inputs) -> tuple[FloatArray, FloatArray]:
    """Rauch, Tung and Striebel 1965 with dense matrices: means and covariances of every step."""
    kalman, count = found.kalman, len(found.stamps)
    whole, r = kalman.whole, kalman.space.order
    a, c, noise = whole.dense(), whole.observation, np.diag(whole.noise_variance)
    p = kalman.steady(found.measured)[0]
    u = kalman.space.drives(inputs.boundary[1:], inputs.heat[1:])
    means, spreads, before, ahead = [], [], [], []
    x = found.states[0]
    for k in range(count):
        before.append(x)
        ahead.append(p)
        m = np.isfinite(inputs.zone[k + 1])
        gain = p @ c[m].T @ np.linalg.inv(c[m] @ p @ c[m].T + noise[np.ix_(m, m)])
        x = x + gain @ (inputs.zone[k + 1] - REFERENCE - c @ x - kalman.space.feedthrough @ u[k])[m]
        p = p - gain @ c[m] @ p
        means.append(x)
        spreads.append(p)
        x, p = a @ x, whole.propagate(p)
        x[:r] += kalman.space.drive @ u[k]
    for k in range(count - 2, -1, -1):
        back = spreads[k] @ a.T @ np.linalg.pinv(ahead[k + 1], rcond=1e-15, hermitian=True)
        means[k] = means[k] + back @ (means[k + 1] - before[k + 1])
        spreads[k] = spreads[k] + back @ (spreads[k + 1] - ahead[k + 1]) @ back.T
    return np.array(means), np.array(spreads)


def test_it_is_the_textbook_s_smoother_with_missing_data(building: StateSpace, simulate: Simulate, gaps: Gaps) -> None:
    inputs = gaps(simulate(200, 0)[0])
    filtered = KalmanFilter(building, DISTURBANCE, tolerance=0.0).filter(inputs, 0, 200, START)
    found = smooth(filtered)
    means, spreads = textbook(filtered, inputs)
    np.testing.assert_allclose(found.disturbance, means[:, -3:], rtol=0, atol=1e-6)
    wanted = np.sqrt(np.diagonal(spreads, axis1=1, axis2=2)[:, -3:])
    np.testing.assert_allclose(found.disturbance_deviation, wanted, rtol=1e-7)
    space, c = filtered.kalman.space, filtered.kalman.whole.observation
    through = space.drives(inputs.boundary[1:], inputs.heat[1:]) @ space.feedthrough.T + REFERENCE
    np.testing.assert_allclose(found.zone, means @ c.T + through, rtol=0, atol=1e-9)
    wanted = np.sqrt(np.diagonal(c @ spreads @ c.T, axis1=1, axis2=2))
    np.testing.assert_allclose(found.zone_deviation, wanted, rtol=1e-6)


def test_against_statsmodels(building: StateSpace, simulate: Simulate, gaps: Gaps) -> None:
    inputs = gaps(simulate(150, 1)[0])
    kalman = KalmanFilter(building, DISTURBANCE, tolerance=0.0)
    whole, space = kalman.whole, kalman.space
    steady = kalman.steady(np.ones(3, dtype=bool))[0]
    scale = np.sqrt(np.diag(steady))
    drives = space.drives(inputs.boundary[1:], inputs.heat[1:])
    reference = Reference(k_endog=3, k_states=whole.n, k_posdef=3, tolerance=0)
    reference.bind((inputs.zone[1:] - REFERENCE).copy())
    reference["design"] = whole.observation * scale
    reference["obs_intercept"] = (drives @ space.feedthrough.T).T
    reference["obs_cov"] = np.diag(whole.noise_variance)
    reference["transition"] = whole.dense() * scale / scale[:, None]
    reference["state_intercept"] = np.vstack([(drives @ space.drive.T).T, np.zeros((3, 150))]) / scale[:, None]
    reference["selection"] = np.eye(whole.n)[:, -3:] / scale[-3:]
    reference["state_cov"] = np.diag(whole.heat_variance)
    reference.initialize_known(np.zeros(whole.n), steady / np.outer(scale, scale))
    result = reference.smooth()
    found = smooth(kalman.filter(inputs, 0, 150, START))
    np.testing.assert_allclose(found.disturbance, scale[-3:] * result.smoothed_state[-3:].T, rtol=0, atol=1e-6)
    variance = np.diagonal(result.smoothed_state_cov, axis1=0, axis2=1)[:, -3:]
    np.testing.assert_allclose(found.disturbance_deviation, scale[-3:] * np.sqrt(variance), rtol=1e-7)


def test_band_covers_the_disturbance_at_its_rate(building: StateSpace, simulate: Simulate) -> None:
    """Pooled over 10 buildings of 3 zones and 1000 steps; errors are correlated over an hour or so."""
    inside, widths = [], []
    for seed in range(10):
        inputs, truth = simulate(1000, seed)
        found = smooth(KalmanFilter(building, DISTURBANCE).filter(inputs, 0, 1000, START))
        low, high = found.band(0.9)
        inside.append(((low < truth) & (truth < high)).mean(axis=0))
        widths.append(np.sqrt(np.mean((found.disturbance - truth) ** 2, axis=0)) / found.disturbance_deviation[500])
    assert np.mean(inside) == pytest.approx(0.9, abs=0.02)
    np.testing.assert_allclose(np.mean(widths, axis=0), 1.0, atol=0.07)


def test_smoothed_is_nearer_than_filtered(building: StateSpace, simulate: Simulate) -> None:
    inputs, truth = simulate(1500, 3)
    filtered = KalmanFilter(building, DISTURBANCE).filter(inputs, 0, 1500, START)
    found = smooth(filtered)
    assert (found.disturbance_deviation < filtered.disturbance_deviation + 1e-12).all()
    errors = [np.sqrt(np.mean((d - truth) ** 2)) for d in (found.disturbance, filtered.disturbance)]
    assert errors[0] < 0.9 * errors[1]


def test_at_the_end_it_knows_what_the_filter_knows(building: StateSpace, simulate: Simulate) -> None:
    filtered = KalmanFilter(building, DISTURBANCE).filter(simulate(100, 4)[0], 0, 100, START)
    found = smooth(filtered)
    np.testing.assert_allclose(found.disturbance[-1], filtered.disturbance[-1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.disturbance_deviation[-1], filtered.disturbance_deviation[-1], rtol=1e-9)
    np.testing.assert_allclose(found.zone[-1], filtered.zone[-1], rtol=0, atol=1e-9)


def test_a_gap_is_bridged_and_its_band_is_wide(building: StateSpace, simulate: Simulate) -> None:
    inputs, truth = simulate(600, 5)
    zone = inputs.zone.copy()
    zone[300:348, 0] = np.nan
    holed = replace(inputs, zone=zone)
    found = smooth(KalmanFilter(building, DISTURBANCE).filter(holed, 0, 600, START))
    assert np.isfinite(found.zone).all()
    assert np.abs(found.zone[299:347, 0] - inputs.zone[300:348, 0]).max() < 3.5 * found.zone_deviation[323, 0] + 0.2
    assert found.disturbance_deviation[323, 0] > 1.3 * found.disturbance_deviation[200, 0]
    assert np.abs(found.disturbance[323, 0] - truth[323, 0]) < 4.0 * found.disturbance_deviation[323, 0]


def test_steady_gains_give_the_same_where_nothing_is_missing(building: StateSpace, simulate: Simulate) -> None:
    inputs, _ = simulate(3000, 6)
    exact, steady = (
        smooth(KalmanFilter(building, DISTURBANCE, covariance=c).filter(inputs, 0, 3000, START))
        for c in ("exact", "steady")
    )
    np.testing.assert_allclose(steady.disturbance, exact.disturbance, rtol=0, atol=1e-9)
    middle = slice(0, 500)  # far from the end, where the future still tells more
    np.testing.assert_allclose(
        steady.disturbance_deviation[middle], exact.disturbance_deviation[middle], rtol=1e-5
    )  # fmt: skip


def test_random_walk_is_smoothed(building: StateSpace, simulate: Simulate) -> None:
    walk = DisturbanceModel(np.array([300.0, 200.0, 250.0]), np.inf, 0.05)
    inputs, truth = simulate(800, 7, walk)
    found = smooth(KalmanFilter(building, walk).filter(inputs, 0, 800, START))
    low, high = found.band(0.9)
    assert ((low < truth) & (truth < high))[100:].mean() > 0.8


def posterior(kalman: KalmanFilter, count: int) -> FloatArray:
    """Covariance of all disturbances given all measurements, as one large normal law: (count, n_zone) twice."""
    whole, r = kalman.whole, kalman.space.order
    start = np.linalg.cholesky(kalman.steady(np.ones(3, dtype=bool))[0] + 1e-9 * np.eye(whole.n))
    sources = np.zeros((whole.n, whole.n + 3 * count))  # z as a sum of independent unit normals
    sources[:, : whole.n] = start
    heat, seen = [], []
    for k in range(count):
        heat.append(sources[r:])
        seen.append(whole.observation @ sources)
        sources = whole.advance(sources)
        at = whole.n + 3 * k
        sources[r:, at : at + 3] += np.diag(np.sqrt(whole.heat_variance))
    d, y = np.concatenate(heat), np.concatenate(seen)
    noise = np.diag(np.tile(whole.noise_variance, count))
    left = d @ d.T - d @ y.T @ np.linalg.solve(y @ y.T + noise, y @ d.T)
    return np.asarray(left.reshape(count, 3, count, 3))


@pytest.mark.parametrize("steps", [1, 4, 12])
def test_mean_of_steps_is_known_as_well_as_one_large_normal_law_says(
    steps: int, building: StateSpace, simulate: Simulate
) -> None:
    kalman = KalmanFilter(building, DISTURBANCE)
    left = posterior(kalman, 160)
    middle = slice(70, 70 + steps)
    found = averaged_deviation(kalman.filter(simulate(200, 0)[0], 0, 200, START), steps)
    for zone in range(3):
        block = left[middle, zone, middle, zone]
        assert found[zone] == pytest.approx(np.sqrt(block.mean() / left[70, zone, 70, zone]), rel=1e-3)
    assert (found <= 1.0 + 1e-12).all()


@pytest.mark.parametrize("level", [0.0, 1.0, 1.5])
def test_level_must_be_a_probability(level: float, building: StateSpace, simulate: Simulate) -> None:
    found = smooth(KalmanFilter(building, DISTURBANCE).filter(simulate(20, 0)[0], 0, 20, START))
    with pytest.raises(FilterError, match="expected a probability between 0 and 1"):
        found.band(level)
