"""The random air shuffle against its deterministic equivalents: error of the zone mean over reach and zone size.

A room loses heat through one wall and is heated by one diffuser in its middle (the paper's special control volumes).
The mean of many runs of "implicit Euler conduction, then shuffle" is compared with implicit Euler steps in which the
shuffle is a term of the conductance matrix:

- diffusivity: air-air faces carry D_eff, with E|d|² of a zone without end;
- exchange: a star node with the rate (1 − λ) / Δt;
- mixing: a star node with the rate (1/λ − 1) / Δt, which gives J + λ (I − J) in a room without walls and sources.

Run: ``python benchmarks/shuffle_equivalence.py --out results/shuffle [--docs docs] [--runs 300]``; four minutes on one
core. Writes ``shuffle_equivalence.json``, ``.md`` and ``.png``; with ``--docs`` also the figure of ``docs/images`` and
the summary in ``docs/shuffle.md``.
"""

from __future__ import annotations

import argparse
import itertools
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from thermal.shuffle.equivalent import (
    MIXING_EXTENT,
    choose_equivalent,
    effective_diffusivity,
    exchange_rate,
    mean_square_reach,
    mixing_rate,
)
from thermal.shuffle.random import RandomShuffle

matplotlib.use("Agg")
from matplotlib import pyplot as plt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

STEP = 300.0  # [s], the paper's step
N_STEP = 72  # six hours, the paper's horizon
AIR_HEAT_CAPACITY = 1.2 * 1006.0  # [J/m3/K] density times specific heat of air at 20 °C
FILM = 2.5  # [W/m2/K] interior film, the baseline's start value
HEIGHT = 3.0  # [m]
MODELS = {
    "diffusivity": ("`D_eff`", "#0072B2"),
    "exchange": ("`exchange_rate`", "#D55E00"),
    "mixing": ("`mixing_rate`", "#888888"),
}
REACHES = (0.75, 1.15, 1.6, 2.25, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0, 24.0)  # [m]
PROBABILITIES = (0.1, 0.5, 0.95)
CONDUCTIVITIES = (0.0, 1.0, 30.0)  # [W/m/K] of the air, besides the shuffle


def laplacian(left: IntArray, right: IntArray, conductance: float, n: int) -> sp.csr_matrix:
    """Conductance matrix (n, n) [W/K] of links of equal conductance between nodes."""
    nodes = np.concatenate([left, right]), np.concatenate([right, left])
    links = sp.coo_matrix((np.full(2 * left.size, conductance), nodes), shape=(n, n)).tocsr()
    return sp.csr_matrix(sp.diags(np.asarray(links.sum(axis=1)).ravel()) - links)


