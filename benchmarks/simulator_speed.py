"""Speed of the grid model at the size of the paper's pilot building, beside what the memory allows.

The building is the generated pilot (two floors, 6,317 m2, 123 zones, seed 0) at 1, 0.5 and 0.25 m between volumes:
factorisation, one step of implicit Euler and of TR-BDF2, six hours (72 steps of 5 minutes) with the forward
sensitivities of the paper's eight parameters, and one random shuffle. Beside them, whatever the distance, drawing the
building, and one step of a plant with a terminal in each of its zones.

A step must read the factors L and U once. Its bound is their size - 8 byte a value and 4 byte an index for each
nonzero - over the bandwidth of one core, measured in the same run as the best of several reductions of an array far
larger than the caches. It is given for the complete factors and for those that `thermal` keeps, which lack what lies
below 1e-20 of its column. TR-BDF2 reads the factors twice; so does a step with sensitivities, once for the state and
once for all slopes together.

Times are CPU times of the process on one thread, so that other processes count less; but they share cache and memory,
so each is a median, with the minimum in brackets.

Run: ``python benchmarks/simulator_speed.py --out results/speed [--publish]``; a minute on one core. Writes
``simulator_speed.json`` and ``.md``; with ``--publish`` also the table between its marks.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from _pilot import SEED, pilot, plant_of
from _table import markdown, write
from _threads import use_one_thread
from scipy.sparse.linalg import splu

from mpc.scenario.scenario import zone_areas
from thermal import Building, SymbolicModel, build_network
from thermal.components.component import Conditions
from thermal.model.factor import SparseSolver, factorise
from thermal.model.matrices import Matrices
from thermal.model.step import IMPLICIT_EULER, TR_BDF2, Scheme, Stepper
from thermal.network.network import ThermalNetwork
from thermal.pilot.building import generate_office
from thermal.shuffle.random import RandomShuffle
from thermal.system.plant import HvacPlant

FloatArray = npt.NDArray[np.float64]

SPACINGS = (1.0, 0.5, 0.25)  # m
STEP = 300.0  # s, the paper's
N_STEP = 72  # six hours, the paper's horizon
BANDWIDTH_BYTES = 800_000_000  # far more than any cache
VALUE_BYTES, INDEX_BYTES = 8, 4  # of a stored nonzero
PARAMETERS = (
    "exterior_convection_coefficient",
    "exterior_wall_conductivity",
    "exterior_wall_heat_capacity",
    "interior_wall_conductivity",
    "interior_wall_heat_capacity",
    "shuffle_probability",
    "interior_film_coefficient",
    "radiant_coefficient",
)


def timed(function: Callable[[], object], repeats: int) -> dict[str, float]:
    """Median and minimum CPU time and median wall time of a call [s], after one call that is not counted."""
    function()
    cpu, wall = np.empty(repeats), np.empty(repeats)
    for i in range(repeats):
        cpu_0, wall_0 = time.process_time(), time.perf_counter()
        function()
        cpu[i], wall[i] = time.process_time() - cpu_0, time.perf_counter() - wall_0
    return {"cpu_median": float(np.median(cpu)), "cpu_min": float(cpu.min()), "wall_median": float(np.median(wall))}


def read_bandwidth(repeats: int = 15) -> float:
    """Best rate at which one core reads an array from memory [byte/s]."""
    array = np.ones(BANDWIDTH_BYTES // 8)
    best = min(timed(function, repeats)["cpu_min"] for function in (array.sum, array.max, lambda: array.dot(array)))
    return array.nbytes / best


def eight_parameters(model: SymbolicModel) -> Matrices:
    """Assemble the model at its start, with the slopes of the paper's parameters only."""
    names = [p.name for p in model.network.parameters]
    matrices = model.matrices(model.network.start(), sensitivities=True)
    chosen = [names.index(name) for name in PARAMETERS]
    return replace(
        matrices,
        capacity_sensitivities=[matrices.capacity_sensitivities[i] for i in chosen],
        flow_sensitivities=[matrices.flow_sensitivities[i] for i in chosen],
    )


