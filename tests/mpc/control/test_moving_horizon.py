"""Moving horizon against the Kalman filter and the smoother where no bound is met; bounds where they are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from calibration import DisturbanceModel, KalmanFilter
from calibration.estimation.state_space import state_space
from mpc.control.controller.controller import MpcController
from mpc.control.controller.observer import MovingHorizonObserver, Observer
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.solution import Status
from mpc.errors import ControlError

BOUNDARY = np.array([276.0])
Record = tuple[np.ndarray, np.ndarray]


@pytest.fixture(scope="module")
def kalman(modes) -> KalmanFilter:
    return KalmanFilter(state_space(modes, 300.0), DisturbanceModel(100.0, 6 * 3600.0, 0.05))


@pytest.fixture(scope="module")
def make_record(kalman) -> Callable[..., Record]:
    """Zones of the model under a hidden heat, with noise, and the heat that is known."""

    def make(count: int = 40, hidden: float = 120.0, gaps: float = 0.0) -> Record:
        rng, n = np.random.default_rng(3), kalman.space.n_zone
        x, zone, heat = np.zeros(kalman.space.order), [], 400.0 + 200.0 * rng.standard_normal((count, n))
        for given in heat:
            u = np.concatenate([BOUNDARY - 293.15, given + hidden])
            zone.append(kalman.space.observation @ x + kalman.space.feedthrough @ u + 293.15)
            x = kalman.space.advance(x) + kalman.space.drive @ u
        seen = np.array(zone) + 0.05 * rng.standard_normal((count, n))
        seen[rng.random(seen.shape) < gaps] = np.nan
        return seen, heat

    return make


def textbook(kalman: KalmanFilter, observer: Observer, record: Record) -> tuple[list, list]:
    """Predicted states and covariances by the filter's own equations, dense."""
    a, c, noise = kalman.whole.dense(), kalman.whole.observation, np.diag(kalman.whole.noise_variance)
    q = np.zeros_like(a)
    q[observer.order :, observer.order :] = np.diag(kalman.whole.heat_variance)
    z, p = observer.state.copy(), observer._covariance
    states, covariances = [z], [p]
    for zone, heat in zip(*record, strict=True):
        u = np.concatenate([BOUNDARY - 293.15, heat])
        on = np.isfinite(zone)
        e = (zone - 293.15 - c @ z - kalman.space.feedthrough @ u)[on]
        gain = p @ c[on].T @ np.linalg.inv(c[on] @ p @ c[on].T + noise[np.ix_(on, on)])
        z, p = a @ (z + gain @ e), a @ (p - gain @ c[on] @ p) @ a.T + q
        z[: observer.order] += kalman.space.drive @ u
        states, covariances = [*states, z], [*covariances, p]
    return states, covariances


@pytest.mark.parametrize("gaps", [0.0, 0.3])
@pytest.mark.parametrize("steps", [1, 6])
def test_without_bounds_it_is_the_kalman_filter(kalman, modes, make_record, steps, gaps) -> None:
    record, found = make_record(gaps=gaps), MovingHorizonObserver(kalman, modes, steps)
    found.start(record[0][0], BOUNDARY) if gaps == 0.0 else found.start(np.full(5, 293.15), BOUNDARY)
    wanted, _ = textbook(kalman, found, record)
    size = np.abs(np.array(wanted)).max(axis=0) + 1e-12
    for k, (zone, heat) in enumerate(zip(*record, strict=True)):
        found.update(zone, heat, BOUNDARY)
        np.testing.assert_allclose(found.state / size, wanted[k + 1] / size, atol=1e-8)
    assert found.status is Status.CONVERGED


def test_with_all_sensors_it_is_the_observer(kalman, modes, make_record) -> None:
    one, other = Observer(kalman, modes), MovingHorizonObserver(kalman, modes, 4)
    for each in (one, other):
        each.start(np.full(5, 293.15), BOUNDARY)
    for zone, heat in zip(*make_record(), strict=True):
        errors = [each.update(zone, heat, BOUNDARY) for each in (one, other)]
        np.testing.assert_allclose(errors[0], errors[1], atol=1e-8)
    np.testing.assert_allclose(other.disturbance, one.disturbance, rtol=1e-8, atol=1e-6)


