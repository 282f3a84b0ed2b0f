"""Predictor-corrector on telemetry: same runs and terms as the model alone, no look ahead, smaller errors."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import DisturbanceModel, Interval, evaluate_model, smooth, tune_disturbance
from calibration.errors import FilterError, NotEnoughDataError
from calibration.estimation.filtered import (
    BOUNDARY_SPREAD,
    ZONE_SPREAD,
    FilterSettings,
    evaluate_filter,
    filter_interval,
    start_spread,
)
from calibration.estimation.innovations import TuningSettings
from calibration.estimation.whiteness import whiteness
from calibration.evaluation.intervals import default_intervals
from calibration.evaluation.n_step import HORIZONS, EvaluationSettings, spatial_metrics
from thermal import (
    Inputs,
    SymbolicModel,
    build_network,
    free_runs,
    load_bundled_case,
    load_case,
    reduced_model,
    replay_inputs,
    spin_up,
)
from thermal.model.matrices import Matrices

FloatArray = NDArray[np.float64]

CASES = Path(__file__).parents[2].parent / "shared" / "cases"

DISTURBANCE = DisturbanceModel(150.0, 4 * 3600.0, 0.05)


@cache
def setting() -> tuple[SymbolicModel, Inputs]:
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    return reduced_model(grid, [grid.network.start()]), replay_inputs(load_bundled_case(), grid.network)


def part(first: int, last: int) -> Interval:
    stamps = setting()[1].stamps
    return Interval(stamps[first], stamps[last])


def test_runs_are_those_of_the_model_alone() -> None:
    model, inputs = setting()
    theta, parts = model.network.start(), [part(1000, 1150), part(1400, 1700)]
    alone = evaluate_model(model, theta, inputs, parts, EvaluationSettings(horizons=HORIZONS, trajectories=True))
    found = evaluate_filter(model, theta, inputs, parts, DISTURBANCE, EvaluationSettings(horizons=HORIZONS, trajectories=True))
    assert (found.steps, found.step_seconds, found.zones) == (alone.steps, alone.step_seconds, alone.zones)
    for a, b in zip(alone.predictions, found.predictions, strict=True):
        assert a.interval == b.interval
        assert a.skipped == b.skipped
        for name in ("start", "measured", "steps", "initial"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        assert a.simulated.shape == b.simulated.shape
    assert list(found.by_horizon) == list(alone.by_horizon)
    assert found.by_horizon["6h"] == pytest.approx(found.metrics.mae)
    short = evaluate_filter(model, theta, inputs, parts, DISTURBANCE, EvaluationSettings("1h"))
    assert short.metrics.mae == pytest.approx(found.by_horizon["1h"])
    np.testing.assert_allclose(
        evaluate_filter(model, theta, inputs, parts, DISTURBANCE).predictions[0].simulated[:, -1],
        found.predictions[0].simulated[:, -1],
    )


def test_without_a_disturbance_it_is_the_model_alone_from_its_first_spin_up() -> None:
    """No disturbance, and sensors that are worth nothing: a free run since the filter's start."""
    model, inputs = setting()
    theta = model.network.start()
    found = evaluate_filter(model, theta, inputs, [part(1400, 1500)], DisturbanceModel(0.0, 3600.0, 1e6))
    (predictions,) = found.predictions
    begin = 1400 - 864
    at = begin + 144
    matrices = model.matrices(theta)
    states, _ = spin_up(matrices, inputs, begin, np.array([at]))
    last = int(inputs.stamps.get_indexer(predictions.start)[-1])
    means, _ = free_runs(matrices, inputs, np.array([at]), last + 72 - at, states)
    np.testing.assert_allclose(predictions.simulated[-1, 0], means[0, -1], rtol=0, atol=1e-5)


def test_a_prediction_knows_nothing_of_what_comes_after_its_start() -> None:
    model, inputs = setting()
    theta, where = model.network.start(), [part(1400, 1600)]
    first = evaluate_filter(model, theta, inputs, where, DISTURBANCE).predictions[0]
    cut = int(inputs.stamps.get_indexer(first.start)[4])
    spoilt = {name: getattr(inputs, name).copy() for name in ("zone", "bridged", "held")}
    for values in spoilt.values():
        values[cut + 1 :] += 5.0
    second = evaluate_filter(model, theta, replace(inputs, **spoilt), where, DISTURBANCE).predictions[0]
    np.testing.assert_array_equal(first.simulated[:5], second.simulated[:5])
    assert np.abs(first.simulated[5] - second.simulated[5]).max() > 0.1


