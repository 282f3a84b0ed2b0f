"""The estimation problem: residuals, their derivatives, the weight of data and priors, starts and runs."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import Interval
from calibration.evaluation.intervals import select_runs
from calibration.fit.estimate import estimate
from calibration.fit.problem import Problem
from calibration.fit.starts import compensated_start, draw_starts
from calibration.fit.tuning_runs import thin
from thermal import SymbolicModel, build_network, free_runs, load_bundled_case, reduced_model, replay_inputs, spin_up
from thermal.effects.catalogue import chosen
from thermal.model.step import TR_BDF2

FloatArray = NDArray[np.float64]


@cache
def problem() -> Problem:
    """Two tuning intervals of the bundled case on a coarse grid; two parameters fixed."""
    case = load_bundled_case()
    grid = SymbolicModel(build_network(case.building, dx=1.5))
    inputs = replay_inputs(case, grid.network)
    stamps = inputs.stamps
    parts = [Interval(stamps[300], stamps[500]), Interval(stamps[1000], stamps[1100])]
    runs = thin([select_runs(inputs, part, 72) for part in parts], 72)
    fixed = ("exterior_convection_coefficient", "radiant_coefficient")
    free = tuple(i for i, p in enumerate(grid.network.parameters) if p.name not in fixed)
    return Problem(grid, inputs, runs, 72, free, grid.network.start())


@cache
def reduced() -> SymbolicModel:
    return reduced_model(problem().grid, [problem().start])


def point() -> FloatArray:
    rng = np.random.default_rng(2)
    return np.array(
        [p.transform(p.start) + 0.3 * p.prior_deviation * rng.standard_normal() for p in problem().parameters]
    )


def test_runs_tile_the_intervals() -> None:
    for runs in problem().runs:
        assert runs.starts.size > 0
        assert (np.diff(runs.starts) >= 72).all()


def test_residuals_are_half_hourly_errors_of_the_runs() -> None:
    p, model = problem(), reduced()
    np.testing.assert_array_equal(p.keep, np.arange(6, 73, 6))
    theta = p.theta(point())
    found, _ = p.residuals(model, theta)
    matrices = model.matrices(theta)
    wanted = []
    for runs in p.runs:
        states, _ = spin_up(matrices, p.inputs, runs.begin, runs.starts)
        means, _ = free_runs(matrices, p.inputs, runs.starts, 72, states)
        for run, start in enumerate(runs.starts):
            wanted.append(means[run, p.keep - 1] - p.inputs.zone[start + p.keep])
    np.testing.assert_allclose(np.sort(found), np.sort(np.concatenate(wanted).ravel()), rtol=0, atol=1e-9)
    np.testing.assert_allclose(p.residuals_only(model, theta), found, rtol=0, atol=1e-9)


@pytest.mark.parametrize("scheme", ["implicit_euler", "tr_bdf2"])
def test_weighted_jacobian_is_that_of_finite_differences(scheme: str) -> None:
    """On the estimation scale, data and priors together, to 1e-6."""
    p, model, z = problem(), reduced(), point()
    if scheme == "tr_bdf2":
        p = replace(p, scheme=TR_BDF2)
    _, jacobian = p.weighted(model, z)
    h = 2e-3
    for j in range(z.size):
        step = h * np.eye(z.size)[j]
        near = p.weighted(model, z + step)[0] - p.weighted(model, z - step)[0]
        far = p.weighted(model, z + 2 * step)[0] - p.weighted(model, z - 2 * step)[0]
        wanted = (8.0 * near - far) / (12.0 * h)
        assert np.abs(jacobian[:, j] - wanted).max() < 1e-6 * np.abs(wanted).max()


def test_cost_is_the_negative_log_posterior() -> None:
    """Data count as days times zones of independent observations; a prior's range is four deviations."""
    p, model, z = problem(), reduced(), point()
    residual, _ = p.weighted(model, z)
    error = p.residuals_only(model, p.theta(z))
    days = sum(r.starts.size for r in p.runs) * 6.0 / 24.0
    observations = max(1.0, days) * 5
    data = observations * np.mean(error**2) / p.deviation**2
    prior = sum(((v - q.transform(q.start)) / q.prior_deviation) ** 2 for v, q in zip(z, p.parameters, strict=True))
    assert residual @ residual == pytest.approx(data + prior, rel=1e-10)
    assert p.effective_size() == pytest.approx(observations)


