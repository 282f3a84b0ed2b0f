"""Effects inside the building and of its air: gains, masses, leakage, openings, mixing, terminals."""

from __future__ import annotations

from typing import Any

import numpy as np
from _worlds import Effect

from energyplus_trials import fabric, model, profiles
from energyplus_trials.draw_effects import outer_zones
from energyplus_trials.frame import merge
from energyplus_trials.plant import Plant

HIDDEN_MASS_THICKNESS = 0.1  # [m] of concrete, of which each face has half


def zones_of(plant: Plant, effect: Effect) -> tuple[str, ...]:
    """Return the zones that have an effect.

    Parameters
    ----------
    plant : Plant
        The building.
    effect : Effect
        Of the building.
    """
    return effect.zones or plant.spec.zone_names


def heat(plant: Plant, zone: str, name: str, watts: float, schedule: str, radiant: float, latent: float = 0.0) -> None:
    """Add heat to a zone, or take it.

    Parameters
    ----------
    plant : Plant
        The building; changed.
    zone, name : str
        Where, and what.
    watts : float
        At a schedule of 1 [W].
    schedule : str
        Its schedule.
    radiant, latent : float
        Shares [-]; the rest goes to the air.
    """
    plant.add(
        "OtherEquipment", f"{zone} {name}", fuel_type="None", zone_or_zonelist_or_space_or_spacelist_name=zone,
        schedule_name=schedule, design_level_calculation_method="EquipmentLevel", design_level=float(watts),
        fraction_latent=latent, fraction_radiant=radiant, fraction_lost=0.0,
    )  # fmt: skip


def internal_gains(plant: Plant, effect: Effect) -> None:
    """Add heat of people, light and equipment, which follows one profile in zones of unequal strength."""
    rng = np.random.default_rng(effect.parameters["seed"])
    shared = plant.add_schedule("use", profiles.use(plant.starts, effect.form, effect.parameters))
    for zone in zones_of(plant, effect):
        watts = effect.parameters["power_W_m2"] * rng.uniform(0.75, 1.25) * model.area(plant.spec, zone)
        heat(plant, zone, "gains", watts, shared, radiant=0.35)


def hidden_mass(plant: Plant, effect: Effect) -> None:
    """Stand concrete in the rooms."""
    layers: fabric.Layers = [("concrete", HIDDEN_MASS_THICKNESS)]
    merge(plant.objects, fabric.objects({"hidden mass": layers}, fabric.NO_SOLAR_ABSORPTANCE))
    _, density, capacity = fabric.SOLIDS["concrete"]
    of_a_face = HIDDEN_MASS_THICKNESS / 2.0 * density * capacity / 1000.0  # [kJ/m2/K]
    for zone in plant.spec.zone_names:
        area = effect.parameters["capacity_kJ_m2_K"] / of_a_face * model.area(plant.spec, zone)
        plant.add(
            "InternalMass", f"{zone} hidden mass", construction_name="hidden mass", zone_or_zonelist_name=zone,
            surface_area=round(area, 4),
        )  # fmt: skip


def zone_mixing(plant: Plant, effect: Effect) -> None:
    """Open doors: as much air goes one way as the other."""
    open_ = profiles.doors(plant.starts, effect.form, effect.parameters)
    schedule = plant.add_schedule("doors", open_)
    for zone, other in effect.parameters["pairs"]:
        plant.add(
            "ZoneCrossMixing", f"{zone} {other}", zone_or_space_name=zone, source_zone_or_space_name=other,
            schedule_name=schedule, design_flow_rate_calculation_method="Flow/Zone",
            design_flow_rate=effect.parameters["flow_m3_s"], delta_temperature=0.0,
        )  # fmt: skip


