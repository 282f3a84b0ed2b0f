"""An office with a fan coil in each room: hot water of an air-to-water heat pump, chilled water that is bought."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep
from foreign_models.heat_pump import Chiller, HeatPump, heat_pump
from foreign_models.rooms import Rooms
from foreign_models.thermostats import COOLING, clock, comfort, cooling_clock, present, thermostat, thermostat_points
from foreign_models.water import scheduled_loop, supply_water, supply_water_points

FABRIC = ep.Fabric(wall=0.06, roof=0.12, floor=0.06, glass=(1.8, 0.4), air_changes=0.5, goods=3.0)
ROOMS = Rooms(columns=2, rows=2, length=12.0, depth=10.0, height=3.0, glass=(10.0, 8.0))
_CHILLER = "COLD"
PUMP, MACHINE = "HEAT PUMP", HeatPump(capacity=40_000.0, cop=4.0, standing=0.15, minimum=0.2)
#: A coil of 10 kW from water at 45 degC: air [m3/s], water [m3/s], conductance [W/K].
_COIL, _AIR, _WATER, _CONDUCTANCE = 10_000.0, 0.6, 4.5e-4, 850.0
_FAN = (80.0, 0.4)  # Pa and total efficiency [-]: 120 W a coil of 10 kW
_PUMPS = 150.0 / 40_000.0  # W per W of the coils, each
#: Own supply water: 45 degC at -10 degC outdoors, 35 at 15, on a straight line.
RESET = (45.0, -10.0, 35.0, 15.0)
#: Supply water of the data sheets [degC]: fan coils are laid out for it.
_HOT_WATER, _COLD_WATER = RESET[0], 7.0
NOBODY = [False] * 24
_HEAT = "{} heat"  # of a fan coil: negative where it cools
_HOT, _COLD, _UNIT = "Coil:Heating:Water", "Coil:Cooling:Water", "ZoneHVAC:FourPipeFanCoil"


@dataclass(frozen=True)
class Office:
    """What an office is made of.

    Parameters
    ----------
    fabric : Fabric
        Of the building.
    rooms : Rooms
        Sizes and places.
    machine : HeatPump
        That heats the water.
    coil : float
        What each fan coil gives from water at 45 degC [W].
    people, appliances : float
        Of a room, and heat that nothing measures [W].
    hours : tuple of int
        From which and until which people are in on working days.
    chiller : Chiller or None
        That cools the water of an office that is looked at in summer: it is cooled to 24 degC while people are in, and
        its cooling is measured and told. None buys chilled water.
    """

    fabric: ep.Fabric = FABRIC
    rooms: Rooms = ROOMS
    machine: HeatPump = MACHINE
    coil: float = _COIL
    people: float = 8.0
    appliances: float = 250.0
    hours: tuple[int, int] = (8, 18)
    chiller: Chiller | None = None

    @property
    def work(self) -> list[bool]:
        """Whether people are in on working days, by hour."""
        return [self.hours[0] <= hour < self.hours[1] for hour in range(24)]

    @property
    def air(self) -> float:
        """Of a fan [m3/s]."""
        return _AIR * self.coil / _COIL

    @property
    def water(self) -> float:
        """Of a coil [m3/s]."""
        return _WATER * self.coil / _COIL

    @property
    def flow(self) -> float:
        """Of all coils' water [m3/s]."""
        return self.water * len(self.rooms.names)


