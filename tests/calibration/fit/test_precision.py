"""Precision of an estimate: the gradient's covariance against simulated heat and noise, and weights."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import Interval
from calibration.estimation.disturbance import DisturbanceModel
from calibration.evaluation.intervals import select_runs
from calibration.fit.precision import Precision, drawn_errors, precision, unexplained
from calibration.fit.problem import Problem
from calibration.fit.tuning_runs import thin
from thermal import SymbolicModel, build_network, load_bundled_case, reduced_model, replay_inputs
from thermal.model.reduce import ReducedModel

FloatArray = NDArray[np.float64]


@cache
def problem() -> Problem:
    case = load_bundled_case()
    grid = SymbolicModel(build_network(case.building, dx=1.5))
    inputs = replay_inputs(case, grid.network)
    stamps = inputs.stamps
    runs = thin([select_runs(inputs, Interval(stamps[900], stamps[1400]), 72)], 72)
    return Problem(grid, inputs, runs, 72, (0, 3, 4, 5), grid.network.start())


@cache
def reduced() -> ReducedModel:
    return reduced_model(problem().grid, [problem().start])


def drawn_gradients(disturbance: DisturbanceModel, count: int) -> FloatArray:
    """Gradient ``J'e`` of errors that come from drawn heat through the building, (count, n_free)."""
    p, model = problem(), reduced()
    errors = drawn_errors(p, model, p.start, disturbance, count, seed=3)
    return np.asarray(errors @ p.turned(model, p.start)[1])


def test_gradient_covariance_is_that_of_drawn_heat() -> None:
    """400 draws of the heat over all runs; its correlation from run to run included."""
    disturbance = DisturbanceModel(np.array([50.0, 100.0, 80.0, 60.0, 120.0]), 4 * 3600.0, 0.02)
    known = precision(problem(), reduced(), problem().start, disturbance)
    memory = precision(problem(), reduced(), problem().start, replace(disturbance, deviation=1e-9 * np.ones(5), sensor_deviation=1e-9))
    wanted = np.cov(drawn_gradients(disturbance, 400).T, bias=True)
    found = known.score - memory.score
    root = np.linalg.inv(np.linalg.cholesky(found))
    values = np.linalg.eigvalsh(root @ wanted @ root.T)
    assert 0.75 < values[0] < values[-1] < 1.3  # 400 draws in 4 dimensions


def test_curvature_is_that_of_the_jacobian() -> None:
    p = problem()
    known = precision(p, reduced(), p.start, DisturbanceModel(50.0, 3600.0, 0.03))
    _, slopes = p.residuals(reduced(), p.start)
    wanted = slopes * p.slopes(p.start)
    np.testing.assert_allclose(known.curvature, wanted.T @ wanted, rtol=1e-9)
    assert known.errors == len(wanted)
    np.testing.assert_allclose(known.prior, np.linalg.inv(p.prior_covariance()))


def test_independent_errors_are_worth_what_they_are() -> None:
    """Where Σ = σ² 1 the weight is 1/σ² and the covariance that of least squares."""
    rng = np.random.default_rng(0)
    jacobian = rng.standard_normal((40, 3))
    curvature = jacobian.T @ jacobian
    known = Precision(curvature, 0.2**2 * curvature, np.diag([1.0, 2.0, 3.0]), 40)
    assert known.weight() == pytest.approx(25.0)
    assert known.effective(0.2) == pytest.approx(40.0)
    wanted = np.linalg.inv(25.0 * curvature + known.prior)
    np.testing.assert_allclose(known.covariance(25.0), wanted, rtol=1e-9)


def test_correlated_errors_are_worth_less_and_the_covariance_is_that_of_repeated_fits() -> None:
    """A linear problem with a known Σ and prior: 4000 repeated fits have the covariance."""
    rng = np.random.default_rng(1)
    jacobian = rng.standard_normal((60, 2))
    lag = np.abs(np.subtract.outer(np.arange(60), np.arange(60)))
    sigma = 0.3**2 * np.exp(-lag / 12.0)
    prior = np.diag([4.0, 0.5])
    known = Precision(jacobian.T @ jacobian, jacobian.T @ sigma @ jacobian, prior, 60)
    weight = known.weight()
    inverse = np.linalg.inv(weight * known.curvature + prior)
    truth = np.linalg.cholesky(np.linalg.inv(prior)) @ rng.standard_normal((2, 4000))
    noise = np.linalg.cholesky(sigma) @ rng.standard_normal((60, 4000))
    estimate = inverse @ (weight * jacobian.T @ (jacobian @ truth + noise))
    np.testing.assert_allclose(np.cov(estimate - truth), known.covariance(weight), rtol=0.1, atol=1e-4)
    slow = Precision(np.ones((1, 1)) * 60.0, np.ones((1, 1)) * sigma.sum(), np.ones((1, 1)), 60)
    assert slow.effective(0.3) < 10.0


def test_errors_as_large_as_the_disturbance_makes_leave_nothing_unexplained() -> None:
    """The ratio falls with the square of the heat and is 1 where both are alike."""
    p = problem()
    small, large = (unexplained(p, reduced(), p.start, DisturbanceModel(d, 4 * 3600.0, 1e-6)) for d in (50.0, 100.0))
    assert small / large == pytest.approx(4.0, rel=1e-3)