def factor_bytes(system: sp.csr_matrix) -> tuple[int, int]:
    """Bytes of the complete factors L and U (minimum degree on A + A^T, no pivoting), and of those that are kept."""
    complete = splu(
        sp.csc_matrix(system), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    kept = SparseSolver(system)
    each = VALUE_BYTES + INDEX_BYTES
    return (complete.L.nnz + complete.U.nnz) * each, kept.nonzeros * each


class Replay:
    """Steps a model over seeded inputs, forwards in time from call to call.

    Parameters
    ----------
    matrices : Matrices
        The model.
    network : ThermalNetwork
        What it was made from.
    scheme : Scheme
        Time stepping.
    """

    def __init__(self, matrices: Matrices, network: ThermalNetwork, scheme: Scheme = IMPLICIT_EULER) -> None:
        self.stepper = Stepper(matrices, STEP, scheme)
        rng = np.random.default_rng(SEED)
        self.heat = rng.uniform(-1000.0, 1000.0, (N_STEP, len(network.zones), 1))
        self.boundary = 283.15 + 5.0 * rng.standard_normal((N_STEP, network.n_boundary, 1))
        self.states = np.full((matrices.n, 1), 293.15)
        self.row = 0

    def step(self) -> None:
        """One step."""
        row = self.row = (self.row + 1) % N_STEP
        self.states = self.stepper.advance(self.states, self.boundary[row], self.heat[row])[0]

    def sensitivities(self, n_parameter: int) -> FloatArray:
        """Six hours with forward sensitivities; zone means' slopes at the end, shape (n_zone, n_parameter)."""
        states, slopes = self.states, np.zeros((self.states.shape[0], n_parameter))
        for row in range(N_STEP):
            states, _, slopes, mean = self.stepper.advance(
                states, self.boundary[row], self.heat[row], sensitivities=slopes
            )
        return mean


def random_shuffle(network: ThermalNetwork) -> tuple[RandomShuffle, FloatArray]:
    """Make the paper's shuffle over whole zones with p = 0.5, and temperatures for it."""
    air = np.flatnonzero(network.kind == "air")
    cells = [np.flatnonzero(network.zone[air] == zone) for zone in range(len(network.zones))]
    positions = network.place[air][:, 1:] * float(network.spacing or 0.0)
    temperatures = np.random.default_rng(SEED).normal(293.15, 1.0, air.size)
    return RandomShuffle(cells, positions, 0.5, None, SEED), temperatures


def measure(building: Building, dx: float, bandwidth: float) -> dict[str, Any]:
    """All times at one spacing [s], with the bounds of what reads the factors."""
    network = build_network(building, dx=dx)
    matrices = eight_parameters(SymbolicModel(network))
    system = sp.csr_matrix(matrices.capacity + STEP * matrices.flow[:, : matrices.n])
    size, kept = factor_bytes(system)
    repeats = int(np.clip(4e6 / matrices.n, 41, 401))
    euler, bdf2 = Replay(matrices, network), Replay(matrices, network, TR_BDF2)
    shuffle, temperatures = random_shuffle(network)
    times = {
        "factorisation": timed(lambda: factorise(system), 5),
        "step": timed(euler.step, repeats),
        "tr_bdf2_step": timed(bdf2.step, repeats),
        "sensitivities": timed(lambda: euler.sensitivities(len(PARAMETERS)), 3),
        "shuffle": timed(lambda: shuffle.apply(temperatures), repeats),
    }
    reads = {"step": 1, "tr_bdf2_step": 2, "sensitivities": 2 * N_STEP}
    for name, count in reads.items():
        times[name] |= {"bound": count * size / bandwidth, "kept_bound": count * kept / bandwidth}
    sizes = {"volumes": matrices.n, "cells": int((network.place[:, 0] >= 0).sum()), "bytes": size, "kept_bytes": kept}
    return {"dx": dx, "repeats": repeats, **sizes, "times": times}


def plant_steps(building: Building, count: int) -> Callable[[], None]:
    """Make a run of steps of the building's plant, in a cool morning."""
    areas = zone_areas(building)
    system, n = plant_of(areas), len(areas)
    plant, state = HvacPlant(system), HvacPlant(system).start(supply_water_temperature=330.0)
    conditions = Conditions(np.linspace(290.0, 300.0, n), np.full(n, 294.0), np.full(n, 297.0), 270.0)
    actions = system.actions(supply_air_temperature_setpoint=287.0, supply_water_temperature_setpoint=335.0)

    def run() -> None:
        for _ in range(count):
            plant.step(state, conditions, actions, STEP)

    return run


def apart_from_the_grid(building: Building) -> dict[str, float]:
    """CPU times of drawing the building [s] and of a step of its plant [s]."""
    count = 200
    return {
        "drawing": timed(lambda: generate_office(SEED), 3)["cpu_median"],
        "plant_step": timed(plant_steps(building, count), 7)["cpu_median"] / count,
    }


def report(rows: list[dict[str, Any]], bandwidth: float, apart: dict[str, float]) -> str:
    """Lay out the table, one column a spacing, and what it was measured on."""

    def times(name: str, unit: float, digits: int) -> list[str]:
        measured = [row["times"][name] for row in rows]
        return [f"{t['cpu_median'] / unit:.{digits}f} ({t['cpu_min'] / unit:.{digits}f})" for t in measured]

    def ratios(name: str) -> list[str]:
        measured = [row["times"][name] for row in rows]
        return [f"{t['cpu_median'] / t['bound']:.1f} ({t['cpu_median'] / t['kept_bound']:.1f})" for t in measured]

    step = [row["times"]["step"] for row in rows]
    lines = [
        ["control volumes", *(f"{row['volumes']:,}" for row in rows)],
        ["of these on the plans' grid", *(f"{row['cells']:,}" for row in rows)],
        ["L and U: complete (kept) [MB]", *(f"{r['bytes'] / 1e6:.1f} ({r['kept_bytes'] / 1e6:.1f})" for r in rows)],
        ["factorisation [ms]", *times("factorisation", 1e-3, 0)],
        [
            "bound of a step: complete (kept) [ms]",
            *(f"{1e3 * t['bound']:.2f} ({1e3 * t['kept_bound']:.2f})" for t in step),
        ],
        ["**implicit Euler step** [ms]", *times("step", 1e-3, 2)],
        ["wall time [ms]", *(f"{1e3 * t['wall_median']:.2f}" for t in step)],
        ["over the bound: complete (kept)", *ratios("step")],
        ["TR-BDF2 step [ms]", *times("tr_bdf2_step", 1e-3, 2)],
        ["over the bound: complete (kept)", *ratios("tr_bdf2_step")],
        ["**72 steps, 8 sensitivities** [s]", *times("sensitivities", 1.0, 2)],
        ["over the bound: complete (kept)", *ratios("sensitivities")],
        ["random shuffle [ms]", *times("shuffle", 1e-3, 2)],
    ]
    note = (
        f"Drawing the building takes {apart['drawing']:.1f} s, a step of its plant {1e6 * apart['plant_step']:.0f} µs. "
        f"CPU time of one thread, median (minimum). Bounds: bytes of L and U over {bandwidth / 1e9:.1f} GB/s, the read "
        f"bandwidth of one core in the same run; complete factors, and (in brackets) those kept without entries below "
        f"1e-20 of their column. {platform.machine()}, {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}.\n"
    )
    return markdown(["distance between volumes", *(f"{row['dx']:g} m" for row in rows)], lines) + "\n" + note


def main() -> None:
    """Measure and write the table."""
    use_one_thread()
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    bandwidth = read_bandwidth()
    building = pilot()
    rows = [measure(building, dx, bandwidth) for dx in SPACINGS]
    apart = apart_from_the_grid(building)
    text = report(rows, bandwidth, apart)
    data = {
        "bandwidth": bandwidth, "apart": apart, "seed": SEED, "step": STEP, "steps": N_STEP, "parameters": PARAMETERS,
        "rows": rows,
    }  # fmt: skip
    write(options.out, "simulator_speed", text, data, options.publish)
    print(text)


if __name__ == "__main__":
    main()
