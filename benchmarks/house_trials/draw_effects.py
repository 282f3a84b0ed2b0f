"""Draws what a house holds: which effects, how strong, where, in which form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from _worlds import Effect
from energyplus_trials.specification import Kind

from house_trials.faces import faces
from house_trials.specification import HouseSpec

Draw = Callable[[HouseSpec, np.random.Generator, float], Effect]
STRENGTHS = (0.35, 1.6)  # of what is typical, drawn evenly on the logarithmic scale


def draw_effects(null: HouseSpec, kind: Kind, rng: np.random.Generator) -> HouseSpec:
    """Return the trial with effects of its kind.

    Parameters
    ----------
    null : HouseSpec
        The trial without effects.
    kind : {"null", "single", "pair", "outside"}
        Of trial.
    rng : Generator
        Random numbers of this purpose.
    """
    names: list[str] = []
    able = [name for name in CATALOGUE if possible(null, name)]
    if kind == "single":
        names = [str(rng.choice(able))]
    elif kind == "outside":
        names = [str(rng.choice([name for name in OUTSIDE if possible(null, name)]))]
    elif kind == "pair":
        names = [str(n) for n in rng.choice(able, 3 if rng.random() < 0.2 else 2, replace=False)]
    spec = replace(null, kind=kind)
    for name in sorted(names, key=list(CATALOGUE | OUTSIDE).index):
        spec = with_effect(spec, name, rng)
    return spec


def known_effects(null: HouseSpec, rng: np.random.Generator) -> tuple[Effect, ...]:
    """Return what every house that people live in has: sun through glass, and leakage at a constant rate.

    Parameters
    ----------
    null : HouseSpec
        The house.
    rng : Generator
        Random numbers of this purpose.
    """
    strengths = np.exp(rng.uniform(*np.log(STRENGTHS), 2)).round(3)
    sun, leakage = (
        CATALOGUE["solar_gain"](null, rng, float(strengths[0])),
        _infiltration("constant")(null, rng, float(strengths[1])),
    )
    return sun, leakage


def with_effect(spec: HouseSpec, name: str, rng: np.random.Generator, strength: float | None = None) -> HouseSpec:
    """Return the trial with one effect more.

    Parameters
    ----------
    spec : HouseSpec
        The trial.
    name : str
        Key of `CATALOGUE` or `OUTSIDE`.
    rng : Generator
        Random numbers.
    strength : float, optional
        Of what is typical [-]; drawn where not given.
    """
    low, high = np.log(STRENGTHS)
    drawn = float(np.exp(rng.uniform(low, high)))
    effect = (CATALOGUE | OUTSIDE)[name](spec, rng, round(strength or drawn, 3))
    return replace(spec, effects=(*spec.effects, replace(effect, unexplained_is_right=name in OUTSIDE)))


def possible(spec: HouseSpec, name: str) -> bool:
    """Tell whether a house can have an effect.

    Parameters
    ----------
    spec : HouseSpec
        The house.
    name : str
        Of the effect.
    """
    if spec.has(name) or (name == "infiltration_by_direction" and spec.has("infiltration")):
        return False  # the diagnosis knows of it
    if name == "ground_exchange":
        return spec.house.bottom == "ground"
    if name == "neighbour":
        # a typical house has windows on all sides, none of which can be a party wall
        return 0.0 in spec.house.glazing.values() and spec.sensors.quality != "generic"
    if name == "unmeasured_attic":
        return spec.house.top == "attic"
    if name == "meter_at_boiler":
        return spec.heating.emitter != "floor"
    if name in ("zone_mixing", "capacity_limit", "swapped_sensors"):
        return spec.heating.meter == "room" and (name != "zone_mixing" or bool(doors(spec)))
    return True


def doors(spec: HouseSpec) -> list[tuple[str, str]]:
    """Return the rooms between which there is a door: a partition of a metre or more, and no open doorway.

    Parameters
    ----------
    spec : HouseSpec
        The house.
    """
    found = [
        (f.room, f.other)
        for f in faces(spec.house)
        if f.kind == "wall" and f.other in spec.zone_names and f.length >= 1.0 and f.room < f.other
    ]
    return sorted(pair for pair in found if set(pair) != set(spec.house.doorway))


def heated(spec: HouseSpec) -> tuple[str, ...]:
    """Return the rooms with a heater.

    Parameters
    ----------
    spec : HouseSpec
        The house.
    """
    return tuple(name for name in spec.zone_names if name not in spec.heating.unheated)


def _metered(spec: HouseSpec, rng: np.random.Generator, rooms: tuple[str, ...], most: int = 2) -> tuple[str, ...]:
    """One or two rooms, or all of them where the house has one meter and one sensor."""
    if spec.heating.meter == "house":
        return spec.zone_names
    return _some(rng, rooms, most)


def _some(rng: np.random.Generator, rooms: tuple[str, ...], most: int) -> tuple[str, ...]:
    count = min(int(rng.integers(1, most + 1)), len(rooms))
    return tuple(sorted(str(r) for r in rng.choice(rooms, count, replace=False)))


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _seed(rng: np.random.Generator) -> int:
    return int(rng.integers(2**31))


def _whole(name: str, form: str, answers: tuple[str, ...] = (), most: float = np.inf, **typical: float) -> Draw:
    """Return the draw of an effect of the whole house whose numbers grow with its strength."""

    def draw(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
        numbers = {key: round(min(value * s, most), 4) for key, value in typical.items()} | {"seed": _seed(rng)}
        return Effect(name, form, s, (), numbers, (name, *answers))

    return draw


def _in_rooms(name: str, form: str, answers: tuple[str, ...], rooms: tuple[str, ...], **typical: float) -> Draw:
    """Return the draw of an effect that sits in a certain room, such as a bath, or in the first one."""

    def draw(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
        there = tuple(name for name in spec.zone_names if name in rooms) or spec.zone_names[:1]
        numbers = {key: round(value * s, 4) for key, value in typical.items()} | {"seed": _seed(rng)}
        return Effect(name, form, s, there[:1], numbers, (name, *answers))

    return draw


def _infiltration(*forms: str) -> Draw:
    def draw(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
        numbers = {"changes_per_hour": round(0.5 * s, 4), "azimuth_deg": round(float(rng.uniform(0.0, 360.0)), 1)}
        return Effect("infiltration", str(rng.choice(forms)), s, (), numbers, ("infiltration",))

    return draw


def _ground(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
    numbers = {"temperature_degC": round(float(rng.uniform(6.0, 12.0)), 1), "u_value_W_m2_K": round(1.5 * s, 3)}
    return Effect("ground_exchange", "soil", s, (), numbers, ("ground_exchange",))


def _neighbour(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
    side = next(side for side, share in spec.house.glazing.items() if share == 0.0)
    rooms = tuple(sorted({f.room for f in faces(spec.house) if f.side == side}))
    level = float(rng.uniform(8.0, 14.0) if rng.random() < 0.3 else rng.uniform(19.0, 24.0))
    numbers = {"u_value_W_m2_K": round(1.0 * s, 3), "side": side, "temperature_degC": round(level, 1)}
    return Effect("neighbour", "party_wall", s, rooms, numbers, ("neighbour",))


def _windows(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
    outer = tuple(sorted({f.room for f in faces(spec.house) if f.glass > 0.0}))
    rooms = outer if spec.heating.meter == "house" else _some(rng, outer, 4)
    return Effect("window_opening", "by_hand", s, rooms, {"area_m2": round(0.3 * s, 4), "seed": _seed(rng)},
                  ("window_opening",))  # fmt: skip


def _mixing(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
    pairs = doors(spec)
    chosen = [pair for pair in pairs if rng.random() < 0.5] or pairs[:1]
    rooms = tuple(sorted({room for pair in chosen for room in pair}))
    numbers = {"flow_m3_s": round(0.08 * s, 4), "pairs": [list(pair) for pair in chosen], "seed": _seed(rng)}
    return Effect("zone_mixing", str(rng.choice(["constant", "by_people"])), s, rooms, numbers, ("zone_mixing",))


def _bias(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
    rooms = _metered(spec, rng, spec.zone_names)
    shared = _sign(rng)
    bias = {room: round(0.8 * s * (shared if spec.heating.meter == "house" else _sign(rng)), 3) for room in rooms}
    return Effect("sensor_bias", "constant", s, rooms, {"bias_K": bias}, ("sensor_bias",))


def _gain(*forms: str) -> Draw:
    def draw(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
        rooms = () if spec.heating.meter == "house" or rng.random() < 0.2 else _some(rng, heated(spec), 2)
        numbers = {"gain": round(0.2 * s * _sign(rng), 4)}
        return Effect("flow_gain", str(rng.choice(forms)), s, rooms, numbers, ("flow_gain",))

    return draw


def _limit(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
    rooms = _some(rng, heated(spec), 2)
    return Effect(
        "capacity_limit", "heater", s, rooms, {"lost_share": round(min(0.4 * s, 0.7), 3)}, ("capacity_limit",)
    )


def _clock(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
    numbers = {"minutes": round(_sign(rng) * max(40.0 * s, 20.0), 1)}
    return Effect("clock_shift", str(rng.choice(["station", "meters"])), s, (), numbers, ("clock_shift",))


def _swapped(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
    rooms = tuple(sorted(str(r) for r in rng.choice(spec.zone_names, 2, replace=False)))
    return Effect("swapped_sensors", "temperature", s, rooms, {}, ("swapped_sensors",))


def _sunlit(spec: HouseSpec, rng: np.random.Generator, s: float) -> Effect:
    rooms = _metered(spec, rng, spec.zone_names, 1)
    numbers = {"kelvin_at_1000_W_m2": round(3.0 * s, 3), "azimuth_deg": round(float(rng.uniform(90.0, 270.0)), 1)}
    return Effect("sunlit_sensor", "vertical", s, rooms, numbers, ("sunlit_sensor",))


CATALOGUE: dict[str, Draw] = {
    "solar_gain": _whole("solar_gain", "glass", transmittance=0.38),
    "solar_opaque": _whole("solar_opaque", "walls", most=0.95, absorptance=0.6),
    "longwave_sky": _whole("longwave_sky", "sky", share=1.0),
    "wind_film": _whole("wind_film", "linear", slope_W_s_m3_K=4.0),
    "infiltration": _infiltration("constant", "wind", "stack"),
    "internal_gains": _whole("internal_gains", "people_and_appliances", mean_W_m2=4.0),
    "ground_exchange": _ground,
    "hidden_mass": _whole("hidden_mass", "masonry", capacity_kJ_m2_K=80.0),
    "zone_mixing": _mixing,
    "sensor_bias": _bias,
    "sensor_lag": _whole("sensor_lag", "first_order", time_constant_s=900.0),
    "flow_gain": _gain("constant"),
    "capacity_limit": _limit,
    "clock_shift": _clock,
    "thermal_bridge": _whole("thermal_bridge", "slab_edge", psi_W_m_K=0.5),
    "neighbour": _neighbour,
    "window_opening": _windows,
}
# Effects that the catalogue does not know, and effects of the catalogue in a form that it does not have.
OUTSIDE: dict[str, Draw] = {
    "stove": _in_rooms("stove", "some_evenings", ("internal_gains",), ("living",), power_W=3000.0),
    "bath": _in_rooms("bath", "evenings", ("internal_gains",), ("bath", "shower"), power_W=1500.0),
    "riser_pipe": _in_rooms("riser_pipe", "always", ("internal_gains",), ("bath", "hall", "kitchen"), power_W=250.0),
    "fireplace_flue": _in_rooms("fireplace_flue", "wind_and_stack", ("infiltration", "window_opening"), ("living",),
                                area_m2=0.02),
    "sunlit_sensor": _sunlit,
    "unmeasured_attic": _whole("unmeasured_attic", "left_out", ("roof_exchange",)),
    "meter_at_boiler": _whole("meter_at_boiler", "first_order", ("clock_shift",), time_constant_s=2400.0),
    "meter_drift": _gain("drift"),
    "infiltration_by_direction": _infiltration("wind_direction"),
    "swapped_sensors": _swapped,
    "wrong_station": _whole("wrong_station", "offset_and_night", offset_K=2.0, night_K=2.0),
}  # fmt: skip
