import numpy as np
import pytest

from thermal.components.operations import StepOperations
from thermal.components.terminals import Terminals
from thermal.errors import ModelError

OPS = StepOperations()
FLOATS = OPS.scalar


def one(**changes):
    given = {
        "design_flow": 1.0, "minimum_flow": 0.3, "heating_flow": 0.5, "air_film": 900.0, "water_film": 1800.0,
        "water_flow": 0.3, "zone": np.array([0]), "air_handler": np.array([0]),
    }  # fmt: skip
    return Terminals(**(given | changes))


def flow(terminals, heating, cooling, reach=1.0):
    most = terminals.most_airflow(OPS, [reach])
    return float(terminals.airflow(OPS, np.array([heating]), np.array([cooling]), most)[0])


def test_two_maxima_by_hand():
    terminals = one()
    assert flow(terminals, 0.0, 0.0) == pytest.approx(0.3)
    assert flow(terminals, 0.0, 0.5) == pytest.approx(0.65)
    assert flow(terminals, 0.5, 0.0) == pytest.approx(0.3)  # the first half opens the reheat
    assert flow(terminals, 0.75, 0.0) == pytest.approx(0.4)
    assert flow(terminals, 1.0, 0.0) == pytest.approx(0.5)


def test_a_single_maximum_heats_with_its_minimum_flow():
    terminals = one(heating_flow=0.3, reheat_first=1.0)
    assert flow(terminals, 1.0, 0.0) == pytest.approx(0.3)


def test_the_duct_bounds_the_flow():
    assert flow(one(), 0.0, 1.0, 0.6) == pytest.approx(0.6)
    assert flow(one(), 0.0, 1.0, 0.0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("discharge_control", [True, False])
def test_discharge_air_keeps_its_limit_and_its_water(discharge_control):
    terminals = one(discharge_control=discharge_control)
    rate = np.array([300.0])
    coil = terminals.conductance(OPS, rate / 1006.0, rate, terminals.open_water(OPS, 1.0))
    for water in (285.0, 300.0, 340.0, 370.0):
        last = -1.0
        for call in (0.0, 0.3, 0.7, 1.0):
            part = terminals.throttled(OPS, np.array([call]), rate, coil, terminals.allowance(FLOATS, 286.0, water))
            discharge = float((286.0 + part * max(water - 286.0, 0.0) / rate)[0])
            assert 0.0 <= part[0] <= coil[0]
            assert discharge <= max(286.0, min(water, terminals.discharge_limit)) + 1e-9
            assert discharge >= last - 1e-12
            last = discharge


def test_a_call_sets_the_discharge_temperature():
    terminals, rate = one(), np.array([300.0])
    coil = terminals.conductance(OPS, rate / 1006.0, rate, terminals.open_water(OPS, 1.0))
    part = terminals.throttled(OPS, np.array([0.5]), rate, coil, terminals.allowance(FLOATS, 287.15, 350.0))
    assert (287.15 + part * (350.0 - 287.15) / rate)[0] == pytest.approx(0.5 * (287.15 + 305.15))


def test_less_differential_pressure_is_less_heat():
    terminals, rate = one(), np.array([500.0])
    coils = [terminals.conductance(OPS, rate / 1006.0, rate, terminals.open_water(OPS, w))[0] for w in (0.2, 0.6, 1.0)]
    assert coils[0] < coils[1] < coils[2]


def test_sizing_by_hand():
    terminals = Terminals.sized([1.0, 0.5], [8000.0, 0.0], heating_share=0.5)
    rate = 1006.0 * terminals.heating_flow
    coil = terminals.conductance(OPS, terminals.heating_flow, rate, terminals.open_water(OPS, 1.0))
    assert coil[0] * (355.35 - 285.95) == pytest.approx(8000.0, rel=1e-6)
    assert coil[1] == pytest.approx(0.0, abs=1e-4)  # no coil


def test_terminals_that_cannot_be_are_refused():
    with pytest.raises(ModelError, match=r"terminal 0: expected minimum_flow <= heating_flow <= design_flow"):
        one(minimum_flow=0.6)
    with pytest.raises(ModelError, match=r"Terminals.water_flow\[0\]: expected 1e-09 to .* found nan"):
        one(water_flow=float("nan"))
    with pytest.raises(ModelError, match=r"Terminals.zone: expected positions from 0 on"):
        one(zone=np.array([-1]))
    with pytest.raises(ModelError, match=r"expected a number or 1 of them, found shape \(2,\)"):
        one(air_film=[1.0, 2.0])
