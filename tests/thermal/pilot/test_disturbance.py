"""Unmeasured heat against the theory of the Ornstein-Uhlenbeck process."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from thermal.errors import ThermalError
from thermal.pilot.weather import draw_disturbance

TIME = 3600.0  # s


@pytest.mark.parametrize("step", [60.0, 300.0, 1800.0])
def test_the_autocovariance_is_that_of_the_process(step: float) -> None:
    n_zone = 20000
    heat = draw_disturbance(1, 13, np.full(n_zone, 5.0), TIME, step)
    for first in (0, 6):  # the same at the start and later: stationary
        for lag in range(7):
            covariance = np.mean(heat[first] * heat[first + lag])
            expected = 25.0 * np.exp(-lag * step / TIME)
            assert covariance == pytest.approx(expected, abs=4.0 * 25.0 * np.sqrt(2.0 / n_zone)), (first, lag)


def test_it_is_gaussian_without_bias_and_independent_between_zones() -> None:
    heat = draw_disturbance(2, 2, np.full(20000, 2.0), TIME)
    for row in heat:
        assert stats.kstest(row / 2.0, "norm").pvalue > 1e-3
    assert abs(np.mean(heat[0, ::2] * heat[0, 1::2])) < 4.0 * 4.0 / np.sqrt(10000)


def test_the_spectrum_of_one_long_record() -> None:
    """Averages over time as well: ergodic, and of the process's integral ``2 σ² τ`` at frequency zero."""
    n_time, step = 400_000, 300.0
    heat = draw_disturbance(3, n_time, np.array([10.0]), TIME, step)[:, 0]
    assert heat.std() == pytest.approx(10.0, rel=0.03)
    blocks = heat.reshape(-1, 1000).sum(axis=1) * step  # 83 correlation times each
    keep = np.exp(-step / TIME)
    assert blocks.var() == pytest.approx(100.0 * step**2 * 1000 * (1.0 + keep) / (1.0 - keep), rel=0.2)


def test_each_zone_has_its_deviation_and_it_may_be_zero() -> None:
    heat = draw_disturbance(4, 50_000, np.array([0.0, 1.0, 30.0]), 600.0)
    assert (heat[:, 0] == 0.0).all()
    assert heat[:, 1:].std(axis=0) == pytest.approx([1.0, 30.0], rel=0.03)


def test_same_seed_same_heat() -> None:
    first, second, other = (draw_disturbance(seed, 5, np.ones(3), TIME) for seed in (7, 7, 8))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize(
    ("seed", "n_time", "deviation", "time", "step"),
    [
        (-1, 1, 1.0, TIME, 300.0),
        (0, 0, 1.0, TIME, 300.0),
        (0, 1, -1.0, TIME, 300.0),
        (0, 1, np.nan, TIME, 300.0),
        (0, 1, 1.0, 0.0, 300.0),
        (0, 1, 1.0, TIME, -1.0),
    ],
)
def test_what_is_no_process_is_refused(seed: int, n_time: int, deviation: float, time: float, step: float) -> None:
    with pytest.raises(ThermalError, match="deviations of 0 or more"):
        draw_disturbance(seed, n_time, np.array([deviation]), time, step)
