"""Heat that no meter tells, as part of a model: of dampers, valves, and counters where water is heated."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from thermal._types import FloatArray
from thermal.case.building import Building, Commanded
from thermal.case.commands import GAS
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal
from thermal.network.graph import GraphBuilder
from thermal.parameters import PARAMETERS

#: Parameter and unit of the signal of what tells a device's heat.
_OF_KIND = {"damper": ("damper_airflow", "J/kg"), "valve": ("valve_heat", "1")}


def add_commanded(graph: GraphBuilder, building: Building) -> None:
    """Give the zones of a complete baseline the heat that follows from commands and counters.

    A damper brings air in proportion to its opening, a valve heat. What a counter counts warms the water and the metal
    of a heating system, from which each zone that it feeds gets heat by a coupling of its own: their shares are the
    shares of the couplings, and the lag is capacity over coupling.

    Parameters
    ----------
    graph : GraphBuilder
        The baseline without effects.
    building : Building
        Its `commanded` devices; those that emit elsewhere than to the air are known to the graph's rooms.
    """
    commanded = building.commanded
    systems: dict[str, list[Commanded]] = {}
    for place, own in enumerate(commanded):
        if own.kind == "counter":
            systems.setdefault(own.columns[0], []).append(own)
            continue
        name, unit = _OF_KIND[own.kind]
        room = graph.anatomy.rooms[own.zone]
        value = graph.own(PARAMETERS[name].of("zone", own.device))
        signal = _signal(f"{own.kind} of {own.device}", unit, place)
        graph.source(f"{own.kind} {own.device}", value, room.air, signal, room.floor_area * room.share)
        number = next((n for n, device in enumerate(building.devices) if device.name == own.device), -1)
        for emission in (e for e in room.emitted if number in e.devices):
            for part, (share, node, weight) in enumerate(emission.parts):
                graph.source(f"{own.kind} {own.device} {part}", value * share, node, signal, room.floor_area * weight)
    for column, fed in systems.items():
        rooms = [graph.anatomy.rooms[own.zone] for own in fed]
        feeder, area = column.partition("/")[0], sum(room.floor_area for room in rooms)
        node = graph.volumes("heating_system", -1)
        heat = graph.own(PARAMETERS["heating_system_capacity"].of("zone", feeder))
        graph.capacity(f"heating system {feeder}", heat, node, area)
        gas = column.endswith(GAS)
        given = graph.own(PARAMETERS["boiler_efficiency"].of("zone", feeder)) if gas else ca.SX(1.0)
        signal = _signal(f"counter of {feeder}", "W", list(commanded).index(fed[0]))
        graph.source(f"counter {feeder}", given, node, signal, 1.0)
        for own, room in zip(fed, rooms, strict=True):
            value = graph.own(PARAMETERS["counter_coupling"].of("zone", own.device))
            graph.face(f"counter {own.device}", value, room.air, int(node[0]), room.floor_area * room.share)


def nominal_heat(commanded: Sequence[Commanded], signals: FloatArray, areas: dict[str, float]) -> dict[str, FloatArray]:
    """Heat of commanded devices at the start of their parameters, by zone: for models that have no such parameters.

    Parameters
    ----------
    commanded : sequence of Commanded
        `Building.commanded`.
    signals : ndarray, shape (n_time, n_commanded)
        Of them [units of `thermal.case.commands.command_signals`].
    areas : dict
        Floor area by zone [m2].

    Returns
    -------
    dict of str to ndarray, shape (n_time,)
        [W].
    """
    found: dict[str, FloatArray] = {}
    for number, own in enumerate(commanded):
        if own.kind == "counter":
            fed = [areas[other.zone] for other in commanded if other.columns == own.columns]
            heat = signals[:, number] * areas[own.zone] / sum(fed)
        else:
            heat = signals[:, number] * areas[own.zone] * PARAMETERS[_OF_KIND[own.kind][0]].start
        found[own.zone] = found.get(own.zone, np.zeros(len(signals))) + heat
    return found


def _signal(name: str, unit: str, number: int) -> Signal:
    return Signal.made(name, unit, _column, "commanded", given={"number": number})


def _column(inputs: InputProvider, number: int) -> FloatArray:
    return np.asarray(inputs.commanded[:, number])
