"""A house of one zone with a heated floor and an air-to-water heat pump."""

from __future__ import annotations

from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep
from foreign_models.heat_pump import HeatPump, heat_pump
from foreign_models.water import water_loop

ZONE, PUMP, FLOOR = "HOUSE", "HEAT PUMP", "HEATED FLOOR"
LENGTH, WIDTH, HEIGHT = 16.0, 12.0, 2.7  # m: 192 m2, as BOPTEST's house with a heat pump
FABRIC = ep.Fabric(wall=0.12, roof=0.20, floor=0.12, glass=(1.3, 0.55), air_changes=0.25)
#: At -16 degC, the coldest hour, it gives 6 kW, about what the house then needs.
MACHINE = HeatPump(capacity=12_000.0, cop=4.2)
FLOW = 4.8e-4  # m3/s: 6 K of spread at full capacity
CIRCULATOR = 60.0  # W, of the heated floor's pump
PEOPLE, APPLIANCES = 5.0, 250.0  # W of appliances that nothing measures
#: Share of the people that is in, by hour: out from 7 to 20 h on working days, as in BOPTEST's house.
HOME = [1.0] * 7 + [0.0] * 13 + [1.0] * 4
WEEKEND = [1.0] * 24
#: Own control: setpoints, the lower one from 7 to 16 h on working days [degC], gain [1/K] and reset time [h] of a PI.
SETPOINTS, GAIN, RESET = (21.3, 19.0), 0.6, 6.0
_PIPES = 300.0 * LENGTH * WIDTH / 45.0  # m: at 0.15 m

_CONTROL = """
SET lack = wanted - room
SET y = {gain} * lack + total
IF y < 1.0 && y > 0.0
  SET total = total + {gain} * lack * ZoneTimeStep / {reset}
ELSEIF y >= 1.0 && lack < 0.0
  SET total = total + {gain} * lack * ZoneTimeStep / {reset}
ELSEIF y <= 0.0 && lack > 0.0
  SET total = total + {gain} * lack * ZoneTimeStep / {reset}
ENDIF
IF y > {on}
  SET running = 1.0
ELSEIF y < {off}
  SET running = 0.0
ENDIF
SET speed = @Max y {minimum}
SET speed = @Min speed 1.0
SET speed = speed * running
IF speed_told >= 0.0
  SET speed = speed_told
ENDIF
SET flowing = 0.0
IF speed > 0.0
  SET flowing = 1.0
ENDIF
IF pump_told >= 0.0
  SET flowing = pump_told
ENDIF
SET valve = 120.0 * flowing - 60.0
SET leaving = @Max supply 20.0
SET leaving = @Min leaving 60.0
"""
_DISPATCH = """
SET share = @CurveValue map leaving outdoor
SET load = speed * flowing * share * {capacity}
"""


def house() -> Objects:
    """Return the house's input.

    The compressor's speed is a share of the capacity at hand, the pump is on or off, and both are told by schedules
    that say ``OWN`` unless they are overwritten: then a PI on the operative temperature runs the compressor, and the
    pump with it. The machine's curves see the water that left it in the step before.
    """
    model = ep.start(FABRIC)
    area = LENGTH * WIDTH
    parts: list[Any] = [
        ep.box(ZONE, (0.0, 0.0), (LENGTH, WIDTH, HEIGHT), {"south": 16.0, "east": 4.0, "west": 4.0, "north": 4.0}),
        ep.inside(ZONE, FABRIC, area, PEOPLE, "presence", APPLIANCES),
        heat_pump(PUMP, MACHINE, FLOW),
        water_loop(
            "FLOOR LOOP", {"design_flow_rate": FLOW, "design_pump_head": 30_000.0, "motor_efficiency": 0.5,
                           "design_power_consumption": CIRCULATOR, "pump_control_type": "Intermittent",
                           "fraction_of_motor_inefficiencies_to_fluid_stream": 0.5},
            ("HeatPump:PlantLoop:EIR:Heating", PUMP), [("ZoneHVAC:LowTemperatureRadiant:VariableFlow", FLOOR)],
            ("PlantEquipmentOperation:UserDefined", "dispatch"), FLOW,
        ),
        ep.equipment(ZONE, [("ZoneHVAC:LowTemperatureRadiant:VariableFlow", FLOOR)]),
        _floor(), _control(),
    ]  # fmt: skip
    for part in parts:
        ep.merge(model, part)
    model["BuildingSurface:Detailed"][f"{ZONE} floor"]["construction_name"] = "heated floor"
    return model


