"""The EnergyPlus input (epJSON) of a trial's null: walls, windows, slabs, furniture and metered heat, nothing else."""

from __future__ import annotations

from typing import Any

import pandas as pd
from energyplus_trials.frame import Objects, constant, frame, merge, polygon

from house_trials import fabric
from house_trials.draw_effects import heated
from house_trials.faces import DOORWAY_AREA, Face, faces, partner
from house_trials.specification import HouseSpec

DARK = 0.001  # [-], solar absorptance of a surface that the sun does not warm; EnergyPlus wants more than 0
_INSIDE = 0.6  # [-], solar absorptance of surfaces inside
_COLD_DAY = 31.0  # [K] between rooms and outdoors, that heaters are sized for
_AIR_CHANGE = 0.4  # [1/h], by which a designer sizes them
_FILES = ("mtr", "eso", "eio", "tabular", "sqlite", "json", "audit", "zone_sizing", "system_sizing", "dxf", "bnd",
          "rdd", "mdd", "mtd", "shd", "dfs", "glhe", "delightin", "delighteldmp", "delightdfdmp", "edd", "dbg",
          "perflog", "sln", "sci", "wrl", "screen", "tarcog", "extshd")  # fmt: skip


def null_model(spec: HouseSpec, first: pd.Timestamp, last: pd.Timestamp) -> Objects:
    """Return the input by EnergyPlus class and object name.

    Parameters
    ----------
    spec : HouseSpec
        Of which the effects are not read.
    first, last : Timestamp
        First and last day of the run.
    """
    objects = frame("run", first.date(), last.date())
    objects |= {"Zone": {}, "BuildingSurface:Detailed": {}, "Window": {}, "InternalMass": {}, "ZoneCrossMixing": {}}
    for part in (_settings(spec), materials(spec, DARK), _glass(spec), _rooms(spec), _surroundings(spec)):
        merge(objects, part)
    for room in heated(spec):
        merge(objects, _floor_heater(spec, room) if on_floor(spec, room) else _radiator(spec, room))
    return {kind: content for kind, content in objects.items() if content}


def on_floor(spec: HouseSpec, room: str) -> bool:
    """Tell whether a room is heated by its floor.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    room : str
        A heated room.
    """
    return spec.heating.emitter == "floor" and spec.room(room).floor == 0


def heater_power(spec: HouseSpec, room: str) -> float:
    """Return the power of a room's heater [W]: what it loses on a cold day, times what it is oversized.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    room : str
        A heated room.
    """
    layers, lost = fabric.constructions(spec.fabric), 0.0
    for face in faces(spec.house):
        if face.room == room and face.other not in spec.zone_names:
            share = 1.0 if face.other in ("outdoor", "attic") else 0.4
            opaque = fabric.u_value(layers[fabric.construction_of(face)]) * (face.area - face.glass)
            lost += share * (opaque + spec.fabric.window_u_value * face.glass)
    lost += 0.34 * _AIR_CHANGE * spec.room(room).area * spec.house.height
    return round(max(spec.heating.oversize * lost * _COLD_DAY, 45.0 * spec.room(room).area), 0)


def heater_schedule(spec: HouseSpec, room: str) -> str:
    """Return the name of the schedule by which a heater is driven.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    room : str
        A heated room.
    """
    return f"{room} {'floor switch' if on_floor(spec, room) else 'heater'}"


def _settings(spec: HouseSpec) -> Objects:
    # Surfaces see the air of the last step, and the air the surfaces of this one. Where air jumps by kelvins with every
    # switch and films follow it (TARP), walls get a tenth more heat than the air gives; with constant films the same.
    switched = spec.heating.control == "on_off" and any(not on_floor(spec, room) for room in heated(spec))
    return {
        "Building": {
            "house": {
                "north_axis": spec.house.orientation,
                "terrain": "Suburbs",
                "solar_distribution": "FullExterior",
                # The run-in, which is not reported, does what the warm-up would.
                "loads_convergence_tolerance_value": 0.5,
                "temperature_convergence_tolerance_value": 0.5,
                "minimum_number_of_warmup_days": 3,
                "maximum_number_of_warmup_days": 60,
            }
        },
        "ZoneAirHeatBalanceAlgorithm": {"air": {"algorithm": "EulerMethod"}},
        "OutputControl:Files": {"files": {f"output_{name}": "No" for name in (*_FILES, "csv")}},
        "ScheduleTypeLimits": {"any": {}},
        "Schedule:Constant": {"always": constant(1.0)},
        "SurfaceConvectionAlgorithm:Inside": {"inside": {"algorithm": "Simple" if switched else "TARP"}},
        "SurfaceConvectionAlgorithm:Outside": {"outside": {"algorithm": "SimpleCombined"}},
        "SurfaceProperty:ConvectionCoefficients:MultipleSurface": {
            kind: {
                "surface_type": kind, "convection_coefficient_1_location": "Outside",
                "convection_coefficient_1_type": "Value", "convection_coefficient_1": spec.fabric.exterior_film,
            }
            for kind in ("AllExteriorWalls", "AllExteriorWindows", "AllExteriorRoofs")
        },
        # Neither air temperature nor wind changes with height: walls see what the station measures.
        "Site:HeightVariation": {
            "height": {"wind_speed_profile_exponent": 0.0, "air_temperature_gradient_coefficient": 0.0}
        },
        "Site:WeatherStation": {"station": {"wind_speed_profile_exponent": 0.0}},
    }  # fmt: skip


