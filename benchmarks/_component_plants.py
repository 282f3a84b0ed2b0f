"""Plant components beside EnergyPlus' for `components_energyplus`: what makes, stores and rejects heat."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from _component_models import (
    STEPS_PER_HOUR,
    YEAR,
    Row,
    column,
    constant,
    curve,
    head,
    idf,
    loop,
    outdoor_hours,
    outputs,
    row,
    run,
    series,
)

from thermal.components.boiler_loop import BoilerLoop
from thermal.components.chiller_loop import ChillerLoop
from thermal.components.component import Conditions
from thermal.components.cooling_tower import CoolingTower
from thermal.components.curves import (
    CHILLER_PART_LOAD,
    CONDENSING_BOILER,
    WATER_COOLED_CAPACITY,
    WATER_COOLED_INPUT,
    Biquadratic,
    Polynomial,
)
from thermal.components.district_loop import DistrictLoop
from thermal.components.heat_pump_loop import HeatPumpLoop
from thermal.components.machine_map import MachineMap
from thermal.components.moist_air import WATER_HEAT_CAPACITY
from thermal.components.operations import FloatOperations, NumpyOperations
from thermal.components.pump import Pump
from thermal.components.storage_tank import StorageTank, TankFlows

FREEZING, SECONDS = 273.15, 3600.0 / STEPS_PER_HOUR
FLOW = 5e-4  # m3/s of each heating loop
HEAT, COLD = 12_000.0, 60_000.0  # W, rated
HOT, CHILLED = 45.0, 6.67  # degC, setpoints
BRINE = 6.0  # degC, of the source of the brine
SITE_PRESSURE = 99_060.0  # Pa, at the site's 190 m
# a heat pump of both signs of what maps have: falling with the lift, and losing at part load
CAPACITY = Biquadratic((0.95, -0.004, 0.0, 0.021, 0.0001, 0.00005), (25.0, 60.0), (-25.0, 25.0), "this benchmark")
INPUT = Biquadratic((0.62, 0.009, 0.00011, -0.011, 0.00015, -0.00022), (25.0, 60.0), (-25.0, 25.0), "this benchmark")
EXTRA = (1.2, -0.45, 0.25)  # input per heat over that at full load, by part load: what EnergyPlus' heat pumps have
PART_LOAD = Polynomial((0.0, *EXTRA), 0.0, 1.0, "this benchmark")
LEAST, COP = 0.25, 4.2
TANK = StorageTank(0.5, 0.3, Pump(0.2), height=1.5, loss=2.5)
DRAW = 1.5e-4  # m3/s, from the tank
TOWER = CoolingTower.sized(1.3 * COLD)


def compared(folder: Path, last: tuple[int, int] = YEAR) -> list[Row]:
    """Run EnergyPlus' models and ours."""
    table = run(_model(folder, last), folder)
    outdoor = column(table, "ENVIRONMENT", "Site Outdoor Air Drybulb Temperature") + FREEZING
    damp = column(table, "ENVIRONMENT", "Site Outdoor Air Humidity Ratio")
    now = Conditions(None, None, None, outdoor, damp)
    loads = {name: np.repeat(values, STEPS_PER_HOUR)[: len(table)] for name, values in _loads().items()}
    rows = [*_heat_pumps(table, now, loads["heat"]), *_boiler(table, now, loads["heat"])]
    rows += [*_district(table, now, loads["heat"]), *_chiller(table, now, loads["cold"]), *_tank(table)]
    return rows


def _loads() -> dict[str, np.ndarray]:
    """Make loads by the hour [W]: with the temperature outdoors, more in the morning, nothing when it is mild."""
    outdoor = outdoor_hours()
    morning = np.tile(np.where(np.isin(np.arange(24), (6, 7, 8)), 1.4, 0.95), 365)
    heat = np.clip((16.0 - outdoor) / 34.0, 0.0, 1.0) * HEAT * morning
    cold = np.clip((outdoor - 12.0) / 20.0, 0.0, 1.0) * COLD * morning
    return {"heat": np.minimum(heat, HEAT), "cold": np.minimum(cold, 0.85 * COLD)}


