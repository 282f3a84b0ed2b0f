"""More than one node through the exterior walls of a plan: chains from the middle of a cell to its faces."""

from __future__ import annotations

import numpy as np

from thermal._types import FloatArray, IntArray
from thermal.errors import ModelError
from thermal.network.floor import Floor

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
                f"wall of {thickness:g} m into {split} nodes, came {wanted}; leave dx or choose fewer nodes"
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