def materials(spec: HouseSpec, outside: float, more: dict[str, fabric.Layers] | None = None) -> Objects:
    """Return constructions and their materials; EnergyPlus counts layers from outside.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    outside : float
        Solar absorptance of exterior walls and roofs [-].
    more : dict, optional
        Further constructions, from the room outwards.
    """
    found = fabric.constructions(spec.fabric)
    reversed_ = {name: layers[::-1] for name, layers in found.items()}
    # On the ground no heat passes: mirrored at the back, a floor is one half of what is the same on both sides.
    reversed_["floor on ground"] = (*found["lowest floor"], *found["lowest floor"][::-1])
    reversed_["slab from above"] = found["slab"]
    reversed_ |= {name: layers[::-1] for name, layers in (more or {}).items()}
    solid: dict[str, dict[str, Any]] = {}
    made: dict[str, dict[str, Any]] = {}
    for name, layers in reversed_.items():
        names = []
        for number, (material, thickness) in enumerate(layers):
            sun = outside if number == 0 and name in ("exterior wall", "roof") else _INSIDE
            names.append(f"{material} {1000.0 * thickness:.1f} mm {sun:.3f}")
            conductivity, density, heat = fabric.MATERIALS[material]
            solid[names[-1]] = {
                "roughness": "MediumRough", "thickness": thickness, "conductivity": conductivity, "density": density,
                "specific_heat": heat, "thermal_absorptance": 0.9, "solar_absorptance": sun, "visible_absorptance": sun,
            }  # fmt: skip
        made[name] = dict(zip(("outside_layer", *(f"layer_{k}" for k in range(2, 11))), names, strict=False))
    return {"Material": solid, "Construction": made}


def _glass(spec: HouseSpec) -> Objects:
    return {
        "WindowMaterial:Glazing": {"glass": fabric.pane(spec.fabric.window_u_value, 0.0)},
        "Construction": {"window": {"outside_layer": "glass"}},
    }


def _rooms(spec: HouseSpec) -> Objects:
    house, found = spec.house, Objects(Zone={}, InternalMass={}, Window={}, ZoneCrossMixing={})
    found["BuildingSurface:Detailed"] = {face.name: _surface(spec, face) for face in faces(house)}
    for room in house.rooms:
        volume, area = room.area * house.height, room.area
        found["Zone"][room.name] = {"volume": round(volume, 6), "floor_area": round(area, 6)}
        found["InternalMass"][f"{room.name} furniture"] = {
            "construction_name": "furniture", "zone_or_zonelist_name": room.name,
            "surface_area": round(2.0 * spec.fabric.furniture * area, 4),
        }  # fmt: skip
    for face in faces(house):
        if face.glass > 0.0:
            start, sill, length, height = face.pane
            found["Window"][f"{face.name} pane"] = {
                "construction_name": "window", "building_surface_name": face.name, "length": round(length, 4),
                "starting_x_coordinate": round(start, 4), "starting_z_coordinate": sill, "height": height,
            }  # fmt: skip
    if house.doorway:
        found["ZoneCrossMixing"]["doorway"] = mixing(house.doorway, spec.fabric.doorway_speed * DOORWAY_AREA, "always")
    return found


def mixing(rooms: tuple[str, ...], flow: float, schedule: str) -> dict[str, Any]:
    """Return the exchange of air through an open door: as much goes one way as the other.

    Parameters
    ----------
    rooms : tuple of str
        The two.
    flow : float
        Each way [m3/s].
    schedule : str
        How far it stands open.
    """
    return {
        "zone_or_space_name": rooms[0], "source_zone_or_space_name": rooms[1], "schedule_name": schedule,
        "design_flow_rate_calculation_method": "Flow/Zone", "design_flow_rate": flow, "delta_temperature": 0.0,
    }  # fmt: skip


def _surface(spec: HouseSpec, face: Face) -> dict[str, Any]:
    """Return a surface, whose construction and boundary follow from what is behind it."""
    name, outdoor = fabric.construction_of(face), face.other == "outdoor"
    boundary: dict[str, Any] = {"outside_boundary_condition": "Outdoors"}
    if face.other in spec.zone_names:
        boundary = {"outside_boundary_condition": "Surface", "outside_boundary_condition_object": partner(face)}
        name = "slab from above" if face.kind == "floor" else name
    elif face.other == "ground":
        boundary, name = {"outside_boundary_condition": "Adiabatic"}, "floor on ground"
    elif not outdoor:
        boundary = behind(face.other)
        if face.kind == "floor" and face.room in heated(spec) and on_floor(spec, face.room):
            name = "heated floor"
    return boundary | {
        "surface_type": "Roof" if outdoor and face.kind == "ceiling" else face.kind.capitalize(),
        "construction_name": name, "zone_name": face.room, "sun_exposure": "SunExposed" if outdoor else "NoSun",
        "wind_exposure": "WindExposed" if outdoor else "NoWind", **polygon(face.corners),
    }  # fmt: skip


