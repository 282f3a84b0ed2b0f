"""Components in zones beside EnergyPlus' for `components_energyplus`: heater, fan coil, unitary, ventilator.

Each stands in a box of its own. Ours get EnergyPlus' zone air, its weather, water temperatures, and for how long the
thermostat lets each run; what follows is compared.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _component_models import (
    YEAR,
    Row,
    column,
    constant,
    curve,
    head,
    idf,
    outputs,
    row,
    run,
)
from _hvac_offices import bypass_factor

from thermal.components.component import Calls, Conditions, Given, Group
from thermal.components.curves import (
    DX_CAPACITY,
    DX_HEATING_CAPACITY,
    DX_HEATING_INPUT,
    DX_INPUT,
)
from thermal.components.electric_heaters import ElectricHeaters
from thermal.components.fan_coils import FanCoils
from thermal.components.machine_map import Defrost, MachineMap
from thermal.components.moist_air import wet_bulb
from thermal.components.operations import FloatOperations, NumpyOperations
from thermal.components.streams import HotWater, SupplyWater
from thermal.components.unitary_units import UnitaryUnits
from thermal.components.ventilators import Ventilators
from thermal.components.water_coil import WaterCoil

FREEZING, SITE_PRESSURE, DENSITY = 273.15, 99_060.0, 1.18  # K, Pa, kg/m3 of air at the site
ZONES = ("electric", "fan coil", "unitary", "ventilator")
HEAT, COLD, AIR, FAN = 7000.0, 6000.0, 0.42, 140.0  # W, W, kg/s, W of the units
HOT, CHILLED = 60.0, 7.0  # degC
FLOW = 4e-4  # m3/s of hot or chilled water, the valve open
DX_COP, HEATING_COP, LOSS, SENSIBLE = 3.8, 3.36, 0.15, 0.75
RESISTANCE, EFFECTIVENESS, AIR_RATE = 4000.0, 0.75, 0.06  # W, -, kg/s
COIL_IN, COIL_OUT, COIL_BYPASS = (25.5, 0.010), (13.5, 0.0088), 0.143  # the dew point of the line between is 11.5 degC
ONE = np.zeros(1, dtype=int)
DEFROST = Defrost(278.15, input_share=1.0, pressure=SITE_PRESSURE)


def compared(folder: Path, last: tuple[int, int] = YEAR) -> list[Row]:
    """Run EnergyPlus' models and ours."""
    table = run(_model(last), folder)
    return [*_heater(table), *_fan_coil(table), *_unitary(table), *_ventilator(table)]


def _box(k: int, zone: str) -> str:
    """Write a box of 100 m2 whose floor is adiabatic, with people, equipment and a thermostat."""
    x, names = 20.0 * k, {"floor": "Floor", "roof": "Roof"} | dict.fromkeys("nesw", "Wall")
    low, high = [(x, 0, 0), (x + 10, 0, 0), (x + 10, 10, 0), (x, 10, 0)], 3
    up = [(a, b, high) for a, b, _ in low]
    faces = {"floor": low[::-1], "roof": up} | {
        side: [up[i], low[i], low[(i + 1) % 4], up[(i + 1) % 4]] for i, side in enumerate("senw")
    }
    parts = [idf("Zone", zone, 0, 0, 0, 0, 1, 1, high, 300)]
    for side, corners in faces.items():
        outside = ("Outdoors", None, "SunExposed", "WindExposed")
        behind, made = (("Adiabatic", None, "NoSun", "NoWind"), "slab") if side == "floor" else (outside, "shell")
        parts.append(idf("BuildingSurface:Detailed", f"{zone} {side}", names[side], made, zone, None, *behind,
                         "autocalculate", 4, *(v for corner in corners for v in corner)))  # fmt: skip
    parts += [
        idf("ElectricEquipment", f"{zone} equipment", zone, "gains", "EquipmentLevel", 1500, None, None, 0, 0.3, 0),
        idf("People", f"{zone} people", zone, "gains", "People", 8, None, None, 0.3, None, "activity"),
        idf("ZoneInfiltration:DesignFlowRate", f"{zone} leaks", zone, "always", "AirChanges/Hour", None, None, None,
            0.3, 1, 0, 0, 0),
        idf("ZoneControl:Thermostat", f"{zone} thermostat", zone, "dual", "ThermostatSetpoint:DualSetpoint", "band"),
    ]  # fmt: skip
    return "".join(parts)


