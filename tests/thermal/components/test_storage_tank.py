"""The tank in layers: mixed and stirred tanks in closed form, plug flow as the limit, and its balance."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.moist_air import WATER_DENSITY, WATER_HEAT_CAPACITY
from thermal.components.operations import FloatOperations
from thermal.components.pump import Pump
from thermal.components.storage_tank import StorageTank, TankFlows

OPS, RATE = FloatOperations(), WATER_HEAT_CAPACITY
TANK = StorageTank(0.3, 0.2, Pump(0.2), height=20.0, loss=0.0)  # tall: next to no conduction
TURN = 0.3 * WATER_DENSITY / 0.2  # s, to change the water once


def charged(layers: int, seconds: float, step: float, tank: StorageTank = TANK) -> list[float]:
    """Layers after charging a tank of 300 K with water of 330 K."""
    now = [300.0] * layers
    for _ in range(round(seconds / step)):
        ends, _ = tank.layers_end(OPS, now, TankFlows(0.2, 0.0, 0.0, 0.0), 293.0, step)
        now = [a + b * 330.0 for a, b in ends]
    return now


@pytest.mark.parametrize("layers", [1, 2, 4])
def test_stirred_tanks_in_a_row(layers: int) -> None:
    """The n-th of n stirred tanks: 1 - exp(-n t) sum_(k < n) (n t)^k / k! of a step, t in turns; for 1 the mixed tank."""
    t = 0.8
    found = (charged(layers, t * TURN, TURN / 4000.0)[-1] - 300.0) / 30.0
    exact = 1.0 - math.exp(-layers * t) * sum((layers * t) ** k / math.factorial(k) for k in range(layers))
    assert found == pytest.approx(exact, abs=2e-4)


def test_the_error_falls_with_the_step_to_the_first_power() -> None:
    exact = 1.0 - math.exp(-0.8)
    errors = [abs((charged(1, 0.8 * TURN, TURN / n)[0] - 300.0) / 30.0 - exact) for n in (10, 20, 40)]
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.1) and errors[1] / errors[2] == pytest.approx(2.0, abs=0.1)


def test_many_layers_go_to_plug_flow() -> None:
    """What comes out at the bottom is cold until the water has been changed once, then hot: the more layers the more."""
    spread = []
    for layers in (2, 8, 16):
        before, after = (charged(layers, t * TURN, TURN / 100.0)[-1] for t in (0.6, 1.4))
        spread.append((after - before) / 30.0)
    assert spread[0] < spread[1] < spread[2] and spread[2] > 0.85


def test_an_idle_tank_cools_by_its_loss() -> None:
    tank = StorageTank(0.3, 0.2, Pump(0.2), loss=3.0)
    ends, _ = tank.layers_end(OPS, [330.0] * 4, TankFlows(0.0, 0.0, 0.0, 0.0), 293.0, 60.0)
    heat = 0.3 * WATER_DENSITY * RATE
    for _ in range(1439):
        ends, _ = tank.layers_end(OPS, [a for a, _ in ends], TankFlows(0.0, 0.0, 0.0, 0.0), 293.0, 60.0)
    assert [a for a, _ in ends] == pytest.approx([293.0 + 37.0 * math.exp(-3.0 * 86400.0 / heat)] * 4, abs=1e-3)


@given(
    before=st.lists(st.floats(290.0, 350.0), min_size=4, max_size=4), charge=st.floats(0.0, 0.3),
    draw=st.floats(0.01, 0.3), share=st.floats(0.0, 1.0), hot=st.floats(300.0, 350.0), seconds=st.floats(30.0, 3600.0),
)  # fmt: skip
def test_the_balance_closes_and_nothing_leaves_what_it_meets(
    before: list[float], charge: float, draw: float, share: float, hot: float, seconds: float
) -> None:
    tank = StorageTank(0.3, 0.2, Pump(0.2), loss=2.5)
    conductance = share * RATE * draw
    ends, means = tank.layers_end(OPS, before, TankFlows(charge, draw, conductance, conductance * 293.0), 293.0, seconds)
    end, mean = (np.array([a + b * hot for a, b in lines]) for lines in (ends, means))
    kept = 0.3 * WATER_DENSITY * RATE / 4.0 * (end - before).sum() / seconds
    gained = RATE * charge * (hot - mean[-1])
    load, loss = conductance * (mean[0] - 293.0), 2.5 * (mean.mean() - 293.0)
    assert abs(gained - load - loss - kept) <= 1e-9 * (abs(gained) + abs(load) + abs(kept) + abs(loss) + 1.0) * 100.0
    assert min(*before, hot, 293.0) - 1e-9 <= end.min() and end.max() <= max(*before, hot) + 1e-9


def test_a_tank_upside_down_mixes() -> None:
    turned = [300.0, 300.0, 340.0, 340.0]
    for _ in range(6):
        ends, _ = TANK.layers_end(OPS, turned, TankFlows(0.0, 0.0, 0.0, 0.0), 293.0, 900.0)
        turned = [a for a, _ in ends]
    still, _ = TANK.layers_end(OPS, [340.0, 340.0, 300.0, 300.0], TankFlows(0.0, 0.0, 0.0, 0.0), 293.0, 900.0)
    assert turned[0] > 310.0 and turned[-1] < 330.0 and sum(turned) == pytest.approx(1280.0)
    assert [a for a, _ in still] == pytest.approx([340.0, 340.0, 300.0, 300.0], abs=0.01)