def test_theta_keeps_what_is_not_free() -> None:
    p = problem()
    theta = p.theta(point())
    for i, parameter in enumerate(p.grid.network.parameters):
        if i not in p.free:
            assert theta[i] == parameter.start
    np.testing.assert_allclose(p.point(theta), point(), rtol=1e-12)


def test_point_outside_of_the_range_is_moved_inside() -> None:
    p = problem()
    theta = p.start.copy()
    theta[p.free[0]] = 1e6
    first = p.parameters[0]
    assert p.point(theta)[0] == pytest.approx(first.transform(first.upper))


def test_unmeasured_zones_and_stamps_have_no_residual() -> None:
    p, model = problem(), reduced()
    whole = p.residuals_only(model, p.start).size
    zone = p.inputs.zone.copy()
    zone[p.runs[0].starts[0] + p.keep[3], 1] = np.nan
    spoilt = replace(p, inputs=replace(p.inputs, zone=zone))
    error, slopes = spoilt.residuals(model, p.start)
    assert error.size == whole - 1
    assert slopes.shape == (error.size, len(p.free))
    assert np.isfinite(error).all()


def test_starts_are_the_given_one_and_seeded_draws() -> None:
    p = problem()
    first, *further = draw_starts(p, 4, seed=5)
    np.testing.assert_allclose(first, p.point(p.start))
    again = draw_starts(p, 4, seed=5)
    other = draw_starts(p, 4, seed=6)
    for a, b, c in zip(further, again[1:], other[1:], strict=True):
        np.testing.assert_array_equal(a, b)
        assert (a != c).all()
    assert not np.array_equal(further[0], further[1])


def test_estimate_is_a_minimum_of_the_grid_s_own_cost() -> None:
    """Found on a reduced model: half a standard error along any parameter does not lower the cost on the grid."""
    p = problem()
    found = estimate(p, p.point(p.start))
    assert found.solve.success
    weighing = found.problem
    z = p.point(found.theta)

    def cost(x: FloatArray) -> float:
        error = p.residuals_only(p.grid, p.theta(x))
        data = weighing.effective_size() * float(np.mean(error**2)) / weighing.deviation**2
        prior = [((v - q.transform(q.start)) / q.prior_deviation) ** 2 for v, q in zip(x, p.parameters, strict=True)]
        return 0.5 * (data + float(np.sum(prior)))

    least = cost(z)
    spread = np.sqrt(np.diag(found.covariance))
    for j in range(z.size):
        for sign in (-0.5, 0.5):
            assert cost(z + sign * spread[j] * np.eye(z.size)[j]) > least - 0.02
    assert least < cost(p.point(p.start))


def test_covariance_is_that_of_the_posterior() -> None:
    """Inverse of the Gauss-Newton Hessian of data and priors at the estimate, on the estimation scale."""
    p = problem()
    found = estimate(p, p.point(p.start))
    _, jacobian = found.problem.weighted(found.model, p.point(found.theta))
    wanted = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), wanted, rtol=0.1)


def test_compensated_start_fits_better_than_the_estimate_and_cares_less_for_the_priors() -> None:
    p = problem()
    found = estimate(p, p.point(p.start))
    bold = compensated_start(found.problem, p.point(p.start), found.model)
    errors = [np.mean(p.residuals_only(found.model, p.theta(z)) ** 2) for z in (bold, found.point)]
    spread = np.array([q.prior_deviation for q in p.parameters])
    centre = np.array([q.transform(q.start) for q in p.parameters])
    moves = [np.linalg.norm((z - centre) / spread) for z in (bold, found.point)]
    assert errors[0] < errors[1]
    assert moves[0] > moves[1]


