"""The controllers of the comparison, each through a week of the plant."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from _site import Site

from mpc.environment.environment import ScenarioPlant
from mpc.environment.policy import ActorNetwork, PolicyController
from mpc.environment.reward import EconomicReward
from mpc.kpi.kpis import measure_kpis
from mpc.kpi.rewards import StageCost
from mpc.loop.history import RecentSteps
from mpc.loop.plant import Controller, Measurements
from mpc.loop.run import run_closed_loop
from mpc.scenario.forecast import Forecast

PEER_DAYS = 1  # of each week that the site's peers are run for


@dataclass(frozen=True)
class Entry:
    """A controller with all its choices: a line of the comparison before weeks and seeds are put together.

    Parameters
    ----------
    controller : str
        A rule, kind of optimal control, or name of a policy.
    price : float
        Of discomfort over that of the site, as the controller has it [-]; without effect on rules.
    """

    controller: str
    price: float = 1.0

    @property
    def name(self) -> str:
        """Of its files."""
        return self.controller if self.price == 1.0 else f"{self.controller}_at_{self.price:g}"


def entries(site: Site, prices: tuple[float, ...], policies: Path) -> list[Entry]:
    """List everything that is compared: rules, optimal control at several prices, all policies of a folder."""
    learned = sorted(path.stem for path in policies.glob("*.npz"))
    fronts = [Entry(name, price) for name in site.optimal for price in prices]
    peers = site.peers if find_spec("do_mpc") is not None else ()  # of the extra [benchmarks]
    return [*map(Entry, site.rules), *fronts, *map(Entry, (*site.sampling, *peers, *learned))]


def controller_of(entry: Entry, site: Site, plant: ScenarioPlant, policies: Path) -> Controller:
    """Make a controller."""
    if entry.controller in (*site.rules, *site.optimal, *site.sampling, *site.peers):
        return site.controller(entry.controller, entry.price * site.discomfort_price, plant)
    network, world = ActorNetwork.load(policies / f"{entry.controller}.npz"), site.world_of(plant)
    return PolicyController(network, world.layout, world.actions)


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


def run(entry: Entry, week: str, site: Site, policies: Path) -> dict[str, Any]:
    """Let a controller run a test week of the plant; plain numbers."""
    first = site.test_weeks[week]
    plant = site.plant(first, bound=entry.controller == "bound")
    controller = _Counted(controller_of(entry, site, plant, policies))
    begin = time.process_time()
    forecasts = entry.controller not in site.rules
    days = min(site.days, PEER_DAYS) if entry.controller in site.peers else site.days
    loop = run_closed_loop(plant, controller, steps=days * site.steps_a_day, seed=first[1], forecasts=forecasts)
    kpis = measure_kpis(loop.record, plant.scenario, control_step=plant.control_step)
    plain = {name: value for name, value in kpis.to_dict().items() if name != "zones"}
    area = kpis.floor_area
    return {
        "site": site.key, "entry": asdict(entry), "week": week, "n_days": site.days, "kpis": plain,
        "cost": kpis.cost_tot * area, "discomfort": kpis.tdis_tot, "days": daily_stage_cost(site, plant),
        "sources": controller.sources, "cpu_seconds": round(time.process_time() - begin, 2),
        "step_seconds": step_seconds(controller), "about": about(entry, policies),
    }  # fmt: skip


def step_seconds(controller: _Counted) -> dict[str, float]:
    """CPU time that a controller took for its actions [s]."""
    return {"median": float(np.median(controller.seconds)), "largest": max(controller.seconds)}


def about(entry: Entry, policies: Path) -> dict[str, Any]:
    """Say how a policy was trained; nothing for others."""
    path = policies / f"{entry.controller}.npz"
    return dict(ActorNetwork.load(path).about) if path.exists() else {}


def daily_stage_cost(site: Site, plant: ScenarioPlant) -> list[float]:
    """Stage cost of each day, discomfort at the price of the site [currency]."""
    reward, record = EconomicReward(StageCost(site.discomfort_price)), plant.record()
    each = round(86400.0 / record.step)
    gas = np.zeros(record.n_steps) if record.gas is None else record.gas
    costs = []
    for first in range(0, record.n_steps, each):
        rows = slice(first, first + each)
        temperature = list(record.zone_temperature[first : first + each + 1])
        done = RecentSteps(record.step, temperature, record.electricity[rows].tolist(), gas[rows].tolist())
        costs.append(-reward.of_steps(done, plant.scenario, first))
    return costs