def _served(zone: str, *equipment: tuple[str, str], exhaust: str | None = None) -> str:
    """Write the list of a zone's equipment, and its connections: inlets ``ZONE supply``, outlet ``ZONE exhaust``."""
    listed = [field for k, pair in enumerate(equipment, 1) for field in (*pair, k, k, None, None)]
    inlet = f"{zone} supply" if exhaust else None
    return idf("ZoneHVAC:EquipmentList", f"{zone} list", "SequentialLoad", *listed) + idf(
        "ZoneHVAC:EquipmentConnections", zone, f"{zone} list", inlet, exhaust, f"{zone} air", f"{zone} return"
    )


def _water(name: str, setpoint: float, coils: list[tuple[str, str]], kind: str) -> str:
    """Write a loop of district heating or cooling for coils, whose nodes are ``COIL in`` and ``COIL out``."""
    scheme = kind.partition(":")[0].removeprefix("District")
    branches = [f"{coil} branch" for _, coil in coils]
    flow = len(coils) * FLOW
    pipe = "Pipe:Adiabatic"
    return "".join([
        idf("PlantLoop", name, "Water", None, f"{name} operation", f"{name} out", 98, 1, flow, 0, 0.1, f"{name} begin",
            f"{name} out", f"{name} supply branches", None, f"{name} demand in", f"{name} demand out",
            f"{name} demand branches", f"{name} connectors", "SequentialLoad"),
        constant(f"{name} setpoint", setpoint),
        idf("SetpointManager:Scheduled", f"{name} manager", "Temperature", f"{name} setpoint", f"{name} out"),
        idf("PlantEquipmentOperationSchemes", f"{name} operation", f"PlantEquipmentOperation:{scheme}Load",
            f"{name} scheme", "always"),
        idf(f"PlantEquipmentOperation:{scheme}Load", f"{name} scheme", 0, 1e9, f"{name} equipment"),
        idf("PlantEquipmentList", f"{name} equipment", kind, f"{name} district"),
        idf(kind, f"{name} district", f"{name} in", f"{name} out", 1e6),
        idf("BranchList", f"{name} supply branches", f"{name} supply branch"),
        idf("Branch", f"{name} supply branch", None, "Pump:VariableSpeed", f"{name} pump", f"{name} begin",
            f"{name} in", kind, f"{name} district", f"{name} in", f"{name} out"),
        idf("Pump:VariableSpeed", f"{name} pump", f"{name} begin", f"{name} in", flow, 100, 200 * flow, 0.9, 0, 0, 1,
            0, 0, 0, "Intermittent"),
        idf("BranchList", f"{name} demand branches", f"{name} first", *branches, f"{name} last"),
        idf("ConnectorList", f"{name} connectors", "Connector:Splitter", f"{name} splitter", "Connector:Mixer",
            f"{name} mixer"),
        idf("Connector:Splitter", f"{name} splitter", f"{name} first", *branches),
        idf("Connector:Mixer", f"{name} mixer", f"{name} last", *branches),
        idf("Branch", f"{name} first", None, pipe, f"{name} pipe 1", f"{name} demand in", f"{name} split"),
        idf(pipe, f"{name} pipe 1", f"{name} demand in", f"{name} split"),
        idf("Branch", f"{name} last", None, pipe, f"{name} pipe 2", f"{name} mixed", f"{name} demand out"),
        idf(pipe, f"{name} pipe 2", f"{name} mixed", f"{name} demand out"),
        *(idf("Branch", f"{coil} branch", None, what, coil, f"{coil} in", f"{coil} out") for what, coil in coils),
    ])  # fmt: skip