def behind(place: str) -> dict[str, Any]:
    """Return the boundary of a surface that looks at a place of a given temperature.

    Parameters
    ----------
    place : str
        Name of `other_side`.
    """
    return {"outside_boundary_condition": "OtherSideCoefficients", "outside_boundary_condition_object": place}


def other_side(place: str, film: float) -> Objects:
    """Return a place whose temperature its schedule, of the same name, gives.

    Parameters
    ----------
    place : str
        Name.
    film : float
        Between the place and a surface [W/m2/K].
    """
    zero = ("constant_temperature", "external_dry_bulb_temperature_coefficient", "ground_temperature_coefficient",
            "wind_speed_coefficient", "zone_air_temperature_coefficient")  # fmt: skip
    fields: dict[str, Any] = dict.fromkeys(zero, 0.0)
    fields |= {"combined_convective_radiative_film_coefficient": film, "constant_temperature_coefficient": 1.0,
               "constant_temperature_schedule_name": place}  # fmt: skip
    return {"SurfaceProperty:OtherSideCoefficients": {place: fields}, "Schedule:Constant": {place: constant(10.0)}}


def _surroundings(spec: HouseSpec) -> Objects:
    """Attic and cellar, where there are some."""
    found: Objects = {}
    for place in (spec.house.top, spec.house.bottom):
        if place in ("attic", "cellar"):
            merge(found, other_side(place, fabric.BOUNDARY_FILM))
    return found


def equipment(room: str, schedule: str, watts: float, radiant: float) -> dict[str, Any]:
    """Return a source of heat in a room.

    Parameters
    ----------
    room, schedule : str
        Where, and the share of its power that it gives.
    watts : float
        Its power [W].
    radiant : float
        Share that surfaces get [-]; the rest goes to the air.
    """
    return {
        "fuel_type": "None", "zone_or_zonelist_or_space_or_spacelist_name": room, "schedule_name": schedule,
        "design_level_calculation_method": "EquipmentLevel", "design_level": float(watts), "fraction_latent": 0.0,
        "fraction_radiant": radiant, "fraction_lost": 0.0,
    }  # fmt: skip


def _radiator(spec: HouseSpec, room: str) -> Objects:
    schedule = heater_schedule(spec, room)
    unit = equipment(room, schedule, heater_power(spec, room), spec.heating.radiant)
    return {"OtherEquipment": {f"{room} radiator": unit}, "Schedule:Constant": {schedule: constant(0.0)}}


def _floor_heater(spec: HouseSpec, room: str) -> Objects:
    """Pipes at the foot of the screed, that are on while the switch is far above the room's temperature."""
    schedule, layers = heater_schedule(spec, room), fabric.constructions(spec.fabric)["lowest floor"][::-1]
    after = [name for name, _ in layers].index(fabric.HEATED_LAYER)
    names = dict(zip(("outside_layer", *(f"layer_{k}" for k in range(2, 11))),
                     (f"{m} {1000.0 * d:.1f} mm {_INSIDE:.3f}" for m, d in layers), strict=False))  # fmt: skip
    face = next(f for f in faces(spec.house) if f.room == room and f.kind == "floor" and f.other not in spec.zone_names)
    return {
        "Construction": {"heated floor": names},
        "ConstructionProperty:InternalHeatSource": {
            "pipes": {
                "construction_name": "heated floor", "thermal_source_present_after_layer_number": after,
                "temperature_calculation_requested_after_layer_number": after,
                "dimensions_for_the_ctf_calculation": 1, "tube_spacing": 0.15,
            }
        },
        "ZoneHVAC:LowTemperatureRadiant:Electric": {
            f"{room} floor heating": {
                "availability_schedule_name": "always", "zone_name": room,
                "surface_name_or_radiant_surface_group_name": face.name,
                "heating_design_capacity_method": "HeatingDesignCapacity",
                "heating_design_capacity": heater_power(spec, room), "temperature_control_type": "MeanAirTemperature",
                "heating_throttling_range": 1.0, "heating_setpoint_temperature_schedule_name": schedule,
            }
        },
        "ZoneHVAC:EquipmentList": {
            f"{room} equipment": {
                "load_distribution_scheme": "SequentialLoad",
                "equipment": [{
                    "zone_equipment_object_type": "ZoneHVAC:LowTemperatureRadiant:Electric",
                    "zone_equipment_name": f"{room} floor heating", "zone_equipment_cooling_sequence": 1,
                    "zone_equipment_heating_or_no_load_sequence": 1,
                }],
            }
        },
        "ZoneHVAC:EquipmentConnections": {
            f"{room} connections": {
                "zone_name": room, "zone_conditioning_equipment_list_name": f"{room} equipment",
                "zone_air_node_name": f"{room} air",
            }
        },
        "Schedule:Constant": {schedule: constant(-60.0)},
    }  # fmt: skip
