"""Tuning of the disturbance: numbers are found again within their spread, with gaps, per zone, and as a random walk."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from calibration import DisturbanceModel, Interval, tune_disturbance
from calibration.errors import FilterError
from calibration.estimation.filtered import filter_interval
from calibration.estimation.innovations import DISTURBANCE_PRIORS, TunedDisturbance, TuningSettings
from calibration.estimation.state_space import state_space
from thermal import Inputs, SymbolicModel, build_network, load_bundled_case, reduced_model, replay_inputs

FloatArray = NDArray[np.float64]

TRUTH = DisturbanceModel(60.0, 5400.0, 0.06)


@cache
def model() -> SymbolicModel:
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    return reduced_model(grid, [grid.network.start()], order=30)


def theta() -> FloatArray:
    return model().network.start()


def telemetry(seed: int, truth: DisturbanceModel = TRUTH, days: float = 2.0) -> Inputs:
    """The bundled case's weather and heat, and what its model does with them and a disturbance."""
    given = replay_inputs(load_bundled_case(), model().network)
    matrices, count, rng = model().matrices(theta()), int(days * 288), np.random.default_rng(seed)
    space = state_space(matrices.modal.modes, given.step)
    (keep, drive), n = truth.discrete(given.step), space.n_zone
    d = np.broadcast_to(np.asarray(truth.deviation), n) * rng.standard_normal(n) * (not truth.random_walk)
    x = space.start(float(np.nanmean(given.zone[0])) * matrices.uniform[:, None])[:, 0]
    zone = np.empty((count, n))
    u = space.drives(given.boundary, given.heat)
    for k in range(count):
        pushed = u[k] + np.concatenate([np.zeros(space.n_boundary), d])
        zone[k] = space.observation @ x + space.feedthrough @ pushed + 293.15
        x, d = space.advance(x) + space.drive @ pushed, keep * d + drive * rng.standard_normal(n)
    zone += np.asarray(truth.sensor_deviation) * rng.standard_normal(zone.shape)
    cut = {name: getattr(given, name)[:count] for name in ("stamps", "heat", "boundary", "airflow", "complete")}
    return sensed(Inputs(step=given.step, zone=zone, bridged=zone, held=zone, **cut), zone)


def sensed(inputs: Inputs, zone: FloatArray) -> Inputs:
    frame = pd.DataFrame(zone)
    return replace(inputs, zone=zone, bridged=frame.ffill(limit=6).to_numpy(), held=frame.ffill().bfill().to_numpy())


def whole(inputs: Inputs) -> list[Interval]:
    return [Interval(inputs.stamps[0], inputs.stamps[-1])]


def distances(found: TunedDisturbance, truth: DisturbanceModel = TRUTH) -> FloatArray:
    """Logarithms of the numbers over those of the truth, in units of their spread."""
    names = ("deviation", "time_constant", "sensor_deviation")
    values = [np.asarray(getattr(m, n)).ravel()[0] for m in (found.disturbance, truth) for n in names]
    return np.log(np.array(values[:3]) / values[3:]) / np.array([found.spread[n] for n in names])


@cache
def tuned(seed: int) -> TunedDisturbance:
    return tune_disturbance(model(), theta(), telemetry(seed), whole(telemetry(seed)))


def test_numbers_are_found_again_within_their_spread() -> None:
    """From the first 12 hours on, when walls are not yet known: the building starts at one temperature throughout."""
    off = []
    for seed in range(3):
        found = tuned(seed)
        assert found.success, found.status
        assert found.at_bound == ()
        assert found.evaluations < 40
        off.append(distances(found))
    assert np.abs(off).max() < 3.5
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.7
    assert 0.02 < tuned(0).spread["deviation"] < 0.2
    assert 0.005 < tuned(0).spread["sensor_deviation"] < 0.05


