"""Plans by trial: near the optimum of a case that is solved exactly, within ranges, the same with the same seed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from mpc.control.solvers.sampling import CrossEntropy
from mpc.errors import ControlError


def linear_quadratic() -> tuple[np.ndarray, np.ndarray]:
    """A room that leaks, heated from 0 to 1 over eight steps: least squares of ``A u - b``.

    ``x+ = 0.9 x + 0.5 u`` from 0 shall be at 2 at the end of each step; a unit of heat costs as 0.1 of the state.
    """
    steps = np.arange(8)
    reached = np.where(steps[:, None] >= steps, 0.5 * 0.9 ** np.maximum(steps[:, None] - steps, 0), 0.0)
    return np.vstack([reached, 0.1 * np.eye(8)]), np.concatenate([np.full(8, 2.0), np.zeros(8)])


def costs(shares: np.ndarray) -> np.ndarray:
    a, b = linear_quadratic()
    return np.asarray(((shares @ a.T - b) ** 2).sum(axis=1))


def test_the_optimum_of_a_linear_quadratic_case() -> None:
    a, b = linear_quadratic()
    exact = lsq_linear(a, b, bounds=(0.0, 1.0)).x
    assert exact.max() == pytest.approx(1.0) and exact.min() < 0.9  # some of the limits are active, not all
    lowest = float(costs(exact[None])[0])
    start = np.full(8, 0.2)
    found = CrossEntropy(samples=256, rounds=25).minimise(costs, start, np.random.default_rng(0))
    assert found.start == pytest.approx(float(costs(start[None])[0])) and found.start > 1.5 * lowest
    assert lowest <= found.cost <= 1.02 * lowest
    assert found.cost == pytest.approx(float(costs(found.decisions[None])[0]))


def test_decisions_stay_in_their_ranges() -> None:
    seen: list[np.ndarray] = []

    def watched(shares: np.ndarray) -> np.ndarray:
        seen.append(shares)
        return np.asarray(-shares.sum(axis=1))  # the best lies in a corner

    found = CrossEntropy(samples=64, rounds=15).minimise(watched, np.full(3, 0.5), np.random.default_rng(1))
    every = np.vstack(seen)
    assert every.min() >= 0.0 and every.max() <= 1.0
    assert found.decisions == pytest.approx([1.0, 1.0, 1.0], abs=0.02)


def test_the_same_seed_finds_the_same() -> None:
    found = [CrossEntropy().minimise(costs, np.full(8, 0.2), np.random.default_rng(k)) for k in (5, 5, 6)]
    np.testing.assert_array_equal(found[0].decisions, found[1].decisions)
    assert np.abs(found[0].decisions - found[2].decisions).max() > 1e-6


def test_what_has_no_cost_is_never_chosen() -> None:
    def broken(shares: np.ndarray) -> np.ndarray:
        return np.where(shares[:, 0] > 0.5, np.nan, -shares[:, 0])

    found = CrossEntropy().minimise(broken, np.full(1, 0.2), np.random.default_rng(0))
    assert np.isfinite(found.cost) and 0.4 < found.decisions[0] <= 0.5


def test_impossible_settings_are_refused() -> None:
    with pytest.raises(ControlError, match="4 samples"):
        CrossEntropy(samples=1)
    with pytest.raises(ControlError, match="elite"):
        CrossEntropy(elite=0.9)
