"""Draws what a trial's building holds: which effects, how strong, where, in which form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from _worlds import Effect

from energyplus_trials import plan
from energyplus_trials.specification import Kind, TrialSpec

Draw = Callable[[TrialSpec, np.random.Generator, float], Effect]
STRENGTHS = (0.35, 1.6)  # of what is typical, drawn evenly on the logarithmic scale


def draw_effects(null: TrialSpec, kind: Kind, rng: np.random.Generator) -> TrialSpec:
    """Return the trial with effects of its kind.

    Parameters
    ----------
    null : TrialSpec
        The trial without effects.
    kind : {"null", "single", "pair", "outside"}
        Of trial.
    rng : Generator
        Random numbers of this purpose.
    """
    names: list[str] = []
    if kind == "single":
        names = [str(rng.choice([n for n in CATALOGUE if possible(null, n) and n != "blinds"]))]
    elif kind == "outside":
        names = [str(rng.choice([n for n in OUTSIDE if possible(null, n)]))]
    elif kind == "pair":
        count = 3 if rng.random() < 0.2 else 2
        names = [str(n) for n in rng.choice([n for n in CATALOGUE if possible(null, n)], count, replace=False)]
        if "blinds" in names and "solar_gain" not in names:
            names[next(k for k, n in enumerate(names) if n != "blinds")] = "solar_gain"
    spec = replace(null, kind=kind)
    for name in sorted(names, key=list(CATALOGUE | OUTSIDE).index):
        spec = with_effect(spec, name, rng)
    return spec


def with_effect(spec: TrialSpec, name: str, rng: np.random.Generator, strength: float | None = None) -> TrialSpec:
    """Return the trial with one effect more.

    Parameters
    ----------
    spec : TrialSpec
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
    effects = (*spec.effects, replace(effect, unexplained_is_right=name in OUTSIDE))
    return replace(spec, effects=effects)


def possible(spec: TrialSpec, name: str) -> bool:
    """Tell whether a building can have an effect.

    Parameters
    ----------
    spec : TrialSpec
        The building.
    name : str
        Of the effect.
    """
    if name == "interfloor_exchange":
        return spec.layout.floors > 1
    if name == "neighbour":
        return 0.0 in spec.layout.glazing.values()
    return True


def outer_zones(spec: TrialSpec) -> tuple[str, ...]:
    """Return the zones that have an exterior wall.

    Parameters
    ----------
    spec : TrialSpec
        The building.
    """
    outer = {s.zone for s in plan.segments(spec.layout.zones) if s.other is None}
    return tuple(zone for zone in spec.zone_names if zone.partition("_")[2] in outer)


