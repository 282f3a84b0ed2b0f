"""Floor of a plan and the zones of a network: air, films, radiant node, slabs, furniture."""

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.case.building import FloorPlan
from thermal.errors import ModelError
from thermal.network.emitters import LAYER, layer_parameter
from thermal.network.graph import GraphBuilder
from thermal.network.grid import FACADES, FloorGrid
from thermal.network.structure import (
    AIR_CONDUCTIVITY,
    RATED_OUTSIDE_FILM,
    SHUFFLE_STEP,
    WINDOW_RATED_FILM,
    series,
    surface_mesh,
)
from thermal.network.topology import VERTICAL, Heated, OuterFaces, Outlook, Pane, Room
from thermal.shuffle.equivalent import choose_equivalent, effective_diffusivity, exchange_rate, mean_square_reach

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
        Share of the zone's air in each [-]; sums to 1.
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
            air_solid, air_node = np.repeat(solid_, self.air.size), np.tile(self.air, solid_.size)
            air_area = np.outer(area_, self.share).ravel()
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
        """Remember the zone with what is in it, once it is complete [m2, m3].

        Parameters
        ----------
        floor_area
            Floor area [m2].
        volume
            Volume [m3].
        """
        radiant = self._inside[1] if self._inside is not None else -1
        place, mass = (self.name, self.number, self.air, self.share), (self._floor, self._ceiling, self._furniture)
        self.graph.anatomy.rooms[self.name] = Room(*place, self.mean, radiant, *mass, floor_area, volume)

    def slabs(self, area: float) -> None:
        """Floor and ceiling slab, adiabatic at their backs: a chain of nodes each, of one make [area: of each, m2].

        Parameters
        ----------
        area
            Floor area [m2].
        """
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

    def lay_heated(self, area: float) -> None:
        """Give emitters a layer of floor or ceiling where the drawing has none; in a slab the nodes at its surface.

        Parameters
        ----------
        area
            Floor area [m2].
        """
        graph = self.graph
        for side, slab in (("floor", self._floor), ("ceiling", self._ceiling)):
            found = graph.anatomy.heated.get((self.name, side))
            if found is None or found:
                continue
            node = np.array(slab[:1], dtype=np.int64)
            if not slab:
                names = "screed_heat_capacity_multiplier", "screed_conductivity_multiplier"
                heat, scale = (layer_parameter(graph, name, self.name) for name in names)
                capacity, conductance = LAYER[side]
                node = graph.volumes("slab", self.number)
                graph.capacity(graph.key(f"{side} screed", self.name, names[0]), capacity * heat, node, area)
                self.surface(f"{side} screed", conductance * scale, node, area, depends=names[1:])
            found.append(Heated(node, np.ones(1), area))

    def furniture(self, floor_area: float) -> None:
        """Furniture: one node, coupled to air and radiant node in the ratio of the films [floor_area: m2].

        Parameters
        ----------
        floor_area
            Floor area [m2].
        """
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
        """Glass without mass towards outdoor: ``u_value`` [W/m2/K] with the zone's own inside film, azimuth [deg].

        Parameters
        ----------
        u_value
            Air to air, an expression of the parameters [W/m2/K].
        area
            Area of the glass [m2].
        air
            Air volumes behind it [-].
        facade
            Side of the plan.
        azimuth
            Direction that it looks to [deg].
        """
        pane = 1.0 / (1.0 / u_value - 1.0 / WINDOW_RATED_FILM)
        far, each = np.full(air.size, self.graph.boundary("outdoor")), np.full(air.size, area / air.size)
        outlook = Outlook(azimuth, VERTICAL, RATED_OUTSIDE_FILM, glass=True)
        self.surface("window", pane, far, each, air, ("window_u_value",), facade, outlook)
        self.graph.anatomy.panes.append(Pane(self.name, azimuth, VERTICAL, area))


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

    def zone(self, name: str, area: float, reach: float | None, mean_shuffle: bool) -> Zone:
        """Air of one zone with its shuffle, slabs and furniture.

        Parameters
        ----------
        name
            Name of the zone.
        area
            Floor area [m2].
        reach
            Reach of the shuffle [m]; None is the whole zone.
        mean_shuffle
            Whether the mean of the shuffle is a term of K.
        """
        graph, grid = self.graph, self.grid
        mine = grid.token == name
        air, count = self.node[mine], self.cells[mine]
        zone = Zone(graph, name, air, count / count.sum())
        heat = graph.anatomy.air_heat_capacity
        graph.air_capacity(name, air, area * self.plan.height * zone.share)
        if air.size > 1:
            self._air(zone, area, heat, reach, mean_shuffle)
        zone.slabs(area)
        zone.lay_heated(area)
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
        """Share of the zone's heat in each of its air volumes, sums to 1.

        Parameters
        ----------
        name
            Name of the zone.
        mask
            Cells of the plan with a diffuser; None for all of them.
        """
        grid = self.grid
        split = (grid.tokens.shape[0] - 2) // self.plan.tokens.shape[0]
        cells = grid.tokens == name
        if mask is not None:
            if np.shape(mask) != self.plan.tokens.shape:
                expected = f"a mask of the plan's shape {self.plan.tokens.shape}"
                raise ModelError(f"diffusers of {name}", expected, f"{np.shape(mask)}")
            if not (mask & (np.asarray(self.plan.tokens) == name)).any():
                raise ModelError(f"diffusers of {name}: expected at least one cell of the zone, got none")
            cells &= np.pad(np.repeat(np.repeat(mask, split, axis=0), split, axis=1), 1)
        count = np.bincount(grid.volume[cells], minlength=grid.token.size)[grid.token == name]
        return np.asarray(count / count.sum(), dtype=float)

    def beside(self, step: tuple[int, int], a: str, b: str) -> tuple[IntArray, IntArray]:
        """Flat numbers of the cells of token a and of those of token b beyond them in a direction.

        Parameters
        ----------
        step
            Direction (row, column) [-].
        a
            Token here.
        b
            Token there.
        """
        here, there = self.grid.neighbours(step)
        tokens = self.grid.tokens.ravel()
        keep = (tokens[here] == a) & (tokens[there] == b)
        return here[keep], there[keep]

    def pairs(
        self, step: tuple[int, int], a: str, b: str, share: FloatArray | None = None
    ) -> tuple[IntArray, IntArray, FloatArray]:
        """Pairs of volumes of tokens a and b across faces in a direction, and how many cell faces they share.

        Parameters
        ----------
        step
            Direction (row, column) [-].
        a
            Token here.
        b
            Token there.
        share
            Share of each cell that is wall [-]; 1 by default.
        """
        here, there = self.beside(step, a, b)
        volume = self.grid.volume.ravel()
        first, second = volume[here], volume[there]
        apart = first != second
        pairs, which = np.unique(np.column_stack([first[apart], second[apart]]), axis=0, return_inverse=True)
        # glass that stands in a wall of several cells leaves less of the faces between them
        part = None if share is None else np.maximum(share.ravel()[here], share.ravel()[there])[apart]
        faces = np.bincount(which.ravel(), part, minlength=len(pairs))
        return self.node[pairs[:, 0]], self.node[pairs[:, 1]], faces.astype(float)
