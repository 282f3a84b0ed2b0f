"""Switches the effects of a trial on, each in its own part of the EnergyPlus input."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from _worlds import Effect
from energyplus_trials.frame import merge, polygon

from house_trials import fabric, model, people
from house_trials.faces import STRUCTURE, faces, upright
from house_trials.plant import Plant

_OUTDOOR_FACES = ("AllExteriorWalls", "AllExteriorWindows", "AllExteriorRoofs")
_MASONRY = 0.115  # [m] of brick, both faces of which see the room
_STRIP = 0.25  # [m], height of the edge of a floor
_PARTY_FILM = 1.0 / 0.13  # [W/m2/K], ISO 6946


def apply_changes(plant: Plant) -> None:
    """Switch effects on; those of sensors, meters and drawings change only what is told of the house.

    Parameters
    ----------
    plant : Plant
        The null; changed.
    """
    for effect in (*plant.spec.known, *plant.spec.effects):
        change = _CHANGES.get(effect.name)
        if change is not None:
            change(plant, effect)


def _solar_gain(plant: Plant, effect: Effect) -> None:
    plant.sun = True
    glass = fabric.pane(plant.spec.fabric.window_u_value, effect.parameters["transmittance"])
    plant.objects["WindowMaterial:Glazing"]["glass"] = glass


def _solar_opaque(plant: Plant, effect: Effect) -> None:
    plant.sun = True
    merge(plant.objects, model.materials(plant.spec, effect.parameters["absorptance"]))


def _longwave_sky(plant: Plant, effect: Effect) -> None:
    plant.sky = effect.parameters["share"]


def _wind_film(plant: Plant, effect: Effect) -> None:
    wind = plant.station["wind_speed_sensor"].to_numpy()
    film = plant.spec.fabric.exterior_film + effect.parameters["slope_W_s_m3_K"] * (wind - wind.mean())
    schedule = plant.follow("film", np.maximum(film, 4.0))
    for kind in _OUTDOOR_FACES:
        values = plant.objects["SurfaceProperty:ConvectionCoefficients:MultipleSurface"][kind]
        values.pop("convection_coefficient_1")
        values |= {"convection_coefficient_1_type": "Schedule", "convection_coefficient_1_schedule_name": schedule}


def _infiltration(plant: Plant, effect: Effect) -> None:
    """Leak outdoor air into rooms with an exterior wall: as strong as the constant form at 3.5 m/s, and at 15 K."""
    spec, wind = plant.spec, plant.station["wind_speed_sensor"].to_numpy()
    share = np.ones(len(wind))
    if effect.form == "wind":
        share = wind / 3.5
    elif effect.form == "wind_direction":
        angle = plant.station["wind_direction_sensor"].to_numpy() - effect.parameters["azimuth_deg"]
        share = np.maximum(np.cos(np.radians(angle)), 0.0) * wind / 1.2
    schedule = plant.follow("leakage", share)
    for room in sorted({f.room for f in faces(spec.house) if f.side}):
        flow = effect.parameters["changes_per_hour"] * spec.room(room).area * spec.house.height / 3600.0
        if effect.form == "stack":  # flow = leakage / 1000 * (C_s dT)^0.5, [cm2] and [m3/s]
            plant.add(
                "ZoneInfiltration:EffectiveLeakageArea", f"{room} leak", zone_or_space_name=room,
                schedule_name=schedule,
                effective_air_leakage_area=float(1000.0 * flow / np.sqrt(0.000145 * 15.0)),
                stack_coefficient=0.000145, wind_coefficient=1e-9,
            )  # fmt: skip
            continue
        leak(plant, room, "leak", flow, schedule)


def leak(plant: Plant, room: str, name: str, flow: float, schedule: str) -> None:
    """Let outdoor air into a room.

    Parameters
    ----------
    plant : Plant
        Changed.
    room, name : str
        Where, and what.
    flow : float
        Of air [m3/s].
    schedule : str
        How much of it there is.
    """
    plant.add(
        "ZoneInfiltration:DesignFlowRate", f"{room} {name}", zone_or_zonelist_or_space_or_spacelist_name=room,
        schedule_name=schedule, design_flow_rate_calculation_method="Flow/Zone", design_flow_rate=flow,
        constant_term_coefficient=1.0, temperature_term_coefficient=0.0, velocity_term_coefficient=0.0,
        velocity_squared_term_coefficient=0.0,
    )  # fmt: skip


def _internal_gains(plant: Plant, effect: Effect) -> None:
    """People, cooking, lights and appliances, room by room, of a given mean over house and time."""
    spec, rng = plant.spec, np.random.default_rng(effect.parameters["seed"])
    who, hour = plant.people, np.asarray(plant.starts.hour + plant.starts.minute / 60.0)
    heat = {room: 0.4 * spec.room(room).area * rng.uniform(0.5, 1.5) * np.ones(hour.size) for room in spec.zone_names}
    beds = [r for r in spec.zone_names if r in ("bedroom", "child", "nursery", "loft", "study")] or [
        spec.zone_names[-1]
    ]
    cook, sit = ("kitchen" if "kitchen" in heat else spec.zone_names[0]), spec.zone_names[0]
    for bed in beds:
        heat[bed] += 70.0 * who.home * (1.0 - who.awake) / len(beds)
    heat[sit] += who.awake * (75.0 * who.home * (hour >= 17.0) + rng.uniform(80.0, 250.0) * (hour >= 18.0))
    heat[cook] += who.awake * 75.0 * who.home * (hour < 17.0) + rng.uniform(40.0, 90.0)
    for at in (7.5, 12.5, 18.5):
        meal = people.now_and_then(rng, hour.size, 0.75, (0.2, 0.9), at) * who.awake
        heat[cook] += rng.uniform(600.0, 1500.0) * meal
    wanted = effect.parameters["mean_W_m2"] * sum(room.area for room in spec.house.rooms)
    scale = wanted / float(sum(watts.mean() for watts in heat.values()))
    for room, watts in heat.items():
        plant.heat(room, "gains", scale * watts, 0.4)


def _ground(plant: Plant, effect: Effect) -> None:
    """Let soil take the place of the adiabatic back of the lowest floors."""
    merge(plant.objects, model.other_side("soil", effect.parameters["u_value_W_m2_K"]))
    plant.follow("soil", np.full(len(plant.station), effect.parameters["temperature_degC"]))
    for face in faces(plant.spec.house):
        if face.other == "ground":
            surface = plant.objects["BuildingSurface:Detailed"][face.name]
            surface |= model.behind("soil") | {"construction_name": "lowest floor"}


def _hidden_mass(plant: Plant, effect: Effect) -> None:
    merge(plant.objects, model.materials(plant.spec, _absorptance(plant), {"masonry": (("brick", _MASONRY),)}))
    _, density, capacity = fabric.MATERIALS["brick"]
    of_a_face = _MASONRY / 2.0 * density * capacity / 1000.0  # [kJ/m2/K]
    for room in plant.spec.house.rooms:
        area = effect.parameters["capacity_kJ_m2_K"] / of_a_face * room.area
        plant.add("InternalMass", f"{room.name} masonry", construction_name="masonry", zone_or_zonelist_name=room.name,
                  surface_area=round(area, 4))  # fmt: skip


def _zone_mixing(plant: Plant, effect: Effect) -> None:
    rng = np.random.default_rng(effect.parameters["seed"])
    for first, second in effect.parameters["pairs"]:
        schedule = "always"
        if effect.form == "by_people":
            schedule = plant.follow(f"{first} {second} door", people.doors(plant.people, rng))
        door = model.mixing((first, second), effect.parameters["flow_m3_s"], schedule)
        plant.objects.setdefault("ZoneCrossMixing", {})[f"{first} {second} door"] = door


def _sensor_bias(plant: Plant, effect: Effect) -> None:
    """Let thermostats control what their sensors read: rooms are off by the bias."""
    for room, bias in effect.parameters["bias_K"].items():
        if room in plant.heaters:
            plant.heaters[room]["bias"] = bias


def _capacity_limit(plant: Plant, effect: Effect) -> None:
    for room in effect.zones:
        plant.heaters[room]["limit"] = 1.0 - effect.parameters["lost_share"]
        if plant.heaters[room]["floor"]:
            unit = plant.objects["ZoneHVAC:LowTemperatureRadiant:Electric"][f"{room} floor heating"]
            unit["heating_design_capacity"] *= plant.heaters[room]["limit"]


def _meter_at_boiler(plant: Plant, effect: Effect) -> None:
    """Give pipes and radiators more water, which the meter sees warm up and the rooms do not."""
    for heater in plant.heaters.values():
        heater["lag"] = effect.parameters["time_constant_s"]


def _thermal_bridge(plant: Plant, effect: Effect) -> None:
    """Let the edge of the floors, above each exterior wall, lose heat; it has no mass."""
    resistance = max(_STRIP / effect.parameters["psi_W_m_K"] - fabric.FILMS, 0.01)
    plant.add("Material:NoMass", "edge", roughness="MediumRough", thermal_resistance=round(resistance, 4),
              thermal_absorptance=0.9, solar_absorptance=model.DARK, visible_absorptance=model.DARK)  # fmt: skip
    plant.add("Construction", "edge", outside_layer="edge")
    for face in faces(plant.spec.house):
        if face.side:
            start, end, low = face.corners[1][:2], face.corners[2][:2], face.corners[0][2]
            plant.add(
                "BuildingSurface:Detailed", f"{face.name} edge", surface_type="Wall", construction_name="edge",
                zone_name=face.room, outside_boundary_condition="Outdoors", sun_exposure="SunExposed",
                wind_exposure="WindExposed", **polygon(upright(start, end, low, low + min(_STRIP, STRUCTURE))),
            )  # fmt: skip


def _neighbour(plant: Plant, effect: Effect) -> None:
    """Put a neighbour behind the side without windows, in place of outdoors."""
    brick = 0.115
    between = 1.0 / effect.parameters["u_value_W_m2_K"] - 0.26 - 2.0 * brick / fabric.MATERIALS["brick"][0]
    wool = round(max(between, 0.01) * fabric.MATERIALS["wool"][0], 4)
    party = (("brick", brick), ("wool", wool), ("brick", brick))
    merge(plant.objects, model.materials(plant.spec, _absorptance(plant), {"party wall": party}))
    merge(plant.objects, model.other_side("next door", _PARTY_FILM))
    plant.follow("next door", np.full(len(plant.station), effect.parameters["temperature_degC"]))
    surfaces = plant.objects["BuildingSurface:Detailed"]
    for face in faces(plant.spec.house):
        if face.side == effect.parameters["side"]:
            surfaces.pop(f"{face.name} edge", None)  # floors of the two houses meet there
            surfaces[face.name] |= model.behind("next door") | {
                "construction_name": "party wall", "sun_exposure": "NoSun", "wind_exposure": "NoWind",
            }  # fmt: skip


def _absorptance(plant: Plant) -> float:
    found = [e.parameters["absorptance"] for e in plant.spec.effects if e.name == "solar_opaque"]
    return found[0] if found else model.DARK


def _window_opening(plant: Plant, effect: Effect) -> None:
    rng = np.random.default_rng(effect.parameters["seed"])
    for room in effect.zones:
        schedule = plant.follow(f"{room} windows", people.openings(plant.people, rng))
        open_area(plant, room, "windows", effect.parameters["area_m2"], schedule, 0.6)


def open_area(plant: Plant, room: str, name: str, area: float, schedule: str, height: float) -> None:
    """Open a window, or what air passes as through one.

    Parameters
    ----------
    plant : Plant
        Changed.
    room, name : str
        Where, and what.
    area : float
        Open [m2].
    schedule : str
        How much of it is.
    height : float
        Over which warmth drives air [m].
    """
    plant.add(
        "ZoneVentilation:WindandStackOpenArea", f"{room} {name}", zone_or_space_name=room, opening_area=area,
        opening_area_fraction_schedule_name=schedule, opening_effectiveness=0.25, effective_angle=0.0,
        height_difference=height, discharge_coefficient_for_opening=0.6, maximum_wind_speed=40.0,
    )  # fmt: skip


def _stove(plant: Plant, effect: Effect) -> None:
    """Light a fire on some evenings, which cools down over an hour."""
    rng = np.random.default_rng(effect.parameters["seed"])
    fire = people.now_and_then(rng, len(plant.station), 0.5, (1.5, 4.0), 18.0)
    kept, heat = np.exp(-1.0 / people.STEPS_PER_HOUR), np.zeros(fire.size)
    for step in range(1, fire.size):
        heat[step] = fire[step] + (heat[step - 1] - fire[step]) * kept
    plant.heat(effect.zones[0], "stove", effect.parameters["power_W"] * heat, 0.5)


def _bath(plant: Plant, effect: Effect) -> None:
    rng = np.random.default_rng(effect.parameters["seed"])
    use = people.now_and_then(rng, len(plant.station), 0.8, (0.3, 1.0), 20.0)
    plant.heat(effect.zones[0], "bath", effect.parameters["power_W"] * use, 0.3)


def _riser_pipe(plant: Plant, effect: Effect) -> None:
    plant.heat(effect.zones[0], "pipe", np.full(len(plant.station), effect.parameters["power_W"]), 0.3)


def _fireplace_flue(plant: Plant, effect: Effect) -> None:
    open_area(plant, effect.zones[0], "flue", effect.parameters["area_m2"], "always", 5.0)


_CHANGES: dict[str, Callable[[Plant, Effect], None]] = {
    "solar_gain": _solar_gain, "solar_opaque": _solar_opaque, "longwave_sky": _longwave_sky, "wind_film": _wind_film,
    "infiltration": _infiltration, "internal_gains": _internal_gains, "ground_exchange": _ground,
    "hidden_mass": _hidden_mass, "zone_mixing": _zone_mixing, "sensor_bias": _sensor_bias,
    "capacity_limit": _capacity_limit, "thermal_bridge": _thermal_bridge, "neighbour": _neighbour,
    "window_opening": _window_opening, "stove": _stove, "bath": _bath, "riser_pipe": _riser_pipe,
    "fireplace_flue": _fireplace_flue, "meter_at_boiler": _meter_at_boiler,
}  # fmt: skip
