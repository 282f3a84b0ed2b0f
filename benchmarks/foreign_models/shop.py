"""A shop with a unitary heat pump: direct expansion, one speed, electric resistance where it is not enough."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from energyplus_trials.frame import Objects

from foreign_models import objects as ep
from foreign_models.thermostats import COOLING, clock, comfort, cooling_clock, present, thermostat, thermostat_points
from mpc.adapters.energyplus.input import InputFile, building_path, read_input

ZONE, UNIT = "SHOP", "HEAT PUMP"
FABRIC = ep.Fabric(wall=0.06, roof=0.10, floor=0.05, glass=(2.2, 0.45), air_changes=0.5, heavy=False, goods=3.0)
_LET_IN = -5.0  # degC, outdoor air up to which the resistance is let in
_FAN = (250.0, 0.5)  # Pa, and total efficiency [-]: 600 W at 1.2 m3/s
_FLOW = 0.05  # m3/s of air per kW: usual of packaged units
#: Whose compressor curves the unit has.
SOURCE = "ASHRAE901_OfficeSmall_STD2019_Denver"
_HEAT = "SHOP heat"  # of the unit: negative where it cools
_HEATING, _COOLING = "Coil:Heating:DX:SingleSpeed", "Coil:Cooling:DX:SingleSpeed"


@dataclass(frozen=True)
class Shop:
    """What a shop is made of.

    Parameters
    ----------
    fabric : Fabric
        Of the building.
    length, depth, height : float
        Inside [m].
    glass : float
        To the south [m2].
    people, appliances : float
        Customers and staff, and heat of lights and tills that nothing measures [W].
    capacity, resistance : float
        Of the compressor, heating at 8.3 degC outdoors and cooling at 35, and of what is let in below `_LET_IN` [W].
    cooled : bool
        Whether it is looked at in summer: cooled to 24 degC while it is open, and its cooling is measured and told.
    opens : tuple of int
        Hours from which and until which it is open on working days; at week-ends from an hour later to two earlier.
    """

    fabric: ep.Fabric = FABRIC
    length: float = 18.0
    depth: float = 12.0
    height: float = 3.6
    glass: float = 22.0
    people: float = 8.0
    appliances: float = 600.0
    capacity: float = 24_000.0
    resistance: float = 8_000.0
    opens: tuple[int, int] = (8, 20)
    cooled: bool = False

    @property
    def air(self) -> float:
        """Of the fan [m3/s]."""
        return _FLOW * self.capacity / 1e3

    @property
    def area(self) -> float:
        """Floor area [m2]."""
        return self.length * self.depth

    @property
    def weekday(self) -> list[bool]:
        """Whether it is open on working days, by hour."""
        return [self.opens[0] <= hour < self.opens[1] for hour in range(24)]

    @property
    def weekend(self) -> list[bool]:
        """Whether it is open at week-ends, by hour."""
        return [self.opens[0] + 1 <= hour < self.opens[1] - 2 for hour in range(24)]


def shop(of: Shop | None = None) -> Objects:
    """Return the input of a shop, by default of the one in the table."""
    of = of or Shop()
    model, cooling = ep.start(of.fabric), (COOLING, COOLING)
    if of.cooled:
        cooling = cooling_clock(of.weekday), cooling_clock(of.weekend)
    parts: list[Any] = [
        ep.box(ZONE, (0.0, 0.0), (of.length, of.depth, of.height), {"south": of.glass}, {"east": "", "west": ""}),
        ep.inside(ZONE, of.fabric, of.area, of.people, "presence", of.appliances),
        thermostat(ZONE, clock(of.weekday), clock(of.weekend), cooling),
        ep.equipment(ZONE, [("AirLoopHVAC:UnitarySystem", UNIT)], f"{UNIT} out", f"{UNIT} in"),
        {"Schedule:Compact": {"presence": ep.daily([float(h) for h in of.weekday], [float(h) for h in of.weekend])}},
        _unit(of), *_coils(of),
        ep.summed(_HEAT, {kind: (UNIT, f"Unitary System Sensible {kind.title()} Rate", sign)
                          for kind, sign in (("heating", 1.0), ("cooling", -1.0))}),
    ]  # fmt: skip
    for part in parts:
        ep.merge(model, part)
    return model


def _unit(of: Shop) -> Objects:
    flows: dict[str, Any] = {}
    for mode in ("heating", "cooling"):
        flows |= {f"{mode}_supply_air_flow_rate": of.air, f"{mode}_supply_air_flow_rate_method": "SupplyAirFlowRate"}
    return {
        "AirLoopHVAC:UnitarySystem": {UNIT: {
            "control_type": "Load", "controlling_zone_or_thermostat_location": ZONE,
            "air_inlet_node_name": f"{UNIT} in", "air_outlet_node_name": f"{UNIT} out",
            "availability_schedule_name": ep.ALWAYS,
            "supply_fan_object_type": "Fan:OnOff", "supply_fan_name": f"{UNIT} fan", "fan_placement": "BlowThrough",
            "supply_air_fan_operating_mode_schedule_name": "fan cycles", "heating_coil_object_type": _HEATING,
            "heating_coil_name": f"{UNIT} heating", "cooling_coil_object_type": _COOLING,
            "cooling_coil_name": f"{UNIT} cooling", "supplemental_heating_coil_object_type": "Coil:Heating:Electric",
            "supplemental_heating_coil_name": f"{UNIT} resistance", **flows,
            "no_load_supply_air_flow_rate_method": "SupplyAirFlowRate", "no_load_supply_air_flow_rate": 0.0,
            "maximum_supply_air_temperature": 45.0,
            "maximum_outdoor_dry_bulb_temperature_for_supplemental_heater_operation": _LET_IN,
        }},
        "Schedule:Constant": {"fan cycles": ep.constant(0.0)},
        "Fan:OnOff": {f"{UNIT} fan": {
            "availability_schedule_name": ep.ALWAYS, "fan_total_efficiency": _FAN[1], "pressure_rise": _FAN[0],
            "maximum_flow_rate": of.air, "air_inlet_node_name": f"{UNIT} in", "air_outlet_node_name": f"{UNIT} fan out",
        }},
        "Coil:Heating:Electric": {f"{UNIT} resistance": {
            "nominal_capacity": of.resistance, "air_inlet_node_name": f"{UNIT} heating out",
            "air_outlet_node_name": f"{UNIT} out",
        }},
        "OutdoorAir:Node": {f"{UNIT} outdoor": {}},
    }  # fmt: skip


def _coils(of: Shop) -> list[Objects]:
    """Coils of a reference building's unit at our size, with all their curves."""
    source = read_input(building_path(SOURCE))
    sizes = {
        _HEATING: {"gross_rated_heating_capacity": of.capacity, "rated_air_flow_rate": of.air,
                   "air_inlet_node_name": f"{UNIT} cooling out", "air_outlet_node_name": f"{UNIT} heating out",
                   "resistive_defrost_heater_capacity": 0.0},
        _COOLING: {"gross_rated_total_cooling_capacity": of.capacity, "gross_rated_sensible_heat_ratio": 0.75,
                   "rated_air_flow_rate": of.air, "air_inlet_node_name": f"{UNIT} fan out",
                   "air_outlet_node_name": f"{UNIT} cooling out", "condenser_air_inlet_node_name": f"{UNIT} outdoor"},
    }  # fmt: skip
    found = []
    for kind, mine in sizes.items():
        fields = next(iter(source.of_type(kind).values()))
        found += [_curve(source, str(name)) for key, name in fields.items() if key.endswith("curve_name")]
        title = f"{UNIT} heating" if kind == _HEATING else f"{UNIT} cooling"
        found.append({kind: {title: {**fields, **mine, "availability_schedule_name": ep.ALWAYS}}})
    return found


