"""An office of four zones with fan coils: hot water of an air-to-water heat pump, chilled water that is bought."""

from __future__ import annotations

from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep
from foreign_models.heat_pump import HeatPump, heat_pump
from foreign_models.thermostats import clock, comfort, present, thermostat, thermostat_points
from foreign_models.water import water_loop

FABRIC = ep.Fabric(wall=0.06, roof=0.12, floor=0.06, glass=(1.8, 0.4), air_changes=0.5, goods=3.0)
LENGTH, DEPTH, HEIGHT = 12.0, 10.0, 3.0  # m, of each of the four
#: South-west corner in lengths and depths, and the sides that are glazed [m2].
ZONES: dict[str, tuple[tuple[int, int], dict[str, float]]] = {
    "SOUTHWEST": ((0, 0), {"south": 10.0, "west": 8.0}), "SOUTHEAST": ((1, 0), {"south": 10.0, "east": 8.0}),
    "NORTHWEST": ((0, 1), {"north": 10.0, "west": 8.0}), "NORTHEAST": ((1, 1), {"north": 10.0, "east": 8.0}),
}  # fmt: skip
PEOPLE, APPLIANCES = 8.0, 250.0  # of a zone, and heat that nothing measures [W]
PUMP, MACHINE = "HEAT PUMP", HeatPump(capacity=40_000.0, cop=4.0, standing=0.15, minimum=0.2)
#: Of each coil: air [m3/s], water [m3/s], conductance [W/K]; 10 kW from water at 45 degC.
AIR, WATER, CONDUCTANCE = 0.6, 4.5e-4, 850.0
_FAN = (80.0, 0.4)  # Pa and total efficiency [-]: 120 W a coil
_PUMPS = 150.0  # W, each
#: Own supply water: 45 degC at -10 degC outdoors, 35 at 15, on a straight line.
RESET = (45.0, -10.0, 35.0, 15.0)
WORK = [8 <= hour < 18 for hour in range(24)]
NOBODY = [False] * 24
_HOT, _COLD, _UNIT = "Coil:Heating:Water", "Coil:Cooling:Water", "ZoneHVAC:FourPipeFanCoil"
_RESET = """
SET wanted_water = {at_zero} - {slope} * outdoor
SET wanted_water = @Min wanted_water {warmest}
SET wanted_water = @Max wanted_water {coolest}
IF told_water > 0.0
  SET wanted_water = told_water
ENDIF
"""


def office() -> Objects:
    """Return the office's input."""
    model, beside = ep.start(FABRIC), {"east": (1, 0), "west": (-1, 0), "north": (0, 1), "south": (0, -1)}
    by_place = {place: zone for zone, (place, _) in ZONES.items()}
    for zone, ((i, k), glass) in ZONES.items():
        behind = {side: by_place[i + a, k + b] for side, (a, b) in beside.items() if (i + a, k + b) in by_place}
        ep.merge(model, ep.box(zone, (i * LENGTH, k * DEPTH), (LENGTH, DEPTH, HEIGHT), glass, behind))
        ep.merge(model, ep.inside(zone, FABRIC, LENGTH * DEPTH, PEOPLE, "presence", APPLIANCES))
        ep.merge(model, thermostat(zone, clock(WORK), clock(NOBODY), cooled=True))
        ep.merge(model, ep.equipment(zone, [(_UNIT, f"{zone} fan coil")], f"{zone} unit out", f"{zone} unit in"))
        ep.merge(model, _fan_coil(zone))
    ep.merge(model, {
        "Schedule:Compact": {"presence": ep.daily([float(on) for on in WORK], [0.0] * 24)},
        "Schedule:Constant": {"fan cycles": ep.constant(0.0)},
    })  # fmt: skip
    ep.merge(model, heat_pump(PUMP, MACHINE, WATER * len(ZONES)))
    ep.merge(model, _loop("HOT LOOP", "Heating", ("HeatPump:PlantLoop:EIR:Heating", PUMP), (_HOT, "hot coil"), 40.0))
    ep.merge(model, _loop("COLD LOOP", "Cooling", ("DistrictCooling", "COLD"), (_COLD, "cold coil"), 7.0))
    ep.merge(model, {"DistrictCooling": {"COLD": {
        "chilled_water_inlet_node_name": "COLD in", "chilled_water_outlet_node_name": "COLD out",
        "nominal_capacity": 40_000.0,
    }}})  # fmt: skip
    ep.merge(model, _water())
    return model


