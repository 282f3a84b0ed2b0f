"""Effects of the envelope: sun, sky, wind, ground, roof, floors, bridges, neighbours."""

from __future__ import annotations

import numpy as np
from _sealed import TrialError
from _worlds import Effect

from energyplus_trials import fabric, model, plan, profiles
from energyplus_trials.frame import merge, polygon
from energyplus_trials.plant import Plant

_OUTDOOR_FACES = ("AllExteriorWalls", "AllExteriorWindows", "AllExteriorRoofs")
STRIP = 0.3  # [m], height of the strip of wall that a thermal bridge takes
PARTY_WALL_FILM = 7.7  # [W/m2/K], ISO 6946


def solar_gain(plant: Plant, effect: Effect) -> None:
    """Let the sun in through glass; behind a horizon in that form."""
    plant.sun = True
    u_value = plant.spec.fabric.window_u_value
    plant.objects["WindowMaterial:Glazing"]["glass"] = fabric.pane(u_value, effect.parameters["transmittance"])
    if effect.form == "horizon":
        _horizon(plant, effect.parameters["azimuth_deg"], effect.parameters["elevation_deg"])


def _horizon(plant: Plant, azimuth: float, elevation: float) -> None:
    """Stand a long, high wall in the way of the sun."""
    distance, half = 60.0, 80.0
    height = distance * np.tan(np.radians(elevation))
    to = np.radians(azimuth)
    middle = distance * np.array([np.sin(to), np.cos(to)])
    along = half * np.array([np.cos(to), -np.sin(to)])
    (x0, y0), (x1, y1) = middle - along, middle + along
    ring = [(x0, y0, height), (x0, y0, 0.0), (x1, y1, 0.0), (x1, y1, height)]
    plant.add("Shading:Site:Detailed", "horizon", **polygon([tuple(map(float, p)) for p in ring]))


def blinds(plant: Plant, effect: Effect) -> None:
    """Lower exterior shades, window by window, while more sun falls on it than a threshold."""
    through = 1.0 - effect.parameters["beta"]
    optics = {
        f"{band}_{what}": value
        for band in ("solar", "visible")
        for what, value in (("transmittance", through), ("reflectance", 0.9 * (1.0 - through)))
    }
    plant.add(
        "WindowMaterial:Shade", "shade", **optics,
        infrared_hemispherical_emissivity=0.9, infrared_transmittance=0.05, thickness=0.002, conductivity=0.1,
        shade_to_glass_distance=0.05, top_opening_multiplier=0.5, bottom_opening_multiplier=0.5,
        left_side_opening_multiplier=0.5, right_side_opening_multiplier=0.5, airflow_permeability=0.0,
    )  # fmt: skip
    by_zone: dict[str, list[str]] = {}
    for name in plant.objects["Window"]:
        by_zone.setdefault(name.split()[0], []).append(name)
    for zone, names in by_zone.items():
        plant.add(
            "WindowShadingControl", f"{zone} shades", zone_name=zone, shading_type="ExteriorShade",
            shading_control_sequence_number=1, shading_device_material_name="shade",
            shading_control_type="OnIfHighSolarOnWindow", setpoint=effect.parameters["threshold_W_m2"],
            multiple_surface_control_type="Sequential",
            fenestration_surfaces=[{"fenestration_surface_name": name} for name in names],
        )  # fmt: skip


def solar_opaque(plant: Plant, effect: Effect) -> None:
    """Let the sun warm opaque walls; a roof, too, where there is one."""
    plant.sun = True
    layers = fabric.constructions(plant.spec.fabric)
    wall = fabric.objects({"exterior wall": layers["exterior wall"]}, effect.parameters["absorptance"])
    merge(plant.objects, wall)


def longwave_sky(plant: Plant, effect: Effect) -> None:
    """Let the building see the sky: part of its difference from the air, or more than all of it."""
    plant.sky = effect.parameters["share"]


def wind_film(plant: Plant, effect: Effect) -> None:
    """Let the film outside follow the wind about the null's value."""
    if plant.spec.fabric.uneven:
        raise TrialError("wind_film: films of uneven offices follow the wind already")
    wind = plant.station["wind_speed_sensor"].to_numpy()
    film = plant.spec.fabric.exterior_film + effect.parameters["slope_W_s_m3_K"] * (wind - wind.mean())
    schedule = plant.add_schedule("film", np.maximum(film, 4.0))
    for faces in _OUTDOOR_FACES:
        values = plant.objects["SurfaceProperty:ConvectionCoefficients:MultipleSurface"][faces]
        values.pop("convection_coefficient_1")
        values |= {
            "convection_coefficient_1_type": "Schedule", "convection_coefficient_1_schedule_name": schedule,
        }  # fmt: skip


def interfloor(plant: Plant, effect: Effect) -> None:
    """Join each ceiling to the floor above: the slabs' concrete stays, the resistance between gives the U-value."""
    concrete = plant.spec.fabric.slab
    rest = 0.27 + 2.0 * concrete / fabric.SOLIDS["concrete"][0]
    between = max(1.0 / effect.parameters["u_value_W_m2_K"] - rest, 0.01)
    layers: fabric.Layers = [("concrete", concrete), ("", round(between, 4)), ("concrete", concrete)]
    merge(plant.objects, fabric.objects({"floor between": layers}, fabric.NO_SOLAR_ABSORPTANCE))
    surfaces = plant.objects["BuildingSurface:Detailed"]
    for zone in plant.spec.zone_names:
        floor, name = model.split(zone)
        if floor == 0:
            continue
        below = f"F{floor}_{name}"
        for one, other in ((f"{zone} floor", f"{below} ceiling"), (f"{below} ceiling", f"{zone} floor")):
            surfaces[one] |= {
                "construction_name": "floor between", "outside_boundary_condition": "Surface",
                "outside_boundary_condition_object": other,
            }  # fmt: skip


