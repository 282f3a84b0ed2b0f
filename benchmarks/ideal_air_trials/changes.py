"""Switches the effect of a trial on, each in its own part of the building."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from _worlds import Effect

from ideal_air_trials import fabric, model, operation
from ideal_air_trials.fabric import PARTY_BLOCK, construction, merge, resistance
from ideal_air_trials.plan import walls, zone_name
from ideal_air_trials.plant import Plant, Series
from ideal_air_trials.settings import ALWAYS
from ideal_air_trials.specification import OPENINGS, generator
from ideal_air_trials.terminals import ideal_air

_ABSORBED = 0.4  # [-], share of what a pane does not let through that it absorbs
#: What U-values from air to air have beside the layers [m2K/W], after ISO 6946: films of a slab between two floors, of
#: a floor on soil, of a roof, and of a wall between two buildings.
_BETWEEN_FILMS, _FLOOR_FILM, _ROOF_FILMS, _WALL_FILMS = 0.27, 0.15, 0.14, 0.26
_LEAST_RESISTANCE = 0.01  # [m2K/W]
_PARTY_FILM = 8.0  # [W/m2/K], behind a party wall
_MASS_DENSITY, _MASS_CAPACITY = 1200.0, 1000.0  # [kg/m3], [J/kg/K]
_INDOORS = 20.0  # [degC], that soil below a building is drawn to
_SOIL_LIMITS = (3.0, 24.0)  # [degC]
_WARMEST_SOIL = 7.5  # months after the beginning of the year
_DOORS_AT_NIGHT = 0.1  # [-], of the flow in working hours
_MOST_SERVERS = 3500.0  # [W] in a room, which its ideal air can still cool
_FLOWING = 0.0001  # [kg/s], more is air


def apply_changes(plant: Plant) -> None:
    """Switch the effect on; those of sensors and meters change only what is reported.

    Parameters
    ----------
    plant : Plant
        The null; changed.
    """
    for effect in plant.spec.effects:
        change = _CHANGES.get(effect.name)
        if change is not None:
            change(plant, effect)


def _people(plant: Plant) -> np.random.Generator:
    return generator(plant.spec.stream, plant.spec.seed, OPENINGS)


def _solar_gain(plant: Plant, effect: Effect) -> None:
    plant.sun = True
    of_one = effect.parameters["transmittance"] ** 0.5
    merge(plant.objects, fabric.window(plant.spec.fabric, of_one, (1.0 - _ABSORBED) * (1.0 - of_one)))


def _solar_opaque(plant: Plant, effect: Effect) -> None:
    plant.sun = True
    outer, _ = fabric.WALLS[plant.spec.fabric.wall]
    merge(plant.objects, fabric.material(outer, effect.parameters["absorptance"]))


def _longwave_sky(plant: Plant, effect: Effect) -> None:
    plant.sky = effect.parameters["share"]


def _infiltration(plant: Plant, effect: Effect) -> None:
    """EnergyPlus' flow: design * (constant + per kelvin * |indoors - outdoors| + per m/s * wind)."""
    constant, kelvin, wind = effect.parameters["terms"]
    for zone, share in effect.parameters["share"].items():
        plant.add(
            "ZoneInfiltration:DesignFlowRate", f"{zone} leak", zone_or_zonelist_or_space_or_spacelist_name=zone,
            schedule_name=ALWAYS, design_flow_rate_calculation_method="AirChanges/Hour",
            air_changes_per_hour=round(effect.parameters["changes_per_hour"] * share, 4),
            constant_term_coefficient=constant, temperature_term_coefficient=kelvin, velocity_term_coefficient=wind,
            velocity_squared_term_coefficient=0.0,
        )  # fmt: skip


def _heat(plant: Plant, zone: str, shares: Series, watts: float, radiant: float) -> None:
    """Add equipment that no meter sees."""
    plant.add(
        "ElectricEquipment", f"{zone} equipment", zone_or_zonelist_or_space_or_spacelist_name=zone,
        schedule_name=plant.follow(f"{zone} use", shares), design_level_calculation_method="EquipmentLevel",
        design_level=round(watts, 2), fraction_latent=0.0, fraction_radiant=round(radiant, 3), fraction_lost=0.0,
    )  # fmt: skip


def _internal_gains(plant: Plant, effect: Effect) -> None:
    rng, areas, numbers = _people(plant), plant.spec.layout.areas(), effect.parameters
    for zone in filter(effect.holds, plant.spec.zone_names):
        watts = numbers["power_W_m2"] * numbers["share"][zone] * areas[zone]
        _heat(plant, zone, operation.occupied(plant.spec, effect, rng), watts, numbers["radiant_share"])