def infiltration(plant: Plant, effect: Effect) -> None:
    """Leak outdoor air: as strong as the constant form at 3.5 m/s, and at 15 K."""
    changes, wind = effect.parameters["changes_per_hour"], plant.station["wind_speed_sensor"].to_numpy()
    series: Any = 1.0
    if effect.form == "wind_direction":
        angle = plant.station["wind_direction_sensor"].to_numpy() - effect.parameters["azimuth_deg"]
        series = np.maximum(np.cos(np.radians(angle)), 0.0) * wind / 1.2
    schedule = plant.add_schedule("leakage", series)
    for zone in outer_zones(plant.spec):
        volume = model.area(plant.spec, zone) * plant.spec.layout.height
        if effect.form == "stack":
            # flow = leakage / 1000 · √(C_s ΔT), [cm2] and [m3/s] (EnergyPlus, Engineering Reference)
            leakage = 1000.0 * changes * volume / 3600.0 / np.sqrt(0.000145 * 15.0)
            plant.add(
                "ZoneInfiltration:EffectiveLeakageArea", f"{zone} leak", zone_or_space_name=zone,
                schedule_name=schedule, effective_air_leakage_area=float(leakage), stack_coefficient=0.000145,
                wind_coefficient=1e-9,
            )  # fmt: skip
            continue
        by_wind = 1.0 / 3.5 if effect.form == "wind" else 0.0
        plant.add(
            "ZoneInfiltration:DesignFlowRate", f"{zone} leak", zone_or_zonelist_or_space_or_spacelist_name=zone,
            schedule_name=schedule, design_flow_rate_calculation_method="AirChanges/Hour",
            air_changes_per_hour=changes, constant_term_coefficient=0.0 if by_wind else 1.0,
            temperature_term_coefficient=0.0, velocity_term_coefficient=by_wind,
            velocity_squared_term_coefficient=0.0,
        )  # fmt: skip


def window_opening(plant: Plant, effect: Effect) -> None:
    """Let people open windows for a while in working hours; the flow follows temperature and wind."""
    rng = np.random.default_rng(effect.parameters["seed"])
    for zone in effect.zones:
        schedule = plant.add_schedule(f"{zone} windows", profiles.openings(plant.starts, rng))
        plant.add(
            "ZoneVentilation:WindandStackOpenArea", f"{zone} windows", zone_or_space_name=zone,
            opening_area=effect.parameters["area_m2"], opening_area_fraction_schedule_name=schedule,
            opening_effectiveness=0.3, effective_angle=0.0, height_difference=0.5,
            discharge_coefficient_for_opening=0.6, maximum_wind_speed=40.0,
        )  # fmt: skip


def latent_load(plant: Plant, effect: Effect) -> None:
    """Evaporate water in the rooms in working hours: its heat of evaporation is taken from the air."""
    schedule = plant.add_schedule("humidifiers", profiles.hours(plant.starts, 7.0, 18.0))
    for zone in zones_of(plant, effect):
        watts = effect.parameters["power_W_m2"] * model.area(plant.spec, zone)
        heat(plant, zone, "evaporation", -watts, schedule, radiant=0.0)
        heat(plant, zone, "vapour", watts, schedule, radiant=0.0, latent=1.0)


def valve_leak(plant: Plant, effect: Effect) -> None:
    """Give heat that no meter sees, whenever air flows."""
    always = plant.add_schedule("leaking", 1.0)
    for zone in effect.zones:
        watts = effect.parameters["power_W_m2"] * model.area(plant.spec, zone)
        heat(plant, zone, "leak", 0.0, always, radiant=0.0)
        plant.laws.append({"law": "leak", "device": f"{zone} leak", "zone": zone, "watts": watts})


def capacity_limit(plant: Plant, effect: Effect) -> None:
    """Let dampers stick: less than the design flow gets through."""
    for zone in effect.zones:
        unit = plant.objects["ZoneHVAC:IdealLoadsAirSystem"][f"{zone} ideal loads"]
        for limit in ("maximum_heating_air_flow_rate", "maximum_cooling_air_flow_rate"):
            unit[limit] = round(unit[limit] * (1.0 - effect.parameters["lost_share"]), 6)


