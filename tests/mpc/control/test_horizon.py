"""Steps, blocks, and plans that are carried over."""

from __future__ import annotations

import numpy as np
import pytest

from mpc.control.problem.horizon import Horizon
from mpc.errors import ControlError


def test_a_shifted_plan_keeps_its_integral_and_its_end() -> None:
    ahead = Horizon.regular(2.0, 300.0, blocks=4)
    plan = np.array([[1.0], [2.0], [4.0], [8.0]])
    half = ahead.shifted(plan, 900.0)
    np.testing.assert_allclose(half.ravel(), [1.5, 3.0, 6.0, 8.0])
    np.testing.assert_allclose(ahead.shifted(plan, 0.0), plan)
    np.testing.assert_allclose(ahead.shifted(plan, 1e6), 8.0)


def test_blocks_of_unequal_steps() -> None:
    ahead = Horizon.growing([(1.0, 300.0), (2.0, 900.0)], [0.5, 0.5, 1.0, 1.0])
    assert len(ahead) == 20 and ahead.n_block == 4
    np.testing.assert_allclose(ahead.block_starts, [0.0, 1800.0, 3600.0, 7200.0])
    assert np.bincount(ahead.block_of).tolist() == [6, 6, 4, 4]


@pytest.mark.parametrize(
    ("steps", "first", "control", "said"),
    [
        ([300.0, -1.0], [0], 300.0, "steps"),
        ([7200.0], [0], 7200.0, "steps"),
        ([300.0, 300.0], [1], 300.0, "first_steps"),
        ([300.0, 300.0], [0, 1], 600.0, "control_step"),
        ([300.0, 300.0], [0], 200.0, "control_step"),
    ],
)
def test_what_does_not_fit_is_refused(steps: list[float], first: list[int], control: float, said: str) -> None:
    with pytest.raises(ControlError, match=said):
        Horizon(np.array(steps), np.array(first), control)
