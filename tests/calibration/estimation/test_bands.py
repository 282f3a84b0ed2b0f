"""Bands of predictions that begin from a filter: they hold as often as they say, also where the disturbance is wrong."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from calibration.estimation.bands import Forecaster
from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.filtered import evaluate_filter, prepare
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import EvaluationSettings, evaluate_model
from thermal import Inputs, SymbolicModel, build_network, load_bundled_case, reduced_model, replay_inputs, spin_up
from thermal.model.reduce import ReducedModel
from thermal.model.step import IMPLICIT_EULER

TRUE = DisturbanceModel(200.0, 3 * 3600.0, 0.05)
SETTINGS = EvaluationSettings("3h", horizons=("1h", "3h"))


@cache
def twin() -> tuple[ReducedModel, Inputs]:
    """The bundled building with temperatures that its own model makes, with heat nobody measured and sensor noise."""
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    theta, rng = grid.network.start(), np.random.default_rng(1)
    model, inputs = reduced_model(grid, [theta]), replay_inputs(load_bundled_case(), grid.network)
    ready = prepare(model, theta, inputs, IMPLICIT_EULER)
    space, at = ready.space, 288
    x = space.start(spin_up(ready.matrices, inputs, 0, np.array([at]))[0])[:, 0]
    keep, push = TRUE.discrete(inputs.step)
    zone, heat = inputs.bridged.copy(), 200.0 * rng.standard_normal(space.n_zone)
    for k in range(at + 1, len(inputs)):
        u = space.drives(inputs.boundary[[k]], inputs.heat[[k]] + heat)[0]
        zone[k] = space.observation @ x + space.feedthrough @ u + 293.15
        x = space.advance(x) + space.drive @ u
        heat = keep * heat + push * rng.standard_normal(space.n_zone)
    zone[at + 1 :] += 0.05 * rng.standard_normal(zone[at + 1 :].shape)
    return model, replace(inputs, zone=zone, bridged=zone, held=zone, complete=np.ones(len(inputs), dtype=bool))


def days(first: int, last: int) -> Interval:
    stamps = twin()[1].stamps
    return Interval(stamps[288 * first], stamps[288 * last])


def test_bands_of_the_true_disturbance_hold_as_often_as_they_say() -> None:
    model, inputs = twin()
    theta = model.network.start()
    normal = dict.fromkeys(model.network.zones, 1.645)
    found = Forecaster(model, inputs, TRUE, SETTINGS).judge(theta, [days(3, 7)], normal)
    assert found.coverage == pytest.approx(0.9, abs=0.03)
    assert found.half_width is not None and 0.1 < found.half_width < 2.0


@pytest.mark.parametrize("wrong", [0.4, 2.5])
def test_factors_make_up_for_a_wrong_disturbance(wrong: float) -> None:
    model, inputs = twin()
    theta = model.network.start()
    forecaster = Forecaster(model, inputs, replace(TRUE, deviation=wrong * TRUE.deviation), SETTINGS)
    factors = forecaster.factors([days(3, 4), days(4, 5)], [theta, theta])
    assert set(factors) == set(model.network.zones)
    assert all((factor > 1.645) == (wrong < 1.0) for factor in factors.values())
    assert forecaster.judge(theta, [days(5, 7)], factors).coverage == pytest.approx(0.9, abs=0.05)


def test_errors_are_those_of_the_filter_and_less_than_without_it() -> None:
    model, inputs = twin()
    theta, part = model.network.start(), [days(4, 6)]
    found = Forecaster(model, inputs, TRUE, SETTINGS).judge(theta, part, {})
    same = evaluate_filter(model, theta, inputs, part, TRUE, SETTINGS)
    assert (found.mae, found.by_horizon) == (same.metrics.mae, same.by_horizon)
    alone = evaluate_model(model, theta, inputs, part, SETTINGS)
    assert found.by_horizon["1h"] < 0.8 * alone.by_horizon["1h"]
    assert found.coverage is None and found.half_width is None


def test_a_zone_without_a_sensor_has_no_band() -> None:
    model, inputs = twin()
    theta, blind = model.network.start(), inputs.zone.copy()
    blind[:, 0] = np.nan
    inputs = replace(inputs, zone=blind, bridged=blind, held=blind)
    forecaster = Forecaster(model, inputs, TRUE, SETTINGS)
    factors = forecaster.factors([days(3, 4)], [theta])
    assert set(factors) == set(model.network.zones[1:])
    assert forecaster.judge(theta, [days(5, 6)], factors).coverage is not None