def test_result_is_the_likeliest_and_says_so() -> None:
    inputs, found = telemetry(0), tuned(0)
    again = filter_interval(model(), theta(), inputs, whole(inputs)[0], found.disturbance)
    assert found.log_likelihood == pytest.approx(again.log_likelihood, abs=0.1)
    assert found.count == again.count
    assert np.nanstd(again.standardised) == pytest.approx(1.0, abs=0.03)
    for factor in (0.8, 1.25):
        for name in ("deviation", "time_constant", "sensor_deviation"):
            other = replace(found.disturbance, **{name: factor * np.asarray(getattr(found.disturbance, name))[()]})
            lower = filter_interval(model(), theta(), inputs, whole(inputs)[0], other).log_likelihood
            assert lower < found.log_likelihood


@pytest.mark.long
def test_a_start_near_the_optimum_finds_the_same_sooner() -> None:
    inputs, wanted = telemetry(0), tuned(0)
    for per_zone in ((), ("deviation", "sensor_deviation")):
        cold = (
            wanted
            if not per_zone
            else tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(per_zone=per_zone))
        )
        found = tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(per_zone=per_zone, start=cold.disturbance))  # fmt: skip
        assert found.evaluations < 0.5 * cold.evaluations
        assert found.disturbance.near(cold.disturbance, 0.02)


def holed(seed: int, days: float) -> Inputs:
    """Single readings, an hour of a sensor, and an hour of an input are missing."""
    inputs = telemetry(seed, days=days)
    zone = inputs.zone.copy()
    zone[np.random.default_rng(0).random(zone.shape) < 0.03] = np.nan
    zone[500:512, 2] = np.nan
    known = inputs.complete.copy()
    known[600:612] = False
    return replace(sensed(inputs, zone), complete=known)


@pytest.mark.long
def test_gaps_and_several_intervals() -> None:
    inputs = holed(1, 3.0)
    s = inputs.stamps
    found = tune_disturbance(model(), theta(), inputs, [Interval(s[200], s[400]), Interval(s[480], s[-1])])
    assert found.success
    assert np.abs(distances(found)).max() < 4.0
    assert found.count == np.isfinite(np.concatenate([inputs.zone[200:401], inputs.zone[480:]])).sum()


def test_steady_gains_find_the_same_after_a_long_spin_up() -> None:
    inputs = holed(1, 6.0)
    found = tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(covariance="steady"))
    assert found.success
    off = distances(found) * np.array([found.spread[n] for n in ("deviation", "time_constant", "sensor_deviation")])
    assert np.abs(off).max() < 0.2
    assert abs(off[2]) < 0.06  # what is missing is taken for known a little too well


def test_time_constant_can_be_given() -> None:
    inputs = telemetry(2, days=2.0)
    found = tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(time_constant=5400.0))
    assert found.disturbance.time_constant == 5400.0
    assert set(found.spread) == {"deviation", "sensor_deviation"}
    assert abs(np.log(float(np.asarray(found.disturbance.deviation)[0]) / 60.0)) < 4.0 * found.spread["deviation"]


def test_random_walk_is_found_again_and_left_out_where_nothing_is_measured() -> None:
    truth = DisturbanceModel(200.0, np.inf, 0.06)
    inputs = telemetry(3, truth, 2.0)
    zone = inputs.zone.copy()
    zone[:, 2] = np.nan
    found = tune_disturbance(
        model(), theta(), sensed(inputs, zone), whole(inputs), TuningSettings(time_constant=np.inf)
    )
    deviation = np.asarray(found.disturbance.deviation)
    assert deviation[2] == 0.0
    np.testing.assert_allclose(np.log(deviation[[0, 1, 3, 4]] / 200.0), 0.0, atol=4.0 * found.spread["deviation"] + 0.1)


@pytest.mark.long
def test_deviation_of_each_zone() -> None:
    truth = DisturbanceModel(np.array([20.0, 120.0, 50.0, 200.0, 80.0]), 5400.0, 0.06)
    inputs = telemetry(4, truth, 2.0)
    found = tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(per_zone=["deviation"]))
    assert found.success
    zones = model().network.zones
    spread = np.array([found.spread[f"deviation@{z}"] for z in zones])
    off = np.log(np.asarray(found.disturbance.deviation) / np.asarray(truth.deviation)) / spread
    assert np.abs(off).max() < 3.5
    alike = filter_interval(model(), theta(), inputs, whole(inputs)[0], DisturbanceModel(90.0, 5400.0, 0.06))
    assert found.log_likelihood > alike.log_likelihood + 20.0