def _curve(source: InputFile, name: str) -> Objects:
    kind, title, fields = next(each for each in source.begins("Curve:") if each[1].lower() == name.lower())
    return {kind: {title: dict(fields)}}


def data_sheet(of: Shop) -> list[list[float | str]]:
    """Return the most heat over outdoor air, as a maker says it [degC, W]: compressor, and resistance below -5 degC."""
    source = read_input(building_path(SOURCE))
    coil = next(iter(source.of_type(_HEATING).values()))
    stops = float(coil["minimum_outdoor_dry_bulb_temperature_for_compressor_operation"])
    curve = next(iter(_curve(source, coil["heating_capacity_function_of_temperature_curve_name"]).values()))
    fields = next(iter(curve.values()))
    terms = [fields[f"coefficient{name}"] for name in ("1_constant", "2_x", "3_x_2", "4_x_3")]
    just = 0.1  # K beside an edge
    found: list[list[float | str]] = []
    for outdoor in (-20.0, stops - just, stops, -10.0, _LET_IN, _LET_IN + just, 0.0, 7.0, 20.0):
        compressor = of.capacity * sum(c * outdoor**k for k, c in enumerate(terms)) if outdoor >= stops else 0.0
        found.append([f"{outdoor:g} degC", round(compressor + of.resistance * (outdoor <= _LET_IN), -2)])
    return found


def description(of: Shop | None = None) -> dict[str, Any]:
    """Return what ``plant.yaml`` says of zones, points and actuators."""
    of = of or Shop()
    measured, acted = thermostat_points(ZONE, "shop", cooled=of.cooled)
    heat = f"EMS, {_HEAT}" if of.cooled else f"{UNIT}, Unitary System Total Heating Rate"
    power = [f"{UNIT}, Unitary System Electricity Rate"]
    return {
        "zones": {"shop": {
            "temperature": f"{ZONE}, Zone Mean Air Temperature", "floor_area": of.area,
            "volume": of.area * of.height, "comfort": comfort(of.weekday, of.weekend),
            "people": present(of.people, of.weekday, of.weekend),
        }},
        "measurements": measured | {
            "heat_pump/electrical_power_sensor": power[0],
            "heat_pump/supply_fan_power_sensor": f"{UNIT} fan, Fan Electricity Rate",
            "heat_pump/heating_power_sensor": heat,
            "heat_pump/supply_air_temperature_sensor": f"{UNIT} out, System Node Temperature",
        },
        "actuators": {name: entry if of.cooled else entry | {"capacity": data_sheet(of)}
                      for name, entry in acted.items()},
        "energy": {"electricity": power},
    }  # fmt: skip