def _loop(name: str, kind: str, machine: tuple[str, str], coils: tuple[str, str], water: float) -> Objects:
    flow = WATER * len(ZONES)
    pump = {"design_flow_rate": flow, "design_pump_head": 40_000.0, "motor_efficiency": 0.7,
            "design_power_consumption": _PUMPS, "pump_control_type": "Intermittent"}  # fmt: skip
    consumers = [(coils[0], f"{zone} {coils[1]}") for zone in ZONES]
    scheme = f"PlantEquipmentOperation:{kind}Load"
    found = water_loop(name, pump, machine, consumers, (scheme, f"{name} load"), flow)
    ep.merge(found, {
        scheme: {f"{name} load": {
            "load_range_1_lower_limit": 0.0, "load_range_1_upper_limit": 1e9,
            "range_1_equipment_list_name": f"{name} machines",
        }},
        "PlantEquipmentList": {f"{name} machines": {
            "equipment": [{"equipment_object_type": machine[0], "equipment_name": machine[1]}]
        }},
        "Schedule:Constant": {f"{name} water": ep.constant(water)},
        "SetpointManager:Scheduled": {f"{name} setpoint": {
            "control_variable": "Temperature", "schedule_name": f"{name} water",
            "setpoint_node_or_nodelist_name": f"{name} supply out",
        }},
    })  # fmt: skip
    return found


def _fan_coil(zone: str) -> Objects:
    hot, cold = f"{zone} hot coil", f"{zone} cold coil"
    return {
        _UNIT: {f"{zone} fan coil": {
            "availability_schedule_name": ep.ALWAYS, "capacity_control_method": "CyclingFan",
            "maximum_supply_air_flow_rate": AIR, "maximum_outdoor_air_flow_rate": 0.0,
            "air_inlet_node_name": f"{zone} unit in", "air_outlet_node_name": f"{zone} unit out",
            "outdoor_air_mixer_object_type": "OutdoorAir:Mixer", "outdoor_air_mixer_name": f"{zone} mixer",
            "supply_air_fan_object_type": "Fan:OnOff", "supply_air_fan_name": f"{zone} fan",
            "supply_air_fan_operating_mode_schedule_name": "fan cycles", "cooling_coil_object_type": _COLD,
            "cooling_coil_name": cold, "heating_coil_object_type": _HOT, "heating_coil_name": hot,
            "maximum_cold_water_flow_rate": WATER, "maximum_hot_water_flow_rate": WATER,
        }},
        "Fan:OnOff": {f"{zone} fan": {
            "availability_schedule_name": ep.ALWAYS, "fan_total_efficiency": _FAN[1], "pressure_rise": _FAN[0],
            "maximum_flow_rate": AIR, "air_inlet_node_name": f"{zone} mixed", "air_outlet_node_name": f"{zone} fan out",
        }},
        # EnergyPlus wants a mixer; outdoor air comes through leaks
        "OutdoorAir:Mixer": {f"{zone} mixer": {
            "mixed_air_node_name": f"{zone} mixed", "outdoor_air_stream_node_name": f"{zone} outdoor",
            "relief_air_stream_node_name": f"{zone} relief", "return_air_stream_node_name": f"{zone} unit in",
        }},
        "OutdoorAir:Node": {f"{zone} outdoor": {}},
        _COLD: {cold: {
            "availability_schedule_name": ep.ALWAYS, "design_water_flow_rate": WATER, "design_air_flow_rate": AIR,
            "design_inlet_water_temperature": 7.0, "design_inlet_air_temperature": 26.0,
            "design_outlet_air_temperature": 14.0, "design_inlet_air_humidity_ratio": 0.0105,
            "design_outlet_air_humidity_ratio": 0.0092, "water_inlet_node_name": f"{cold} in",
            "water_outlet_node_name": f"{cold} out", "air_inlet_node_name": f"{zone} fan out",
            "air_outlet_node_name": f"{cold} air",
        }},
        _HOT: {hot: {
            "availability_schedule_name": ep.ALWAYS, "u_factor_times_area_value": CONDUCTANCE,
            "maximum_water_flow_rate": WATER, "water_inlet_node_name": f"{hot} in",
            "water_outlet_node_name": f"{hot} out", "air_inlet_node_name": f"{cold} air",
            "air_outlet_node_name": f"{zone} unit out",
        }},
    }  # fmt: skip


