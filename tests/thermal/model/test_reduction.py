"""The reduced model: replay error against the grid, shifts, structure."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import ModelError, SymbolicModel, build_network, load_bundled_case, reduced_model
from thermal.model.certificate import closed_loop
from thermal.model.reduce import krylov_basis
from thermal.model.step import IMPLICIT_EULER, TR_BDF2, Scheme, Stepper

FloatArray = NDArray[np.float64]

MONTH, DAY, HOUR, MINUTES = 1.0 / 2.6e6, 1.0 / 86400.0, 1.0 / 3600.0, 1.0 / 300.0


@cache
def grid() -> SymbolicModel:
    return SymbolicModel(build_network(load_bundled_case().building, dx=1.0))


def replayed(model: SymbolicModel, theta: FloatArray, scheme: Scheme = IMPLICIT_EULER) -> FloatArray:
    """Two days at 300 s under weather, steps of heat and pulses, from one temperature."""
    matrices = model.matrices(theta)
    stepper = Stepper(matrices, 300.0, scheme)
    states = matrices.uniform[:, None] * 0.0
    rng = np.random.default_rng(5)
    heat = np.repeat(2000.0 * rng.random((48, 5)), 12, axis=0)
    outdoor = -10.0 + 6.0 * np.sin(2 * np.pi * np.arange(576) / 288.0)
    means = []
    for q, u in zip(heat, outdoor, strict=True):
        states, mean, _, _ = stepper.advance(states, np.array([[u]]), q[:, None])
        means.append(mean[:, 0])
    return np.array(means)


def draw(seed: int = 1, spread: float = 0.3) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.array(
        [
            p.inverse(p.transform(p.start) + spread * p.prior_deviation * rng.standard_normal())
            for p in grid().network.parameters
        ]
    )


@pytest.mark.parametrize("scheme", [IMPLICIT_EULER, TR_BDF2], ids=["implicit_euler", "tr_bdf2"])
def test_replay_on_the_reduced_model_is_that_on_the_grid(scheme: Scheme) -> None:
    """Within 5 mK of 20 K and more that the zones move, at the θ of the basis."""
    theta = draw()
    small = reduced_model(grid(), [theta])
    assert small.projection is not None
    assert small.projection.shape[1] < grid().network.n_node / 5
    wanted = replayed(grid(), theta, scheme)
    assert np.ptp(wanted) > 10.0
    assert np.abs(replayed(small, theta, scheme) - wanted).max() < 5e-3


def test_error_falls_with_every_shift() -> None:
    theta = draw()
    wanted = replayed(grid(), theta)
    errors = []
    for shifts in ((DAY,), (DAY, HOUR), (DAY, HOUR, MINUTES), (MONTH, DAY, 1 / 28800.0, HOUR, 1 / 900.0, MINUTES)):
        errors.append(np.abs(replayed(reduced_model(grid(), [theta], shifts=shifts), theta) - wanted).max())
    assert (np.diff(errors) < 0).all(), errors
    assert errors[0] > 20 * errors[-1]


def test_order_falls_and_error_rises_with_the_tolerance() -> None:
    theta = draw()
    wanted = replayed(grid(), theta)
    orders, errors = [], []
    for tolerance in (0.3, 0.03, 0.003):
        small = reduced_model(grid(), [theta], tolerance=tolerance)
        assert small.certificate.max_difference <= tolerance
        assert small.certificate.order == small.order
        orders.append(small.order)
        errors.append(np.abs(replayed(small, theta) - wanted).max())
    assert orders[0] < orders[1] < orders[2]
    assert errors[0] > errors[1] > errors[2]


def test_error_falls_with_the_order() -> None:
    theta = draw()
    errors = [reduced_model(grid(), [theta], order=n).certificate.max_difference for n in (8, 16, 24, 36)]
    assert (np.diff(errors) < 0).all(), errors
    assert errors[-1] < 2e-3


def test_the_certificate_is_a_replay_on_the_grid() -> None:
    """The same thermostats' heat through the generic stepper of both models gives the certificate's numbers."""
    theta = draw()
    small = reduced_model(grid(), [theta], order=20)
    replay = closed_loop(grid().matrices(theta))
    assert np.ptp(replay.zone) > 4.0
    assert replay.heat.max() > 100.0
    matrices = small.matrices(theta)
    stepper = Stepper(matrices, replay.step)
    states = 17.0 * matrices.uniform[:, None]
    means = []
    for q, u in zip(replay.heat, replay.boundary, strict=True):
        states, mean, _, _ = stepper.advance(states, u[:, None], q[:, None])
        means.append(mean[:, 0])
    error = np.abs(np.array(means) - replay.zone)
    assert small.certificate.max_difference == pytest.approx(error.max(), rel=1e-6)
    assert small.certificate.mean_difference == pytest.approx(error.mean(), rel=1e-6)
    assert small.certificate.volumes == grid().network.n_node


def test_drift_grows_as_theta_moves_away() -> None:
    small = reduced_model(grid(), [draw()])
    drifts = [small.drift(draw(1, spread)) for spread in (0.3, 0.5, 1.0)]
    assert drifts[0] < 2e-3 < drifts[-1]
    assert drifts[0] < drifts[1] < drifts[2]
    for spread, drift in zip((0.3, 0.5, 1.0), drifts, strict=True):
        assert small.is_accurate(draw(1, spread), 1.001 * drift)
        assert not small.is_accurate(draw(1, spread), 0.999 * drift)


def test_impossible_wishes_are_refused() -> None:
    theta = draw()
    with pytest.raises(ModelError, match="order or a tolerance, found both"):
        reduced_model(grid(), [theta], order=10, tolerance=0.1)
    with pytest.raises(ModelError, match="at least 2 states, found 1"):
        reduced_model(grid(), [theta], order=1)
    with pytest.raises(ModelError, match="add shifts"):
        reduced_model(grid(), [theta], tolerance=1e-9)


def test_transfer_function_is_matched_at_the_shifts() -> None:
    """Galerkin with a symmetric model: value and slope at each expansion point."""
    theta, shifts = draw(), (DAY, HOUR)
    small = reduced_model(grid(), [theta], shifts=shifts)

    def transfer(model: SymbolicModel, s: float) -> FloatArray:
        m = model.matrices(theta)
        dense = [x.toarray() if hasattr(x, "toarray") else x for x in (m.flow, m.capacity, m.heating, m.observation)]
        flow, capacity, heating, observation = dense
        return np.asarray(observation @ np.linalg.solve(flow[:, : m.n] + s * capacity, heating))

    for s in shifts:
        wanted = transfer(grid(), s)
        np.testing.assert_allclose(transfer(small, s), wanted, rtol=1e-7, atol=1e-9 * np.abs(wanted).max())
        slopes = [(transfer(m, s * 1.001) - transfer(m, s * 0.999)) / (0.002 * s) for m in (grid(), small)]
        np.testing.assert_allclose(slopes[1], slopes[0], rtol=1e-4, atol=1e-6 * np.abs(slopes[0]).max())


def test_uniform_temperature_is_a_steady_state() -> None:
    theta = draw()
    matrices = reduced_model(grid(), [theta]).matrices(theta)
    stepper = Stepper(matrices, 300.0)
    states = 291.0 * matrices.uniform[:, None]
    for _ in range(50):
        states, mean, _, _ = stepper.advance(states, np.array([[291.0]]), np.zeros((5, 1)))
    np.testing.assert_allclose(mean, 291.0, atol=1e-7)
    np.testing.assert_allclose(states, 291.0 * matrices.uniform[:, None], atol=1e-6)


def test_basis_is_orthonormal_and_holds_the_uniform_temperature() -> None:
    basis = krylov_basis([grid().matrices(draw())])
    np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-10)
    ones = np.ones(basis.shape[0])
    np.testing.assert_allclose(basis @ (basis.T @ ones), ones, atol=1e-9)


def test_reduced_matrices_at_another_theta_are_the_grid_s_projected() -> None:
    small = reduced_model(grid(), [draw()])
    v, other = small.projection, draw(9, 1.0)
    assert v is not None
    whole, found = grid().matrices(other), small.matrices(other)
    n = whole.n
    scale = np.abs(found.flow).max()
    np.testing.assert_allclose(found.flow[:, : v.shape[1]], v.T @ (whole.flow[:, :n] @ v), atol=1e-10 * scale)
    np.testing.assert_allclose(found.capacity, v.T @ (whole.capacity @ v), atol=1e-10 * np.abs(found.capacity).max())
    symmetric = found.flow[:, : v.shape[1]]
    np.testing.assert_allclose(symmetric, symmetric.T, atol=1e-10 * scale)
    assert np.linalg.eigvalsh(0.5 * (symmetric + symmetric.T))[0] > -1e-10 * scale


def test_basis_over_two_thetas_serves_both() -> None:
    a, b = draw(1), draw(12, 1.0)
    both = reduced_model(grid(), [a, b])
    alone = reduced_model(grid(), [a])
    wanted = replayed(grid(), b)
    errors = [np.abs(replayed(m, b) - wanted).max() for m in (both, alone)]
    assert errors[0] < 5e-3
    assert errors[0] < errors[1]
