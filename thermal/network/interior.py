"""What every zone contains beside its air, whatever its geometry: radiant node, slabs, furniture and windows."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from thermal.network.films import series, surface_mesh
from thermal.network.graph import GraphBuilder
from thermal.network.materials import RATED_OUTSIDE_FILM, WINDOW_RATED_FILM
from thermal.network.topology import VERTICAL, OuterFaces, Outlook, Pane, Room

#: Parameters of the inside films with a radiant node, and of the one film without.
_FILMS = {True: ("interior_film_coefficient", "radiant_coefficient"), False: ("combined_film_coefficient",)}


class Zone:
    """A zone while its network is built: its air volumes with their shares, its radiant node and its films.

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
        self.film_names = _FILMS[graph.structure.radiant]
        self._inside: tuple[tuple[ca.SX, ...], int] | None = None
        self.mean = int(air[0]) if air.size == 1 else -1
        self._floor: tuple[int, ...] = ()
        self._ceiling: tuple[int, ...] = ()
        self._furniture = -1
        if graph.structure.furniture:
            self.inside()

    def inside(self) -> tuple[tuple[ca.SX, ...], int]:
        """Films of the zone's surfaces and its radiant node (-1 without), made where the first surface needs them.

        A zone that has none, with no wall and nothing in it, has no radiant node: it would make the system singular.
        """
        if self._inside is None:
            node = int(self.graph.volumes("radiant", self.number)[0]) if self.graph.structure.radiant else -1
            self._inside = (tuple(self.graph.parameter(n, self.name) for n in self.film_names), node)
        return self._inside

    def surface(
        self,
        kind: str,
        solid_value: ca.SX,
        solid: NDArray[np.int64] | int,
        area: NDArray[np.float64] | float,
        air: NDArray[np.int64] | None = None,
        depends: tuple[str, ...] = (),
        facade: str | None = None,
        outlook: Outlook | None = None,
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
        facade : str, optional
            Facade that these belong to.
        outlook : Outlook, optional
            How a window looks outside.
        """
        graph = self.graph
        films, radiant = self.inside()
        key = graph.key(kind, self.name, *self.film_names, *depends, facade=facade)
        solid_, area_ = np.atleast_1d(solid), np.atleast_1d(np.asarray(area, float))
        if air is None:
            air_solid, air_area, air_node = (
                np.repeat(solid_, self.air.size),
                np.outer(area_, self.share).ravel(),
                np.tile(self.air, solid_.size),
            )
        else:
            air_solid, air_area, air_node = np.broadcast_to(solid_, air.shape), np.broadcast_to(area_, air.shape), air
        if radiant < 0:
            through = series(*films, solid_value)
            graph.face(f"air-{key}", through, air_node, air_solid, air_area)
            self._look(outlook, (through, air_node, air_area))
            return
        film, radiation = films
        to_air, to_radiant, across = surface_mesh(film, radiation, solid_value)
        graph.face(f"air-{key}", to_air, air_node, air_solid, air_area)
        graph.face(f"radiant-{key}", to_radiant, radiant, solid_, area_)
        graph.face(f"air-radiant past {key}", across, air_node, radiant, air_area)
        self._look(outlook, (to_air, air_node, air_area), (to_radiant, np.full(area_.size, radiant), area_))

    def _look(self, outlook: Outlook | None, *faces: tuple[ca.SX, NDArray[np.int64], NDArray[np.float64]]) -> None:
        """Remember the faces of a window to the outdoor air."""
        if outlook is not None:
            self.graph.anatomy.outer += [OuterFaces(v, node, area, outlook, self.name) for v, node, area in faces]

    def room(self, floor_area: float, volume: float) -> None:
        """Remember the zone with what is in it, once it is complete [m2, m3]."""
        radiant = self._inside[1] if self._inside is not None else -1
        self.graph.anatomy.rooms[self.name] = Room(
            self.name,
            self.number,
            self.air,
            self.share,
            self.mean,
            radiant,
            self._floor,
            self._ceiling,
            self._furniture,
            floor_area,
            volume,
        )

    def slabs(self, area: float) -> None:
        """Floor and ceiling slab, adiabatic at their backs: a chain of nodes each, of one make [area: of each, m2]."""
        graph = self.graph
        layers = graph.structure.slab_nodes
        if layers == 0:
            return
        coupling = graph.parameter("slab_coupling", self.name)
        heat = graph.parameter("slab_heat_capacity", self.name)
        nodes = graph.volumes("slab", np.full(2 * layers, self.number)).reshape(2, layers)
        self._floor, self._ceiling = (tuple(int(n) for n in chain) for chain in nodes)
        graph.capacity(graph.key("slab", self.name, "slab_heat_capacity"), heat, nodes.ravel(), area / layers)
        self.surface("slab", 2 * layers * coupling, nodes[:, 0], np.full(2, area), depends=("slab_coupling",))
        near, far = nodes[:, :-1].ravel(), nodes[:, 1:].ravel()
        graph.face(graph.key("slab-slab", self.name, "slab_coupling"), layers * coupling, near, far, area)

    def furniture(self, floor_area: float) -> None:
        """Furniture: one node, coupled to air and radiant node in the ratio of the films [floor_area: m2]."""
        graph = self.graph
        if not graph.structure.furniture:
            return
        coupling = graph.parameter("furniture_coupling", self.name)
        heat = graph.parameter("furniture_heat_capacity", self.name)
        node = graph.volumes("furniture", self.number)
        self._furniture = int(node[0])
        graph.capacity(graph.key("furniture", self.name, "furniture_heat_capacity"), heat, node, floor_area)
        films, radiant = self.inside()
        if radiant < 0:
            key = graph.key("air-furniture", self.name, "furniture_coupling")
            graph.face(key, coupling, self.air, node, floor_area * self.share)
            return
        film, radiation = films
        key = graph.key("furniture", self.name, "furniture_coupling", *self.film_names)
        total = film + radiation
        graph.face(f"air-{key}", coupling * film / total, self.air, node, floor_area * self.share)
        graph.face(f"radiant-{key}", coupling * radiation / total, radiant, node, floor_area)

    def window(self, u_value: ca.SX, area: float, air: NDArray[np.int64], facade: str, azimuth: float) -> None:
        """Glass without mass towards outdoor: ``u_value`` [W/m2/K] with the zone's own inside film, azimuth [deg]."""
        pane = 1.0 / (1.0 / u_value - 1.0 / WINDOW_RATED_FILM)
        far, each = np.full(air.size, self.graph.boundary("outdoor")), np.full(air.size, area / air.size)
        outlook = Outlook(azimuth, VERTICAL, RATED_OUTSIDE_FILM, glass=True)
        self.surface("window", pane, far, each, air, ("window_u_value",), facade, outlook)
        self.graph.anatomy.panes.append(Pane(self.name, azimuth, VERTICAL, area))
