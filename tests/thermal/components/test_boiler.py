import pytest
from hypothesis import given
from hypothesis import strategies as st

from thermal.components.boiler_loop import BoilerLoop
from thermal.components.curves import CONDENSING_BOILER
from thermal.components.operations import FloatOperations
from thermal.components.pump import Pump
from thermal.components.streams import WaterDrawn
from thermal.errors import ModelError

OPS = FloatOperations()
LOOP = BoilerLoop(100_000.0, Pump(3.0), water_volume=0.5)


def heat(loop=LOOP, before=330.0, setpoint=330.0, running=1.0, conductance=500.0, source=140_000.0, step=300.0):
    goal = loop.goal(OPS, before, setpoint, step)
    return loop.heat(OPS, before, goal, running * loop.capacity, WaterDrawn(conductance, source, 0.0), 0.0, 293.15, step)


def test_pump_power_by_hand():
    # 3 l/s of water, 179,352 Pa, 68.25 %: volume flows, not mass flows
    assert Pump(3.0).power(3.0, 80_000.0) == pytest.approx(3.0 / 983.0 * 179_352.0 / 0.6825)
    assert Pump(3.0).power(0.0, 80_000.0) == 0.0


@given(flow=st.floats(0.01, 3.0), pressure=st.floats(1e4, 2e5))
def test_pump_power_grows_with_flow_and_pressure(flow, pressure):
    pump = Pump(3.0)
    assert pump.power(1.01 * flow, pressure) > pump.power(flow, pressure)
    assert pump.power(flow, 1.01 * pressure) > pump.power(flow, pressure)


def test_the_setpoint_is_held_within_the_capacity():
    end = heat()
    assert end.water == pytest.approx(330.0)
    assert end.produced == pytest.approx(500.0 * 330.0 - 140_000.0 + 50.0 * (330.0 - 293.15))


@given(
    before=st.floats(285.0, 365.0), setpoint=st.floats(285.0, 365.0), conductance=st.floats(0.0, 50_000.0),
    air=st.floats(280.0, 300.0), running=st.sampled_from([0.0, 1.0]), step=st.floats(10.0, 3600.0),
)  # fmt: skip
def test_the_loop_balances_and_stays_within_what_it_meets(before, setpoint, conductance, air, running, step):
    end = heat(LOOP, before, setpoint, running, conductance, conductance * air, step)
    residual = end.produced - end.load - end.loss - end.storage
    assert abs(residual) <= 1e-9 * (abs(end.load) + abs(end.storage) + 1e5)
    assert 0.0 <= end.produced <= 100_000.0
    assert min(before, air, 293.15) - 1e-6 <= end.water <= max(before, setpoint, air, 293.15) + 1e-6


def test_the_rise_is_bounded():
    assert heat(before=300.0, setpoint=350.0, conductance=0.0, source=0.0).water <= 310.0 + 1e-9
    fast = BoilerLoop(1e6, Pump(3.0), water_volume=0.5, fastest_rise=1.0)
    assert heat(fast, 300.0, 350.0, conductance=0.0, source=0.0).water == pytest.approx(350.0)


def test_an_idle_loop_cools_to_its_room():
    water = 340.0
    for _ in range(20_000):
        water = heat(before=water, running=0.0, conductance=0.0, source=0.0).water
    assert water == pytest.approx(293.15, abs=1e-3)


def test_return_water_by_balance_and_where_none_flows():
    end = heat()
    pipes = 40.0 / 50.0 * end.loss
    assert LOOP.returning(end, 2.0) == pytest.approx(330.0 - (end.load + pipes) / (2.0 * 4186.0))
    assert LOOP.returning(end, 0.0) == pytest.approx(330.0)


def test_fuel_by_hand_and_condensing():
    assert LOOP.fuel(OPS, 100_000.0, 340.0) == pytest.approx(100_000.0 / 0.78)
    condensing = BoilerLoop(100_000.0, Pump(3.0), 0.89, CONDENSING_BOILER)
    assert condensing.fuel(OPS, 50_000.0, 308.0) < condensing.fuel(OPS, 50_000.0, 340.0)
    best = BoilerLoop(100_000.0, Pump(3.0), 1.0, CONDENSING_BOILER)
    assert best.fuel(OPS, 20_000.0, 303.0) == 20_000.0  # never more heat than the higher heating value


def test_parameters_out_of_range_are_refused():
    with pytest.raises(ModelError, match=r"BoilerLoop.efficiency: expected 0.5 to 1 -, found 1.05"):
        BoilerLoop(1e5, Pump(3.0), 1.05)
    with pytest.raises(ModelError, match=r"BoilerLoop.pipe_conductance"):
        BoilerLoop(1e5, Pump(0.01), pipe_conductance=1000.0)
    with pytest.raises(ModelError, match=r"Pump.efficiency"):
        Pump(3.0, efficiency=0.0)
