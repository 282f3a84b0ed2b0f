"""The EnergyPlus input (epJSON) of a trial's null: walls, windows, slabs, furniture and heat, nothing else."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from energyplus_trials import fabric, plan, terminals
from energyplus_trials.frame import Objects, constant, frame, merge, polygon
from energyplus_trials.specification import TrialSpec, stream_generator

#: Spread of the furniture of zones in uneven offices, and the purpose of its random numbers.
_UNEVEN, _FURNITURE = 0.5, 90

ZONE_OUTPUTS = {
    "temperature": ("Zone Mean Air Temperature", "{zone}"),
    "flow": ("Zone Ideal Loads Supply Air Mass Flow Rate", "{zone} ideal loads"),
    "discharge": ("Zone Ideal Loads Supply Air Temperature", "{zone} ideal loads"),
    "heat": ("Zone Air Heat Balance System Air Transfer Rate", "{zone}"),
}


def null_model(spec: TrialSpec, first: pd.Timestamp, last: pd.Timestamp) -> Objects:
    """Return the input by EnergyPlus class and object name.

    Parameters
    ----------
    spec : TrialSpec
        Of which the effects are not read.
    first, last : Timestamp
        First and last day of the run.
    """
    objects = frame("run", first, last)
    parts = (
        _building(spec),
        _climate(spec),
        fabric.objects(fabric.constructions(spec.fabric), fabric.NO_SOLAR_ABSORPTANCE),
        {"WindowMaterial:Glazing": {"glass": fabric.pane(spec.fabric.window_u_value, 0.0)}},
        {"Construction": {"window": {"outside_layer": "glass"}}},
        _surfaces(spec),
        {"Schedule:Constant": {terminals.DUAL_SETPOINT: constant(4.0)}, "ScheduleTypeLimits": {"any": {}}},
        *(terminals.terminal(zone, spec.use.flow * area(spec, zone)) for zone in spec.zone_names),
    )
    for part in parts:
        merge(objects, part)
    return objects


def split(zone: str) -> tuple[int, str]:
    """Return floor, from 0, and name on the floor of a zone.

    Parameters
    ----------
    zone : str
        Name in the building.
    """
    floor, _, name = zone.partition("_")
    return int(floor[1:]) - 1, name


def area(spec: TrialSpec, zone: str) -> float:
    """Return the floor area of a zone [m2].

    Parameters
    ----------
    spec : TrialSpec
        Of a trial.
    zone : str
        Name in the building.
    """
    return plan.rectangles(spec.layout.zones)[split(zone)[1]].area


def design_flow(spec: TrialSpec, zone: str) -> float:
    """Return the largest supply air flow of a zone [kg/s], at EnergyPlus's standard density: 20 degC at the site.

    Parameters
    ----------
    spec : TrialSpec
        Of a trial.
    zone : str
        Name in the building.
    """
    pressure = 101325.0 * (1.0 - 2.25577e-5 * spec.climate.elevation) ** 5.2559
    return pressure / (287.0 * 293.15) * spec.use.flow * area(spec, zone)


def surface_name(zone: str, side: str, other: str | None = None) -> str:
    """Return the name of a wall.

    Parameters
    ----------
    zone : str
        Name in the building.
    side : str
        Of the zone.
    other : str or None
        Zone on the far side, on the same floor.
    """
    return f"{zone} {side} {other or 'outdoor'}"


def _building(spec: TrialSpec) -> Objects:
    return {
        "Building": {
            "building": {
                "north_axis": spec.layout.orientation,
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
        "OutputControl:Files": {"files": dict.fromkeys(_FILES, "No") | {"output_csv": "No"}},
    }


_FILES = tuple(
    f"output_{name}"
    for name in ("mtr", "eso", "eio", "tabular", "sqlite", "json", "audit", "zone_sizing", "system_sizing", "dxf",
                 "bnd", "rdd", "mdd", "mtd", "shd", "dfs", "glhe", "delightin", "delighteldmp", "delightdfdmp", "edd",
                 "dbg", "perflog", "sln", "sci", "wrl", "screen", "tarcog", "extshd")
)  # fmt: skip


def _climate(spec: TrialSpec) -> Objects:
    if spec.fabric.uneven:
        films: Objects = {
            "SurfaceConvectionAlgorithm:Inside": {"inside": {"algorithm": "TARP"}},
            "SurfaceConvectionAlgorithm:Outside": {"outside": {"algorithm": "DOE-2"}},
        }
    else:
        films = _constant_films(spec)
    return films | {
        # Neither air temperature nor wind changes with height: walls see what the station measures.
        "Site:HeightVariation": {
            "height": {"wind_speed_profile_exponent": 0.0, "air_temperature_gradient_coefficient": 0.0}
        },
        "Site:WeatherStation": {"station": {"wind_speed_profile_exponent": 0.0}},
        "ShadowCalculation": {
            "sun": {
                "shading_calculation_method": "PolygonClipping",
                "shading_calculation_update_frequency_method": "Periodic",
                "shading_calculation_update_frequency": 4,
                "sky_diffuse_modeling_algorithm": "SimpleSkyDiffuseModeling",
            }
        },
    }


def _constant_films(spec: TrialSpec) -> Objects:
    return {
        "SurfaceConvectionAlgorithm:Inside": {"inside": {"algorithm": spec.fabric.interior_convection}},
        "SurfaceConvectionAlgorithm:Outside": {"outside": {"algorithm": "SimpleCombined"}},
        "SurfaceProperty:ConvectionCoefficients:MultipleSurface": {
            kind: {
                "surface_type": kind,
                "convection_coefficient_1_location": "Outside",
                "convection_coefficient_1_type": "Value",
                "convection_coefficient_1": spec.fabric.exterior_film,
            }
            for kind in ("AllExteriorWalls", "AllExteriorWindows", "AllExteriorRoofs")
        },
    }


def _surfaces(spec: TrialSpec) -> Objects:
    layout, found = spec.layout, {"Zone": {}, "BuildingSurface:Detailed": {}, "Window": {}, "InternalMass": {}}
    sides = {(s.zone, s.other): s.side for s in plan.segments(layout.zones) if s.other}
    lengths = plan.panes(layout)
    spread = _UNEVEN * stream_generator(spec.stream, spec.seed, _FURNITURE).standard_normal(len(spec.zone_names))
    shares = np.exp(spread) if spec.fabric.uneven else np.ones(len(spec.zone_names))
    for zone, share in zip(spec.zone_names, shares.tolist(), strict=True):
        floor, name = split(zone)
        found["Zone"][zone] = {
            "volume": round(area(spec, zone) * layout.height, 6), "floor_area": round(area(spec, zone), 6),
        }  # fmt: skip
        found["InternalMass"][f"{zone} furniture"] = {
            "construction_name": "furniture",
            "zone_or_zonelist_name": zone,
            "surface_area": round(spec.fabric.furniture_area * share * area(spec, zone), 4),
        }
        found["BuildingSurface:Detailed"] |= _slabs(spec, zone)
        for s in plan.segments(layout.zones):
            if s.zone != name:
                continue
            wall = _wall(s, zone, floor * layout.height, layout.height)
            found["BuildingSurface:Detailed"][surface_name(zone, s.side, s.other)] = wall
            if s.other is not None:
                far = surface_name(f"F{floor + 1}_{s.other}", sides[s.other, s.zone], s.zone)
                wall["outside_boundary_condition_object"] = far
            elif (name, s.side) in lengths:
                length = lengths[name, s.side]
                found["Window"][f"{zone} {s.side} pane"] = {
                    "construction_name": "window",
                    "building_surface_name": surface_name(zone, s.side),
                    "starting_x_coordinate": round((s.length - length) / 2.0, 4),
                    "starting_z_coordinate": plan.SILL,
                    "length": length,
                    "height": layout.pane_height,
                }
    return found


def _wall(s: plan.Segment, zone: str, bottom: float, height: float) -> dict[str, Any]:
    (x0, y0), (x1, y1), top, inside = s.start, s.end, bottom + height, s.other is not None
    return {
        "surface_type": "Wall",
        "construction_name": "partition" if inside else "exterior wall",
        "zone_name": zone,
        "outside_boundary_condition": "Surface" if inside else "Outdoors",
        "sun_exposure": "NoSun" if inside else "SunExposed",
        "wind_exposure": "NoWind" if inside else "WindExposed",
        **polygon([(x0, y0, top), (x0, y0, bottom), (x1, y1, bottom), (x1, y1, top)]),
    }


def _slabs(spec: TrialSpec, zone: str) -> dict[str, dict[str, Any]]:
    floor, name = split(zone)
    r = plan.rectangles(spec.layout.zones)[name]
    corners = [(r.west, r.south), (r.east, r.south), (r.east, r.north), (r.west, r.north)]
    bottom, slabs = floor * spec.layout.height, {}
    for kind, z, ring in (("Floor", bottom, corners[::-1]), ("Ceiling", bottom + spec.layout.height, corners)):
        slabs[f"{zone} {kind.lower()}"] = {
            "surface_type": kind,
            "construction_name": "slab",
            "zone_name": zone,
            "outside_boundary_condition": "Adiabatic",
            "sun_exposure": "NoSun",
            "wind_exposure": "NoWind",
            **polygon([(x, y, z) for x, y in ring]),
        }
    return slabs
