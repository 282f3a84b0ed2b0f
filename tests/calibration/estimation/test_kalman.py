"""Kalman filter: by hand, against a textbook filter written here, statsmodels, and the normal density of all data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import multivariate_normal
from statsmodels.tsa.statespace.kalman_filter import KalmanFilter as Reference

from calibration import DisturbanceModel, KalmanFilter, StateSpace
from calibration.errors import FilterError
from calibration.estimation.gains import Covariance, pays_off, runs
from calibration.estimation.smoother import costates
from calibration.estimation.state_space import state_space
from thermal import Inputs
from thermal.model.matrices import Matrices
from thermal.model.step import EXACT

FloatArray = NDArray[np.float64]

REFERENCE = 293.15
STEP = 300.0
AIRFLOWS, FLOW = ((0, 1), (1, 2)), np.array([0.05, 0.02])


Pencil, Telemetry = Callable[..., Matrices], Callable[..., Inputs]
Gaps = Callable[[Inputs], Inputs]

DISTURBANCE = DisturbanceModel(np.array([150.0, 60.0, 100.0]), 3600.0, np.array([0.05, 0.1, 0.07]))


@dataclass(frozen=True)
class Simulated:
    """A building with a disturbance that is known, and its telemetry from row 1 on."""

    space: StateSpace
    inputs: Inputs
    disturbance: FloatArray
    states: FloatArray


def simulate_with(
    telemetry: Telemetry, space: StateSpace, count: int, seed: int, constant: float | None = None
) -> Simulated:
    """Rows 1 to ``count`` of a building that starts at 293.15 K throughout; the disturbance has its model's law."""
    rng, n_zone = np.random.default_rng(seed), space.n_zone
    keep, drive = DISTURBANCE.discrete(STEP)
    heat = 500.0 * rng.random((count + 1, n_zone))
    boundary = 283.15 + 3.0 * np.sin(np.arange(count + 1) / 40.0)[:, None]
    airflow = FLOW * (1.0 + 0.3 * np.sin(np.arange(count + 1) / 9.0)[:, None]) if space.flow is not None else None
    sigma = np.asarray(DISTURBANCE.deviation)[:n_zone]
    d = sigma * rng.standard_normal(n_zone)
    x, zone, truth = np.zeros(space.order), np.full((count + 1, n_zone), REFERENCE), np.zeros((count + 1, n_zone))
    states = np.zeros((count + 1, space.order))
    for k in range(1, count + 1):
        truth[k] = d if constant is None else constant
        given = heat[k] + truth[k]
        if airflow is not None:
            given = given + space.directed_heat(airflow[k][:, None], x[:, None])[:, 0]
        u = space.drives(boundary[k], given)
        zone[k] = space.observation @ x + space.feedthrough @ u + REFERENCE
        x = space.advance(x) + space.drive @ u
        states[k] = x
        d = keep * d + drive[:n_zone] * rng.standard_normal(n_zone)
    noise = np.asarray(DISTURBANCE.sensor_deviation)[:n_zone] * rng.standard_normal(zone.shape)
    inputs = telemetry(zone + (noise if constant is None else 0.0), heat, boundary, airflow)
    return Simulated(space, inputs, truth, states)


SpaceOf, Simulate = Callable[..., StateSpace], Callable[..., Simulated]


@pytest.fixture(scope="module")
def space_of(pencil: Pencil) -> SpaceOf:
    def space(mixed: bool = False, n_zone: int = 3) -> StateSpace:
        modes = pencil(n_zone).modal.modes
        return state_space(modes, STEP, airflows=AIRFLOWS, flow=FLOW) if mixed else state_space(modes, STEP)

    return space


@pytest.fixture(scope="module")
def simulated(telemetry: Telemetry) -> Simulate:
    return partial(simulate_with, telemetry)


START = np.full((9, 1), REFERENCE)


@dataclass(frozen=True)
class Textbook:
    """Predicted and filtered means and covariances, innovations with their covariances, and the log-likelihood."""

    predicted: FloatArray
    predicted_covariance: FloatArray
    filtered: FloatArray
    filtered_covariance: FloatArray
    log_likelihood: float