def ground(plant: Plant, effect: Effect) -> None:
    """Rest the lowest floor on ground: the mean of the outdoor air, somewhat warmer, and lagged by the season."""
    concrete = plant.spec.fabric.slab
    between = 1.0 / effect.parameters["u_value_W_m2_K"] - 0.17 - concrete / fabric.SOLIDS["concrete"][0]
    layers: fabric.Layers = [("", round(max(between, 0.01), 4)), ("concrete", concrete)]
    merge(plant.objects, fabric.objects({"floor on ground": layers}, fabric.NO_SOLAR_ABSORPTANCE))
    temperature = profiles.ground_temperature(plant.spec.climate, plant.starts) + effect.parameters["warmer_K"]
    other_side(plant, "ground", plant.add_schedule("ground", temperature), film=0.0)
    for zone in plant.spec.zone_names:
        if model.split(zone)[0] == 0:
            plant.objects["BuildingSurface:Detailed"][f"{zone} floor"] |= {
                "construction_name": "floor on ground", "outside_boundary_condition": "OtherSideCoefficients",
                "outside_boundary_condition_object": "ground",
            }  # fmt: skip


def other_side(plant: Plant, name: str, schedule: str, film: float) -> None:
    """Add a place of a given temperature behind surfaces.

    Parameters
    ----------
    plant : Plant
        The building; changed.
    name, schedule : str
        Of the place, and of its temperature [degC].
    film : float
        Between place and surface [W/m2/K]; 0 gives the surface the temperature itself.
    """
    plant.add(
        "SurfaceProperty:OtherSideCoefficients", name, combined_convective_radiative_film_coefficient=film,
        constant_temperature=0.0, constant_temperature_coefficient=1.0, constant_temperature_schedule_name=schedule,
        external_dry_bulb_temperature_coefficient=0.0, ground_temperature_coefficient=0.0, wind_speed_coefficient=0.0,
        zone_air_temperature_coefficient=0.0,
    )  # fmt: skip


def roof(plant: Plant, effect: Effect) -> None:
    """Open the top ceilings to outdoors, behind insulation."""
    concrete = plant.spec.fabric.slab
    between = 1.0 / effect.parameters["u_value_W_m2_K"] - 0.14 - concrete / fabric.SOLIDS["concrete"][0]
    layers: fabric.Layers = [("render", 0.01), ("", round(max(between, 0.01), 4)), ("concrete", concrete)]
    opaque = [e.parameters["absorptance"] for e in plant.spec.effects if e.name == "solar_opaque"]
    absorptance = opaque[0] if opaque else fabric.NO_SOLAR_ABSORPTANCE
    merge(plant.objects, fabric.objects({"roof": layers}, absorptance))
    for zone in plant.spec.zone_names:
        if model.split(zone)[0] == plant.spec.layout.floors - 1:
            plant.objects["BuildingSurface:Detailed"][f"{zone} ceiling"] |= {
                "surface_type": "Roof", "construction_name": "roof", "outside_boundary_condition": "Outdoors",
                "sun_exposure": "SunExposed", "wind_exposure": "WindExposed",
            }  # fmt: skip


def thermal_bridge(plant: Plant, effect: Effect) -> None:
    """Give each exterior wall a strip without mass at its foot, of the wall's U-value and the bridge's."""
    u_value = plant.spec.fabric.wall_u_value + effect.parameters["psi_W_m_K"] / STRIP
    layers: fabric.Layers = [("", round(max(1.0 / u_value - fabric.FILMS, 0.01), 4))]
    merge(plant.objects, fabric.objects({"bridge": layers}, fabric.NO_SOLAR_ABSORPTANCE))
    for zone in plant.spec.zone_names:
        for s in plan.segments(plant.spec.layout.zones):
            if s.other is None and s.zone == model.split(zone)[1]:
                plant.add(
                    "Door", f"{zone} {s.side} bridge", construction_name="bridge",
                    building_surface_name=model.surface_name(zone, s.side), starting_x_coordinate=0.02,
                    starting_z_coordinate=0.02, length=round(s.length - 0.04, 4), height=STRIP,
                )  # fmt: skip


def neighbour(plant: Plant, effect: Effect) -> None:
    """Put a neighbour behind the walls of the facade without windows, in place of outdoors."""
    brick = 0.15
    between = 1.0 / effect.parameters["u_value_W_m2_K"] - 0.26 - 2.0 * brick / fabric.SOLIDS["brick"][0]
    layers: fabric.Layers = [("brick", brick), ("", round(max(between, 0.01), 4)), ("brick", brick)]
    merge(plant.objects, fabric.objects({"party wall": layers}, fabric.NO_SOLAR_ABSORPTANCE))
    schedule = plant.add_schedule("next door", effect.parameters["temperature_degC"])
    other_side(plant, "next door", schedule, PARTY_WALL_FILM)
    for zone in effect.zones:
        plant.objects.get("Door", {}).pop(f"{zone} {effect.parameters['side']} bridge", None)  # not to a neighbour
        plant.objects["BuildingSurface:Detailed"][model.surface_name(zone, effect.parameters["side"])] |= {
            "construction_name": "party wall", "outside_boundary_condition": "OtherSideCoefficients",
            "outside_boundary_condition_object": "next door", "sun_exposure": "NoSun", "wind_exposure": "NoWind",
        }  # fmt: skip
