"""Gains: followed where sensors or inputs are missing, steady where they may be, and shortcuts that hardly differ."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration import DisturbanceModel, KalmanFilter, StateSpace
from calibration.estimation.kalman import Filtered
from thermal import Inputs

FloatArray = NDArray[np.float64]

REFERENCE = 293.15
STEP = 300.0
START = np.full((9, 1), REFERENCE)


Simulate = Callable[..., tuple[Inputs, FloatArray]]
Gaps = Callable[[Inputs], Inputs]

DISTURBANCE = DisturbanceModel(np.array([150.0, 60.0, 100.0]), 3600.0, np.array([0.05, 0.1, 0.07]))


# Shortcuts


def test_steady_covariance_is_taken_up_again_within_the_tolerance(
    building: StateSpace, simulate: Simulate, gaps: Gaps
) -> None:
    """Walls forget a gap in days: 4000 steps after it the covariance has been steady for long."""
    space = building
    inputs = gaps(simulate(4000, 2)[0])
    exact, usual, loose = (
        KalmanFilter(space, DISTURBANCE, tolerance=t).filter(inputs, 0, 4000, START) for t in (0.0, 1e-8, 1e-5)
    )
    assert len(exact.gains) == 3992
    assert len(loose.gains) < 200 < len(usual.gains) < 2000
    for found, kelvin, watts, likelihood in ((usual, 1e-6, 1e-2, 1e-3), (loose, 1e-3, 1.0, 0.1)):
        assert np.abs(found.zone - exact.zone).max() < kelvin
        assert np.abs(found.disturbance - exact.disturbance).max() < watts
        assert found.log_likelihood == pytest.approx(exact.log_likelihood, abs=likelihood)


def test_complete_data_need_one_gain(building: StateSpace, simulate: Simulate) -> None:
    space = building
    found = KalmanFilter(space, DISTURBANCE).filter(simulate(300, 2)[0], 0, 300, START)
    assert len(found.gains) == 1


def test_steady_gains_hardly_differ_over_short_gaps(building: StateSpace, simulate: Simulate) -> None:
    space = building
    inputs = simulate(600, 4)[0]
    zone = inputs.zone.copy()
    zone[np.random.default_rng(0).random(zone.shape) < 0.02] = np.nan
    inputs = replace(inputs, zone=zone)
    exact = KalmanFilter(space, DISTURBANCE).filter(inputs, 0, 600, START)
    steady = KalmanFilter(space, DISTURBANCE, covariance="steady").filter(inputs, 0, 600, START)
    assert len(steady.gains) < 10
    assert np.abs(steady.zone - exact.zone).max() < 0.1
    assert np.sqrt(np.mean((steady.zone - exact.zone) ** 2)) < 0.005
    known = inputs.complete.copy()
    known[200:210] = False
    held = replace(inputs, complete=known)
    a, b = (KalmanFilter(space, DISTURBANCE, covariance=c).filter(held, 0, 600, START) for c in ("exact", "steady"))
    assert np.abs(a.zone[195:230] - b.zone[195:230]).max() < 0.2


# What is not measured


def test_nothing_that_is_estimated_is_nan(building: StateSpace, simulate: Simulate, gaps: Gaps) -> None:
    space = building
    inputs = gaps(simulate(200, 5)[0])
    zone = inputs.zone.copy()
    zone[:, 1] = np.nan
    found = KalmanFilter(space, DISTURBANCE).filter(replace(inputs, zone=zone), 0, 200, START)
    assert list(found.measured) == [True, False, True]
    for name in Filtered.__dataclass_fields__:
        value = getattr(found, name)
        if isinstance(value, np.ndarray) and name != "innovations":
            assert np.isfinite(value).all(), name
    assert np.isnan(found.innovations[:, 1]).all()
    np.testing.assert_allclose(found.disturbance_deviation[:, 1], 60.0, rtol=0.05)


def test_unknown_heat_does_not_mislead_the_filter(building: StateSpace, simulate: Simulate) -> None:
    """4 kW that no meter reports for two hours: the zone is followed all the same, and forgotten soon after."""
    space = building
    made, truth = simulate(400, 6)
    heat = made.heat.copy()
    heat[:, 0] += 2000.0 * (np.arange(401) % 100 < 50)  # the zone's heat varies by kilowatts
    plant, x = made.zone.copy(), np.zeros(space.order)
    extra = np.zeros((401, 3))
    extra[200:224, 0] = 4000.0
    for k in range(1, 401):
        u = space.drives(made.boundary[k], heat[k] + extra[k] + truth[k - 1])
        plant[k] = space.observation @ x + space.feedthrough @ u + REFERENCE
        x = space.advance(x) + space.drive @ u
    known = made.complete.copy()
    known[200:224] = False
    inputs = replace(made, heat=heat, zone=plant, complete=known)
    found = KalmanFilter(space, DISTURBANCE).filter(inputs, 0, 400, START)
    assert np.abs(found.zone[199:223] - plant[200:224]).max() < 0.15
    assert np.isnan(found.innovations[199:223]).all()
    assert np.abs(found.disturbance[235:260, 0] - truth[235:260, 0]).max() < 250.0
    blind = KalmanFilter(space, DISTURBANCE).filter(replace(inputs, complete=made.complete), 0, 400, START)
    assert np.abs(blind.zone[199:223] - plant[200:224]).max() > 0.5
