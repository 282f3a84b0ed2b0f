"""N-step prediction error: the paper's metric by hand, and evaluations of made-up buildings."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import Interval, evaluate_model
from calibration.errors import NotEnoughDataError
from calibration.evaluation.n_step import HORIZONS, EvaluationSettings, spatial_metrics
from thermal import Case, Inputs, SymbolicModel, build_network, free_runs, load_bundled_case, replay_inputs, spin_up
from thermal.model.step import TR_BDF2

FloatArray = NDArray[np.float64]


# Hand-worked


def test_spatial_error_is_the_paper_s() -> None:
    """Two runs, three zones: eps_1 = (0.3 + 0.1 + 0.5) / 3 = 0.3, eps_2 = (0.0 + 0.6 + 0.3) / 3 = 0.3."""
    found = spatial_metrics(np.array([[0.3, -0.1, 0.5], [0.0, -0.6, 0.3]]))
    assert found.mae == pytest.approx(0.3)
    # medians over zones 0.3 and 0.0, then their mean; bias (0.7 / 3 - 0.3 / 3) / 2
    assert found.median == pytest.approx(0.15)
    assert found.bias == pytest.approx(0.4 / 6)
    assert found.to_dict() == {"mae": found.mae, "median": found.median, "bias": found.bias}


def test_zones_that_are_not_measured_do_not_count() -> None:
    """Run 1 knows one zone, run 2 both: eps = 1.0 and 0.3, whose mean is not that of the three errors."""
    found = spatial_metrics(np.array([[1.0, np.nan], [np.nan, np.nan], [0.2, -0.4]]))
    assert found.mae == pytest.approx(0.65)
    assert found.bias == pytest.approx(0.45)
    assert found.median == pytest.approx(0.45)


def test_sign_is_simulated_minus_measured() -> None:
    assert spatial_metrics(np.array([[0.5, 0.7]])).bias == pytest.approx(0.6)
    assert spatial_metrics(np.array([[-0.5, -0.7]])).median == pytest.approx(-0.6)


# On the bundled case


@cache
def setting() -> tuple[Case, SymbolicModel, Inputs]:
    case = load_bundled_case()
    model = SymbolicModel(build_network(case.building, dx=1.5))
    return case, model, replay_inputs(case, model.network)


def part(first: int, last: int) -> Interval:
    stamps = setting()[2].stamps
    return Interval(stamps[first], stamps[last])


def test_errors_are_those_of_runs_one_by_one() -> None:
    """Every run spun up and stepped for itself; its mean over the 72nd step against the sensor there."""
    _, model, inputs = setting()
    theta = model.network.start()
    found = evaluate_model(model, theta, inputs, [part(1200, 1400)])
    (predictions,) = found.predictions
    assert found.steps == 72
    assert found.step_seconds == 300.0
    starts = inputs.stamps.get_indexer(predictions.start)
    assert (starts >= 1200 - 72).all()
    matrices = model.matrices(theta)
    wanted = []
    for start in starts:
        state, _ = spin_up(matrices, inputs, 1200 - 864, np.array([start]))
        means, _ = free_runs(matrices, inputs, np.array([start]), 72, state)
        wanted.append(means[0, 71] - inputs.zone[start + 72])
    np.testing.assert_allclose(predictions.error, wanted, rtol=0, atol=1e-9)
    np.testing.assert_allclose(predictions.initial, inputs.zone[starts])
    mae = np.mean([np.mean(np.abs(e)) for e in wanted])
    assert found.metrics.mae == pytest.approx(mae)
    assert found.metrics.bias == pytest.approx(np.mean(wanted))
    by_zone = found.by_zone()
    for z, zone in enumerate(model.network.zones):
        assert by_zone[zone]["mae"] == pytest.approx(np.abs(np.array(wanted)[:, z]).mean())
        assert by_zone[zone]["bias"] == pytest.approx(np.array(wanted)[:, z].mean())


def test_trajectories_end_in_the_targets_and_begin_near_the_start() -> None:
    _, model, inputs = setting()
    theta = model.network.start()
    short = evaluate_model(model, theta, inputs, [part(1200, 1400)])
    whole = evaluate_model(model, theta, inputs, [part(1200, 1400)], EvaluationSettings(trajectories=True))
    a, b = short.predictions[0], whole.predictions[0]
    assert b.simulated.shape == (a.simulated.shape[0], 72, 5)
    np.testing.assert_allclose(b.simulated[:, -1], a.simulated[:, -1], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(b.steps, np.arange(1, 73))
    assert np.abs(b.simulated[:, 0] - b.initial).mean() < np.abs(b.simulated[:, -1] - b.initial).mean()
    assert whole.metrics == short.metrics


def test_several_intervals_count_run_by_run() -> None:
    _, model, inputs = setting()
    theta = model.network.start()
    parts = [part(1000, 1100), part(1500, 1800)]
    both = evaluate_model(model, theta, inputs, parts)
    errors = [evaluate_model(model, theta, inputs, [p]).predictions[0].error for p in parts]
    assert len(both.predictions) == 2
    assert both.metrics.mae == pytest.approx(spatial_metrics(np.concatenate(errors)).mae)


def test_horizons_have_runs_of_their_own_and_only_multiples_of_the_step() -> None:
    _, model, inputs = setting()
    theta = model.network.start()
    found = evaluate_model(
        model, theta, inputs, [part(1200, 1700)], EvaluationSettings(horizons=(*HORIZONS, "7min", "1000h"))
    )
    assert list(found.by_horizon) == list(HORIZONS)
    assert found.by_horizon["6h"] == pytest.approx(found.metrics.mae)
    assert found.by_horizon["5min"] < found.by_horizon["1h"] < found.by_horizon["6h"]
    one = evaluate_model(model, theta, inputs, [part(1200, 1700)], EvaluationSettings("1h"))
    assert found.by_horizon["1h"] == pytest.approx(one.metrics.mae)
    assert one.steps == 12


def test_scheme_reaches_the_runs() -> None:
    _, model, inputs = setting()
    theta = model.network.start()
    errors = [
        evaluate_model(model, theta, inputs, [part(1200, 1300)], EvaluationSettings(**options)).predictions[0].error
        for options in ({}, {"scheme": TR_BDF2})
    ]
    assert 1e-6 < np.abs(errors[0] - errors[1]).max() < 0.2


def test_unmeasured_zone_is_left_out_of_errors_and_zones() -> None:
    _, model, inputs = setting()
    blind = {}
    for field in ("zone", "bridged", "held"):
        blind[field] = getattr(inputs, field).copy()
        blind[field][:, 2] = np.nan
    found = evaluate_model(model, model.network.start(), replace(inputs, **blind), [part(1200, 1300)])
    assert list(found.by_zone()) == [z for i, z in enumerate(model.network.zones) if i != 2]
    assert np.isnan(found.predictions[0].error[:, 2]).all()
    assert np.isfinite(found.metrics.mae)


def test_zone_that_is_missing_at_its_start_has_no_error() -> None:
    """It could not be matched: its error would be that of a guess."""
    _, model, inputs = setting()
    whole = evaluate_model(model, model.network.start(), inputs, [part(1200, 1300)])
    start = int(inputs.stamps.get_indexer(whole.predictions[0].start)[3])
    bridged = inputs.bridged.copy()
    bridged[start, 1] = np.nan
    found = evaluate_model(model, model.network.start(), replace(inputs, bridged=bridged), [part(1200, 1300)])
    missing = np.isnan(found.predictions[0].error)
    assert missing[3, 1]
    assert missing.sum() == 1


def test_interval_whose_runs_all_miss_telemetry_is_refused() -> None:
    _, model, inputs = setting()
    complete = inputs.complete.copy()
    complete[1100:1400] = False
    with pytest.raises(NotEnoughDataError, match="miss"):
        evaluate_model(model, model.network.start(), replace(inputs, complete=complete), [part(1200, 1300)])


def test_progress_counts_to_its_total() -> None:
    _, model, inputs = setting()
    told: list[tuple[str, int, int]] = []
    evaluate_model(model, model.network.start(), inputs, [part(1200, 1300), part(1400, 1500)], EvaluationSettings(horizons=("1h",)), progress=lambda *message: told.append(message))  # fmt: skip
    assert [done for _, done, _ in told] == [1, 2]
    assert {total for _, _, total in told} == {2}