def _server_room(plant: Plant, effect: Effect) -> None:
    (zone,) = effect.zones
    daily = np.sin((operation.hours(plant.spec) - 8.0) / 24.0 * 2.0 * np.pi)
    watts = min(effect.parameters["power_W_m2"] * plant.spec.layout.areas()[zone], _MOST_SERVERS)
    _heat(plant, zone, np.round(1.0 + effect.parameters["swing"] * daily, 2), watts, 0.1)


def _stove(plant: Plant, effect: Effect) -> None:
    rng, numbers = _people(plant), effect.parameters
    for zone in filter(effect.holds, plant.spec.zone_names):
        shares = operation.fires(plant.spec, numbers["fires_a_day"], numbers["duration_h"], rng)
        _heat(plant, zone, shares, numbers["power_W"], numbers["radiant_share"])


def _interfloor(plant: Plant, effect: Effect) -> None:
    """Join the two halves of a slab over as much of its area as makes the conductance, from the west."""
    spec, made = plant.spec, plant.spec.fabric
    layers = 2.0 * fabric.slab_half(made) + made.carpet_resistance + made.tile_resistance
    share = min(effect.parameters["u_value_W_m2_K"] * (layers + _BETWEEN_FILMS), 1.0)
    merge(
        plant.objects,
        fabric.material(fabric.slab("whole slab", made, made.slab_thickness)),
        construction("floor between", ("tile", "whole slab", "carpet")),
        construction("ceiling between", ("carpet", "whole slab", "tile")),
    )
    surfaces = plant.objects["BuildingSurface:Detailed"]
    for floor in range(spec.layout.floors):
        for name, box in spec.layout.boxes().items():
            zone, (low, high) = zone_name(floor, name), spec.layout.levels(floor)
            for kind, height, beyond in (("Floor", low, floor - 1), ("Ceiling", high, floor + 1)):
                if not 0 <= beyond < spec.layout.floors:
                    continue
                own, far = kind.lower(), "ceiling" if kind == "Floor" else "floor"
                joined = model.surface(
                    zone, kind, f"{own} between", model.slab_corners(kind, box, height, (0.0, share))
                )
                surfaces[f"{zone} {own} between"] = joined | {
                    "outside_boundary_condition": "Surface", "sun_exposure": "NoSun", "wind_exposure": "NoWind",
                    "outside_boundary_condition_object": f"{zone_name(beyond, name)} {far} between",
                }  # fmt: skip
                left = model.slab_corners(kind, box, height, (share, 1.0))
                if left:
                    surfaces[f"{zone} {own}"] = model.surface(zone, kind, own, left) | model.behind(model.NO_FLOW)
                else:
                    del surfaces[f"{zone} {own}"]


def _added(name: str, u_value: float, others: float) -> fabric.Objects:
    """Layer that makes a U-value with others [W/m2/K], [m2K/W]; the sun does not warm it."""
    return resistance(name, max(1.0 / u_value - others, _LEAST_RESISTANCE), fabric.NO_SUN)


def _ground(plant: Plant, effect: Effect) -> None:
    made, numbers = plant.spec.fabric, effect.parameters
    others = fabric.slab_half(made) + made.carpet_resistance + _FLOOR_FILM
    merge(plant.objects, _added("soil", numbers["u_value_W_m2_K"], others),
          construction("lowest floor", ("soil", "half slab", "carpet")))  # fmt: skip
    mean = float(plant.weather.hourly["outside_air_temperature_sensor"].mean())
    level = mean + numbers["share_of_20_degC"] * (_INDOORS - mean) + numbers["offset_K"]
    level = float(np.clip(level, *_SOIL_LIMITS))
    months = ("january", "february", "march", "april", "may", "june", "july", "august", "september", "october",
              "november", "december")  # fmt: skip
    courses = np.cos(2.0 * np.pi * (np.arange(12) - _WARMEST_SOIL) / 12.0)
    temperatures = {
        f"{month}_ground_temperature": round(float(level + numbers["swing_K"] * course), 2)
        for month, course in zip(months, courses, strict=True)
    }
    plant.add("Site:GroundTemperature:BuildingSurface", "soil", **temperatures)
    for name in plant.spec.layout.boxes():
        floor = plant.objects["BuildingSurface:Detailed"][f"{zone_name(0, name)} floor"]
        floor |= {"construction_name": "lowest floor", "outside_boundary_condition": "Ground"}
        del floor["outside_boundary_condition_object"]


