"""From a reference building to a trial's: what the baseline leaves out is switched off, save what the trial holds."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from typing import Any

from mpc.adapters.energyplus.input import InputFile
from reference_trials.buildings import Content
from reference_trials.specification import Effect

#: Film outside without an effect [W/m2/K]: convection at about 3 m/s; exchange with surfaces at air temperature adds 4.
EXTERIOR_FILM = 15.0
#: What takes the place of a solar absorptance, and of a solar heat gain coefficient, that is to be none [-].
NO_ABSORPTANCE, NO_TRANSMITTANCE = 0.001, 0.01
#: Between slab and ground where they are to exchange no heat [m2K/W]: 10 K drive 0.1 W/m2.
INSULATION = 100.0
#: The concrete that EnergyPlus gives a slab which is described by its perimeter's loss (Engineering Reference).
_SLAB = {"roughness": "MediumRough", "thickness": 0.15, "conductivity": 1.95, "density": 2240.0, "specific_heat": 900.0}

_GAINS = {
    "People": "number_of_people_schedule_name",
    **dict.fromkeys(
        ("Lights", "ElectricEquipment", "GasEquipment", "HotWaterEquipment", "SteamEquipment", "OtherEquipment"),
        "schedule_name",
    ),
}
#: Fields that a load is proportional to, and those that it is inversely proportional to.
_LEVELS = ("number_of_people", "people_per_floor_area", "design_level", "watts_per_floor_area", "watts_per_person",
           "watts_per_zone_floor_area", "power_per_zone_floor_area")  # fmt: skip
_INVERSE = ("floor_area_per_person",)
_AIR = ("ZoneInfiltration:DesignFlowRate", "ZoneInfiltration:EffectiveLeakageArea", "ZoneVentilation:DesignFlowRate",
        "ZoneVentilation:WindandStackOpenArea")  # fmt: skip
_RATES = ("design_flow_rate", "flow_rate_per_floor_area", "flow_rate_per_exterior_surface_area",
          "air_changes_per_hour", "effective_air_leakage_area")  # fmt: skip
#: A schedule that is on in design days only, so that equipment is sized for people, light and leaks all the same.
DESIGN_ONLY = "trial design days"


def variant(building: InputFile, effects: tuple[Effect, ...]) -> Content:
    """Return the objects of a trial's building.

    Parameters
    ----------
    building : InputFile
        As EnergyPlus has it.
    effects : tuple of Effect
        What the trial holds; effects of sensors and meters change nothing here.
    """
    content: Content = copy.deepcopy({k: dict(v) for k, v in building.content.items()})
    held = {e.name: e for e in effects}
    _schedules(content)
    _sun(content, held)
    content["Site:HeightVariation"] = {
        "height": {"wind_speed_profile_exponent": 0.0, "air_temperature_gradient_coefficient": 0.0}
    }
    content.pop("Site:WeatherStation", None)
    content["Site:WeatherStation"] = {"station": {"wind_speed_profile_exponent": 0.0}}
    content.pop("ZoneMixing", None)
    content.pop("ZoneCrossMixing", None)
    for name, (off, on) in _SWITCHES.items():
        effect = held.get(name)
        if effect is None:
            off(content)
        else:
            on(content, effect)
    for name, add in _ADDED.items():
        if name in held:
            add(content, held[name])
    return content


def _schedules(content: Content) -> None:
    content.setdefault("ScheduleTypeLimits", {})["trial any"] = {}
    days = [("SummerDesignDay WinterDesignDay", 1.0), ("AllOtherDays", 0.0)]
    data: list[dict[str, Any]] = [{"field": "Through: 12/31"}]
    for day, value in days:
        data += [{"field": f"For: {day}"}, {"field": "Until: 24:00"}, {"field": value}]
    content.setdefault("Schedule:Compact", {})[DESIGN_ONLY] = {
        "schedule_type_limits_name": "trial any", "data": data
    }  # fmt: skip
    content.setdefault("Schedule:Constant", {})["trial zero"] = {
        "schedule_type_limits_name": "trial any", "hourly_value": 0.0
    }  # fmt: skip


def _surfaces(content: Content) -> list[dict[str, Any]]:
    return list(content["BuildingSurface:Detailed"].values())


def _sun(content: Content, held: Mapping[str, Effect]) -> None:
    """Let the sun through glass, on walls, on both, or on nothing."""
    glass, walls = held.get("solar_gain"), held.get("solar_opaque")
    if glass is None and walls is None:  # windows take their exposure from the wall that they are in
        for surface in _surfaces(content):
            surface["sun_exposure"] = "NoSun"
        return
    for pane in content.get("WindowMaterial:SimpleGlazingSystem", {}).values():
        share = pane["solar_heat_gain_coefficient"]
        pane["solar_heat_gain_coefficient"] = NO_TRANSMITTANCE if glass is None else min(share * glass.strength, 0.85)
        pane.pop("visible_transmittance", None)
    _outer_layers(content, 0.0 if walls is None else walls.strength)


def _outer_layers(content: Content, strength: float) -> None:
    """Give constructions that look outdoors an outer layer that absorbs that share of what it does."""
    constructions = content["Construction"]
    names = {name.lower(): name for name in constructions}
    layers = {name.lower(): (kind, name) for kind in ("Material", "Material:NoMass") for name in content.get(kind, {})}
    for surface in _surfaces(content):
        if surface["outside_boundary_condition"] != "Outdoors":
            continue
        own = names[surface["construction_name"].lower()]
        kind, layer = layers[constructions[own]["outside_layer"].lower()]
        made = f"{own} in the sun"
        if made not in constructions:
            absorbed = content[kind][layer].get("solar_absorptance", 0.7)
            content[kind][f"{layer} of {own}"] = content[kind][layer] | {
                "solar_absorptance": min(max(absorbed * strength, NO_ABSORPTANCE), 0.95),
                "visible_absorptance": 0.5,
            }
            constructions[made] = constructions[own] | {"outside_layer": f"{layer} of {own}"}
        surface["construction_name"] = made


def _no_sky(content: Content) -> None:
    """Hold the sky at air temperature in the run, by whose name the property goes; sizing has the true one."""
    content["WeatherProperty:SkyTemperature"] = {
        "run": {"calculation_type": "DifferenceScheduleDryBulbValue", "schedule_name": "trial zero"}
    }


def _as_it_is(content: Content, effect: Effect) -> None:
    """Leave what the building has."""


def _constant_films(content: Content) -> None:
    content["SurfaceProperty:ConvectionCoefficients:MultipleSurface"] = {
        kind: {
            "surface_type": kind,
            "convection_coefficient_1_location": "Outside",
            "convection_coefficient_1_type": "Value",
            "convection_coefficient_1": EXTERIOR_FILM,
        }
        for kind in ("AllExteriorWalls", "AllExteriorWindows", "AllExteriorRoofs")
    }


def _no_air(content: Content) -> None:
    for kind in _AIR:
        for fields in content.get(kind, {}).values():
            fields["schedule_name"] = DESIGN_ONLY


def _air(content: Content, effect: Effect) -> None:
    for kind in _AIR:
        for fields in content.get(kind, {}).values():
            _scale(fields, _RATES, effect.strength)


def _no_gains(content: Content) -> None:
    for kind, schedule in _GAINS.items():
        for fields in content.get(kind, {}).values():
            fields[schedule] = DESIGN_ONLY


def _gains(content: Content, effect: Effect) -> None:
    for kind in _GAINS:
        for fields in content.get(kind, {}).values():
            _scale(fields, _LEVELS, effect.strength)
            _scale(fields, _INVERSE, 1.0 / effect.strength)


def _scale(fields: dict[str, Any], names: tuple[str, ...], factor: float) -> None:
    for name in names:
        if isinstance(fields.get(name), int | float):
            fields[name] *= factor


def _layers(construction: Mapping[str, str]) -> list[str]:
    """List the layers of a construction from outside to inside."""
    inner = sorted((k for k in construction if k.startswith("layer_")), key=lambda k: int(k.removeprefix("layer_")))
    return [construction["outside_layer"], *(construction[k] for k in inner)]


def _no_ground(content: Content) -> None:
    """Put insulation that lets nothing through between slab and ground.

    EnergyPlus' own adiabatic surfaces have the room on both sides, so that half of their mass would be missing. Of a
    slab that is described by the loss at its perimeter, EnergyPlus' concrete remains.
    """
    materials, constructions = content.setdefault("Material:NoMass", {}), content["Construction"]
    materials["trial insulation"] = {"roughness": "Rough", "thermal_resistance": INSULATION}
    slabs = {name.lower() for name in content.pop("Construction:FfactorGroundFloor", {})}
    if slabs:
        content.setdefault("Material", {})["trial slab"] = dict(_SLAB)
    names = {name.lower(): name for name in constructions}
    for surface in _surfaces(content):
        own = surface["construction_name"].lower()
        if not surface["outside_boundary_condition"].startswith("Ground"):
            if own in slabs:  # a floor without a perimeter, which EnergyPlus has as adiabatic
                constructions["trial slab inside"] = {"outside_layer": "trial slab"}
                surface["construction_name"] = "trial slab inside"
            continue
        surface["outside_boundary_condition"] = "Ground"
        surface.pop("outside_boundary_condition_object", None)
        made = f"{own} insulated"
        layers = ["trial slab"] if own in slabs else _layers(constructions[names[own]])
        constructions[made] = {"outside_layer": "trial insulation"} | {f"layer_{k}": v for k, v in enumerate(layers, 2)}
        surface["construction_name"] = made


#: What the building has, off and on.
_SWITCHES: dict[str, tuple[Callable[[Content], None], Callable[[Content, Effect], None]]] = {
    "longwave_sky": (_no_sky, _as_it_is),
    "wind_film": (_constant_films, _as_it_is),
    "infiltration": (_no_air, _air),
    "internal_gains": (_no_gains, _gains),
    "ground_exchange": (_no_ground, _as_it_is),
}


def _hidden_mass(content: Content, effect: Effect) -> None:
    """Add concrete that both faces of look at the zone, and that no drawing shows."""
    content.setdefault("Material", {})["trial concrete"] = {
        "roughness": "Rough", "thickness": 0.1, "conductivity": 1.7, "density": 2300.0, "specific_heat": 900.0,
    }  # fmt: skip
    content["Construction"]["trial mass"] = {"outside_layer": "trial concrete"}
    for zone, area in effect.parameters["area_m2"].items():
        content.setdefault("InternalMass", {})[f"{zone} trial mass"] = {
            "construction_name": "trial mass", "zone_or_zonelist_name": zone, "surface_area": area,
        }  # fmt: skip


def _zone_mixing(content: Content, effect: Effect) -> None:
    content.setdefault("Schedule:Constant", {})["trial one"] = {
        "schedule_type_limits_name": "trial any", "hourly_value": 1.0
    }  # fmt: skip
    for k, (one, other) in enumerate(effect.parameters["between"]):
        for a, b in ((one, other), (other, one)):
            content.setdefault("ZoneMixing", {})[f"trial mixing {k} {a}"] = {
                "zone_or_space_name": a,
                "source_zone_or_space_name": b,
                "schedule_name": "trial one",
                "design_flow_rate_calculation_method": "Flow/Zone",
                "design_flow_rate": effect.parameters["flow_m3_s"],
            }


#: What is added to the building.
_ADDED: dict[str, Callable[[Content, Effect], None]] = {"hidden_mass": _hidden_mass, "zone_mixing": _zone_mixing}