def _floor() -> Objects:
    layers = [(0.15, 1.6, 2300.0, 1000.0), (FABRIC.floor, 0.035, 30.0, 1400.0), (0.04, 1.4, 2000.0, 1000.0),
              (0.04, 1.4, 2000.0, 1000.0), (0.012, 1.0, 2000.0, 800.0)]  # fmt: skip
    return ep.construction("heated floor", layers) | {
        "ConstructionProperty:InternalHeatSource": {"pipes": {
            "construction_name": "heated floor", "thermal_source_present_after_layer_number": 3,
            "temperature_calculation_requested_after_layer_number": 3, "dimensions_for_the_ctf_calculation": 1,
            "tube_spacing": 0.15,
        }},
        "ZoneHVAC:LowTemperatureRadiant:VariableFlow:Design": {"floor design": {
            "temperature_control_type": "MeanAirTemperature", "heating_design_capacity_method": "HeatingDesignCapacity",
            "heating_control_throttling_range": 0.5, "heating_control_temperature_schedule_name": "floor valve",
            "cooling_design_capacity_method": "CoolingDesignCapacity", "condensation_control_type": "Off",
        }},
        "ZoneHVAC:LowTemperatureRadiant:VariableFlow": {FLOOR: {
            "design_object": "floor design", "availability_schedule_name": ep.ALWAYS, "zone_name": ZONE,
            "surface_name_or_radiant_surface_group_name": f"{ZONE} floor", "hydronic_tubing_length": round(_PIPES, 1),
            "heating_design_capacity": 20_000.0, "maximum_hot_water_flow": FLOW, "cooling_design_capacity": 0.0,
            "heating_water_inlet_node_name": f"{FLOOR} in", "heating_water_outlet_node_name": f"{FLOOR} out",
            "number_of_circuits": "CalculateFromCircuitLength", "circuit_length": 100.0,
        }},
    }  # fmt: skip


def _control() -> Objects:
    warm, cool = SETPOINTS
    told = {
        "gain": GAIN, "reset": RESET, "minimum": MACHINE.minimum, "on": MACHINE.minimum + 0.05,
        "off": MACHINE.minimum - 0.1, "capacity": MACHINE.capacity,
    }  # fmt: skip
    found: Objects = {
        "Schedule:Constant": {
            "COMPRESSOR SPEED": ep.constant(ep.OWN), "PUMP STATE": ep.constant(ep.OWN),
            "floor valve": ep.constant(-60.0), "supply setpoint": ep.constant(40.0),
        },
        "Schedule:Compact": {
            "presence": ep.daily(HOME, WEEKEND),
            "HEATING SETPOINT": ep.daily([warm] * 7 + [cool] * 9 + [warm] * 8, [warm] * 24),
        },
        "SetpointManager:Scheduled": {"supply": {
            "control_variable": "Temperature", "schedule_name": "supply setpoint",
            "setpoint_node_or_nodelist_name": "FLOOR LOOP supply out",
        }},
        "PlantEquipmentOperation:UserDefined": {"dispatch": {
            "main_model_program_calling_manager_name": "dispatching call",
            "equipment_1_object_type": "HeatPump:PlantLoop:EIR:Heating", "equipment_1_name": PUMP,
        }},
        "EnergyManagementSystem:GlobalVariable": {"kept": {"variables": [
            {"erl_variable_name": name} for name in ("total", "running", "speed", "flowing")
        ]}},
        "EnergyManagementSystem:CurveOrTableIndexVariable": {
            "map": {"curve_or_table_object_name": f"{PUMP} capacity"}
        },
    }  # fmt: skip
    ep.merge(found, ep.sensors({
        "room": (ZONE, "Zone Operative Temperature"), "wanted": ("HEATING SETPOINT", "Schedule Value"),
        "speed_told": ("COMPRESSOR SPEED", "Schedule Value"), "pump_told": ("PUMP STATE", "Schedule Value"),
        "supply": (f"{PUMP} out", "System Node Temperature"),
        "outdoor": ("Environment", "Site Outdoor Air Drybulb Temperature"),
    }))  # fmt: skip
    ep.merge(found, ep.actuators({
        "valve": ("floor valve", "Schedule:Constant", "Schedule Value"),
        "leaving": ("supply setpoint", "Schedule:Constant", "Schedule Value"),
        "load": (f"dispatch:{PUMP}", "Plant Equipment Operation", "Distributed Load Rate"),
    }))  # fmt: skip
    begin = "SET total = 0.0\nSET running = 0.0\nSET speed = 0.0\nSET flowing = 0.0"
    ep.merge(found, ep.program("beginning", begin, "BeginNewEnvironment"))
    ep.merge(found, ep.program("control", _CONTROL.format(**told)))
    ep.merge(found, ep.program("dispatching", _DISPATCH.format(**told), "UserDefinedComponentModel"))
    return found


