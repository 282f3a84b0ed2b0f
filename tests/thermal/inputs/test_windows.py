"""Air through open windows: by wind alone, by warmth alone, and by both."""

import doctest

import numpy as np
import pytest

from thermal.inputs import windows
from thermal.inputs.windows import across, on_one_side


def test_wind_and_warmth_add_as_pressures_do() -> None:
    wind, warmth = np.array([0.0, 3.0, 3.0]), np.array([12.0, 0.0, -12.0])
    by_warmth, by_wind, by_both = across(wind, warmth)
    assert by_both == pytest.approx(np.hypot(by_warmth, by_wind))
    assert by_warmth == pytest.approx(0.65 * np.sqrt(2.0 * 9.80665 * 0.5 * 12.0 / 285.0))
    assert across(np.array(6.0), np.array(0.0)) == pytest.approx(2.0 * by_wind)


def test_on_one_side_air_moves_without_wind_and_warmth() -> None:
    assert on_one_side(np.array(0.0), np.array(0.0)) == pytest.approx(0.05)
    assert on_one_side(np.array(5.0), np.array(-9.0)) == on_one_side(np.array(5.0), np.array(9.0))
    assert (across(np.full(3, 4.0), np.arange(3.0)) > on_one_side(np.full(3, 4.0), np.arange(3.0))).all()


def test_examples() -> None:
    assert doctest.testmod(windows).failed == 0