@dataclass(frozen=True)
class Room:
    """A room of square cells that loses heat through the wall of its first row of cells and is heated."""

    name: str = "square room"
    n_column: int = 24
    n_row: int = 24
    cell_size: float = 0.5  # [m]
    conductivity: float = 0.0  # [W/m/K] of the air, besides the shuffle
    heated: str = "diffuser"  # or "everywhere"

    @property
    def n_cell(self) -> int:
        """Number of cells [-]."""
        return self.n_column * self.n_row

    @property
    def cells(self) -> IntArray:
        """Cell numbers on the plan (n_column, n_row) [-]."""
        return np.arange(self.n_cell).reshape(self.n_column, self.n_row)

    @property
    def capacity(self) -> float:
        """Heat capacity of a cell [J/K]."""
        return AIR_HEAT_CAPACITY * HEIGHT * self.cell_size**2

    @property
    def sides(self) -> tuple[float, float]:
        """Width and depth [m]."""
        return self.n_column * self.cell_size, self.n_row * self.cell_size

    def heat(self) -> FloatArray:
        """Heat of each cell (n_cell,) [W], 1 W in all."""
        heat = np.full(self.n_cell, 1.0 / self.n_cell)
        if self.heated == "diffuser":
            heat[:] = 0.0
            heat[self.cells[self.n_column // 2, self.n_row // 2]] = 1.0
        return heat

    def conduction(self, conductivity: float) -> sp.csr_matrix:
        """Conductance matrix of the air-air faces (n_cell, n_cell) [W/K]."""
        cells = self.cells
        left = np.concatenate([cells[:-1].ravel(), cells[:, :-1].ravel()])
        right = np.concatenate([cells[1:].ravel(), cells[:, 1:].ravel()])
        # square cells: area over distance is the height
        return laplacian(left, right, conductivity * HEIGHT, self.n_cell)

    def step_matrix(self) -> sp.csr_matrix:
        """C/Δt + K without the shuffle (n_cell, n_cell) [W/K]."""
        wall = np.zeros(self.n_cell)
        wall[self.cells[0]] = FILM * HEIGHT * self.cell_size
        return sp.csr_matrix(self.conduction(self.conductivity) + sp.diags(wall + self.capacity / STEP))


def shuffled_runs(room: Room, probability: float, reach: float, n_run: int, seed: int) -> FloatArray:
    """Zone-mean temperature rise of the random shuffle, (n_step, n_run) [K]: all runs are zones of one shuffle."""
    factor = splu(room.step_matrix().tocsc())
    columns, rows = np.divmod(np.arange(room.n_cell), room.n_row)
    positions = np.tile(np.stack([columns, rows], axis=1) * room.cell_size, (n_run, 1))
    zones = np.arange(room.n_cell * n_run).reshape(n_run, room.n_cell)
    shuffle = RandomShuffle(list(zones), positions, probability, reach, seed)
    temperatures = np.zeros((n_run, room.n_cell))
    means = np.empty((N_STEP, n_run))
    for k in range(N_STEP):
        conducted = factor.solve((room.capacity / STEP * temperatures + room.heat()).T).T
        temperatures = shuffle.apply(conducted.ravel()).reshape(temperatures.shape)
        means[k] = temperatures.mean(axis=1)
    return means


def equivalent_runs(room: Room, probability: float, reach: float) -> dict[str, FloatArray]:
    """Zone-mean temperature rise of each equivalent, (n_step,) [K]."""
    diffusivity = effective_diffusivity(probability, mean_square_reach(reach, room.cell_size), STEP)
    diffusing = room.step_matrix() + room.conduction(AIR_HEAT_CAPACITY * diffusivity)
    return {
        "diffusivity": _implicit_euler(room, diffusing),
        "exchange": _implicit_euler(room, _with_star(room, float(exchange_rate(probability, STEP)))),
        "mixing": _implicit_euler(room, _with_star(room, float(mixing_rate(probability, STEP, STEP)))),
    }


def _with_star(room: Room, rate: float) -> sp.csr_matrix:
    """C/Δt + K with every cell tied to a massless node, (n_cell + 1, n_cell + 1) [W/K]."""
    n = room.n_cell
    star = laplacian(np.arange(n), np.full(n, n), rate * room.capacity, n + 1)
    return sp.csr_matrix(sp.block_diag((room.step_matrix(), [[0.0]])) + star)


def _implicit_euler(room: Room, matrix: sp.csr_matrix) -> FloatArray:
    factor = splu(matrix.tocsc())
    temperatures, means = np.zeros(room.n_cell), np.empty(N_STEP)
    right_hand_side = np.zeros(matrix.shape[0])
    for k in range(N_STEP):
        right_hand_side[: room.n_cell] = room.capacity / STEP * temperatures + room.heat()
        temperatures = factor.solve(right_hand_side)[: room.n_cell]
        means[k] = temperatures.mean()
    return means


def settings() -> Iterator[tuple[Room, float]]:
    """Rooms and probabilities of the study."""
    square = Room()
    for conductivity in CONDUCTIVITIES:
        for probability in PROBABILITIES:
            yield replace(square, conductivity=conductivity), probability
    yield replace(square, heated="everywhere"), 0.5
    yield replace(square, name="finer cells", n_column=48, n_row=48, cell_size=0.25), 0.5
    yield Room(name="corridor", n_column=48, n_row=4), 0.5


def study(n_run: int) -> list[dict[str, Any]]:
    """Errors of the zone mean over all settings and reaches, one row each; errors are shares of the largest rise."""
    rows: list[dict[str, Any]] = []
    for room, probability in settings():
        for reach in REACHES:
            runs = shuffled_runs(room, probability, reach, n_run * 576 // room.n_cell, seed=len(rows))
            mean, error = runs.mean(axis=1), runs.std(axis=1, ddof=1) / np.sqrt(runs.shape[1])
            row = asdict(room) | {"probability": probability, "reach": reach, "n_run": runs.shape[1]}
            row["extent_over_reach"] = max(room.sides) / reach
            row["standard_error"] = float(error.max() / mean.max())
            for model, result in equivalent_runs(room, probability, reach).items():
                row[model] = float(np.abs(result - mean).max() / mean.max())
            row["choice"] = choose_equivalent(room.sides, reach)
            rows.append(row)
    return rows


def markdown(header: str, lines: list[str]) -> str:
    """Markdown table of lines of cells, all separated by bars."""
    rule = " | ".join("---" for _ in header.split("|"))
    return "".join(f"| {line} |\n" for line in (header, rule, *lines))


def study_table(rows: list[dict[str, Any]]) -> str:
    """Markdown table of all errors [%]."""
    lines = []
    for row in rows:
        room = f"{row['name']} | {row['conductivity']:g} | {row['heated']} | {row['probability']:g}"
        errors = " | ".join(f"{100 * row[key]:.1f}" for key in (*MODELS, "standard_error"))
        lines.append(f"{room} | {row['extent_over_reach']:.1f} | {errors} | {row['choice']}")
    names = " | ".join(label for label, _ in MODELS.values())
    return markdown(f"room | air [W/m/K] | heated | p | longer side / reach | {names} | ± | choice", lines)


def summary_table(rows: list[dict[str, Any]]) -> str:
    """Markdown table of the median and the largest error [%] over all settings, by longer side over reach."""
    lines = []
    for lower, upper in itertools.pairwise((0.0, 0.75, 1.5, 3.0, 4.0, 5.5, 8.0, 12.0, 32.0)):
        group = [row for row in rows if lower < row["extent_over_reach"] <= upper]
        errors = [[row[model] for row in group] for model in MODELS]
        errors.append([row["exchange" if row["choice"] == "mixing" else "diffusivity"] for row in group])
        cells = [f"{100 * np.median(column):.1f} ({100 * max(column):.1f})" for column in errors]
        lines.append(f"{lower:g} to {upper:g} | {' | '.join(cells)}")
    return markdown(f"longer side / reach | {' | '.join(label for label, _ in MODELS.values())} | chosen", lines)


def figure(rows: list[dict[str, Any]], path: Path) -> None:
    """Plot the error of each equivalent over the reach for the square room with a diffuser."""
    grid, axes = plt.subplots(3, 3, figsize=(10.5, 8.0), sharex=True, sharey=True, layout="constrained")
    for axis_row, conductivity in zip(axes, CONDUCTIVITIES, strict=True):
        for axis, probability in zip(axis_row, PROBABILITIES, strict=True):
            key = (Room.name, Room.heated, conductivity, probability)
            names = ("name", "heated", "conductivity", "probability")
            _plot_errors(axis, [row for row in rows if tuple(row[name] for name in names) == key])
            axis.set_title(f"p = {probability:g}, air {conductivity:g} W/m/K", fontsize=10)
    for axis in axes[:, 0]:
        axis.set_ylabel("error of the zone mean [%]")
    for axis in axes[-1]:
        axis.set_xlabel("reach / side of the room [-]")
    axes[2, 0].legend(fontsize=8, loc="upper left")
    grid.savefig(path, dpi=130)
    plt.close(grid)


def _plot_errors(axis: Any, rows: list[dict[str, Any]]) -> None:
    ratios = np.array([1.0 / row["extent_over_reach"] for row in rows])
    noise = 200.0 * np.array([row["standard_error"] for row in rows])
    axis.fill_between(ratios, 0.0, noise, color="0.85", label="2 standard errors of the Monte Carlo mean")
    for model, (label, colour) in MODELS.items():
        errors = [100.0 * row[model] for row in rows]
        axis.plot(ratios, errors, "o-", color=colour, ms=3.5, lw=1.4, label=label.strip("`"))
    limit = 1.0 / MIXING_EXTENT
    axis.axvline(limit, color="black", lw=0.8, ls="--", label="criterion: diffusivity | mixing")
    axis.set_xscale("log")
    axis.set_xticks([0.1, 0.2, 0.5, 1.0, 2.0], ["0.1", "0.2", "0.5", "1", "2"])
    axis.minorticks_off()
    axis.grid(alpha=0.3)


def fill(page: Path, name: str, table: str) -> None:
    """Replace what stands between ``<!-- name -->`` and ``<!-- end name -->`` of a page by a table."""
    start, end = f"<!-- {name} -->\n", f"<!-- end {name} -->"
    text = page.read_text(encoding="utf-8")
    before, after = text.split(start)[0], text.split(end)[1]
    page.write_text(before + start + table + end + after, encoding="utf-8")


def main() -> None:
    """Run the study and write its tables and figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--docs", type=Path, help="documentation folder to update as well")
    parser.add_argument("--runs", type=int, default=300, help="random runs of a room of 576 cells")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    rows = study(options.runs)
    (options.out / "shuffle_equivalence.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")
    page = f"# Summary\n\n{summary_table(rows)}\n# All settings\n\n{study_table(rows)}"
    (options.out / "shuffle_equivalence.md").write_text(page, encoding="utf-8")
    figure(rows, options.out / "shuffle_equivalence.png")
    if options.docs:
        (options.docs / "images").mkdir(exist_ok=True)
        figure(rows, options.docs / "images" / "shuffle_equivalence.png")
        fill(options.docs / "shuffle.md", "summary", summary_table(rows))
    print(page)


if __name__ == "__main__":
    main()
