"""People and what they bring: gains, latent load, clocks that are wrong."""

from __future__ import annotations

from functools import partial

import numpy as np

from thermal._types import FloatArray
from thermal.effects.effect import CONSTANT, Effect, Joining, shape, strength
from thermal.inputs.drivers import Drivers, Signal


def _slope(values: FloatArray, step: float) -> FloatArray:
    """Rate of change by central differences [1/h]."""
    return np.asarray(np.gradient(values, step / 3600.0, axis=0))


def _occupancy(drivers: Drivers) -> FloatArray:
    return drivers.occupancy


def _arrival(drivers: Drivers) -> FloatArray:
    return _slope(drivers.occupancy, drivers.case.step)


def _heat_slope(drivers: Drivers, zone: str) -> FloatArray:
    return _slope(drivers.heat[:, drivers.zones.index(zone)], drivers.case.step)


def _outdoor_slope(drivers: Drivers) -> FloatArray:
    return _slope(drivers.outdoor, drivers.case.step)


PRESENCE = Signal("presence", "1", _occupancy)


def _build_gains(join: Joining) -> None:
    peak, shift, base = (join.parameter(n) for n in ("internal_gain", "internal_gain_delay", "base_load"))
    arrival = Signal("coming and going", "1/h", _arrival)
    for value, signal in ((peak, PRESENCE), (-peak * shift, arrival), (base, CONSTANT)):
        for room in join.rooms:
            join.heat_air(room, value, signal, 0.5 * room.floor_area)
            join.heat_surfaces(room, value, signal, 0.5 * room.floor_area)


def _build_latent(join: Joining) -> None:
    load = join.parameter("latent_load")
    for room in join.rooms:
        join.heat_air(room, load, PRESENCE, -room.floor_area)


def _build_shift(join: Joining) -> None:
    heat, weather = join.parameter("heat_clock_shift"), join.parameter("weather_clock_shift")
    for room in join.rooms:
        signal = Signal(f"change of heat in {room.name}", "W/h", partial(_heat_slope, zone=room.name))
        join.heat_air(room, heat, signal, -1.0)
    outdoor = Signal("change of outdoor temperature", "K/h", _outdoor_slope)
    for value, _, node, weight in join.graph.touching(np.array([join.graph.boundary("outdoor")])):
        join.graph.source(join.key(), -weather * value, node, outdoor, weight)


INTERNAL_GAINS = Effect(
    id="internal_gains",
    title="heat from people, light and equipment",
    equation="A (P occ(t - τ) + P_0), half to the air",
    source="ISO 18523-1:2016; ASHRAE Fundamentals 2017, ch. 18",
    acts_on="air and surfaces of every zone",
    confounders=("solar_gain", "clock_shift", "ground_exchange"),
    separated_by="weekends; plug meters; CO2",
    parameters=(
        strength("internal_gain", "W/m^2", 30.0, "2 to 30: ASHRAE Fundamentals 2017, ch. 18", "internal_gains"),
        shape("internal_gain_delay", "h", 0.0, -1.0, 1.0, "against hours from 8 to 18", "internal_gains", "linear"),
        strength("base_load", "W/m^2", 6.0, "0 to 6: equipment at night", "internal_gains"),
    ),
    build=_build_gains,
)

LATENT_LOAD = Effect(
    id="latent_load",
    title="heat that evaporating water takes",
    equation="-L A occ(t)",
    source="ASHRAE Fundamentals 2017, ch. 18, table 1 (latent heat of people)",
    acts_on="air of every zone",
    confounders=("internal_gains", "window_opening", "infiltration"),
    separated_by="humidity sensors; humidifiers off for a week",
    parameters=(strength("latent_load", "W/m^2", 10.0, "55 W a person at 5 to 10 m2", "latent_load"),),
    build=_build_latent,
)

CLOCK_SHIFT = Effect(
    id="clock_shift",
    title="a clock that is off",
    equation="-τ dq/dt; -τ κ dT_out/dt",
    source="first order of q(t - τ) and T_out(t - τ)",
    acts_on="air, and whatever touches the outdoor air",
    confounders=("internal_gains", "solar_gain", "sensor_lag"),
    separated_by="sun time and office time",
    parameters=(
        strength("heat_clock_shift", "h", 1.0, "an hour, as by daylight saving", "clock_shift", -1.0),
        strength("weather_clock_shift", "h", 1.0, "an hour, as by daylight saving", "clock_shift", -1.0),
    ),
    build=_build_shift,
    shifts=("heat_clock_shift", "weather_clock_shift"),
)
