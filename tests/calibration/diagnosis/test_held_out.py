"""Growth of held-out errors between two models, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.diagnosis._held_out import HeldOut, growth


def errors(days: list[int], daily: list[float], weight: list[float]) -> HeldOut:
    return HeldOut(np.array(days), np.array(daily), np.array(weight))


def test_growth_and_its_standard_error_from_days_that_both_have() -> None:
    before = errors([1, 2, 3, 9], [0.2, 0.4, 0.3, 5.0], [24.0, 24.0, 24.0, 24.0])
    after = errors([0, 1, 2, 3], [9.0, 0.3, 0.4, 0.5], [24.0, 24.0, 24.0, 24.0])
    grown, error = growth(before, after)
    assert grown == pytest.approx(0.1)
    assert error == pytest.approx(0.1 / np.sqrt(3.0))  # differences 0.1, 0.0, 0.2: deviation 0.1


def test_days_with_few_runs_count_less_and_one_day_has_no_error() -> None:
    before = errors([1, 2], [0.2, 0.2], [30.0, 10.0])
    grown, error = growth(before, errors([1, 2], [0.2, 0.6], [30.0, 10.0]))
    assert grown == pytest.approx(0.1)
    assert error == pytest.approx(np.sqrt(2.0 * ((0.75 * 0.1) ** 2 + (0.25 * 0.3) ** 2)))
    assert growth(before, errors([2], [0.5], [10.0])) == (pytest.approx(0.3), 0.0)
