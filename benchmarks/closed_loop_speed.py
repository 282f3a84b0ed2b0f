"""One day of the pilot building in closed loop: the grid, and the reduced model, beside the paper's simulator.

The building is the generated pilot (two floors, 6,317 m2, 123 zones, 127 devices, seed 0) with a plant sized from its
loads; a winter day of steps of 5 minutes under fixed supply setpoints, after a warm-up of one day. Every step has the
thermostats, terminals, air handlers and hot water of `thermal/system` in it. The two buildings are the grid at 0.25 m
between volumes (100,000 of them) with the mean of the shuffle, and its reduction to some 500 modes made at 0.5 m; both
begin where their own warm-up ends. Their difference is that of the zones' temperatures over the day, with thermostats
in the loop.

The paper's simulator takes "about 15 s" a step for the pilot building, by the paper, and needs 288 of them for a day.

A step of the grid has two solves: without supply air, for the local controls that settle within a step, and with it.
Times are CPU times of the thread. Steps of reduced models are each the least of several equal days, which leaves out
what other processes on the machine take from caches; the day is the sum of them. Beside the pilot stands an office of
12 zones with sensor noise, all of whose measurements are read at every step, as a learning controller would.

Run: ``python benchmarks/closed_loop_speed.py --out results/loop [--publish]``; a minute on one core. Writes
``closed_loop_speed.json`` and ``.md``; with ``--publish`` also the table between its marks.
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
from _threads import use_one_thread

from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.simulated import SimulatedPlant
from thermal import Building
from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system
from thermal.system.system import HvacSystem

SEED = 0
DAY, NEXT = "2023-01-09", "2023-01-10"
SPACINGS = {"grid": 0.25, "reduced": 0.5}  # m
DAYS = 10  # equal days that the least is of
PAPER_STEP = 15.0  # s, "about 15 s" a step


def make(
    building: Building, system: HvacSystem, kind: Any, dx: float, noise: SensorNoise | None = None
) -> tuple[SimulatedPlant, dict[str, float]]:
    """Make a plant and warm it up; with the CPU times of both [s]."""
    begin, weather = time.process_time(), pilot_weather(SEED, DAY, 1.0)
    settings = PlantSettings(kind=kind, dx=dx, system=system, noise=noise)
    plant = simulated_plant(building, weather, DAY, NEXT, settings)
    made = time.process_time()
    plant.reset()
    return plant, {"make": made - begin, "reset": time.process_time() - made}


def day(plant: SimulatedPlant, read: bool = False) -> np.ndarray:
    """CPU times of the steps of a day, shape (n_steps,) [s], with or without reading what was measured."""
    times = []
    while not plant.finished:
        begin = time.thread_time()
        seen = plant.step(plant.default_actions)
        if read:
            _ = seen.values_array
        times.append(time.thread_time() - begin)
    return np.array(times)


def least_of_days(plant: SimulatedPlant, days: int, read: bool = False) -> np.ndarray:
    """Time the steps of a day [s], each the least of several equal days: what other processes do not add to."""
    runs = []
    for _ in range(days):
        plant.reset()
        runs.append(day(plant, read))
    return np.min(runs, axis=0)


def office(days: int = DAYS) -> dict[str, float]:
    """Step a small office with noise, read every measurement, and give the record at the end."""
    building = pilot_building(1, floor_area=600.0, zones=12)
    plant, _ = make(building, size_system(building), "reduced", SPACINGS["reduced"], SensorNoise())
    steps = least_of_days(plant, days, read=True)
    begin = time.thread_time()
    plant.record()
    step = float(steps.mean()) + (time.thread_time() - begin) / len(steps)
    return {"zones": len(building.zone_names), "points": len(plant.columns), "step": step, "per_second": 1.0 / step}


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
        begin = time.thread_time()
        plant.telemetry()
        read = (time.thread_time() - begin) / len(steps)
        least = least_of_days(plant, DAYS) if kind == "reduced" else steps
        volumes = plant.model.network.n_node
        found[kind] = {
            "dx": dx, "volumes": volumes, "states": getattr(plant.model, "order", volumes), **times,
            "day": float(steps.sum()), "step_median": float(np.median(steps)), "step_min": float(steps.min()),
            "undisturbed_day": float(least.sum()), "undisturbed_mean": float(least.mean()),
            "read": read, "balance": abs(plant.balance().residual) / plant.balance().turnover,
        }  # fmt: skip
    gap = np.abs(temperatures["grid"] - temperatures["reduced"])
    return found | {"mean_difference": float(gap.mean()), "max_difference": float(gap.max()), "office": office()}


def report(found: dict[str, Any]) -> str:
    """Lay out the table."""
    grid, reduced, small = found["grid"], found["reduced"], found["office"]
    both = (grid, reduced)
    rows = [
        ["control volumes, states", *(f"{b['volumes']:,}, {b['states']:,}" for b in both), "744 x 1004 cells"],
        ["**one day of 288 steps** [s]", *(f"{b['undisturbed_day']:.3g}" for b in both), f"{288 * PAPER_STEP:,.0f}"],
        [
            "a step, mean (least) [ms]",
            *(f"{1e3 * b['undisturbed_mean']:.3g} ({1e3 * b['step_min']:.3g})" for b in both),
            f"{1e3 * PAPER_STEP:,.0f}",
        ],
        ["model made, factorised or reduced [s]", *(f"{b['make']:.3g}" for b in both), ""],
        ["890 measurements of a step read [ms]", *(f"{1e3 * b['read']:.3g}" for b in both), ""],
        ["energy that a step loses, of its turnover", *(f"{b['balance']:.0e}" for b in both), ""],
    ]
    note = (
        f"{found['zones']} zones, {found['devices']} devices, CPU time of one thread; steps of the reduced model are "
        f"the least of {DAYS} equal days. Zone temperatures of the two differ by {1e3 * found['mean_difference']:.1f} "
        f"mK in the mean, {1e3 * found['max_difference']:.0f} mK at most. An office of {small['zones']} zones, "
        f"reduced, takes {1e6 * small['step']:.0f} µs a step with noise, its {small['points']} points read and "
        f"recorded: {small['per_second']:,.0f} steps a second. {platform.machine()}, {os.cpu_count()} cores, load "
        f"average {os.getloadavg()[0]:.1f}.\n"
    )
    columns = ["", f"grid, {grid['dx']:g} m", f"reduced, from {reduced['dx']:g} m", "the paper's simulator"]
    return markdown(columns, rows) + "\n" + note


def main() -> None:
    """Measure and write the table."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    found = measure()
    text = report(found)
    write(options.out, "closed_loop_speed", text, found, options.publish)
    print(text)


if __name__ == "__main__":
    main()
