"""Closed loops with a fault each: it goes on, says which by name, and comfort falls off gracefully."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np
import pandas as pd
import pytest

from calibration import DisturbanceModel, KalmanFilter
from calibration.estimation.state_space import state_space
from mpc.control.controller.controller import MpcController
from mpc.control.controller.observer import Observer
from mpc.control.controller.site import Action, ControllerSettings, SitePoints, Source
from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import supply_channels
from mpc.control.problem.horizon import Horizon
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.solution import Status
from mpc.control.solvers.uncertainty import BackOff
from mpc.scenario.forecast import Forecast

START = pd.Timestamp("2023-01-16 07:00", tz="Etc/GMT+8")
STEPS, FAULT = 15, 3  # of 5 minutes, and the step from which on there is a fault


class Site:
    """The model's building and plant, with noise and a heat that the model does not know of."""

    def __init__(self, modes, hvac, make_data, points: SitePoints) -> None:
        self.predictor = Predictor(modes, hvac, Horizon(np.array([300.0]), np.array([0]), 300.0), supply_channels())
        self.points, self.rng, self.course = points, np.random.default_rng(0), []
        self.data = partial(make_data, _Shaped(self.predictor), disturbance=np.full(len(points.zones), 80.0))
        self.x, self.water, self.heat = modes.uniform * 1.2, 330.0, np.zeros(len(points.zones))
        self.zone = self.predictor.modes.output @ self.x + 293.15

    def measure(self) -> dict[str, float]:
        seen = {"weather_station/outside_air_temperature_sensor": 276.0, "AHU/electrical_power_sensor": 2000.0,
                "BOILER/supply_water_temperature_sensor": self.water}  # fmt: skip
        noisy = self.zone + 0.05 * self.rng.standard_normal(self.zone.size)
        for name, value, heat in zip(self.points.terminals, noisy, self.heat, strict=True):
            seen[f"{name}/zone_air_temperature_sensor"] = value
            seen[f"{name}/supply_air_flowrate_sensor"] = 0.05
            seen[f"{name}/discharge_air_temperature_sensor"] = value + heat / (1006.0 * 0.05)
        return seen

    def step(self, action: Action) -> None:
        air, water = action["AHU/supply_air_temperature_setpoint"], action["BOILER/supply_water_temperature_setpoint"]
        gone = self.predictor.rollout(self.data(state=self.x, water=self.water), np.array([[air, water]]))
        self.x, self.heat, self.zone = gone.end_state, gone.heat[0], gone.zone[1]
        self.water = self.predictor.rollout(self.data(state=self.x, water=self.water), gone.plan).inputs[0, 0]
        self.course.append(self.zone)


class _Shaped:
    """What the maker of data asks of a problem."""

    def __init__(self, predictor: Predictor) -> None:
        self.predictor, self.shape = predictor, (1, 2)


@pytest.fixture
def run(make_problem, modes, hvac, points, make_data, make_forecast) -> Callable[..., tuple[Site, list[Action]]]:
    def go(fault: Callable | None = None, settings: ControllerSettings | None = None) -> tuple[Site, list[Action]]:
        kalman = KalmanFilter(state_space(modes, 300.0), DisturbanceModel(100.0, 6 * 3600.0, 0.05))
        problem = make_problem(Horizon.growing([(0.5, 300.0), (1.5, 900.0)], [0.5, 0.5, 1.0]))
        controller = MpcController(
            SequentialSolver(problem), Observer(kalman, modes), points, settings or ControllerSettings()
        )
        site, actions = Site(modes, hvac, make_data, points), []
        for k in range(STEPS):
            now = START + k * pd.Timedelta(minutes=5)
            seen, forecast = site.measure(), make_forecast(now)
            if fault is not None and k >= FAULT:
                seen, forecast = fault(controller, site, seen, forecast)
            actions.append(controller.step(seen, forecast, now))
            assert np.isfinite(list(actions[-1].values())).all()
            site.step(actions[-1])
        return site, actions

    return go


def discomfort(site: Site) -> float:
    """Kelvin-hours a zone outside of 21 to 24 degC."""
    zone = np.array(site.course)
    return float((np.maximum(294.15 - zone, 0.0) + np.maximum(zone - 297.15, 0.0)).sum() / 12.0 / zone.shape[1])


def said(actions: list[Action], words: str) -> int:
    return sum(any(words in reason for reason in action.reasons) for action in actions)


def test_without_a_fault_nothing_is_said(run) -> None:
    site, actions = run()
    assert all(action.source is Source.OPTIMAL for action in actions)
    assert said(actions, "stuck") == said(actions, "predicted") == said(actions, "missing") == 0
    assert discomfort(site) < 0.1


def test_a_stuck_sensor(run, points) -> None:
    name = f"{points.terminals[2]}/zone_air_temperature_sensor"

    def fault(controller, site, seen, forecast):
        return seen | {name: 293.0}, forecast

    site, actions = run(fault, ControllerSettings(resolution=0.0))
    assert (
        said(actions, f"zone temperature of {points.zones[2]!r} has been 19.85 degC for 6 steps") == STEPS - FAULT - 5
    )
    assert said(actions, "taken for stuck") == STEPS - FAULT - 5
    assert discomfort(site) < 0.3


