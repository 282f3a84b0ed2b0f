import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from thermal.components.operations import FloatOperations
from thermal.components.water_coil import WaterCoil, _effectiveness, heat_share, valve_flow, valve_position, water_share
from thermal.errors import ModelError

OPS = FloatOperations()
NTU, RATIO = st.floats(0.01, 8.0), st.floats(1e-6, 1.0)


def counterflow(ntu, ratio):
    """Incropera eq. 11.29."""
    if ratio > 1.0 - 1e-9:
        return ntu / (1.0 + ntu)
    decay = np.exp(-ntu * (1.0 - ratio))
    return (1.0 - decay) / (1.0 - ratio * decay)


def parallel(ntu, ratio):
    """Incropera eq. 11.28."""
    return (1.0 - np.exp(-ntu * (1.0 + ratio))) / (1.0 + ratio)


def test_effectiveness_by_hand():
    # Incropera eq. 11.32 with NTU = 1, Cr = 0.5: 1 - exp((exp(-0.5) - 1) / 0.5)
    assert _effectiveness(OPS, 1.0, 0.5) == pytest.approx(1.0 - np.exp((np.exp(-0.5) - 1.0) / 0.5), rel=1e-12)


@given(ntu=NTU)
def test_effectiveness_where_one_side_does_not_change(ntu):
    assert _effectiveness(OPS, ntu, 1e-9) == pytest.approx(1.0 - np.exp(-ntu), rel=1e-6)  # eq. 11.35a


@given(ntu=NTU, ratio=RATIO)
def test_effectiveness_lies_between_parallel_and_counter_flow(ntu, ratio):
    value = _effectiveness(OPS, ntu, ratio)
    # eq. 11.32 is a fit to a series: some thousandths off where NTU is small
    assert parallel(ntu, ratio) - 7e-3 <= value <= counterflow(ntu, ratio) + 7e-3
    assert value <= 1.0


@given(ntu=NTU, ratio=RATIO)
def test_effectiveness_grows_with_size(ntu, ratio):
    assert _effectiveness(OPS, 1.1 * ntu, ratio) >= _effectiveness(OPS, ntu, ratio) - 1e-12


@given(air=st.floats(1e-4, 2.0), water=st.floats(0.0, 2.0))
def test_no_coil_carries_more_than_its_air_or_water_can(air, water):
    coil = WaterCoil.sized(20_000.0, 1.0)
    carried = coil.conductance(OPS, air, water)
    assert 0.0 <= carried <= min(1006.0 * (air + 1e-9), 4186.0 * coil.water_flow * (water + 1e-9)) * (1.0 + 1e-9)
    assert coil.conductance(OPS, 1.05 * air, water) >= carried * (1.0 - 1e-9)


def test_sizing_reaches_its_capacity():
    coil = WaterCoil.sized(38_380.0, 1.13, 289.85, 355.35)
    assert coil.conductance(OPS, 1.13) * (355.35 - 289.85) == pytest.approx(38_380.0, rel=1e-9)
    assert coil.water_flow * 4186.0 * 11.1 == pytest.approx(38_380.0)


def test_sizing_refuses_what_no_coil_reaches():
    with pytest.raises(ModelError, match="expected an effectiveness below"):
        WaterCoil.sized(60_000.0, 1.0, 290.0, 330.0)
    with pytest.raises(ModelError, match=r"WaterCoil.air_flow: expected 1e-06 to 10000 kg/s, found -1.0"):
        WaterCoil(100.0, 100.0, -1.0, 0.1)


def exact_water_share(coil, air, share):
    """Water that gives a share of the heat, by effectiveness-NTU at that flow."""
    full = coil.conductance(OPS, air)
    return brentq(lambda w: coil.conductance(OPS, air, w) - share * full, 1e-9, 1.0)


@pytest.mark.parametrize("air", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9])
def test_the_characteristic_is_near_effectiveness_ntu_at_part_flow(air, share):
    coil = WaterCoil.sized(20_000.0, 1.0)
    curve = coil.water_side(OPS, 1.0).curve
    full = coil.conductance(OPS, air)
    found = water_share(share * full, full, curve)
    assert found == pytest.approx(exact_water_share(coil, air, share), rel=0.17, abs=0.03)


@given(share=st.floats(0.0, 1.0), air=st.floats(0.1, 1.5), size=st.floats(3000.0, 20_000.0))
def test_the_characteristic_inverts_and_obeys_the_second_law(share, air, size):
    coil = WaterCoil.sized(size, 1.0)
    full, curve = coil.conductance(OPS, air), coil.water_side(OPS, 1.0).curve
    flow = water_share(share * full, full, curve)
    assert 0.0 <= flow <= 1.0
    assert heat_share(OPS, flow, full, curve) == pytest.approx(share, abs=1e-9)
    # the water does not leave colder than the air enters
    assert share * full <= flow * 4186.0 * coil.water_flow * (1.0 + 1e-9) + 1e-12


@given(position=st.floats(0.0, 1.0), rangeability=st.floats(2.0, 200.0))
def test_valves_close_open_and_invert(position, rangeability):
    assert valve_flow(OPS, 0.0, rangeability) == 0.0
    assert valve_flow(OPS, 1.0, rangeability) == pytest.approx(1.0)
    assert valve_position(OPS, valve_flow(OPS, position, rangeability), rangeability) == pytest.approx(
        position, abs=1e-9
    )