def _roof(plant: Plant, effect: Effect) -> None:
    made, top = plant.spec.fabric, plant.spec.layout.floors - 1
    others = fabric.slab_half(made) + made.tile_resistance + _ROOF_FILMS
    merge(plant.objects, _added("roofing", effect.parameters["u_value_W_m2_K"], others),
          construction("roof", ("roofing", "half slab", "tile")))  # fmt: skip
    for name in plant.spec.layout.boxes():
        ceiling = plant.objects["BuildingSurface:Detailed"][f"{zone_name(top, name)} ceiling"]
        ceiling |= {"surface_type": "Roof", "construction_name": "roof", "outside_boundary_condition": "Outdoors",
                    "sun_exposure": "SunExposed", "wind_exposure": "WindExposed"}  # fmt: skip
        del ceiling["outside_boundary_condition_object"]


def _neighbour(plant: Plant, effect: Effect) -> None:
    """Put a neighbour behind the facade without windows, in place of outdoors."""
    numbers, layout = effect.parameters, plant.spec.layout
    others = PARTY_BLOCK[1] / PARTY_BLOCK[2] + _WALL_FILMS
    daily = np.sin((operation.hours(plant.spec) - 9.0) / 24.0 * 2.0 * np.pi)
    temperature = np.round(numbers["temperature_degC"] + numbers["swing_K"] * daily, 1)
    merge(
        plant.objects,
        _added("party layer", numbers["u_value_W_m2_K"], others),
        fabric.material(PARTY_BLOCK),
        construction("party wall", ("party layer", PARTY_BLOCK[0])),
        model.other_side("next door", _PARTY_FILM, follows=plant.follow("next door", temperature)),
    )
    for floor in range(layout.floors):
        for wall in walls(layout):
            if wall.other is None and wall.side == numbers["side"]:
                surface = plant.objects["BuildingSurface:Detailed"][model.wall_name(floor, wall)]
                surface |= {"construction_name": "party wall"} | model.behind("next door")


def _hidden_mass(plant: Plant, effect: Effect) -> None:
    """Plates of which one face sees the zone."""
    share = effect.parameters["area_share"]
    capacity = effect.parameters["capacity_kJ_m2_K"] * 1000.0 / share
    thickness = capacity / (_MASS_DENSITY * _MASS_CAPACITY)
    layer: fabric.Layer = ("plate", thickness, 1.0, _MASS_DENSITY, _MASS_CAPACITY)
    merge(plant.objects, fabric.material(layer), construction("plate", ("plate",)))
    for zone, area in plant.spec.layout.areas().items():
        plant.add("InternalMass", f"{zone} plates", construction_name="plate", zone_or_zonelist_name=zone,
                  surface_area=round(share * area, 3))  # fmt: skip


def _zone_mixing(plant: Plant, effect: Effect) -> None:
    numbers, shares = effect.parameters, np.ones(len(plant.spec.starts))
    if effect.form == "working_hours":
        shares = np.where(operation.working_hours(plant.spec), 1.0, _DOORS_AT_NIGHT)
    schedule = plant.follow("doors", shares)
    for pair, share in zip(numbers["pairs"], numbers["share"], strict=True):
        for zone, source in (pair, pair[::-1]):
            plant.add(
                "ZoneMixing", f"{source} to {zone}", zone_or_space_name=zone, source_zone_or_space_name=source,
                schedule_name=schedule, design_flow_rate_calculation_method="Flow/Zone",
                design_flow_rate=round(numbers["flow_m3_s"] * share, 4), delta_temperature=0.0,
            )  # fmt: skip


def _sensor_bias(plant: Plant, effect: Effect) -> None:
    """Let thermostats control what their sensors read: zones are off by the bias."""
    for zone, bias in effect.parameters["bias_K"].items():
        for values in plant.setpoints:
            values[zone] -= bias


def _capacity_limit(plant: Plant, effect: Effect) -> None:
    left, areas, limits = 1.0 - effect.parameters["lost_share"], plant.spec.layout.areas(), plant.spec.terminal
    for zone in effect.zones:
        air = plant.objects["ZoneHVAC:IdealLoadsAirSystem"][ideal_air(zone)]
        air["maximum_sensible_heating_capacity"] = round(left * limits.heating_power * areas[zone], 1)
        air["maximum_total_cooling_capacity"] = round(left * limits.cooling_power * areas[zone], 1)


