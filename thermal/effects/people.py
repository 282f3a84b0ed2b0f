"""People and what they bring: gains, latent load, clocks that are wrong."""

from functools import partial
from operator import attrgetter

import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import CONSTANT, EffectBuilder, described
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal


def _heat_rate(inputs: InputProvider, zone: str) -> FloatArray:
    return np.asarray(inputs.heat_rate[:, inputs.zones.index(zone)])


PRESENCE = Signal("presence", "1", attrgetter("occupancy"), ("occupancy",))


def _build_gains(builder: EffectBuilder) -> None:
    peak, shift, base = (builder.parameter(n) for n in ("internal_gain", "internal_gain_delay", "base_load"))
    arrival = Signal("coming and going", "1/h", attrgetter("occupancy_rate"), ("occupancy_rate",))
    for value, signal in ((peak, PRESENCE), (-peak * shift, arrival), (base, CONSTANT)):
        for room in builder.rooms:
            builder.heat_air(room, value, signal, 0.5 * room.floor_area)
            builder.heat_surfaces(room, value, signal, 0.5 * room.floor_area)


def _build_latent(builder: EffectBuilder) -> None:
    load = builder.parameter("latent_load")
    for room in builder.rooms:
        builder.heat_air(room, load, PRESENCE, -room.floor_area)


def _build_shift(builder: EffectBuilder) -> None:
    heat, weather = builder.parameter("heat_clock_shift"), builder.parameter("weather_clock_shift")
    for room in builder.rooms:
        rate = partial(_heat_rate, zone=room.name)
        signal = Signal(f"change of heat in {room.name}", "W/h", rate, ("heat_rate",))
        builder.heat_air(room, heat, signal, -1.0)
    outdoor = Signal("change of outdoor temperature", "K/h", attrgetter("outdoor_rate"), ("outdoor_rate",))
    for value, _, node, weight in builder.graph.touching(np.array([builder.graph.boundary("outdoor")])):
        builder.graph.source(builder.key(), -weather * value, node, outdoor, weight)


INTERNAL_GAINS = described("internal_gains", _build_gains)
LATENT_LOAD = described("latent_load", _build_latent)
CLOCK_SHIFT = described("clock_shift", _build_shift)
