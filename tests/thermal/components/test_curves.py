import pytest

from thermal.components.curves import (
    CONDENSING_BOILER,
    DX_CAPACITY,
    DX_INPUT,
    FAN_PART_LOAD,
    ORDINARY_BOILER,
    Biquadratic,
    Polynomial,
)
from thermal.components.operations import FloatOperations
from thermal.errors import ModelError

OPS = FloatOperations()


def test_curves_are_one_at_their_rated_points():
    assert DX_CAPACITY(OPS, 19.44, 35.0) == pytest.approx(1.0, abs=0.02)
    assert DX_INPUT(OPS, 19.44, 35.0) == pytest.approx(1.0, abs=0.02)
    assert FAN_PART_LOAD(OPS, 1.0) == pytest.approx(1.0, abs=1e-3)
    assert ORDINARY_BOILER(OPS, 1.0, 60.0) == pytest.approx(1.0)


def test_a_condensing_boiler_gains_from_cold_water_and_little_load():
    assert CONDENSING_BOILER(OPS, 0.5, 35.0) > CONDENSING_BOILER(OPS, 0.5, 65.0)
    assert CONDENSING_BOILER(OPS, 0.2, 65.0) > CONDENSING_BOILER(OPS, 1.0, 65.0)


def test_arguments_are_held_within_their_ranges():
    assert DX_INPUT(OPS, 19.44, -20.0) == DX_INPUT(OPS, 19.44, 10.0)
    assert FAN_PART_LOAD(OPS, 1.5) == FAN_PART_LOAD(OPS, 1.0)


def test_a_curve_without_range_is_refused():
    with pytest.raises(ModelError, match="six coefficients and rising ranges"):
        Biquadratic((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (1.0, 0.0), (0.0, 1.0), "")
    with pytest.raises(ModelError, match="coefficients and a rising range"):
        Polynomial((), 0.0, 1.0, "")