def _model(folder: Path, last: tuple[int, int]) -> str:
    """Write all plant components into one model."""
    loads = _loads()
    parts = [head("plants", last)]
    for name, values in loads.items():
        parts += [series(name, values if name == "heat" else -values, folder)]
        parts += [series(f"{name} flow", (values > 0.0) * 1.0, folder)]
    heat_pump = "HeatPump:PlantLoop:EIR:Heating"
    parts += [
        curve("hp capacity", CAPACITY.coefficients, *CAPACITY.x_range, *CAPACITY.y_range),
        curve("hp input", INPUT.coefficients, *INPUT.x_range, *INPUT.y_range),
        curve("hp part load", EXTRA, 0.0, 1.0),
        loop("air", heat_pump, "air pump", FLOW, HOT, "heat"),
        idf(heat_pump, "air pump", "air in", "air middle", "AirSource", "source air in", "source air out", None, None,
            None, FLOW, 1.0, None, HEAT, COP, 1, "hp capacity", "hp input", "hp part load", 1, "HeatingCapacity",
            "Load", "ConstantFlow", LEAST, -100, 100),
        idf("OutdoorAir:Node", "source air in"),
        loop("brine", heat_pump, "brine pump", FLOW, HOT, "heat"),
        idf(heat_pump, "brine pump", "brine in", "brine middle", "WaterSource", "ground demand in", "ground demand out",
            None, None, None, FLOW, FLOW, None, HEAT, COP, 1, "hp capacity", "hp input", "hp part load", 1,
            "HeatingCapacity", "Load", "ConstantFlow", LEAST, -100, 100),
        loop("ground", "PlantComponent:TemperatureSource", "ground source", FLOW, BRINE, None),
        idf("Branch", "ground demand branch", None, heat_pump, "brine pump", "ground demand in", "ground demand out"),
        idf("PlantComponent:TemperatureSource", "ground source", "ground in", "ground middle", FLOW, "Constant", BRINE),
        curve("condensing", CONDENSING_BOILER.coefficients, *CONDENSING_BOILER.x_range, *CONDENSING_BOILER.y_range),
        loop("gas", "Boiler:HotWater", "gas boiler", FLOW, HOT, "heat"),
        idf("Boiler:HotWater", "gas boiler", "NaturalGas", 1.2 * HEAT, 0.89, "EnteringBoiler", "condensing", FLOW, 0.0,
            1.2, 1.0, "gas in", "gas middle", 95, "ConstantFlow", 0, 1),
        loop("district", "DistrictHeating:Water", "district", FLOW, HOT, "heat"),
        idf("DistrictHeating:Water", "district", "district in", "district middle", 0.7 * HEAT),
        *_chilled_model(), *_tank_model(),
    ]  # fmt: skip
    parts += [
        outputs("*", "Heat Pump Electricity Rate", "Heat Pump Load Side Heat Transfer Rate"),
        outputs("brine pump", "Heat Pump Source Side Inlet Temperature"),
        outputs("gas boiler", "Boiler NaturalGas Rate", "Boiler Heating Rate", "Boiler Inlet Temperature"),
        outputs("*", "District Heating Water Rate"),
        outputs("chiller", "Chiller Electricity Rate", "Chiller Evaporator Cooling Rate",
                "Chiller Condenser Heat Transfer Rate", "Chiller Condenser Inlet Temperature"),
        outputs("tower", "Cooling Tower Fan Electricity Rate", "Cooling Tower Heat Transfer Rate"),
        outputs("tank", *(f"Water Heater {what}" for what in (
            "Use Side Heat Transfer Rate", "Source Side Heat Transfer Rate", "Heat Loss Rate",
            "Use Side Mass Flow Rate", "Source Side Mass Flow Rate", "Use Side Inlet Temperature",
            "Source Side Inlet Temperature", "Temperature Node 1", "Temperature Node 4"))),
    ]  # fmt: skip
    return "".join(parts)


