"""The EnergyPlus input (epJSON) of the bundled case."""

from datetime import date
from pathlib import Path
from typing import Any

from energyplus_trials.frame import SITE_OUTPUTS, STEPS_PER_HOUR, Objects, frame

from energyplus_case import layout, materials

RUN_PERIOD = "run-in and saved stretch"
SUPPLY_TEMPERATURE_HEATING = 35.0  # [degC]
SUPPLY_TEMPERATURE_COOLING = 14.0  # [degC]
# So dry that EnergyPlus's cp of air (1004.84 + 1858.95 w) is the case format's 1006 J/kg/K; no moisture anywhere else.
SUPPLY_HUMIDITY_RATIO = 0.000624  # [kg/kg]
FLOW_PER_AREA = 0.0025  # [m3/s/m2], limit of a zone's supply air
OUTPUTS_ZONE = {
    "zone_temperature": ("Zone Mean Air Temperature", "{zone}"),
    "flow": ("Zone Ideal Loads Supply Air Mass Flow Rate", "{zone} ideal loads"),
    "discharge": ("Zone Ideal Loads Supply Air Temperature", "{zone} ideal loads"),
    "heating": ("Zone Ideal Loads Zone Sensible Heating Rate", "{zone} ideal loads"),
    "cooling": ("Zone Ideal Loads Zone Sensible Cooling Rate", "{zone} ideal loads"),
    "balance": ("Zone Air Heat Balance System Air Transfer Rate", "{zone}"),
    "transmitted_sun": ("Enclosure Windows Total Transmitted Solar Radiation Rate", "{zone}"),
}


def epjson(first: date, last: date, schedules: Path, columns: list[tuple[str, str]]) -> Objects:
    """Return the whole input, by EnergyPlus class and object name.

    Parameters
    ----------
    first, last : date
        First and last day of the run.
    schedules : Path
        CSV of set points [degC], a year at the run's step, one header row.
    columns : list of (zone, kind)
        What its columns hold, in order.
    """
    return (
        frame(RUN_PERIOD, first, last)
        | _building()
        | _climate()
        | _constructions()
        | _surfaces()
        | _air(schedules, columns)
        | _outputs()
    )


def _building() -> Objects:
    return {
        "Building": {
            "bundled case": {
                "north_axis": layout.ORIENTATION,
                "terrain": "Suburbs",
                "solar_distribution": "FullInteriorAndExterior",
                "maximum_number_of_warmup_days": 50,
                "minimum_number_of_warmup_days": 6,
            }
        },
    }


def _climate() -> Objects:
    return {
        # Air temperature does not fall with height: walls see what the station measures.
        "Site:HeightVariation": {"height": {"air_temperature_gradient_coefficient": 0.0}},
        # A sky at air temperature: no longwave loss beyond that to the air. The station still reports the real one.
        "WeatherProperty:SkyTemperature": {
            RUN_PERIOD: {"calculation_type": "DifferenceScheduleDryBulbValue", "schedule_name": "no difference"}
        },
        "SurfaceConvectionAlgorithm:Inside": {"inside": {"algorithm": "TARP"}},
        "SurfaceConvectionAlgorithm:Outside": {"outside": {"algorithm": "SimpleCombined"}},
        "SurfaceProperty:ConvectionCoefficients:MultipleSurface": {
            kind: {
                "surface_type": kind,
                "convection_coefficient_1_location": "Outside",
                "convection_coefficient_1_type": "Value",
                "convection_coefficient_1": materials.EXTERIOR_CONVECTION,
            }
            for kind in ("AllExteriorWalls", "AllExteriorWindows")
        },
        "ShadowCalculation": {
            "sun": {
                "shading_calculation_update_frequency_method": "Timestep",
                "sky_diffuse_modeling_algorithm": "SimpleSkyDiffuseModeling",
            }
        },
    }


