"""The battery: closed form over any step, its limits, its balance, and in a system."""

from __future__ import annotations

from typing import Any

import casadi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.battery import Battery
from thermal.components.component import Conditions, Given
from thermal.components.electric_heaters import ElectricHeaters
from thermal.components.operations import CasadiOperations, FloatOperations
from thermal.system.plant import HvacPlant
from thermal.system.points import energy_balance
from thermal.system.system import HvacSystem

BATTERY = Battery(10.0 * 3.6e6, 5e3)
KWH = 3.6e6


def ran(level: Any, command: Any, seconds: Any, ops: Any = None) -> Any:
    none = Conditions(None, None, None, None)
    told = Given(none, None, {"battery_command": command}, {"charge_level": level}, seconds, lambda p, m: None)
    return BATTERY.run(ops or FloatOperations(), told)


def test_an_hour_each_way_by_hand() -> None:
    charged = ran(0.2, 0.5, 3600.0)
    assert charged.electric_power == 2500.0 and charged.charge_level == pytest.approx(0.2 + 0.95 * 0.25)
    back = ran(charged.charge_level, -0.5, 3600.0)
    assert back.electric_power == -2500.0 and back.charge_level == pytest.approx(0.4375 - 0.25 / 0.95)
    assert ran(0.98, 1.0, 3600.0).charge_level == pytest.approx(1.0) and ran(0.1, -1.0, 3600.0).charge_level == 0.0
    assert ran(0.1, -1.0, 3600.0).electric_power == pytest.approx(-0.1 * 10e3 * 0.95)


@given(level=st.floats(0.0, 1.0), command=st.floats(-1.0, 1.0), hours=st.floats(0.02, 1.0))
def test_one_step_is_many_and_the_balance_closes(level: float, command: float, hours: float) -> None:
    whole, now, taken = ran(level, command, 3600.0 * hours), level, 0.0
    for _ in range(10):
        part = ran(now, command, 360.0 * hours)
        now, taken = part.charge_level, taken + part.electric_power / 10.0
    assert whole.charge_level == pytest.approx(now, abs=1e-9) and whole.electric_power == pytest.approx(taken, abs=1e-6)
    assert -1e-12 <= whole.charge_level <= 1.0 + 1e-12 and whole.loss >= -1e-9
    balance = BATTERY.energy(None, whole)  # type: ignore[arg-type]
    assert abs(balance.residual) <= 1e-9 * max(balance.turnover, 1.0)


def test_derivatives_are_finite_differences() -> None:
    x = casadi.SX.sym("x", 2)
    done = casadi.vertcat(*ran(x[0], x[1], 900.0, CasadiOperations(0.02))[:2])
    f, slope = casadi.Function("f", [x], [done]), casadi.Function("d", [x], [casadi.jacobian(done, x)])
    for point in ([0.5, 0.4], [0.03, -0.9], [0.97, 0.8]):
        exact = np.array(slope(point))
        for k in range(2):
            step = 1e-6 * np.eye(2)[k]
            numeric = np.array(f(np.array(point) + step) - f(np.array(point) - step)).ravel() / 2e-6
            assert exact[:, k] == pytest.approx(numeric, rel=1e-4, abs=1e-3)


def test_in_a_system_it_is_a_state_an_actuator_and_on_the_meter() -> None:
    heaters = ElectricHeaters(np.array([1000.0]), np.array([0]))
    system = HvacSystem({"HEATER": heaters, "BATTERY": BATTERY}, ())
    plant = HvacPlant(system)
    conditions = Conditions(np.array([292.0]), np.array([294.0]), np.array([298.0]), 270.0)
    state, step = plant.step(plant.start(), conditions, system.actions(battery_command=-0.1), 900.0)
    assert step.electric_power == pytest.approx(1000.0 - 500.0)
    assert state.values[0] == pytest.approx(0.5 - 500.0 * 900.0 / 0.95 / (10.0 * KWH))
    balance = energy_balance(system, conditions, step)
    assert abs(balance.residual) <= 1e-9 * balance.turnover
