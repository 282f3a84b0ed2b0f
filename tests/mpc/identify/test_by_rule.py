"""The rule on a controller's model: it keeps the band's lower edge, and a plan is held against it fairly."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.network import GreyBox
from mpc.control.identified.by_rule import _bought, _rule, estimate_rule
from mpc.control.identified.controller import IdentifiedController, IdentifiedSettings
from mpc.control.identified.problem import Ahead, IdentifiedProblem
from mpc.identify.curves import Curve
from mpc.identify.machines import Machine
from mpc.identify.maps import MachineMap
from mpc.identify.model import PlantModel
from mpc.loop.actuators import HEATING_SETPOINT, Actuator
from mpc.loop.plant import Measurements, PointLayout
from mpc.scenario.forecast import Forecast
from thermal.case.building import Location
from thermal.case.points import OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE

NAME = f"room/{HEATING_SETPOINT}"
PLACE = Location(latitude=50.8, longitude=4.35, elevation=100.0, timezone="Etc/GMT-1")
THERMOSTAT = Actuator(NAME, "K", 285.15, 298.15)


def room(operation: str) -> PlantModel:
    """A room whose heater costs a quarter of its heat."""
    heat, power = Curve({"command": 5000.0}, {"command": 0.0}), Curve({"command": 1250.0}, {"command": 0.0})
    machine = Machine(THERMOSTAT, "setpoint" if operation == "setpoint" else "machine", ("room",))
    found = MachineMap(machine, operation, heat, {"electricity": power}, (-0.1, 0.3))  # type: ignore[arg-type]
    return PlantModel("shop", 900.0, GreyBox.start({"room": 100.0}, (), {NAME: ("room",)}, (False,)), (found,))


def forecast(steps: int = 96) -> Forecast:
    stamps = pd.date_range("2023-01-09 00:15", periods=steps, freq="15min", tz="Etc/GMT-1")
    table = {OUTDOOR_TEMPERATURE: 278.15, "electricity_price": 0.2, "room/internal_gain": 0.0,
             "room/comfort_lower_temperature": 293.15, "room/comfort_upper_temperature": 297.15}  # fmt: skip
    return Forecast(pd.DataFrame(table, index=stamps))


@pytest.mark.parametrize("operation", ["setpoint", "duty"])
def test_the_rule_keeps_the_edge_and_equals_itself(operation: str) -> None:
    problem, ahead = IdentifiedProblem(room(operation)), Ahead.of(room(operation), forecast(), PLACE)
    ends, start = (np.zeros((96, 1)), np.ones((96, 1))), np.full(5, 293.15 - REFERENCE)
    start[4] = 0.0
    parameters = problem.data(start, ahead, np.zeros((96, 1)), 10.0, ends).parameters
    states, levels = _rule(problem, ahead, parameters, (start[:4], ends[1], np.array([False])))
    air = states[12:, 0] + REFERENCE
    assert 292.9 < air.min() and air.max() < 294.3 and 0.0 < levels.mean() < 1.0
    assert set(levels.ravel()) == {0.0, 1.0} or operation == "setpoint"
    cost, heat = _bought(problem, ahead, states, levels, ahead.running)
    assert cost == pytest.approx(0.25 * 0.2 * heat / 3.6e6)  # a quarter of the heat at 0.2 a kilowatt hour
    same = estimate_rule(problem, ahead, parameters, (states, levels), ends[1], np.array([False]))
    assert same.saving == 0.0 and same.plan == same.rule == cost
    more = levels.copy()
    more[-1] = 1.0 if levels[-1, 0] < 0.5 else 0.0
    ended = states.copy()
    ended[-1] = np.array(problem.stage.step(states[-2], more[-1], parameters[-1])[0]).ravel()
    other = estimate_rule(problem, ahead, parameters, (ended, more), ends[1], np.array([False]))
    # what one step heats more is still in the building, but for what it loses within that step
    assert other.plan != cost and abs(other.saving) < 0.1 * abs(other.plan - cost) / cost


def test_a_plan_tells_what_the_rule_would_cost() -> None:
    settings = IdentifiedSettings(guarantee=None)
    controller = IdentifiedController(room("setpoint"), (THERMOSTAT,), PLACE, settings)
    seen = Measurements(PointLayout((f"room/{ZONE_TEMPERATURE}",), "Etc/GMT-1"), 1673218800, [293.3])
    action = controller.step(seen, forecast())
    assert action.rule is not None and action.rule.rule > 0.0
    assert action.rule.plan == pytest.approx(float(action.power[:, 0].sum()) * 0.2 * 900.0 / 3.6e6)
    assert -0.02 < action.rule.saving < 0.15  # one price and one band leave a plan little
