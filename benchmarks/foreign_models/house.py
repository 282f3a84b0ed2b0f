"""A house of one zone with a heated floor and an air-to-water heat pump."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep
from foreign_models.heat_pump import HeatPump, heat_pump
from foreign_models.water import water_loop

ZONE, PUMP, FLOOR = "HOUSE", "HEAT PUMP", "HEATED FLOOR"
FABRIC = ep.Fabric(wall=0.12, roof=0.20, floor=0.12, glass=(1.3, 0.55), air_changes=0.25)
#: At -16 degC, the coldest hour, it gives 6 kW, about what the house of the table then needs.
MACHINE = HeatPump(capacity=12_000.0, cop=4.2)
CIRCULATOR = 60.0  # W, of the heated floor's pump
#: Share of the people that is in, by hour: out from 7 to 20 h on working days, as in BOPTEST's house.
HOME = [1.0] * 7 + [0.0] * 13 + [1.0] * 4
WEEKEND = [1.0] * 24
#: Own control: setpoints, the lower one from 7 to 16 h on working days [degC], gain [1/K] and reset time [h] of a PI.
SETPOINTS, GAIN, RESET = (21.3, 19.0), 0.6, 6.0
_SPREAD = 4e-8  # m3/s of water per W: 6 K at full capacity
_PIPES = 300.0 / 45.0  # m per m2: at 0.15 m

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
SET leaving = @Min supply 60.0
IF supply < 20.0
  SET leaving = 30.0
ENDIF
"""
_DISPATCH = """
SET share = @CurveValue map leaving outdoor
SET load = speed * flowing * share * {capacity}
"""


@dataclass(frozen=True)
class House:
    """What a house is made of.

    Parameters
    ----------
    fabric : Fabric
        Of the building.
    length, width, height : float
        Inside [m]; 192 m2 as BOPTEST's house with a heat pump.
    south : float
        Glass to the south, of which each other side has a quarter [m2].
    machine : HeatPump
        That heats the floor.
    people, appliances : float
        Number, and heat of appliances that nothing measures [W].
    """

    fabric: ep.Fabric = FABRIC
    length: float = 16.0
    width: float = 12.0
    height: float = 2.7
    south: float = 16.0
    machine: HeatPump = MACHINE
    people: float = 5.0
    appliances: float = 250.0

    @property
    def area(self) -> float:
        """Floor area [m2]."""
        return self.length * self.width

    @property
    def flow(self) -> float:
        """Of the water [m3/s]."""
        return _SPREAD * self.machine.capacity


def house(of: House | None = None) -> Objects:
    """Return the input of a house, by default of the one in the table.

    The compressor's speed is a share of the capacity at hand, the pump is on or off, and both are told by schedules
    that say ``OWN`` unless they are overwritten: then a PI on the operative temperature runs the compressor, and the
    pump with it. The machine's curves see the water that left it in the step before.
    """
    of = of or House()
    model, side = ep.start(of.fabric), of.south / 4.0
    parts: list[Any] = [
        ep.box(ZONE, (0.0, 0.0), (of.length, of.width, of.height),
               {"south": of.south, "east": side, "west": side, "north": side}),
        ep.inside(ZONE, of.fabric, of.area, of.people, "presence", of.appliances),
        heat_pump(PUMP, of.machine, of.flow),
        water_loop(
            "FLOOR LOOP", {"design_flow_rate": of.flow, "design_pump_head": 30_000.0, "motor_efficiency": 0.5,
                           "design_power_consumption": CIRCULATOR, "pump_control_type": "Intermittent",
                           "fraction_of_motor_inefficiencies_to_fluid_stream": 0.5},
            ("HeatPump:PlantLoop:EIR:Heating", PUMP), [("ZoneHVAC:LowTemperatureRadiant:VariableFlow", FLOOR)],
            ("PlantEquipmentOperation:UserDefined", "dispatch"), of.flow,
        ),
        ep.equipment(ZONE, [("ZoneHVAC:LowTemperatureRadiant:VariableFlow", FLOOR)]),
        _floor(of), _control(of),
    ]  # fmt: skip
    for part in parts:
        ep.merge(model, part)
    model["BuildingSurface:Detailed"][f"{ZONE} floor"]["construction_name"] = "heated floor"
    return model


def _floor(of: House) -> Objects:
    layers = [(0.15, 1.6, 2300.0, 1000.0), (of.fabric.floor, 0.035, 30.0, 1400.0), (0.04, 1.4, 2000.0, 1000.0),
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
            "surface_name_or_radiant_surface_group_name": f"{ZONE} floor",
            "hydronic_tubing_length": round(_PIPES * of.area, 1),
            "heating_design_capacity": 20_000.0, "maximum_hot_water_flow": of.flow, "cooling_design_capacity": 0.0,
            "heating_water_inlet_node_name": f"{FLOOR} in", "heating_water_outlet_node_name": f"{FLOOR} out",
            "number_of_circuits": "CalculateFromCircuitLength", "circuit_length": 100.0,
        }},
    }  # fmt: skip


def _control(of: House) -> Objects:
    warm, cool = SETPOINTS
    told = {
        "gain": GAIN, "reset": RESET, "minimum": of.machine.minimum,
        "on": of.machine.minimum + 0.05, "off": of.machine.minimum - 0.1, "capacity": of.machine.capacity,
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


def description(of: House | None = None) -> dict[str, Any]:
    """Return what ``plant.yaml`` says of zones, points and actuators."""
    of = of or House()
    lower = {day: [21.0 if h else 16.0 for h in hours] for day, hours in (("weekday", HOME), ("weekend", WEEKEND))}
    upper = {day: [24.0 if h else 30.0 for h in hours] for day, hours in (("weekday", HOME), ("weekend", WEEKEND))}
    power, circulator = f"{PUMP}, Heat Pump Electricity Rate", "FLOOR LOOP pump, Pump Electricity Rate"
    return {
        "zones": {"house": {
            "temperature": f"{ZONE}, Zone Operative Temperature", "floor_area": of.area,
            "volume": of.area * of.height, "comfort": {"lower": _degrees(lower), "upper": _degrees(upper)},
            "people": {day: [of.people * h for h in hours] for day, hours in (("weekday", HOME), ("weekend", WEEKEND))},
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
                "kind": "modulating", "minimum": of.machine.minimum,
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
