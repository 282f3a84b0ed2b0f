"""Modes of a reduced model: exact zero-order hold against the matrix exponential, schemes, difference quotients."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import scipy.linalg as sl
from numpy.typing import NDArray

from thermal import ModelError, SymbolicModel, build_network, load_bundled_case, reduced_model
from thermal.model.matrices import Matrices
from thermal.model.modal import divided_differences, modal_model, propagator_functions
from thermal.model.step import EXACT, IMPLICIT_EULER, TR_BDF2, Scheme

FloatArray = NDArray[np.float64]


def pencil(seed: int = 0, n: int = 9, isolated: bool = False) -> Matrices:
    """Random symmetric model of two zones; ``isolated`` has no path to the outside."""
    rng = np.random.default_rng(seed)
    links = np.triu(rng.random((n, n)), 1) * 5.0
    links += links.T
    leak = np.zeros(n) if isolated else rng.random(n)
    stiffness = np.diag(links.sum(axis=1) + leak) - links
    observation = np.zeros((2, n))
    observation[0, :3], observation[1, 3:6] = 1 / 3, 1 / 3
    return Matrices(
        capacity=np.diag(rng.uniform(1e3, 1e5, n)),
        flow=np.hstack([stiffness, -leak[:, None]]),
        heating=observation.T.copy(),
        observation=observation,
        uniform=np.ones(n),
        capacity_sensitivities=[],
        flow_sensitivities=[],
    )


def exact_step(m: Matrices, x: FloatArray, u: FloatArray, q: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
    """End and mean of a zero-order hold by one matrix exponential with the inputs and an integrator as states."""
    n = m.n
    inverse = np.linalg.inv(m.capacity)
    drive = inverse @ (m.heating @ q - m.flow[:, n:] @ u)
    big = np.zeros((2 * n + 1, 2 * n + 1))
    big[:n, :n] = -inverse @ m.flow[:, :n]
    big[:n, n] = drive
    big[n + 1 :, :n] = np.eye(n)
    out = sl.expm(big * step) @ np.concatenate([x, [1.0], np.zeros(n)])
    return out[:n], out[n + 1 :] / step


@pytest.mark.parametrize("step", [1.0, 300.0, 3600.0, 86400.0])
@pytest.mark.parametrize("isolated", [False, True])
def test_zero_order_hold_is_exact_at_any_step(step: float, isolated: bool) -> None:
    m = pencil(isolated=isolated)
    modes = modal_model(m)
    p = modes.propagator(step, EXACT)
    rng = np.random.default_rng(1)
    x, u, q = 20.0 * rng.random(m.n), np.array([-5.0]), 50.0 * rng.random(2)
    drive = modes.boundary @ u + modes.heating @ q
    start = modes.coordinates @ x
    end, mean = exact_step(m, x, u, q, step)
    np.testing.assert_allclose(modes.states @ (p.end * start + p.end_gain * drive), end, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(modes.states @ (p.mean * start + p.mean_gain * drive), mean, rtol=1e-6, atol=1e-6)


def test_modes_diagonalise_both_matrices() -> None:
    m = pencil()
    modes = modal_model(m)
    np.testing.assert_allclose(modes.states.T @ m.capacity @ modes.states, np.diag(modes.capacity), atol=1e-6)
    stiffness = modes.states.T @ m.flow[:, : m.n] @ modes.states
    np.testing.assert_allclose(stiffness, np.diag(modes.conductance), atol=1e-9)
    np.testing.assert_allclose(modes.coordinates @ modes.states, np.eye(m.n), atol=1e-9)
    wanted = np.sort(1.0 / sl.eigvals(m.flow[:, : m.n], m.capacity).real)
    np.testing.assert_allclose(modes.time_constants, wanted, rtol=1e-7)


@pytest.mark.parametrize(("scheme", "order"), [(IMPLICIT_EULER, 1), (TR_BDF2, 2)])
def test_schemes_approach_the_exact_hold_at_their_order(scheme: Scheme, order: int) -> None:
    capacity = np.array([3000.0])
    errors = []
    for parts in (8, 16, 32):
        share = 1.0
        for _ in range(parts):
            share *= float(propagator_functions(2400.0 / parts, scheme)[0](capacity)[0])
        errors.append(abs(share - float(propagator_functions(2400.0, EXACT)[0](capacity)[0])))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize("scheme", [EXACT, IMPLICIT_EULER, TR_BDF2])
def test_mean_is_the_integral_of_the_step(scheme: Scheme) -> None:
    """Of the exact hold by quadrature; any scheme keeps a steady state."""
    capacity = np.array([50.0, 3000.0, 1e6])
    end, end_gain, mean, mean_gain = (np.asarray(f(capacity), float) for f in propagator_functions(600.0, scheme))
    k = 1.0 - 1e-8 * capacity
    np.testing.assert_allclose(end / k + end_gain, 1.0 / k, rtol=1e-12)
    np.testing.assert_allclose(mean / k + mean_gain, 1.0 / k, rtol=1e-12)
    if scheme is EXACT:
        times = np.linspace(0.0, 600.0, 20001)
        path = np.exp(-k * times[:, None] / capacity)
        np.testing.assert_allclose(np.trapezoid(path, times, axis=0) / 600.0, mean, rtol=1e-5)


def test_massless_states_are_at_rest_within_a_step() -> None:
    m = pencil()
    m.capacity[0, 0] = 0.0
    modes = modal_model(m)
    p = modes.propagator(300.0)
    assert p.end[0] == 0.0
    x = modes.states @ (p.end_gain * (modes.boundary @ np.array([1.0])))
    assert np.isfinite(x).all()


def test_difference_quotients_are_the_derivative_of_a_matrix_function() -> None:
    rng = np.random.default_rng(3)
    c = np.array([100.0, 1000.0, 1000.0 * (1 + 1e-7), 5e4, 1e6])
    direction = rng.standard_normal((5, 5))
    end = propagator_functions(300.0, EXACT)[0]

    def function(matrix: FloatArray) -> FloatArray:
        value, vectors = np.linalg.eig(matrix)
        return np.asarray((vectors * end(value)) @ np.linalg.inv(vectors)).real

    size = 1e-3
    numeric = (function(np.diag(c) + size * direction) - function(np.diag(c) - size * direction)) / (2 * size)
    np.testing.assert_allclose(direction * divided_differences(end, c), numeric, rtol=1e-5, atol=1e-12)


def test_difference_quotients_meet_the_derivative() -> None:
    c = np.array([1000.0, 1000.0 * (1 + 0.9e-5), 1000.0 * (1 + 1.1e-5)])
    found = divided_differences(lambda x: np.exp(-300.0 / x), c)
    np.testing.assert_allclose(found, np.exp(-0.3) * 300.0 / 1000.0**2, rtol=3e-5)
    np.testing.assert_allclose(np.diag(found), np.exp(-300.0 / c) * 300.0 / c**2, rtol=1e-12)


@cache
def grid() -> SymbolicModel:
    return SymbolicModel(build_network(load_bundled_case().building, dx=1.0))


def test_bad_wishes_are_refused() -> None:
    theta = grid().network.start()
    with pytest.raises(ModelError, match="found the grid"):
        modal_model(grid().matrices(theta))
    with pytest.raises(ModelError, match="positive number of seconds, found 0"):
        modal_model(reduced_model(grid(), [theta]).matrices(theta)).propagator(0.0)
