"""Runs by mixed-integer programming: the best of all sequences, and no dearer than dithering."""

from __future__ import annotations

from itertools import pairwise, product

import casadi as ca
import numpy as np
import pandas as pd
import pytest

from calibration.estimation.state_space import REFERENCE
from calibration.grey_box.network import GreyBox
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.controller import IdentifiedController, IdentifiedSettings
from mpc.control.identified.mixed_integer import RunLimits, RunPlanner
from mpc.control.identified.problem import SCALE, IdentifiedProblem
from mpc.control.solvers.stages import StageData, StageProblem
from mpc.errors import ControlError
from mpc.identify.curves import Curve
from mpc.identify.machines import Machine
from mpc.identify.maps import MachineMap
from mpc.identify.model import PlantModel
from mpc.loop.actuators import Actuator
from mpc.loop.plant import Measurements, PointLayout
from mpc.scenario.forecast import Forecast
from thermal.case.building import Location
from thermal.case.points import OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE

COUNT, KEPT, RISE, START, COLD = 10, 0.8, 0.5, 0.15, 3.0


def room() -> StageProblem:
    """A room that keeps `KEPT` of its warmth in a step and gains `RISE` from a machine of power 1."""
    x, u, p = ca.SX.sym("x"), ca.SX.sym("u"), ca.SX.sym("p")
    return StageProblem(x, u, p, KEPT * x + RISE * u, p * u, 0.0 * x, x, np.zeros(1), np.ones(1))


def data_of(seed: int) -> StageData:
    """Prices of a seed, and a band that somebody asks for from the fourth step on."""
    low = np.where(np.arange(COUNT + 1) < 4, -np.inf, 0.9)[:, None]
    price = np.random.default_rng(seed).uniform(0.1, 0.4, (COUNT, 1))
    return StageData(np.array([0.6]), price, low, np.full((COUNT + 1, 1), 2.0), np.full((COUNT + 1, 1), COLD))


def allowed(runs: tuple[int, ...], limits: RunLimits) -> bool:
    """Whether a sequence keeps shortest runs and rests, and the starts that there are."""
    changes = np.flatnonzero(np.diff([int(limits.on), *runs]))
    starts = [k for k in changes if runs[k]]
    short = any(b - a < limits.hold for a, b in pairwise(changes))
    early = bool(changes.size) and changes[0] < limits.bound
    return not (short or early or any(n > limits.left + limits.back * k for n, k in enumerate(starts, 1)))


@pytest.mark.parametrize(("seed", "on", "bound", "left"), [(0, False, 0, 3.0), (1, True, 2, 0.0), (2, False, 1, 0.7)])
def test_the_plan_is_the_best_of_all_sequences(seed: int, on: bool, bound: int, left: float) -> None:
    problem, data = room(), data_of(seed)
    limits = RunLimits(0, on, bound, 2, left, 0.1, START)

    def cost(runs: tuple[int, ...]) -> float:
        u = np.array(runs, dtype=float)[:, None]
        starts = int((np.diff([float(on), *u[:, 0]]) > 0.5).sum())
        return problem.cost_along(data, problem.follow(data, u), u) + START * starts

    best = min(cost(runs) for runs in product((0, 1), repeat=COUNT) if allowed(runs, limits))
    relaxed = np.full((COUNT, 1), 0.4)
    found = RunPlanner(problem, COUNT).plan(data, problem.follow(data, relaxed), relaxed, [limits])
    assert found is not None and found.shape == (COUNT, 1) and set(found.ravel()) <= {0.0, 1.0}
    chosen = tuple(int(u) for u in found[:, 0])
    assert allowed(chosen, limits) and cost(chosen) == pytest.approx(best, rel=2e-3)


NAME, PLACE = "room/machine", Location(latitude=50.8, longitude=4.35, elevation=100.0, timezone="Etc/GMT-1")
LOW, HIGH = 0.1, 0.4  # EUR/kWh
MACHINE = Actuator(NAME, "1", 0.0, 1.0, kind="on_off")


def outcome(runs: str) -> tuple[float, float, int]:
    """Cost less that of the heat left at the end, at the lower price, kelvin hours below the band, starts; of 5 h."""
    heat, power = Curve({"command": 4000.0}, {"command": 0.0}), Curve({"command": 1000.0}, {"command": 0.0})
    found = MachineMap(Machine(MACHINE, "machine", ("room",)), "duty", heat, {"electricity": power}, (0.0, 0.0))
    box = GreyBox.start({"room": 100.0}, (), {NAME: ("room",)}, (False,))
    model = PlantModel("room", 900.0, box, (found,))
    stamps = pd.date_range("2023-01-09 00:15", periods=44, freq="15min", tz="Etc/GMT-1")
    prices = np.where(np.arange(44) % 12 < 6, LOW, HIGH)
    table = pd.DataFrame({OUTDOOR_TEMPERATURE: 275.15, "electricity_price": prices, "room/internal_gain": 0.0,
             "room/comfort_lower_temperature": 293.15, "room/comfort_upper_temperature": 297.15}, index=stamps)  # fmt: skip
    controller = IdentifiedController(model, (MACHINE,), PLACE, IdentifiedSettings(runs=runs, guarantee=None))  # type: ignore[arg-type]
    problem, layout = IdentifiedProblem(model), PointLayout((f"room/{ZONE_TEMPERATURE}",), "Etc/GMT-1")
    state, paid, below, starts, before = np.full(5, 293.5 - REFERENCE), 0.0, 0.0, 0, 0.0
    state[4] = 0.0
    for k in range(20):
        forecast = Forecast(table.iloc[k : k + 24])
        seen = Measurements(layout, int(stamps[k].timestamp()) - 900, [state[0] + REFERENCE])
        on = controller.step(seen, forecast)[NAME]
        ends, ahead = (np.zeros((24, 1)), np.ones((24, 1))), Ahead.of(model, forecast, PLACE)
        given = problem.data(state, ahead, np.zeros((24, 1)), 10.0, ends).parameters[0]
        state[:4], cost = (np.array(part).ravel() for part in problem.stage.step(state[:4], on, given))
        paid += float(cost[0]) / SCALE
        below += max(293.15 - REFERENCE - state[0], 0.0) * 0.25
        starts, before = starts + int(on > before), on
    return paid - 0.25 * LOW * float(box.capacity @ state[:4]) / 3.6e6, below, starts


def test_it_keeps_the_band_no_dearer_than_dithering() -> None:
    (dithered, *_, many), (mixed, below, starts) = outcome("dithering"), outcome("mixed_integer")
    assert mixed == pytest.approx(dithered, rel=0.02) and below < 0.1 and 0 < starts <= many
    with pytest.raises(ControlError, match="mpc: runs"):
        IdentifiedSettings(runs="rounding")  # type: ignore[arg-type]
