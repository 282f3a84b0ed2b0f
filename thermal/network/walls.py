"""Walls of a floor's grid: faces to rooms and outdoors, mass, windows, and nodes through exterior walls."""

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.errors import ModelError
from thermal.network.floor import Floor, Zone
from thermal.network.grid import FACADES, wall_facades
from thermal.network.structure import EXTERIOR_WALL_MASS, INTERIOR_WALL_MASS, STRUCTURE_RESISTANCE, series
from thermal.network.topology import VERTICAL, OuterFaces, Outlook, azimuth_of

#: Share of a cell below which what its chains leave to its middle is round-off [-].
_ROUND_OFF = 1e-9


class Arms:
    """Chains of mass nodes in the half cells between the middle of exterior wall and its rooms and the outdoors.

    They divide resistances that a wall of one node has too, so no steady state depends on their number.

    Parameters
    ----------
    floor : Floor
        Whose walls.
    thickness : float
        Of a wall, one cell of the plan [m].
    conductivity : float
        Of its structure [W/m/K].

    Raises
    ------
    ModelError
        When cells are split, by a number smaller than that of the nodes.
    """

    def __init__(self, floor: Floor, thickness: float, conductivity: float) -> None:
        wanted, split = floor.graph.structure.wall_nodes or 1, round(thickness / floor.grid.cell)
        if wanted > split > 1:
            raise ModelError(
                f"structure.wall_nodes: expected at most {split} with dx = {floor.grid.spacing:g} m, which splits a "
                f"wall of {thickness:g} m into {split} nodes, got {wanted}; leave dx or choose fewer nodes"
            )
        self.floor, self.conductivity = floor, conductivity
        through = wanted if split == 1 else 1
        self.slices = through // 2
        self.slice = floor.grid.cell / through
        self.half = 0.5 * self.slice
        self.odd = bool(through % 2)
        self._grown: list[tuple[IntArray, IntArray, FloatArray]] = []

    def grow(
        self, volume: IntArray, middle: IntArray, far: IntArray, area: FloatArray
    ) -> tuple[IntArray, IntArray, FloatArray]:
        """Put chains between wall volumes and what their faces look at, and return their ends.

        Faces of one volume towards the same air volume, or outdoor, share a chain: theirs would be alike.

        Parameters
        ----------
        volume, middle : ndarray of int, shape (n,)
            Wall volumes of the faces, by their number on the floor and as nodes.
        far : ndarray of int, shape (n,)
            Air volumes as nodes, or the code of a boundary.
        area : ndarray, shape (n,)
            Areas of the faces [m2].

        Returns
        -------
        tuple
            Last node of each chain, what it looks at, and its area [m2]; what was given when there are no chains.
        """
        if self.slices == 0:
            return middle, far, area
        pairs, first, which = np.unique(np.column_stack([volume, far]), axis=0, return_index=True, return_inverse=True)
        total = np.bincount(which.ravel(), area).astype(float)
        open_ = total > 0.0  # behind a cell that is all glass there is no wall
        volume, far, node, area = pairs[open_, 0], pairs[open_, 1], middle[first[open_]], total[open_]
        distance = self.slice if self.odd else self.half
        for _ in range(self.slices):
            further = self.floor.graph.volumes("exterior_wall", np.full(area.size, -1))
            self.floor.graph.face("exterior_wall through", self.conductivity, node, further, area / distance)
            self._grown.append((volume, further, area))
            node, distance = further, self.slice
        return node, far, area

    def spread(self, volume: FloatArray) -> tuple[IntArray, FloatArray, IntArray]:
        """Spread the volume of exterior wall over its nodes.

        A slice holds its area times its thickness. Where the chains of a volume overlap, at a corner of three rooms,
        all of them are scaled to leave its middle one slice, or none when their number is even; where there are fewer
        than two, the middle keeps the rest.

        Parameters
        ----------
        volume : ndarray, shape (n_volume,)
            Of each volume of the floor, without glass [m3].

        Returns
        -------
        tuple
            Nodes, the volume of each [m3], and the number on the floor of the volume that it is of.
        """
        wall = np.flatnonzero(self.floor.grid.token == "#")
        if not self._grown:
            return self.floor.node[wall], volume[wall], wall
        owner, node, area = (np.concatenate([g[k] for g in self._grown]) for k in range(3))
        held = area * self.slice
        natural = np.bincount(owner, held, minlength=volume.size)
        most = volume * (1.0 - (self.slice / self.floor.grid.cell if self.odd else 0.0))
        scale = np.divide(most, natural, out=np.ones_like(most), where=natural > most)
        held = held * scale[owner]
        middle = volume - np.bincount(owner, held, minlength=volume.size)
        middle[middle < _ROUND_OFF * volume] = 0.0
        return (
            np.concatenate([self.floor.node[wall], node]),
            np.concatenate([middle[wall], held]),
            np.concatenate([wall, owner]),
        )


