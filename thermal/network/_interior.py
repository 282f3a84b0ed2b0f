"""What every zone contains beside its air, whatever its geometry: radiant node, slabs, furniture and windows."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from thermal.network._films import surface_mesh
from thermal.network._graph import GraphBuilder
from thermal.network._materials import WINDOW_RATED_FILM

#: Layers of a slab: two resolve the hours-to-days response of floors and ceilings (chain of two nodes).
SLAB_LAYERS = 2


class Zone:
    """A zone while its network is built: its air volumes with their shares, and its radiant node.

    Parameters
    ----------
    graph : GraphBuilder
        Where volumes and faces go.
    name : str
        Zone name.
    air : ndarray, shape (n_air,)
        Node numbers of its air volumes.
    share : ndarray, shape (n_air,)
        Share of the zone's air in each; sums to 1.
    """

    def __init__(self, graph: GraphBuilder, name: str, air: NDArray[np.int64], share: NDArray[np.float64]) -> None:
        self.graph, self.name, self.air, self.share = graph, name, air, share
        self.number = graph.zones.index(name)
        self.radiant = int(graph.volumes("radiant", self.number)[0])
        self.film = graph.parameter("interior_film_coefficient", name)
        self.radiation = graph.parameter("radiant_coefficient", name)

    def surface(
        self,
        kind: str,
        solid_value: ca.SX,
        solid: NDArray[np.int64] | int,
        area: NDArray[np.float64] | float,
        air: NDArray[np.int64] | None = None,
        depends: tuple[str, ...] = (),
    ) -> None:
        """Add surfaces between this zone and a solid (or a boundary, for a window).

        Parameters
        ----------
        kind : str
            Class name of what lies behind the surface.
        solid_value : casadi.SX
            Conductance from the surface to the solid node [W/m2/K].
        solid : int or ndarray, shape (n,)
            Solid nodes (or a boundary code).
        area : float or ndarray, shape (n,)
            Areas [m2].
        air : ndarray, shape (n,), optional
            The air volume that each surface faces; None spreads one surface over all air of the zone.
        depends : tuple of str
            Parameters inside ``solid_value``.
        """
        to_air, to_radiant, across = surface_mesh(self.film, self.radiation, solid_value)
        graph = self.graph
        key = graph.key(kind, self.name, "interior_film_coefficient", "radiant_coefficient", *depends)
        solid_, area_ = np.atleast_1d(solid), np.atleast_1d(np.asarray(area, float))
        if air is None:
            air_solid, air_area, air_node = (
                np.repeat(solid_, self.air.size),
                np.outer(area_, self.share).ravel(),
                np.tile(self.air, solid_.size),
            )
        else:
            air_solid, air_area, air_node = np.broadcast_to(solid_, air.shape), np.broadcast_to(area_, air.shape), air
        graph.face(f"air-{key}", to_air, air_node, air_solid, air_area)
        graph.face(f"radiant-{key}", to_radiant, self.radiant, solid_, area_)
        graph.face(f"air-radiant past {key}", across, air_node, self.radiant, air_area)

    def slabs(self, area: float) -> None:
        """Floor and ceiling slab, adiabatic at their back: one chain of nodes for both [area: both faces, m2]."""
        graph = self.graph
        coupling = graph.parameter("slab_coupling", self.name)
        heat = graph.parameter("slab_heat_capacity", self.name)
        nodes = graph.volumes("slab", np.full(SLAB_LAYERS, self.number))
        graph.capacity(graph.key("slab", self.name, "slab_heat_capacity"), heat, nodes, area / SLAB_LAYERS)
        self.surface("slab", 2 * SLAB_LAYERS * coupling, nodes[0], area, depends=("slab_coupling",))
        graph.face(
            graph.key("slab-slab", self.name, "slab_coupling"), SLAB_LAYERS * coupling, nodes[:-1], nodes[1:], area
        )

    def furniture(self, floor_area: float) -> None:
        """Furniture: one node, coupled to air and radiant node in the ratio of the films [floor_area: m2]."""
        graph = self.graph
        coupling = graph.parameter("furniture_coupling", self.name)
        heat = graph.parameter("furniture_heat_capacity", self.name)
        node = graph.volumes("furniture", self.number)
        graph.capacity(graph.key("furniture", self.name, "furniture_heat_capacity"), heat, node, floor_area)
        key = graph.key(
            "furniture", self.name, "furniture_coupling", "interior_film_coefficient", "radiant_coefficient"
        )
        total = self.film + self.radiation
        graph.face(f"air-{key}", coupling * self.film / total, self.air, node, floor_area * self.share)
        graph.face(f"radiant-{key}", coupling * self.radiation / total, self.radiant, node, floor_area)

    def window(
        self, u_value: ca.SX, area: float, other: int, air: NDArray[np.int64] | None = None, *, depends: str
    ) -> None:
        """Glass without mass towards boundary ``other``: ``u_value`` [W/m2/K] with the zone's own inside film."""
        pane = 1.0 / (1.0 / u_value - 1.0 / WINDOW_RATED_FILM)
        if air is None:
            self.surface("window", pane, other, area, depends=(depends,))
        else:
            self.surface(
                "window", pane, np.full(air.size, other), np.full(air.size, area / air.size), air, depends=(depends,)
            )