def _model(last: tuple[int, int]) -> str:
    """Write all boxes into one model."""
    parts = [
        head("zones", last),
        idf("Material:NoMass", "insulation", "Rough", 2.2), idf("Material", "concrete", "Rough", 0.1, 1.7, 2300, 900),
        idf("Construction", "shell", "insulation", "concrete"), idf("Construction", "slab", "concrete"),
        constant("gains", 0.5), constant("activity", 120), constant("dual", 4), constant("cycling", 0),
        constant("low", 20), constant("high", 25),
        idf("ThermostatSetpoint:DualSetpoint", "band", "low", "high"),
        *(_box(k, zone) for k, zone in enumerate(ZONES)),
        _heater_model(), _fan_coil_model(), _unitary_model(), _ventilator_model(),
        _water("hot", HOT, [("Coil:Heating:Water", "hot coil")], "DistrictHeating:Water"),
        _water("chilled", CHILLED, [("Coil:Cooling:Water", "cold coil")], "DistrictCooling"),
        outputs("*", "Zone Mean Air Temperature", "Zone Air Humidity Ratio"),
    ]  # fmt: skip
    return "".join(parts)


def _heater_model() -> str:
    electric = "ZoneHVAC:Baseboard:Convective:Electric"
    return "".join([
        _served("electric", (electric, "the heater")),
        idf(electric, "the heater", "always", "HeatingDesignCapacity", HEAT, None, None, 1.0),
        outputs("the heater", "Baseboard Total Heating Rate", "Baseboard Electricity Rate"),
    ])  # fmt: skip


def _fan_coil_model() -> str:
    unit, volume = "ZoneHVAC:FourPipeFanCoil", AIR / DENSITY
    return "".join([
        _served("fan coil", (unit, "the fan coil"), exhaust="fan coil exhaust"),
        idf(unit, "the fan coil", "always", "CyclingFan", volume, None, None, 0, None, "fan coil exhaust",
            "fan coil supply", "OutdoorAir:Mixer", "coil mixer", "Fan:OnOff", "coil fan",
            "Coil:Cooling:Water", "cold coil", FLOW, 0, 0.001,
            "Coil:Heating:Water", "hot coil", FLOW, 0, 0.001),
        idf("OutdoorAir:Mixer", "coil mixer", "coil 0", "coil outdoor", "coil relief", "fan coil exhaust"),
        idf("OutdoorAir:Node", "coil outdoor"),
        idf("Fan:OnOff", "coil fan", "always", 0.5, 0.5 * FAN / volume, volume, 0.9, 1.0, "coil 0", "coil 1"),
        idf("Coil:Cooling:Water", "cold coil", "always", FLOW, volume, CHILLED, COIL_IN[0], COIL_OUT[0], COIL_IN[1],
            COIL_OUT[1],
            "cold coil in", "cold coil out", "coil 1", "coil 2", "SimpleAnalysis", "CrossFlow"),
        idf("Coil:Heating:Water", "hot coil", "always", 260.0, FLOW, "hot coil in", "hot coil out", "coil 2",
            "fan coil supply", "UFactorTimesAreaAndDesignWaterFlowRate", "autosize", HOT, 20, HOT - 10, 40, 0.5),
        outputs("the fan coil", "Fan Coil Runtime Fraction", "Fan Coil Heating Rate", "Fan Coil Sensible Cooling Rate",
                "Fan Coil Total Cooling Rate", "Fan Coil Fan Electricity Rate"),
        outputs("*", "Cooling Coil Total Cooling Rate", "Cooling Coil Sensible Cooling Rate",
                "Heating Coil Heating Rate"),
        outputs("coil fan", "Fan Runtime Fraction", "Fan Electricity Rate"),
        *(outputs(f"{coil} in", "System Node Temperature", "System Node Mass Flow Rate")
          for coil in ("hot coil", "cold coil")),
    ])  # fmt: skip


