"""Unmeasured heat: its discretisation by hand, and the steady covariance against SciPy and python-control."""

from __future__ import annotations

import json
from functools import cache

import control
import numpy as np
import pytest
import scipy.linalg as sl
from numpy.typing import NDArray

from calibration import DisturbanceModel
from calibration.errors import FilterError
from calibration.estimation.disturbance import DisturbedSpace, doubled_riccati, summed_stein
from calibration.estimation.state_space import state_space
from thermal import SymbolicModel, build_network, load_bundled_case, reduced_model
from thermal.model.matrices import Matrices
from thermal.model.step import EXACT

FloatArray = NDArray[np.float64]

ALL = np.ones(5, dtype=bool)


@cache
def matrices() -> Matrices:
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    theta = grid.network.start()
    return reduced_model(grid, [theta]).matrices(theta)


def disturbed(disturbance: DisturbanceModel, mixed: bool = False) -> DisturbedSpace:
    airflows, flow = (((0, 1), (1, 2)), np.array([0.05, 0.02])) if mixed else ((), None)
    return DisturbedSpace(state_space(matrices().modal.modes, 300.0, airflows=airflows, flow=flow), disturbance)


# The process


def test_sampling_is_exact_at_any_step() -> None:
    """φ = exp(-Δt/τ) and Var w = σ² (1 - φ²): at Δt = τ ln 2 half remains, and three quarters of the variance enter."""
    keep, drive = DisturbanceModel(40.0, 1000.0, 0.1).discrete(1000.0 * np.log(2.0))
    assert keep == pytest.approx(0.5)
    assert drive[0] == pytest.approx(40.0 * np.sqrt(0.75))
    half_keep, half_drive = DisturbanceModel(40.0, 1000.0, 0.1).discrete(500.0 * np.log(2.0))
    assert half_keep**2 == pytest.approx(keep)
    assert half_drive[0] ** 2 * (1.0 + half_keep**2) == pytest.approx(drive[0] ** 2)


def test_stationary_deviation_is_kept() -> None:
    keep, drive = DisturbanceModel(np.array([10.0, 0.0]), 3600.0, 0.1).discrete(1.0)
    np.testing.assert_allclose(drive**2 / -np.expm1(2.0 * np.log(keep)), [100.0, 0.0], rtol=1e-10)


def test_random_walk_grows_by_its_deviation_in_a_day() -> None:
    walk = DisturbanceModel(50.0, np.inf, 0.1)
    keep, drive = walk.discrete(300.0)
    assert walk.random_walk
    assert keep == 1.0
    assert 288 * drive[0] ** 2 == pytest.approx(50.0**2)
    slow = DisturbanceModel(50.0 * np.sqrt(1e9 / (2 * 86400.0)), 1e9, 0.1).discrete(300.0)  # the same growth
    assert slow[1][0] == pytest.approx(drive[0], rel=1e-6)


def test_values_of_a_file() -> None:
    found = DisturbanceModel(np.array([10.0, 20.0]), 3600.0, 0.1).to_dict()
    assert json.loads(json.dumps(found)) == {
        "deviation": [10.0, 20.0], "time_constant": 3600.0, "sensor_deviation": 0.1
    }  # fmt: skip


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((-1.0, 3600.0, 0.1), "deviation: expected watts of 0 or more"),
        ((np.nan, 3600.0, 0.1), "deviation: expected watts"),
        ((1.0, 0.0, 0.1), "time_constant: expected positive seconds, found 0.0"),
        ((1.0, np.nan, 0.1), "time_constant"),
        ((1.0, 3600.0, 0.0), "sensor_deviation: expected positive kelvins"),
    ],
)
def test_values_out_of_range_are_refused(values: tuple[float, float, float], message: str) -> None:
    with pytest.raises(FilterError, match=message):
        DisturbanceModel(*values)


def test_zones_must_fit() -> None:
    with pytest.raises(FilterError, match="one deviation or one for each of 5 zones, found 3"):
        disturbed(DisturbanceModel(np.ones(3), 3600.0, 0.1))


# Beside a building