def textbook(kalman: KalmanFilter, inputs: Inputs, unknown: FloatArray) -> Textbook:
    """Anderson and Moore 1979, ch. 3, with dense matrices, from the steady covariance."""
    whole, space, r = kalman.whole, kalman.space, kalman.space.order
    a, c, noise = whole.dense(), whole.observation, np.diag(whole.noise_variance)
    q = np.zeros((whole.n, whole.n))
    q[r:, r:] = np.diag(whole.heat_variance)
    x, p = np.zeros(whole.n), kalman.steady(np.isfinite(inputs.zone[1:]).any(axis=0))[0]
    out: list[list[FloatArray]] = [[], [], [], []]
    total = 0.0
    for k in range(1, len(inputs)):
        heat = inputs.heat[k]
        if space.flow is not None:
            heat = heat + space.directed_heat(inputs.airflow[k][:, None], x[:r, None])[:, 0]
        u = space.drives(inputs.boundary[k], heat)
        if not inputs.complete[k]:
            p = p + np.diag(np.concatenate([np.zeros(r), unknown**2]))
        out[0].append(x)
        out[1].append(p)
        m = np.isfinite(inputs.zone[k])
        if m.any():
            error = (inputs.zone[k] - REFERENCE - c @ x - space.feedthrough @ u)[m]
            s = c[m] @ p @ c[m].T + noise[np.ix_(m, m)]
            gain = p @ c[m].T @ np.linalg.inv(s)
            x, p = x + gain @ error, p - gain @ s @ gain.T
            total += multivariate_normal(cov=s).logpdf(error)
        out[2].append(x)
        out[3].append(p)
        x, p = a @ x, a @ p @ a.T + q
        x[:r] += space.drive @ u
    return Textbook(*(np.array(o) for o in out), float(total))


# Oracles


def test_scalar_filter_by_hand(telemetry: Telemetry) -> None:
    """One volume without disturbance: P = q = 0, so the filter only predicts; with it, two steps by hand."""
    m = Matrices(
        capacity=np.array([[3e5]]), flow=np.array([[100.0, -100.0]]), heating=np.array([[1.0]]),
        observation=np.array([[1.0]]), uniform=np.ones(1), capacity_sensitivities=[], flow_sensitivities=[],
    )  # fmt: skip
    space = state_space(m.modal.modes, STEP)
    # implicit Euler: T' = (C T + Δt (U u + q)) / (C + Δt U), mean (T + T') / 2
    share = 3e5 / (3e5 + 300.0 * 100.0)
    warm = 300.0 / (3e5 + 300.0 * 100.0)
    inputs = telemetry(np.array([[293.15], [293.35], [293.25]]), np.zeros((3, 1)), np.full((3, 1), 293.15))
    kalman = KalmanFilter(space, DisturbanceModel(100.0, 3600.0, 0.1))
    found = kalman.filter(inputs, 0, 2, np.array([[293.15]]))
    to_kelvin = np.array([[space.zone_means[0, 0], 0.0], [0.0, 1.0]])
    p = to_kelvin @ kalman.steady(np.array([True]))[0] @ to_kelvin.T  # of temperature and watts
    c = np.array([0.5 * (1.0 + share), 0.5 * warm])
    s = c @ p @ c + 0.01
    gain = p @ c / s
    first = gain * 0.2
    np.testing.assert_allclose(found.innovations[0], 0.2, rtol=1e-9)
    np.testing.assert_allclose(found.innovation_deviation[0], np.sqrt(s), rtol=1e-9)
    np.testing.assert_allclose(found.disturbance[0], first[1], rtol=1e-9)
    keep = np.exp(-300.0 / 3600.0)
    second = np.array([share * first[0] + warm * first[1], keep * first[1]])
    error = 0.1 - c @ second
    np.testing.assert_allclose(found.innovations[1], error, rtol=1e-9)
    np.testing.assert_allclose(found.zone[1] - 293.15, c @ (second + gain * error), rtol=1e-7)
    by_hand = -0.5 * (2.0 * np.log(2.0 * np.pi * s) + (0.04 + error**2) / s)
    assert found.log_likelihood == pytest.approx(by_hand, rel=1e-9)


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("complete", [True, False])
def test_it_is_the_textbook_s_filter_with_missing_data(
    mixed: bool, complete: bool, space_of: SpaceOf, simulated: Simulate, gaps: Gaps
) -> None:
    space = space_of(mixed)
    inputs = gaps(simulated(space, 200, 0).inputs)
    if not complete:
        known = inputs.complete.copy()
        known[100:110] = known[150] = False
        inputs = replace(inputs, complete=known)
    kalman = KalmanFilter(space, DISTURBANCE, tolerance=0.0)
    found = kalman.filter(inputs, 0, 200, START)
    wanted = textbook(kalman, inputs, inputs.heat[inputs.complete].std(axis=0))
    scale = np.sqrt(wanted.predicted_covariance[0].diagonal())
    np.testing.assert_allclose(found.states[:-1] / scale, wanted.predicted / scale, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.disturbance, wanted.filtered[:, -3:], rtol=0, atol=1e-8)
    deviation = np.sqrt(np.diagonal(wanted.filtered_covariance, axis1=1, axis2=2)[:, -3:])
    np.testing.assert_allclose(found.disturbance_deviation, deviation, rtol=1e-9)
    c = kalman.whole.observation
    spread = c @ wanted.predicted_covariance @ c.T
    expected = np.sqrt(np.diagonal(spread, axis1=1, axis2=2) + kalman.whole.noise_variance)
    np.testing.assert_allclose(found.innovation_deviation, expected, rtol=1e-9)
    left = np.diagonal(c @ wanted.filtered_covariance @ c.T, axis1=1, axis2=2)
    np.testing.assert_allclose(found.zone_deviation, np.sqrt(left), rtol=1e-7)
    assert found.log_likelihood == pytest.approx(wanted.log_likelihood, rel=1e-11)
    unseen = np.isnan(inputs.zone[1:]) | ~inputs.complete[1:, None]
    np.testing.assert_array_equal(np.isnan(found.innovations), unseen)
    assert found.count == (~unseen).sum()