def description() -> dict[str, Any]:
    """Return what ``plant.yaml`` says of zones, points and actuators."""
    lower = {day: [21.0 if h else 16.0 for h in hours] for day, hours in (("weekday", HOME), ("weekend", WEEKEND))}
    upper = {day: [24.0 if h else 30.0 for h in hours] for day, hours in (("weekday", HOME), ("weekend", WEEKEND))}
    power, circulator = f"{PUMP}, Heat Pump Electricity Rate", "FLOOR LOOP pump, Pump Electricity Rate"
    return {
        "zones": {"house": {
            "temperature": f"{ZONE}, Zone Operative Temperature", "floor_area": LENGTH * WIDTH,
            "volume": LENGTH * WIDTH * HEIGHT, "comfort": {"lower": _degrees(lower), "upper": _degrees(upper)},
            "people": {day: [PEOPLE * h for h in hours] for day, hours in (("weekday", HOME), ("weekend", WEEKEND))},
        }},
        "measurements": {
            "house/zone_air_temperature_sensor": f"{ZONE}, Zone Operative Temperature",
            "house/zone_air_heating_temperature_setpoint": "HEATING SETPOINT, Schedule Value",
            "heat_pump/electrical_power_sensor": power,
            "heat_pump/heating_power_sensor": f"{PUMP}, Heat Pump Load Side Heat Transfer Rate",
            "heat_pump/supply_water_temperature_sensor": f"{PUMP} out, System Node Temperature",
            "heat_pump/return_water_temperature_sensor": f"{PUMP} in, System Node Temperature",
            "floor/pump_power_sensor": circulator,
            "floor/heating_power_sensor": f"{FLOOR}, Zone Radiant HVAC Heating Rate",
        },
        "actuators": {
            "heat_pump/compressor_speed": {
                "signal": "COMPRESSOR SPEED, Schedule:Constant, Schedule Value", "range": [0.0, 1.0],
                "kind": "modulating", "minimum": MACHINE.minimum,
            },
            "floor/pump": {
                "signal": "PUMP STATE, Schedule:Constant, Schedule Value", "range": [0.0, 1.0], "kind": "on_off",
            },
            "house/zone_air_heating_temperature_setpoint": {
                "signal": "HEATING SETPOINT, Schedule:Compact, Schedule Value", "range": ["12 degC", "30 degC"],
            },
        },
        "energy": {"electricity": [power, circulator]},
    }  # fmt: skip


def _degrees(hours: dict[str, list[float]]) -> dict[str, list[str]]:
    return {day: [f"{value:g} degC" for value in values] for day, values in hours.items()}
