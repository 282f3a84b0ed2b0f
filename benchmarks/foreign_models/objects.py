"""What the plants' EnergyPlus inputs (epJSON) have in common: a box with windows, people, air, schedules, programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

from energyplus_trials.frame import Objects, constant, frame, merge, polygon

#: Value of a command's schedule that leaves the decision to the building's own control.
OWN = -1.0
ALWAYS = "always"
# Usual design values of ISO 10456, rounded: thickness [m], conductivity [W/m/K], density [kg/m3], heat capacity
# [J/kg/K]; from the outside inwards.
_BRICK, _CONCRETE, _PLASTER = (0.10, 0.75, 1700.0, 840.0), (0.15, 1.6, 2300.0, 1000.0), (0.012, 0.5, 1300.0, 1000.0)
_SCREED = (0.06, 1.4, 2000.0, 1000.0)


def _foam(thickness: float) -> tuple[float, float, float, float]:
    """Layer of insulation of a thickness [m]."""
    return thickness, 0.035, 30.0, 1400.0


@dataclass(frozen=True)
class Fabric:
    """What a building is made of.

    Parameters
    ----------
    wall, roof, floor : float
        Thickness of insulation [m].
    glass : tuple of float
        U-value [W/m2/K] and solar heat gain coefficient [-].
    air_changes : float
        By leaks and ventilation [1/h].
    heavy : bool
        Whether walls have brick inside; plaster board on studs otherwise.
    goods : float
        Heat capacity of a zone's air and of the goods that follow it, over that of the air alone [-]; 3 stands for a
        few kilograms of goods a square metre.
    """

    wall: float
    roof: float
    floor: float
    glass: tuple[float, float]
    air_changes: float
    heavy: bool = True
    goods: float = 1.0


def start(fabric: Fabric) -> Objects:
    """Return the frame of an input: steps, rules, schedules that all use, constructions.

    Parameters
    ----------
    fabric : Fabric
        Of the building.
    """
    objects = frame("run", date(2023, 1, 1), date(2023, 12, 31))
    inner = [_BRICK] if fabric.heavy else []
    walls = [_BRICK, _foam(fabric.wall), *inner, _PLASTER]
    stacks = {
        "wall": walls, "roof": [(0.01, 0.16, 1120.0, 1460.0), _foam(fabric.roof), _PLASTER],
        "floor": [_CONCRETE, _foam(fabric.floor), _SCREED],
        "partition": [_PLASTER, _BRICK, _PLASTER],
    }  # fmt: skip
    for name, layers in stacks.items():
        merge(objects, construction(name, layers))
    merge(objects, {
        "Building": {"building": {
            "north_axis": 0.0, "terrain": "Suburbs", "solar_distribution": "FullExterior",
            "minimum_number_of_warmup_days": 6, "maximum_number_of_warmup_days": 40,
        }},
        "ZoneCapacitanceMultiplier:ResearchSpecial": {"goods": {"temperature_capacity_multiplier": fabric.goods}},
        "WindowMaterial:SimpleGlazingSystem": {
            "glass": {"u_factor": fabric.glass[0], "solar_heat_gain_coefficient": fabric.glass[1]}
        },
        "Construction": {"window": {"outside_layer": "glass"}},
        "ScheduleTypeLimits": {"any": {}},
        "Schedule:Constant": {ALWAYS: constant(1.0), "activity": constant(125.0)},
        "Site:GroundTemperature:BuildingSurface": {
            "ground": {f"{month}_ground_temperature": 12.0 for month in _MONTHS}  # of the soil below an insulated floor
        },
    })  # fmt: skip
    return objects


_MONTHS = ("january", "february", "march", "april", "may", "june", "july", "august", "september", "october",
           "november", "december")  # fmt: skip


def daily(weekday: Sequence[float], weekend: Sequence[float]) -> dict[str, Any]:
    """Return a schedule of hours.

    Parameters
    ----------
    weekday, weekend : sequence of float
        24 values from midnight on.
    """
    lines: list[Any] = ["Through: 12/31"]
    for days, values in (("For: Weekdays", weekday), ("For: AllOtherDays", weekend)):
        lines.append(days)
        for hour, value in enumerate(values, 1):
            if hour == 24 or values[hour] != value:
                lines += [f"Until: {hour}:00", value]
    return {"schedule_type_limits_name": "any", "data": [{"field": line} for line in lines]}


def construction(name: str, layers: Sequence[tuple[float, float, float, float]]) -> Objects:
    """Return a construction and its materials.

    Parameters
    ----------
    name : str
        Its name.
    layers : sequence of tuple of float
        Thickness [m], conductivity [W/m/K], density [kg/m3] and heat capacity [J/kg/K], from the outside inwards.
    """
    # named by what they are: EnergyPlus sees by names that a wall is the same from both sides
    names = [f"{1000 * d:g} mm of {k:g} W/m/K, {rho:g} kg/m3, {c:g} J/kg/K" for d, k, rho, c in layers]
    keys = ("thickness", "conductivity", "density", "specific_heat")
    materials = {
        each: {"roughness": "MediumRough", **dict(zip(keys, layer, strict=True))}
        for each, layer in zip(names, layers, strict=True)
    }
    fields = dict(zip(("outside_layer", *(f"layer_{k}" for k in range(2, 11))), names, strict=False))
    return {"Material": materials, "Construction": {name: fields}}


def box(
    zone: str, corner: tuple[float, float], size: tuple[float, float, float], glass: Mapping[str, float],
    behind: Mapping[str, str] | None = None,
) -> Objects:  # fmt: skip
    """Return a cuboid zone on the ground and under the roof.

    Parameters
    ----------
    zone : str
        Its name; faces are called ``ZONE SIDE``.
    corner : tuple of float
        South-west corner, x to the east and y to the north [m].
    size : tuple of float
        Length in x, in y, and height [m].
    glass : mapping of str to float
        Area of a window by side, ``south`` and so on [m2].
    behind : mapping of str to str, optional
        Zone behind a side, or behind ``floor`` and ``ceiling``; outdoors and ground by default. ``""`` is the same
        temperature as inside.
    """
    (x, y), (length, width, height), other = corner, size, behind or {}
    far, deep = x + length, y + width
    sides = {"south": ((x, y), (far, y)), "east": ((far, y), (far, deep)),
             "north": ((far, deep), (x, deep)), "west": ((x, deep), (x, y))}  # fmt: skip
    found: Objects = {
        "Zone": {zone: {"volume": length * width * height, "floor_area": length * width}},
        "BuildingSurface:Detailed": {}, "Window": {},
    }  # fmt: skip
    walls = found["BuildingSurface:Detailed"]
    for side, (first, last) in sides.items():
        corners = [(*first, height), (*first, 0.0), (*last, 0.0), (*last, height)]
        walls[f"{zone} {side}"] = _face(zone, "Wall", corners, other.get(side), side)
        if glass.get(side):
            span = abs(last[0] - first[0]) + abs(last[1] - first[1])
            tall = 1.5
            long = glass[side] / tall
            found["Window"][f"{zone} {side} window"] = {
                "construction_name": "window", "building_surface_name": f"{zone} {side}", "length": long,
                "height": tall, "starting_x_coordinate": (span - long) / 2.0, "starting_z_coordinate": 0.8,
            }  # fmt: skip
    ring = [(x, y), (x, deep), (far, deep), (far, y)]
    floor, top = [(*p, 0.0) for p in ring], [(*p, height) for p in [(x, y), (far, y), (far, deep), (x, deep)]]
    walls[f"{zone} floor"] = _face(zone, "Floor", floor, other.get("floor"), "floor")
    walls[f"{zone} ceiling"] = _face(zone, "Roof", top, other.get("ceiling"), "ceiling")
    return {kind: content for kind, content in found.items() if content}


_FACING = {"south": "north", "north": "south", "east": "west", "west": "east"}


def _face(zone: str, kind: str, corners: list[tuple[float, ...]], other: str | None, side: str) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "surface_type": kind, "zone_name": zone, "construction_name": kind.lower(), "sun_exposure": "NoSun",
        "wind_exposure": "NoWind", **polygon(corners),
    }  # fmt: skip
    if other:
        fields |= {"outside_boundary_condition": "Surface", "construction_name": "partition",
                   "outside_boundary_condition_object": f"{other} {_FACING[side]}"}  # fmt: skip
    elif other == "":
        fields |= {"outside_boundary_condition": "Adiabatic", "construction_name": "partition"}
        fields["surface_type"] = "Ceiling" if kind == "Roof" else kind
    elif kind == "Floor":
        fields["outside_boundary_condition"] = "Ground"
    else:
        fields |= {"outside_boundary_condition": "Outdoors", "sun_exposure": "SunExposed",
                   "wind_exposure": "WindExposed"}  # fmt: skip
    return fields


def inside(zone: str, fabric: Fabric, area: float, people: float, presence: str, appliances: float) -> Objects:
    """Return what a zone has inside: people of 75 W of sensible heat, appliances, leaks, furniture.

    Parameters
    ----------
    zone : str
        Its name.
    fabric : Fabric
        Leaks.
    area : float
        Floor area [m2].
    people : float
        Largest number.
    presence : str
        Schedule of the share that is in.
    appliances : float
        Heat of appliances all day, which nothing measures [W].
    """
    where = "zone_or_zonelist_or_space_or_spacelist_name"
    return {
        "People": {f"{zone} people": {
            where: zone, "number_of_people_schedule_name": presence, "number_of_people_calculation_method": "People",
            "number_of_people": people, "fraction_radiant": 0.3, "sensible_heat_fraction": 0.6,
            "activity_level_schedule_name": "activity",
        }},
        "OtherEquipment": {f"{zone} appliances": {
            "fuel_type": "None", where: zone, "schedule_name": ALWAYS, "fraction_radiant": 0.3,
            "design_level_calculation_method": "EquipmentLevel", "design_level": appliances,
        }},
        "ZoneInfiltration:DesignFlowRate": {f"{zone} air": {
            "zone_or_zonelist_or_space_or_spacelist_name": zone, "schedule_name": ALWAYS,
            "design_flow_rate_calculation_method": "AirChanges/Hour", "air_changes_per_hour": fabric.air_changes,
            "constant_term_coefficient": 1.0, "temperature_term_coefficient": 0.0,
            "velocity_term_coefficient": 0.0, "velocity_squared_term_coefficient": 0.0,
        }},
        "InternalMass": {f"{zone} furniture": {
            "construction_name": "partition", "zone_or_zonelist_name": zone, "surface_area": 0.5 * area,
        }},
    }  # fmt: skip


def program(name: str, text: str, call: str = "BeginTimestepBeforePredictor") -> Objects:
    """Return a program of EnergyPlus' energy management system, and when it is called.

    Parameters
    ----------
    name : str
        Without spaces.
    text : str
        Its lines.
    call : str
        Calling point.
    """
    lines = [{"program_line": line.strip()} for line in text.strip().splitlines() if line.strip()]
    return {
        "EnergyManagementSystem:Program": {name: {"lines": lines}},
        "EnergyManagementSystem:ProgramCallingManager": {
            f"{name} call": {"energyplus_model_calling_point": call, "programs": [{"program_name": name}]}
        },
    }


def sensors(listed: Mapping[str, tuple[str, str]]) -> Objects:
    """Return sensors of the energy management system.

    Parameters
    ----------
    listed : mapping of str to tuple of str
        By name: key and output variable.
    """
    return {"EnergyManagementSystem:Sensor": {
        name: {"output_variable_or_output_meter_index_key_name": key, "output_variable_or_output_meter_name": variable}
        for name, (key, variable) in listed.items()
    }}  # fmt: skip


def summed(title: str, terms: Mapping[str, tuple[str, str, float]]) -> Objects:
    """Return an output of our own, ``EMS, TITLE``: a sum of outputs of EnergyPlus.

    Parameters
    ----------
    title : str
        Of the output [W].
    terms : mapping of str to tuple
        By a name without spaces: key, output variable, and factor [-].
    """
    name = title.lower().replace(" ", "_")
    parts = {f"{name}_{term}": (key, variable) for term, (key, variable, _) in terms.items()}
    total = " + ".join(f"{factor:g} * {name}_{term}" for term, (_, _, factor) in terms.items())
    found = sensors(parts)
    # before reporting: after it, the sum would be told a step late
    merge(found, program(f"{name}_sum", f"SET {name} = {total}", "EndOfSystemTimestepBeforeHVACReporting"))
    merge(found, {
        "EnergyManagementSystem:GlobalVariable": {f"{name} variable": {"variables": [{"erl_variable_name": name}]}},
        "EnergyManagementSystem:OutputVariable": {title: {
            "ems_variable_name": name, "type_of_data_in_variable": "Averaged", "update_frequency": "SystemTimestep",
            "units": "W",
        }},
    })  # fmt: skip
    return found


def actuators(listed: Mapping[str, tuple[str, str, str]]) -> Objects:
    """Return actuators of the energy management system.

    Parameters
    ----------
    listed : mapping of str to tuple of str
        By name: key, component type and control type.
    """
    keys = ("actuated_component_unique_name", "actuated_component_type", "actuated_component_control_type")
    return {"EnergyManagementSystem:Actuator": {
        name: dict(zip(keys, what, strict=True)) for name, what in listed.items()
    }}  # fmt: skip


def equipment(zone: str, units: Sequence[tuple[str, str]], inlet: str = "", exhaust: str = "") -> Objects:
    """Return what heats a zone, in this order.

    Parameters
    ----------
    zone : str
        Its name.
    units : sequence of tuple of str
        Class and name of each.
    inlet, exhaust : str
        Nodes of the air that it gets and gives, where it gets some.
    """
    connections = {
        "zone_name": zone, "zone_conditioning_equipment_list_name": f"{zone} equipment",
        "zone_air_node_name": f"{zone} air node", "zone_return_air_node_or_nodelist_name": f"{zone} return",
    }  # fmt: skip
    connections |= {"zone_air_inlet_node_or_nodelist_name": inlet} if inlet else {}
    connections |= {"zone_air_exhaust_node_or_nodelist_name": exhaust} if exhaust else {}
    return {
        "ZoneHVAC:EquipmentList": {f"{zone} equipment": {"load_distribution_scheme": "SequentialLoad", "equipment": [
            {"zone_equipment_object_type": kind, "zone_equipment_name": name, "zone_equipment_cooling_sequence": k,
             "zone_equipment_heating_or_no_load_sequence": k}
            for k, (kind, name) in enumerate(units, 1)
        ]}},
        "ZoneHVAC:EquipmentConnections": {f"{zone} connections": connections},
    }  # fmt: skip
