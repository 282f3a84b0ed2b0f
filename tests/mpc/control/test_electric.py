"""Battery, photovoltaics and demand charge in the stages of an identified plant, against closed forms and HiGHS."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import linprog

from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.network import GreyBox
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.beyond import WEIGHTS
from mpc.control.identified.controller import IdentifiedController, IdentifiedSettings
from mpc.control.identified.electric import Electric, ElectricNow, Photovoltaic
from mpc.control.identified.problem import SCALE, IdentifiedProblem
from mpc.control.solvers.stages import StageSolution, StageSolver
from mpc.errors import ControlError
from mpc.identify.curves import Curve
from mpc.identify.machines import Machine
from mpc.identify.maps import MachineMap
from mpc.identify.model import PlantModel
from mpc.loop.actuators import Actuator
from mpc.loop.plant import Measurements, PointLayout
from mpc.scenario.forecast import Forecast
from thermal.case.building import Location
from thermal.components.battery import Battery

N, BASE, COMMAND, LEVEL = 96, 1500.0, "battery/battery_command", "battery/charge_level_sensor"
BATTERY = Battery(36e6, 5000.0, 0.95, 0.95)  # 10 kWh
PLACE = Location(latitude=50.8, longitude=4.35, elevation=100.0, timezone="Etc/GMT-1")


def model(base: float = BASE) -> PlantModel:
    heat = Curve({"command": 3000.0}, {"command": 0.0})
    heater = Machine(Actuator("room/heater", "1", 0.0, 1.0), "machine", ("room",), "room/heating_power_sensor")
    box = GreyBox.start({"room": 100.0}, (), {"room/heater": ("room",)}, (True,))
    maps = (MachineMap(heater, "modulated", heat, {"electricity": heat}),)
    return PlantModel("house", 900.0, box, maps, {"electricity": base})


def plan(electric: Electric, price: np.ndarray, now: ElectricNow, load: np.ndarray) -> StageSolution:
    """Plan with the heater's loads as they are."""
    problem, edge = IdentifiedProblem(model(), electric), np.ones((N, 1))
    ahead = Ahead(np.full(N, 278.15), np.zeros((N, 0)), np.zeros((N, 1)), np.outer(price, [1.0, 0.0, 0.0]),
                  200.0 * edge, 400.0 * edge, edge > 0.0, np.zeros((N, 1, WEIGHTS)), np.full(N, np.inf),
                 np.zeros(N, dtype=int), np.zeros(N))  # fmt: skip
    state = np.append(np.full(4, 293.15 - REFERENCE), 0.0)
    data = problem.data(state, ahead, 0.0 * edge, 10.0, (load[:, None], load[:, None]), now)
    guess = np.full((N, problem.decisions), 0.5)
    return StageSolver(problem.stage, N, tolerance=1e-3).solve(data, problem.stage.follow(data, guess), guess)


def least_cost(electric: Electric, price: np.ndarray, now: ElectricNow, load: np.ndarray) -> float:
    """The same as a linear programme, by HiGHS: charge, discharge, bought power of each step, and the peak [kW]."""
    net, hours = (BASE + 3000.0 * load - now.generation) / 1e3, 0.25
    kw, kwh, eye = BATTERY.power / 1e3, BATTERY.capacity / 3.6e6, np.eye(N)
    sold, none = np.minimum(electric.feed_in, price), np.zeros((N, 1))
    cost = np.concatenate([sold * hours, -sold * hours, (price - sold) * hours, [electric.demand]])
    into = np.tril(np.ones((N, N))) * hours / kwh
    level = np.hstack([BATTERY.charging * into, -into / BATTERY.discharging, 0.0 * eye, none])
    rows = [np.hstack([eye, -eye, -eye, none]), np.hstack([0.0 * eye, 0.0 * eye, eye, none - 1.0]), level, -level]
    ends = [-net, np.zeros(N), np.full(N, 1.0 - now.level), np.full(N, now.level)]
    limits = [(0.0, kw)] * (2 * N) + [(0.0, None)] * N + [(now.peak / 1e3, None)]
    found = linprog(cost, np.vstack(rows), np.concatenate(ends), bounds=limits, method="highs")
    return float(found.fun + (sold * net).sum() * hours)


def test_a_battery_buys_at_the_low_price_as_much_as_it_can_sell() -> None:
    price = np.where(np.arange(N) < 48, 0.1, 0.3)
    found = plan(Electric(BATTERY, COMMAND, LEVEL), price, ElectricNow(np.zeros(N)), np.zeros(N))
    gain = BASE / 1e3 * 12.0 * (0.1 + 0.3) - found.cost / SCALE
    # nothing is paid for what is fed in: full at midday, and empty in the evening
    assert gain == pytest.approx(10.0 * (0.95 * 0.3 - 0.1 / 0.95), rel=2e-3)
    level = found.states[:, -1]
    assert level[48] == pytest.approx(1.0, abs=0.02) and level[-1] == pytest.approx(0.0, abs=0.02)
    assert -0.01 < level.min() and level.max() < 1.01