@pytest.mark.parametrize("mixed", [False, True])
def test_structured_products_are_those_of_the_dense_matrix(mixed: bool) -> None:
    whole = disturbed(DisturbanceModel(np.arange(5.0), 3600.0, 0.1), mixed)
    rng, dense = np.random.default_rng(0), whole.dense()
    x = rng.standard_normal((whole.n, 4))
    np.testing.assert_allclose(whole.advance(x), dense @ x, rtol=0, atol=1e-12)
    np.testing.assert_allclose(whole.retreat(x), dense.T @ x, rtol=0, atol=1e-12)
    np.testing.assert_allclose(whole.advance(x[:, 0]), dense @ x[:, 0], rtol=0, atol=1e-12)
    p = x @ x.T
    spread = np.zeros((whole.n, whole.n))
    spread[-5:, -5:] = np.diag(whole.heat_variance)
    np.testing.assert_allclose(whole.propagate(p), dense @ p @ dense.T + spread, rtol=0, atol=1e-10 * np.abs(p).max())


def test_a_disturbance_is_heat() -> None:
    """A step with 100 W of disturbance ends where one with 100 W more heat does."""
    whole = disturbed(DisturbanceModel(1.0, 3600.0, 0.1))
    space = whole.space
    d = np.array([100.0, 0.0, 0.0, 0.0, 0.0])
    z = np.concatenate([np.zeros(space.order), d])
    u = np.concatenate([np.zeros(space.n_boundary), d])
    np.testing.assert_allclose(whole.advance(z)[: space.order], space.drive @ u, rtol=1e-12)
    np.testing.assert_allclose(whole.observation @ z, space.feedthrough @ u, rtol=1e-12)


@pytest.mark.parametrize(
    "disturbance",
    [
        DisturbanceModel(100.0, 3600.0, 0.05),
        DisturbanceModel(np.array([10.0, 500.0, 30.0, 0.0, 80.0]), 86400.0, 0.02),
        DisturbanceModel(200.0, np.inf, 0.1),
    ],
    ids=["common", "zones", "walk"],
)
@pytest.mark.parametrize("mixed", [False, True])
def test_steady_covariance_against_scipy_and_python_control(disturbance: DisturbanceModel, mixed: bool) -> None:
    whole = disturbed(disturbance, mixed)
    p, dual = whole.steady(ALL)
    a, c, r = whole.dense(), whole.observation, np.diag(whole.noise_variance)
    q = np.zeros((whole.n, whole.n))
    q[-5:, -5:] = np.diag(whole.heat_variance)
    scale = np.sqrt(np.diag(p)) + 1e-9
    step = whole.propagate(p - p @ c.T @ np.linalg.solve(c @ p @ c.T + r, c @ p))
    assert np.abs((step - p) / np.outer(scale, scale)).max() < 1e-10
    zones = np.vstack([c, np.eye(whole.n)[-5:]])  # zone temperatures and disturbances; SciPy's own error is near 1e-7
    found, other = (zones @ x @ zones.T for x in (p, sl.solve_discrete_are(a.T, c.T, q, r)))
    size = np.sqrt(np.diag(found)) + 1e-6
    assert np.abs((found - other) / np.outer(size, size)).max() < 1e-5
    select = np.vstack([np.zeros((whole.space.order, 5)), np.eye(5)])
    wanted = control.dlqe(a, select, c, np.diag(whole.heat_variance), r)[0]
    gain = a @ p @ c.T @ np.linalg.inv(c @ p @ c.T + r)
    np.testing.assert_allclose(gain[-5:], wanted[-5:], rtol=1e-5, atol=1e-5 * np.abs(wanted[-5:]).max())
    information = c.T @ np.linalg.solve(r, c)
    back = a.T @ dual @ np.linalg.solve(np.eye(whole.n) + q @ dual, a) + information
    assert np.abs(back - dual).max() < 1e-8 * np.abs(dual).max()


def test_information_of_the_future_gives_the_smoother_s_precision() -> None:
    """(I + Y P)^-1 Y = Σ L'^j C' S^-1 C L^j with the closed loop L."""
    whole = disturbed(DisturbanceModel(100.0, 3600.0, 0.05))
    p, dual = whole.steady(ALL)
    c = whole.observation
    s = c @ p @ c.T + np.diag(whole.noise_variance)
    loop = whole.advance(np.eye(whole.n) - p @ c.T @ np.linalg.solve(s, c))
    wanted = sl.solve_discrete_lyapunov(loop.T, c.T @ np.linalg.solve(s, c))
    found = np.linalg.solve(np.eye(whole.n) + dual @ p, dual)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-8 * np.abs(wanted).max())