def test_it_predicts_better_than_the_model_alone() -> None:
    """The bundled case at its start parameters, an hour ahead, on the part that the disturbance was not tuned on."""
    model, inputs = setting()
    theta = model.network.start()
    tuned = tune_disturbance(model, theta, inputs, [part(300, 1100)])
    assert tuned.success
    alone = evaluate_model(model, theta, inputs, [part(1200, 1700)], EvaluationSettings("1h"))
    found = evaluate_filter(model, theta, inputs, [part(1200, 1700)], tuned.disturbance, EvaluationSettings("1h"))
    assert found.metrics.mae < 0.75 * alone.metrics.mae


def test_interval_is_filtered_from_its_beginning_where_there_is_telemetry_before() -> None:
    model, inputs = setting()
    theta = model.network.start()
    found = filter_interval(model, theta, inputs, part(1000, 1200), DISTURBANCE)
    assert (found.stamps[0], found.stamps[-1]) == (inputs.stamps[1000], inputs.stamps[1200])
    early = filter_interval(model, theta, inputs, part(0, 400), DISTURBANCE)
    assert early.stamps[0] == inputs.stamps[145]
    steady = filter_interval(model, theta, inputs, part(0, 400), DISTURBANCE, FilterSettings(covariance="steady"))
    assert steady.stamps[0] == inputs.stamps[145]
    steady = filter_interval(model, theta, inputs, part(0, 1600), DISTURBANCE, FilterSettings(covariance="steady"))
    assert steady.stamps[0] == inputs.stamps[534]


def test_grid_and_short_intervals_are_refused() -> None:
    model, inputs = setting()
    theta = model.network.start()
    grid = SymbolicModel(model.network)
    with pytest.raises(FilterError, match="expected a reduced model, found the grid"):
        filter_interval(grid, theta, inputs, part(1000, 1100), DISTURBANCE)
    with pytest.raises(FilterError, match="expected a reduced model, found the grid"):
        evaluate_filter(grid, theta, inputs, [part(1000, 1100)], DISTURBANCE)
    with pytest.raises(FilterError, match="room for a step after 12 h"):
        filter_interval(model, theta, inputs, part(0, 100), DISTURBANCE)
    broken = replace(inputs, complete=np.arange(len(inputs)) < 1000)
    with pytest.raises(NotEnoughDataError, match="miss telemetry"):
        evaluate_filter(model, theta, broken, [part(1200, 1300)], DISTURBANCE)


def test_progress_counts_intervals() -> None:
    model, inputs = setting()
    told: list[tuple[str, int, int]] = []
    evaluate_filter(model, model.network.start(), inputs, [part(1200, 1300)], DISTURBANCE, EvaluationSettings(horizons=("1h", "7min", "1000h")), progress=lambda *message: told.append(message))  # fmt: skip
    assert told == [("predict", 1, 1)]


@pytest.mark.parametrize(("name", "share"), [("practice_solar_gain", 0.6), ("twinhouse_N2_exp1", 0.8)])
def test_cases_of_others_at_their_start_parameters(name: str, share: float) -> None:
    """Six hours ahead on the last third, with the disturbance tuned on two days before it."""
    if not (CASES / name).is_dir():
        pytest.skip(f"the shared case is not here: {CASES / name}")
    case = load_case(CASES / name)
    grid = SymbolicModel(build_network(case.building))
    theta = grid.network.start()
    model, inputs = reduced_model(grid, [theta]), replay_inputs(case, grid.network)
    tuning, held_out = default_intervals(case)
    days = Interval(tuning[0].end - np.timedelta64(2, "D"), tuning[0].end)
    tuned = tune_disturbance(model, theta, inputs, [days], TuningSettings(time_constant=86400.0))
    alone = evaluate_model(model, theta, inputs, held_out).metrics.mae
    found = evaluate_filter(model, theta, inputs, held_out, tuned.disturbance).metrics.mae
    assert found < share * alone
    filtered = filter_interval(model, theta, inputs, days, tuned.disturbance)
    spoken = whiteness(filtered, model.network.zones, inputs, boundaries=model.network.boundaries)
    assert spoken.zones[model.network.zones[0]].count > 200
    low, high = smooth(filtered).band()
    assert (low < high).all()


