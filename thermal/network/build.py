"""Building of the network of a plan or a zone table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.case.building import Building, FloorPlans, ZoneTable
from thermal.case.emitters import emitters_of
from thermal.case.plan import facade_areas, zone_floor_areas
from thermal.errors import ModelError
from thermal.network.commands import add_commanded
from thermal.network.emitters import add_emitters
from thermal.network.films import add_natural_convection, add_wind
from thermal.network.floor import Floor, Zone
from thermal.network.graph import GraphBuilder
from thermal.network.grid import floor_grid
from thermal.network.lumped import lump
from thermal.network.network import ThermalNetwork
from thermal.network.structure import BASELINE, Structure
from thermal.network.table import add_table
from thermal.network.topology import UNKNOWN_GLAZING, VERTICAL, Pane, azimuth_of, partition_areas, stacked_areas
from thermal.network.walls import Walls
from thermal.parameters import Scope
from thermal.units import AIR_HEAT_CAPACITY, air_density


class Extension(Protocol):
    """An effect, as the builders of a network see it."""

    def extend(self, graph: GraphBuilder) -> None:
        """Add its volumes, faces, sources and parameters to a graph whose baseline is complete.

        Parameters
        ----------
        graph : GraphBuilder
            With its anatomy.
        """


@dataclass(frozen=True)
class Blueprint:
    """A building's baseline, from which its networks with one set of effects after another are made.

    Parameters
    ----------
    graph : GraphBuilder
        Complete but for effects.
    air, zone : ndarray of int, shape (n_air,)
        Air volumes and the numbers of their zones.
    mean, share : ndarray, shape (n_air,)
        Weight of each volume in the mean of its zone, and share of the zone's heat that it gets [-].
    spacing : float, optional
        Distance between the volumes of a plan [m].
    floor_shapes : tuple of (int, int)
        Rows and columns of each floor's grid.
    """

    graph: GraphBuilder
    air: IntArray
    zone: IntArray
    mean: FloatArray
    share: FloatArray
    spacing: float | None = None
    floor_shapes: tuple[tuple[int, int], ...] = ()

    def network(self, effects: Sequence[Extension] = ()) -> ThermalNetwork:
        """Make the network with effects.

        Parameters
        ----------
        effects : sequence of Extension
            What is added to the baseline.
        """
        graph = self.graph.copy()
        for effect in effects:
            effect.extend(graph)
        shape = (graph.size, len(graph.zones))
        heating = sp.csr_matrix((self.share, (self.air, self.zone)), shape=shape)
        observation = sp.csr_matrix((self.mean, (self.zone, self.air)), shape=shape[::-1])
        return graph.finish(observation, heating, graph.anatomy.airflows, self.spacing, self.floor_shapes)


def _turned(building: Building, angle: float) -> Building:
    """Turn a building clockwise by an angle [deg]: its plans, or the outer faces of its zone table."""
    if not angle:
        return building
    if not isinstance(table := building.geometry, ZoneTable):
        return replace(building, orientation=(building.orientation + angle) % 360.0)
    surfaces = (
        s if s.azimuth is None else s.model_copy(update={"azimuth": (s.azimuth + angle) % 360.0})
        for s in table.surfaces
    )
    return replace(building, geometry=replace(table, surfaces=tuple(surfaces)))


def _remember(
    graph: GraphBuilder, building: Building, plans: FloorPlans, zones: Mapping[str, Zone], areas: Mapping[str, float]
) -> None:
    """Complete the anatomy: rooms, what lies above and below them, and their facades."""
    anatomy = graph.anatomy
    for plan in plans.floors:
        for name in plan.zone_names:
            zones[name].room(areas[name], areas[name] * plan.height)
    anatomy.windows_told = bool(plans.glazing)
    anatomy.stacked, anatomy.under_roof, anatomy.on_ground = stacked_areas(plans, areas)
    for zone, sides in facade_areas(plans).items():
        for side, area in sides.items():
            if area > 0.0:
                azimuth = azimuth_of(side, building.orientation)
                anatomy.facades[zone, azimuth] = area
                if not plans.glazing:
                    anatomy.panes.append(Pane(zone, azimuth, VERTICAL, UNKNOWN_GLAZING * area))


def build_network(
    building: Building,
    dx: float | None = None,
    reach: float | None = None,
    scopes: Mapping[str, Scope] | None = None,
    diffusers: Mapping[str, NDArray[np.bool_]] | None = None,
    mean_shuffle: bool = True,
    structure: Structure = BASELINE,
    effects: Sequence[Extension] = (),
) -> ThermalNetwork:
    """Build the control volumes and faces of a building, from floor plans or from a zone table.

    Parameters
    ----------
    building : Building
        What the case folder describes.
    dx : float, optional
        Distance between control volumes of a plan [m]; its cell size by default. A zone table has none and ignores it.
    reach : float, optional
        Reach of the shuffle [m]; None is the whole zone.
    scopes : mapping of str to {"global", "facade", "zone"}, optional
        Parameters with one value a facade or a zone; the others are global. Facades are the plan's sides, in a zone
        table the direction nearest to a surface's azimuth, and ``roof`` and ``floor`` where those look outdoors.
    diffusers : mapping of str to ndarray of bool, optional
        Cells with a diffuser, per zone, at the plan's resolution; all air cells by default.
    mean_shuffle : bool
        Whether the mean of the shuffle is a term of K; off for a simulator that shuffles at random.
    structure : Structure
        What the model is made of beside its geometry: furniture, slabs, nodes of a wall, radiant node.
    effects : sequence of Extension
        What is added to the baseline: effects of the catalogue, `thermal.effects.catalogue.chosen`.

    Returns
    -------
    ThermalNetwork
        The baseline of the architecture (no sun, sky, leakage, gains, exchange between floors, ground or roof) and
        the effects.

    Raises
    ------
    ModelError
        When a cell size, a scope, a mask of diffusers or the structure does not fit the building.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.network.structure import Structure
    >>> building = load_bundled_case().building
    >>> network = build_network(building, dx=1.0, scopes={"window_u_value": "facade"}, structure=Structure.paper())
    >>> [p.member for p in network.parameters if p.base == "window_u_value"]
    ['north', 'south', 'west', 'east']
    """
    return blueprint(building, dx, reach, scopes, diffusers, mean_shuffle, structure).network(effects)


def _lumped(building: Building, dx: float | None, structure: Structure) -> Blueprint:
    """Lump a building into two nodes a zone."""
    drawn = replace(structure, lumped=False, sun=False, recurring=False, wind_films=False, natural_films=False)
    drawn = replace(drawn, light_contents=False)
    detailed = build_network(replace(building, commanded=()), dx, structure=drawn)
    graph, air = lump(detailed, building.geometry_quality, structure)
    add_emitters(graph, emitters_of(building, structure.emitter))
    add_commanded(graph, building)
    ones = np.ones(air.size)
    return Blueprint(graph, air, np.arange(air.size), ones, ones)


def blueprint(
    building: Building,
    dx: float | None = None,
    reach: float | None = None,
    scopes: Mapping[str, Scope] | None = None,
    diffusers: Mapping[str, NDArray[np.bool_]] | None = None,
    mean_shuffle: bool = True,
    structure: Structure = BASELINE,
) -> Blueprint:
    """Build the baseline of a building once, for networks with many sets of effects.

    Parameters
    ----------
    building : Building
        What the case folder describes.
    dx, reach : float, optional
        Distance between control volumes, and reach of the shuffle [m]; see `build_network`.
    scopes, diffusers, mean_shuffle, structure
        As in `build_network`.

    Returns
    -------
    Blueprint
        Its `network` is that of `build_network`.

    Raises
    ------
    ModelError
        When a cell size, a scope, a mask of diffusers or the structure does not fit the building.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.effects.catalogue import chosen
    >>> baseline = blueprint(load_bundled_case().building, dx=1.0)
    >>> len(baseline.network().signals), len(baseline.network(chosen({"solar_gain": ()})).signals) > 0
    (0, True)
    """
    if structure.lumped:
        return _lumped(building, dx, structure)
    baseline = _drawn(building, dx, reach, scopes, diffusers, mean_shuffle, structure)
    if structure.wind_films:
        add_wind(baseline.graph)
    add_emitters(baseline.graph, emitters_of(building, structure.emitter))
    if structure.natural_films:
        add_natural_convection(baseline.graph)
    add_commanded(baseline.graph, building)
    return baseline


def _drawn(
    building: Building,
    dx: float | None,
    reach: float | None,
    scopes: Mapping[str, Scope] | None,
    diffusers: Mapping[str, NDArray[np.bool_]] | None,
    mean_shuffle: bool,
    structure: Structure,
) -> Blueprint:
    """Build the baseline as it is drawn."""
    building = _turned(building, structure.turned)
    boundaries = ("outdoor", *building.measured_boundaries)
    graph, plans = GraphBuilder(building.zone_names, boundaries, scopes or {}, structure), building.geometry
    graph.quality = building.geometry_quality
    graph.anatomy.heated = {(e.zone, side): [] for e in emitters_of(building, structure.emitter) for side in e.sides}
    graph.anatomy.served = frozenset(d.zone for d in building.devices if d.zone) or frozenset(building.zone_names)
    graph.anatomy.air_heat_capacity = air_density(building.location.elevation) * AIR_HEAT_CAPACITY
    place = graph.zones.index
    graph.anatomy.airflows = tuple((place(a.source), place(a.target)) for a in building.airflows)
    if isinstance(plans, ZoneTable):
        air, ones = add_table(graph, plans), np.ones(len(graph.zones))
        return Blueprint(graph, air, np.arange(len(graph.zones)), ones, ones)
    unknown = sorted(set(diffusers or {}) - set(building.zone_names))
    if unknown:
        raise ModelError(f"diffusers: zones {unknown} are not of this building; it has {list(building.zone_names)}")
    areas = zone_floor_areas(plans)
    diffuser_weight: dict[int, FloatArray] = {}
    zones: dict[str, Zone] = {}
    shapes = []
    for number, plan in enumerate(plans.floors):
        grid = floor_grid(plan, plans.cell_size, dx)
        shapes.append(grid.shape)
        floor = Floor(graph, plan, grid, number)
        for name in (z for z in building.zone_names if (grid.token == z).any()):
            zones[name] = floor.zone(name, areas[name], reach, mean_shuffle)
            mask = (diffusers or {}).get(name)
            diffuser_weight[zones[name].number] = floor.diffuser_weight(name, mask)
        Walls(floor, zones, plans.cell_size, building.orientation).add(plans.glazing)
        graph.anatomy.partitions |= partition_areas(plan, plans.cell_size)
    _remember(graph, building, plans, zones, areas)
    columns = [(z.air, np.full(z.air.size, z.number), z.share, diffuser_weight[z.number]) for z in zones.values()]
    air, zone, mean, share = (np.concatenate([c[k] for c in columns]) for k in range(4))
    return Blueprint(graph, air, zone, mean, share, grid.spacing, tuple(shapes))