def test_exact_hold_has_a_steady_covariance_too() -> None:
    space = state_space(matrices().modal.modes, 3600.0, EXACT)
    p, _ = DisturbedSpace(space, DisturbanceModel(100.0, 3600.0, 0.05)).steady(ALL)
    assert np.isfinite(p).all()


def test_zone_without_a_sensor_keeps_its_stationary_variance() -> None:
    """Neighbours tell next to nothing of it."""
    whole = disturbed(DisturbanceModel(100.0, 3600.0, 0.05))
    measured = ALL.copy()
    measured[2] = False
    heat = np.sqrt(np.diag(whole.steady(measured)[0])[-5:])
    assert 90.0 < heat[2] <= 100.0 + 1e-6
    assert (heat[[0, 1, 3, 4]] < 65.0).all()


def test_random_walk_without_a_sensor_is_refused() -> None:
    measured = ALL.copy()
    measured[2] = False
    with pytest.raises(FilterError, match=r"none in zones \[2\]; give these a deviation of 0"):
        disturbed(DisturbanceModel(100.0, np.inf, 0.05)).steady(measured)
    deviation = np.array([100.0, 100.0, 0.0, 100.0, 100.0])
    assert np.isfinite(disturbed(DisturbanceModel(deviation, np.inf, 0.05)).steady(measured)[0]).all()


def test_near_compares_every_number() -> None:
    one = DisturbanceModel(np.array([100.0, 50.0]), 3600.0, 0.05)
    assert one.near(DisturbanceModel(np.array([103.0, 49.0]), 3700.0, 0.051), 0.05)
    for other in (
        DisturbanceModel(np.array([100.0, 60.0]), 3600.0, 0.05),
        DisturbanceModel(np.array([100.0, 50.0]), 4600.0, 0.05),
        DisturbanceModel(np.array([100.0, 50.0]), 3600.0, 0.06),
    ):
        assert not one.near(other, 0.05)


# Doubling against the quadratic formula, SciPy and python-control


def stable(seed: int, n: int, radius: float = 0.98) -> FloatArray:
    a = np.random.default_rng(seed).standard_normal((n, n))
    return np.asarray(radius * a / np.abs(np.linalg.eigvals(a)).max())


@pytest.mark.parametrize(("a", "q", "r"), [(0.9, 1.0, 2.0), (1.0, 0.01, 5.0), (1.2, 3.0, 0.1)])
def test_scalar_equation_by_the_quadratic_formula(a: float, q: float, r: float) -> None:
    """p = a² p r / (p + r) + q, so p² + (r - a² r - q) p - q r = 0."""
    found, dual = doubled_riccati(np.array([[a]]), np.array([[1.0 / r]]), np.array([[q]]))
    b = r - a**2 * r - q
    assert found[0, 0] == pytest.approx(0.5 * (-b + np.sqrt(b**2 + 4.0 * q * r)), rel=1e-10)
    # y = a² y / (1 + q y) + 1/r
    y = dual[0, 0]
    assert y == pytest.approx(a**2 * y / (1.0 + q * y) + 1.0 / r, rel=1e-10)


@pytest.mark.parametrize("n", [3, 20])
def test_against_scipy_and_python_control(n: int) -> None:
    rng = np.random.default_rng(n)
    a, c, g = stable(n, n), rng.standard_normal((2, n)), rng.standard_normal((n, 2))
    q, r = g @ g.T, np.diag([0.1, 0.3])
    found, _ = doubled_riccati(a, c.T @ np.linalg.solve(r, c), q)
    np.testing.assert_allclose(found, sl.solve_discrete_are(a.T, c.T, q, r), rtol=1e-7, atol=1e-9)
    gain, p, _ = control.dlqe(a, g, c, np.eye(2), r)
    np.testing.assert_allclose(found, p, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(a @ found @ c.T @ np.linalg.inv(c @ found @ c.T + r), gain, rtol=1e-6, atol=1e-8)


def test_sum_of_congruences_against_scipy() -> None:
    a, x = stable(1, 12), np.random.default_rng(2).standard_normal((12, 12))
    wanted = sl.solve_discrete_lyapunov(a.T, x + x.T)
    np.testing.assert_allclose(summed_stein(a, x + x.T), wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


def test_no_steady_state_is_said() -> None:
    with pytest.raises(FilterError, match="did not converge"):
        doubled_riccati(np.array([[1.1]]), np.array([[0.0]]), np.array([[1.0]]))
