"""Heat of sun and people: sun through glass and on opaque walls, blinds, gains of people, latent load."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from operator import attrgetter

import casadi as ca
import numpy as np

from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.effects.effect import EffectBuilder, described, lacking
from thermal.effects.weights import hat
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import CONSTANT, DAILY, Signal, daily_waves, on_plane, zone_signal
from thermal.network.topology import Anatomy, Room

#: Solar transmittance that a window is taken for where another's is known [-]: double glazing (EN 410).
_USUAL_TRANSMITTANCE = 0.6

#: Irradiance on a facade at which blinds may be drawn [W/m2]: knots of the interpolation in between.
_DRAWN_AT = (100.0, 200.0, 300.0, 400.0)

#: Heat in a room that nobody meters: of equipment that is always on and in the hours of people [W/m2], and of what is
#: switched on at times [W].
EQUIPMENT, IN_HOURS, SWITCHED_HEAT = "equipment_gain", "scheduled_gain", "switched_heat"

PRESENCE = Signal("presence", "1", attrgetter("occupancy"), ("occupancy",))
AT_HOME = Signal("presence at home", "1", attrgetter("at_home"), ("at_home",))


def _through(inputs: InputProvider, azimuth: float, tilt: float, threshold: float = -1.0) -> FloatArray:
    """Sun through glass while more than a threshold falls on it; by default always."""
    light = inputs.sun.through_glass(azimuth, tilt)
    return light if threshold < 0.0 else np.where(on_plane(inputs, azimuth, tilt) > threshold, light, 0.0)


def _of_sun(name: str, of: Callable[..., FloatArray], azimuth: float, tilt: float, **given: float) -> Signal:
    """Signal of the sun on a plane."""
    where = f"{name} at {azimuth:g} deg, tilt {tilt:g}"
    return Signal.made(where, "W/m^2", of, "sun", given={"azimuth": azimuth, "tilt": tilt, **given})


def _panes(builder: EffectBuilder, value: ca.SX, name: str, **given: float) -> None:
    """Bring sun through every pane: a share to the floor or furniture, the rest to the other surfaces."""
    share, parts = builder.graph.own(SOLAR_GAIN.parameters[1]), dict[str, tuple[ca.SX, ca.SX, ca.SX]]()
    for pane in builder.anatomy.panes:
        room = builder.anatomy.rooms[pane.zone]
        of_room = builder.share(pane.zone, SOLAR_GAIN)
        key = name if isinstance(of_room, float) else f"{name} in {pane.zone}"
        if key not in parts:
            own = value * of_room
            parts[key] = own, own * share, own * (1.0 - share)
        whole, to_mass, to_surfaces = parts[key]
        signal = _of_sun(name, _through, pane.azimuth, pane.tilt, **given)
        known = 1.0 if pane.transmittance is None else pane.transmittance / _USUAL_TRANSMITTANCE
        mass = room.floor[0] if room.floor else room.furniture
        if mass < 0:
            builder.heat_surfaces(room, whole, signal, known * pane.area)
            continue
        builder.graph.source(key, to_mass, mass, signal, known * pane.area)
        builder.heat_surfaces(room, to_surfaces, signal, known * pane.area)


def _build_gain(builder: EffectBuilder) -> None:
    _panes(builder, builder.graph.own(SOLAR_GAIN.parameters[0]), "sun through glass")


def _build_blinds(builder: EffectBuilder) -> None:
    drawn, threshold = builder.parameter("blind_shading"), builder.parameter("blind_irradiance")
    for number, knot in enumerate(_DRAWN_AT):
        value = -builder.graph.own(SOLAR_GAIN.parameters[0]) * drawn * hat(threshold, _DRAWN_AT, number)
        _panes(builder, value, f"sun through glass over {knot:g} W/m2", threshold=knot)


def _build_opaque(builder: EffectBuilder) -> None:
    absorptance = builder.parameter("solar_absorptance")
    for faces in builder.anatomy.outer:
        look = faces.outlook
        if look.glass or look.tilt > 90.0:
            continue
        signal = _of_sun("sun", on_plane, look.azimuth, look.tilt)
        builder.graph.source(builder.key(), absorptance * faces.value / look.film, faces.node, signal, faces.area)


def _give_half_to_air(builder: EffectBuilder, room: Room, value: ca.SX, signal: Signal, area: float) -> None:
    builder.heat_air(room, value, signal, 0.5 * area)
    builder.heat_surfaces(room, value, signal, 0.5 * area)


def _build_people(builder: EffectBuilder) -> None:
    if builder.named:
        everywhere = len(builder.rooms) == len(builder.anatomy.rooms)
        (_build_courses if everywhere else _build_equipment)(builder)
        return
    names = ("internal_gain", "internal_gain_delay", "internal_gain_at_home", "base_load")
    peak, shift, home, base = (builder.parameter(n) for n in names)
    arrival = Signal("coming and going", "1/h", attrgetter("occupancy_rate"), ("occupancy_rate",))
    served = {room.name for room in builder.rooms} <= builder.anatomy.served
    elsewhere = 1.0 if served else builder.parameter("internal_gain_unserved_share")
    shares = {room.name: builder.share(room.name) for room in builder.rooms}
    for value, signal in ((peak, PRESENCE), (-peak * shift, arrival), (home, AT_HOME), (base, CONSTANT)):
        for room in builder.rooms:
            own = value if room.name in builder.anatomy.served else value * elsewhere
            _give_half_to_air(builder, room, own * shares[room.name], signal, room.floor_area)


def _build_courses(builder: EffectBuilder) -> None:
    """Let each room have hours of its own, which are the same every day."""
    for room in builder.rooms:
        heat = [(builder.parameter("internal_gain_mean", zone=room.name), CONSTANT)]
        heat += [(builder.parameter("internal_gain_wave", zone=f"{room.name}, {w.name}"), w) for w in DAILY]
        for value, signal in heat:
            _give_half_to_air(builder, room, value, signal, room.floor_area)


def _build_equipment(builder: EffectBuilder) -> None:
    """Let some rooms have heat that is always on, heat in the hours of people, and heat that is switched, each."""
    for room in builder.rooms:
        _give_half_to_air(builder, room, builder.parameter(EQUIPMENT, zone=room.name), CONSTANT, room.floor_area)
    _build_in_hours(builder)
    _build_switched(builder)


def _build_in_hours(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        _give_half_to_air(builder, room, builder.parameter(IN_HOURS, zone=room.name), PRESENCE, room.floor_area)


def _build_switched(builder: EffectBuilder) -> None:
    for room in builder.rooms:
        on = zone_signal(f"heat seen on in {room.name}", "1", "switched", room.name)
        _give_half_to_air(builder, room, builder.parameter(SWITCHED_HEAT, zone=room.name), on, 1.0)


def daily_course(zone: str, values: Mapping[str, float]) -> FloatArray:
    """Heat of people of a zone with a course of its own, at each full hour of the clock on the wall, (24,) [W/m2].

    Parameters
    ----------
    zone : str
        Its name.
    values : mapping of str to float
        Parameters by name [parameter units]; 0 where there is none.

    Examples
    --------
    >>> course = daily_course("A", {"internal_gain_mean@A": 3.0, "internal_gain_wave@A, cos of 24 h": 2.0})
    >>> round(float(course[0]), 6), round(float(course[12]), 6)
    (5.0, 1.0)
    """
    hours = np.arange(24.0)
    course = np.full(24, values.get(f"internal_gain_mean@{zone}", 0.0))
    for wave, of in daily_waves().items():
        course += values.get(f"internal_gain_wave@{zone}, {wave}", 0.0) * of(hours)
    return course


def _build_latent(builder: EffectBuilder) -> None:
    load = builder.parameter("latent_load")
    for room in builder.rooms:
        if room.name in builder.anatomy.served:
            builder.heat_air(room, load, PRESENCE, -room.floor_area)


def _no_walls(anatomy: Anatomy) -> str | None:
    opaque = any(not f.outlook.glass and f.outlook.tilt <= 90.0 for f in anatomy.outer)
    return None if opaque else "the building has no opaque walls to outdoor"


_no_panes = lacking("panes", "the building has no windows to outdoor")
SOLAR_GAIN = described("solar_gain", _build_gain, _no_panes)
BLINDS = described("blinds", _build_blinds, _no_panes)
SOLAR_OPAQUE = described("solar_opaque", _build_opaque, _no_walls)
INTERNAL_GAINS = described("internal_gains", _build_people)


def has_people(building: Building, effects: Mapping[str, Sequence[str]]) -> bool:
    """Whether a model has the heat of people, and not only heat of some zones, whatever gives it.

    Parameters
    ----------
    building : Building
        Of the model.
    effects : mapping of str to sequence of str
        Of the model, with their zones.
    """
    zones = effects.get(INTERNAL_GAINS.id)
    return zones is not None and len(zones) in (0, len(building.zone_names))


#: What some rooms have in the hours of people, and what is switched there, alone: for a screening.
SCHEDULED = replace(INTERNAL_GAINS, build=_build_in_hours)
SWITCHED = replace(INTERNAL_GAINS, build=_build_switched)
LATENT_LOAD = described("latent_load", _build_latent)
