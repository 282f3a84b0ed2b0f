"""Pressures that are not given are those of the design, and flows go with their root."""

import casadi
import numpy as np
import pytest

from thermal.components.component import Calls, Conditions
from thermal.components.operations import CasadiOperations, FloatOperations, StepOperations
from thermal.system.exchange import advance, givens


def step(system, actions, ops=None):
    ops, n = ops or StepOperations(), system.zone_count
    zones = [np.full(n, t) for t in (292.0, 294.0, 297.0)]
    calls = Calls(np.ones(n), np.zeros(n))
    return advance(ops, system, (335.0,), calls, Conditions(*zones, 280.0), actions, 300.0)


def opening(system, actions):
    """Water through open valves over the design flow, as the loop says it [-]."""
    sent, nothing = [], [None] * 3
    given = givens(
        system, Calls(None, None), Conditions(*nothing, 280.0), actions, (335.0,), 300.0,
        lambda name: lambda port, message: sent.append(message),
    )  # fmt: skip
    next(system.loop.run(FloatOperations(), given["BOILER"]))
    return sent[0].opening


def test_pressures_that_are_not_given_are_those_of_the_design(plant_system, command):
    held = command(plant_system, 287.0, 335.0)
    assert [held[f"AHU_{k}/supply_air_temperature_setpoint"] for k in (0, 1)] == [287.0, 287.0]
    assert [held[f"AHU_{k}/fan_running"] for k in (0, 1)] == [1.0, 1.0]
    design = [plant_system.defaults[f"AHU_{k}/supply_air_static_pressure_setpoint"] for k in (0, 1)]
    assert tuple(design) == plant_system.static_pressures
    assert opening(plant_system, held) == 1.0
    most = step(plant_system, held).terminals.most_airflow
    assert most == pytest.approx(plant_system.terminals.design_flow, rel=1e-11)


def test_flows_go_with_the_root_of_the_pressures(plant_system, command):
    design, pump = plant_system.static_pressures, plant_system.loop.pump
    static = tuple(0.25 * p for p in design)
    quarter = command(plant_system, 287.0, 335.0, static, 0.25 * pump.differential_pressure, (1.0, 0.0))
    first = plant_system.terminals.air_handler == 0
    assert opening(plant_system, quarter) == pytest.approx(0.5)
    most = step(plant_system, quarter).terminals.most_airflow
    assert most == pytest.approx(np.where(first, 0.5 * plant_system.terminals.design_flow, 0.0), abs=1e-9)


def test_expressions_are_laid_out_as_floats_are(plant_system, command):
    given = command(plant_system, (287.0, 289.0), 335.0, (100.0, 300.0), 5e4, (1.0, 1.0), 1.0, 0.5)
    symbols = {name: casadi.SX(value) for name, value in given.items()}
    zones = [casadi.SX(np.full(5, t)) for t in (292.0, 294.0, 297.0, 1.0, 0.0)]
    conditions = Conditions(*zones[:3], 280.0)
    found = advance(CasadiOperations(), plant_system, (335.0,), Calls(*zones[3:]), conditions, symbols, 300.0)
    held = step(plant_system, given)
    assert np.array(casadi.DM(found.terminals.most_airflow)).ravel() == pytest.approx(
        held.terminals.most_airflow, rel=1e-12
    )
    assert float(casadi.DM(found.results["BOILER"].water_flow)) == pytest.approx(
        held.results["BOILER"].water_flow, rel=1e-12
    )