def test_outliers_pull_least_squares_but_not_the_robust_loss() -> None:
    """A sensor that reads 8 K too high for a few hours: the robust estimate stays closer to that without it."""
    p = problem()
    zone = p.inputs.zone.copy()
    zone[p.runs[0].starts[1] + 30 : p.runs[0].starts[1] + 66, 2] += 8.0
    spoilt = replace(p, inputs=replace(p.inputs, zone=zone))
    spread = np.array([q.prior_deviation for q in p.parameters])
    wanted = estimate(p, p.point(p.start)).point
    away = {}
    for loss in ("linear", "pseudo_huber"):
        found = estimate(replace(spoilt, loss=loss), p.point(p.start))
        away[loss] = float(np.linalg.norm((found.point - wanted) / spread))
    assert away["pseudo_huber"] < 0.7 * away["linear"]


def test_robust_loss_is_least_squares_for_small_errors_and_linear_for_large_ones() -> None:
    p = replace(problem(), loss="pseudo_huber", deviation=1.0)
    small, large = np.array([1e-3, -1e-3]), np.array([100.0, -100.0])
    np.testing.assert_allclose(p._cost(small)[0], small, rtol=1e-6)
    np.testing.assert_allclose(0.5 * p._cost(large)[0] ** 2, 1.345 * 100.0, rtol=0.02)
    for e in (0.01, 0.7, -3.0, 20.0):
        h = 1e-6
        slope = (p._cost(np.array([e + h]))[0] - p._cost(np.array([e - h]))[0]) / (2 * h)
        np.testing.assert_allclose(p._cost(np.array([e]))[1], slope, rtol=1e-6)


def test_members_of_a_group_share_their_spread_and_shrink_towards_each_other() -> None:
    """Correlation of the members before any data, and a spread that is learnt from how far they are apart."""
    case = load_bundled_case()
    scopes = {"slab_heat_capacity": "zone"}
    network = build_network(case.building, dx=1.5, scopes=scopes)
    grid = SymbolicModel(network)
    p = replace(problem(), grid=grid, free=tuple(range(len(network.parameters))), start=network.start())
    members = [i for i, q in enumerate(p.parameters) if q.base == "slab_heat_capacity"]
    assert len(members) == 5
    block = p.prior_covariance()[np.ix_(members, members)]
    spread = p.parameters[members[0]].prior_deviation
    np.testing.assert_allclose(block, spread**2 + 0.3**2 * np.eye(5))
    found = estimate(p, p.point(p.start))
    learnt = found.problem.shrinkage["slab_heat_capacity"]
    own = found.point[members] - found.point[members].mean()
    assert 0.02 <= learnt <= 1.0
    assert np.sqrt(own @ own / 4) <= learnt + 1e-9  # what is seen, and what is still open


def test_strengths_of_an_effect_in_several_zones_are_independent() -> None:
    """One zone's sensor may read high where the next one's reads low; a slab's capacity is much like the next one's."""
    case = load_bundled_case()
    zones = tuple(case.building.zone_names[:3])
    network = build_network(case.building, dx=1.5, effects=tuple(chosen({"sensor_bias": zones})))
    p = replace(
        problem(), grid=SymbolicModel(network), free=tuple(range(len(network.parameters))), start=network.start()
    )
    members = [i for i, q in enumerate(p.parameters) if q.effect == "sensor_bias"]
    assert len(members) == 3
    block = p.prior_covariance()[members]
    deviations = np.array([p.parameters[i].prior_deviation for i in members])
    np.testing.assert_allclose(block[:, members], np.diag(deviations**2))
    np.testing.assert_allclose(np.delete(block, members, axis=1), 0.0)
