"""Air that comes from outdoor or from the next zone: infiltration, thermal bridges, open windows, mixing."""

import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import PAIR, EffectBuilder, described, lacking, without_facades
from thermal.effects.weights import paired
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal, of_zone
from thermal.network.topology import Room

#: Wind speed [m/s], root of temperature difference [K^0.5] and presence [-] at which a varying exchange is part of K;
#: what they differ from it acts as heat at usual zone temperatures. Unmeasured wind blows at this speed. Windows are no
#: part of K: where none is ever opened, it would tie the zones to their usual temperatures.
_WIND, _ROOT, _PRESENCE = 3.0, 3.0, 0.3

#: Hours of the clock between which ventilation at night runs [h], and the share of a day that they are [-].
_NIGHT, _NIGHTLY = (22.0, 6.0), 1.0 / 3.0

#: Outdoor temperatures between which windows come to be opened [K].
_MILD = (285.15, 295.15)

_OUT = ("outdoor", "usual")


def _out(inputs: InputProvider, zone: str) -> FloatArray:
    return np.asarray(inputs.outdoor - of_zone(inputs, "usual", zone))


def _by_wind(inputs: InputProvider, zone: str) -> FloatArray:
    if not inputs.gives("wind"):
        return np.zeros(len(inputs.stamps))
    return (inputs.wind - _WIND) * _out(inputs, zone)


def _by_stack(inputs: InputProvider, zone: str) -> FloatArray:
    difference = _out(inputs, zone)
    return (np.sqrt(np.abs(difference)) - _ROOT) * difference


def _by_opening(inputs: InputProvider, zone: str) -> FloatArray:
    mild = np.clip((inputs.outdoor - _MILD[0]) / (_MILD[1] - _MILD[0]), 0.0, 1.0)
    return inputs.occupancy * mild * _out(inputs, zone)


def _by_fans(inputs: InputProvider, zone: str) -> FloatArray:
    return np.asarray((inputs.occupancy - _PRESENCE) * _out(inputs, zone))


def _by_fans_at_night(inputs: InputProvider, zone: str) -> FloatArray:
    night = (inputs.clock >= _NIGHT[0]) | (inputs.clock < _NIGHT[1])
    return np.asarray((night - _NIGHTLY) * _out(inputs, zone))


def _by_hand(inputs: InputProvider, zone: str) -> FloatArray:
    return np.asarray(of_zone(inputs, "openings", zone) * of_zone(inputs, "through_windows", zone))


def _by_presence(inputs: InputProvider, first: str, second: str) -> FloatArray:
    difference = of_zone(inputs, "usual", second) - of_zone(inputs, "usual", first)
    return np.asarray((inputs.occupancy - _PRESENCE) * difference)


def _exposed(builder: EffectBuilder) -> list[Room]:
    """Zones with an exterior wall; all of them where none is known."""
    outside = {zone for zone, _ in builder.anatomy.facades}
    rooms = [r for r in builder.rooms if r.name in outside]
    return rooms or list(builder.rooms)


def _build_infiltration(builder: EffectBuilder) -> None:
    """Exchange the zones' air with outdoor at rates times what varies: its mean by K, the rest as heat."""
    names = ("infiltration_rate", "infiltration_by_wind", "infiltration_by_stack")
    constant, wind, stack = (builder.parameter(n) for n in names)
    terms = ((wind, _WIND, "wind", "K*m/s", _by_wind), (stack, _ROOT, "stack", "K^1.5", _by_stack))
    outdoor = builder.graph.boundary("outdoor")
    for room in _exposed(builder):
        heat, share = builder.anatomy.air_heat_capacity * room.volume / 3600.0, builder.share(room.name)
        builder.air_to(room, constant * share, outdoor, heat)
        for rate, mean, name, unit, of in terms:
            builder.air_to(room, rate * share, outdoor, mean * heat)
            varying = Signal.made(f"{name} and cold in {room.name}", unit, of, *_OUT, given={"zone": room.name})
            builder.heat_air(room, rate * share, varying, heat)


def _build_bridge(builder: EffectBuilder) -> None:
    value = builder.parameter("thermal_bridge_u_value")
    for (zone, _), area in builder.anatomy.facades.items():
        room = builder.anatomy.rooms[zone]
        builder.air_to(room, value, builder.graph.boundary("outdoor"), area)


def _build_opening(builder: EffectBuilder) -> None:
    rate, heat = builder.parameter("window_opening_rate"), builder.anatomy.air_heat_capacity
    for room in _exposed(builder):
        name, seen_open = f"open windows of {room.name}", f"windows seen open in {room.name}"
        varying = Signal.made(name, "K", _by_opening, *_OUT, "occupancy", given={"zone": room.name})
        builder.heat_air(room, rate, varying, heat * room.volume / 3600.0)
        seen = Signal.made(seen_open, "K*m/s", _by_hand, "openings", "through_windows", given={"zone": room.name})
        builder.heat_air(room, builder.parameter("opened_window_area", zone=room.name), seen, heat)


def _build_ventilation(builder: EffectBuilder) -> None:
    """Exchange the zones' air with outdoor while fans run: its mean by K, the rest as heat."""
    outdoor = builder.graph.boundary("outdoor")
    for room in builder.rooms:
        heat = builder.anatomy.air_heat_capacity * room.volume / 3600.0
        for name, mean, of, needs in (
            ("ventilation_with_people", _PRESENCE, _by_fans, ("occupancy",)),
            ("ventilation_at_night", _NIGHTLY, _by_fans_at_night, ()),
        ):
            rate = builder.parameter(name, zone=room.name)
            builder.air_to(room, rate, outdoor, mean * heat)
            varying = Signal.made(f"{name} of {room.name}", "K", of, *_OUT, *needs, given={"zone": room.name})
            builder.heat_air(room, rate, varying, heat)


def _build_mixing(builder: EffectBuilder) -> None:
    heat, inside = builder.anatomy.air_heat_capacity, {room.name for room in builder.rooms}
    pairs = [pair for pair in builder.anatomy.partitions if set(pair) <= inside]
    if not pairs:
        return
    by_presence = builder.parameter("door_presence_share")
    for first, second in pairs:
        a, b, pair = builder.anatomy.rooms[first], builder.anatomy.rooms[second], f"{first}{PAIR}{second}"
        airflow = builder.parameter("door_airflow", zone=pair)
        scheduled = by_presence * airflow
        near, far, share = paired((a.air, a.share), (b.air, b.share))
        builder.graph.face(f"zone_mixing {pair}", airflow - (1.0 - _PRESENCE) * scheduled, near, far, heat * share)
        name = f"presence and difference {pair}"
        signal = Signal.made(name, "K", _by_presence, "occupancy", "usual", given={"first": first, "second": second})
        builder.heat_air(a, scheduled, signal, heat)
        builder.heat_air(b, scheduled, signal, -heat)


INFILTRATION = described("infiltration", _build_infiltration, without_facades)
THERMAL_BRIDGE = described("thermal_bridge", _build_bridge, without_facades)
WINDOW_OPENING = described("window_opening", _build_opening, without_facades)
VENTILATION = described("ventilation", _build_ventilation)
ZONE_MIXING = described("zone_mixing", _build_mixing, lacking("partitions", "no two zones share a partition"))
