import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.operations import CasadiOperations, FloatOperations, NumpyOperations, StepOperations
from thermal.errors import ModelError

KINDS = (FloatOperations, NumpyOperations, CasadiOperations)
NUMBERS = st.floats(-1e3, 1e3)
WIDTHS = st.floats(1e-3, 0.5)


def number(value):
    return float(casadi.DM(value)) if isinstance(value, casadi.DM | casadi.SX) else float(value)


@pytest.mark.parametrize("kind", KINDS)
@given(x=NUMBERS, y=NUMBERS)
def test_without_a_width_the_kinks_are_exact(kind, x, y):
    ops = kind()
    assert number(ops.maximum(casadi.DM(x) if kind is CasadiOperations else x, y)) == max(x, y)
    assert number(ops.minimum(casadi.DM(x) if kind is CasadiOperations else x, y)) == min(x, y)
    low, high = min(x, y), max(x, y)
    assert number(ops.clip(casadi.DM(0.0) if kind is CasadiOperations else 0.0, low, high)) == min(max(0.0, low), high)
    assert number(ops.step(casadi.DM(x) if kind is CasadiOperations else x)) == float(x > 0.0)


@given(x=NUMBERS, y=NUMBERS, width=WIDTHS, scale=st.floats(0.1, 100.0))
def test_smoothing_errs_by_no_more_than_half_its_width(x, y, width, scale):
    ops, bound = FloatOperations(width), 0.5 * width * scale + 1e-9
    assert -1e-9 <= ops.maximum(x, y, scale) - max(x, y) <= bound
    assert -1e-9 <= min(x, y) - ops.minimum(x, y, scale) <= bound
    assert ops.positive(x, scale) == ops.maximum(x, 0.0, scale)


@given(a=st.floats(1e-9, 1e4), b=st.floats(1e-9, 1e4), width=WIDTHS)
def test_the_lesser_of_positive_values_is_positive(a, b, width):
    assert 0.0 < FloatOperations(width).lesser(a, b) <= min(a, b) * (1.0 + 1e-9)
    assert FloatOperations(width).lesser(a, b) >= (1.0 - width) * min(a, b) - 1e-9 * max(a, b)
    assert FloatOperations().lesser(a, b) == min(a, b)


@given(a=st.floats(1e-6, 1e4), b=st.floats(1e-6, 1e4), width=WIDTHS)
def test_values_in_order_keep_their_sum(a, b, width):
    for kind in KINDS:
        x, y = (casadi.DM(a), casadi.DM(b)) if kind is CasadiOperations else (a, b)
        assert tuple(map(number, kind().ordered(x, y))) == pytest.approx((min(a, b), max(a, b)), rel=1e-9, abs=1e-12)
        least, most = map(number, kind(width).ordered(x, y))
        assert 0.0 < least <= most * (1.0 + 1e-9)
        assert least + most == pytest.approx(a + b, rel=1e-12)


@given(a=st.floats(0.0, 1e4), b=st.floats(1e-6, 1e4), width=WIDTHS, scale=st.floats(0.1, 100.0))
def test_what_is_capped_is_never_negative_and_never_above(a, b, width, scale):
    ops = FloatOperations(width)
    assert 0.0 <= ops.capped(a, b, scale) <= min(a, b) * (1.0 + 1e-12)
    assert ops.capped(0.0, b, scale) == 0.0
    assert min(a, b) - ops.capped(a, b, scale) <= 0.5 * width * scale * (1.0 + 1e-9) + 1e-9
    assert FloatOperations().capped(a, b) == float(NumpyOperations().capped(a, b)) == min(a, b)


@given(x=NUMBERS, low=NUMBERS, span=st.floats(0.0, 100.0), width=WIDTHS)
def test_a_smooth_clip_keeps_its_limits(x, low, span, width):
    ops, exact = FloatOperations(width), min(max(x, low), low + span)
    assert low - 1e-9 <= ops.clip(x, low, low + span) <= low + span + 1e-9
    assert abs(ops.clip(x, low, low + span) - exact) <= 0.5 * width + 1e-9


@given(x=st.floats(-100.0, 100.0).filter(lambda x: abs(x) > 1e-3), width=WIDTHS)
def test_a_smooth_step_errs_by_the_square_of_its_width(x, width):
    value = FloatOperations(width).step(x)
    assert 0.0 <= value <= 1.0
    assert abs(value - float(x > 0.0)) <= width**2 / (4.0 * x**2) + 1e-12


@pytest.mark.parametrize("name", ["maximum", "minimum"])
def test_the_smooth_functions_of_all_kinds_agree(name):
    values = np.linspace(-1.0, 1.0, 7)
    for a in values:
        expected = getattr(FloatOperations(0.1), name)(a, 0.2)
        assert float(getattr(NumpyOperations(0.1), name)(a, 0.2)) == pytest.approx(expected, abs=1e-15)
        assert float(getattr(CasadiOperations(0.1), name)(casadi.DM(a), 0.2)) == pytest.approx(expected, abs=1e-15)


def test_a_step_has_floats_for_what_there_is_one_of():
    ops = StepOperations()
    members = np.eye(2)[[0, 1, 1]]
    assert ops.sums(np.array([1.0, 2.0, 3.0]), members) == [1.0, 5.0]
    assert ops.spread([1.0, 2.0], np.array([0, 1, 1])).tolist() == [1.0, 2.0, 2.0]
    assert isinstance(ops.dot(np.ones(3), np.ones(3)), float)
    assert isinstance(ops.scalar, FloatOperations)


def test_a_width_out_of_range_is_refused():
    with pytest.raises(ModelError, match=r"expected a share from 0 \(exact\) to 0.5, found 0.7"):
        FloatOperations(0.7)
