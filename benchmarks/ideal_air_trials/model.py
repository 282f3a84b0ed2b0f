"""The EnergyPlus input (epJSON) of a trial's null: walls, windows, slabs and ideal air, nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ideal_air_trials import fabric, plan
from ideal_air_trials.fabric import Objects, merge
from ideal_air_trials.plan import Box, Point, Wall, walls, zone_name
from ideal_air_trials.settings import settings
from ideal_air_trials.specification import Spec
from ideal_air_trials.terminals import terminal

NO_FLOW = "no flow"
#: [W/m2/K] between a face without flow and what is behind it. EnergyPlus' own ``Adiabatic`` gives the outer face the
#: temperature of the inner one, which lets heat in and out there while temperatures change.
NO_FLOW_FILM = 0.0005
_LEAST_STRIP = 0.01  # [m], narrower parts of slabs are left out

Corner = tuple[float, float, float]


def null_model(spec: Spec) -> Objects:
    """Return the input by EnergyPlus class and object name.

    Parameters
    ----------
    spec : Spec
        Of which the effects are not read.
    """
    parts = (
        settings(spec), fabric.opaque(spec.fabric), fabric.window(spec.fabric, *fabric.DARK),
        other_side(NO_FLOW, NO_FLOW_FILM, temperature=20.0), _zones(spec), _slabs(spec), _walls(spec),
        *(terminal(spec, zone, area) for zone, area in spec.layout.areas().items()),
    )  # fmt: skip
    return merge({}, *parts)


def other_side(name: str, film: float, *, temperature: float | None = None, follows: str | None = None) -> Objects:
    """Return what is behind a face where it is neither outdoors nor a zone.

    Parameters
    ----------
    name : str
        Of it.
    film : float
        Between it and the face [W/m2/K].
    temperature : float, optional
        [degC]
    follows : str, optional
        Schedule of its temperature, instead.
    """
    fields: dict[str, Any] = {
        "combined_convective_radiative_film_coefficient": film, "constant_temperature_coefficient": 1.0,
        "external_dry_bulb_temperature_coefficient": 0.0, "ground_temperature_coefficient": 0.0,
        "wind_speed_coefficient": 0.0, "zone_air_temperature_coefficient": 0.0,
    }  # fmt: skip
    if temperature is not None:
        fields["constant_temperature"] = temperature
    if follows is not None:
        fields["constant_temperature_schedule_name"] = follows
    return {"SurfaceProperty:OtherSideCoefficients": {name: fields}}


def behind(name: str) -> dict[str, str]:
    """Return the fields of a surface that has another side.

    Parameters
    ----------
    name : str
        As `other_side` has it.
    """
    return {"outside_boundary_condition": "OtherSideCoefficients", "outside_boundary_condition_object": name,
            "sun_exposure": "NoSun", "wind_exposure": "NoWind"}  # fmt: skip


def _zones(spec: Spec) -> Objects:
    layout = spec.layout
    return {
        "Zone": {
            zone: {"ceiling_height": layout.height, "volume": round(area * layout.height, 3),
                   "floor_area": round(area, 3)}
            for zone, area in layout.areas().items()
        }
    }  # fmt: skip


def surface(zone: str, kind: str, made_of: str, corners: Sequence[Corner]) -> dict[str, Any]:
    """Return the fields of a surface, but for what is behind it.

    Parameters
    ----------
    zone, kind, made_of : str
        Zone, EnergyPlus' kind of surface, construction.
    corners : sequence of tuple of float
        From the upper left one, counterclockwise as seen from outside [m].
    """
    axes = ("x", "y", "z")
    vertices = [{f"vertex_{a}_coordinate": round(v, 3) for a, v in zip(axes, c, strict=True)} for c in corners]
    return {"surface_type": kind, "construction_name": made_of, "zone_name": zone,
            "number_of_vertices": len(vertices), "vertices": vertices}  # fmt: skip


def slab_corners(kind: str, box: Box, height: float, share: Point = (0.0, 1.0)) -> list[Corner]:
    """Return the corners of a part of a slab [m]; none where it is too narrow to be one.

    Parameters
    ----------
    kind : str
        ``Floor`` or ``Ceiling``.
    box : Box
        Of the zone.
    height : float
        Where it lies [m].
    share : tuple of float
        Of the zone's width where it begins and ends, from the west [-].
    """
    west, east = (box.west + s * (box.east - box.west) for s in share)
    if east - west < _LEAST_STRIP:
        return []
    south, north = box.south, box.north
    if kind == "Floor":
        ring = [(west, south), (west, north), (east, north), (east, south)]
    else:
        ring = [(west, north), (west, south), (east, south), (east, north)]
    return [(x, y, height) for x, y in ring]


def _slabs(spec: Spec) -> Objects:
    found = {}
    for floor in range(spec.layout.floors):
        for name, box in spec.layout.boxes().items():
            zone = zone_name(floor, name)
            for kind, height in zip(("Floor", "Ceiling"), spec.layout.levels(floor), strict=True):
                corners = slab_corners(kind, box, height)
                found[f"{zone} {kind.lower()}"] = surface(zone, kind, kind.lower(), corners) | behind(NO_FLOW)
    return {"BuildingSurface:Detailed": found}


def wall_name(floor: int, wall: Wall) -> str:
    """Return the name of a wall's surface.

    Parameters
    ----------
    floor : int
        From 0.
    wall : Wall
        Of that floor.
    """
    return f"{zone_name(floor, wall.zone)} {wall.side if wall.other is None else 'to ' + wall.other}"


def _walls(spec: Spec) -> Objects:
    surfaces: dict[str, dict[str, Any]] = {}
    panes: dict[str, dict[str, Any]] = {}
    for floor in range(spec.layout.floors):
        bottom, top = spec.layout.levels(floor)
        for wall in walls(spec.layout):
            zone, name = zone_name(floor, wall.zone), wall_name(floor, wall)
            made_of = "exterior wall" if wall.other is None else "partition"
            surfaces[name] = surface(zone, "Wall", made_of, _upright(wall.start, wall.end, bottom, top))
            if wall.other is not None:
                far = f"{zone_name(floor, wall.other)} to {wall.zone}"
                surfaces[name] |= {"outside_boundary_condition": "Surface", "sun_exposure": "NoSun",
                                   "wind_exposure": "NoWind", "outside_boundary_condition_object": far}  # fmt: skip
                continue
            surfaces[name] |= {"outside_boundary_condition": "Outdoors", "sun_exposure": "SunExposed",
                               "wind_exposure": "WindExposed"}  # fmt: skip
            if spec.layout.glazing[wall.side] > 0.0:
                panes[f"{name} pane"] = _pane(spec, wall, name, bottom)
    return {"BuildingSurface:Detailed": surfaces, "FenestrationSurface:Detailed": panes}


def _upright(start: Point, end: Point, bottom: float, top: float) -> list[Corner]:
    return [(*start, top), (*start, bottom), (*end, bottom), (*end, top)]


def _pane(spec: Spec, wall: Wall, name: str, bottom: float) -> dict[str, Any]:
    low, high = plan.pane(spec.layout, wall)
    start, end = wall.point(plan.PANE_EDGE), wall.point(1.0 - plan.PANE_EDGE)
    corners = _upright(start, end, bottom + low, bottom + high)
    fields: dict[str, Any] = {
        f"vertex_{k}_{a}_coordinate": round(v, 3)
        for k, corner in enumerate(corners, 1)
        for a, v in zip(("x", "y", "z"), corner, strict=True)
    }
    return fields | {"surface_type": "Window", "construction_name": "window", "building_surface_name": name,
                     "number_of_vertices": len(corners)}  # fmt: skip