def test_a_lost_sensor(run, points) -> None:
    name = f"{points.terminals[1]}/zone_air_temperature_sensor"
    site, actions = run(lambda controller, site, seen, forecast: (seen | {name: np.nan}, forecast))
    assert said(actions, f"zone temperature of {points.zones[1]!r} is missing") == STEPS - FAULT
    assert discomfort(site) < 0.2


OUTDOOR, WATER = "weather_station/outside_air_temperature_sensor", "BOILER/supply_water_temperature_sensor"


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        (OUTDOOR, 0.0, "-273.15 degC is outside of -80 degC to 65 degC: it counts as missing"),
        (WATER, 1e12, "1e+12 degC is outside of -20 degC to 250 degC: it counts as missing"),
        (OUTDOOR, 300.0, "min before is faster than it can move: it counts as missing"),
        ("AHU/electrical_power_sensor", -1e20, "is outside of -1e+07 W to 1e+08 W: it counts as missing"),
    ],
)
def test_what_no_sensor_can_read_is_said_and_counts_as_missing(run, name: str, value: float, words: str) -> None:
    """As if the sensor had not reported at all: the same setpoints, and the reason on top."""
    site, actions = run(lambda controller, site, seen, forecast: (seen | {name: value}, forecast))
    _, missing = run(lambda controller, site, seen, forecast: (seen | {name: np.nan}, forecast))
    assert said(actions, f"{name}: ") == said(actions, words) > 0
    first = [a.setpoints for a in actions[: FAULT + 2]]
    assert first == [a.setpoints for a in missing[: FAULT + 2]]
    assert discomfort(site) < 0.2


def test_a_value_that_stays_is_possible_again(run) -> None:
    """A front brought it: after a quarter of an hour the rate allows 24 K, and the sensor is believed."""
    _, actions = run(lambda controller, site, seen, forecast: (seen | {OUTDOOR: 300.0}, forecast))
    assert [k for k in range(STEPS) if said(actions[k : k + 1], "faster than")] == [FAULT, FAULT + 1]


def test_a_forecast_that_cannot_be(run) -> None:
    def fault(controller, site, seen, forecast):
        table = forecast.to_frame()
        table.iloc[5:8, table.columns.get_loc("outside_air_temperature_sensor")] = 1e9
        return seen, Forecast(table)

    _, actions = run(fault)
    assert said(actions, "forecast of outside_air_temperature_sensor: 3 values that cannot be") == STEPS - FAULT
    assert all(action.source is Source.OPTIMAL for action in actions)


def test_a_late_forecast(run) -> None:
    site, actions = run(lambda controller, site, seen, forecast: (seen, None))
    assert said(actions, "forecast is late") == STEPS - FAULT
    assert all(action.source is Source.OPTIMAL for action in actions)
    assert discomfort(site) < 0.2


def test_a_solver_out_of_time(run) -> None:
    def fault(controller, site, seen, forecast):
        controller.settings = ControllerSettings(time_limit=1e-4)
        return seen, forecast

    site, actions = run(fault)
    assert said(actions, "sequential solver: time limit") == STEPS - FAULT
    assert discomfort(site) < 0.3


def test_the_time_limit_holds_within_a_step(make_problem, make_data, monkeypatch) -> None:
    """A roll-out that takes long is the last one: neither line search nor inner programmes go on."""
    problem = make_problem()
    solver, data, plan = SequentialSolver(problem), make_data(problem, 303.0, 297.0), np.tile([288.0, 330.0], (4, 1))
    real, calls = problem.predictor.rollout, []

    def slow(*given):
        calls.append(time.perf_counter())
        if len(calls) > 1:
            time.sleep(0.3)
        return real(*given)

    monkeypatch.setattr(problem.predictor, "rollout", slow)
    begin = time.perf_counter()
    found = solver.solve(data, plan, time_limit=0.25)
    assert found.status is Status.TIME_LIMIT and found.usable and len(calls) <= 2
    assert time.perf_counter() - begin < 0.25 + 0.3 + 0.5  # the roll-out that ran, and a loaded machine


def test_a_plant_far_from_its_model(run, points) -> None:
    done = []

    def fault(controller, site, seen, forecast):
        if not done:  # doors stood open: every zone has lost four kelvins, walls and all
            done.append(True)
            site.x = site.x - 4.0 * site.predictor.modes.uniform
            site.zone = site.zone - 4.0
            seen = site.measure()
        return seen, forecast

    site, actions = run(fault)
    assert said(actions, "K from what its model predicted") >= 1
    assert all(action.source is Source.OPTIMAL for action in actions)
    zone = np.array(site.course)
    assert (zone[-1] > zone[FAULT] + 1.0).all()  # it heats up again


def test_narrowed_bands_reach_the_solver(run, modes, make_problem) -> None:
    kalman = KalmanFilter(state_space(modes, 300.0), DisturbanceModel(100.0, 6 * 3600.0, 0.05))
    horizon = Horizon.growing([(0.5, 300.0), (1.5, 900.0)], [0.5, 0.5, 1.0])
    seen = []

    def watch(controller, site, measured, forecast):
        real = controller.solver.solve
        controller.solver.solve = lambda data, *rest: (seen.append(data), real(data, *rest))[1]
        return measured, forecast

    off = BackOff(kalman, modes, horizon, 0.1, recourse=1800.0)
    run(watch, ControllerSettings(back_off=off))
    np.testing.assert_allclose(seen[0].lower, 294.15 + off.quantile * off.deviation)
