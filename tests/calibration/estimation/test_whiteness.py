"""Residual tests: against statsmodels, their size under white noise and under a filter's innovations, their power."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from statsmodels.stats.diagnostic import acorr_ljungbox

from calibration import DisturbanceModel, KalmanFilter, StateSpace
from calibration.errors import FilterError
from calibration.estimation.kalman import Filtered
from calibration.estimation.state_space import state_space
from calibration.estimation.whiteness import Whiteness, whiteness
from thermal import Inputs
from thermal.model.matrices import Matrices

FloatArray = NDArray[np.float64]

STEP = 300.0
REFERENCE = 293.15
DISTURBANCE = DisturbanceModel(np.array([150.0, 80.0]), 3600.0, 0.05)


def building() -> StateSpace:
    """Air and wall of two rooms."""
    link = np.array(
        [[90.0, -10.0, -60.0, 0.0], [-10.0, 90.0, 0.0, -60.0], [-60.0, 0.0, 80.0, 0.0], [0.0, -60.0, 0.0, 80.0]]
    )
    leak = link.sum(axis=1)
    observation = np.eye(4)[:2]
    matrices = Matrices(
        capacity=np.diag([2e5, 3e5, 8e6, 6e6]), flow=np.hstack([link, -leak[:, None]]), heating=observation.T.copy(),
        observation=observation, uniform=np.ones(4), capacity_sensitivities=[], flow_sensitivities=[],
    )  # fmt: skip
    return state_space(matrices.modal.modes, STEP)


def simulate(count: int, seed: int) -> Inputs:
    space, rng = building(), np.random.default_rng(seed)
    keep, drive = DISTURBANCE.discrete(STEP)
    heat = np.repeat(rng.choice([0.0, 800.0], (count // 12 + 1, 2)), 12, axis=0)[: count + 1]
    heat = np.vstack([heat, heat[: count + 1 - len(heat)]])
    boundary = 283.15 + 0.2 * np.cumsum(rng.standard_normal((count + 1, 1)), axis=0)
    d, x = np.asarray(DISTURBANCE.deviation) * rng.standard_normal(2), np.zeros(4)
    zone = np.full((count + 1, 2), REFERENCE)
    for k in range(1, count + 1):
        u = space.drives(boundary[k], heat[k] + d)
        zone[k] = space.observation @ x + space.feedthrough @ u + REFERENCE
        x, d = space.advance(x) + space.drive @ u, keep * d + drive * rng.standard_normal(2)
    zone += 0.05 * rng.standard_normal(zone.shape)
    stamps = pd.date_range("2024-01-01", periods=count + 1, freq="300s", tz="UTC")
    return Inputs(
        stamps=stamps, step=STEP, heat=heat, boundary=boundary, airflow=np.zeros((count + 1, 0)), zone=zone,
        bridged=zone, held=zone, complete=np.ones(count + 1, dtype=bool),
    )  # fmt: skip


def filtered(inputs: Inputs, disturbance: DisturbanceModel = DISTURBANCE) -> Filtered:
    kalman = KalmanFilter(building(), disturbance)
    return kalman.filter(inputs, 0, len(inputs) - 1, np.full((4, 1), REFERENCE))


def series(values: FloatArray) -> Filtered:
    """A filter's result with these standardised innovations, to test the tests alone."""
    found = filtered(simulate(len(values), 0))
    return replace(found, innovations=values, innovation_deviation=np.ones(values.shape))


def results(values: FloatArray, lags: tuple[float, ...] = (1800.0, 7200.0), fitted: int = 0) -> Whiteness:
    return whiteness(series(values), ("a", "b"), lags=lags, fitted=fitted)


def test_ljung_box_is_that_of_statsmodels() -> None:
    values = np.random.default_rng(0).standard_normal((500, 2))
    for fitted in (0, 2):
        found = results(values, fitted=fitted)
        assert found.lags == (6, 24)
        assert found.degrees == (6 - fitted, 24 - fitted)
        for name, column in zip("ab", values.T, strict=True):
            wanted = acorr_ljungbox(column, [6, 24], model_df=fitted)
            np.testing.assert_allclose(found.zones[name].ljung_box, wanted["lb_stat"], rtol=1e-10)
            np.testing.assert_allclose(found.zones[name].ljung_box_p, wanted["lb_pvalue"], rtol=1e-8)


def test_cumulated_periodogram_by_hand() -> None:
    """Of x = (1, 0, 0, 0, -1, 0, 0): power 2 - 2 cos(2π 4 j / 7) at j = 1, 2, 3."""
    values = np.zeros((35, 2))
    values[::7], values[4::7] = 1.0, -1.0
    found = results(values, lags=(300.0,))
    power = np.array([2.0 - 2.0 * np.cos(2.0 * np.pi * 4.0 * j / 7.0) for j in (1, 2, 3)])
    at = np.zeros(17)  # the frequencies j / 7 are every fifth of the 17
    at[[4, 9, 14]] = power
    share = np.cumsum(at)[:-1] / at.sum()
    steps = np.arange(1, 17)
    wanted = max((steps / 16 - share).max(), (share - (steps - 1) / 16).max())
    assert found.zones["a"].periodogram_distance == pytest.approx(wanted)


