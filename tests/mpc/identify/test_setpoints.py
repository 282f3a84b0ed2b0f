"""Thermostats that are led by their setpoint keep the band, and tell how much heat there is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm

from calibration.grey_box.network import GreyBox
from mpc.control.identified.controller import IdentifiedController, IdentifiedSettings
from mpc.control.identified.thermostats import Thermostats
from mpc.errors import PlantError
from mpc.identify.curves import Curve
from mpc.identify.limits import HeatLimit
from mpc.identify.machines import Machine, check_terminals, find_machines
from mpc.identify.maps import MachineMap, map_machines
from mpc.identify.model import PlantModel
from mpc.identify.regression import Loads
from mpc.loop.actuators import HEATING_SETPOINT, Actuator
from mpc.loop.plant import Measurements, PointLayout
from mpc.scenario.forecast import Forecast
from thermal.case.building import Location
from thermal.case.points import OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE

NAME = f"room/{HEATING_SETPOINT}"


@pytest.mark.parametrize("back_off", [0.0, 0.2])
def test_a_setpoint_is_never_told_below_the_edge_of_the_band(back_off: float) -> None:
    thermostat = Actuator(NAME, "K", 285.15, 298.15)
    heat = Curve({"command": 5000.0}, {"command": 0.0})
    # it seems to give no heat until it is a kelvin above the air: what a wrong map says
    machine = MachineMap(
        Machine(thermostat, "setpoint", ("room",)), "setpoint", heat, {"electricity": heat}, (-1.0, 1.0)
    )
    box = GreyBox.start({"room": 100.0}, (), {NAME: ("room",)}, (False,))
    controller = IdentifiedController(
        PlantModel("shop", 900.0, box, (machine,)), (thermostat,), Location(latitude=50.8, longitude=4.35, elevation=100.0, timezone="Etc/GMT-1"),
        IdentifiedSettings(back_off=back_off, guarantee=None),
    )  # fmt: skip
    stamps = pd.date_range("2023-01-09 06:15", periods=48, freq="15min", tz="Etc/GMT-1")
    edges = np.where(np.arange(48) < 8, 288.15, 293.15)  # from 8 h on
    table = {OUTDOOR_TEMPERATURE: 273.15, "electricity_price": 0.2, "room/internal_gain": 0.0,
             "room/comfort_lower_temperature": edges, "room/comfort_upper_temperature": 297.15}  # fmt: skip
    forecast, layout = pd.DataFrame(table, index=stamps), PointLayout((f"room/{ZONE_TEMPERATURE}",), "Etc/GMT-1")
    told = []
    for k in range(16):
        air = 288.4 if k < 8 else 293.0
        seen = Measurements(layout, int(stamps[k].timestamp()) - 900, [air])
        told.append(controller.step(seen, Forecast(forecast.iloc[k : k + 24]))[NAME])
    assert (np.array(told) >= edges[:16] + back_off - 1e-9).all()


def led(limits: tuple[tuple[float, float], ...] = ()) -> PlantModel:
    heat = Curve({"command": 5000.0}, {"command": 0.0})
    thermostat = Machine(Actuator(NAME, "K", 285.15, 298.15), "setpoint", ("room",), "room/heating_power_sensor")
    machine = MachineMap(thermostat, "setpoint", heat, {"electricity": heat}, (-0.1, 0.3), limits)
    box = GreyBox.start({"room": 100.0}, (), {NAME: ("room",)}, (True,))
    return PlantModel("shop", 900.0, box, (machine,))


def test_a_setpoint_is_the_air_that_is_planned_for_the_end_of_the_step() -> None:
    thermostats = Thermostats(led())
    end = np.array([[292.0], [292.2]])
    assert thermostats.tell(0, 0.5, 1.0, end, (288.0, 297.0)) == pytest.approx(292.0 + 0.1)
    assert thermostats.tell(0, 1.0, 1.0, end, (288.0, 297.0)) == pytest.approx(292.0 + 0.3 + 0.5)  # all that there is
    rising = np.array([[292.0], [294.0], [293.0]])
    assert thermostats.tell(0, 1.0, 1.0, rising, (288.0, 297.0)) == 294.0  # out of reach, whatever the model has wrong
    assert thermostats.tell(0, 1.0, 1.0, rising, (288.0, 293.5)) == 293.5  # but within the band
    assert (
        thermostats.tell(0, 0.0, 1.0, end, (288.0, 297.0)) == 288.0
        and thermostats.tell(0, 0.5, 1.0, end, (293.0, 297.0)) == 293.0
    )


def test_what_a_machine_gives_at_most_is_learned_where_its_setpoint_is_out_of_reach() -> None:
    """A compressor that stops in the cold: the limit falls there at once, and nowhere else."""
    thermostats = Thermostats(led(((278.0, 1.0), (270.0, 1.0))))
    layout = PointLayout(("room/heating_power_sensor",), "Etc/GMT-1")
    cold, mild = np.array([260.0]), np.array([278.0])
    before, warm = thermostats.most(cold)[0, 0], thermostats.most(mild)[0, 0]
    assert 0.3 < before < 0.9 < warm <= 1.0  # it was never seen in such cold: less is relied on
    for told, zone, seen in ((293.0, 292.9, before), (293.0, 291.0, 0.4)):  # within reach, and out of it
        thermostats.tell(0, 1.0, 1.0, np.array([[told - 0.8]]), (288.0, 297.0))
        thermostats.learn(Measurements(layout, 0, [2000.0]), np.array([zone]), 260.0)
        assert thermostats.most(cold)[0, 0] == pytest.approx(seen, abs=0.06)
    assert thermostats.most(mild)[0, 0] == pytest.approx(warm, abs=0.05)


def test_a_limit_is_the_posterior_of_a_gaussian_process() -> None:
    """One reading, by hand: k = 0.08 without slope at 7 degC, noise 0.05."""
    limit = HeatLimit([(280.15, 1.5)])
    gain = 0.08 / (0.08 + 0.05**2)
    mean, spread = 1.0 + gain * 0.5, np.sqrt(0.08 * (1.0 - gain))
    assert limit.at(np.array([280.15]))[0] == pytest.approx(mean - spread)
    assert HeatLimit().at(np.array([250.0, 290.0])).tolist() == [1.0, 1.0]


def test_a_data_sheet_says_what_was_never_seen() -> None:
    """A compressor that stops at -12 degC: what is likely is relied on where it may be colder; readings shift it all."""
    sheet, cold = ((253.15, 0.3), (261.0, 0.3), (261.1, 0.8), (280.0, 1.0)), np.array([256.0, 261.6, 263.0, 280.0])
    likely = cold + norm.ppf([0.1, 0.3, 0.5, 0.7, 0.9])[:, None]
    assert HeatLimit((), sheet).at(cold, 1.0) == pytest.approx(np.interp(likely, *np.array(sheet).T).mean(axis=0), abs=1e-4)
    assert HeatLimit([(261.05, 0.35)], sheet).at(cold)[1] > 0.65  # beside an edge a reading says nothing
    seen = HeatLimit([(280.0, 0.9), (278.0, 0.88)], sheet).at(cold)
    assert seen[3] == pytest.approx(0.86, abs=0.03) and 0.1 < seen[0] < 0.25
    led_by_sheet = replace(led().maps[0], machine=replace(led().maps[0].machine, capacity=((253.15, 1500.0),)))
    assert led_by_sheet.sheet == ((253.15, pytest.approx(0.3)),)


def test_a_data_sheet_is_of_a_setpoint_whose_heat_is_measured() -> None:
    thermostat, sheet = Actuator(NAME, "K", 285.15, 298.15), {NAME: ((260.0, 900.0),)}
    (found,) = find_machines([thermostat], ["room/heating_power_sensor"], ["room"], (), sheet)
    assert found.capacity == sheet[NAME]
    with pytest.raises(PlantError, match="capacity: expected a setpoint whose heat is measured, found no heat"):
        find_machines([thermostat], [], ["room"], (), sheet)


def test_a_data_sheet_of_one_source_is_of_several_setpoints_whose_heat_is_measured() -> None:
    rooms = ("north", "south")
    machines = [replace(led().maps[0].machine, heat=f"{room}/heating_power_sensor", serves=(room,)) for room in rooms]
    check_terminals(machines, rooms)
    air = replace(machines[1], heat="", air=("south/flow", "south/supply", "south/zone"))
    for refused, zones in ((machines[:1], rooms[:1]), ([machines[0], air], rooms), (machines, (*rooms, "east"))):
        with pytest.raises(PlantError, match="source: expected setpoints of all zones, two at least, whose heat is m"):
            check_terminals(refused, zones)


def test_limits_are_read_from_the_steps_at_which_more_was_wanted() -> None:
    n = 60
    level = np.random.default_rng(0).uniform(0.1, 0.9, (n, 1))
    level[:3], level[3] = 0.3, 0.35  # as much as there is at -10 degC
    outdoor = np.random.default_rng(1).normal(280.0, 3.0, n)
    outdoor[:4] = 263.0
    above = np.full((n, 1), 0.0)
    above[:4] = 1.0
    (found,), _ = map_machines([led().maps[0].machine], Loads(level, outdoor, 300.0 + level**3),
                               5000.0 * level, {}, above, 96)  # fmt: skip
    assert found.limits == ((263.0, 0.35),)
    assert found.heat.coefficients["command"] == pytest.approx(5000.0)
