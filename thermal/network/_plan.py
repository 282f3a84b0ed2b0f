"""From floor plans to control volumes and faces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal.case import Building, FloorPlan, FloorPlans, zone_floor_areas
from thermal.errors import ModelError
from thermal.network._films import series
from thermal.network._graph import GraphBuilder, ThermalNetwork
from thermal.network._grid import FACADES, FloorGrid, floor_grid
from thermal.network._interior import Zone
from thermal.network._materials import (
    AIR_CONDUCTIVITY,
    EXTERIOR_WALL_MASS,
    INTERIOR_WALL_MASS,
    SHUFFLE_STEP,
    STRUCTURE_RESISTANCE,
)
from thermal.parameters import Scope
from thermal.shuffle import choose_equivalent, effective_diffusivity, exchange_rate, mean_square_reach
from thermal.units import AIR_HEAT_CAPACITY, air_density

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def plan_network(
    building: Building,
    plans: FloorPlans,
    dx: float | None = None,
    reach: float | None = None,
    scopes: Mapping[str, Scope] | None = None,
    diffusers: Mapping[str, NDArray[np.bool_]] | None = None,
    mean_shuffle: bool = True,
) -> ThermalNetwork:
    """Build the network of a building given by floor plans.

    Parameters
    ----------
    building : Building
        For its location, zones and airflows.
    plans : FloorPlans
        Its geometry.
    dx : float, optional
        Distance between control volumes [m]; the plan's cell size by default.
    reach : float, optional
        Reach of the shuffle [m]; None is the whole zone.
    scopes : mapping of str to {"global", "zone"}, optional
        Parameters with one value a zone.
    diffusers : mapping of str to ndarray of bool, optional
        Per zone, a mask of the shape of its floor's plan with the cells that have a diffuser; all air cells by default.
    mean_shuffle : bool
        Whether the mean of the shuffle is a term of K; off for a simulator that shuffles at random.

    Returns
    -------
    ThermalNetwork
        Boundary ``outdoor``; slabs adiabatic at their back; no air exchange between zones (both are effects of the
        catalogue).
    """
    graph = GraphBuilder(building.zone_names, ("outdoor",), scopes or {})
    unknown = sorted(set(diffusers or {}) - set(building.zone_names))
    if unknown:
        raise ModelError(f"diffusers: zones {unknown} are not of this building; it has {list(building.zone_names)}")
    areas = zone_floor_areas(plans)
    density = air_density(building.location.elevation)
    diffuser_weight: dict[int, FloatArray] = {}
    zones: dict[str, Zone] = {}
    shapes = []
    for number, plan in enumerate(plans.floors):
        grid = floor_grid(plan, plans.cell_size, dx)
        shapes.append(grid.shape)
        floor = _Floor(graph, plan, grid, number, plans.cell_size)
        for name in (z for z in building.zone_names if (grid.token == z).any()):
            zones[name] = floor.zone(name, areas[name], density, reach, mean_shuffle)
            mask = (diffusers or {}).get(name)
            diffuser_weight[zones[name].number] = floor.diffuser_weight(name, mask)
        floor.walls(zones, plans.glazing)
    n = graph.size
    columns = [(z.air, np.full(z.air.size, z.number), diffuser_weight[z.number]) for z in zones.values()]
    node = np.concatenate([c[0] for c in columns])
    column = np.concatenate([c[1] for c in columns])
    share = np.concatenate([c[2] for c in columns])
    mean = np.concatenate([z.share for z in zones.values()])
    shape = (n, len(graph.zones))
    heating = sp.csr_matrix((share, (node, column)), shape=shape)
    observation = sp.csr_matrix((mean, (column, node)), shape=shape[::-1])
    flows = tuple((graph.zones.index(a.source), graph.zones.index(a.target)) for a in building.airflows)
    return graph.finish(observation, heating, flows, grid.spacing, tuple(shapes))


class _Floor:
    """Volumes and faces of one floor."""

    def __init__(self, graph: GraphBuilder, plan: FloorPlan, grid: FloorGrid, number: int, wall: float) -> None:
        self.graph, self.plan, self.grid, self.wall = graph, plan, grid, wall
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
        zone.slabs(2.0 * area)
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
                key = graph.key("mixing", zone.name, "shuffle_probability")
                graph.face(key, rate * heat, zone.air, star, area * self.plan.height * zone.share)
            else:
                diffusivity = effective_diffusivity(probability, mean_square_reach(reach, grid.cell), SHUFFLE_STEP)
                conductivity = AIR_CONDUCTIVITY + diffusivity * heat
                name = graph.key("air-air diffusing", zone.name, "shuffle_probability")
        for step in (FACADES["south"], FACADES["east"]):
            first, second, faces = self._pairs(step, zone.name, zone.name)
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

    def walls(self, zones: Mapping[str, Zone], glazing: Mapping[str, Mapping[str, float]]) -> None:
        """Exterior and interior walls, windows and their faces."""
        graph, grid, height = self.graph, self.grid, self.plan.height
        present = {n: z for n, z in zones.items() if (grid.token == n).any()}
        opaque = self._opaque_share(present, glazing)
        w = self.wall
        structure = w / STRUCTURE_RESISTANCE
        half = 0.5 * grid.cell
        inner = graph.parameter("interior_wall_conductivity", factor=w)
        insulation = graph.parameter("exterior_wall_conductivity", factor=w) / w
        film = graph.parameter("exterior_convection_coefficient")
        solid_of = {"#": ("exterior_wall", structure / half), "+": ("interior_wall", inner / half)}
        for facade, step in FACADES.items():
            for token, (kind, conductance) in solid_of.items():
                for zone in present.values():
                    self._room_side(zone, kind, conductance, step, token, opaque[facade] if token == "#" else None)
            face = grid.cell * height
            self._outside(
                step, "#", "exterior_wall-outdoor", series(film, insulation, structure / half), opaque[facade]
            )
            self._outside(step, "+", "interior_wall-outdoor", series(film, inner / half), None)
            if facade in ("south", "east"):
                pairs = (("#", "#", structure / grid.spacing), ("+", "+", inner / grid.spacing))
                mixed = series(structure / half, inner / half)
                for a, b, value in (*pairs, ("#", "+", mixed), ("+", "#", mixed)):
                    along = np.minimum(opaque[facade], opaque["north" if facade == "south" else "west"])
                    first, second, faces = self._pairs(step, a, b, along if a == b == "#" else None)
                    if first.size:
                        kinds = sorted({solid_of[a][0], solid_of[b][0]})
                        graph.face("-".join(kinds if len(kinds) > 1 else kinds * 2), value, first, second, faces * face)
        self._wall_mass(opaque)

    def _wall_mass(self, opaque: Mapping[str, FloatArray]) -> None:
        graph, grid = self.graph, self.grid
        cube = grid.cell**2 * self.plan.height
        least = np.minimum.reduce(list(opaque.values()))
        for token, name, mass in (
            ("#", "exterior_wall", EXTERIOR_WALL_MASS),
            ("+", "interior_wall", INTERIOR_WALL_MASS),
        ):
            mine = grid.token == token
            if not mine.any():
                continue
            density = mass / self.wall
            graph.nominal[f"{name}_density"] = (density, "kg/m^3")
            cells = grid.tokens == token
            weight = least[cells] if token == "#" else np.ones(cells.sum())
            volume = np.bincount(grid.volume[cells], weight * cube, minlength=grid.token.size)[mine]
            graph.capacity(name, density * graph.parameter(f"{name}_heat_capacity"), self.node[mine], volume)

    def _pairs(
        self, step: tuple[int, int], a: str, b: str, share: FloatArray | None = None
    ) -> tuple[IntArray, IntArray, FloatArray]:
        """Pairs of volumes of tokens a and b across faces in a direction, and how many cell faces they share."""
        here, there = self.grid.neighbours(step)
        tokens, volume = self.grid.tokens.ravel(), self.grid.volume.ravel()
        keep = (tokens[here] == a) & (tokens[there] == b)
        first, second = volume[here[keep]], volume[there[keep]]
        apart = first != second
        pairs, which = np.unique(np.column_stack([first[apart], second[apart]]), axis=0, return_inverse=True)
        # glass that stands in a wall of several cells leaves less of the faces between them
        part = None if share is None else np.maximum(share.ravel()[here[keep]], share.ravel()[there[keep]])[apart]
        faces = np.bincount(which.ravel(), part, minlength=len(pairs))
        return self.node[pairs[:, 0]], self.node[pairs[:, 1]], faces.astype(float)

    def _room_side(
        self, zone: Zone, kind: str, conductance: Any, step: tuple[int, int], token: str, share: FloatArray | None
    ) -> None:
        here, there = self.grid.neighbours(step)
        tokens, volume = self.grid.tokens.ravel(), self.grid.volume.ravel()
        keep = (tokens[here] == zone.name) & (tokens[there] == token)
        if keep.any():
            area = np.full(keep.sum(), self.grid.cell * self.plan.height)
            if share is not None:
                area *= share.ravel()[there[keep]]
            zone.surface(kind, conductance, self.node[volume[there[keep]]], area, self.node[volume[here[keep]]],
                         depends=(f"{kind}_conductivity",))  # fmt: skip

    def _outside(self, step: tuple[int, int], token: str, key: str, value: Any, share: FloatArray | None) -> None:
        here, there = self.grid.neighbours(step)
        tokens, volume = self.grid.tokens.ravel(), self.grid.volume.ravel()
        keep = (tokens[here] == token) & (tokens[there] == ".")
        if keep.any():
            area = np.full(keep.sum(), self.grid.cell * self.plan.height)
            if share is not None:
                area *= share.ravel()[here[keep]]
            self.graph.face(key, value, self.node[volume[here[keep]]], self.graph.boundary("outdoor"), area)

    def _opaque_share(
        self, zones: Mapping[str, Zone], glazing: Mapping[str, Mapping[str, float]]
    ) -> dict[str, FloatArray]:
        """Per facade, the share of each exterior wall cell that is not glass; adds the windows themselves."""
        grid, graph = self.grid, self.graph
        shares = {}
        tokens = grid.tokens
        for facade, (dr, dc) in FACADES.items():
            share = np.ones(tokens.shape)
            for name, zone in zones.items():
                area = float(glazing.get(name, {}).get(facade, 0.0))
                if area <= 0.0:
                    continue
                rows, columns, depth = _facade_cells(tokens, name, (dr, dc))
                if rows.size == 0:
                    continue
                exposed = rows.size * grid.cell * self.plan.height
                air = self.node[grid.volume[rows, columns]]
                u_value = graph.parameter("window_u_value", name)
                zone.window(u_value, area, graph.boundary("outdoor"), air, depends="window_u_value")
                for k in range(1, depth + 1):
                    share[rows + k * dr, columns + k * dc] = max(0.0, 1.0 - area / exposed)
            shares[facade] = share
        return shares


def _facade_cells(tokens: NDArray[np.str_], zone: str, step: tuple[int, int]) -> tuple[IntArray, IntArray, int]:
    """Air cells of a zone behind a wall to the outside in one direction, and the thickness of that wall in cells.

    A wall that runs on in that direction before it ends outside is another facade's, seen from its end.
    """
    rows, columns = np.nonzero(tokens == zone)
    depth = np.zeros(rows.size, dtype=np.int64)
    wall = np.ones(rows.size, dtype=bool)
    while wall.any():
        r, c = rows + (depth + 1) * step[0], columns + (depth + 1) * step[1]
        wall &= tokens[np.clip(r, 0, tokens.shape[0] - 1), np.clip(c, 0, tokens.shape[1] - 1)] == "#"
        depth[wall] += 1
    beyond = tokens[rows + (depth + 1) * step[0], columns + (depth + 1) * step[1]]
    outside = (depth > 0) & (beyond == ".")
    if not outside.any():
        return rows[:0], columns[:0], 0
    thickness = int(depth[outside].min())
    mine = outside & (depth == thickness)
    return rows[mine], columns[mine], thickness
