"""The guideline's requests and resets on measurements made by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mpc.baselines.guideline36 import Guideline36, Guideline36Settings, HysteresisRequests, SuppressedRequests
from mpc.baselines.rules import BASELINES, OutdoorReset
from mpc.control.controller.site import SitePoints
from mpc.errors import ControlError
from mpc.loop.actuators import Actuator

TERMINALS = ("A", "B", "C", "D")
POINTS = SitePoints(TERMINALS, TERMINALS, ("AHU1", "AHU2"), "BOILER", "station")
ACTUATORS = (
    Actuator("AHU1/supply_air_temperature_setpoint", "K", 285.0, 300.0),
    Actuator("AHU2/supply_air_temperature_setpoint", "K", 285.0, 300.0),
    Actuator("BOILER/supply_water_temperature_setpoint", "K", 310.0, 355.0),
)
START = pd.Timestamp("2023-07-03 08:00", tz="America/Los_Angeles")


class Seen(dict):
    """Measurements with a stamp."""

    def __init__(self, minutes: float, zone, valve=(0, 0, 0, 0), discharge=None, outdoor=283.15, fans=(1e3, 1e3)):
        super().__init__({"station/outside_air_temperature_sensor": outdoor, "BOILER/pump_power_sensor": 50.0})
        self.stamp = START + pd.Timedelta(minutes=minutes)
        for k, name in enumerate(TERMINALS):
            self[f"{name}/zone_air_temperature_sensor"] = zone[k]
            self[f"{name}/zone_air_heating_temperature_setpoint"] = 294.15
            self[f"{name}/zone_air_cooling_temperature_setpoint"] = 297.15
            self[f"{name}/heating_water_valve_percentage_command"] = valve[k]
            self[f"{name}/discharge_air_temperature_sensor"] = 291.15 if discharge is None else discharge[k]
        for k, name in enumerate(("AHU1", "AHU2")):
            self[f"{name}/supply_fan_power_sensor"] = fans[k]
            self[f"{name}/supply_air_temperature_setpoint"] = 291.15


def control(settings: Guideline36Settings | None = None) -> Guideline36:
    return Guideline36(POINTS, (0, 0, 0, 1), ACTUATORS, settings)


def test_requests_have_hysteresis_and_patience() -> None:
    asks = HysteresisRequests(3, 2.0, 3.0, 120.0)
    none = np.zeros(3)
    assert asks.count(np.array([0.96, 0.9, 0.2]), none, 60.0).tolist() == [1, 0, 0]
    assert asks.count(np.array([0.90, 0.9, np.nan]), none, 60.0).tolist() == [1, 0, 0]
    assert asks.count(np.array([0.84, 0.9, np.nan]), none, 60.0).tolist() == [0, 0, 0]
    far = np.array([2.5, 3.5, np.nan])
    assert asks.count(none, far, 60.0).tolist() == [0, 0, 0]
    assert asks.count(none, far, 60.0).tolist() == [2, 3, 0]
    assert asks.count(none, none, 60.0).tolist() == [0, 0, 0]


def test_a_setpoint_that_has_changed_keeps_quiet() -> None:
    """By 2 K: 18 minutes; by 5 K half an hour and not 45 minutes."""
    quiet, far = SuppressedRequests(2), np.full(2, 4.0)
    assert quiet.distance(far, np.array([299.0, 299.0]), 300.0).tolist() == [4.0, 4.0]
    found = [quiet.distance(far, np.array([297.0, 294.0]), 300.0).tolist() for _ in range(7)]
    assert [row[0] for row in found] == [0.0, 0.0, 0.0, 0.0, 4.0, 4.0, 4.0]
    assert [row[1] for row in found] == [0.0] * 6 + [4.0]


def test_air_follows_requests_of_its_own_zones_and_the_outdoor_temperature() -> None:
    """Three zones of the first air handler at 98 % of their loops: -0.1 K every 2 minutes from minute 10 on."""
    guideline = control()
    warm = (298.13, 298.13, 298.13, 298.13)
    found = [guideline.step(Seen(5.0 * k, warm), None) for k in range(4)]
    first = [a["AHU1/supply_air_temperature_setpoint"] for a in found]
    assert first == pytest.approx([291.15, 291.15, 291.15 - 0.1, 291.15 - 0.3])
    assert [a["AHU2/supply_air_temperature_setpoint"] for a in found] == pytest.approx([291.15] * 4)
    # 18.5 degC outdoors is half-way from T-max to Min_ClgSAT; 21 degC and above is all the way
    half = guideline.step(Seen(20.0, warm, outdoor=291.65), None)
    assert half["AHU2/supply_air_temperature_setpoint"] == pytest.approx(0.5 * (291.15 + 285.15))
    hot = guideline.step(Seen(25.0, warm, outdoor=303.15), None)
    assert hot["AHU1/supply_air_temperature_setpoint"] == pytest.approx(285.15)
    off = guideline.step(Seen(30.0, warm, fans=(0.0, 1e3)), None)
    assert off["AHU1/supply_air_temperature_setpoint"] == 291.15


def test_water_follows_valves_and_discharge_temperatures() -> None:
    """Two valves at 96 % are ignored; a box that lacks 9 K asks twice more: +1.7 K x 2 against the trim of 1.1 K."""
    guideline, cool = control(), (293.65, 293.65, 293.65, 295.0)
    for k in range(6):
        given = guideline.step(Seen(5.0 * k, cool, valve=(0.96, 0.96, 0.5, 0.0), discharge=(305.0,) * 4), None)
    water = "BOILER/supply_water_temperature_setpoint"
    assert given[water] == pytest.approx(353.15 - 4 * 1.1)
    # half of the call for heating: discharge air is wanted at 294.15 + 11 K
    seen = Seen(30.0, cool, valve=(0.96, 0.96, 0.9, 0.0), discharge=(305.0, 305.0, 296.0, 291.0))
    assert guideline.requests(seen, 300.0)[1].tolist() == [1, 1, 2, 0]
    assert guideline.step(seen, None)[water] == pytest.approx(353.15 - 5 * 1.1 + 2 * 1.7)


def test_setpoints_stay_within_the_range_of_the_plant_and_lost_sensors_ask_for_nothing() -> None:
    guideline, mild = control(), (295.0,) * 4
    for k in range(80):
        given = guideline.step(Seen(5.0 * k, mild), None)
    assert given["BOILER/supply_water_temperature_setpoint"] == 310.0
    blind = Seen(400.0, (np.nan,) * 4, valve=(np.nan,) * 4, outdoor=np.nan)
    for name in TERMINALS:
        del blind[f"{name}/discharge_air_temperature_sensor"]
    assert all(np.isfinite(list(guideline.step(blind, None).values())))
    with pytest.raises(ControlError, match="an air handler for each of 4 terminals"):
        Guideline36(POINTS, (0,), ACTUATORS)


def test_outdoor_reset_follows_its_lines() -> None:
    reset = OutdoorReset(ACTUATORS, "station")
    cold, warm, lost = ({"station/outside_air_temperature_sensor": t} for t in (266.15, 289.15, np.nan))
    assert list(reset.step(cold, None).values()) == [291.15, 291.15, 353.15]
    assert list(reset.step(warm, None).values()) == [286.15, 286.15, 323.15]
    assert list(reset.step(lost, None).values()) == [288.65, 288.65, 338.15] == list(reset.step({}, None).values())


@pytest.mark.parametrize("name", BASELINES)
def test_every_baseline_is_made_of_points_and_actuators(name: str) -> None:
    rule = BASELINES[name](POINTS, (0, 0, 0, 1), ACTUATORS)
    chosen = rule.step(Seen(0.0, (295.15,) * 4), None)
    assert set(chosen) == {a.name for a in ACTUATORS}
    assert all(a.lowest <= chosen[a.name] <= a.highest for a in ACTUATORS)


@pytest.mark.parametrize("name", BASELINES)
def test_a_rule_that_would_set_nothing_names_what_it_misses(name: str) -> None:
    heat_pump = (Actuator("heat_pump/speed", "1", 0.0, 1.0),)
    with pytest.raises(ControlError, match=r"supply_air_temperature_setpoint or .*supply_water_temperature_setpoint among "
                       r"the plant's actuators, found heat_pump/speed; map them"):  # fmt: skip
        BASELINES[name](POINTS, (0, 0, 0, 1), heat_pump)
