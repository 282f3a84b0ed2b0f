"""Estimation by the likelihood of innovations: exact derivatives, what they leave out, recovery, gaps."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import (
    CalibrationError,
    CalibrationResult,
    CalibrationSettings,
    DisturbanceModel,
    Interval,
    KalmanFilter,
    calibrate,
)
from calibration.estimation.filtered import prepare
from calibration.evaluation.settings import Objective
from calibration.fit.likelihood import InnovationsProblem
from calibration.fit.precision import precision, unexplained
from thermal import (
    Case,
    Inputs,
    SymbolicModel,
    build_network,
    free_runs,
    load_bundled_case,
    reduced_model,
    replay_inputs,
    spin_up,
)
from thermal.model.reduce import ReducedModel
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinSettings, TwinTruth, generate_twin

FloatArray = NDArray[np.float64]

DISTURBANCE = DisturbanceModel(120.0, 3600.0, 0.06)


@cache
def problem() -> InnovationsProblem:
    """Two tuning intervals of the bundled case on a coarse grid, with gaps; two parameters fixed."""
    case = load_bundled_case()
    grid = SymbolicModel(build_network(case.building, dx=1.5))
    inputs = replay_inputs(case, grid.network)
    zone = inputs.zone.copy()
    zone[330:350, 1] = np.nan
    zone[420:424] = np.nan
    inputs, stamps = replace(inputs, zone=zone), inputs.stamps
    parts = (Interval(stamps[300], stamps[480]), Interval(stamps[1000], stamps[1040]))
    fixed = ("exterior_convection_coefficient", "radiant_coefficient")
    free = tuple(i for i, p in enumerate(grid.network.parameters) if p.name not in fixed)
    bare = InnovationsProblem(grid, inputs, (), 72, free, grid.network.start(), intervals=parts)
    return bare.at(reduced(), bare.start, DISTURBANCE)


@cache
def reduced() -> ReducedModel:
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    return reduced_model(grid, [grid.network.start()])


def mean(p: InnovationsProblem, theta: FloatArray, number: int) -> FloatArray:
    """Free run of an interval."""
    white, matrices = p.whitenings[number], reduced().matrices(theta)
    starts = np.array([white.at])
    states, _ = spin_up(matrices, p.inputs, white.begin, starts)
    return np.asarray(free_runs(matrices, p.inputs, starts, white.stop - white.at, states)[0][0])


def log_likelihood(p: InnovationsProblem, theta: FloatArray, at: FloatArray, inputs: Inputs, number: int = 0) -> float:
    """Exact log-likelihood by `KalmanFilter` at ``at``, of telemetry that is moved by what θ does to the free run.

    With ``at`` held it is ``log N(y; μ(θ), Σ(at))``, with ``at = θ`` the filter's own at θ.
    """
    white = p.whitenings[number]
    zone = inputs.zone.copy()
    if at is not theta:
        zone[white.at + 1 : white.stop + 1] += mean(p, at, number) - mean(p, theta, number)
    moved = replace(inputs, zone=zone)
    ready = prepare(reduced(), at, p.inputs, p.scheme)  # spun up with what was measured, whatever moved since
    kalman = KalmanFilter(ready.space, DISTURBANCE, tolerance=1e-5)
    return float(kalman.filter(moved, white.at, white.stop, *ready.start(white.begin, white.at)).log_likelihood)


def test_gradient_is_that_of_the_exact_log_likelihood() -> None:
    """J'r along three directions against differences of the filter's log-likelihood with Σ held, gaps and all."""
    p, model = problem(), reduced()
    z = p.point(p.start)
    residual, jacobian = p.weighted(model, z)
    data = residual.size - z.size
    gradient = -(jacobian[:data].T @ residual[:data])
    h = 1e-3
    for direction in np.random.default_rng(0).standard_normal((3, z.size)):
        step = h * direction

        def total(x: FloatArray) -> float:
            return sum(log_likelihood(p, p.theta(x), p.start, p.inputs, n) for n in range(2))

        near, far = total(z + step) - total(z - step), total(z + 2 * step) - total(z - 2 * step)
        assert gradient @ direction == pytest.approx((8.0 * near - far) / (12.0 * h), rel=1e-6)


def test_jacobian_is_that_of_finite_differences() -> None:
    p, model = problem(), reduced()
    z = p.point(p.start) + 0.05
    _, jacobian = p.weighted(model, z)
    h = 1e-3
    for direction in np.random.default_rng(1).standard_normal((3, z.size)):
        step = h * direction
        near = p.weighted(model, z + step)[0] - p.weighted(model, z - step)[0]
        far = p.weighted(model, z + 2 * step)[0] - p.weighted(model, z - 2 * step)[0]
        wanted = (8.0 * near - far) / (12.0 * h)
        assert np.abs(jacobian @ direction - wanted).max() < 1e-6 * np.abs(wanted).max()


def drawn(p: InnovationsProblem, seed: int) -> Inputs:
    """Telemetry of the first interval drawn from the model: the filter run from its innovations to measurements."""
    white, rng = p.whitenings[0], np.random.default_rng(seed)
    whole, z = white.whole, np.zeros(white.whole.n)
    error = np.zeros(white.measured.shape)
    for k, g in enumerate(white.gain_of):
        seen = white.measured[k]
        block = np.ix_(seen, seen)
        innovation = np.zeros(seen.size)
        innovation[seen] = np.linalg.solve(white.roots[g][block], rng.standard_normal(int(seen.sum())))
        error[k] = whole.observation @ z + innovation
        z = whole.advance(z + white.corrections[g] @ innovation)
    zone = p.inputs.zone.copy()
    rows = slice(white.at + 1, white.stop + 1)
    zone[rows] = np.where(white.measured, mean(p, p.start, 0) + error, np.nan)
    return replace(p.inputs, zone=zone)


def test_what_is_left_out_of_the_gradient_vanishes_in_expectation() -> None:
    """Where the model is true, the exact score through Σ, determinant and gains included, has mean zero."""
    p = replace(problem(), intervals=problem().intervals[:1], whitenings=problem().whitenings[:1])
    model, z, h = reduced(), p.point(p.start), 1e-2
    chosen, left_out, own = [4, 6], [], []
    for seed in range(8):
        sample = replace(p, inputs=drawn(p, seed))
        residual, jacobian = sample.turned(model, p.start)
        gradient = -(jacobian.T @ residual)
        own.append(gradient[chosen])
        exact = []
        for j in chosen:
            ends = [p.theta(z + sign * h * np.eye(z.size)[j]) for sign in (1.0, -1.0)]
            high, low = (log_likelihood(p, end, end, sample.inputs) for end in ends)
            exact.append((high - low) / (2.0 * h))
        left_out.append(np.array(exact) - gradient[chosen])
    for scores in (np.array(left_out), np.array(own)):
        deviation = scores.std(axis=0, ddof=1) / np.sqrt(len(scores))
        assert (np.abs(scores.mean(axis=0)) < 4.0 * deviation).all()
    information = np.diag(jacobian.T @ jacobian)[chosen]
    np.testing.assert_allclose(np.var(own, axis=0), information, rtol=0.9)  # J'J is the variance of the score


def test_precision_is_the_information_and_white_innovations_have_no_excess() -> None:
    p = replace(problem(), intervals=problem().intervals[:1], whitenings=problem().whitenings[:1])
    sample, model = replace(p, inputs=drawn(p, 3)), reduced()
    _, jacobian = sample.turned(model, p.start)
    known = precision(sample, model, p.start, DISTURBANCE)
    np.testing.assert_allclose(known.curvature, jacobian.T @ jacobian)
    assert known.weight() == pytest.approx(1.0)
    prior = np.linalg.inv(p.prior_covariance())
    np.testing.assert_allclose(known.covariance(1.0), np.linalg.inv(jacobian.T @ jacobian + prior), rtol=1e-8)
    assert known.effective(1.0) == pytest.approx(sample.effective_size()) == p.whitenings[0].measured.sum()
    assert unexplained(sample, model, p.start, DISTURBANCE) < 3.0  # a day and a half: two stretches of telemetry
    assert unexplained(problem(), model, p.start, DisturbanceModel(5.0, 60.0, 0.02)) > 10.0


@cache
def twin() -> tuple[Case, TwinTruth]:
    """Six days of a small office whose parameters are known."""
    building = pilot_building(1, floor_area=80.0, zones=2, floors=1, name="office")
    return generate_twin(building, 1, TwinSettings(days=6.0, dx=2.0, step_seconds=900.0, excitation="prbs"))


def without(case: Case) -> Case:
    """Every fiftieth reading lost, and one sensor for a day and a half."""
    rng = np.random.default_rng(0)
    frame = case.telemetry.frame.copy()
    sensors = [name for name in frame.columns if name.endswith("/zone_air_temperature_sensor")]
    frame[sensors] = frame[sensors].where(rng.random((len(frame), len(sensors))) > 0.02)
    frame.loc[frame.index[200:344], sensors[1]] = np.nan
    return replace(case, telemetry=replace(case.telemetry, frame=frame))


@cache
def calibrated(objective: Objective) -> CalibrationResult:
    return calibrate(twin()[0], settings=CalibrationSettings(dx=2.0, objective=objective, starts=1, horizon="3h"))


def off(result: CalibrationResult) -> tuple[FloatArray, FloatArray]:
    """Errors of the estimates in deviations of their priors and in standard errors."""
    known = {p.name: (p, v) for p, v in zip(twin()[1].parameters, twin()[1].theta, strict=True)}
    errors = []
    for e in result.parameters:
        if e.standard_error is not None:
            p, truth = known[e.name]
            error = p.transform(e.value) - p.transform(float(truth))
            errors.append((error / p.prior_deviation, error * p.slope(e.value) / e.standard_error))
    first, second = np.array(errors).T
    return first, second


def test_parameters_of_a_twin_are_recovered() -> None:
    """Nearer to the truth than the prior is by far, intervals that cover it, and a disturbance close to the true one."""
    found = calibrated("innovations")
    of_priors, of_errors = off(found)
    assert found.objective == "innovations" and found.solver.success and found.solver.settled
    assert np.sqrt(np.mean(of_priors**2)) < 0.7
    assert np.mean(np.abs(of_errors) < 2.0) >= 0.8
    assert found.excess < 2.0
    assert found.disturbance is not None
    assert float(np.mean(found.disturbance.sensor_deviation)) == pytest.approx(twin()[1].noise, rel=0.2)


def test_innovations_determine_more_of_a_twin_than_errors_of_runs() -> None:
    errors = []
    for found in (calibrated("multi_step"), calibrated("innovations")):
        errors.append(sum(np.log(p.standard_error / p.value) for p in found.parameters if p.standard_error is not None))
    assert errors[1] < errors[0]


def test_gaps_widen_an_estimate_and_do_not_move_it() -> None:
    """Every fiftieth reading lost, and a sensor for a day and a half: within two standard errors of the whole's."""
    whole = calibrated("innovations")
    found = calibrate(without(twin()[0]), settings=CalibrationSettings(dx=2.0, objective="innovations", starts=1, horizon="3h"))
    assert found.solver.success
    for a, b in zip(whole.parameters, found.parameters, strict=True):
        if a.standard_error is not None and b.standard_error is not None:
            assert abs(a.value - b.value) < 2.0 * max(a.standard_error, b.standard_error), a.name


def test_result_says_what_was_minimised() -> None:
    assert calibrated("innovations").to_dict()["objective"] == "innovations"
    assert calibrated("multi_step").to_dict()["objective"] == "multi_step"
    with pytest.raises(CalibrationError, match="objective: expected one of multi_step, innovations, found 'kalman'"):
        calibrate(twin()[0], settings=CalibrationSettings(objective="kalman"))  # type: ignore[arg-type]