def _chilled_model() -> list[str]:
    water, condenser = COLD / (6.67 * 4.19e6), TOWER.water_flow / 998.0
    tower = "CoolingTower:SingleSpeed"
    return [
        loop("cold water", "Chiller:Electric:EIR", "chiller", water, CHILLED, "cold"),
        curve("chiller capacity", WATER_COOLED_CAPACITY.coefficients, 5.0, 10.0, 17.78, 46.11),
        curve("chiller input", WATER_COOLED_INPUT.coefficients, 5.0, 10.0, 17.78, 46.11),
        curve("chiller part load", CHILLER_PART_LOAD.coefficients, 0.25, 1.0),
        idf("Chiller:Electric:EIR", "chiller", COLD, 4.5, CHILLED, 29.4, water, condenser, "chiller capacity",
            "chiller input", "chiller part load", 0.25, 1.0, 1.0, 0.25, "cold water in", "cold water out",
            "condenser demand in", "condenser demand out", "WaterCooled", None, 1.0, 2.0, "ConstantFlow"),
        loop("condenser", tower, "tower", condenser, TOWER.setpoint - FREEZING, None),
        idf("Branch", "condenser demand branch", None, "Chiller:Electric:EIR", "chiller", "condenser demand in",
            "condenser demand out"),
        idf(tower, "tower", "condenser in", "condenser out", condenser, TOWER.air_flow / 1.155, TOWER.fan_power,
            TOWER.conductance, 0.1 * TOWER.air_flow / 1.155, None, 0.1 * TOWER.conductance, None,
            "UFactorTimesAreaAndDesignWaterFlowRate"),
    ]  # fmt: skip


def _tank_model() -> list[str]:
    """Write a tank charged from a district loop by its own control, and drawn from by the profile of heat."""
    area = 2.0 * (3.14159 * TANK.volume * TANK.height) ** 0.5 + 2.0 * TANK.volume / TANK.height
    charge, kind = TANK.charge_flow / 1000.0, "WaterHeater:Stratified"
    return [
        loop("use", kind, "tank", DRAW, HOT, "heat"),
        loop("charge", "DistrictHeating:Water", "charger", charge, 60.0, None),
        idf("DistrictHeating:Water", "charger", "charge in", "charge middle", 1e5),
        idf("Branch", "charge demand branch", None, kind, "tank", "charge demand in", "charge demand out"),
        constant("tank setpoint", 55.0), constant("tank room", 20.0),
        idf(kind, "tank", None, TANK.volume, TANK.height, "VerticalCylinder", None, 90, "MasterSlave", "tank setpoint",
            3, 0, 0.9 * TANK.height, "tank setpoint", 3, 0, 0.3, "Electricity", 1, 0, "Electricity", 0, 0, 0,
            "Electricity", 0, 0, "Schedule", "tank room", None, None, TANK.loss / area, 1, 0, 1, None, None, None,
            "use in", "use middle", 1, 0, TANK.height, "charge demand in", "charge demand out", 1, TANK.height, 0,
            "Fixed", DRAW, charge, 1.5, 4),
    ]  # fmt: skip


def _heat_pumps(table: pd.DataFrame, now: Conditions, load: np.ndarray) -> list[Row]:
    """Compare heat and electricity of the heat pumps, under the loads of the profile.

    Without frost: EnergyPlus' object takes its multiplier of the input for that of the input per heat, so that frost
    would spare electricity. The unitary heat pump has frost, and its coil of direct expansion has it right.
    """
    ops, found, model = NumpyOperations(), [], "HeatPump:PlantLoop:EIR:Heating"
    for name, label, source in (("air pump", "air-source", None), ("brine pump", "water-source", BRINE + FREEZING)):
        machine = MachineMap(COP, CAPACITY, INPUT, PART_LOAD, minimum=LEAST)
        ours = HeatPumpLoop(HEAT, Pump(FLOW * 1000.0), machine, source)
        heat = np.minimum(load, ours.can(ops, now, HOT + FREEZING))
        took = ours.takes(ops, now, heat, HOT + FREEZING, HOT + FREEZING)
        pairs = {"heat": ("Heat Pump Load Side Heat Transfer Rate", heat),
                 "electricity": ("Heat Pump Electricity Rate", took.electric_power)}  # fmt: skip
        label = f"heat pump, {label}"
        found += [row(label, model, what, column(table, name, variable), v) for what, (variable, v) in pairs.items()]
    return found


