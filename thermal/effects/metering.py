"""What sensors, meters and terminals get wrong: bias, lag, flow gain, duct loss, limits and leaks."""

from functools import partial

import casadi as ca
import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import CONSTANT, EffectBuilder, described, hat
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal
from thermal.units import AIR_HEAT_CAPACITY

#: Heat that a sensor takes up in a minute over that of the zone's air [-]: too little to cool the zone, and enough for
#: a reduced model to see.
_SENSOR = 1e-4

#: NTU at which the loss of a duct is linearised [-].
_NTU = 0.1

#: Shares of capacity that may be lost [-]: knots of the interpolation in between.
_LOST = (0.0, 0.1, 0.2, 0.35, 0.5, 0.7)


def _of_zone(inputs: InputProvider, name: str, zone: str, factor: float = 1.0) -> FloatArray:
    return np.asarray(factor * inputs.values(name)[:, inputs.zones.index(zone)])


def _passing(inputs: InputProvider, number: int) -> FloatArray:
    return np.asarray(AIR_HEAT_CAPACITY * inputs.airflow[:, number])


def _duct(inputs: InputProvider, zone: str, exponent: float) -> FloatArray:
    """Heat lost per unit of NTU at the largest flow; NTU grows as flow falls, to a power."""
    flow, heat = (_of_zone(inputs, name, zone) for name in ("supply_flow", "supply_heat"))
    most = inputs.normalisation.flow.get(zone, 0.0)
    running = flow > 1e-3 * max(most, 1e-9)
    ntu = _NTU * (most / np.where(running, flow, 1.0)) ** exponent
    return np.where(running, heat * -np.expm1(-ntu) / _NTU, 0.0)


def _over(inputs: InputProvider, zone: str, lost: float) -> FloatArray:
    heat, most = _of_zone(inputs, "heat", zone), inputs.normalisation.heat.get(zone, 0.0)
    return np.asarray(np.sign(heat) * np.maximum(np.abs(heat) - (1.0 - lost) * most, 0.0))


def _running(inputs: InputProvider, zone: str) -> FloatArray:
    most = inputs.normalisation.peak_flow.get(zone, 0.0)
    return (_of_zone(inputs, "supply_flow", zone) > 0.02 * max(most, 1e-9)).astype(float)


def _build_bias(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        bias = builder.parameter("sensor_bias", zone=room.name)
        inside = np.append(room.air, room.mean) if room.mean >= 0 else room.air
        for value, near, far, weight in builder.graph.touching(np.unique(inside)):
            builder.graph.source(builder.key(room.name), bias * value, near, CONSTANT, weight)
            beyond = far >= 0
            if beyond.any():
                builder.graph.source(builder.key(room.name), -bias * value, far[beyond], CONSTANT, weight[beyond])
        flow = partial(_of_zone, name="supply_flow", zone=room.name, factor=AIR_HEAT_CAPACITY)
        builder.heat_air(room, bias, Signal(f"supply air of {room.name}", "W/K", flow, ("supply_flow",)), 1.0)
        for number, (source, target) in enumerate(builder.anatomy.airflows):
            # air that passes from zone to zone brings what its sensors make of it, and not the bias
            if room.number in (source, target):
                entered = builder.anatomy.rooms[builder.graph.zones[target]]
                signal = Signal(f"passing air {number}", "W/K", partial(_passing, number=number), ("airflow",))
                builder.heat_air(entered, bias if room.number == target else -bias, signal, 1.0)


def _build_lag(builder: EffectBuilder) -> None:
    lag, link = builder.parameter("sensor_lag"), ca.SX(_SENSOR / 60.0)
    for room in builder.rooms:
        node, heat = builder.graph.volumes("sensor", room.number), builder.anatomy.air_heat_capacity * room.volume
        builder.graph.capacity("sensor", lag * _SENSOR, node, heat)
        builder.air_to(room, link, int(node[0]), heat)
        builder.graph.reading(room.number, int(node[0]))


def _build_gain(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        signal = Signal(f"heat of {room.name}", "W", partial(_of_zone, name="heat", zone=room.name), ("heat",))
        builder.heat_air(room, builder.parameter("flow_gain", zone=room.name), signal, 1.0)


def _build_duct(builder: EffectBuilder) -> None:
    by_flow = builder.parameter("duct_flow_dependence")
    for room in builder.rooms:
        lost = builder.parameter("duct_ntu", zone=room.name)
        for share, exponent in ((1.0 - by_flow, 0.0), (by_flow, 1.0)):
            name = f"heat in the ducts of {room.name}, flow to the power {exponent:g}"
            lossy = partial(_duct, zone=room.name, exponent=exponent)
            signal = Signal(name, "W", lossy, ("supply_flow", "supply_heat"))
            builder.heat_air(room, -lost * share, signal, 1.0)


def _build_limit(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        lost = builder.parameter("capacity_lost", zone=room.name)
        for number, knot in enumerate(_LOST[1:], 1):
            beyond = partial(_over, zone=room.name, lost=knot)
            signal = Signal(f"heat of {room.name} over {1.0 - knot:.0%}", "W", beyond, ("heat",))
            builder.heat_air(room, -hat(lost, _LOST, number, signed=True), signal, 1.0)


def _build_leak(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        running = partial(_running, zone=room.name)
        signal = Signal(f"air flows into {room.name}", "1", running, ("supply_flow",))
        builder.heat_air(room, builder.parameter("valve_leak", zone=room.name), signal, room.floor_area)


SENSOR_BIAS = described("sensor_bias", _build_bias)
SENSOR_LAG = described("sensor_lag", _build_lag)
FLOW_GAIN = described("flow_gain", _build_gain)
DUCT_LOSS = described("duct_loss", _build_duct)
CAPACITY_LIMIT = described("capacity_limit", _build_limit)
VALVE_LEAK = described("valve_leak", _build_leak)
