"""Balance of heat: a model needs exactly the heat that its own simulation was given, and statistics worked by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration import Interval
from calibration.estimation.heat_balance import HeatBalance, _heat_fit, _needed_heat, heat_balance
from thermal import Case, Inputs, SymbolicModel, build_network, load_bundled_case, reduced_model, replay_inputs
from thermal.model.matrices import Matrices
from thermal.model.modal_runs import ModalRuns
from thermal.model.step import Stepper
from thermal.units import AIR_HEAT_CAPACITY

QUIET = 300  # steps at one temperature everywhere, so that the steady start of a spin-up is exact
LENGTH = 600
LEVEL = 293.15 + 2.0  # K


@pytest.fixture(scope="module")
def case() -> Case:
    return load_bundled_case()


@pytest.fixture(scope="module")
def grid(case: Case) -> SymbolicModel:
    return SymbolicModel(build_network(case.building, dx=1.0))


def replayed(matrices: Matrices, real: Inputs, airflows: tuple[tuple[int, int], ...] = ()) -> Inputs:
    """Inputs whose zone temperatures are those at the ends of a simulation's steps."""
    rng = np.random.default_rng(3)
    n_zone, n_boundary = real.heat.shape[1], real.boundary.shape[1]
    heat = np.where(np.arange(LENGTH)[:, None] < QUIET, 0.0, rng.normal(500.0, 400.0, (LENGTH, n_zone)))
    boundary = np.full((LENGTH, n_boundary), LEVEL)
    boundary[QUIET:] += np.cumsum(rng.normal(size=(LENGTH - QUIET, n_boundary)), axis=0)
    airflow = rng.uniform(0.01, 0.05, (LENGTH, len(airflows)))
    stepper = Stepper(replace(matrices, airflows=airflows), real.step)
    states = LEVEL * matrices.uniform[:, None]
    zone = np.empty((LENGTH, n_zone))
    for k in range(LENGTH):
        states, *_ = stepper.advance(states, boundary[k][:, None], heat[k][:, None], airflow[k][:, None])
        zone[k] = np.asarray(matrices.observation @ states)[:, 0]
    complete = np.ones(LENGTH, dtype=bool)
    return Inputs(real.stamps[:LENGTH], real.step, heat, boundary, airflow, zone, zone, zone, complete)


@pytest.mark.parametrize("kind", ["reduced", "grid"])
def test_a_model_needs_the_heat_that_its_own_simulation_was_given(case: Case, grid: SymbolicModel, kind: str) -> None:
    theta = grid.network.start()
    model: SymbolicModel = reduced_model(grid, [theta]) if kind == "reduced" else grid
    matrices = model.matrices(theta)
    inputs = replayed(matrices, replay_inputs(case, grid.network))
    rows = np.arange(QUIET - 5, LENGTH)
    np.testing.assert_allclose(_needed_heat(matrices, inputs, 0, rows), inputs.heat[rows], atol=1e-4)


def test_air_between_zones_is_no_heat_of_theirs(case: Case, grid: SymbolicModel) -> None:
    theta, airflows = grid.network.start(), ((0, 1), (1, 2))
    matrices = reduced_model(grid, [theta]).matrices(theta)
    inputs = replayed(matrices, replay_inputs(case, grid.network), airflows)
    rows = np.arange(QUIET, LENGTH)
    np.testing.assert_allclose(_needed_heat(matrices, inputs, 0, rows, airflows), inputs.heat[rows], atol=1e-4)
    still = _needed_heat(matrices, inputs, 0, rows)  # without, what the air brings is missing
    brought = AIR_HEAT_CAPACITY * inputs.airflow[rows, 0] * (inputs.zone[rows, 0] - inputs.zone[rows, 1])
    np.testing.assert_allclose(still[:, 1] - inputs.heat[rows, 1], brought, atol=1e-4)