def test_noise_of_each_sensor() -> None:
    truth = DisturbanceModel(60.0, 5400.0, np.array([0.02, 0.15, 0.06, 0.06, 0.3]))
    inputs = telemetry(6, truth, 1.5)
    found = tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(per_zone="sensor_deviation", time_constant=5400.0))  # fmt: skip
    assert next(iter(found.spread)) == "deviation"
    spread = np.array([found.spread[f"sensor_deviation@{z}"] for z in model().network.zones])
    off = np.log(np.asarray(found.disturbance.sensor_deviation) / np.asarray(truth.sensor_deviation)) / spread
    assert np.abs(off).max() < 3.5


def test_weights_share_the_deviation_out() -> None:
    shares = np.array([20.0, 120.0, 50.0, 200.0, 80.0])
    inputs = telemetry(4, DisturbanceModel(shares, 5400.0, 0.06), 2.0)
    found = tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(weights=shares))
    deviation = np.asarray(found.disturbance.deviation)
    np.testing.assert_allclose(deviation / deviation[0], shares / shares[0])
    assert abs(np.log(deviation[0] / 20.0)) < 4.0 * found.spread["deviation"]


def test_where_data_say_little_the_prior_does() -> None:
    """Noise of 0.9 K drowns a watt: its deviation stays inside the limits, and its spread is that of the prior."""
    inputs = telemetry(5, DisturbanceModel(1.0, 5400.0, 0.9), 1.0)
    found = tune_disturbance(model(), theta(), inputs, whole(inputs))
    assert found.success
    assert found.at_bound == ()
    assert 0.4 < found.spread["time_constant"] < 3.0
    assert 0.4 < found.spread["deviation"] < 3.0


def test_a_number_on_its_limit_is_named() -> None:
    inputs = telemetry(0, days=1.0)
    narrow = replace(DISTURBANCE_PRIORS["sensor_deviation"], median=0.02, upper=0.03)
    priors = {**DISTURBANCE_PRIORS, "sensor_deviation": narrow}
    found = tune_disturbance(
        model(), theta(), inputs, whole(inputs), TuningSettings(time_constant=5400.0, priors=priors)
    )
    assert found.at_bound == ("sensor_deviation",)


def test_progress_and_file() -> None:
    told: list[tuple[str, int, int]] = []
    inputs = telemetry(0, days=1.0)
    found = tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(time_constant=5400.0), progress=lambda *message: told.append(message))  # fmt: skip
    assert {stage for stage, _, _ in told} == {"tune"}
    assert [done for _, done, _ in told] == sorted(done for _, done, _ in told)
    content = json.loads(json.dumps(found.to_dict()))
    assert content["success"] is True
    assert content["disturbance"]["time_constant"] == 5400.0


def test_bad_wishes_are_refused() -> None:
    inputs = telemetry(0)
    grid = SymbolicModel(model().network)
    with pytest.raises(FilterError, match="expected a reduced model, found the grid"):
        tune_disturbance(grid, theta(), inputs, whole(inputs))
    with pytest.raises(FilterError, match="weights: expected 5 numbers of 0 or more"):
        tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(weights=np.ones(3)))
    with pytest.raises(FilterError, match=r"found none for \['time_constant'\]"):
        some = {k: v for k, v in DISTURBANCE_PRIORS.items() if k != "time_constant"}
        tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(priors=some))
    with pytest.raises(FilterError, match="room for a step after 12 h of spin-up"):
        tune_disturbance(model(), theta(), inputs, [Interval(inputs.stamps[0], inputs.stamps[100])])
    with pytest.raises(FilterError, match=r"some of deviation, sensor_deviation, found \['time_constant'\]"):
        tune_disturbance(model(), theta(), inputs, whole(inputs), TuningSettings(per_zone=["time_constant"]))
    with pytest.raises(FilterError, match="at least one interval"):
        tune_disturbance(model(), theta(), inputs, [])


def test_priors_state_their_source() -> None:
    for prior in DISTURBANCE_PRIORS.values():
        assert prior.lower < prior.median < prior.upper
        assert len(prior.source) > 30
