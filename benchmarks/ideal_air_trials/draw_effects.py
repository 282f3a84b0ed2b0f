"""Draws what an office holds: how strong the effect is, where, in which form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from _worlds import Effect

from ideal_air_trials.plan import outer_zones, walls, zone_name
from ideal_air_trials.specification import Spec

Draw = Callable[[Spec, np.random.Generator, float], Effect]
STRENGTHS = (0.35, 1.6)  # of what is typical, drawn evenly

#: EnergyPlus' constant term, and those with the difference of temperatures [1/K] and with the wind [s/m], by form.
_LEAKS = {"constant": (1.0, 0.0, 0.0), "wind": (0.0, 0.0, 0.3), "stack": (0.0, 0.06, 0.0), "mixed": (0.5, 0.02, 0.08)}


def draw_effect(name: str, null: Spec, rng: np.random.Generator, strength: float | None = None) -> Effect:
    """Draw an effect.

    Parameters
    ----------
    name : str
        Key of `CATALOGUE` or of `OUTSIDE_CATALOGUE`.
    null : Spec
        The office.
    rng : Generator
        Random numbers of this purpose.
    strength : float, optional
        Of what is typical [-]; drawn where not given.
    """
    drawn = float(rng.uniform(*STRENGTHS))
    effect = (CATALOGUE | OUTSIDE_CATALOGUE)[name](null, rng, drawn if strength is None else strength)
    answers = (name, *_ALSO_RIGHT.get(name, ()))
    return replace(effect, answers=answers, unexplained_is_right=name in OUTSIDE_CATALOGUE)


def _some(rng: np.random.Generator, zones: Sequence[str], low: int, high: int) -> tuple[str, ...]:
    count = min(len(zones), int(rng.integers(low, high + 1)))
    return tuple(sorted(rng.choice(zones, count, replace=False).tolist()))


def _by_zone(zones: Sequence[str], values: np.ndarray) -> dict[str, float]:
    return dict(zip(zones, values.tolist(), strict=True))


def _signs(rng: np.random.Generator, zones: Sequence[str], typical: float) -> dict[str, float]:
    """Draw a number for each zone, of either sign and about as large as is typical."""
    return _by_zone(zones, typical * rng.choice([-1, 1], len(zones)) * rng.uniform(0.7, 1.2, len(zones)))


def _whole(name: str, form: str, key: str, typical: float, most: float = np.inf) -> Draw:
    """Return the draw of an effect of the whole office that has one number."""

    def draw(null: Spec, rng: np.random.Generator, s: float) -> Effect:
        return Effect(name, form, s, (), {key: min(typical * s, most)})

    return draw


def _infiltration(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    form = str(rng.choice(list(_LEAKS)))
    spread = _by_zone(null.zone_names, rng.uniform(0.7, 1.3, len(null.zone_names)))
    return Effect("infiltration", form, s, (), {"changes_per_hour": 0.45 * s, "terms": _LEAKS[form], "share": spread})


def _internal_gains(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    every = null.zone_names
    zones = _some(rng, every, 2, max(3, len(every) // 2)) if rng.random() < 0.3 else ()
    numbers = {
        "power_W_m2": 12.0 * s,
        "base_share": float(rng.uniform(0.0, 0.3)),
        "radiant_share": float(rng.uniform(0.2, 0.5)),
        "arrival_h": float(rng.uniform(7.0, 9.5)),
        "departure_h": float(rng.uniform(16.0, 19.0)),
        "weekend_share": float(rng.choice([0.0, 0.0, 0.15])),
        "lunch_share": float(rng.uniform(0.5, 1.0)),
        "share": _by_zone(every, rng.uniform(0.6, 1.4, len(every))),
    }
    return Effect("internal_gains", "working_days", s, zones, numbers)


def _ground(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    """Soil between the mean temperature outdoors and 20 degC, and somewhat beside it."""
    numbers = {
        "u_value_W_m2_K": 0.4 * s,
        "share_of_20_degC": float(rng.uniform(0.0, 0.4)),
        "offset_K": float(rng.uniform(-1.0, 1.0)),
        "swing_K": float(rng.uniform(0.5, 3.0)),
    }
    return Effect("ground_exchange", "soil", s, (), numbers)


def _zone_mixing(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    beside = sorted({tuple(sorted((w.zone, w.other))) for w in walls(null.layout) if w.other})
    pairs = [[zone_name(floor, name) for name in pair] for floor in range(null.layout.floors) for pair in beside]
    count = int(rng.integers(max(2, len(pairs) // 3), len(pairs) + 1))
    chosen = [pairs[k] for k in sorted(rng.choice(len(pairs), count, replace=False).tolist())]
    form = "working_hours" if rng.random() < 0.4 else "constant"
    numbers = {"flow_m3_s": 0.1 * s, "pairs": chosen, "share": rng.uniform(0.6, 1.4, count).tolist()}
    return Effect("zone_mixing", form, s, tuple(sorted({zone for pair in chosen for zone in pair})), numbers)


def _hidden_mass(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    numbers = {"capacity_kJ_m2_K": 45.0 * s, "area_share": float(rng.uniform(0.6, 1.2))}
    return Effect("hidden_mass", "plates", s, (), numbers)


def _sensor_bias(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, null.zone_names, 1, 3)
    return Effect("sensor_bias", "constant", s, zones, {"bias_K": _signs(rng, zones, 0.8 * s)})


def _sensor_lag(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, null.zone_names, 1, 4) if rng.random() < 0.5 else ()
    return Effect("sensor_lag", "first_order", s, zones, {"time_constant_s": 540.0 * s})


def _flow_gain(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, null.zone_names, 1, 3)
    return Effect("flow_gain", "constant", s, zones, {"gain": _signs(rng, zones, 0.18 * s)})


def _duct_loss(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, null.zone_names, 1, 4) if rng.random() < 0.7 else ()
    return Effect("duct_loss", "void", s, zones, {"ntu": 0.15 * s, "outdoor_share": float(rng.uniform(0.0, 0.5))})


def _neighbour(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    levels = [rng.uniform(8.0, 15.0), rng.uniform(24.0, 28.0)]
    numbers = {
        "side": null.layout.blank,
        "u_value_W_m2_K": 0.9 * s,
        "temperature_degC": float(rng.choice(levels)),
        "swing_K": float(rng.uniform(0.0, 1.5)),
    }
    return Effect("neighbour", "party_wall", s, tuple(outer_zones(null.layout, null.layout.blank)), numbers)


def _valve_leak(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    return Effect("valve_leak", "while_air_flows", s, _some(rng, null.zone_names, 1, 3), {"power_W_m2": 10.0 * s})


def _capacity_limit(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, null.zone_names, 1, 3)
    left = float(np.clip(0.45 - 0.28 * s, 0.05, 0.4))
    return Effect("capacity_limit", "terminal", s, zones, {"lost_share": 1.0 - left})


def _clock_shift(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    minutes = float(np.round(45.0 * s / 5.0) * 5.0 * rng.choice([-1, 1]))  # whole steps
    return Effect("clock_shift", "station", s, (), {"minutes": minutes})


def _window_opening(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    outer = outer_zones(null.layout)
    zones = _some(rng, outer, 2, max(3, len(outer) // 2))
    numbers = {"changes_per_hour": 3.5 * s, "eagerness": float(rng.uniform(0.5, 1.5))}
    return Effect("window_opening", "by_hand", s, zones, numbers)


def _server_room(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, null.zone_names, 1, 1)
    return Effect("server_room", "always", s, zones, {"power_W_m2": 55.0 * s, "swing": float(rng.uniform(0.0, 0.2))})


def _stove(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, null.zone_names, 1, 2)
    numbers = {
        "power_W": 1500.0 * s,
        "fires_a_day": float(rng.uniform(0.7, 2.0)),
        "duration_h": float(rng.uniform(1.5, 5.0)),
        "radiant_share": float(rng.uniform(0.4, 0.7)),
    }
    return Effect("stove", "now_and_then", s, zones, numbers)


def _night_ventilation(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    numbers = {
        "changes_per_hour": 3.0 * s,
        "from_h": float(rng.uniform(20.0, 23.0)),
        "to_h": float(rng.uniform(4.0, 7.0)),
        "least_indoor_degC": float(rng.uniform(17.0, 19.0)),
    }
    return Effect("night_ventilation", "every_night", s, (), numbers)


def _stratified_room(null: Spec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, null.zone_names, 1, 4)
    numbers = {
        "top_K": s,
        "height_above_middle": float(rng.uniform(0.4, 1.0)),
        "time_constant_s": 60.0 * float(rng.uniform(10.0, 30.0)),
    }
    return Effect("stratified_room", "by_heat", s, zones, numbers)


#: Effects of the catalogue in the order in which their turns are drawn.
CATALOGUE: dict[str, Draw] = {
    "solar_gain": _whole("solar_gain", "glass", "transmittance", 0.5, most=0.8),
    "longwave_sky": _whole("longwave_sky", "sky", "share", 0.85, most=1.3),
    "infiltration": _infiltration,
    "internal_gains": _internal_gains,
    "interfloor_exchange": _whole("interfloor_exchange", "slab", "u_value_W_m2_K", 1.5),
    "ground_exchange": _ground,
    "roof_exchange": _whole("roof_exchange", "slab", "u_value_W_m2_K", 0.4),
    "zone_mixing": _zone_mixing,
    "hidden_mass": _hidden_mass,
    "sensor_bias": _sensor_bias,
    "sensor_lag": _sensor_lag,
    "flow_gain": _flow_gain,
    "duct_loss": _duct_loss,
    "solar_opaque": _whole("solar_opaque", "walls", "absorptance", 0.6, most=0.95),
    "neighbour": _neighbour,
    "valve_leak": _valve_leak,
    "capacity_limit": _capacity_limit,
    "clock_shift": _clock_shift,
    "window_opening": _window_opening,
}
#: Effects that the catalogue does not know, in the order in which their turns are drawn.
OUTSIDE_CATALOGUE: dict[str, Draw] = {
    "server_room": _server_room,
    "stove": _stove,
    "night_ventilation": _night_ventilation,
    "stratified_room": _stratified_room,
}
#: What else counts as right.
_ALSO_RIGHT = {"server_room": ("internal_gains",), "stove": ("internal_gains",), "night_ventilation": ("ventilation",)}
