import casadi
import numpy as np
import pytest

from thermal.hvac._operations import CasadiOperations, StepOperations
from thermal.hvac._settings import settings_of
from thermal.hvac._step import Actions


def test_pressures_that_are_not_given_are_those_of_the_design(plant_system):
    held = settings_of(StepOperations(), plant_system, Actions(287.0, 335.0))
    assert held.supply_air == (287.0, 287.0) and held.running == (1.0, 1.0)
    assert held.static_pressure == plant_system.static_pressures and held.opening == 1.0
    assert held.most_airflow == pytest.approx(plant_system.terminals.design_flow, rel=1e-11)


def test_flows_go_with_the_root_of_the_pressures(plant_system):
    design, pump = plant_system.static_pressures, plant_system.loop.pump
    quarter = Actions(287.0, 335.0, tuple(0.25 * p for p in design), 0.25 * pump.differential_pressure, (1.0, 0.0))
    held = settings_of(StepOperations(), plant_system, quarter)
    first = plant_system.terminals.air_handler == 0
    assert held.opening == pytest.approx(0.5)
    assert held.most_airflow == pytest.approx(np.where(first, 0.5 * plant_system.terminals.design_flow, 0.0), abs=1e-9)


def test_expressions_are_laid_out_as_floats_are(plant_system):
    given = Actions((287.0, 289.0), 335.0, (100.0, 300.0), 5e4, (1.0, 1.0), 1.0, 0.5)
    held = settings_of(StepOperations(), plant_system, given)
    ops = CasadiOperations()
    symbols = settings_of(ops, plant_system, Actions(*[
        tuple(map(casadi.SX, v)) if isinstance(v, tuple) else casadi.SX(v) for v in given
    ]))  # fmt: skip
    assert np.array(casadi.DM(symbols.most_airflow)).ravel() == pytest.approx(held.most_airflow, rel=1e-12)
    assert float(casadi.DM(symbols.opening)) == pytest.approx(held.opening, rel=1e-12)
