"""Terminals on one source reach more alone than together: it is found where they do, and plans keep to it."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from calibration.grey_box.network import GreyBox
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.beyond import WEIGHTS
from mpc.control.identified.by_rule import _rule
from mpc.control.identified.problem import IdentifiedProblem
from mpc.control.identified.thermostats import Thermostats
from mpc.control.solvers.stages import StageData, StageProblem, StageSolver
from mpc.identify.curves import Curve
from mpc.identify.limits import HeatLimit, limits_of
from mpc.identify.machines import Machine
from mpc.identify.maps import MachineMap
from mpc.identify.model import PlantModel
from mpc.identify.shared import SharedLimit, out_of_reach, shared_of, shares_of
from mpc.loop.actuators import HEATING_SETPOINT, Actuator
from mpc.loop.plant import Measurements, PointLayout

FULL, STEP = 8e3, 900.0
ROOMS = ("north", "east", "south", "west")


def _alone(outdoor: float) -> float:
    """What a terminal reaches alone [-]."""
    return 1.2 - 0.01 * (outdoor - 263.0)


def _source(outdoor: float) -> float:
    """Heat that the source has, over the full loads of all terminals [-]."""
    return 0.7 + 0.02 * (outdoor - 263.0)


def _given(wanted: np.ndarray, outdoor: float, shared: bool) -> np.ndarray:
    """Loads of terminals that want all they can get."""
    loads = np.where(wanted, _alone(outdoor), 0.1)
    return loads * min(_source(outdoor) / loads.mean(), 1.0) if shared else loads


def _known() -> list[HeatLimit]:
    return [HeatLimit([(t, _alone(t)) for t in np.arange(255.0, 285.0, 2.0)]) for _ in ROOMS]


def test_a_source_is_found_by_what_terminals_give_together() -> None:
    rng, limits = np.random.default_rng(3), _known()
    shared, own = (SharedLimit(np.full(4, FULL), STEP) for _ in range(2))
    for _ in range(200):
        outdoor, many = rng.uniform(258.0, 280.0), rng.integers(0, 5)
        wanted = rng.permutation(4) < many
        for _ in range(3):
            shared.learn(outdoor, _given(wanted, outdoor, True), wanted, limits)
            own.learn(outdoor, _given(wanted, outdoor, False), wanted, limits)
    cold = np.arange(258.0, 272.0, 2.0)
    said = shared.at(cold) / np.array([_source(t) for t in cold])
    assert (said < 1.05).all() and (said > 0.93).all()  # a standard deviation below the mean is relied on
    assert (
        own.at(cold) > 0.93 * np.array([_alone(t) for t in cold])
    ).all()  # with sources of their own nothing is lost


@pytest.mark.parametrize("band", [0.5, 1.0, 2.0])
def test_proportional_thermostats_are_no_source(band: float) -> None:
    """Four rooms with heaters of their own, set back at night: below their setpoints at part load, all of them alike."""
    rng, n = np.random.default_rng(1), 14 * 96
    hour = np.arange(n) % 96 / 4.0
    outdoor = 270.0 + 4.0 * np.sin(2.0 * np.pi * (hour - 9.0) / 24.0) + np.repeat(rng.normal(0.0, 3.0, 14), 96)
    setpoint = np.where((hour > 6.0) & (hour < 22.0), 293.5, 290.0)
    air, loads, above = np.full(4, 290.0), np.empty((n, 4)), np.empty((n, 4))
    lost = np.array([110.0, 130.0, 150.0, 170.0])  # W/K
    for k in range(n):
        for _ in range(15):
            loads[k] = np.clip((setpoint[k] - air) / band, 0.0, 1.0)
            air = air + 60.0 * (FULL * loads[k] - lost * (air - outdoor[k])) / 2e6
        above[k] = setpoint[k] - air
    alone = [limits_of(outdoor, loads[:, m], above[:, m]) for m in range(4)]
    found = shared_of(np.full(4, FULL), STEP, outdoor, loads, out_of_reach(above, np.full(4, band)), alone)
    assert SharedLimit(np.full(4, FULL), STEP, found).at(np.arange(262.0, 276.0)).min() > 0.85
    if band > 0.5:  # a fixed distance from the setpoint would take part load for all that there is
        told = shared_of(np.full(4, FULL), STEP, outdoor, loads, above > 0.3, alone)
        assert SharedLimit(np.full(4, FULL), STEP, told).at(np.arange(262.0, 276.0)).min() < 0.7


def test_weather_that_is_new_and_readings_that_are_missing_tell_little() -> None:
    shared, half, every = SharedLimit(np.full(4, FULL), STEP), np.arange(4) < 2, np.ones(4, dtype=bool)
    mild, low = [HeatLimit([(278.0, 1.0)]) for _ in ROOMS], np.array([0.5, 0.5, 0.1, 0.1])
    for _ in range(4):  # in such cold nobody knows what each reaches alone: two that give less may be just that
        assert shared.learn(258.0, low, half, mild).all()
    assert shared.readings == ()
    for k in range(3):  # an hour in which each step has lost a meter, and one after a gap
        shared.learn(278.0, np.where(np.arange(4) == k, np.nan, 0.5), every, mild)
    shared.learn(278.0, np.full(4, 0.5), every, mild)
    shared.learn(np.nan, np.full(4, 0.5), every, mild)
    for _ in range(2):
        assert not shared.learn(278.0, np.full(4, 0.5), every, mild).any()
    assert shared.readings == ()
    shared.learn(278.0, np.full(4, 0.5), every, mild)
    assert shared.readings == ((278.0, pytest.approx(0.5)),)
    hourly = SharedLimit(np.full(4, FULL), 3600.0)
    for _ in range(3):
        hourly.learn(278.0, np.full(4, 0.9), half, mild)
    assert hourly.readings == ()


def test_a_reading_is_the_mean_since_more_was_wanted_and_rises_with_what_is_given() -> None:
    shared, limits, every = SharedLimit(np.full(2, FULL), STEP), _known(), np.ones(2, dtype=bool)
    for load in (0.9, 0.5, 0.6):
        shared.learn(265.0, np.full(2, load), every, limits[:2])
    assert shared.readings == ((265.0, pytest.approx((0.9 + 0.5 + 0.6) / 3.0)),)
    for outdoor in (265.0, 267.0, 269.0):  # an hour each in which all give more, whatever was believed
        for _ in range(4):
            shared.learn(outdoor, np.full(2, 1.1), ~every, limits[:2])
    assert shared.readings == ((265.0, pytest.approx(1.1)),)  # of weather in which nobody wanted more nothing is said
    assert np.isinf(shared.at(np.array([267.5]))[0]) and shared.at(np.array([250.0]))[0] < 1.1


def test_what_was_given_in_harder_weather_is_no_limit() -> None:
    """Setpoints deep in the band are out of reach of what two hours on a colder day gave."""
    limits, every, here = _known(), np.ones(2, dtype=bool), np.array([265.0])
    shared = SharedLimit(np.full(2, FULL), STEP)
    for outdoor in [258.0] * 4 + [262.0] * 4:  # two hours, in weather of 262 K and colder
        shared.learn(outdoor, np.full(2, 0.9), ~every, limits[:2])
    assert shared.shown(np.array([261.9, 262.0, 280.0])).tolist() == [0.0, 0.9, 0.9] and np.isinf(shared.at(here)[0])
    for _ in range(8):
        shared.learn(265.0, np.full(2, 0.6), every, limits[:2])
    assert shared.readings == () and np.isinf(shared.at(here)[0])
    for _ in range(4):  # colder than that it is one
        shared.learn(260.0, np.full(2, 0.6), every, limits[:2])
    assert [load for _, load in shared.readings] == [pytest.approx(0.6)]
    told = shared.at(np.array([260.0, 261.5, 262.0]))
    assert told[0] < 0.65 and told[1] < 0.7 and told[2] >= 0.9
    outdoor, loads = np.array([262.0] * 8 + [265.0] * 6), np.repeat([0.9, 0.6], [8, 6])[:, None] * np.ones(2)
    wanted = np.repeat([False, True], [8, 6])[:, None] & every
    before = shared_of(np.full(2, FULL), STEP, outdoor, loads, wanted, [[(265.0, 1.2)]] * 2)
    after = shared_of(np.full(2, FULL), STEP, outdoor[::-1], loads[::-1], wanted[::-1], [[(265.0, 1.2)]] * 2)
    assert before == after == ()  # also where it is seen afterwards


def test_a_data_sheet_says_what_a_source_has_in_weather_that_was_never_seen() -> None:
    sheet, limits = ((253.0, 0.3), (283.0, 0.9)), [HeatLimit(), HeatLimit()]
    shared, every = SharedLimit(np.full(2, FULL), STEP, (), sheet), np.ones(2, dtype=bool)
    weather = np.array([243.0, 253.0, 268.0, 290.0])
    assert shared.at(weather) == pytest.approx([0.3, 0.3, 0.6, 0.9])
    assert 0.3 < shared.at(weather, 3.0)[1] < 0.33  # as likely warmer as colder, and no less when colder
    for _ in range(6):  # a sixth less than it says
        shared.learn(268.0, np.full(2, 0.5), every, limits)
    less = shared.at(weather) / np.array([0.3, 0.3, 0.6, 0.9])
    assert 0.75 < less[2] < 0.87 and less[[0, 1, 3]] == pytest.approx(less[0], abs=0.02) and less[0] < less[2]
    risen = []
    for _ in range(2):  # more, an hour each, in weather of which nothing else was seen
        for _ in range(4):
            shared.learn(253.0, np.full(2, 0.35), ~every, limits)
        risen.append(float(shared.at(weather)[1]))
    assert 0.3 * less[1] + 0.02 < risen[0] < risen[1] == pytest.approx(0.35)
    more = SharedLimit(np.full(2, FULL), STEP, (), sheet)
    for load in (0.605, 0.66):  # an hour of more than it says is no reason to rely on less anywhere
        for _ in range(4):
            more.learn(268.0, np.full(2, load), ~every, limits)
        assert (more.at(weather) >= np.array([0.3, 0.3, 0.6, 0.9]) - 1e-9).all()
    model = replace(_office(), shared=(), sheet=((253.0, 0.3), (283.0, 1.5)))
    ahead = Thermostats(model).together(np.array([253.0, 253.0, 283.0]))
    assert ahead[0] > ahead[1] > 0.3 * 0.95 and ahead[0] < 0.33 and np.isinf(ahead[2])  # terminals alone reach 1


def test_telemetry_tells_what_the_controller_would_have_learned() -> None:
    outdoor, begun = np.full(8, 263.0), np.arange(8)[:, None] >= 4
    loads, wanted = np.where(begun, 0.7, 0.1) * np.ones(4), begun & (np.arange(4) < 3)
    found = shared_of(np.full(4, FULL), STEP, outdoor, loads, wanted, [[(263.0, 1.2)]] * 4)
    assert found == ((263.0, pytest.approx(0.7)),)
    assert shared_of(np.full(4, FULL), STEP, outdoor, loads, wanted, [[(263.0, 0.75)]] * 4) == ()
    assert not shares_of(np.array([FULL, 0.0, -1.0])).any()


@pytest.mark.parametrize("method", ["fatrop", "ipopt"])
def test_what_is_kept_within_costs_what_a_linear_programme_says(method) -> None:
    """Two rooms on a source of 1.1, cheap before an edge rises at step 8."""
    n, kept, rise = 15, 0.95, 0.8
    price, lower = np.where(np.arange(n) < 6, 1.0, 2.0), np.where(np.arange(n + 1) < 8, 0.0, 2.5)
    x, u, p = ca.SX.sym("x", 2), ca.SX.sym("u", 2), ca.SX.sym("p", 2)
    cost = p[0] * ca.sum1(u)
    problem = StageProblem(x, u, p, kept * x + rise * u, cost, ca.SX(0), x, np.zeros(2), np.ones(2), ca.sum1(u) - p[1])
    edges = np.ones((n + 1, 2))
    data = StageData(np.zeros(2), np.column_stack([price, np.full(n, 1.1)]), lower[:, None] * edges, np.inf * edges,
                     100.0 * edges)  # fmt: skip
    guess = np.full((n, 2), 0.5)
    found = StageSolver(problem, n, method, 1e-6).solve(data, problem.follow(data, guess), guess)
    assert str(found.status) == "converged" and found.decisions.sum(axis=1).max() <= 1.1 + 1e-6
    course = np.array([[rise * kept ** (k - j - 1) if j < k else 0.0 for j in range(n)] for k in range(8, n + 1)])
    reach = np.kron(np.eye(2), course)  # rooms one after the other, as in the decisions below
    both = np.hstack([np.eye(n), np.eye(n)])
    best = linprog(np.tile(price, 2), np.vstack([-reach, both]),
                   np.concatenate([np.full(len(reach), -2.5), np.full(n, 1.1)]), bounds=(0.0, 1.0))  # fmt: skip
    assert found.cost == pytest.approx(best.fun, rel=1e-3)
    free = StageSolver(replace(problem, within=ca.SX(0, 1)), n, method, 1e-6)
    assert free.solve(data, problem.follow(data, guess), guess).cost < 0.99 * best.fun


def _office() -> PlantModel:
    heat, maps, serves = Curve({"command": FULL}, {"command": 0.0}), [], {}
    for room in ROOMS:
        name = f"{room}/{HEATING_SETPOINT}"
        machine = Machine(Actuator(name, "K", 285.15, 298.15), "setpoint", (room,), f"{room}/heating_power_sensor")
        limits = tuple((float(t), _alone(t)) for t in np.arange(255.0, 285.0, 2.0))
        maps.append(MachineMap(machine, "setpoint", heat, {"electricity": heat}, (-0.1, 0.3), limits))
        serves[name] = (room,)
    box = GreyBox.start(dict.fromkeys(ROOMS, 120.0), (), serves, (True,) * 4)
    return PlantModel("office", STEP, box, tuple(maps), {}, ((263.0, 0.7),))


def test_a_plan_keeps_to_what_the_source_has() -> None:
    model, n = _office(), 48
    problem = IdentifiedProblem(model)
    edge = np.where(np.arange(n)[:, None] < 32, 288.15, 293.15) * np.ones((1, 4))
    ahead = Ahead(np.full(n, 263.15), np.zeros((n, 0)), np.zeros((n, 4)), np.full((n, 3), 0.2), edge, edge + 10.0,
                  edge > 0.0, np.zeros((n, 4, WEIGHTS)), np.full(n, np.inf),
                 np.zeros(n, dtype=int), np.zeros(n))  # fmt: skip
    guess, ends, most = np.full((n, 4), 0.3), (np.zeros((n, 4)), np.full((n, 4), 1.2)), []
    start = np.concatenate([np.full(16, -5.0), np.zeros(4)])
    for each in (ahead, replace(ahead, together=np.full(n, 0.4))):
        data = problem.data(start, each, np.zeros((n, 4)), 10.0, ends)
        found = StageSolver(problem.stage, n, tolerance=1e-6).solve(data, problem.stage.follow(data, guess), guess)
        assert str(found.status) == "converged"
        _, by_rule = _rule(problem, each, data.parameters, (start[:16], ends[1], np.zeros(4, dtype=bool)))
        most.append([float((1.2 * found.decisions).mean(axis=1).max()), float(by_rule.mean(axis=1).max())])
    assert min(most[0]) > 0.6 and most[1] == pytest.approx([0.4, 0.4], abs=1e-4)


@pytest.mark.parametrize("known", [255.0, 267.0])
@pytest.mark.parametrize("cap", [0.5, 0.8])
@pytest.mark.parametrize("first", [0.0, 0.4])
def test_control_finds_a_source_and_still_knows_what_each_reaches_alone(known: float, cap: float, first: float) -> None:
    """Ten mornings at the limit, whose first step may have more from the water's store, and hours of little between."""
    limits = tuple((float(t), _alone(t)) for t in np.arange(known, 285.0, 2.0))
    model = replace(_office(), shared=(), maps=tuple(replace(found, limits=limits) for found in _office().maps))
    thermostats, layout = Thermostats(model), PointLayout(tuple(m.machine.heat for m in model.maps), "Etc/GMT-1")
    here = np.array([263.0])
    before = float(thermostats.most(here)[0, 0])

    def go(level: float, loads: list[float], air: float) -> None:
        for k in range(4):
            thermostats.tell(k, level, 1.0, np.full((1, 4), 293.0 if level == 1.0 else 290.0), (288.0, 297.0))
        thermostats.learn(Measurements(layout, 0, [load * FULL for load in loads]), np.full(4, air), 263.0)

    assert np.isinf(thermostats.together(here)[0])
    for _ in range(10):
        for step in range(6):
            go(1.0, [cap + first * (step == 0)] * 4, 290.0)
        for _ in range(10):
            go(0.1, [0.1] * 4, 291.5)
    assert 0.88 * cap < thermostats.together(here)[0] < 1.02 * cap
    ahead = thermostats.together(np.repeat(here, 3))
    assert ahead == pytest.approx(ahead[0] * np.array([1.0, 0.95, 0.95]))  # something is left for errors
    assert thermostats.most(here)[0, 0] >= before - 1e-9
    assert thermostats.shares_all(np.full(4, cap), here) and not thermostats.shares_all(np.full(4, 0.5 * cap), here)
    planned = np.array([[291.0] * 4, [294.0] * 4])
    told = [thermostats.tell(0, 0.5, 1.2, planned, (288.0, 297.0), shared) for shared in (False, True)]
    assert told[1] == pytest.approx(told[0] + 0.5)  # more than is relied on shows where it is there