def _unitary_model() -> str:
    unit, volume = "ZoneHVAC:PackagedTerminalHeatPump", AIR / DENSITY
    heating, cooling = "Coil:Heating:DX:SingleSpeed", "Coil:Cooling:DX:SingleSpeed"
    flat = (1.0, 0.0, 0.0)
    return "".join([
        curve("dx capacity", DX_CAPACITY.coefficients, *DX_CAPACITY.x_range, *DX_CAPACITY.y_range),
        curve("dx input", DX_INPUT.coefficients, *DX_INPUT.x_range, *DX_INPUT.y_range),
        curve("heat capacity", DX_HEATING_CAPACITY.polynomial.coefficients, -20, 20),
        curve("heat input", DX_HEATING_INPUT.polynomial.coefficients, -20, 20),
        curve("flat", flat, 0, 2), curve("loss", (1.0 - LOSS, LOSS, 0.0), 0, 1),
        curve("one", (1.0, 0.0, 0.0, 0.0, 0.0, 0.0), -50, 100, -50, 100),
        _served("unitary", (unit, "the unit"), exhaust="unitary exhaust"),
        idf(unit, "the unit", "always", "unitary exhaust", "unitary supply", None, None, volume, volume, 0, None, 0, 0,
            0, "Fan:OnOff", "unit fan", heating, "warm coil", 0.001, cooling, "cool coil", 0.001,
            "Coil:Heating:Electric", "more heat", 60, 21, "BlowThrough", "cycling"),
        idf("Fan:OnOff", "unit fan", "always", 0.5, 0.5 * FAN / volume, volume, 0.9, 1.0, "unitary exhaust", "unit 1"),
        idf(cooling, "cool coil", "always", COLD, SENSIBLE, DX_COP, volume, None, None, "unit 1", "unit 2",
            "dx capacity", "flat", "dx input", "flat", "loss"),
        idf(heating, "warm coil", "always", HEAT, HEATING_COP, volume, None, None, "unit 2", "unit 3", "heat capacity",
            "flat", "heat input", "flat", "loss", "one", -40, None, DEFROST.highest - FREEZING, 0, None, 0,
            "ReverseCycle", "OnDemand"),
        idf("Coil:Heating:Electric", "more heat", "always", 1.0, RESISTANCE, "unit 3", "unitary supply"),
        outputs("cool coil", "Cooling Coil Electricity Rate", "Cooling Coil Runtime Fraction"),
        outputs("warm coil", "Heating Coil Electricity Rate", "Heating Coil Defrost Electricity Rate"),
        outputs("unit fan", "Fan Runtime Fraction", "Fan Electricity Rate"),
    ])  # fmt: skip


def _ventilator_model() -> str:
    unit, volume = "ZoneHVAC:EnergyRecoveryVentilator", AIR_RATE / DENSITY
    exchanger, ideal = "HeatExchanger:AirToAir:SensibleAndLatent", "ZoneHVAC:IdealLoadsAirSystem"
    return "".join([
        idf("NodeList", "ventilator supply", "fresh air", "ideal air"),
        _served("ventilator", (unit, "the ventilator"), (ideal, "ideal"), exhaust="stale air"),
        idf(ideal, "ideal", None, "ideal air"),
        idf(unit, "the ventilator", "always", "exchanger", volume, volume, "fresh fan", "stale fan"),
        idf(exchanger, "exchanger", "always", volume, EFFECTIVENESS, 0, EFFECTIVENESS, 0, "outdoor air", "exchanged",
            "stale air", "stale out", 0, "No", "Plate", "MinimumExhaustTemperature", 1.7),
        idf("OutdoorAir:Node", "outdoor air"),
        idf("Fan:SystemModel", "fresh fan", "always", "exchanged", "fresh air", volume, "Discrete", 0, 100, 0.9, 1,
            30, "TotalEfficiencyAndPressure", None, None, 0.5),
        idf("Fan:SystemModel", "stale fan", "always", "stale out", "gone", volume, "Discrete", 0, 100, 0.9, 1, 30,
            "TotalEfficiencyAndPressure", None, None, 0.5),
        outputs("exchanger", "Heat Exchanger Sensible Heating Rate", "Heat Exchanger Sensible Cooling Rate"),
        outputs("fresh air", "System Node Mass Flow Rate", "System Node Temperature"),
    ])  # fmt: skip


