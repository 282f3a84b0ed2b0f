import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.fan import Fan
from thermal.components.operations import FloatOperations
from thermal.errors import ModelError

OPS = FloatOperations()


def test_design_power_by_hand():
    # 6.822 m3/s, 1109.648 Pa, 59.15 %: the Medium Office's first fan, sized by EnergyPlus to 12,798 W
    fan = Fan(6.821875881 * 1.2)
    assert fan.design_power == pytest.approx(12_797.77, rel=1e-6)
    assert fan.power(OPS, fan.design_flow, 250.0) == pytest.approx(fan.design_power, rel=1e-3)


@given(share=st.floats(0.0, 1.0), pressure=st.floats(20.0, 1000.0))
def test_power_grows_with_flow_and_pressure(share, pressure):
    fan = Fan(2.0)
    power = fan.power(OPS, 2.0 * share, pressure)
    assert 0.0 < power
    assert fan.power(OPS, 2.0 * share, 1.1 * pressure) > power
    assert fan.power(OPS, 2.0 * min(share + 0.01, 1.0), pressure) >= power - 1e-9


def test_part_of_the_flow_at_the_design_pressure_takes_the_curve():
    fan = Fan(2.0)
    x = 0.5
    curve = 0.0407598940 + 0.08804497 * x - 0.072926120 * x**2 + 0.9437398230 * x**3
    assert fan.power(OPS, 1.0, fan.static_pressure) == pytest.approx(fan.design_power * curve, rel=1e-12)


def test_pressures_beyond_those_of_buildings_are_refused():
    with pytest.raises(ModelError, match=r"Fan.design_pressure: expected 20 to 2500 Pa, found 10000.0"):
        Fan(1.0, 10_000.0)
    with pytest.raises(ModelError, match=r"Fan.static_pressure"):
        Fan(1.0, 500.0, 600.0)
    with pytest.raises(ModelError, match=r"Fan.design_flow: .* found nan"):
        Fan(float("nan"))