def test_directed_airflows_are_in_the_prediction() -> None:
    """The predictor of a house with directed air, from the model's own state: the steps of the model alone."""
    name = "twinhouse_N2_exp1"
    if not (CASES / name).is_dir():
        pytest.skip(f"the shared case is not here: {CASES / name}")
    case = load_case(CASES / name)
    grid = SymbolicModel(build_network(case.building))
    theta = grid.network.start()
    model, inputs = reduced_model(grid, [theta]), replay_inputs(case, grid.network)
    where = [Interval(inputs.stamps[1000], inputs.stamps[1100])]
    found = evaluate_filter(model, theta, inputs, where, DisturbanceModel(0.0, 3600.0, 1e6), EvaluationSettings("2h"))
    at, starts = 1000 - 3 * 144 + 72, inputs.stamps.get_indexer(found.predictions[0].start)
    matrices = model.matrices(theta)
    states, _ = spin_up(matrices, inputs, 1000 - 3 * 144, np.array([at]))
    steps = int(starts[0]) + 12 - at
    means, _ = free_runs(matrices, inputs, np.array([at]), steps, states)
    assert np.abs(found.predictions[0].simulated[0, 0] - means[0, -1]).max() < 2e-3
    assert spatial_metrics(found.predictions[0].error).mae > 0


# What a spin-up leaves unknown, against the runs of the model with its zones held


ALL = np.ones(5, dtype=bool)


@cache
def matrices() -> Matrices:
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    return reduced_model(grid, [grid.network.start()]).matrices(grid.network.start())


def test_it_begins_with_steady_states_of_other_temperatures() -> None:
    modes = matrices().modal.modes
    columns = start_spread(modes, 300.0, 0, ALL)
    wanted = np.hstack([ZONE_SPREAD * np.eye(5), np.zeros((5, 1))])
    np.testing.assert_allclose(modes.observation @ columns, wanted, atol=1e-8)
    # what is not balanced in a steady state is heat given to zones
    flow = modes.conductance[:, None] * columns
    flow[:, -1] -= BOUNDARY_SPREAD * modes.boundary[:, 0]
    _, rest, _, _ = np.linalg.lstsq(modes.heating, flow, rcond=None)
    assert np.sqrt(rest).max() < 1e-6 * np.abs(flow).max()


@pytest.mark.parametrize("steps", [1, 20])
def test_it_decays_as_in_a_spin_up(steps: int) -> None:
    """The library's own runs with held zones, from the same states."""
    m = matrices()
    modes = m.modal.modes
    first, found = (start_spread(modes, 300.0, n, ALL) for n in (0, steps))
    still = [np.zeros((steps, n)) for n in (modes.boundary.shape[1], 5, 5)]
    for column, wanted in zip(first.T, found.T, strict=True):
        kept, _ = m.modal.hold(modes.states @ column[:, None], *still, np.array([steps - 1]), 300.0)
        scale = np.abs(first).max()
        np.testing.assert_allclose(modes.coordinates @ kept[:, 0], wanted, rtol=0, atol=1e-9 * scale)


def test_days_of_spin_up_leave_little() -> None:
    modes = matrices().modal.modes
    walls = [np.linalg.norm(modes.states @ start_spread(modes, 300.0, n, ALL)) for n in (1, 144, 864)]
    assert walls[0] > 2.0 * walls[1] > 6.0 * walls[2]


def test_zones_without_a_sensor_stay_free() -> None:
    held = ALL.copy()
    held[3] = False
    found = start_spread(matrices().modal.modes, 300.0, 10, held)
    assert found.shape[1] == 5
    assert np.isfinite(found).all()
    np.testing.assert_allclose((matrices().modal.modes.observation @ found)[held], 0.0, atol=1e-8)
