"""Heat of devices that does not all go to the air: what radiates, and what warms a layer of floor or ceiling.

Metered heat enters the air (`ThermalNetwork.heating`). What an emitter gives elsewhere is a source that the heat of its
devices drives, and a source of the air of the opposite sign, so that nothing is lost or counted twice. While a spin-up
holds the air, layers are warmed by what was metered.
"""

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from thermal._types import FloatArray, IntArray
from thermal.case.building import GeometryQuality, Layer
from thermal.case.emitters import Emitter
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal
from thermal.network.graph import GraphBuilder
from thermal.network.topology import Emission, Room
from thermal.parameters import PARAMETERS

#: Conductivity up to which a layer insulates [W/m/K] (EN 13162 to EN 13171: products of up to 0.06 W/m/K).
_INSULATES = 0.065

#: Thickness of what lies before the insulation up to which pipes are at its foot, as in a screed of 45 to 80 mm with
#: its covering; in a thicker one, a slab of concrete, they are in its middle [m] (ISO 11855-2, types A to C, and E).
_SCREED = 0.1

#: A layer where the drawing has none, by side: capacity [J/m2/K] and conductance to its surface [W/m2/K]. Screed of
#: 65 mm (EN 1264-4: 45 mm over the pipes) with 2000 kg/m3, 1000 J/kg/K and 1.2 W/m/K and a covering of 0.05 m2K/W
#: (EN 1264-2: 0 to 0.15); panels of 15 mm of gypsum (EN 14240, ISO 10456).
LAYER = {"floor": (130e3, 10.0), "ceiling": (13.5e3, 15.0)}

#: Factor that a heated layer's properties are within, 95 times in a hundred [-]: a guess, whose middle is the range of
#: the slabs' own multipliers.
_WITHIN: dict[GeometryQuality, float] = {"surveyed": 2.0, "approximate": 3.0, "generic": 6.0}


def pipes_at(layers: Sequence[Layer]) -> float:
    """Resistance between the room's face of a construction and the pipes in it [m2K/W].

    Parameters
    ----------
    layers : sequence of Layer
        From the room.
    """
    number = next((n for n, layer in enumerate(layers) if layer.conductivity <= _INSULATES), len(layers))
    before = layers[:number] or layers[:1]
    resistance = [layer.thickness / layer.conductivity for layer in before]
    if sum(layer.thickness for layer in before) <= _SCREED:
        return sum(resistance)
    heaviest = max(range(len(before)), key=lambda n: before[n].thickness * before[n].density)
    return sum(resistance[:heaviest]) + 0.5 * resistance[heaviest]


def shared_at(resistance: float, nodes: IntArray, at: FloatArray) -> tuple[IntArray, FloatArray]:
    """Share heat that is given between two nodes of a chain: without mass there, by the resistances to both.

    Parameters
    ----------
    resistance : float
        Where, from the chain's beginning [m2K/W].
    nodes : ndarray of int, shape (n,)
        Of the chain.
    at : ndarray, shape (n,)
        Where they are [m2K/W], increasing.

    Returns
    -------
    tuple of ndarray
        Nodes and their shares, which sum to 1 [-].
    """
    after = int(np.searchsorted(at, resistance))
    if after in (0, at.size):
        return nodes[[min(after, at.size - 1)]], np.ones(1)
    share = (resistance - at[after - 1]) / (at[after] - at[after - 1])
    return nodes[[after - 1, after]], np.array([1.0 - share, share])


def layer_parameter(graph: GraphBuilder, name: str, zone: str) -> ca.SX:
    """Symbol of a multiplier of heated layers, whose prior is as wide as the geometry's quality leaves it.

    Parameters
    ----------
    graph : GraphBuilder
        The building.
    name, zone : str
        Of the parameter, and where.
    """
    own = replace(PARAMETERS[name], deviation=float(np.log(_WITHIN[graph.quality])) / 2.0)
    return graph.own(own.of("zone", zone) if graph.scopes.get(name) == "zone" else own)


def add_emitters(graph: GraphBuilder, emitters: Sequence[Emitter]) -> None:
    """Bring the heat of devices to where they emit it, in a complete baseline.

    Parameters
    ----------
    graph : GraphBuilder
        The baseline without effects, whose anatomy knows the heated layers.
    emitters : sequence of Emitter
        `thermal.case.emitters.emitters_of`.
    """
    for emitter in emitters:
        room = graph.anatomy.rooms[emitter.zone]
        radiant, layer = _shares(graph, emitter)
        surfaces = room.radiant if room.radiant >= 0 else room.furniture
        radiant = radiant if surfaces >= 0 else ca.SX(0.0)
        parts: list[tuple[ca.SX, IntArray, FloatArray]] = [(-(radiant + layer), room.air, room.share)]
        if surfaces >= 0 and not radiant.is_zero():
            parts.append((radiant, np.array([surfaces]), np.ones(1)))
        parts += [(layer, *_of_layers(graph, room, side)) for side in emitter.sides]
        name = f"heat by {emitter.kind.replace('_', ' ')} in {room.name}"
        given = {"devices": emitter.devices}
        emission = Emission(
            emitter.devices,
            Signal.made(name, "W", _emitted, "emitted", given=given),
            Signal.made(f"change of {name}", "W/h", _emitted_rate, "emitted_rate", given=given),
            emitter.share,
            tuple(parts),
        )
        graph.anatomy.rooms[room.name] = replace(room, emitted=(*room.emitted, emission))
        for number, (value, node, weight) in enumerate(parts):
            graph.source(f"{name} {number}", value, node, emission.signal, weight)


def _shares(graph: GraphBuilder, emitter: Emitter) -> tuple[ca.SX, ca.SX]:
    """Shares of an emitter's heat that surfaces and a layer get [-]."""
    none, whole = ca.SX(0.0), ca.SX(1.0)
    if emitter.kind in ("floor", "ceiling"):
        return none, whole
    baseboard = emitter.kind == "baseboard"
    radiant = graph.parameter("baseboard_radiant_share" if baseboard else "radiator_radiant_share")
    if emitter.kind != "unknown_floor":
        return radiant, none
    layer = graph.own(PARAMETERS["floor_heat_share"].of("zone", emitter.zone))
    return (1.0 - layer) * radiant, layer


def _of_layers(graph: GraphBuilder, room: Room, side: str) -> tuple[IntArray, FloatArray]:
    """Nodes of a zone's heated layers with their shares by area, which sum to 1 [-]."""
    heated = graph.anatomy.heated[room.name, side]
    area = sum(layer.area for layer in heated)
    node, share = (np.concatenate([getattr(layer, k) * w for layer, w in weighed]) for k, weighed in (
        ("node", [(layer, 1) for layer in heated]), ("share", [(layer, layer.area / area) for layer in heated]),
    ))  # fmt: skip
    return node.astype(np.int64), share


def _emitted(inputs: InputProvider, devices: tuple[int, ...]) -> FloatArray:
    return np.asarray(inputs.emitted[:, list(devices)].sum(axis=1))


def _emitted_rate(inputs: InputProvider, devices: tuple[int, ...]) -> FloatArray:
    return np.asarray(inputs.emitted_rate[:, list(devices)].sum(axis=1))