def _at(table: pd.DataFrame, zone: str) -> Conditions:
    """Give what a unit meets: its zone's air and the weather, shape (n_time, 1)."""
    temperature = column(table, zone, "Zone Mean Air Temperature")[:, None] + FREEZING
    outdoor = column(table, "ENVIRONMENT", "Site Outdoor Air Drybulb Temperature")[:, None] + FREEZING
    damp, inside = (column(table, key, what)[:, None] for key, what in (
        ("ENVIRONMENT", "Site Outdoor Air Humidity Ratio"), (zone, "Zone Air Humidity Ratio")))  # fmt: skip
    return Conditions(temperature, None, None, outdoor, damp, inside)


def _ran(
    group: Group, now: Conditions, warm: np.ndarray, cold: np.ndarray, water: dict[str, float] | None = None
) -> Any:
    """Run a group of one for calls of shape (n_time,), with water of constant temperatures [K] by port."""
    given = Given(now, Calls(warm[:, None], cold[:, None]), {}, {}, 900.0, lambda port, message: None)
    done = group.run(NumpyOperations(), given)
    if water is None:
        return done
    told: Any = None
    try:
        while True:
            port = done.send(told)
            told = SupplyWater(water[port]) if isinstance(told, HotWater) else HotWater(1.0, water[port])
    except StopIteration as end:
        return end.value


def _heater(table: pd.DataFrame) -> list[Row]:
    """Compare the electric heater, for the share of time that it is on."""
    theirs = column(table, "the heater", "Baseboard Total Heating Rate")
    model = "ZoneHVAC:Baseboard:Convective:Electric"
    group = ElectricHeaters(np.array([HEAT]), ONE, radiant_share=0.0)
    done = _ran(group, _at(table, "electric"), theirs / HEAT, 0.0 * theirs)
    used = column(table, "the heater", "Baseboard Electricity Rate")
    return [row("electric heater", model, "electricity", used, done.electric_power)]


def _fan_coil(table: pd.DataFrame) -> list[Row]:
    """Compare the fan coil, as it brings the heat and the sensible cooling that EnergyPlus' does."""
    model = "ZoneHVAC:FourPipeFanCoil"
    heating = column(table, "hot coil", "Heating Coil Heating Rate")
    # ours is rated where EnergyPlus' coils are: by UA and flows, and by the air at the design
    coil = WaterCoil(260.0 * 1.5, 260.0 * 3.0, AIR, FLOW * 1000.0).conductance(FloatOperations(), AIR)
    (inlet, damp), (outlet, dry) = COIL_IN, COIL_OUT
    cooling = AIR * (1006.0 * (inlet - outlet) + 2.454e6 * (damp - dry))
    group = FanCoils(
        np.array([coil * (HOT - 20.0)]), np.array([cooling]), ONE, np.array([AIR]), np.array([FAN]), COIL_BYPASS,
        SITE_PRESSURE, hot_water=HOT + FREEZING, chilled_water=CHILLED + FREEZING,
        rated=(293.15, inlet + FREEZING, damp),
    )  # fmt: skip
    water = {"hot_water": HOT + FREEZING, "chilled_water": CHILLED + FREEZING}
    now, none = _at(table, "fan coil"), np.zeros(len(table))
    warmed = column(table, "the fan coil", "Fan Coil Heating Rate")
    cooled = column(table, "the fan coil", "Fan Coil Sensible Cooling Rate")
    most, least = (_ran(group, now, none + a, none + b, water).heat[:, 0] for a, b in ((1.0, 0.0), (0.0, 1.0)))
    done = _ran(group, now, warmed / most, cooled / -least, water)
    total = column(table, "cold coil", "Cooling Coil Total Cooling Rate")
    fan = column(table, "coil fan", "Fan Electricity Rate")
    return [
        row("fan coil", model, "heat of the water", heating, done.heating),
        row("fan coil", model, "cold of the water", total, done.cooling + done.moisture),
        row("fan coil", model, "fan", fan, done.electric_power),
    ]


