"""Speed of the controller's solver on a building of the pilot's size, beside Ipopt on the same problem.

The building is the generated pilot (two floors, 6,317 m2, 123 zones, seed 0), volumes 1 m apart, reduced to `ORDER`
states; a plant with an air handler a floor, and 12 blocks of supply-air and supply-water temperature. A horizon of six
hours in steps of 5 minutes, and one of 24 hours in steps of 5 minutes for the first hour and a quarter of an hour from
there on. Each is solved from outdoor reset, then `WARM` times from the plan before, shifted by 5 minutes, with the
state that the model predicts and a disturbance of it; Ipopt then solves the last of these from the same plan.

A second table is of what any library can solve (`_common_control.py`: ten zones of three states, twelve decisions, 72
steps): do-mpc as it comes and tuned twice, Ipopt and fatrop in stages of ours, each along the same sequence of states,
each from its own plan before. What a plan costs is counted for all of them by the same roll-out; the reference is Ipopt
at its default tolerance.

Times are CPU times of the process on one thread.

Run: ``python benchmarks/mpc_speed.py --out results/mpc_speed``; three minutes on one core, most of them Ipopt's. The
peer needs the extra ``[benchmarks]``. Writes ``mpc_speed.json`` and ``.md``, ``mpc_peers.json`` and ``.md``;
``--publish`` replaces the tables in README and documentation.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from _common_control import STEPS, common_data, common_problem
from _do_mpc_peer import SETTINGS, DoMpc
from _pilot import pilot, plant_of
from _table import markdown, publish, write

from mpc.control.controller.site import ResetRule
from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import supply_channels
from mpc.control.problem.horizon import Horizon, HorizonData, PeakData
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.ipopt import IpoptSolver
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.solution import Status
from mpc.control.solvers.stages import StageData, StageMethod, StageSolution, StageSolver
from mpc.scenario.scenario import zone_areas
from thermal import SymbolicModel, build_network, reduced_model
from thermal.model.modal import ModalModel, modal_model
from thermal.system.smooth import SmoothHvac

ORDER, WARM, SEED = 201, 12, 0
HORIZONS = {
    "6 h": Horizon.regular(6.0, 300.0, 12),
    "24 h": Horizon.growing([(1.0, 300.0), (23.0, 900.0)], [0.5, 0.5, 1, 1, 1, 2, 2, 2, 2, 4, 4, 4], 300.0),
}
COLUMNS = (
    "horizon", "steps", "cold, s", "warm, median s", "warm, largest s", "iterations", "Ipopt, s", "Ipopt",
    "cost over Ipopt's, %",
)  # fmt: skip
PEERS = ("solver", "warm, median s", "warm, largest s", "iterations", "cost over the reference's, largest %", "solved")
STAGES: dict[str, tuple[StageMethod, float]] = {
    "reference: Ipopt in stages, tolerance 1e-8": ("ipopt", 1e-8), "ours: Ipopt in stages": ("ipopt", 1e-4),
    "ours: fatrop in stages": ("fatrop", 1e-4),
}  # fmt: skip


def data_at(modes: ModalModel, areas: np.ndarray, horizon: Horizon, hour: float) -> HorizonData:
    """Make a winter day from an hour on, in the state of a cool night."""
    n, count, middle = len(areas), len(horizon), hour + (horizon.edges[:-1] + horizon.edges[1:]) / 7200.0
    occupied = (middle % 24 >= 7) & (middle % 24 < 19)
    early, zones = (middle % 24 >= 5.5) & (middle % 24 < 19), np.ones((count, n))
    outdoor = 273.0 + 4.0 * np.sin(2.0 * np.pi * (middle - 9.0) / 24.0)

    def daily(day: float, night: float, when: np.ndarray) -> np.ndarray:
        return np.where(when, day, night)[:, None] * zones

    return HorizonData(
        state=modes.uniform * -0.5, water=330.0, disturbance=np.zeros(n), previous=np.array([288.0, 330.0]),
        boundary=outdoor[:, None], outdoor_temperature=outdoor, outdoor_humidity=np.full(count, 0.003),
        gains=areas * np.where(occupied, 12.0, 2.0)[:, None], lower=daily(294.15, 288.15, occupied),
        upper=daily(297.15, 303.15, occupied), heating_setpoint=daily(294.65, 288.65, early),
        cooling_setpoint=daily(296.65, 302.65, early), running=np.ones((count, 2)),
        ventilation=np.repeat(occupied[:, None].astype(float), 2, axis=1), boiler=np.ones(count),
        electricity_price=np.where((middle % 24 > 8) & (middle % 24 < 21), 0.25, 0.12),
        gas_price=np.full(count, 0.05), comfort_price=0.2 * zones, peaks=PeakData.none(count),
    )  # fmt: skip


def measure(name: str, modes: ModalModel, areas: np.ndarray, hvac: SmoothHvac, warm: int) -> dict[str, Any]:
    """Solve a sequence of horizons, and the last by Ipopt as well."""
    horizon, rng = HORIZONS[name], np.random.default_rng(SEED)
    predictor = Predictor(modes, hvac, horizon, supply_channels())
    problem = ControlProblem(predictor)
    solver, seconds, steps = SequentialSolver(problem), [], []
    data = data_at(modes, areas, horizon, 5.0)
    plan = ResetRule().plan(predictor, data.outdoor_temperature)
    for k in range(warm + 1):
        begin = time.process_time()
        found = solver.solve(data, plan)
        seconds.append(time.process_time() - begin)
        steps.append(found.iterations)
        if k == warm:
            break
        plan = horizon.shifted(found.plan, 300.0)
        one = Predictor(modes, hvac, Horizon(np.array([300.0]), np.array([0]), 300.0), supply_channels())
        short = data_at(modes, areas, one.horizon, 5.0 + k / 12.0)
        gone = one.rollout(replace(short, state=data.state, water=data.water), found.plan[:1])
        data = replace(
            data_at(modes, areas, horizon, 5.0 + (k + 1) / 12.0),
            state=gone.end_state + 0.05 * rng.standard_normal() * modes.uniform,
            water=float(gone.inputs[0, 0] + 0.5 * rng.standard_normal()),
            previous=found.plan[0],
        )
    begin = time.process_time()
    reference = IpoptSolver(problem, tolerance=1e-4, iterations=150).solve(data, plan)
    return {
        "horizon": name, "steps": len(horizon), "cold": seconds[0], "warm_median": float(np.median(seconds[1:])),
        "warm_largest": max(seconds[1:]), "iterations": float(np.median(steps[1:])),
        "ipopt": time.process_time() - begin, "ipopt_status": str(reference.status), "status": str(found.status),
        "over_ipopt": 100.0 * (found.terms.total / reference.terms.total - 1.0),
    }  # fmt: skip


def instances(warm: int) -> tuple[list[StageData], list[StageSolution]]:
    """Follow the reference in closed loop: horizons of the common problem, and its solutions."""
    problem, rng = common_problem(), np.random.default_rng(SEED)
    solver, start = StageSolver(problem, STEPS, "ipopt", 1e-8), np.full(problem.state.numel(), -3.0)
    data = common_data(0, start)
    decisions = np.tile(0.5 * (problem.lower + problem.upper), (STEPS, 1))
    guess, horizons, solutions = (problem.follow(data, decisions), decisions), [], []
    for k in range(warm + 1):
        horizons.append(common_data(k, start))
        solutions.append(solver.solve(horizons[-1], *guess))
        guess = solutions[-1].shifted()
        start = solutions[-1].states[1] + 0.05 * rng.standard_normal(start.size)
    return horizons, solutions


class Stages:
    """Ours on the common problem, each solve from the plan before, shifted by a step."""

    def __init__(self, name: str, states: np.ndarray, decisions: np.ndarray) -> None:
        self._solver, self._guess = StageSolver(common_problem(), STEPS, *STAGES[name]), (states, decisions)

    def solve(self, data: StageData) -> tuple[np.ndarray, float, bool, int]:
        """Solve for one horizon: decisions, CPU time [s], success, iterations."""
        begin = time.process_time()
        found = self._solver.solve(data, *self._guess)
        seconds, self._guess = time.process_time() - begin, found.shifted()
        return found.decisions, seconds, found.status is Status.CONVERGED, found.iterations


def compare(name: str, horizons: list[StageData], reference: list[StageSolution]) -> dict[str, Any]:
    """Solve all horizons of the common problem with one solver, the first from the same middling plan."""
    problem, seconds, steps, over, solved = common_problem(), [], [], [], 0
    decisions = np.tile(0.5 * (problem.lower + problem.upper), (STEPS, 1))
    states = problem.follow(horizons[0], decisions)
    solver = DoMpc(problem, name, states, decisions) if name in SETTINGS else Stages(name, states, decisions)
    for data, best in zip(horizons, reference, strict=True):
        plan, spent, success, count = solver.solve(data)
        plan = np.clip(plan, problem.lower, problem.upper)
        cost = problem.cost_along(data, problem.follow(data, plan), plan)
        seconds, steps = [*seconds, spent], [*steps, count]
        over, solved = [*over, 100.0 * float(cost / best.cost - 1.0)], solved + success
    return {
        "solver": name, "warm_median": float(np.median(seconds[1:])), "warm_largest": max(seconds[1:]),
        "iterations": float(np.median(steps[1:])), "over": max(over), "solved": f"{solved} of {len(horizons)}",
    }  # fmt: skip


def peer_tables(peers: list[dict[str, Any]]) -> tuple[str, str]:
    """Lay out all peers, and the fastest of theirs and ours beside theirs as it comes."""
    theirs = [row for row in peers if row["solver"] in SETTINGS]
    chosen = [theirs[0], min(theirs[1:], key=lambda row: row["warm_median"]), peers[-1]]
    short = [
        [row["solver"], row["warm_median"], chosen[0]["warm_median"] / row["warm_median"], row["over"]]
        for row in chosen
    ]
    columns = ("solver", "median [s]", "times as fast", "cost over the optimum, largest [%]")
    return markdown(PEERS, [list(row.values()) for row in peers]), markdown(columns, short)


def main() -> None:
    """Measure both horizons and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--warm", type=int, default=WARM, help="solves from a shifted plan")
    parser.add_argument("--horizons", nargs="*", default=list(HORIZONS), choices=list(HORIZONS))
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    arguments = parser.parse_args()
    horizons, reference = instances(arguments.warm)
    peers = [compare(name, horizons, reference) for name in (*SETTINGS, *STAGES)]
    table, short = peer_tables(peers)
    write(arguments.out, "mpc_peers", table, {"seed": SEED, "rows": peers}, arguments.publish)
    if arguments.publish:
        publish("mpc_peers_short", short)
    print(table)
    if not arguments.horizons:
        return
    building = pilot()
    grid = SymbolicModel(build_network(building, dx=1.0))
    small = reduced_model(grid, [grid.network.start()], order=ORDER)
    modes, areas = modal_model(small.matrices(small.theta)), zone_areas(building)
    hvac = SmoothHvac(plant_of(areas))
    rows = [measure(name, modes, areas, hvac, arguments.warm) for name in arguments.horizons]
    keys = (
        "horizon",
        "steps",
        "cold",
        "warm_median",
        "warm_largest",
        "iterations",
        "ipopt",
        "ipopt_status",
        "over_ipopt",
    )
    table = markdown(COLUMNS, [[row[key] for key in keys] for row in rows])
    write(arguments.out, "mpc_speed", table, {"order": ORDER, "seed": SEED, "rows": rows}, arguments.publish)
    print(table)


if __name__ == "__main__":
    main()
