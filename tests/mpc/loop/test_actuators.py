"""Actions are refused by name, never clipped."""

from __future__ import annotations

import math

import pytest

from mpc.errors import PlantActionError
from mpc.loop.actuators import ACTION_LIMITS, actuators_of, checked_actions
from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.fan import Fan
from thermal.components.pump import Pump
from thermal.components.terminals import Terminals
from thermal.system.system import vav_system

AIR, WATER = "AHU/supply_air_temperature_setpoint", "BOILER/supply_water_temperature_setpoint"
SYSTEM = vav_system([AirHandler(Fan(1.0))], BoilerLoop(2e4, Pump(0.5)), Terminals.sized([0.5], 4000.0)).named(
    {AirHandler: ["AHU"]}
)
ACTUATORS = {a.name: a for a in actuators_of(SYSTEM, ["west"])}
FINE = {AIR: 287.0, WATER: 330.0}


def test_supply_setpoints_come_first_and_are_required() -> None:
    assert [a.name for a in ACTUATORS.values() if a.required] == [AIR, WATER]
    assert (ACTUATORS[AIR].lowest, ACTUATORS[WATER].highest) == (285.0, 355.0)  # the paper's simulator
    assert {a.unit for a in ACTUATORS.values()} == {"K", "Pa"}
    assert {name.rpartition("/")[2] for name in ACTUATORS} <= set(ACTION_LIMITS)


def test_what_is_fine_passes_as_floats() -> None:
    assert checked_actions({AIR: 287, WATER: 330.0}, ACTUATORS) == FINE


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({AIR: 284.999}, "AHU/supply_air_temperature_setpoint: expected a number from 285 to 300 K, found 284.999"),
        ({WATER: math.nan}, "BOILER/supply_water_temperature_setpoint: expected a number from 310 to 355 K, found nan"),
        ({AIR: math.inf}, "found inf"),
        ({AIR: "warm"}, "found 'warm'"),
        ({AIR: None}, "found None"),
        ({"AHU/suply_air_temperature_setpoint": 287.0}, "nearest valid one is 'AHU/supply_air_temperature_setpoint'"),
    ],
)
def test_what_is_not_is_refused_by_name(change: dict[str, object], words: str) -> None:
    with pytest.raises(PlantActionError, match=words.replace("/", ".")):
        checked_actions(FINE | change, ACTUATORS)  # type: ignore[arg-type]


def test_a_missing_setpoint_is_named() -> None:
    with pytest.raises(PlantActionError, match=r"action BOILER/supply_water.* found nothing"):
        checked_actions({AIR: 287.0}, ACTUATORS)


def test_limits_are_of_known_kinds_and_in_order() -> None:
    narrow = actuators_of(SYSTEM, [], {"supply_air_temperature_setpoint": (286.0, 290.0)})
    assert (narrow[0].lowest, narrow[0].highest) == (286.0, 290.0)
    with pytest.raises(PlantActionError, match="kind of action"):
        actuators_of(SYSTEM, [], {"supply_air": (286.0, 290.0)})
    with pytest.raises(PlantActionError, match="lower and a higher"):
        actuators_of(SYSTEM, [], {"supply_air_temperature_setpoint": (290.0, 286.0)})
