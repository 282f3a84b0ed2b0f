"""Maps of machines: part load, cycling and frost by hand, against EnergyPlus' closed forms, and derivatives."""

from __future__ import annotations

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.curves import (
    AIR_SOURCE_INPUT,
    CHILLER_PART_LOAD,
    CONSTANT,
    DX_HEATING_CAPACITY,
    Biquadratic,
    Polynomial,
)
from thermal.components.heat_pump_loop import AIR_TO_WATER
from thermal.components.machine_map import Defrost, MachineMap
from thermal.components.moist_air import saturation_humidity
from thermal.components.operations import CasadiOperations, FloatOperations, NumpyOperations
from thermal.errors import ModelError

OPS = FloatOperations()
FLAT = MachineMap(4.0, CONSTANT, CONSTANT, Polynomial((0.1, 0.9), 0.0, 1.0, "test"), minimum=0.25)
FROSTED = MachineMap(3.36, DX_HEATING_CAPACITY, CONSTANT, cycling_loss=0.15, defrost=Defrost())


def test_modulating_cycling_and_standing_by_hand() -> None:
    machine = MachineMap(
        4.0, CONSTANT, CONSTANT, FLAT.part_load, minimum=0.25, cycling_loss=0.2, running_share=0.16, standing_share=0.01
    )  # fmt: skip
    full, half, cycling, off = (machine.run_at(OPS, q, 10e3, 308.0, 280.0) for q in (20e3, 5e3, 1e3, 0.0))
    rated = 2500.0
    assert full.output == 10e3 and full.power == pytest.approx(rated * (1.0 + 0.16 + 0.01))
    # fans and pumps take what they take, whatever the compressor's speed
    assert half.output == 5e3 and half.power == pytest.approx(rated * (0.55 + 0.16 + 0.01)) and half.duty == 1.0
    time = 0.4 / (1.0 - 0.2 * 0.6)
    assert cycling.output == 1e3 and cycling.duty == pytest.approx(time)
    assert cycling.power == pytest.approx(time * rated * (0.1 + 0.9 * 0.25 + 0.16) + 0.01 * rated)
    assert off.power == pytest.approx(0.01 * rated) and off.duty == 0.0


@given(load=st.floats(0.0, 1.0), loss=st.floats(0.0, 0.3))
def test_on_off_is_the_run_time_fraction_of_a_coil(load: float, loss: float) -> None:
    """EnergyPlus: PLF = 1 - C (1 - PLR), RTF = PLR / PLF, power at full load times RTF."""
    machine = MachineMap(3.0, CONSTANT, CONSTANT, cycling_loss=loss)
    found = machine.run_at(OPS, load * 6e3, 6e3, 300.0, 280.0)
    assert found.power == pytest.approx(2e3 * load / (1.0 - loss * (1.0 - load)))


@given(load=st.floats(0.02, 1.5), chilled=st.floats(5.0, 10.0), outdoor=st.floats(24.0, 35.0))
def test_chillers_unload_as_energyplus_does(load: float, chilled: float, outdoor: float) -> None:
    """Q_available f_EIR f_PLR(max(PLR, least)) min(PLR / least, 1) / COP."""
    one = Biquadratic((0.9, 0.01, 0.0, 0.002, 0.0, 0.0), (5.0, 10.0), (24.0, 35.0), "test")
    machine = MachineMap(3.0, one, one, CHILLER_PART_LOAD, minimum=0.25)
    available = 50e3 * one(OPS, chilled, outdoor)
    found = machine.run_at(OPS, load * available, 50e3, 273.15 + chilled, 273.15 + outdoor)
    part = min(load, 1.0)
    expected = available * one(OPS, chilled, outdoor) / 3.0 * CHILLER_PART_LOAD(OPS, max(part, 0.25))
    assert found.power == pytest.approx(expected * min(part / 0.25, 1.0))


