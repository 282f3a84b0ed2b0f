"""Components in zones beside EnergyPlus' for `components_energyplus`: heater, radiator, fan coil, unitary, ventilator.

Each stands in a box of its own. Ours get EnergyPlus' zone air, its weather, water temperatures, and for how long the
thermostat lets each run; what follows is compared.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from _component_models import (
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

from thermal.components.component import Calls, Conditions, Given
from thermal.components.curves import (
    DX_CAPACITY,
    DX_HEATING_CAPACITY,
    DX_HEATING_INPUT,
    DX_INPUT,
)
from thermal.components.electric_heaters import ElectricHeaters
from thermal.components.machine_map import Defrost, MachineMap
from thermal.components.moist_air import WATER_HEAT_CAPACITY
from thermal.components.operations import NumpyOperations
from thermal.components.radiators import Radiators
from thermal.components.streams import HotWater, SupplyWater
from thermal.components.ventilators import Ventilators
from thermal.components.zone_units import FanCoils, UnitaryUnits

FREEZING, SITE_PRESSURE, DENSITY = 273.15, 99_060.0, 1.18  # K, Pa, kg/m3 of air at the site
ZONES = ("electric", "radiator", "fan coil", "unitary", "ventilator")
HEAT, COLD, AIR, FAN = 7000.0, 6000.0, 0.42, 140.0  # W, W, kg/s, W of the units
HOT, CHILLED = 60.0, 7.0  # degC
FLOW = 4e-4  # m3/s of hot or chilled water, the valve open
BYPASS, DX_COP, HEATING_COP, LOSS = 0.06, 3.8, 3.36, 0.15
RESISTANCE, EFFECTIVENESS, AIR_RATE = 4000.0, 0.75, 0.06  # W, -, kg/s
ONE = np.zeros(1, dtype=int)
DEFROST = Defrost(278.15, input_share=1.0, pressure=SITE_PRESSURE)


def compared(folder: Path) -> list[Row]:
    """Run EnergyPlus' models and ours."""
    table = run(_model(), folder)
    return [*_heater(table), *_radiator(table), *_fan_coil(table), *_unitary(table), *_ventilator(table)]


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
        behind = ("Adiabatic", None, "NoSun", "NoWind") if side == "floor" else ("Outdoors", None, "SunExposed", "WindExposed")
        made = "slab" if side == "floor" else "shell"
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


def _model() -> str:
    """Write all boxes into one model."""
    parts = [
        head("zones"),
        idf("Material:NoMass", "insulation", "Rough", 2.2), idf("Material", "concrete", "Rough", 0.1, 1.7, 2300, 900),
        idf("Construction", "shell", "insulation", "concrete"), idf("Construction", "slab", "concrete"),
        constant("gains", 0.5), constant("activity", 120), constant("dual", 4), constant("cycling", 0),
        constant("low", 20), constant("high", 25),
        idf("ThermostatSetpoint:DualSetpoint", "band", "low", "high"),
        *(_box(k, zone) for k, zone in enumerate(ZONES)),
        _heater_model(), _fan_coil_model(), _unitary_model(), _ventilator_model(),
        _water("hot", HOT, [("ZoneHVAC:Baseboard:RadiantConvective:Water", "the radiator"),
                            ("Coil:Heating:Water", "hot coil")], "DistrictHeating:Water"),
        _water("chilled", CHILLED, [("Coil:Cooling:Water", "cold coil")], "DistrictCooling"),
        outputs("*", "Zone Mean Air Temperature", "Zone Air Humidity Ratio"),
    ]  # fmt: skip
    return "".join(parts)


def _heater_model() -> str:
    electric, water = "ZoneHVAC:Baseboard:Convective:Electric", "ZoneHVAC:Baseboard:RadiantConvective:Water"
    return "".join([
        _served("electric", (electric, "the heater")),
        idf(electric, "the heater", "always", "HeatingDesignCapacity", HEAT, None, None, 1.0),
        _served("radiator", (water, "the radiator")),
        idf(f"{water}:Design", "radiators", "HeatingDesignCapacity", None, None, 0.001, 0.3, 0),
        idf(water, "the radiator", "radiators", "always", "the radiator in", "the radiator out", HOT - 10.0, 0.16, HEAT,
            0.16e-3, "radiator n", 1.0),
        outputs("the heater", "Baseboard Total Heating Rate", "Baseboard Electricity Rate"),
        outputs("the radiator", "Baseboard Total Heating Rate", "Baseboard Water Mass Flow Rate",
                "Baseboard Water Inlet Temperature"),
    ])  # fmt: skip


def _fan_coil_model() -> str:
    unit, volume = "ZoneHVAC:FourPipeFanCoil", AIR / DENSITY
    return "".join([
        _served("fan coil", (unit, "the fan coil"), exhaust="fan coil exhaust"),
        idf(unit, "the fan coil", "always", "CyclingFan", volume, None, None, 0, None, "fan coil exhaust",
            "fan coil supply", "OutdoorAir:Mixer", "coil mixer", "Fan:OnOff", "coil fan", "Coil:Cooling:Water", "cold coil", FLOW, 0, 0.001,
            "Coil:Heating:Water", "hot coil", FLOW, 0, 0.001),
        idf("OutdoorAir:Mixer", "coil mixer", "coil 0", "coil outdoor", "coil relief", "fan coil exhaust"),
        idf("OutdoorAir:Node", "coil outdoor"),
        idf("Fan:OnOff", "coil fan", "always", 0.5, 0.5 * FAN / volume, volume, 0.9, 1.0, "coil 0", "coil 1"),
        idf("Coil:Cooling:Water", "cold coil", "always", FLOW, volume, CHILLED, 25.5, 13.5, 0.010, 0.0088,
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
        idf(cooling, "cool coil", "always", COLD, 0.75, DX_COP, volume, None, None, "unit 1", "unit 2", "dx capacity",
            "flat", "dx input", "flat", "loss"),
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
