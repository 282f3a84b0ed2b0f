"""One day of the pilot building in closed loop: the grid, and the reduced model, beside the paper's simulator.

The building is the generated pilot (two floors, 6,317 m2, 123 zones, 127 devices, seed 0) with a plant sized from its
loads; a winter day of steps of 5 minutes under fixed supply setpoints, after a warm-up of one day. Every step has the
thermostats, terminals, air handlers and hot water of `thermal.hvac` in it. The two buildings are the grid at 0.25 m
between volumes (100,000 of them) with the mean of the shuffle, and its reduction to some 500 modes made at 0.5 m; both
begin where their own warm-up ends. Their difference is that of the zones' temperatures over the day, with thermostats
in the loop.

The paper's simulator takes "about 15 s" a step for the pilot building, by the paper, and needs 288 of them for a day.

A step of the grid has two solves: without supply air, for the local controls that settle within a step, and with it.
Times are CPU times of the process on one thread; the median of a step, and the least in brackets.

Run: ``python benchmarks/closed_loop_speed.py --out results/loop [--readme]``; a minute on one core. Writes
``closed_loop_speed.json`` and ``.md``; with ``--readme`` also the table between its marks.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
from pathlib import Path
from typing import Any

import numpy as np
from _table import markdown, write
from simulator_speed import use_one_thread

from mpc.plants import SimulatedPlant, pilot_building, pilot_weather, simulated_plant
from thermal import Building
from thermal.hvac import HvacSystem
from thermal.pilot import size_system

SEED = 0
DAY, NEXT = "2023-01-09", "2023-01-10"
SPACINGS = {"grid": 0.25, "reduced": 0.5}  # m
PAPER_STEP = 15.0  # s, "about 15 s" a step


def make(building: Building, system: HvacSystem, kind: Any, dx: float) -> tuple[SimulatedPlant, dict[str, float]]:
    """Make a plant and warm it up; with the CPU times of both [s]."""
    begin = time.process_time()
    plant = simulated_plant(building, pilot_weather(SEED, DAY, 1.0), DAY, NEXT, model=kind, dx=dx, system=system)
    made = time.process_time()
    plant.reset()
    return plant, {"make": made - begin, "reset": time.process_time() - made}


def day(plant: SimulatedPlant) -> np.ndarray:
    """CPU times of the steps of a day, shape (n_steps,) [s]."""
    times = []
    while not plant.finished:
        begin = time.process_time()
        plant.step(plant.default_actions)
        times.append(time.process_time() - begin)
    return np.array(times)


def least_of_days(plant: SimulatedPlant, days: int) -> np.ndarray:
    """Time the steps of a day [s], each the least of several equal days: what other processes do not add to."""
    runs = []
    for _ in range(days):
        plant.reset()
        runs.append(day(plant))
    return np.min(runs, axis=0)


def measure() -> dict[str, Any]:
    """Run both and compare them."""
    building = pilot_building(SEED)
    system = size_system(building)
    found: dict[str, Any] = {"devices": len(building.devices), "zones": len(building.zone_names)}
    temperatures = {}
    for kind, dx in SPACINGS.items():
        plant, times = make(building, system, kind, dx)
        steps = day(plant)
        temperatures[kind] = plant.record().zone_temperature
        begin = time.process_time()
        plant.telemetry()
        read = (time.process_time() - begin) / len(steps)
        least = least_of_days(plant, 5) if kind == "reduced" else steps
        volumes = plant.model.network.n_node
        found[kind] = {
            "dx": dx, "volumes": volumes, "states": getattr(plant.model, "order", volumes), **times,
            "day": float(steps.sum()), "step_median": float(np.median(steps)), "step_min": float(steps.min()),
            "undisturbed_day": float(least.sum()), "undisturbed_median": float(np.median(least)),
            "read": read, "balance": abs(plant.balance().residual) / plant.balance().turnover,
        }  # fmt: skip
    gap = np.abs(temperatures["grid"] - temperatures["reduced"])
    return found | {"mean_difference": float(gap.mean()), "max_difference": float(gap.max())}


def report(found: dict[str, Any]) -> str:
    """Lay out the table."""
    grid, reduced = found["grid"], found["reduced"]
    both = (grid, reduced)
    rows = [
        ["control volumes, states", *(f"{b['volumes']:,}, {b['states']:,}" for b in both), "744 x 1004 cells"],
        ["**one day of 288 steps** [s]", *(f"{b['day']:.3g}" for b in both), f"{288 * PAPER_STEP:,.0f}"],
        [
            "a step, median (least) [ms]",
            *(f"{1e3 * b['step_median']:.3g} ({1e3 * b['step_min']:.3g})" for b in both),
            f"{1e3 * PAPER_STEP:,.0f}",
        ],
        ["the same, each the least of five days [ms]", "", f"{1e3 * reduced['undisturbed_median']:.3g}", ""],
        ["model made, factorised or reduced [s]", *(f"{b['make']:.3g}" for b in both), ""],
        ["890 measurements of a step read [ms]", *(f"{1e3 * b['read']:.3g}" for b in both), ""],
        ["energy that a step loses, of its turnover", *(f"{b['balance']:.0e}" for b in both), ""],
    ]
    note = (
        f"{found['zones']} zones, {found['devices']} devices, CPU time of one thread. Zone temperatures of the two "
        f"differ by {1e3 * found['mean_difference']:.1f} mK in the mean, {1e3 * found['max_difference']:.0f} mK at "
        f"most. {platform.machine()}, {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}.\n"
    )
    columns = ["", f"grid, {grid['dx']:g} m", f"reduced, from {reduced['dx']:g} m", "the paper's simulator"]
    return markdown(columns, rows) + "\n" + note


def main() -> None:
    """Measure and write the table."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--readme", action="store_true", help="replace the table in README or docs")
    options = parser.parse_args()
    found = measure()
    text = report(found)
    write(options.out, "closed_loop_speed", text, found, options.readme)
    print(text)


if __name__ == "__main__":
    main()
