"""From the null's input to that with effects: which effect changes EnergyPlus how."""

from __future__ import annotations

from collections.abc import Callable

from _worlds import Effect

from energyplus_trials import envelope, inside
from energyplus_trials.plant import Plant

CHANGES: dict[str, Callable[[Plant, Effect], None]] = {
    "solar_gain": envelope.solar_gain,
    "blinds": envelope.blinds,
    "solar_opaque": envelope.solar_opaque,
    "longwave_sky": envelope.longwave_sky,
    "wind_film": envelope.wind_film,
    "interfloor_exchange": envelope.interfloor,
    "ground_exchange": envelope.ground,
    "roof_exchange": envelope.roof,
    "thermal_bridge": envelope.thermal_bridge,
    "neighbour": envelope.neighbour,
    "infiltration": inside.infiltration,
    "internal_gains": inside.internal_gains,
    "hidden_mass": inside.hidden_mass,
    "zone_mixing": inside.zone_mixing,
    "movable_partition": inside.zone_mixing,
    "window_opening": inside.window_opening,
    "latent_load": inside.latent_load,
    "valve_leak": inside.valve_leak,
    "capacity_limit": inside.capacity_limit,
    "sensor_bias": inside.sensor_bias,
    "night_ventilation": inside.night_ventilation,
    "exhaust_fan": inside.exhaust_fan,
    "server_room": inside.server_room,
    "phase_change": inside.phase_change,
    "unmetered_heating": inside.unmetered_heating,
}


def apply_changes(plant: Plant) -> None:
    """Switch the building's effects on.

    Parameters
    ----------
    plant : Plant
        Of a null; changed.
    """
    for effect in plant.spec.effects:
        change = CHANGES.get(effect.name)
        if change is not None:
            change(plant, effect)