def _constructions() -> Objects:
    solid = {
        name: {
            "roughness": "MediumRough",
            "thickness": m.thickness,
            "conductivity": m.conductivity,
            "density": m.density,
            "specific_heat": m.heat_capacity,
            "thermal_absorptance": materials.THERMAL_ABSORPTANCE,
            "solar_absorptance": materials.INTERIOR_SOLAR_ABSORPTANCE,
            "visible_absorptance": materials.INTERIOR_SOLAR_ABSORPTANCE,
        }
        for name, m in materials.MATERIALS.items()
    }
    solid["render"]["solar_absorptance"] = materials.EXTERIOR_SOLAR_ABSORPTANCE
    fields = ("outside_layer", "layer_2", "layer_3", "layer_4")
    constructions = {name: dict(zip(fields, layers, strict=False)) for name, layers in materials.CONSTRUCTIONS.items()}
    return {
        "Material": solid,
        "WindowMaterial:SimpleGlazingSystem": {
            "pane": {
                "u_factor": materials.GLAZING_U_VALUE,
                "solar_heat_gain_coefficient": materials.GLAZING_SHGC,
            }
        },
        "Construction": {**constructions, "window": {"outside_layer": "pane"}},
    }


def _polygon(points: list[tuple[float, float, float]]) -> dict[str, Any]:
    names = ("vertex_x_coordinate", "vertex_y_coordinate", "vertex_z_coordinate")
    return {"vertices": [dict(zip(names, point, strict=True)) for point in points]}


def _surfaces() -> Objects:
    walls: dict[str, dict[str, Any]] = {}
    panes: dict[str, dict[str, Any]] = {}
    by_pair = {(s.zone, s.other): s.name for s in layout.segments() if s.other}
    for s in layout.segments():
        (x0, y0), (x1, y1), top = s.start, s.end, layout.HEIGHT
        inside = s.other is not None
        walls[s.name] = {
            "surface_type": "Wall",
            "construction_name": "interior_wall" if inside else "exterior_wall",
            "zone_name": s.zone,
            "outside_boundary_condition": "Surface" if inside else "Outdoors",
            "sun_exposure": "NoSun" if inside else "SunExposed",
            "wind_exposure": "NoWind" if inside else "WindExposed",
            **_polygon([(x0, y0, top), (x0, y0, 0.0), (x1, y1, 0.0), (x1, y1, top)]),
        }
        if s.other is not None:
            walls[s.name]["outside_boundary_condition_object"] = by_pair[s.other, s.zone]
            continue
        length = layout.PANE_LENGTHS.get(s.zone, {}).get(s.side)
        if length is not None:
            panes[f"{s.name}_pane"] = {
                "construction_name": "window",
                "building_surface_name": s.name,
                "starting_x_coordinate": (s.length - length) / 2.0,
                "starting_z_coordinate": layout.PANE_SILL,
                "length": length,
                "height": layout.PANE_HEIGHT,
            }
    zones = {zone: {"direction_of_relative_north": 0.0} for zone in layout.ZONES}
    return {"Zone": zones, "BuildingSurface:Detailed": walls | _slabs(), "Window": panes}


def _slabs() -> dict[str, dict[str, Any]]:
    slabs: dict[str, dict[str, Any]] = {}
    for zone, r in layout.zone_rectangles().items():
        corners = [(r.x0, r.y0), (r.x1, r.y0), (r.x1, r.y1), (r.x0, r.y1)]
        for kind, z, ring in (("Floor", 0.0, corners[::-1]), ("Ceiling", layout.HEIGHT, corners)):
            slabs[f"{zone}_{kind.lower()}"] = {
                "surface_type": kind,
                "construction_name": f"{kind.lower()}_slab",
                "zone_name": zone,
                "outside_boundary_condition": "Adiabatic",
                "sun_exposure": "NoSun",
                "wind_exposure": "NoWind",
                **_polygon([(x, y, z) for x, y in ring]),
            }
    return slabs


