"""State space of a reduced model: against the runs of the model alone, the matrix exponential, and by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl
from numpy.typing import NDArray

from calibration import StateSpace
from calibration.errors import CalibrationError, FilterError
from calibration.estimation.state_space import state_space
from thermal import ModelError
from thermal.model.matrices import Matrices
from thermal.model.modal import modal_model
from thermal.model.step import EXACT, IMPLICIT_EULER, TR_BDF2, Scheme, Stepper
from thermal.units import AIR_HEAT_CAPACITY

FloatArray = NDArray[np.float64]

REFERENCE = 293.15


def pencil(seed: int = 0, n: int = 9) -> Matrices:
    """Random symmetric model of two zones and one boundary, heated as observed."""
    rng = np.random.default_rng(seed)
    links = np.triu(rng.random((n, n)), 1) * 50.0
    links += links.T
    leak = 10.0 * rng.random(n)
    stiffness = np.diag(links.sum(axis=1) + leak) - links
    observation = np.zeros((2, n))
    observation[0, :3], observation[1, 3:6] = 1 / 3, 1 / 3
    return Matrices(
        capacity=np.diag(rng.uniform(1e5, 1e7, n)),
        flow=np.hstack([stiffness, -leak[:, None]]),
        heating=observation.T.copy(),
        observation=observation,
        uniform=np.ones(n),
        capacity_sensitivities=[],
        flow_sensitivities=[],
    )


def run(space: StateSpace, states: FloatArray, boundary: FloatArray, heat: FloatArray) -> FloatArray:
    """Zone means of one run, one row a step [K]."""
    x, u = space.start(states)[:, 0], space.drives(boundary, heat)
    means = []
    for row in u:
        means.append(space.observation @ x + space.feedthrough @ row + REFERENCE)
        x = space.advance(x) + space.drive @ row
    return np.array(means)


def signals(count: int = 40) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(7)
    return 280.0 + 5.0 * rng.random((count, 1)), 800.0 * rng.random((count, 2))


@pytest.mark.parametrize("scheme", [EXACT, IMPLICIT_EULER, TR_BDF2])
def test_it_is_the_model_alone(scheme: Scheme) -> None:
    m = pencil()
    boundary, heat = signals()
    start = 290.0 + np.arange(9.0)[:, None]
    keep = np.arange(1, len(heat) + 1)
    offset = REFERENCE * m.uniform[:, None]
    wanted, _ = m.modal.run(
        start - offset, boundary[:, :, None] - REFERENCE, heat[:, :, None], keep, 300.0, scheme
    )  # fmt: skip
    space = state_space(m.modal.modes, 300.0, scheme)
    assert space.transition.ndim == 1
    np.testing.assert_allclose(run(space, start, boundary, heat), wanted[0] + REFERENCE, rtol=0, atol=1e-9)


AIRFLOWS, FLOW = ((0, 1), (1, 0)), np.array([0.05, 0.02])


@pytest.mark.parametrize("scheme", [IMPLICIT_EULER, TR_BDF2])
def test_constant_directed_airflows_are_those_of_the_grid_s_stepper(scheme: Scheme) -> None:
    m = pencil()
    boundary, heat = signals()
    states = 290.0 + np.arange(9.0)[:, None]
    space = state_space(m.modal.modes, 300.0, scheme, airflows=AIRFLOWS, flow=FLOW)
    found = run(space, states, boundary, heat)
    stepper = Stepper(replace(m, airflows=AIRFLOWS), 300.0, scheme)
    for k in range(len(heat)):
        states, mean, _, _ = stepper.advance(states, boundary[k][:, None], heat[k][:, None], FLOW[:, None])
        np.testing.assert_allclose(found[k], mean[:, 0], rtol=0, atol=1e-8)


def test_directed_airflows_under_the_exact_hold() -> None:
    """End and mean by one matrix exponential of the whole model with inputs and an integrator as states."""
    m, n = pencil(), 9
    mixing = AIR_HEAT_CAPACITY * np.array([[-FLOW[1], FLOW[1]], [FLOW[0], -FLOW[0]]])
    states, u, q = 290.0 + np.arange(9.0), np.array([280.0]), np.array([500.0, 100.0])
    inverse = np.linalg.inv(m.capacity)
    big = np.zeros((2 * n + 1, 2 * n + 1))
    big[:n, :n] = -inverse @ (m.flow[:, :n] - m.heating @ mixing @ m.observation)
    big[:n, n] = inverse @ (m.heating @ q - m.flow[:, n:] @ u)
    big[n + 1 :, :n] = np.eye(n)
    out = sl.expm(big * 300.0) @ np.concatenate([states, [1.0], np.zeros(n)])
    space = state_space(m.modal.modes, 300.0, EXACT, airflows=AIRFLOWS, flow=FLOW)
    x, drives = space.start(states[:, None])[:, 0], space.drives(u, q)
    mean = space.observation @ x + space.feedthrough @ drives + REFERENCE
    np.testing.assert_allclose(mean, m.observation @ out[n + 1 :] / 300.0, rtol=0, atol=1e-7)
    end = space.zone_means @ (space.advance(x) + space.drive @ drives) + REFERENCE
    np.testing.assert_allclose(end, m.observation @ out[:n], rtol=0, atol=1e-7)


def test_dense_and_diagonal_agree_where_no_air_moves() -> None:
    m = pencil()
    for scheme in (EXACT, IMPLICIT_EULER, TR_BDF2):
        plain = state_space(m.modal.modes, 300.0, scheme)
        dense = state_space(m.modal.modes, 300.0, scheme, airflows=AIRFLOWS, flow=np.array([0.0, 1e-14]))
        np.testing.assert_allclose(dense.transition, np.diag(plain.transition), atol=1e-9)
        for name in ("drive", "observation", "feedthrough"):
            wanted = getattr(plain, name)
            np.testing.assert_allclose(getattr(dense, name), wanted, rtol=0, atol=1e-9 * np.abs(wanted).max())


def test_what_an_airflow_differs_by_is_heat_at_the_start_s_temperatures() -> None:
    """0.01 kg/s more from zone 0 at 25 degC to zone 1 at 20 degC bring 1006 * 0.01 * 5 = 50.3 W to zone 1 alone."""
    m = pencil()
    space = state_space(m.modal.modes, 300.0, airflows=AIRFLOWS, flow=FLOW)
    states = np.full((9, 1), 293.15)
    states[:3] = 298.15
    found = space.directed_heat(FLOW[:, None] + [[0.01], [0.0]], space.start(states))
    np.testing.assert_allclose(found[:, 0], [0.0, 50.3], atol=1e-6)
    plain = state_space(m.modal.modes, 300.0)
    np.testing.assert_array_equal(plain.directed_heat(np.empty((0, 1)), plain.start(states)), np.zeros((2, 1)))


@pytest.mark.parametrize("flow", [None, FLOW])
def test_a_building_at_one_temperature_stays_there(flow: FloatArray | None) -> None:
    m = pencil()
    space = state_space(modal_model(m), 600.0, airflows=AIRFLOWS, flow=flow)
    warm = run(space, np.full((9, 1), 301.0), np.full((500, 1), 301.0), np.zeros((500, 2)))
    np.testing.assert_allclose(warm, 301.0, rtol=0, atol=1e-8)


@pytest.mark.parametrize("flow", [None, FLOW])
def test_the_transpose_is_the_transpose(flow: FloatArray | None) -> None:
    space = state_space(pencil().modal.modes, 600.0, airflows=AIRFLOWS, flow=flow)
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, space.order, 3))
    np.testing.assert_allclose(a.T @ space.advance(b), space.retreat(a).T @ b, rtol=1e-12)


def test_sizes_and_refusals() -> None:
    space = state_space(pencil().modal.modes, 600.0)
    assert (space.order, space.n_zone, space.n_boundary) == (9, 2, 1)
    assert space.heat_drive.shape == (9, 2)
    assert space.heat_feedthrough.shape == (2, 2)
    with pytest.raises(FilterError, match=r"one mean for each of 2 airflows, got shape \(1,\)"):
        state_space(pencil().modal.modes, 600.0, airflows=AIRFLOWS, flow=np.array([0.1]))
    with pytest.raises(ModelError, match="positive number of seconds"):
        state_space(pencil().modal.modes, 0.0)
    assert issubclass(FilterError, CalibrationError)