def test_its_window_is_smoothed(kalman, modes, make_record) -> None:
    """States within the window are those of the Rauch-Tung-Striebel smoother, sensors missing."""
    record, found = make_record(12, gaps=0.3), MovingHorizonObserver(kalman, modes, 12)
    found.start(np.full(5, 293.15), BOUNDARY)
    predicted, covariances = textbook(kalman, found, record)
    for zone, heat in zip(*record, strict=True):
        found.update(zone, heat, BOUNDARY)
    a, c = kalman.whole.dense(), kalman.whole.observation
    smooth = [predicted[-1]]
    for k in range(11, -1, -1):
        zone, heat = record[0][k], record[1][k]
        on, u = np.isfinite(zone), np.concatenate([BOUNDARY - 293.15, heat])
        e = (zone - 293.15 - c @ predicted[k] - kalman.space.feedthrough @ u)[on]
        p = covariances[k]
        gain = p @ c[on].T @ np.linalg.inv(c[on] @ p @ c[on].T + np.diag(kalman.whole.noise_variance[on]))
        filtered, left = predicted[k] + gain @ e, p - gain @ c[on] @ p
        back = np.linalg.solve(covariances[k + 1], a @ left).T
        smooth.insert(0, filtered + back @ (smooth[0] - predicted[k + 1]))
    size = np.abs(np.array(smooth)).max(axis=0) + 1e-12
    np.testing.assert_allclose(found.trajectory() / size, np.array(smooth) / size, atol=1e-7)


def test_bounds_are_kept_and_help(kalman, modes, make_record) -> None:
    """Heat that is known to lie between 0 and 150 W is never estimated outside, and nearer to the truth."""
    record = make_record(24, hidden=20.0)
    free, bounded = Observer(kalman, modes), MovingHorizonObserver(kalman, modes, 5, 0.0, 150.0)
    misses: list[list[float]] = [[], []]
    for each in (free, bounded):
        each.start(np.full(5, 293.15), BOUNDARY)
    for zone, heat in zip(*record, strict=True):
        for each, miss in zip((free, bounded), misses, strict=True):
            each.update(zone, heat, BOUNDARY)
            miss.append(float(np.abs(each.disturbance - 20.0).mean()))
        assert (bounded.trajectory()[:, bounded.order :] >= -1e-3).all() and bounded.status is Status.CONVERGED
    assert np.mean(misses[1]) < np.mean(misses[0])


def test_a_controller_takes_either_and_goes_on_bit_for_bit(
    kalman, modes, points, make_problem, make_forecast, make_record
) -> None:
    controller = MpcController(SequentialSolver(make_problem()), MovingHorizonObserver(kalman, modes, 3), points)
    zone, _ = make_record(6)
    seen = [
        {"weather_station/outside_air_temperature_sensor": 276.0, "BOILER/supply_water_temperature_sensor": 330.0}
        | {f"{t}/zone_air_temperature_sensor": float(row[k]) for k, t in enumerate(points.terminals)}
        for row in zone
    ]  # fmt: skip
    for k in range(2):
        controller.step(seen[k], make_forecast())
    saved = controller.save_state()
    first = controller.step(seen[2], make_forecast())
    controller.step(seen[3], make_forecast())
    controller.restore_state(saved)
    assert dict(controller.step(seen[2], make_forecast())) == dict(first)


def test_what_does_not_fit_is_named(kalman, modes) -> None:
    with pytest.raises(ControlError, match="0 steps"):
        MovingHorizonObserver(kalman, modes, 0)
    with pytest.raises(ControlError, match="lower bounds below"):
        MovingHorizonObserver(kalman, modes, 2, 100.0, 50.0)