def _water() -> Objects:
    """Supply water by the outdoor temperature unless it is told."""
    found: Objects = {"Schedule:Constant": {"SUPPLY WATER": ep.constant(ep.OWN)}}
    ep.merge(found, ep.sensors({
        "outdoor": ("Environment", "Site Outdoor Air Drybulb Temperature"),
        "told_water": ("SUPPLY WATER", "Schedule Value"),
    }))  # fmt: skip
    ep.merge(found, ep.actuators({"wanted_water": ("HOT LOOP water", "Schedule:Constant", "Schedule Value")}))
    warmest, cold, coolest, mild = RESET
    slope = (warmest - coolest) / (mild - cold)
    line = {"warmest": warmest, "coolest": coolest, "slope": slope, "at_zero": warmest + slope * cold}
    ep.merge(found, ep.program("supply_water", _RESET.format(**line)))
    return found


def description() -> dict[str, Any]:
    """Return what ``plant.yaml`` says of zones, points and actuators."""
    power, pump = f"{PUMP}, Heat Pump Electricity Rate", "HOT LOOP pump, Pump Electricity Rate"
    told: dict[str, Any] = {"zones": {}, "measurements": {}, "actuators": {}}
    electricity = [power, pump, "COLD LOOP pump, Pump Electricity Rate"]
    for zone in ZONES:
        name, fan = zone.lower(), f"{zone} fan, Fan Electricity Rate"
        told["zones"][name] = {
            "temperature": f"{zone}, Zone Mean Air Temperature", "floor_area": LENGTH * DEPTH,
            "volume": LENGTH * DEPTH * HEIGHT, "comfort": comfort(WORK, NOBODY),
            "people": present(PEOPLE, WORK, NOBODY),
        }  # fmt: skip
        measured, acted = thermostat_points(zone, name)
        told["measurements"] |= measured | {
            f"{name}/heating_power_sensor": f"{zone} fan coil, Fan Coil Heating Rate",
            f"{name}/supply_fan_power_sensor": fan,
        }
        told["actuators"] |= acted
        electricity.append(fan)
    setpoint = "heat_pump/supply_water_temperature_setpoint"
    told["measurements"] |= {
        "heat_pump/electrical_power_sensor": power, "hot_water/pump_power_sensor": pump,
        "heat_pump/heating_power_sensor": f"{PUMP}, Heat Pump Load Side Heat Transfer Rate",
        "heat_pump/supply_water_temperature_sensor": f"{PUMP} out, System Node Temperature",
        "heat_pump/return_water_temperature_sensor": f"{PUMP} in, System Node Temperature",
        setpoint: "HOT LOOP water, Schedule Value",
    }  # fmt: skip
    told["actuators"][setpoint] = {
        "signal": "SUPPLY WATER, Schedule:Constant, Schedule Value", "range": ["30 degC", "50 degC"],
    }  # fmt: skip
    return told | {"energy": {"electricity": electricity}}