def _valve_leak(plant: Plant, effect: Effect) -> None:
    """Give heat that no meter sees while air flows, by EnergyPlus' own programs."""
    lines = []
    for zone in effect.zones:
        watts = effect.parameters["power_W_m2"] * plant.spec.layout.areas()[zone]
        plant.add(
            "OtherEquipment", f"{zone} leak", fuel_type="None", zone_or_zonelist_or_space_or_spacelist_name=zone,
            schedule_name=ALWAYS, design_level_calculation_method="EquipmentLevel", design_level=0.0,
        )  # fmt: skip
        plant.add(
            "EnergyManagementSystem:Sensor", f"flow_{zone}",
            output_variable_or_output_meter_index_key_name=ideal_air(zone),
            output_variable_or_output_meter_name="Zone Ideal Loads Supply Air Mass Flow Rate",
        )  # fmt: skip
        plant.add(
            "EnergyManagementSystem:Actuator", f"leak_{zone}", actuated_component_unique_name=f"{zone} leak",
            actuated_component_type="OtherEquipment", actuated_component_control_type="Power Level",
        )  # fmt: skip
        lines += [f"IF flow_{zone} > {_FLOWING}", f"SET leak_{zone} = {watts:.2f}", "ELSE", f"SET leak_{zone} = 0",
                  "ENDIF"]  # fmt: skip
    plant.add("EnergyManagementSystem:Program", "leaks", lines=[{"program_line": line} for line in lines])
    plant.add(
        "EnergyManagementSystem:ProgramCallingManager", "leaks before each step",
        energyplus_model_calling_point="BeginTimestepBeforePredictor", programs=[{"program_name": "leaks"}],
    )  # fmt: skip


def _ventilate(plant: Plant, zone: str, schedule: str, changes: float, **fields: float) -> None:
    """Bring outdoor air, whatever its temperature and that of the zone, unless fields say otherwise."""
    unlimited = {
        "constant_term_coefficient": 1.0, "temperature_term_coefficient": 0.0, "velocity_term_coefficient": 0.0,
        "minimum_indoor_temperature": -100.0, "delta_temperature": -100.0,
    }  # fmt: skip
    plant.add(
        "ZoneVentilation:DesignFlowRate", f"{zone} outdoor air", zone_or_zonelist_or_space_or_spacelist_name=zone,
        schedule_name=schedule, design_flow_rate_calculation_method="AirChanges/Hour",
        air_changes_per_hour=round(changes, 3), ventilation_type="Natural", fan_pressure_rise=0.0,
        fan_total_efficiency=1.0, velocity_squared_term_coefficient=0.0, **(unlimited | fields),
    )  # fmt: skip


def _window_opening(plant: Plant, effect: Effect) -> None:
    """Open windows by hand: more air the larger the difference of temperatures and the stronger the wind."""
    rng, outdoor, numbers = _people(plant), plant.outdoor, effect.parameters
    for zone in filter(effect.holds, plant.spec.zone_names):
        shares = operation.openings(plant.spec, outdoor, numbers["eagerness"], rng)
        _ventilate(
            plant, zone, plant.follow(f"{zone} windows", shares), numbers["changes_per_hour"],
            constant_term_coefficient=0.3, temperature_term_coefficient=0.05, velocity_term_coefficient=0.1,
        )  # fmt: skip


def _night_ventilation(plant: Plant, effect: Effect) -> None:
    numbers, hour = effect.parameters, operation.hours(plant.spec)
    night = plant.follow("night", np.where((hour >= numbers["from_h"]) | (hour < numbers["to_h"]), 1.0, 0.0))
    for zone in plant.spec.zone_names:
        _ventilate(plant, zone, night, numbers["changes_per_hour"], delta_temperature=1.5,
                   minimum_indoor_temperature=round(numbers["least_indoor_degC"], 2))  # fmt: skip


_CHANGES: dict[str, Callable[[Plant, Effect], None]] = {
    "solar_gain": _solar_gain, "solar_opaque": _solar_opaque, "longwave_sky": _longwave_sky,
    "infiltration": _infiltration, "internal_gains": _internal_gains, "interfloor_exchange": _interfloor,
    "ground_exchange": _ground, "roof_exchange": _roof, "neighbour": _neighbour, "hidden_mass": _hidden_mass,
    "zone_mixing": _zone_mixing, "sensor_bias": _sensor_bias, "capacity_limit": _capacity_limit,
    "valve_leak": _valve_leak, "window_opening": _window_opening, "server_room": _server_room, "stove": _stove,
    "night_ventilation": _night_ventilation,
}  # fmt: skip