def office(of: Office | None = None) -> Objects:
    """Return the input of an office, by default of the one in the table."""
    of = of or Office()
    model, listed, cooling = ep.start(of.fabric), of.rooms.names, (COOLING, COOLING)
    if of.chiller is not None:
        cooling = cooling_clock(of.work), cooling_clock(NOBODY)
    for number, zone in enumerate(listed):
        ep.merge(model, of.rooms.box(number))
        ep.merge(model, ep.inside(zone, of.fabric, of.rooms.area, of.people, "presence", of.appliances))
        ep.merge(model, thermostat(zone, clock(of.work), clock(NOBODY), cooling))
        ep.merge(model, ep.equipment(zone, [(_UNIT, f"{zone} fan coil")], f"{zone} unit out", f"{zone} unit in"))
        ep.merge(model, _fan_coil(of, zone))
        if of.chiller is not None:
            ep.merge(model, ep.summed(_HEAT.format(zone), {
                "heating": (f"{zone} fan coil", "Fan Coil Heating Rate", 1.0),
                "cooling": (f"{zone} fan coil", "Fan Coil Sensible Cooling Rate", -1.0),
            }))  # fmt: skip
    ep.merge(model, {
        "Schedule:Compact": {"presence": ep.daily([float(on) for on in of.work], [0.0] * 24)},
        "Schedule:Constant": {"fan cycles": ep.constant(0.0)},
    })  # fmt: skip
    ep.merge(model, heat_pump(PUMP, of.machine, of.flow))
    machine, coils = ("HeatPump:PlantLoop:EIR:Heating", PUMP), (_HOT, "hot coil")
    ep.merge(model, _loop(of, "HOT LOOP", "Heating", machine, coils, 40.0))
    machine = ("DistrictCooling" if of.chiller is None else "HeatPump:PlantLoop:EIR:Cooling", _CHILLER)
    ep.merge(model, _loop(of, "COLD LOOP", "Cooling", machine, (_COLD, "cold coil"), _COLD_WATER))
    ep.merge(model, heat_pump(_CHILLER, of.chiller, of.flow) if of.chiller is not None else {
        "DistrictCooling": {_CHILLER: {
            "chilled_water_inlet_node_name": f"{_CHILLER} in", "chilled_water_outlet_node_name": f"{_CHILLER} out",
            "nominal_capacity": of.coil * len(listed),
        }},
    })  # fmt: skip
    ep.merge(model, supply_water("HOT LOOP", RESET))
    if of.chiller is not None:
        ep.merge(model, supply_water("COLD LOOP", (_COLD_WATER, 0.0, _COLD_WATER, 40.0)))
    return model


def _loop(of: Office, name: str, kind: str, machine: tuple[str, str], coils: tuple[str, str], water: float) -> Objects:
    pump = {"design_flow_rate": of.flow, "design_pump_head": 40_000.0, "motor_efficiency": 0.7,
            "design_power_consumption": _PUMPS * of.coil * len(of.rooms.names),
            "pump_control_type": "Intermittent"}  # fmt: skip
    consumers = [(coils[0], f"{zone} {coils[1]}") for zone in of.rooms.names]
    return scheduled_loop(name, pump, machine, consumers, kind, of.flow, water)