@pytest.mark.parametrize("covariance", ["exact", "steady"])
def test_a_run_of_one_gain_is_its_steps_one_by_one(
    covariance: Covariance, space_of: SpaceOf, simulated: Simulate, gaps: Gaps, monkeypatch: pytest.MonkeyPatch
) -> None:
    space = space_of()
    inputs = gaps(simulated(space, 200, 0).inputs)

    def found() -> tuple[FloatArray, FloatArray, float, FloatArray, FloatArray]:
        filtered = KalmanFilter(space, DISTURBANCE, covariance=covariance).filter(inputs, 0, 200, START)
        assert any(pays_off(at, filtered.kalman.whole) for at, _ in runs(filtered.gains, filtered.gain_of)) == by_run
        return (filtered.states, filtered.disturbance, filtered.log_likelihood, *costates(filtered))

    by_run = True
    together = found()
    monkeypatch.setattr("calibration.estimation.gains._SAVED", 0.0)
    by_run = False
    for one, other in zip(together, found(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-10 * np.max(np.abs(other)))


def test_likelihood_is_the_normal_density_of_all_measurements(space_of: SpaceOf, simulated: Simulate) -> None:
    """The stacked measurements of 12 steps, jointly normal with means and covariances from the matrices' powers."""
    space = space_of()
    zone = simulated(space, 12, 3).inputs.zone
    zone[4, 1] = zone[7:9, 0] = np.nan
    inputs = replace(simulated(space, 12, 3).inputs, zone=zone)
    kalman = KalmanFilter(space, DISTURBANCE)
    whole, r = kalman.whole, space.order
    a, c = whole.dense(), whole.observation
    p, q = kalman.steady(np.ones(3, dtype=bool))[0], np.zeros((whole.n, whole.n))
    q[r:, r:] = np.diag(whole.heat_variance)
    powers = [np.linalg.matrix_power(a, k) for k in range(12)]

    def covariance(i: int, j: int) -> FloatArray:
        shared = powers[i] @ p @ powers[j].T
        for k in range(min(i, j)):
            shared = shared + powers[i - 1 - k] @ q @ powers[j - 1 - k].T
        return np.asarray(c @ shared @ c.T + (i == j) * np.diag(whole.noise_variance))

    spread = np.block([[covariance(i, j) for j in range(12)] for i in range(12)])
    x, means = np.zeros(r), []
    for k in range(1, 13):
        u = space.drives(inputs.boundary[k], inputs.heat[k])
        means.append(space.observation @ x + space.feedthrough @ u)
        x = space.advance(x) + space.drive @ u
    error = (zone[1:] - REFERENCE - np.array(means)).ravel()
    there = np.isfinite(error)
    wanted = multivariate_normal(cov=spread[np.ix_(there, there)]).logpdf(error[there])
    assert kalman.filter(inputs, 0, 12, START).log_likelihood == pytest.approx(wanted, abs=1e-8)


def test_against_statsmodels(space_of: SpaceOf, simulated: Simulate, gaps: Gaps) -> None:
    space = space_of()
    inputs = gaps(simulated(space, 200, 1).inputs)
    kalman = KalmanFilter(space, DISTURBANCE, tolerance=0.0)
    whole = kalman.whole
    scale = np.sqrt(np.diag(kalman.steady(np.ones(3, dtype=bool))[0]))  # statsmodels wants states of like size
    drives = space.drives(inputs.boundary[1:], inputs.heat[1:])
    reference = Reference(k_endog=3, k_states=whole.n, k_posdef=3, tolerance=0)
    reference.bind((inputs.zone[1:] - REFERENCE).copy())
    reference["design"] = whole.observation * scale
    reference["obs_intercept"] = (drives @ space.feedthrough.T).T
    reference["obs_cov"] = np.diag(whole.noise_variance)
    reference["transition"] = whole.dense() * scale / scale[:, None]
    reference["state_intercept"] = np.vstack([(drives @ space.drive.T).T, np.zeros((3, 200))]) / scale[:, None]
    reference["selection"] = np.eye(whole.n)[:, -3:] / scale[-3:]
    reference["state_cov"] = np.diag(whole.heat_variance)
    steady = kalman.steady(np.ones(3, dtype=bool))[0]
    reference.initialize_known(np.zeros(whole.n), steady / np.outer(scale, scale))
    result = reference.filter()
    found = kalman.filter(inputs, 0, 200, START)
    assert found.log_likelihood == pytest.approx(result.llf, rel=1e-9)
    np.testing.assert_allclose(found.disturbance, scale[-3:] * result.filtered_state[-3:].T, rtol=0, atol=1e-6)


def test_what_is_unknown_at_the_start_adds_to_the_covariance(
    space_of: SpaceOf, simulated: Simulate, gaps: Gaps
) -> None:
    """The textbook's filter from the steady covariance and two columns beside it."""
    space = space_of()
    inputs = gaps(simulated(space, 200, 0).inputs)
    spread = np.zeros((9, 2))
    spread[[4, 7], [0, 1]] = 300.0, 500.0
    kalman = KalmanFilter(space, DISTURBANCE, tolerance=0.0)
    found = kalman.filter(inputs, 0, 200, START, spread)
    steady = kalman.steady(np.ones(3, dtype=bool))
    more = steady[0].copy()
    more[:9, :9] += spread @ spread.T
    kalman._steady[np.ones(3, dtype=bool).tobytes()] = (more, steady[1])
    wanted = textbook(kalman, inputs, np.zeros(3))
    np.testing.assert_allclose(found.disturbance, wanted.filtered[:, -3:], rtol=0, atol=1e-6)
    assert found.log_likelihood == pytest.approx(wanted.log_likelihood, rel=1e-9)


# Prediction


@pytest.mark.parametrize("mixed", [False, True])
def test_prediction_is_the_model_with_a_fading_disturbance(mixed: bool, space_of: SpaceOf, simulated: Simulate) -> None:
    space = space_of(mixed)
    made = simulated(space, 150, 7)
    kalman = KalmanFilter(space, DISTURBANCE)
    found = kalman.filter(made.inputs, 0, 100, START)
    starts, steps, r = np.array([60, 100]), 30, space.order
    rows = starts + np.arange(1, steps + 1)[:, None]
    boundary, heat, airflow = (
        v[rows].transpose(0, 2, 1) for v in (made.inputs.boundary, made.inputs.heat, made.inputs.airflow)
    )
    keep = np.array([1, 2, 30])
    predicted = kalman.predict(found.states[starts].T, boundary, heat, keep, airflow)
    assert predicted.shape == (2, 3, 3)
    fade = np.exp(-STEP / 3600.0)
    for i, start in enumerate(starts):
        x, d = found.states[start][:r], found.states[start][r:]
        for k in range(steps):
            given = heat[k, :, i] + d * fade**k
            if mixed:
                given = given + space.directed_heat(airflow[k, :, i][:, None], x[:, None])[:, 0]
            u = space.drives(boundary[k, :, i], given)
            if k + 1 in keep:
                mean = space.observation @ x + space.feedthrough @ u + REFERENCE
                np.testing.assert_allclose(predicted[i, list(keep).index(k + 1)], mean, rtol=0, atol=1e-9)
            x = space.advance(x) + space.drive @ u
    first = kalman.predict(found.states[[60]].T, boundary[..., :1], heat[..., :1], np.array([1]), airflow[..., :1])
    np.testing.assert_allclose(first[0, 0], found.predicted[60], rtol=0, atol=1e-9)


def test_constant_unmeasured_heat_leaves_no_offset(space_of: SpaceOf, simulated: Simulate) -> None:
    """150 W in every zone that nobody measures: the model alone drifts off, the predictor with it does not."""
    space = space_of()
    made = simulated(space, 4000, 8, constant=150.0)
    horizon, start = 72, 3900
    rows = start + np.arange(1, horizon + 1)
    truth = made.inputs.zone[rows[-1]]
    boundary, heat = made.inputs.boundary[rows][:, :, None], made.inputs.heat[rows][:, :, None]
    errors = {}
    for name, disturbance in {
        "alone": DisturbanceModel(0.0, 3600.0, 0.05),
        "fading": DisturbanceModel(100.0, 20 * 86400.0, 0.05),
        "walk": DisturbanceModel(500.0, np.inf, 0.05),
    }.items():
        kalman = KalmanFilter(space, disturbance)
        state = kalman.filter(made.inputs, 0, start, START).states[[start]].T
        if name == "alone":  # with the right state, but without the heat
            state = np.concatenate([made.states[start], np.zeros(3)])[:, None]
        errors[name] = np.abs(kalman.predict(state, boundary, heat, np.array([horizon]))[0, 0] - truth).max()
    assert errors["alone"] > 0.3
    assert errors["walk"] < 1e-6
    assert errors["fading"] < 0.03 * errors["alone"]


def test_deviation_of_a_prediction_is_that_of_the_covariance_run_forward(space_of: SpaceOf) -> None:
    space = space_of()
    kalman = KalmanFilter(space, DISTURBANCE)
    p = kalman.steady(np.ones(3, dtype=bool))[0]
    c, wanted = kalman.whole.observation, []
    for _ in range(50):
        wanted.append(np.sqrt(np.diag(c @ p @ c.T)))
        p = kalman.whole.propagate(p)
    np.testing.assert_allclose(kalman.prediction_deviation(50), wanted, rtol=1e-10)


def test_errors_of_predictions_are_as_large_as_their_deviation_says(space_of: SpaceOf, simulated: Simulate) -> None:
    space = space_of()
    made = simulated(space, 6000, 9)
    kalman = KalmanFilter(space, DISTURBANCE)
    found = kalman.filter(made.inputs, 0, 6000, START)
    starts = np.arange(300, 5960, 40)
    rows = starts + np.arange(1, 37)[:, None]
    boundary, heat = (v[rows].transpose(0, 2, 1) for v in (made.inputs.boundary, made.inputs.heat))
    predicted = kalman.predict(found.states[starts].T, boundary, heat, np.array([36]))[:, 0]
    noise = np.asarray(DISTURBANCE.sensor_deviation) ** 2
    error = predicted - made.inputs.zone[starts + 36]
    expected = np.sqrt(kalman.prediction_deviation(36)[-1] ** 2 + noise)
    np.testing.assert_allclose(error.std(axis=0) / expected, 1.0, atol=0.2)


# Refusals


def test_bad_wishes_are_refused(space_of: SpaceOf, simulated: Simulate) -> None:
    space = space_of()
    inputs = simulated(space, 20, 0).inputs
    kalman = KalmanFilter(space, DISTURBANCE)
    with pytest.raises(FilterError, match="covariance: expected one of exact, steady, found 'fast'"):
        KalmanFilter(space, DISTURBANCE, covariance="fast")  # type: ignore[arg-type]
    with pytest.raises(FilterError, match="0 <= begin < stop < 21, got 20 and 21"):
        kalman.filter(inputs, 20, 21, START)
    with pytest.raises(FilterError, match="finite states"):
        kalman.filter(inputs, 0, 20, np.full((9, 1), np.nan))
    with pytest.raises(FilterError, match="zone temperatures in rows 1 to 20, found none"):
        kalman.filter(replace(inputs, zone=np.full(inputs.zone.shape, np.nan)), 0, 20, START)


def test_exact_hold_runs_too(simulated: Simulate, pencil: Pencil) -> None:
    space = state_space(pencil().modal.modes, STEP, EXACT)
    found = KalmanFilter(space, DISTURBANCE).filter(simulated(space, 400, 1).inputs, 0, 400, START)
    assert np.nanstd(found.standardised) == pytest.approx(1.0, abs=0.08)
