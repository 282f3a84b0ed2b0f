"""Runs in the modes against the generic stepper on the same dense matrices, and sensitivities by differences."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import SymbolicModel, build_network, load_bundled_case, reduced_model
from thermal.model.matrices import Matrices
from thermal.model.reduce import ReducedModel
from thermal.model.step import EXACT, IMPLICIT_EULER, TR_BDF2, Scheme, Stepper

FloatArray = NDArray[np.float64]
STEPS, RUNS = 30, 3


@cache
def model() -> ReducedModel:
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
    return reduced_model(grid, [grid.network.start()])


def inputs(seed: int = 0) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    return -5.0 + 10.0 * rng.random((STEPS, 1, RUNS)), 3000.0 * rng.random((STEPS, 5, RUNS))


def starting(m: Matrices) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(4)
    p = len(m.flow_sensitivities)
    shape = 0.1 * m.uniform[:, None]
    return 20.0 * m.uniform[:, None] + shape * rng.random(RUNS), shape * rng.random(p * RUNS)


@pytest.mark.parametrize("scheme", [IMPLICIT_EULER, TR_BDF2], ids=["implicit_euler", "tr_bdf2"])
def test_free_runs_are_those_of_the_generic_stepper(scheme: Scheme) -> None:
    m = model().matrices(model().theta, sensitivities=True)
    boundary, heat = inputs()
    states, slopes = starting(m)
    keep = np.array([1, 7, STEPS])
    means, moved = m.modal.run(states, boundary, heat, keep, 300.0, scheme, slopes)
    stepper, p = Stepper(m, 300.0, scheme), len(m.flow_sensitivities)
    seen = 0
    for k in range(STEPS):
        states, mean, slopes, mean_slopes = stepper.advance(states, boundary[k], heat[k], sensitivities=slopes)
        if k + 1 in keep:
            np.testing.assert_allclose(means[:, seen], mean.T, atol=1e-9)
            assert mean_slopes is not None
            assert moved is not None
            wanted = mean_slopes.reshape(5, p, RUNS).transpose(2, 0, 1)
            np.testing.assert_allclose(moved[:, seen], wanted, rtol=1e-7, atol=1e-9 * np.abs(wanted).max())
            seen += 1
    assert seen == 3


@pytest.mark.parametrize("free", [(), (1, 3)], ids=["all held", "two zones free"])
def test_held_runs_are_those_of_the_generic_stepper(free: tuple[int, ...]) -> None:
    m = model().matrices(model().theta, sensitivities=True)
    rng = np.random.default_rng(2)
    boundary, heat = (v[:, :, 0] for v in inputs())
    zone = 20.0 + rng.random((STEPS, 5))
    zone[:, list(free)] = np.nan
    states, slopes = (v[:, :n] for v, n in zip(starting(m), (1, len(m.flow_sensitivities)), strict=True))
    keep = np.array([0, 4, STEPS - 1])
    found, moved = m.modal.hold(states, boundary, zone, heat, keep, 300.0, slopes)
    wanted, wanted_moved = Stepper(m, 300.0).hold_many(states, boundary, zone, keep, slopes, heat)
    np.testing.assert_allclose(found, wanted, atol=1e-8 * np.abs(wanted).max())
    assert moved is not None
    assert wanted_moved is not None
    np.testing.assert_allclose(moved, wanted_moved, atol=1e-8 * np.abs(wanted_moved).max())
    held = [z for z in range(5) if z not in free]
    np.testing.assert_allclose((m.observation @ found)[held], zone[keep].T[held], atol=1e-9)


@pytest.mark.parametrize("scheme", [EXACT, IMPLICIT_EULER, TR_BDF2], ids=["exact", "implicit_euler", "tr_bdf2"])
def test_sensitivities_are_differences(scheme: Scheme) -> None:
    """Central differences of whole runs in θ, for every parameter and every scheme."""
    theta = model().theta
    boundary, heat = inputs(1)
    keep = np.array([2, STEPS])

    def means(at: FloatArray) -> FloatArray:
        m = model().matrices(at)
        return m.modal.run(19.0 * np.tile(m.uniform[:, None], RUNS), boundary, heat, keep, 300.0, scheme)[0]

    m = model().matrices(theta, sensitivities=True)
    none = np.zeros((m.n, len(theta) * RUNS))
    _, moved = m.modal.run(19.0 * np.tile(m.uniform[:, None], RUNS), boundary, heat, keep, 300.0, scheme, none)
    assert moved is not None
    for j, value in enumerate(theta):
        size = 1e-4 * value * np.eye(theta.size)[j]
        numeric = (means(theta + size) - means(theta - size)) / (2e-4)
        np.testing.assert_allclose(moved[..., j] * value, numeric, atol=2e-6 * np.abs(numeric).max() + 1e-7)


@pytest.mark.parametrize("scheme", [EXACT, IMPLICIT_EULER], ids=["exact", "implicit_euler"])
def test_the_adjoint_is_the_transpose_of_the_run(scheme: Scheme) -> None:
    """<w, G q + F x> of a run is <G'w, q> + <F'w, x> of the adjoint: both are linear, so exactly."""
    m = model().matrices(model().theta)
    rng = np.random.default_rng(6)
    heat, states = rng.standard_normal((STEPS, 5, RUNS)), rng.standard_normal((m.n, RUNS))
    weights = rng.standard_normal((2, STEPS, 5, RUNS))
    keep = np.arange(1, STEPS + 1)
    means, _ = m.modal.run(states, np.zeros((STEPS, 1, RUNS)), heat, keep, 300.0, scheme)
    by_heat, by_start = m.modal.backward(weights, 300.0, scheme)
    for j in range(2):
        forward = np.einsum("kzm,mkz->", weights[j], means)
        adjoint = np.sum(by_heat[j] * heat) + np.sum(by_start[j] * states)
        assert adjoint == pytest.approx(forward, rel=1e-9)


def test_heat_that_is_spread_otherwise_is_noticed() -> None:
    m = model().matrices(model().theta)
    assert m.modal.heated_as_observed
    other = Matrices(m.capacity, m.flow, 1.1 * m.heating, m.observation, m.uniform, [], [])
    assert not other.modal.heated_as_observed