def _air(schedules: Path, columns: list[tuple[str, str]]) -> Objects:
    files = {
        f"{zone} {kind}": {
            "schedule_type_limits_name": "any",
            "file_name": str(schedules),
            "column_number": number + 1,
            "rows_to_skip_at_top": 1,
            "number_of_hours_of_data": 8760,
            "column_separator": "Comma",
            "interpolate_to_timestep": "No",
            "minutes_per_item": 60 // STEPS_PER_HOUR,
        }
        for number, (zone, kind) in enumerate(columns)
    }
    constants = {
        "no difference": {"schedule_type_limits_name": "any", "hourly_value": 0.0},
        "dual setpoint": {"schedule_type_limits_name": "any", "hourly_value": 4.0},
    }
    objects: Objects = {
        "ScheduleTypeLimits": {"any": {}},
        "Schedule:File": files,
        "Schedule:Constant": constants,
    }
    for zone, r in layout.zone_rectangles().items():
        for kind, content in _zone_air(zone, FLOW_PER_AREA * r.area).items():
            objects.setdefault(kind, {}).update(content)
    return objects


def _zone_air(zone: str, flow: float) -> Objects:
    return {
        "ZoneControl:Thermostat": {
            f"{zone} thermostat": {
                "zone_or_zonelist_name": zone,
                "control_type_schedule_name": "dual setpoint",
                "control_1_object_type": "ThermostatSetpoint:DualSetpoint",
                "control_1_name": f"{zone} setpoints",
            }
        },
        "ThermostatSetpoint:DualSetpoint": {
            f"{zone} setpoints": {
                "heating_setpoint_temperature_schedule_name": f"{zone} heating",
                "cooling_setpoint_temperature_schedule_name": f"{zone} cooling",
            }
        },
        "ZoneHVAC:EquipmentConnections": {
            f"{zone} connections": {
                "zone_name": zone,
                "zone_conditioning_equipment_list_name": f"{zone} equipment",
                "zone_air_inlet_node_or_nodelist_name": f"{zone} inlet",
                "zone_air_node_name": f"{zone} air",
                "zone_return_air_node_or_nodelist_name": f"{zone} return",
            }
        },
        "ZoneHVAC:EquipmentList": {
            f"{zone} equipment": {
                "load_distribution_scheme": "SequentialLoad",
                "equipment": [
                    {
                        "zone_equipment_object_type": "ZoneHVAC:IdealLoadsAirSystem",
                        "zone_equipment_name": f"{zone} ideal loads",
                        "zone_equipment_cooling_sequence": 1,
                        "zone_equipment_heating_or_no_load_sequence": 1,
                    }
                ],
            }
        },
        "ZoneHVAC:IdealLoadsAirSystem": {
            f"{zone} ideal loads": {
                "zone_supply_air_node_name": f"{zone} inlet",
                "maximum_heating_supply_air_temperature": SUPPLY_TEMPERATURE_HEATING,
                "minimum_cooling_supply_air_temperature": SUPPLY_TEMPERATURE_COOLING,
                "maximum_heating_supply_air_humidity_ratio": SUPPLY_HUMIDITY_RATIO,
                "minimum_cooling_supply_air_humidity_ratio": SUPPLY_HUMIDITY_RATIO,
                "heating_limit": "LimitFlowRate",
                "maximum_heating_air_flow_rate": flow,
                "cooling_limit": "LimitFlowRate",
                "maximum_cooling_air_flow_rate": flow,
                "dehumidification_control_type": "ConstantSupplyHumidityRatio",
                "humidification_control_type": "ConstantSupplyHumidityRatio",
            }
        },
    }


def _outputs() -> Objects:
    names = list(SITE_OUTPUTS.values()) + [variable for variable, _ in OUTPUTS_ZONE.values()]
    return {
        "Output:SQLite": {"sql": {"option_type": "Simple"}},
        "Output:Variable": {
            name: {"key_value": "*", "variable_name": name, "reporting_frequency": "Timestep"} for name in names
        },
    }
