"""The controllers of the comparison, each through a week of the plant."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from _learning_case import (
    BLOCK_ENDS,
    DISCOMFORT_PRICE,
    FULL,
    HORIZON_HOURS,
    POLICIES,
    TEST_WEEKS,
    Size,
    building_model,
    known_model,
    make_plant,
    office,
)

from mpc.baselines import Guideline36, OutdoorReset, day_schedule
from mpc.control import ControllerSettings, Horizon, Margin, MpcController
from mpc.environment import ActorNetwork, ControlEnvironment, EconomicReward, PolicyController
from mpc.kpi import StageCost, measure_kpis
from mpc.plants import (
    Controller,
    FixedSetpoints,
    Measurements,
    RecentSteps,
    SimulatedPlant,
    run_closed_loop,
)
from mpc.scenario import Forecast
from mpc.studies import KnownState, default_horizon, make_controller, site_points

STEPS_A_DAY = 96

#: Price of discomfort in optimal control [currency/K/h]: that of the comparison, and others for its front.
PRICES = (0.3, 1.0, 3.0)
RULES = ("floor", "schedule", "reset", "guideline36")
OPTIMAL = ("mpc_before", "mpc_after", "bound")
#: do-mpc, and our solver on the very problem that do-mpc solves.
PEERS = ("do_mpc", "mpc_as_do_mpc")
#: What do-mpc solves: steps of a quarter of an hour, fewer of them and fewer modes, for the sake of its time.
PEER_HOURS, PEER_ORDER, PEER_DAYS = 6.0, 30, 1


@dataclass(frozen=True)
class Entry:
    """A controller with all its choices: a line of the comparison before weeks and seeds are put together.

    Parameters
    ----------
    controller : str
        A rule, kind of optimal control, or name of a policy.
    price : float
        Of discomfort, as the controller has it [currency/K/h]; without effect on rules.
    """

    controller: str
    price: float = DISCOMFORT_PRICE

    @property
    def name(self) -> str:
        """Of its files."""
        return self.controller if self.price == DISCOMFORT_PRICE else f"{self.controller}_at_{self.price:g}"


def entries(prices: tuple[float, ...] = PRICES, policies: Path = POLICIES) -> list[Entry]:
    """List everything that is compared: rules, optimal control at several prices, all policies of a folder."""
    learned = sorted(path.stem for path in policies.glob("*.npz"))
    fronts = [Entry(name, price) for name in OPTIMAL for price in prices]
    peers = PEERS if find_spec("do_mpc") is not None else ()  # of the extra [benchmarks]
    return [*map(Entry, RULES), *fronts, *map(Entry, peers), *map(Entry, learned)]


def controller_of(entry: Entry, plant: SimulatedPlant, size: Size, policies: Path) -> Controller:
    """Make a controller."""
    required = tuple(a for a in plant.actuators if a.required)
    points = site_points(office(size), plant.devices)
    if entry.controller == "floor":
        kinds = {"supply_air_temperature_setpoint": 300.0, "supply_water_temperature_setpoint": 310.0}
        return FixedSetpoints(kinds, required)
    if entry.controller == "schedule":
        return day_schedule(required)
    if entry.controller == "reset":
        return OutdoorReset(required, points.weather_station)
    if entry.controller == "guideline36":
        return Guideline36(points, plant.system.terminals.air_handler.tolist(), required)
    if entry.controller in OPTIMAL:
        worlds: dict[str, Any] = {"mpc_before": "before", "mpc_after": "after", "bound": "plant"}
        model = known_model(worlds[entry.controller], size)
        return make_controller(
            model, plant, settings=ControllerSettings(comfort_price=entry.price),
            horizon=default_horizon(plant.control_step, HORIZON_HOURS),
            observer=KnownState(model, plant) if entry.controller == "bound" else None,
        )  # fmt: skip
    if entry.controller in PEERS:
        return peer_controller(entry, plant, size)
    network = ActorNetwork.load(policies / f"{entry.controller}.npz")
    world = ControlEnvironment(plant, block_ends=BLOCK_ENDS)
    return PolicyController(network, world.layout, world.actions)


def peer_controller(entry: Entry, plant: SimulatedPlant, size: Size, hours: float = PEER_HOURS) -> MpcController:
    """Make optimal control with do-mpc as its solver, or with ours on the same problem."""
    model = known_model("after", size, order=PEER_ORDER)
    steps = round(hours * 3600.0 / plant.control_step)
    # do-mpc's slacks are linear from the edge of a band on: a margin belongs to a penalty that begins softly
    back_off = Margin(0.0) if entry.controller == "do_mpc" else None
    ours = make_controller(
        model, plant, settings=ControllerSettings(comfort_price=entry.price, back_off=back_off),
        horizon=Horizon.regular(hours, plant.control_step, steps),
    )  # fmt: skip
    if entry.controller == "mpc_as_do_mpc":
        return ours
    from _do_mpc_loop import do_mpc_controller  # needs do-mpc

    return do_mpc_controller(ours)


class _Counted:
    """A controller whose fallbacks are counted, and its time."""

    def __init__(self, inner: Controller) -> None:
        self.inner, self.sources, self.seconds = inner, dict[str, int](), list[float]()

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        begin = time.process_time()
        action = self.inner.step(measurements, forecast)
        self.seconds.append(time.process_time() - begin)
        source = str(getattr(action, "source", "controller"))
        self.sources[source] = self.sources.get(source, 0) + 1
        return action


def run(entry: Entry, week: str, size: Size = FULL, policies: Path = POLICIES) -> dict[str, Any]:
    """Let a controller run a test week of the plant; plain numbers."""
    bound = entry.controller == "bound"
    plant = make_plant(TEST_WEEKS[week], building_model("plant", size), bound=bound, size=size)
    controller = _Counted(controller_of(entry, plant, size, policies))
    begin = time.process_time()
    forecasts = entry.controller not in RULES
    days = min(size.days, PEER_DAYS) if entry.controller in PEERS else size.days
    loop = run_closed_loop(plant, controller, steps=days * STEPS_A_DAY, seed=TEST_WEEKS[week][1], forecasts=forecasts)
    kpis = measure_kpis(loop.record, plant.scenario, control_step=plant.control_step)
    plain = {name: value for name, value in kpis.to_dict().items() if name != "zones"}
    area = kpis.floor_area
    return {
        "entry": asdict(entry), "week": week, "size": asdict(size), "kpis": plain, "cost": kpis.cost_tot * area,
        "discomfort": kpis.tdis_tot, "days": daily_stage_cost(plant), "sources": controller.sources,
        "cpu_seconds": round(time.process_time() - begin, 2), "step_seconds": step_seconds(controller),
        "about": about(entry, policies),
    }  # fmt: skip


def step_seconds(controller: _Counted) -> dict[str, float]:
    """CPU time that a controller took for its actions [s]."""
    return {"median": float(np.median(controller.seconds)), "largest": max(controller.seconds)}


def about(entry: Entry, policies: Path) -> dict[str, Any]:
    """Say how a policy was trained; nothing for others."""
    path = policies / f"{entry.controller}.npz"
    return dict(ActorNetwork.load(path).about) if path.exists() else {}


def daily_stage_cost(plant: SimulatedPlant) -> list[float]:
    """Stage cost of each day, discomfort at the price of the comparison [currency]."""
    reward, record = EconomicReward(StageCost(DISCOMFORT_PRICE)), plant.record()
    each = round(86400.0 / record.step)
    gas = np.zeros(record.n_steps) if record.gas is None else record.gas
    costs = []
    for first in range(0, record.n_steps, each):
        rows = slice(first, first + each)
        temperature = list(record.zone_temperature[first : first + each + 1])
        done = RecentSteps(record.step, temperature, record.electricity[rows].tolist(), gas[rows].tolist())
        costs.append(-reward.of_steps(done, plant.scenario, first))
    return costs