def _some(rng: np.random.Generator, zones: tuple[str, ...], low: int, high: int) -> tuple[str, ...]:
    count = min(int(rng.integers(low, high + 1)), len(zones))
    return tuple(sorted(str(z) for z in rng.choice(zones, count, replace=False)))


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _simple(name: str, form: str, *answers: str, **typical: float) -> Draw:
    """Return the draw of an effect of the whole building whose numbers grow with its strength."""

    def draw(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
        numbers = {key: round(value * s, 4) for key, value in typical.items()}
        return Effect(name, form, s, (), numbers, (name, *answers))

    return draw


def _solar_gain(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    transmittance = round(min(rng.uniform(0.3, 0.45) * s, 0.8), 3)
    return Effect("solar_gain", "glass", s, (), {"transmittance": transmittance}, ("solar_gain",))


def _solar_gain_horizon(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    numbers = dict(_solar_gain(spec, rng, s).parameters)
    numbers |= {"azimuth_deg": round(rng.uniform(90.0, 270.0), 1), "elevation_deg": round(rng.uniform(20.0, 45.0), 1)}
    return Effect("solar_gain", "horizon", s, (), numbers, ("solar_gain",))


def _solar_opaque(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    return Effect("solar_opaque", "walls", s, (), {"absorptance": round(min(0.58 * s, 0.95), 3)}, ("solar_opaque",))


def _infiltration(*forms: str) -> Draw:
    def draw(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
        form = str(rng.choice(forms))
        numbers = {"changes_per_hour": round(0.4 * s, 4)}
        if form == "wind_direction":
            numbers |= {"azimuth_deg": round(rng.uniform(0.0, 360.0), 1)}
        return Effect("infiltration", form, s, (), numbers, ("infiltration",))

    return draw


def _internal_gains(*forms: str) -> Draw:
    def draw(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
        numbers = {
            "power_W_m2": round(16.0 * s, 3),
            "base": round(rng.uniform(0.05, 0.3), 3),
            "start_h": round(rng.uniform(7.0, 9.0), 2),
            "end_h": round(rng.uniform(16.5, 18.5), 2),
            "seed": int(rng.integers(2**31)),
        }
        return Effect("internal_gains", str(rng.choice(forms)), s, (), numbers, ("internal_gains",))

    return draw


def _ground(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    numbers = {"u_value_W_m2_K": round(0.7 * s, 4), "warmer_K": round(rng.uniform(0.0, 3.0), 2)}
    return Effect("ground_exchange", "slab", s, (), numbers, ("ground_exchange",))


def _zone_mixing(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    pairs = _pairs(spec)
    chosen = [pairs[k] for k in np.flatnonzero(rng.random(len(pairs)) < 0.5)] or pairs[:1]
    form = str(rng.choice(["constant", "scheduled"]))
    zones = tuple(sorted({z for pair in chosen for z in pair}))
    numbers = {"flow_m3_s": round(0.1 * s, 4), "pairs": [list(pair) for pair in chosen], "start_h": 8.0, "end_h": 18.0}
    return Effect("zone_mixing", form, s, zones, numbers, ("zone_mixing",))


def _pairs(spec: TrialSpec) -> list[tuple[str, str]]:
    """Return the zones that share a partition, once each, floor by floor."""
    plan_pairs = sorted({tuple(sorted((s.zone, s.other))) for s in plan.segments(spec.layout.zones) if s.other})
    return [(f"F{f + 1}_{a}", f"F{f + 1}_{b}") for f in range(spec.layout.floors) for a, b in plan_pairs]


def _sensor_bias(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, spec.zone_names, 1, 2)
    bias = {zone: round(0.8 * s * _sign(rng), 3) for zone in zones}
    return Effect("sensor_bias", "constant", s, zones, {"bias_K": bias}, ("sensor_bias",))


def _duct_loss(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, spec.zone_names, 2, 4)
    return Effect("duct_loss", "constant", s, zones, {"ntu": round(0.15 * s, 4)}, ("duct_loss",))


def _flow_gain(*forms: str) -> Draw:
    def draw(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
        zones = () if rng.random() < 0.15 else _some(rng, spec.zone_names, 2, 4)
        gain = round(0.22 * s * _sign(rng), 4)
        return Effect("flow_gain", str(rng.choice(forms)), s, zones, {"gain": gain}, ("flow_gain",))

    return draw


def _capacity_limit(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, spec.zone_names, 2, 4)
    return Effect(
        "capacity_limit", "damper", s, zones, {"lost_share": round(min(0.4 * s, 0.8), 3)}, ("capacity_limit",)
    )


def _valve_leak(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, spec.zone_names, 1, 2)
    return Effect("valve_leak", "while_air_flows", s, zones, {"power_W_m2": round(10.0 * s, 3)}, ("valve_leak",))


def _clock_shift(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    steps = max(round(6.0 * s), 2)  # of five minutes
    return Effect("clock_shift", "station", s, (), {"steps": int(_sign(rng)) * steps}, ("clock_shift",))


def _neighbour(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    side = next(side for side, share in spec.layout.glazing.items() if share == 0.0)
    inner = {seg.zone for seg in plan.segments(spec.layout.zones) if seg.other is None and seg.side == side}
    zones = tuple(zone for zone in spec.zone_names if zone.partition("_")[2] in inner)
    level = round(rng.uniform(6.0, 14.0) if rng.random() < 0.5 else rng.uniform(21.0, 25.0), 1)
    numbers = {"u_value_W_m2_K": round(1.0 * s, 3), "side": side, "temperature_degC": level}
    return Effect("neighbour", "party_wall", s, zones, numbers, ("neighbour",))


def _window_opening(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, outer_zones(spec), 2, 4)
    numbers = {"area_m2": round(0.3 * s, 4), "seed": int(rng.integers(2**31))}
    return Effect("window_opening", "by_hand", s, zones, numbers, ("window_opening",))


def _blinds(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    numbers = {"beta": round(min(0.55 * s, 0.9), 3), "threshold_W_m2": round(rng.uniform(120.0, 300.0), 0)}
    return Effect("blinds", "exterior_shade", s, (), numbers, ("blinds",))


def _in_one_zone(name: str, answers: tuple[str, ...], **typical: float) -> Draw:
    """Return the draw of an effect outside of the catalogue that one or two zones have."""

    def draw(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
        zones = _some(rng, spec.zone_names, 1, 2)
        numbers = {key: round(value * s, 4) for key, value in typical.items()} | {"seed": int(rng.integers(2**31))}
        return Effect(name, "other", s, zones, numbers, (name, *answers))

    return draw


def _movable_partition(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    pairs = _pairs(spec)
    pair = pairs[int(rng.integers(len(pairs)))]
    numbers = {"flow_m3_s": round(0.5 * s, 4), "pairs": [list(pair)], "seed": int(rng.integers(2**31))}
    return Effect("movable_partition", "some_days", s, pair, numbers, ("movable_partition", "zone_mixing"))


def _swapped_sensors(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, spec.zone_names, 2, 2)
    return Effect("swapped_sensors", "flow_and_discharge", s, zones, {}, ("swapped_sensors",))


def _sunlit_sensor(spec: TrialSpec, rng: np.random.Generator, s: float) -> Effect:
    zones = _some(rng, outer_zones(spec), 1, 2)
    numbers = {"kelvin_at_1000_W_m2": round(3.0 * s, 3), "azimuth_deg": round(rng.uniform(90.0, 270.0), 1)}
    return Effect("sunlit_sensor", "other", s, zones, numbers, ("sunlit_sensor",))


CATALOGUE: dict[str, Draw] = {
    "solar_gain": _solar_gain,
    "blinds": _blinds,
    "solar_opaque": _solar_opaque,
    "longwave_sky": _simple("longwave_sky", "sky", share=1.0),
    "wind_film": _simple("wind_film", "linear", slope_W_s_m3_K=4.0),
    "infiltration": _infiltration("constant", "wind", "stack"),
    "internal_gains": _internal_gains("office"),
    "interfloor_exchange": _simple("interfloor_exchange", "slab", u_value_W_m2_K=1.5),
    "ground_exchange": _ground,
    "roof_exchange": _simple("roof_exchange", "slab", u_value_W_m2_K=0.6),
    "hidden_mass": _simple("hidden_mass", "concrete", capacity_kJ_m2_K=60.0),
    "zone_mixing": _zone_mixing,
    "sensor_bias": _sensor_bias,
    "sensor_lag": _simple("sensor_lag", "first_order", time_constant_s=480.0),
    "duct_loss": _duct_loss,
    "flow_gain": _flow_gain("constant"),
    "capacity_limit": _capacity_limit,
    "valve_leak": _valve_leak,
    "clock_shift": _clock_shift,
    "thermal_bridge": _simple("thermal_bridge", "slab_edge", psi_W_m_K=0.5),
    "neighbour": _neighbour,
    "window_opening": _window_opening,
    "latent_load": _simple("latent_load", "humidifier", power_W_m2=8.0),
}
# Effects that the catalogue does not know, and effects of the catalogue in a form that it does not have.
OUTSIDE: dict[str, Draw] = {
    "night_ventilation": _simple("night_ventilation", "other", "ventilation", changes_per_hour=2.0),
    "stratification": _simple("stratification", "other", share=0.15),
    "wrong_station": _simple("wrong_station", "other", offset_K=2.0, night_K=2.0),
    "movable_partition": _movable_partition,
    "server_room": _in_one_zone("server_room", ("internal_gains",), power_W_m2=25.0),
    "phase_change": _simple("phase_change", "other", latent_kJ_m2=150.0, coupling_W_m2_K=4.0),
    "unmetered_heating": _in_one_zone("unmetered_heating", (), power_W_m2_K=1.2),
    "exhaust_fan": _in_one_zone("exhaust_fan", ("infiltration", "window_opening", "ventilation"), changes_per_hour=2.5),
    "swapped_sensors": _swapped_sensors,
    "sunlit_sensor": _sunlit_sensor,
    "meter_drift": _flow_gain("drift"),
    "gains_bimodal": _internal_gains("bimodal", "random_days"),
    "infiltration_by_direction": _infiltration("wind_direction"),
    "solar_behind_horizon": _solar_gain_horizon,
    "duct_loss_by_flow": lambda spec, rng, s: replace(_duct_loss(spec, rng, s), form="by_flow"),
}
