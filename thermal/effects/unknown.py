"""Heat of unknown cause: what nothing of the catalogue explains, by what it answers to, the weather or the clock."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import casadi as ca
import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import Effect, EffectBuilder, strength
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import CONSTANT, Signal, on_plane, signal_values, zone_signal
from thermal.network.topology import Room

#: Hours of a bin of the day [h].
BIN = 3

#: Heat that is plausible [W/m2]: in a bin of the day or always; per kelvin, per 100 W/m2 of sun or of sky, and per
#: 10 m/s K of wind and how much warmer it is indoors; and as a share of the metered heat [-].
_HEAT, _PER_KELVIN, _PER_WEATHER, _SHARE = 20.0, 1.0, 10.0, 0.3

_SOURCE = "any cause: loads and losses of offices stay within"


def _hours(inputs: InputProvider, first: int) -> FloatArray:
    hour = np.asarray(inputs.stamps.hour)
    return ((hour >= first) & (hour < first + BIN)).astype(float)


def _weekend(inputs: InputProvider) -> FloatArray:
    return (np.asarray(inputs.stamps.day_of_week) >= 5).astype(float)


def _colder(inputs: InputProvider) -> FloatArray:
    return np.asarray(inputs.usual.mean(axis=1) - inputs.outdoor)


def _hours_of_cold(inputs: InputProvider, first: int) -> FloatArray:
    return _hours(inputs, first) * _colder(inputs)


def _sun(inputs: InputProvider, azimuth: float, tilt: float) -> FloatArray:
    return np.asarray(on_plane(inputs, azimuth, tilt)) / 100.0


def _wind(inputs: InputProvider) -> FloatArray:
    return np.asarray(inputs.wind * _colder(inputs)) / 10.0


def _sky(inputs: InputProvider) -> FloatArray:
    return np.asarray(inputs.sky) / 100.0


def _occupied(inputs: InputProvider) -> FloatArray:
    return np.asarray(inputs.occupancy)


#: Every part of the day, 1 while it lasts.
BINS = tuple(Signal(f"{h} to {h + BIN} h", "1", partial(_hours, first=h)) for h in range(0, 24, BIN))

#: Azimuth and tilt of the walls and of the roof that the sun is measured on [deg].
PLANES = ((0.0, 90.0), (90.0, 90.0), (180.0, 90.0), (270.0, 90.0), (0.0, 0.0))

#: Of what heat of unknown cause is made, by what it answers to: signals, and the heat that is plausible per unit.
_DRIVERS: dict[str, tuple[str, tuple[Signal, ...], float]] = {
    "heat_always": ("always", (CONSTANT,), _HEAT),
    "heat_by_hour": ("time of day", BINS, _HEAT),
    "heat_at_weekends": ("weekends", (Signal("weekend", "1", _weekend),), _HEAT),
    "heat_by_occupancy": ("occupancy", (Signal("presence of people", "1", _occupied, ("occupancy",)),), _HEAT),
    "heat_by_cold": (
        "outdoor temperature", (Signal("how much colder it is outdoors", "K", _colder, ("outdoor", "usual")),),
        _PER_KELVIN,
    ),
    "heat_by_hour_of_cold": (
        "outdoor temperature by time of day",
        tuple(
            Signal(f"cold from {h} to {h + BIN} h", "K", partial(_hours_of_cold, first=h), ("outdoor", "usual"))
            for h in range(0, 24, BIN)
        ),
        _PER_KELVIN,
    ),
    "heat_by_sun": (
        "sun",
        tuple(
            Signal(f"sun at {a:g} deg, tilt {t:g}", "hW/m^2", partial(_sun, azimuth=a, tilt=t), ("sun",))
            for a, t in PLANES
        ),
        _PER_WEATHER,
    ),
    "heat_by_wind": ("wind", (Signal("wind and cold", "dam/s*K", _wind, ("wind", "outdoor", "usual")),), _PER_WEATHER),
    "heat_by_sky": ("sky", (Signal("sky deficit, in hundreds", "hW/m^2", _sky, ("sky",)),), _PER_WEATHER),
}  # fmt: skip

#: Heat with the sun, and what comes from outdoors.
SUN, OUTER = "heat_by_sun", ("heat_by_cold", "heat_by_sun", "heat_by_wind", "heat_by_sky")

#: What heat of each zone answers to beside: a share of the metered heat.
METERED = "heat_by_meter"


def _heat(effect: str, room: Room) -> list[tuple[Signal, float]]:
    """Signals of a zone's heat, and what they are multiplied by: its floor area, or nothing."""
    if effect == METERED:
        return [(zone_signal(f"metered heat of {room.name}", "W", "heat", room.name), 1.0)]
    return [(signal, room.floor_area) for signal in _DRIVERS[effect][1]]