def sensor_bias(plant: Plant, effect: Effect) -> None:
    """Let the thermostat control what its sensor reads: the room is off by the bias."""
    for zone, bias in effect.parameters["bias_K"].items():
        for kind in ("heating", "cooling"):
            plant.drive[f"{zone} {kind}"] = plant.drive[f"{zone} {kind}"] - bias


def night_ventilation(plant: Plant, effect: Effect) -> None:
    """Air the building at night while it is warmer than outdoors."""
    schedule = plant.add_schedule("night", 1.0 - profiles.hours(plant.starts, 6.0, 22.0, every_day=True))
    for zone in zones_of(plant, effect):
        ventilate(plant, zone, effect.parameters["changes_per_hour"], schedule, coldest=18.0)


def exhaust_fan(plant: Plant, effect: Effect) -> None:
    """Draw outdoor air through a zone at lunch time and in the evening."""
    lunch = profiles.hours(plant.starts, 11.5, 13.5) + profiles.hours(plant.starts, 17.0, 18.0)
    schedule = plant.add_schedule("fan", np.minimum(lunch, 1.0))
    for zone in effect.zones:
        ventilate(plant, zone, effect.parameters["changes_per_hour"], schedule, coldest=-100.0)


def ventilate(plant: Plant, zone: str, changes: float, schedule: str, coldest: float) -> None:
    """Bring outdoor air to a zone.

    Parameters
    ----------
    plant : Plant
        The building; changed.
    zone : str
        Where.
    changes : float
        Of the zone's air [1/h].
    schedule : str
        When.
    coldest : float
        Temperature of the zone that stops it [degC].
    """
    plant.add(
        "ZoneVentilation:DesignFlowRate", f"{zone} {schedule}", zone_or_zonelist_or_space_or_spacelist_name=zone,
        schedule_name=schedule, design_flow_rate_calculation_method="AirChanges/Hour", air_changes_per_hour=changes,
        ventilation_type="Natural", minimum_indoor_temperature=coldest,
        delta_temperature=1.0 if coldest > -100.0 else -100.0, constant_term_coefficient=1.0,
        temperature_term_coefficient=0.0, velocity_term_coefficient=0.0, velocity_squared_term_coefficient=0.0,
    )  # fmt: skip


def server_room(plant: Plant, effect: Effect) -> None:
    """Run a load by day and night, on or off for random stretches."""
    rng = np.random.default_rng(effect.parameters["seed"])
    for zone in effect.zones:
        schedule = plant.add_schedule(f"{zone} servers", profiles.on_and_off(rng, len(plant.starts)))
        watts = effect.parameters["power_W_m2"] * model.area(plant.spec, zone)
        heat(plant, zone, "servers", watts, schedule, radiant=0.1)


def phase_change(plant: Plant, effect: Effect) -> None:
    """Hang boards that melt about the rooms' temperature."""
    always = plant.add_schedule("boards", 1.0)
    for zone in zones_of(plant, effect):
        area = model.area(plant.spec, zone)
        heat(plant, zone, "boards", 0.0, always, radiant=0.0)
        plant.laws.append(
            {
                "law": "phase_change", "device": f"{zone} boards", "zone": zone, "melting": 21.5, "width": 1.5,
                "coupling": effect.parameters["coupling_W_m2_K"] * area, "capacity": 15000.0 * area,
                "latent": 1000.0 * effect.parameters["latent_kJ_m2"] * area,
            }
        )  # fmt: skip


def unmetered_heating(plant: Plant, effect: Effect) -> None:
    """Heat with radiators that no meter counts and that follow the outdoor temperature below 16 degC by day."""
    need = np.maximum(16.0 - plant.station["outside_air_temperature_sensor"].to_numpy(), 0.0)
    schedule = plant.add_schedule("radiators", need * profiles.hours(plant.starts, 4.0, 21.0, every_day=True))
    for zone in effect.zones:
        watts = effect.parameters["power_W_m2_K"] * model.area(plant.spec, zone)
        heat(plant, zone, "radiator", watts, schedule, radiant=0.4)