def test_an_unmeasured_zone_needs_what_it_was_given(case: Case, grid: SymbolicModel) -> None:
    theta = grid.network.start()
    matrices = reduced_model(grid, [theta]).matrices(theta)
    inputs = replayed(matrices, replay_inputs(case, grid.network))
    blind = inputs.held.copy()
    blind[:, 2] = np.nan
    rows = np.arange(QUIET, LENGTH)
    found = _needed_heat(matrices, replace(inputs, held=blind), 0, rows)
    np.testing.assert_allclose(found, inputs.heat[rows], atol=1e-4)


def test_hours_with_a_gap_are_left_out(case: Case, grid: SymbolicModel) -> None:
    theta = grid.network.start()
    model = reduced_model(grid, [theta])
    inputs = replayed(model.matrices(theta), replay_inputs(case, grid.network))
    zone, complete = inputs.zone.copy(), inputs.complete.copy()
    gap, dark = QUIET + 100, QUIET + 160
    zone[gap, 1] = np.nan
    complete[dark] = False
    stamps = inputs.stamps
    given = replace(inputs, zone=zone, complete=complete)
    found = heat_balance(model, theta, given, [Interval(stamps[QUIET], stamps[-1])])
    assert isinstance(model.matrices(theta).modal, ModalRuns) and found.zones == grid.network.zones
    assert (found.stamps.minute == 0).all() and len(found.stamps) == (LENGTH - QUIET) // 12
    hours = [(stamps[k] - pd.Timedelta(seconds=inputs.step)).floor("h") for k in (gap, gap + 1, dark)]
    missing = np.isnan(found.needed)
    assert set(found.stamps[missing[:, 1]]) == set(hours)
    assert set(found.stamps[missing[:, 0]]) == {hours[2]}
    row = int(np.flatnonzero(~missing.any(axis=1))[0])
    steps = stamps - pd.Timedelta(seconds=inputs.step)
    mine = (steps >= found.stamps[row]) & (steps < found.stamps[row] + pd.Timedelta("1h"))
    np.testing.assert_allclose(found.metered[row], inputs.heat[mine].mean(axis=0))
    np.testing.assert_allclose(found.needed[row], found.metered[row], atol=1e-4)


def test_statistics_by_hand() -> None:
    metered, needed = np.array([100.0, 200.0, 300.0, np.nan]), np.array([110.0, 180.0, 280.0, 5.0])
    found = _heat_fit(metered, needed, fewest=3)
    assert found is not None and (found.count, found.mean) == (3, 200.0)
    assert found.nmbe == pytest.approx((-10.0 + 20.0 + 20.0) / (2 * 200.0))
    assert found.cv_rmse == pytest.approx(np.sqrt((100.0 + 400.0 + 400.0) / 2) / 200.0)
    assert found.met
    cooled = _heat_fit(-metered, -needed, fewest=3)  # metered minus needed, over the size of the mean
    assert cooled is not None and cooled.nmbe == pytest.approx(-found.nmbe)
    assert not replace(found, nmbe=-0.11).met and not replace(found, cv_rmse=0.31).met


def test_a_mean_near_zero_has_no_ratio() -> None:
    there_and_back = np.tile([1000.0, -990.0], 50)
    assert _heat_fit(there_and_back, there_and_back) is None
    assert _heat_fit(np.zeros(100), np.ones(100)) is None
    assert _heat_fit(np.ones(23), np.ones(23)) is None
    fits = HeatBalance(
        pd.date_range("2023-01-01", periods=100, freq="h", tz="UTC"),
        ("a", "b", "c"),
        np.column_stack([there_and_back, np.full(100, 50.0), np.full(100, 7.0)]),
        np.column_stack([there_and_back, np.full(100, 60.0), np.full(100, np.nan)]),
    )
    by_zone = fits.by_zone()
    assert by_zone["a"] is None and by_zone["c"] is None
    assert by_zone["b"] is not None and by_zone["b"].nmbe == pytest.approx(-10.0 / 50.0 * 100 / 99)
    np.testing.assert_allclose(fits.building()[0], there_and_back + 50.0)  # the unmeasured zone counts on neither side