#: Walls by token.
_KINDS = {"#": "exterior_wall", "+": "interior_wall"}

#: Directions in which pairs of volumes are counted once, with those opposite to them.
_FORWARD = {"south": "north", "east": "west"}


class Walls:
    """Walls and windows of one floor while its network is built.

    Parameters
    ----------
    floor : Floor
        Its volumes.
    zones : mapping of str to Zone
        Zones so far, those of this floor among them.
    thickness : float
        Of a wall, one cell of the plan [m].
    orientation : float
        Clockwise from true north to the plan's "up" [deg].
    """

    def __init__(self, floor: Floor, zones: Mapping[str, Zone], thickness: float, orientation: float) -> None:
        self.orientation = orientation
        self.graph, self.grid, self.floor, self.thickness = floor.graph, floor.grid, floor, thickness
        self.zones = {name: zone for name, zone in zones.items() if (floor.grid.token == name).any()}
        self.height = floor.plan.height
        self.conductivity = thickness / STRUCTURE_RESISTANCE
        self.arms = Arms(floor, thickness, self.conductivity)

    def add(self, glazing: Mapping[str, Mapping[str, float]]) -> None:
        """Add all of them.

        Parameters
        ----------
        glazing : mapping
            Glazed area by zone and facade [m2].
        """
        opaque = {facade: self._windows(facade, glazing) for facade in FACADES}
        half = 0.5 * self.grid.cell
        inner = self.graph.parameter("interior_wall_conductivity", factor=self.thickness)
        behind: dict[str, Any] = {"#": self.conductivity / self.arms.half, "+": inner / half}
        for facade in FACADES:
            for token, conductance in behind.items():
                for zone in self.zones.values():
                    self._room_side(facade, zone, token, conductance, opaque[facade] if token == "#" else None)
            self._outer_faces(facade, inner / half, opaque[facade])
            if facade in _FORWARD:
                along = np.minimum(opaque[facade], opaque[_FORWARD[facade]])
                self._between_walls(facade, inner, along)
        self._mass(opaque)

    def _room_side(self, facade: str, zone: Zone, token: str, conductance: Any, share: FloatArray | None) -> None:
        """Surfaces of walls that a zone looks at in a direction; of exterior wall only the ``share`` without glass."""
        air, wall = self.floor.beside(FACADES[facade], zone.name, token)
        if not air.size:
            return
        area = np.full(air.size, self.grid.cell * self.height)
        if share is not None:
            area *= share.ravel()[wall]
        volume = self.grid.volume.ravel()
        nodes, rooms = self.floor.node[volume[wall]], self.floor.node[volume[air]]
        if token == "#":
            nodes, rooms, area = self.arms.grow(volume[wall], nodes, rooms, area)
        kind = _KINDS[token]
        zone.surface(kind, conductance, nodes, area, rooms, depends=(f"{kind}_conductivity",))

    def _outer_faces(self, facade: str, stub: ca.SX, opaque: FloatArray) -> None:
        """Faces to outdoor in a direction: insulation and film on exterior walls, the film on ends of interior ones."""
        graph, w = self.graph, self.thickness
        insulation = graph.parameter("exterior_wall_conductivity", factor=w, facade=facade) / w
        film = graph.parameter("exterior_convection_coefficient", facade=facade)
        values = {"#": series(film, insulation, self.conductivity / self.arms.half), "+": series(film, stub)}
        for token, value in values.items():
            wall, _ = self.floor.beside(FACADES[facade], token, ".")
            if not wall.size:
                continue
            area = np.full(wall.size, self.grid.cell * self.height)
            volume = self.grid.volume.ravel()[wall]
            nodes, outdoor = self.floor.node[volume], np.full(wall.size, graph.boundary("outdoor"))
            if token == "#":
                area *= opaque.ravel()[wall]
                nodes, outdoor, area = self.arms.grow(volume, nodes, outdoor, area)
            depends = ("exterior_convection_coefficient", *(("exterior_wall_conductivity",) if token == "#" else ()))
            key = graph.key(f"{_KINDS[token]}-outdoor", None, *depends, facade=facade)
            graph.face(key, value, nodes, outdoor, area)
            if token == "#":
                outlook = Outlook(azimuth_of(facade, self.orientation), VERTICAL, film, glass=False)
                graph.anatomy.outer.append(OuterFaces(value, nodes, area, outlook))

    def _between_walls(self, facade: str, inner: ca.SX, along: FloatArray) -> None:
        """Faces between wall volumes in a direction; glass leaves the share ``along`` of those of exterior walls."""
        half, spacing = 0.5 * self.grid.cell, self.grid.spacing
        mixed = series(self.conductivity / half, inner / half)
        values = {"##": self.conductivity / spacing, "++": inner / spacing, "#+": mixed, "+#": mixed}
        for pair, value in values.items():
            first, second, faces = self.floor.pairs(FACADES[facade], pair[0], pair[1], along if pair == "##" else None)
            if first.size:
                key = "-".join(sorted(_KINDS[token] for token in pair))
                self.graph.face(key, value, first, second, faces * (self.grid.cell * self.height))

    def _mass(self, opaque: Mapping[str, FloatArray]) -> None:
        """Heat capacity of the walls; that of exterior ones without the share of the glass in them."""
        grid, graph = self.grid, self.graph
        cube = grid.cell**2 * self.height
        least = np.minimum.reduce(list(opaque.values()))
        for token, mass in (("#", EXTERIOR_WALL_MASS), ("+", INTERIOR_WALL_MASS)):
            cells, name = grid.tokens == token, _KINDS[token]
            if not cells.any():
                continue
            density = mass / self.thickness
            graph.nominal[f"{name}_density"] = (density, "kg/m^3")
            weight = least[cells] if token == "#" else np.ones(cells.sum())
            volume = np.bincount(grid.volume[cells], weight * cube, minlength=grid.token.size).astype(float)
            if token == "#":
                node, held, owner = self.arms.spread(volume)
            else:
                owner = np.flatnonzero(grid.token == token)
                node, held = self.floor.node[owner], volume[owner]
            for facade, share in self._shares(name).items():
                mine = share[owner] > 0.0
                if not mine.any():
                    continue
                heat = graph.parameter(f"{name}_heat_capacity", facade=facade)
                key = graph.key(name, None, f"{name}_heat_capacity", facade=facade)
                graph.capacity(key, density * heat, node[mine], held[mine] * share[owner][mine])

    def _shares(self, name: str) -> dict[str | None, FloatArray]:
        """Share of each volume's walls in each facade, of the rest under None; all is rest without facade scope."""
        grid = self.grid
        rest = np.ones(grid.token.size)
        if self.graph.scopes.get(f"{name}_heat_capacity") != "facade":
            return {None: rest}
        cells = grid.tokens == "#"
        count = np.bincount(grid.volume[cells], minlength=rest.size)
        shares: dict[str | None, FloatArray] = {}
        for facade, of_cell in wall_facades(grid).items():
            cells_of = np.bincount(grid.volume[cells], of_cell[cells], minlength=rest.size)
            shares[facade] = np.divide(cells_of, count, out=np.zeros_like(rest), where=count > 0)
            rest = rest - shares[facade]
        rest[rest < 1e-9] = 0.0
        return {**shares, **({None: rest} if rest[grid.token == "#"].any() else {})}

    def _windows(self, facade: str, glazing: Mapping[str, Mapping[str, float]]) -> FloatArray:
        """Add the windows of a facade; returns the share of each cell of exterior wall that is not glass."""
        grid = self.grid
        row_step, column_step = FACADES[facade]
        share = np.ones(grid.tokens.shape)
        for name, zone in self.zones.items():
            area = float(glazing.get(name, {}).get(facade, 0.0))
            if area <= 0.0:
                continue
            rows, columns, depth = _facade_cells(grid.tokens, name, (row_step, column_step))
            if rows.size == 0:
                continue
            exposed = rows.size * grid.cell * self.height
            u_value = self.graph.parameter("window_u_value", name, facade=facade)
            air = self.floor.node[grid.volume[rows, columns]]
            zone.window(u_value, area, air, facade, azimuth_of(facade, self.orientation))
            for k in range(1, depth + 1):
                share[rows + k * row_step, columns + k * column_step] = max(0.0, 1.0 - area / exposed)
        return share


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