def _fan_coil(of: Office, zone: str) -> Objects:
    hot, cold = f"{zone} hot coil", f"{zone} cold coil"
    return {
        _UNIT: {f"{zone} fan coil": {
            "availability_schedule_name": ep.ALWAYS, "capacity_control_method": "CyclingFan",
            "maximum_supply_air_flow_rate": of.air, "maximum_outdoor_air_flow_rate": 0.0,
            "air_inlet_node_name": f"{zone} unit in", "air_outlet_node_name": f"{zone} unit out",
            "outdoor_air_mixer_object_type": "OutdoorAir:Mixer", "outdoor_air_mixer_name": f"{zone} mixer",
            "supply_air_fan_object_type": "Fan:OnOff", "supply_air_fan_name": f"{zone} fan",
            "supply_air_fan_operating_mode_schedule_name": "fan cycles", "cooling_coil_object_type": _COLD,
            "cooling_coil_name": cold, "heating_coil_object_type": _HOT, "heating_coil_name": hot,
            "maximum_cold_water_flow_rate": of.water, "maximum_hot_water_flow_rate": of.water,
        }},
        "Fan:OnOff": {f"{zone} fan": {
            "availability_schedule_name": ep.ALWAYS, "fan_total_efficiency": _FAN[1], "pressure_rise": _FAN[0],
            "maximum_flow_rate": of.air, "air_inlet_node_name": f"{zone} mixed",
            "air_outlet_node_name": f"{zone} fan out",
        }},
        # EnergyPlus wants a mixer; outdoor air comes through leaks
        "OutdoorAir:Mixer": {f"{zone} mixer": {
            "mixed_air_node_name": f"{zone} mixed", "outdoor_air_stream_node_name": f"{zone} outdoor",
            "relief_air_stream_node_name": f"{zone} relief", "return_air_stream_node_name": f"{zone} unit in",
        }},
        "OutdoorAir:Node": {f"{zone} outdoor": {}},
        _COLD: {cold: {
            "availability_schedule_name": ep.ALWAYS, "design_water_flow_rate": of.water, "design_air_flow_rate": of.air,
            "design_inlet_water_temperature": 7.0, "design_inlet_air_temperature": 26.0,
            "design_outlet_air_temperature": 14.0, "design_inlet_air_humidity_ratio": 0.0105,
            "design_outlet_air_humidity_ratio": 0.0092, "water_inlet_node_name": f"{cold} in",
            "water_outlet_node_name": f"{cold} out", "air_inlet_node_name": f"{zone} fan out",
            "air_outlet_node_name": f"{cold} air",
        }},
        _HOT: {hot: {
            "availability_schedule_name": ep.ALWAYS, "u_factor_times_area_value": _CONDUCTANCE * of.coil / _COIL,
            "maximum_water_flow_rate": of.water, "water_inlet_node_name": f"{hot} in",
            "water_outlet_node_name": f"{hot} out", "air_inlet_node_name": f"{cold} air",
            "air_outlet_node_name": f"{zone} unit out",
        }},
    }  # fmt: skip


def description(of: Office | None = None) -> dict[str, Any]:
    """Return what ``plant.yaml`` says of zones, points and actuators."""
    of = of or Office()
    power, pump = f"{PUMP}, Heat Pump Electricity Rate", "HOT LOOP pump, Pump Electricity Rate"
    told: dict[str, Any] = {"zones": {}, "measurements": {}, "actuators": {}}
    electricity = [power, pump, "COLD LOOP pump, Pump Electricity Rate"]
    for zone in of.rooms.names:
        name, fan = zone.lower(), f"{zone} fan, Fan Electricity Rate"
        told["zones"][name] = {
            "temperature": f"{zone}, Zone Mean Air Temperature", "floor_area": of.rooms.area,
            "volume": of.rooms.area * of.rooms.height, "comfort": comfort(of.work, NOBODY),
            "people": present(of.people, of.work, NOBODY),
        }  # fmt: skip
        measured, acted = thermostat_points(zone, name, cooled=of.chiller is not None)
        heat = f"{zone} fan coil, Fan Coil Heating Rate" if of.chiller is None else f"EMS, {_HEAT.format(zone)}"
        told["measurements"] |= measured | {
            f"{name}/heating_power_sensor": heat,
            f"{name}/supply_fan_power_sensor": fan,
        }
        told["actuators"] |= acted
        electricity.append(fan)
    if of.chiller is not None:
        electricity.append(f"{_CHILLER}, Heat Pump Electricity Rate")
    measured, acted = supply_water_points(PUMP, "heat_pump", "HOT LOOP", "30 degC", "50 degC")
    told["measurements"] |= measured | {
        "heat_pump/electrical_power_sensor": power,
        "heat_pump/heating_power_sensor": f"{PUMP}, Heat Pump Load Side Heat Transfer Rate",
    }
    told["actuators"] |= acted
    source = {"heating": of.machine.sheet(_HOT_WATER), "heating_water": "heat_pump/supply_water_temperature_setpoint"}
    if of.chiller is not None:
        measured, acted = supply_water_points(_CHILLER, "chiller", "COLD LOOP", "7 degC", "15 degC", "chilled_water")
        told["measurements"], told["actuators"] = told["measurements"] | measured, told["actuators"] | acted
        source |= {
            "cooling": of.chiller.sheet(_COLD_WATER), "cooling_water": "chiller/supply_water_temperature_setpoint",
        }  # fmt: skip
    return told | {"source": source, "energy": {"electricity": electricity}}
