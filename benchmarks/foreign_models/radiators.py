"""A dwelling whose rooms have radiators with thermostats of their own, on the water of a gas boiler."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep
from foreign_models.rooms import Rooms
from foreign_models.thermostats import clock, comfort, present, thermostat, thermostat_points
from foreign_models.water import scheduled_loop, supply_water, supply_water_points

BOILER = "BOILER"
FABRIC = ep.Fabric(wall=0.08, roof=0.12, floor=0.06, glass=(1.8, 0.6), air_changes=0.5, goods=3.0)
ROOMS = Rooms(columns=2, rows=2, length=5.0, depth=5.0, height=2.6, glass=(3.0, 2.0))
#: EUR/kWh, of a household.
GAS = 0.11
#: Own supply water: 65 degC at -10 degC outdoors, 40 at 15, on a straight line.
RESET = (65.0, -10.0, 40.0, 15.0)
_COOL = 17.0  # degC, of the thermostats' own clocks
_RADIANT = 0.3  # of a radiator's heat [-], usual of panels with convectors (EN 442)
_MEAN_WATER = 55.0  # degC, at which the radiators are rated: 60 to 50
_SPREAD = 1.0 / (4180.0 * 10.0)  # kg/s of water per W: 10 K
_PARASITIC = 40.0  # W, fan and electronics of the boiler at full load
_PUMP, _IDLE = 45.0, 0.3  # W at full flow, and the share that it draws at none
#: Efficiency, of the gross calorific value, with water that returns at 50 degC, and what a kelvin less adds while
#: vapour condenses: about 0.97 at 30 degC, as makers say of condensing boilers.
_EFFICIENCY, _PER_KELVIN, _RETURN = 0.88, 0.0045, (25.0, 60.0)
_DAY, _NIGHT = [7 <= hour < 23 for hour in range(24)], [hour < 8 or hour >= 22 for hour in range(24)]
ALL_DAY = [True] * 24
_RADIATOR = "ZoneHVAC:Baseboard:RadiantConvective:Water"


@dataclass(frozen=True)
class Dwelling:
    """What a dwelling is made of.

    Parameters
    ----------
    fabric : Fabric
        Of the building.
    rooms : Rooms
        Sizes and places; the first half of them are lived in by day, the others are bedrooms.
    radiator, boiler : float
        What a room's radiators give at a mean water temperature of 55 degC, and the boiler [W].
    people, appliances : float
        Of a room, and heat that nothing measures [W].
    out : tuple of int
        Hours between which nobody is in on working days.
    """

    fabric: ep.Fabric = FABRIC
    rooms: Rooms = ROOMS
    radiator: float = 1_800.0
    boiler: float = 9_000.0
    people: float = 1.5
    appliances: float = 60.0
    out: tuple[int, int] = (8, 16)

    @property
    def present(self) -> dict[str, tuple[list[bool], list[bool]]]:
        """Whether somebody is in, by room: hours of working days and of week-ends."""
        out, found = range(*self.out), {}
        for number, room in enumerate(self.rooms.names):
            hours = _DAY if 2 * number < len(self.rooms.names) else _NIGHT
            found[room] = ([some and hour not in out for hour, some in enumerate(hours)], hours)
        return found


def dwelling(of: Dwelling | None = None) -> Objects:
    """Return the input of a dwelling."""
    of = of or Dwelling()
    model, listed = ep.start(of.fabric), of.rooms.names
    flow = _SPREAD * of.radiator / 1e3  # m3/s
    for number, (zone, hours) in enumerate(of.present.items()):
        ep.merge(model, of.rooms.box(number))
        ep.merge(model, ep.inside(zone, of.fabric, of.rooms.area, of.people, f"{zone} presence", of.appliances))
        ep.merge(model, thermostat(zone, *(clock(each, cool=_COOL) for each in hours)))
        ep.merge(model, ep.equipment(zone, [(_RADIATOR, f"{zone} radiator")]))
        ep.merge(model, {"Schedule:Compact": {f"{zone} presence": ep.daily(*_shares(hours))}})
        ep.merge(model, _radiator(zone, of.radiator, flow))
        ep.merge(model, ep.summed(f"{zone} heat", {  # EnergyPlus' own total has little of what radiates
            kind: (f"{zone} radiator", f"Baseboard {kind.title()} Heating Rate", 1.0)
            for kind in ("convective", "radiant")
        }))  # fmt: skip
    ep.merge(model, {f"{_RADIATOR}:Design": {"radiators": {
        "heating_design_capacity_method": "HeatingDesignCapacity", "fraction_radiant": _RADIANT,
        "fraction_of_radiant_energy_incident_on_people": 0.0,
    }}})  # fmt: skip
    pump = {"design_maximum_flow_rate": flow * len(listed), "design_pump_head": 20_000.0, "motor_efficiency": 0.5,
            "design_power_consumption": _PUMP, "pump_control_type": "Intermittent",
            "coefficient_1_of_the_part_load_performance_curve": _IDLE,
            "coefficient_2_of_the_part_load_performance_curve": 1.0 - _IDLE}  # fmt: skip
    consumers = [(_RADIATOR, f"{zone} radiator") for zone in listed]
    machine = ("Boiler:HotWater", BOILER)
    ep.merge(model, scheduled_loop("HOT LOOP", pump, machine, consumers, "Heating", flow * len(listed), 50.0,
                                   variable=True))  # fmt: skip
    ep.merge(model, _boiler(of.boiler, flow * len(listed)))
    ep.merge(model, supply_water("HOT LOOP", RESET))
    return model


def _shares(hours: Sequence[Sequence[bool]]) -> list[list[float]]:
    return [[float(some) for some in each] for each in hours]


def _radiator(zone: str, capacity: float, flow: float) -> Objects:
    name = f"{zone} radiator"
    return {_RADIATOR: {name: {
        "design_object": "radiators", "availability_schedule_name": ep.ALWAYS,
        "inlet_node_name": f"{name} in", "outlet_node_name": f"{name} out", "maximum_water_flow_rate": flow,
        "rated_average_water_temperature": _MEAN_WATER, "rated_water_mass_flow_rate": 1e3 * flow,
        "heating_design_capacity": capacity,
        "surface_fractions": [
            {"surface_name": f"{zone} {face}", "fraction_of_radiant_energy_to_surface": 0.5}
            for face in ("floor", "ceiling")
        ],
    }}}  # fmt: skip


def _boiler(capacity: float, flow: float) -> Objects:
    """Return a condensing boiler, whose efficiency falls with the water that returns."""
    per_kelvin = _PER_KELVIN / _EFFICIENCY
    curve = {"coefficient1_constant": 1.0 + 50.0 * per_kelvin, "coefficient2_x": 0.0, "coefficient3_x_2": 0.0,
             "coefficient4_y": -per_kelvin, "coefficient5_y_2": 0.0, "coefficient6_x_y": 0.0,
             "minimum_value_of_x": 0.1, "maximum_value_of_x": 1.0, "minimum_value_of_y": _RETURN[0],
             "maximum_value_of_y": _RETURN[1]}  # fmt: skip
    return {
        "Boiler:HotWater": {BOILER: {
            "fuel_type": "NaturalGas", "nominal_capacity": capacity, "nominal_thermal_efficiency": _EFFICIENCY,
            "efficiency_curve_temperature_evaluation_variable": "EnteringBoiler",
            "normalized_boiler_efficiency_curve_name": "condensing", "design_water_flow_rate": flow,
            "boiler_water_inlet_node_name": f"{BOILER} in", "boiler_water_outlet_node_name": f"{BOILER} out",
            "water_outlet_upper_temperature_limit": 85.0, "boiler_flow_mode": "NotModulated",
            "on_cycle_parasitic_electric_load": _PARASITIC,
        }},
        "Curve:Biquadratic": {"condensing": curve},
    }  # fmt: skip


def description(of: Dwelling | None = None) -> dict[str, Any]:
    """Return what ``plant.yaml`` says of zones, points and actuators."""
    of = of or Dwelling()
    told: dict[str, Any] = {"zones": {}, "measurements": {}, "actuators": {}}
    for zone, hours in of.present.items():
        name = zone.lower()
        told["zones"][name] = {
            "temperature": f"{zone}, Zone Mean Air Temperature", "floor_area": of.rooms.area,
            "volume": of.rooms.area * of.rooms.height, "comfort": comfort(*hours),
            "people": present(of.people, *hours),
        }  # fmt: skip
        measured, acted = thermostat_points(zone, name)
        told["measurements"] |= measured | {f"{name}/heating_power_sensor": f"EMS, {zone} heat"}
        told["actuators"] |= acted
    gas, pump, fan = (f"{name} Rate" for name in (
        f"{BOILER}, Boiler NaturalGas", "HOT LOOP pump, Pump Electricity", f"{BOILER}, Boiler Ancillary Electricity",
    ))  # fmt: skip
    measured, acted = supply_water_points(BOILER, "boiler", "HOT LOOP", "35 degC", "70 degC")
    told["measurements"] |= measured | {
        "boiler/gas_power_sensor": gas,
        "boiler/heating_power_sensor": f"{BOILER}, Boiler Heating Rate",
    }
    told["actuators"] |= acted
    source = {"heating_water": "boiler/supply_water_temperature_setpoint"}
    return told | {"source": source, "energy": {"electricity": [pump, fan], "gas": [gas]}, "prices": {"gas": GAS}}