@pytest.mark.parametrize("missing", [False, True])
def test_sizes_under_white_noise(missing: bool) -> None:
    """500 series: 5 % of them rejected, within the 99.9 % binomial band."""
    rng, found = np.random.default_rng(1), []
    base = filtered(simulate(800, 0))
    for _ in range(250):
        values = rng.standard_normal((800, 2))
        if missing:
            values[rng.random(values.shape) < 0.1] = np.nan
            values[100:150, 1] = np.nan
        tests = whiteness(replace(base, innovations=values, innovation_deviation=np.ones(values.shape)), ("a", "b"),
                          lags=(1800.0, 7200.0))  # fmt: skip
        found += [[*z.ljung_box_p, z.periodogram_p] for z in tests.zones.values()]
    assert np.abs(np.mean(np.array(found) < 0.05, axis=0) - 0.05).max() < 0.033


def test_sizes_under_the_innovations_of_the_true_filter() -> None:
    """200 simulated records: innovations are white, and owe nothing to past inputs."""
    found, lag_one = [], []
    for seed in range(100):
        inputs = simulate(400, seed)
        tests = whiteness(filtered(inputs), ("a", "b"), inputs, boundaries=("outdoor",), lags=(1800.0, 7200.0))
        for z in tests.zones.values():
            found.append([*z.ljung_box_p, z.periodogram_p, *z.inputs_p.values()])
            lag_one.append(z.lag_one)
    assert np.abs(np.mean(np.array(found) < 0.05, axis=0) - 0.05).max() < 0.055
    assert abs(np.mean(lag_one)) < 0.012
    assert np.std(lag_one) == pytest.approx(1.0 / np.sqrt(400), rel=0.2)


def test_wrong_disturbance_is_rejected() -> None:
    inputs = simulate(1000, 0)
    slow = whiteness(filtered(inputs, DisturbanceModel(10.0, 3600.0, 0.05)), ("a", "b"))
    assert slow.rejected() == ("a", "b")
    assert slow.zones["a"].lag_one > 0.2
    assert whiteness(filtered(inputs), ("a", "b")).rejected(0.01) == ()


def test_wrong_heat_shows_in_the_correlation_with_it() -> None:
    """A meter that reads half: the innovations follow the heat, whose prewhitened steps they still carry an hour on."""
    inputs = simulate(1500, 1)
    right = whiteness(filtered(inputs), ("a", "b"), inputs, boundaries=("outdoor",))
    half = replace(inputs, heat=0.5 * inputs.heat)
    wrong = whiteness(filtered(half), ("a", "b"), half, boundaries=("outdoor",))
    assert right.zones["a"].inputs_p["heat"] > 1e-3
    assert wrong.zones["a"].inputs_p["heat"] < 1e-6


def test_constant_and_unmeasured_zones_are_not_tested() -> None:
    values = np.random.default_rng(3).standard_normal((200, 2))
    for bad in (np.nan, 0.25):
        values[:, 1] = bad
        found = results(values)
        assert np.isfinite(found.zones["a"].ljung_box_p).all()
        assert np.isnan(found.zones["b"].ljung_box_p).all()
        assert np.isnan(found.zones["b"].periodogram_p)
        content = json.loads(json.dumps(found.to_dict(), allow_nan=False))
        assert content["zones"]["b"]["lag_one"] is None
        assert "b" not in content["rejected"]


def test_constant_inputs_and_long_lags_are_left_out() -> None:
    inputs = simulate(200, 4)
    heat = inputs.heat.copy()
    heat[:, 0] = 100.0
    inputs = replace(inputs, heat=heat)
    found = whiteness(filtered(inputs), ("a", "b"), inputs, boundaries=("outdoor",))
    assert found.lags == (6, 24, 288)
    assert np.isnan(found.zones["a"].ljung_box[2])
    assert np.isnan(found.zones["a"].inputs_p["heat"])
    assert 0.0 <= found.zones["a"].inputs_p["outdoor"] <= 1.0


def test_bad_wishes_are_refused() -> None:
    found, inputs = filtered(simulate(100, 0)), simulate(100, 0)
    with pytest.raises(FilterError, match="zones: expected 2 names, got 1"):
        whiteness(found, ("a",))
    with pytest.raises(FilterError, match="expected positive lags"):
        whiteness(found, ("a", "b"), lags=(0.0,))
    with pytest.raises(FilterError, match="names of 1 boundaries"):
        whiteness(found, ("a", "b"), inputs)
    with pytest.raises(FilterError, match="expected those that were filtered"):
        whiteness(found, ("a", "b"), simulate(90, 0), boundaries=("outdoor",))
