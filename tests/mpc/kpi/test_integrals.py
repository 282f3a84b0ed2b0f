"""Positive parts of straight lines, against quadrature."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mpc.kpi.record import excess

ENDS = st.floats(-50.0, 50.0).map(lambda value: round(value, 6))


@given(start=ENDS, end=ENDS)
def test_means_and_shares_by_quadrature(start: float, end: float) -> None:
    line = np.linspace(start, end, 20001)
    mean, share = excess(np.array([start]), np.array([end]))
    assert mean[0] == pytest.approx(np.trapezoid(np.maximum(line, 0.0), dx=1 / 20000), abs=1e-5)
    assert share[0] == pytest.approx((line > 0).mean(), abs=1e-3)


@given(start=ENDS, end=ENDS, cut=st.floats(0.0, 1.0))
def test_a_step_in_two_is_the_whole(start: float, end: float, cut: float) -> None:
    middle = start + cut * (end - start)
    whole = excess(np.array([start]), np.array([end]))
    parts = excess(np.array([start, middle]), np.array([middle, end]))
    for k in range(2):
        assert parts[k] @ [cut, 1.0 - cut] == pytest.approx(whole[k][0], abs=1e-8 if k == 0 else 1e-3)


def test_ends_worked_by_hand() -> None:
    mean, share = excess(np.array([2.0, -2.0, -1.0, 3.0, 0.0]), np.array([4.0, -1.0, 3.0, -1.0, 0.0]))
    assert mean == pytest.approx([3.0, 0.0, 1.125, 1.125, 0.0])
    assert share == pytest.approx([1.0, 0.0, 0.75, 0.75, 0.0])