def test_frost_by_hand() -> None:
    """0 degC, saturated: the coil at -8.589 degC, the time share, and what it does to capacity and power."""
    outdoor, humidity = 273.15, saturation_humidity(OPS, 273.15, 101_325.0)
    excess = humidity - saturation_humidity(OPS, 273.15 - 8.589, 101_325.0)
    time = 1.0 / (1.0 + 0.01446 / excess)
    frost = FROSTED.frosted(OPS, outdoor, humidity)
    assert 0.1 < time < 0.2 and frost.capacity == pytest.approx(0.875 * (1.0 - time))
    assert frost.power == pytest.approx(0.954 * (1.0 - time)) and frost.added == pytest.approx(0.8 * time / 1.01667)
    dry, most = 0.758746 * 8e3, FROSTED.available(OPS, 8e3, 293.15, outdoor, frost)
    assert most == pytest.approx(dry * 0.875 * (1.0 - time) - 8e3 * 0.01 * time * 7.222 / 1.01667)
    done = FROSTED.run_at(OPS, 1e9, 8e3, 293.15, outdoor, humidity)
    assert done.power == pytest.approx((dry * 0.954 * (1.0 - time)) / 3.36 + 8e3 * 0.8 * time / 1.01667)
    warm = FROSTED.run_at(OPS, 4e3, 8e3, 293.15, 283.15, 0.007)
    assert warm == MachineMap(3.36, DX_HEATING_CAPACITY, CONSTANT, cycling_loss=0.15).run_at(
        OPS, 4e3, 8e3, 293.15, 283.15, 0.007
    )


def test_the_default_has_the_cop_of_its_source() -> None:
    """Staffell et al. (2012): 6.81 - 0.121 dT + 0.00063 dT^2, at 0 degC outdoors and water of 45 degC."""
    done = AIR_TO_WATER.run_at(OPS, 1e9, 10e3, 318.15, 273.15)
    standing = AIR_TO_WATER.standing_share * 10e3 / AIR_TO_WATER.cop
    cop = 6.81 - 0.121 * 45.0 + 0.00063 * 45.0**2
    assert done.output / (done.power - standing) == pytest.approx(cop)
    assert AIR_SOURCE_INPUT(OPS, 35.0, 7.0) == pytest.approx(1.0)


@given(wanted=st.floats(0.0, 15e3), outdoor=st.floats(250.0, 295.0), water=st.floats(300.0, 330.0))
def test_casadi_and_numpy_agree_and_derivatives_are_finite_differences(
    wanted: float, outdoor: float, water: float
) -> None:
    machine = MachineMap(3.5, DX_HEATING_CAPACITY, AIR_SOURCE_INPUT, FLAT.part_load, 0.3, 0.1, 0.05, 0.01, Defrost())
    values = [wanted, 10e3, water, outdoor, 0.003]
    exact = machine.run_at(NumpyOperations(), *(np.array([v]) for v in values))
    x = casadi.SX.sym("x", 5)
    plain = casadi.Function("p", [x], [casadi.vertcat(*machine.run_at(CasadiOperations(), *casadi.vertsplit(x)))])
    assert np.array(plain(values)).ravel() == pytest.approx(np.concatenate(exact), rel=1e-12)
    smooth = casadi.vertcat(*machine.run_at(CasadiOperations(0.02), *casadi.vertsplit(x))[:2])
    f, slope = casadi.Function("f", [x], [smooth]), casadi.Function("d", [x], [casadi.jacobian(smooth, x)])
    for k, h in ((0, 1e-2), (2, 1e-4), (3, 1e-4)):
        step = h * np.eye(5)[k]
        numeric = np.array(f(values + step) - f(values - step)).ravel() / (2.0 * h)
        assert np.array(slope(values))[:, k] == pytest.approx(numeric, rel=1e-4, abs=1e-3)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ModelError, match="MachineMap.part_load: expected a range that has the minimum of 0.1"):
        MachineMap(3.0, CONSTANT, CONSTANT, CHILLER_PART_LOAD, minimum=0.1)
    with pytest.raises(ModelError, match="MachineMap.cop: expected 1 to 20"):
        MachineMap(0.5, CONSTANT, CONSTANT)
