"""What sensors, meters and terminals get wrong: bias, lag, flow gain, duct loss, limits, leaks and clocks."""

from functools import partial
from operator import attrgetter

import casadi as ca
import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import EffectBuilder, described
from thermal.effects.weights import hat
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import CONSTANT, Signal, of_zone, zone_signal
from thermal.network.topology import Emission
from thermal.units import AIR_HEAT_CAPACITY

#: Heat that a sensor takes up in a minute over that of the zone's air [-]: too little to cool the zone, and enough for
#: a reduced model to see.
_SENSOR = 1e-4

#: NTU at which the loss of a duct is linearised [-].
_NTU = 0.1

#: Shares of capacity that may be lost [-]: knots of the interpolation in between.
_LOST = (0.0, 0.1, 0.2, 0.35, 0.5, 0.7)


def _passing(inputs: InputProvider, number: int) -> FloatArray:
    return np.asarray(AIR_HEAT_CAPACITY * inputs.airflow[:, number])


def _duct(inputs: InputProvider, zone: str, exponent: float) -> FloatArray:
    """Heat lost per unit of NTU at the largest flow; NTU grows as flow falls, to a power."""
    flow, heat = (of_zone(inputs, name, zone) for name in ("supply_flow", "supply_heat"))
    most = inputs.normalisation.flow.get(zone, 0.0)
    running = flow > 1e-3 * max(most, 1e-9)
    ntu = _NTU * (most / np.where(running, flow, 1.0)) ** exponent
    return np.where(running, heat * -np.expm1(-ntu) / _NTU, 0.0)


def _over(inputs: InputProvider, zone: str, lost: float) -> FloatArray:
    heat, most = of_zone(inputs, "heat", zone), inputs.largest_heat[:, inputs.zones.index(zone)]
    return np.asarray(np.sign(heat) * np.maximum(np.abs(heat) - (1.0 - lost) * most, 0.0))


def _over_emitted(inputs: InputProvider, zone: str, lost: float, devices: tuple[int, ...]) -> FloatArray:
    """Part of the heat over a limit that some of the zone's devices gave: their share of the heat."""
    heat, own = of_zone(inputs, "heat", zone), inputs.emitted[:, list(devices)].sum(axis=1)
    share = np.divide(own, heat, out=np.zeros_like(own), where=heat != 0.0)
    return np.asarray(share * _over(inputs, zone, lost))


def _running(inputs: InputProvider, zone: str) -> FloatArray:
    most = inputs.normalisation.peak_flow.get(zone, 0.0)
    return (of_zone(inputs, "supply_flow", zone) > 0.02 * max(most, 1e-9)).astype(float)


def _build_bias(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        bias = builder.parameter("sensor_bias", zone=room.name)
        inside = np.append(room.air, room.mean) if room.mean >= 0 else room.air
        for value, near, far, weight in builder.graph.touching(np.unique(inside)):
            builder.graph.source(builder.key(room.name), bias * value, near, CONSTANT, weight)
            beyond = far >= 0
            if beyond.any():
                builder.graph.source(builder.key(room.name), -bias * value, far[beyond], CONSTANT, weight[beyond])
        supply = zone_signal(f"supply air of {room.name}", "W/K", "supply_flow", room.name, AIR_HEAT_CAPACITY)
        builder.heat_air(room, bias, supply, 1.0)
        for number, (source, target) in enumerate(builder.anatomy.airflows):
            # air that passes from zone to zone brings what its sensors make of it, and not the bias
            if room.number in (source, target):
                entered = builder.anatomy.rooms[builder.graph.zones[target]]
                signal = Signal.made(f"passing air {number}", "W/K", _passing, "airflow", given={"number": number})
                builder.heat_air(entered, bias if room.number == target else -bias, signal, 1.0)


def _build_lag(builder: EffectBuilder) -> None:
    link = ca.SX(_SENSOR / 60.0)
    for room in builder.rooms:
        lag = builder.parameter("sensor_lag", zone=room.name)
        node, heat = builder.graph.volumes("sensor", room.number), builder.anatomy.air_heat_capacity * room.volume
        builder.graph.capacity(f"sensor {room.name}", lag * _SENSOR, node, heat)
        builder.air_to(room, link, int(node[0]), heat)
        builder.graph.reading(room.number, int(node[0]))


def _build_gain(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        signal = zone_signal(f"heat of {room.name}", "W", "heat", room.name)
        gain = builder.parameter("flow_gain", zone=room.name)
        builder.heat_like_meter(room, gain, signal, lambda emission: emission.signal)


def _build_duct(builder: EffectBuilder) -> None:
    by_flow = builder.parameter("duct_flow_dependence")
    for room in builder.rooms:
        lost = builder.parameter("duct_ntu", zone=room.name)
        for share, exponent in ((1.0 - by_flow, 0.0), (by_flow, 1.0)):
            name = f"heat in the ducts of {room.name}, flow to the power {exponent:g}"
            given = {"zone": room.name, "exponent": exponent}
            signal = Signal.made(name, "W", _duct, "supply_flow", "supply_heat", given=given)
            builder.heat_air(room, -lost * share, signal, 1.0)


def _build_limit(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        lost = builder.parameter("capacity_lost", zone=room.name)
        for number, knot in enumerate(_LOST[1:], 1):
            name = f"heat of {room.name} over {1.0 - knot:.0%}"
            signal = Signal.made(name, "W", _over, "heat", given={"zone": room.name, "lost": knot})
            moved = partial(_limited, name, given={"zone": room.name, "lost": knot})
            builder.heat_like_meter(room, -hat(lost, _LOST, number, signed=True), signal, moved)


def _limited(name: str, emission: Emission, given: dict[str, object]) -> Signal:
    own = {**given, "devices": emission.devices}
    return Signal.made(f"{name}, {emission.signal.name}", "W", _over_emitted, "heat", "emitted", given=own)


def _build_leak(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        signal = Signal.made(f"air flows into {room.name}", "1", _running, "supply_flow", given={"zone": room.name})
        builder.heat_air(room, builder.parameter("valve_leak", zone=room.name), signal, room.floor_area)


def _build_shift(builder: EffectBuilder) -> None:
    heat, weather = builder.parameter("heat_clock_shift"), builder.parameter("weather_clock_shift")
    for room in builder.rooms:
        signal = zone_signal(f"change of heat in {room.name}", "W/h", "heat_rate", room.name)
        builder.heat_like_meter(room, heat, signal, lambda emission: emission.rate, -1.0)
    outdoor = Signal("change of outdoor temperature", "K/h", attrgetter("outdoor_rate"), ("outdoor_rate",))
    for value, _, node, weight in builder.graph.touching(np.array([builder.graph.boundary("outdoor")])):
        builder.graph.source(builder.key(), -weather * value, node, outdoor, weight)


SENSOR_BIAS = described("sensor_bias", _build_bias)
SENSOR_LAG = described("sensor_lag", _build_lag)
FLOW_GAIN = described("flow_gain", _build_gain)
DUCT_LOSS = described("duct_loss", _build_duct)
CAPACITY_LIMIT = described("capacity_limit", _build_limit)
VALVE_LEAK = described("valve_leak", _build_leak)
CLOCK_SHIFT = described("clock_shift", _build_shift)
