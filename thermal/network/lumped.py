"""A building lumped into air and mass a zone: the drawing's conductances and capacities, each with a factor of its own.

Where a drawing cannot be trusted, what is fitted is what a zone exchanges with each other zone and with each boundary,
and how much heat it holds. The model stays that of the drawing in its sums: every conductance and capacity is the
detailed network's at its start, times a multiplier whose prior is as wide as the quality of the geometry leaves it.
(Bacher and Madsen 2011, doi:10.1016/j.enbuild.2011.02.005, for one zone.)
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from thermal._types import FloatArray, IntArray
from thermal.case.building import FACADES, GeometryQuality
from thermal.inputs.signals import CONSTANT, DAILY, Signal, on_plane
from thermal.network.graph import GraphBuilder
from thermal.network.network import ThermalNetwork
from thermal.network.structure import Structure
from thermal.network.topology import UPWARD, VERTICAL, Heated, Pane, Room, direction_of
from thermal.parameters import PARAMETERS

#: Factor that the drawing's sums are within, 95 times in a hundred [-]: what surveys, drawings and guesses are off by.
_WITHIN: dict[GeometryQuality, float] = {"surveyed": 3.0, "approximate": 6.0, "generic": 30.0}

#: Factor that a multiplier may go to either side [-]: the prior draws it, not its bounds.
_RANGE = 30.0

#: Least conductance of a pair of zones and of a zone and a boundary per floor area [W/m2/K], so that a multiplier can
#: find what no drawing shows, such as an open door: a twentieth of a door's in a room of 15 m2.
_LEAST = 0.1

#: Share of it that is enough where the drawing tells which zones lie outside [-].
_KNOWN = 0.1

#: Share of a heated layer's conductance that counts as none [-].
_NEGLIGIBLE = 1e-3

#: Share of the drawing's coupling and capacity that a zone's mass keeps at least where heated layers have the rest [-].
_LEFT = 0.01

#: Resistance that keeps pipes in one place apart, as a share of that between pipes and air [-].
_APART = 0.01

#: Directions that the sun is taken from [deg]: azimuth and tilt of the compass's points and of a roof.
_PLANES = {**{name: (90.0 * number, VERTICAL) for number, name in enumerate(FACADES)}, "roof": (0.0, UPWARD)}

#: Solar transmittance of a pane that nothing tells [-]: double glazing (EN 410).
_TRANSMITTANCE = 0.6


@dataclass(frozen=True)
class _Layer:
    """What the pipes of a heated layer are joined to in a steady state.

    Parameters
    ----------
    to_air, outward, to_layers : ndarray, shape (n_zone,), (n_boundary,) and (n_layer,)
        Conductances to the air of the zones, to the boundaries and to the pipes of the other layers [W/K].
    capacity : float
        Heat capacity that follows the pipes [J/K].
    """

    to_air: FloatArray
    outward: FloatArray
    to_layers: FloatArray
    capacity: float


@dataclass(frozen=True)
class _Drawn:
    """What the drawing makes of every zone.

    Parameters
    ----------
    direct, slow : ndarray, shape (n_zone, n_boundary)
        Conductances to the boundaries from the air, past the masses, and from the mass [W/K].
    pairs : ndarray, shape (n_zone, n_zone)
        Conductances between the zones in a steady state [W/K].
    inner : ndarray, shape (n_zone,)
        Conductances from the air to what is not air [W/K].
    air, mass : ndarray, shape (n_zone,)
        Heat capacities of the air and of the rest, as far as it follows the zone's temperature [J/K].
    heated : dict
        Each layer that emitters warm, by zone and side. What it conducts and stores is in no other of these.
    """

    direct: FloatArray
    slow: FloatArray
    pairs: FloatArray
    inner: FloatArray
    air: FloatArray
    mass: FloatArray
    heated: dict[tuple[str, str], _Layer]


def lump(network: ThermalNetwork, quality: GeometryQuality, structure: Structure) -> tuple[GraphBuilder, IntArray]:
    """Lump a building into two nodes a zone.

    Parameters
    ----------
    network : ThermalNetwork
        The building as drawn.
    quality : {"surveyed", "approximate", "generic"}
        How its geometry was come by, which sets how far a multiplier may go and which zones may be neighbours.
    structure : Structure
        Says whether the sun is a part of it: an aperture a zone and direction.

    Returns
    -------
    tuple
        What effects may be added to, and the air volume of each zone, shape (n_zone,).
    """
    drawn, old = _drawn(network), network.anatomy
    graph = GraphBuilder(network.zones, network.boundaries, {}, structure)
    graph.anatomy = replace(old.copy(), outer=[], ground_faces=[], rooms={}, heated={})
    count, deviation = len(network.zones), float(np.log(_WITHIN[quality])) / 2.0
    area = np.array([old.rooms[z].floor_area for z in network.zones])
    air, mass = graph.volumes("air", np.arange(count)), graph.volumes("mass", np.arange(count))

    def multiplier(name: str, member: str) -> ca.SX:
        own = PARAMETERS[name]
        own = replace(own, lower=own.start / _RANGE, upper=own.start * _RANGE, deviation=deviation)
        return graph.own(own.of("zone", member))

    for i, zone in enumerate(network.zones):
        graph.capacity(f"air {zone}", multiplier("air_capacity_multiplier", zone), air[i], drawn.air[i])
        graph.capacity(f"mass {zone}", multiplier("mass_capacity_multiplier", zone), mass[i], drawn.mass[i])
        value = multiplier("mass_coupling_multiplier", zone)
        graph.face(f"air-mass {zone}", value, air[i], mass[i], drawn.inner[i])
        least = (1.0 if quality == "generic" else _KNOWN) * _LEAST * area[i]
        for j, name in enumerate(network.boundaries):
            if quality != "generic" and drawn.direct[i, j] + drawn.slow[i, j] < least:
                continue
            for kind, node, table in (("air", air, drawn.direct), ("mass", mass, drawn.slow)):
                value = multiplier(f"{kind}_boundary_multiplier", f"{zone} to {name}")
                weight = max(least, table[i, j])
                graph.face(f"{kind}-boundary {zone} to {name}", value, node[i], graph.boundary(name), weight)
        for j in range(i):
            least = _LEAST * min(area[i], area[j])
            if quality == "generic" or drawn.pairs[i, j] >= least:
                value = multiplier("zone_coupling_multiplier", f"{network.zones[j]} + {zone}")
                graph.face(f"zones {j} {i}", value, air[i], air[j], max(least, drawn.pairs[i, j]))
        room = old.rooms[zone]
        graph.anatomy.rooms[zone] = Room(
            zone, i, air[i : i + 1], np.ones(1), int(air[i]), -1, (), (), int(mass[i]), room.floor_area, room.volume
        )
        _add_heated(graph, drawn, i, air, multiplier)
        _add_gains(graph, graph.anatomy.rooms[zone], [p for p in old.panes if p.zone == zone], quality, structure)
    return graph, air


def _add_heated(
    graph: GraphBuilder, drawn: _Drawn, number: int, air: IntArray, multiplier: Callable[[str, str], ca.SX]
) -> None:
    """Add the layers of a zone that emitters warm: a node each, whose heat goes where the drawing lets it."""
    zone = graph.zones[number]
    heated = graph.anatomy.heated
    for (name, side), layer in drawn.heated.items():
        if name != zone:
            continue
        node = graph.volumes("screed", number)
        heat = multiplier("screed_heat_capacity_multiplier", zone)
        scale = multiplier("screed_conductivity_multiplier", zone)
        graph.capacity(f"screed {zone} {side}", heat, node, layer.capacity)
        codes = [graph.boundary(name) for name in graph.boundaries]
        laid = {k: heated[key][0].node[0] for k, key in enumerate(drawn.heated) if key in heated}
        pipes, beside = list(laid.values()), layer.to_layers[list(laid)]
        heated[zone, side] = [Heated(node, np.ones(1), graph.anatomy.rooms[zone].floor_area)]
        ends = {"air": (air, layer.to_air), "boundary": (codes, layer.outward), "screed": (pipes, beside)}
        least = _NEGLIGIBLE * (layer.to_air.sum() + layer.outward.sum())
        for kind, (far, conductance) in ends.items():
            there = np.flatnonzero(conductance > least)
            if there.size:
                graph.face(f"screed-{kind} {zone} {side}", scale, node, np.asarray(far)[there], conductance[there])


def _add_gains(
    graph: GraphBuilder, room: Room, panes: list[Pane], quality: GeometryQuality, structure: Structure
) -> None:
    """Add heat that is always there, that recurs from day to day, and the sun from each direction."""
    steady = graph.own(PARAMETERS["constant_gain"].of("zone", room.name))
    graph.source(f"constant gain {room.name}", steady, int(room.air[0]), CONSTANT, room.floor_area)
    for wave in DAILY if structure.recurring else ():
        value = graph.own(PARAMETERS["recurring_gain"].of("zone", f"{room.name}, {wave.name}"))
        graph.source(f"recurring gain {room.name}, {wave.name}", value, int(room.air[0]), wave, room.floor_area)
    for name, (azimuth, tilt) in _PLANES.items() if structure.sun else ():
        looking = [p for p in panes if (direction_of(p.azimuth) if p.tilt >= 45.0 else "roof") == name]
        glass = sum(p.area * (p.transmittance or _TRANSMITTANCE) for p in looking) / room.floor_area
        own = PARAMETERS["solar_aperture"]
        if quality != "generic":
            own = replace(own, start=max(own.start / 4.0, min(0.6 * glass, own.upper / 2.0)))
        value = graph.own(own.of("zone", f"{room.name} from {name}"))
        signal = Signal.made(f"sun from {name}", "W/m^2", on_plane, "sun", given={"azimuth": azimuth, "tilt": tilt})
        graph.source(f"sun {room.name} from {name}", value, int(room.air[0]), signal, room.floor_area)


def _drawn(network: ThermalNetwork) -> _Drawn:
    """Sum the detailed network up, at the start of its parameters."""
    n, count, theta = network.n_node, len(network.zones), network.start()
    faces = [c for c in network.conductances if not c.source]
    kappa, heat = (
        np.array(ca.Function("values", [network.symbols], [ca.vertcat(*[c.value for c in parts])])(theta)).ravel()
        for parts in (faces, network.capacities)
    )
    first, second = (np.concatenate([getattr(c, end) for c in faces]) for end in ("first", "second"))
    weight = np.concatenate([k * c.weight for k, c in zip(kappa, faces, strict=True)])
    total = n + len(network.boundaries)
    joined = sp.coo_matrix((weight, (first, second)), shape=(total, total)).tocsr()
    joined = joined + joined.T
    capacity = np.zeros(n)
    for value, c in zip(heat, network.capacities, strict=True):
        np.add.at(capacity, c.node, value * c.weight)
    # the air of a zone is one node
    observed = sp.csr_matrix(network.observation != 0)
    in_air = np.asarray(observed.sum(axis=0)).ravel() > 0
    rest = np.flatnonzero(~in_air)
    member = observed.astype(float)
    laplacian = sp.diags(np.asarray(joined.sum(axis=1)).ravel()[:n]) - joined[:n, :n]
    to_rest = (member @ joined[:n][:, rest]).toarray()
    direct = (member @ joined[:n][:, n:]).toarray()
    beside = (member @ joined[:n, :n] @ member.T).toarray()
    inner = laplacian[rest][:, rest] + 1e-9 * sp.eye(rest.size)
    outer = joined[:n][rest][:, n:].toarray()
    given = _given(network, rest)
    solved = sla.splu(inner.tocsc()).solve(np.hstack([to_rest.T, outer, given]))
    follows, warmed = np.split(solved, [count + outer.shape[1]], axis=1)
    # eliminate all but the pipes: what passes them is a path of their own, and not the zones' as well
    gain = np.linalg.inv(given.T @ warmed + np.diag(_before(network, joined, given.T @ warmed)))
    seen = given.T @ follows
    star, stored = gain @ seen, capacity[rest] @ warmed @ gain
    steady = to_rest @ follows
    steady = np.maximum(steady - seen[:, :count].T @ star, 0.0)
    pairs, through = beside + steady[:, :count], steady[:, count:]
    np.fill_diagonal(pairs, 0.0)
    coupled, mass = to_rest.sum(axis=1), follows[:, :count].T @ capacity[rest]
    coupled = np.maximum(coupled - star[:, :count].sum(axis=0), _LEFT * coupled)
    mass = np.maximum(mass - stored @ seen[:, :count], _LEFT * mass)
    # behind the coupling of air and mass, so that both in series are the drawing's
    behind = coupled / np.maximum(coupled - through.sum(axis=1), 0.1 * coupled)
    return _Drawn(
        direct=direct,
        slow=through * behind[:, None],
        pairs=pairs,
        inner=coupled,
        air=member @ capacity,
        mass=mass,
        heated={
            key: _Layer(star[k, :count], star[k, count:], -gain[k], float(stored[k]))
            for k, key in enumerate(network.anatomy.heated)
        },
    )


def _given(network: ThermalNetwork, rest: IntArray) -> FloatArray:
    """Share of each heated layer's heat that each node gets, shape (n_rest, n_layer) [-]."""
    given = np.zeros((network.n_node, len(network.anatomy.heated)))
    for k, layers in enumerate(network.anatomy.heated.values()):
        area = sum(layer.area for layer in layers)
        for layer in layers:
            np.add.at(given[:, k], layer.node, layer.share * layer.area / area)
    return given[rest]


def _before(network: ThermalNetwork, joined: sp.csr_matrix, pipes: FloatArray) -> FloatArray:
    """Resistance from each layer's pipes to the nodes that share their heat, shape (n_layer,) [K/W].

    Pipes between two nodes have the resistances to both, in parallel. Beside it a hundredth of their own resistance,
    so that pipes of two layers in one place are two nodes; no steady flow of heat depends on it.
    """
    before = _APART * np.diag(pipes)
    for k, layers in enumerate(network.anatomy.heated.values()):
        area = sum(layer.area for layer in layers)
        for layer in layers:
            if layer.node.size > 1:
                before[k] += (layer.area / area) ** 2 * layer.share.prod() / joined[layer.node[0], layer.node[1]]
    return before

