"""Whitening: the filter's own likelihood and innovations, linear, and blind to what is not measured."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import DisturbanceModel, Interval
from calibration.estimation.filtered import FilterSettings, filter_interval
from calibration.estimation.gains import Covariance
from calibration.estimation.innovations import ROUGH_TOLERANCE
from calibration.fit.likelihood import Whitening, whitening
from thermal import (
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

FloatArray = NDArray[np.float64]

DISTURBANCE = DisturbanceModel(120.0, 3600.0, 0.06)


@cache
def model() -> ReducedModel:
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    return reduced_model(grid, [grid.network.start()])


@cache
def telemetry(gaps: bool = False) -> Inputs:
    inputs = replay_inputs(load_bundled_case(), model().network)
    if not gaps:
        return inputs
    zone = inputs.zone.copy()
    zone[310:330, 1] = zone[400, 0] = np.nan
    zone[450:455] = np.nan
    return replace(inputs, zone=zone)


def interval() -> Interval:
    return Interval(telemetry().stamps[300], telemetry().stamps[560])


def made(gaps: bool = False, covariance: Covariance = "exact") -> Whitening:
    theta = model().network.start()
    settings = FilterSettings(covariance=covariance, tolerance=ROUGH_TOLERANCE)
    return whitening(model(), theta, telemetry(gaps), interval(), DISTURBANCE, settings)


def errors_of_a_free_run(white: Whitening, inputs: Inputs) -> FloatArray:
    theta = model().network.start()
    matrices, starts = model().matrices(theta), np.array([white.at])
    states, _ = spin_up(matrices, inputs, white.begin, starts)
    means, _ = free_runs(matrices, inputs, starts, white.stop - white.at, states)
    return np.asarray(inputs.zone[white.at + 1 : white.stop + 1] - means[0])[..., None]


@pytest.mark.parametrize("gaps", [False, True])
@pytest.mark.parametrize("covariance", ["exact", "steady"])
def test_squares_of_whitened_errors_make_the_filter_s_likelihood(gaps: bool, covariance: Covariance) -> None:
    """-2 log L = Σ r² + Σ log det S + n log 2π, r from a run that nothing corrects."""
    white, inputs = made(gaps, covariance), telemetry(gaps)
    found = white(errors_of_a_free_run(white, inputs))
    filtered = filter_interval(
        model(), model().network.start(), inputs, interval(), DISTURBANCE, FilterSettings(covariance=covariance)
    )
    determinants = sum(filtered.gains[g].log_determinant for g in filtered.gain_of)
    wanted = -2.0 * white.log_likelihood - determinants - white.measured.sum() * np.log(2.0 * np.pi)
    assert found.shape == (white.measured.sum(), 1)
    assert np.sum(found**2) == pytest.approx(wanted, rel=1e-4)  # gains follow to another tolerance in each


def test_whitening_is_linear_and_takes_columns_one_by_one() -> None:
    white = made(gaps=True)
    rng = np.random.default_rng(0)
    columns = rng.standard_normal((*white.measured.shape, 3))
    together = white(columns)
    for j in range(3):
        np.testing.assert_allclose(together[:, [j]], white(columns[..., [j]]), atol=1e-9)
    mixed = columns @ np.array([[1.0], [-2.0], [0.5]])
    np.testing.assert_allclose(white(mixed), together @ np.array([[1.0], [-2.0], [0.5]]), atol=1e-8)


def test_what_is_not_measured_does_not_matter() -> None:
    white = made(gaps=True)
    errors = errors_of_a_free_run(white, telemetry(gaps=True))
    assert np.isnan(errors).any()
    filled = np.where(white.measured[..., None], errors, 1e6)
    np.testing.assert_array_equal(white(errors), white(filled))