def _boiler(table: pd.DataFrame, now: Conditions, load: np.ndarray) -> list[Row]:
    """Compare heat and gas of the condensing boiler."""
    ops, ours = NumpyOperations(), BoilerLoop(1.2 * HEAT, Pump(FLOW * 1000.0), 0.89, CONDENSING_BOILER)
    heat = np.minimum(load, ours.capacity)
    back = HOT + FREEZING - heat / (FLOW * 1000.0 * WATER_HEAT_CAPACITY)
    gas = ours.takes(ops, now, heat, HOT + FREEZING, back).fuel_power
    pairs = {"heat": ("Boiler Heating Rate", heat), "gas": ("Boiler NaturalGas Rate", gas)}
    return [row("boiler, condensing", "Boiler:HotWater", what, column(table, "gas boiler", variable), values)
            for what, (variable, values) in pairs.items()]  # fmt: skip


def _district(table: pd.DataFrame, now: Conditions, load: np.ndarray) -> list[Row]:
    """Compare the heat of a district connection that the loads outgrow."""
    hot = HOT + FREEZING
    ours = DistrictLoop(0.7 * HEAT, Pump(FLOW * 1000.0), rated_water=hot)
    heat = np.minimum(load, ours.can(NumpyOperations(), now, hot))
    theirs = column(table, "district", "District Heating Water Rate")
    return [row("district connection", "DistrictHeating:Water", "heat", theirs, heat)]


def _chiller(table: pd.DataFrame, now: Conditions, load: np.ndarray) -> list[Row]:
    """Compare the chiller, and the tower that cools it, wet bulb and all."""
    ops = NumpyOperations()
    machine = MachineMap(4.5, WATER_COOLED_CAPACITY, WATER_COOLED_INPUT, CHILLER_PART_LOAD, minimum=0.25)
    tower = replace(TOWER, pressure=SITE_PRESSURE)
    ours = ChillerLoop(COLD, Pump(2.0), machine=machine, tower=tower)
    done, cooled = ours.chilled(ops, load, CHILLED + FREEZING, now)
    pairs = {"cooling": ("Chiller Evaporator Cooling Rate", done.output),
             "electricity": ("Chiller Electricity Rate", done.power)}  # fmt: skip
    found = [row("chiller, water-cooled", "Chiller:Electric:EIR", what, column(table, "chiller", variable), values)
             for what, (variable, values) in pairs.items()]  # fmt: skip
    fan = column(table, "tower", "Cooling Tower Fan Electricity Rate")
    return [*found, row("cooling tower", "CoolingTower:SingleSpeed", "fan", fan, cooled.power)]


def _tank(table: pd.DataFrame) -> list[Row]:
    """Compare the tank, charged and drawn from with EnergyPlus' flows and the temperatures of what comes in."""

    def theirs(what: str) -> list[float]:
        return column(table, "tank", f"Water Heater {what}").tolist()

    ops, rate, layers = FloatOperations(), WATER_HEAT_CAPACITY, [50.0 + FREEZING] * 4
    rows: list[tuple[float, float, float]] = []
    flows = zip(
        theirs("Source Side Mass Flow Rate"), theirs("Source Side Inlet Temperature"),
        theirs("Use Side Mass Flow Rate"), theirs("Use Side Inlet Temperature"), strict=True,
    )  # fmt: skip
    room = 20.0 + FREEZING
    for charge, hot, draw, cold in flows:
        through = TankFlows(charge, draw, rate * draw, rate * draw * (cold + FREEZING))
        ends, means = TANK.layers_end(ops, layers, through, room, SECONDS)
        layers, mean = ([a + b * (hot + FREEZING) for a, b in lines] for lines in (ends, means))
        rows.append((
            rate * charge * (hot + FREEZING - mean[-1]), rate * draw * (mean[0] - cold - FREEZING),
            TANK.loss * (sum(mean) / len(mean) - room),
        ))  # fmt: skip
    names = {"heat from the source": "Source Side Heat Transfer Rate", "heat to the use": "Use Side Heat Transfer Rate",
             "loss": "Heat Loss Rate"}  # fmt: skip
    return [
        row("storage tank, 4 layers", "WaterHeater:Stratified", what, sign * np.array(theirs(variable)), values)
        for (what, variable), values, sign in zip(names.items(), np.array(rows).T, (1.0, -1.0, -1.0), strict=True)
    ]