def _give(builder: EffectBuilder, effect: str, room: Room, value: ca.SX, signal: Signal, area: float) -> None:
    """Give heat to a zone: the sun's to the surfaces, what answers to meters where devices give it, else to air."""
    if effect == METERED:
        builder.heat_like_meter(room, value, signal, lambda emission: emission.signal, area)
    else:
        (builder.heat_surfaces if effect == SUN else builder.heat_air)(room, value, signal, area)


def _build(builder: EffectBuilder) -> None:
    effect = builder.effect.id
    for room in builder.rooms:
        for p, (signal, area) in zip(builder.effect.parameters, _heat(effect, room), strict=True):
            _give(builder, effect, room, builder.parameter(p.name, zone=room.name), signal, area)


def _effect(name: str, answers_to: str, signals: tuple[Signal, ...], most: float) -> Effect:
    single = len(signals) == 1
    parameters = tuple(
        strength(
            name if single else f"{name}_{n}", f"W/m^2/({s.unit})", most, _SOURCE, name, 0.0 if name == SUN else -most
        )
        for n, s in enumerate(signals)
    )
    return Effect(
        id=name, title=f"heat of unknown cause with {answers_to}", equation="A Σ_k p_k s_k", source=_SOURCE,
        acts_on="surfaces of each zone" if name == SUN else "air of each zone", confounders=(), separated_by="",
        parameters=parameters, build=_build, zonal=True,
    )  # fmt: skip


#: Heat of unknown cause by id; no cause, and so no candidate of a diagnosis.
UNKNOWN: dict[str, Effect] = {name: _effect(name, *of) for name, of in _DRIVERS.items()}
UNKNOWN[METERED] = Effect(
    id=METERED, title="heat of unknown cause with metered heat", equation="p q", source=_SOURCE,
    acts_on="air of each zone", confounders=(), separated_by="",
    parameters=(strength(METERED, "1", _SHARE, _SOURCE, METERED, -_SHARE),), build=_build, zonal=True,
)  # fmt: skip

#: What each answers to, in words.
ANSWERS_TO = {name: words for name, (words, _, _) in _DRIVERS.items()} | {METERED: "metered heat"}


def tied(effect: str, name: str, weights: Mapping[str, FloatArray], tightness: float, joined: bool = False) -> Effect:
    """Heat of unknown cause whose strengths some zones share, one a signal or one for all.

    Parameters
    ----------
    effect : str
        Key of `UNKNOWN`.
    name : str
        What it and its parameters are called by.
    weights : mapping of str to ndarray, shape (n_signal,)
        Its heat by the floor area in every zone, over that of the strengths [-].
    tightness : float
        Plausible heat over that of `UNKNOWN` [-].
    joined : bool
        Whether all signals share the first one's strength.
    """
    of = UNKNOWN[effect]
    parameters = tuple(
        replace(p, name=f"{p.name}, {name}", lower=tightness * p.lower, upper=tightness * p.upper, effect=name)
        for p in of.parameters[: 1 if joined else None]
    )
    shared = parameters * (len(of.parameters) if joined else 1)

    def build(builder: EffectBuilder) -> None:
        for zone, weight in weights.items():
            room = builder.anatomy.rooms[zone]
            for p, (signal, area), share in zip(shared, _heat(effect, room), weight.tolist(), strict=True):
                if share:
                    _give(builder, effect, room, builder.parameter(p.name) * share, signal, area)

    return replace(of, id=name, parameters=parameters, build=build, zonal=False)


def inputs_of(effect: str) -> tuple[str, ...]:
    """Name the inputs that heat of unknown cause is made of, keys of `thermal.inputs.provider.INPUTS`.

    Parameters
    ----------
    effect : str
        Key of `UNKNOWN`.
    """
    return ("heat",) if effect == METERED else _DRIVERS[effect][1][0].inputs


def heat_of(effect: str, zone: str, floor_area: float, inputs: InputProvider) -> FloatArray:
    """Heat of a zone by each of its strengths, per unit of it, shape (n_time, n_strength) [W].

    Parameters
    ----------
    effect : str
        Key of `UNKNOWN`.
    zone : str
        Where.
    floor_area : float
        Of the zone [m2].
    inputs : InputProvider
        The weather, the clock and the metered heat.
    """
    if effect == METERED:
        return np.asarray(inputs.heat[:, [inputs.zones.index(zone)]])
    return floor_area * signal_values(_DRIVERS[effect][1], inputs)
