"""The control volumes of one floor, the air of its zones and the faces between what lies side by side."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.case.building import FloorPlan
from thermal.errors import ModelError
from thermal.network.graph import GraphBuilder
from thermal.network.grid import FACADES, FloorGrid
from thermal.network.interior import Zone
from thermal.network.materials import AIR_CONDUCTIVITY, SHUFFLE_STEP
from thermal.shuffle.equivalent import choose_equivalent, effective_diffusivity, exchange_rate, mean_square_reach
from thermal.units import AIR_HEAT_CAPACITY


class Floor:
    """One floor while its network is built: its control volumes, in the order of the grid.

    Parameters
    ----------
    graph : GraphBuilder
        Where volumes and faces go.
    plan : FloorPlan
        The floor.
    grid : FloorGrid
        Its cells.
    number : int
        Of the floor, lowest first.
    """

    def __init__(self, graph: GraphBuilder, plan: FloorPlan, grid: FloorGrid, number: int) -> None:
        self.graph, self.plan, self.grid = graph, plan, grid
        token = grid.token
        names = [z for z in graph.zones if (token == z).any()]
        zone = np.full(token.size, -1, dtype=np.int64)
        for name in names:
            zone[token == name] = graph.zones.index(name)
        kind = np.where(token == "#", "exterior_wall", np.where(token == "+", "interior_wall", "air"))
        place = np.column_stack([np.full(token.size, number), grid.place])
        self.node = np.empty(token.size, dtype=np.int64)
        for k in ("air", "exterior_wall", "interior_wall"):
            mask = kind == k
            if mask.any():
                self.node[mask] = graph.volumes(k, zone[mask], place[mask])
        self.cells = np.bincount(grid.volume[grid.volume >= 0], minlength=token.size)

    def zone(self, name: str, area: float, density: float, reach: float | None, mean_shuffle: bool) -> Zone:
        """Air of one zone with its shuffle, slabs and furniture."""
        graph, grid = self.graph, self.grid
        mine = grid.token == name
        air, count = self.node[mine], self.cells[mine]
        zone = Zone(graph, name, air, count / count.sum())
        heat = density * AIR_HEAT_CAPACITY
        graph.capacity("air", heat, air, area * self.plan.height * zone.share)
        if air.size > 1:
            self._air(zone, area, heat, reach, mean_shuffle)
        zone.slabs(area)
        zone.furniture(area)
        return zone

    def _air(self, zone: Zone, area: float, heat: float, reach: float | None, mean_shuffle: bool) -> None:
        """Conduction between air volumes, and the shuffle's mean: a star node or a diffusivity (`thermal.shuffle`)."""
        graph, grid = self.graph, self.grid
        conductivity = ca.SX(AIR_CONDUCTIVITY)
        name = "air-air"
        if mean_shuffle:
            probability = graph.parameter("shuffle_probability", zone.name)
            rows, columns = np.nonzero(grid.tokens == zone.name)
            extent = ((np.ptp(columns) + 1) * grid.cell, (np.ptp(rows) + 1) * grid.cell)
            if reach is None or choose_equivalent(extent, reach) == "mixing":
                star = graph.volumes("mixing", zone.number)
                rate = exchange_rate(probability, SHUFFLE_STEP)
                zone.mean = int(star[0])
                key = graph.key("mixing", zone.name, "shuffle_probability")
                graph.face(key, rate * heat, zone.air, star, area * self.plan.height * zone.share)
            else:
                diffusivity = effective_diffusivity(probability, mean_square_reach(reach, grid.cell), SHUFFLE_STEP)
                conductivity = AIR_CONDUCTIVITY + diffusivity * heat
                name = graph.key("air-air diffusing", zone.name, "shuffle_probability")
        for step in (FACADES["south"], FACADES["east"]):
            first, second, faces = self.pairs(step, zone.name, zone.name)
            graph.face(name, conductivity, first, second, faces * grid.cell * self.plan.height / grid.spacing)

    def diffuser_weight(self, name: str, mask: NDArray[np.bool_] | None) -> FloatArray:
        """Share of the zone's heat in each of its air volumes, sums to 1."""
        grid = self.grid
        split = (grid.tokens.shape[0] - 2) // self.plan.tokens.shape[0]
        cells = grid.tokens == name
        if mask is not None:
            if np.shape(mask) != self.plan.tokens.shape:
                raise ModelError(
                    f"diffusers of {name}: expected a mask of the plan's shape {self.plan.tokens.shape}, "
                    f"came {np.shape(mask)}"
                )
            if not (mask & (np.asarray(self.plan.tokens) == name)).any():
                raise ModelError(f"diffusers of {name}: expected at least one cell of the zone, came none")
            cells &= np.pad(np.repeat(np.repeat(mask, split, axis=0), split, axis=1), 1)
        count = np.bincount(grid.volume[cells], minlength=grid.token.size)[grid.token == name]
        return np.asarray(count / count.sum(), dtype=float)

    def beside(self, step: tuple[int, int], a: str, b: str) -> tuple[IntArray, IntArray]:
        """Flat numbers of the cells of token a and of those of token b beyond them in a direction."""
        here, there = self.grid.neighbours(step)
        tokens = self.grid.tokens.ravel()
        keep = (tokens[here] == a) & (tokens[there] == b)
        return here[keep], there[keep]

    def pairs(
        self, step: tuple[int, int], a: str, b: str, share: FloatArray | None = None
    ) -> tuple[IntArray, IntArray, FloatArray]:
        """Pairs of volumes of tokens a and b across faces in a direction, and how many cell faces they share."""
        here, there = self.beside(step, a, b)
        volume = self.grid.volume.ravel()
        first, second = volume[here], volume[there]
        apart = first != second
        pairs, which = np.unique(np.column_stack([first[apart], second[apart]]), axis=0, return_inverse=True)
        # glass that stands in a wall of several cells leaves less of the faces between them
        part = None if share is None else np.maximum(share.ravel()[here], share.ravel()[there])[apart]
        faces = np.bincount(which.ravel(), part, minlength=len(pairs))
        return self.node[pairs[:, 0]], self.node[pairs[:, 1]], faces.astype(float)