@pytest.mark.parametrize("demand", [0.0, 2.0])
@pytest.mark.parametrize("feed_in", [0.0, 0.08])
def test_a_plan_costs_what_a_linear_programme_says(demand: float, feed_in: float) -> None:
    rng = np.random.default_rng(3)
    price = 0.2 + 0.05 * np.sin(np.arange(N) / 8.0) + 0.02 * rng.normal(size=N)
    load = (rng.random(N) < 0.3).astype(float)
    now = ElectricNow(np.where(abs(np.arange(N) - 48) < 14, 5000.0, 0.0), 0.4, 2500.0)
    electric = Electric(BATTERY, COMMAND, LEVEL, None, feed_in, demand)
    found, least = plan(electric, price, now, load), least_cost(electric, price, now, load)
    assert found.cost / SCALE == pytest.approx(least, abs=0.02)  # what tolerance and evenness cost
    without = plan(Electric(feed_in=feed_in, demand=demand), price, now, load)
    assert without.cost / SCALE > least + 0.5


def test_machines_shave_the_peak_where_there_is_no_battery() -> None:
    """Heat of a day is needed, whenever: the charge makes it even, as far as the building holds it."""
    problem = {demand: IdentifiedProblem(model(0.0), Electric(demand=demand)) for demand in (0.0, 5.0)}
    edge, peaks = np.ones((N, 1)), {}
    price = np.where(np.arange(N) % 8 < 4, 0.2, 0.25)
    ahead = Ahead(np.full(N, 285.15), np.zeros((N, 0)), np.zeros((N, 1)), np.outer(price, [1.0, 0.0, 0.0]),
                  293.15 * edge, 303.15 * edge, edge > 0.0, np.zeros((N, 1, WEIGHTS)), np.full(N, np.inf),
                 np.zeros(N, dtype=int), np.zeros(N))  # fmt: skip
    state = np.append([293.65 - REFERENCE] * 3 + [290.0 - REFERENCE], 0.0)
    for demand, each in problem.items():
        data = each.data(state, ahead, 0.0 * edge, 10.0, (0.0 * edge, edge), None)
        guess = np.full((N, each.decisions), 0.5)
        found = StageSolver(each.stage, N, tolerance=1e-3).solve(data, each.stage.follow(data, guess), guess)
        peaks[demand] = 3000.0 * found.decisions[4:, 0].max()
    assert peaks[5.0] < 0.9 * peaks[0.0]


def forecast_of(start: str, price: np.ndarray) -> Forecast:
    index = pd.date_range(start, periods=len(price), freq="15min", tz="Etc/GMT-1")
    table = {"outside_air_temperature_sensor": 293.15, "electricity_price": price, "room/internal_gain": 0.0,
             "room/comfort_lower_temperature": 283.15, "room/comfort_upper_temperature": 303.15,
             "global_horizontal_irradiance_sensor": 500.0}  # fmt: skip
    return Forecast(pd.DataFrame(table, index=index))


def test_the_controller_commands_the_battery_and_knows_the_peak_of_the_month() -> None:
    heater, inverter = Actuator("room/heater", "1", 0.0, 1.0), Actuator(COMMAND, "1", -1.0, 1.0)
    price = np.where(np.arange(N) < 8, 0.1, 0.4)
    electric = Electric(BATTERY, COMMAND, LEVEL, Photovoltaic(1000.0), 0.0, 0.1)
    controller = IdentifiedController(model(), (heater, inverter), PLACE, IdentifiedSettings(guarantee=None), electric)
    layout = PointLayout(("room/zone_air_temperature_sensor", LEVEL), "Etc/GMT-1")
    told = []
    for start in ("2023-01-31 23:30", "2023-01-31 23:45", "2023-02-01 00:00"):
        begin = pd.Timestamp(start, tz="Etc/GMT-1")
        ahead = forecast_of(f"{(begin + pd.Timedelta(minutes=15)).tz_localize(None)}", price)
        told.append(controller.step(Measurements(layout, int(begin.timestamp()), [293.15, 0.2]), ahead))
    assert all(action[COMMAND] > 0.1 for action in told)  # it is cheap now
    generated = electric.photovoltaic.power(forecast_of("2023-01-31 23:45", price), PLACE, 900.0)[0]
    bought = (BASE + BATTERY.power * told[0][COMMAND] - generated) / 1e3
    peaks = [action.solution.states[0][6] for action in told]  # after four nodes and the excesses of two bands
    assert peaks == pytest.approx([0.0, bought, 0.0], rel=0.02)


def test_what_is_not_possible_is_said() -> None:
    with pytest.raises(ControlError, match="battery: expected its actuator and the column of its charge level"):
        Electric(BATTERY)
    with pytest.raises(ControlError, match="demand charge: expected 0 or more, found -1"):
        Electric(demand=-1.0)
    with pytest.raises(ControlError, match="photovoltaic: expected a peak above 0 W"):
        Photovoltaic(0.0)
    with pytest.raises(ControlError, match="photovoltaic: expected a forecast of beam"):
        table = forecast_of("2023-01-31", np.ones(4)).table.drop(columns="global_horizontal_irradiance_sensor")
        Photovoltaic(1000.0).power(Forecast(table), PLACE, 900.0)
    with pytest.raises(ControlError, match=COMMAND):
        IdentifiedController(model(), (Actuator("room/heater", "1", 0.0, 1.0),), PLACE,
                             electric=replace(Electric(), command=COMMAND))  # fmt: skip