def _unitary(table: pd.DataFrame) -> list[Row]:
    """Compare the unitary heat pump, as it brings the heat and the total cooling that EnergyPlus' does."""
    warm, cold = "Coil:Heating:DX:SingleSpeed", "Coil:Cooling:DX:SingleSpeed"
    heating = MachineMap(HEATING_COP, DX_HEATING_CAPACITY, DX_HEATING_INPUT, cycling_loss=LOSS, defrost=DEFROST)
    cooling = MachineMap(DX_COP, DX_CAPACITY, DX_INPUT, cycling_loss=LOSS)
    group = UnitaryUnits(
        np.array([HEAT]), np.array([COLD]), ONE, np.array([AIR]), np.array([FAN]),
        bypass_factor(COLD, AIR / DENSITY, SENSIBLE), SITE_PRESSURE, heating,
        cooling, np.array([RESISTANCE]),
    )  # fmt: skip
    now, ops = _at(table, "unitary"), NumpyOperations()
    outdoor = now.outdoor_temperature
    frost = heating.frosted(ops, outdoor, now.outdoor_humidity)
    able = heating.available(ops, HEAT, now.zone_temperature, outdoor, frost)[:, 0]
    wet = wet_bulb(ops, now.zone_temperature, now.return_humidity, SITE_PRESSURE)
    most = cooling.available(ops, COLD, wet, outdoor, cooling.frosted(ops, outdoor, 0.0))[:, 0]
    extra = column(table, "more heat", "Heating Coil Heating Rate")
    heat = column(table, "warm coil", "Heating Coil Heating Rate") + extra
    total = column(table, "cool coil", "Cooling Coil Total Cooling Rate")
    done = _ran(group, now, heat / (able + RESISTANCE), total / most)
    used = column(table, "warm coil", "Heating Coil Electricity Rate") + column(
        table, "warm coil", "Heating Coil Defrost Electricity Rate"
    )
    chilled = column(table, "cool coil", "Cooling Coil Electricity Rate")
    sensible = column(table, "cool coil", "Cooling Coil Sensible Cooling Rate")
    both, cools = done.electric_power[:, 0] - done.fan_power[:, 0], total > 0.0
    return [
        row("unitary heat pump", warm, "electricity, defrosting and resistance", used + extra, both * ~cools),
        row("unitary heat pump", cold, "electricity", chilled, both * cools),
        row("unitary heat pump", cold, "sensible cooling", sensible, done.cooling),
        row("unitary heat pump", "Fan:OnOff", "fan", column(table, "unit fan", "Fan Electricity Rate"), done.fan_power),
    ]


def _ventilator(table: pd.DataFrame) -> list[Row]:
    """Compare the heat that the ventilator recovers, frost and all."""
    now = _at(table, "ventilator")
    group = Ventilators(np.array([AIR_RATE]), ONE, np.zeros(1), EFFECTIVENESS)
    none = np.zeros(len(table))
    recovered = _ran(group, now, none, none).recovered[:, 0]
    model = "HeatExchanger:AirToAir:SensibleAndLatent"
    pairs = {"heat recovered": ("Heating", np.maximum(recovered, 0.0)),
             "cold recovered": ("Cooling", np.maximum(-recovered, 0.0))}  # fmt: skip
    return [row("ventilator", model, what, column(table, "exchanger", f"Heat Exchanger Sensible {kind} Rate"), values)
            for what, (kind, values) in pairs.items()]  # fmt: skip
