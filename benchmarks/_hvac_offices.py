"""The reference offices' plant for `hvac_energyplus`: our devices at EnergyPlus' sizes, under its air and setpoints."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd
import psychrolib
from _hvac_reference import STEPS_PER_HOUR, Reference
from scipy.optimize import brentq

from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Conditions
from thermal.components.cooling_coil import CoolingCoil
from thermal.components.curves import CONSTANT_EFFICIENCY
from thermal.components.fan import Fan
from thermal.components.heater import Heater
from thermal.components.pump import Pump
from thermal.components.streams import AirCommand
from thermal.components.terminals import Terminals
from thermal.components.water_coil import WaterCoil
from thermal.system.component_replay import AirHandlerReplay, replay_air_handler, replay_loop, replay_reheat
from thermal.units import air_density

FloatArray = npt.NDArray[np.float64]

FREEZING = 273.15
ELEVATION = 190.0  # m, of the buildings' site
DENSITY = air_density(ELEVATION)  # EnergyPlus turns volume flows into mass flows with the site's density too
WATER_DENSITY = 983.0  # kg/m3, as `thermal.components` has it
RATED_DRY_BULB, RATED_WET_BULB = 26.6667, 19.4444  # degC, of EnergyPlus' coils
FILM_RATIO = 0.5  # of EnergyPlus' heating coils: hA of the air over that of the water
TEMPERATURE, FLOW = "System Node Temperature", "System Node Mass Flow Rate"
HUMIDITY, SETPOINT = "System Node Humidity Ratio", "System Node Setpoint Temperature"
VENTILATION = ("MinOA_MotorizedDamper_Sched", "Schedule Value")
SITE = [("*", f"Site Outdoor Air {what}") for what in ("Drybulb Temperature", "Humidity Ratio", "Barometric Pressure")]
HEAD = 179_352.0  # Pa, of the Large Office's pump
LOOP = "HeatSys1 Supply Outlet Node"


class Compared(NamedTuple):
    """A quantity over a week.

    Parameters
    ----------
    season, quantity : str
        Which.
    reference, ours : float
        Energy by EnergyPlus and by us [kWh].
    """

    season: str
    quantity: str
    reference: float
    ours: float


def air_handler_outputs(numbers: tuple[int, ...]) -> list[tuple[str, str]]:
    """Return the outputs of air handlers."""
    wanted = [*SITE, VENTILATION]
    for k in numbers:
        for node in (_inlet(k), _outlet(k), _outdoor(k)):
            wanted += [(node, what) for what in (TEMPERATURE, FLOW, HUMIDITY, SETPOINT)]
    for what in ("Total Cooling Rate", "Sensible Cooling Rate", "Electricity Rate"):
        wanted.append(("*", f"Cooling Coil {what}"))
    return [
        *wanted,
        ("*", "Heating Coil Heating Rate"),
        ("*", "Heating Coil NaturalGas Rate"),
        ("*", "Fan Electricity Rate"),
    ]


def loop_outputs(boxes: list[str]) -> list[tuple[str, str]]:
    """Return the outputs of terminals and of the hot-water loop."""
    wanted = [(LOOP, what) for what in (TEMPERATURE, FLOW, SETPOINT)]
    for box in boxes:
        nodes = (f"{box} VAV Box Damper Node", f"{box} VAV Box Outlet Node Name")
        wanted += [(node, what) for node in nodes for what in (TEMPERATURE, FLOW)]
    return wanted + [("*", what) for what in ("Boiler NaturalGas Rate", "Boiler Heating Rate", "Pump Electricity Rate")]


def compare_medium(reference: Reference) -> list[Compared]:
    """Compare air handlers and their direct expansion, all three together."""
    rows = []
    for season, week in reference.weeks.items():
        sums: dict[str, FloatArray] = {}
        for k in (1, 2, 3):
            dx, heat = f"VAV_{k}_COOLC DXCOIL", f"VAV_{k}_HEATC"
            handler = _medium_handler(reference, week, k)
            ours = _replayed(handler, week, k)
            pairs = {
                "cooling, sensible": (_series(week, dx, "Cooling Coil Sensible Cooling Rate"), ours.mixed.sensible),
                "cooling, total": (
                    _series(week, dx, "Cooling Coil Total Cooling Rate"),
                    ours.mixed.sensible + ours.mixed.latent,
                ),
                "compressor": (_series(week, dx, "Cooling Coil Electricity Rate"), ours.mixed.cooling_power),
                "heating coil": (_series(week, heat, "Heating Coil Heating Rate"), ours.heating),
                "gas of the heating coil": (_series(week, heat, "Heating Coil NaturalGas Rate"), ours.fuel_power),
                "fan": (_series(week, f"VAV_{k}_FAN", "Fan Electricity Rate"), ours.mixed.supply_fan_power),
            }
            _add(sums, pairs)
        rows += [Compared(season, name, *_energy(pair)) for name, pair in sums.items()]
    return rows


def compare_large(reference: Reference, boxes: list[str]) -> list[Compared]:
    """Compare reheat coils, the heating coils of the air handlers, boiler, pump and fans."""
    rows = []
    terminals = _large_terminals(reference, boxes)
    loop = _large_loop(reference)
    for season, week in reference.weeks.items():
        water = _series(week, LOOP, SETPOINT) + FREEZING
        entering, airflow, discharge = (
            np.column_stack([_series(week, f"{box} VAV Box {node}", what) for box in boxes])
            for node, what in (("Damper Node", TEMPERATURE), ("Damper Node", FLOW), ("Outlet Node Name", TEMPERATURE))
        )
        reheat = replay_reheat(terminals, airflow, entering + FREEZING, discharge + FREEZING, water)
        load, drawn = reheat.reheat.sum(axis=1), reheat.water_flow.sum(axis=1)
        theirs = sum(_series(week, f"{box} VAV Box Reheat Coil", "Heating Coil Heating Rate") for box in boxes)
        sums: dict[str, FloatArray] = {}
        _add(sums, {"reheat coils": (np.asarray(theirs), load)})
        for k in (1, 2, 3, 5):
            ours = _replayed(_large_handler(reference, k), week, k, water)
            pairs = {
                "heating coils of air handlers": (
                    _series(week, f"VAV_{k}_HEATC", "Heating Coil Heating Rate"),
                    ours.heating,
                ),
                "fans": (_series(week, f"VAV_{k}_FAN", "Fan Electricity Rate"), ours.mixed.supply_fan_power),
            }
            _add(sums, pairs)
            load, drawn = load + ours.heating, drawn + ours.water_flow
        plant = replay_loop(loop, load, drawn, water, 3600.0 / STEPS_PER_HOUR, float(water[0]))
        pairs = {
            "boiler": (_series(week, "HEATSYS1 BOILER", "Boiler Heating Rate"), plant.boiler),
            "gas of the boiler": (_series(week, "HEATSYS1 BOILER", "Boiler NaturalGas Rate"), plant.fuel_power),
            "pump": (_series(week, "HEATSYS1 PUMP", "Pump Electricity Rate"), plant.pump_power),
        }
        _add(sums, pairs)
        rows += [Compared(season, name, *_energy(pair)) for name, pair in sums.items()]
    return rows


def _medium_handler(reference: Reference, week: pd.DataFrame, k: int) -> AirHandler:
    dx = f"VAV_{k}_COOLC DXCOIL"
    volume = reference.size(dx, "Design Size High Speed Rated Air Flow Rate")
    capacity = reference.size(dx, "Design Size High Speed Gross Rated Total Cooling Capacity")
    sensible = reference.size(dx, "Design Size High Speed Rated Sensible Heat Ratio")
    # the coil's surface may be as cold as it needs: direct expansion has no water that bounds it
    pressure = float(_series(week, "ENVIRONMENT", "Site Outdoor Air Barometric Pressure").mean())
    cooling = CoolingCoil(capacity, bypass=bypass_factor(capacity, volume, sensible), coldest=275.15, pressure=pressure)
    heating = Heater(reference.size(f"VAV_{k}_HEATC", "Design Size Nominal Capacity"))
    fan = Fan(DENSITY * volume, 1109.648, efficiency=0.5915, air_density=DENSITY)
    return AirHandler(
        fan, None, cooling, heating, 0.0, DENSITY * reference.size(f"VAV_{k}_OA_CONTROLLER", "Minimum Outdoor"),
        enthalpy_limit=64_000.0,
    )  # fmt: skip


def _large_handler(reference: Reference, k: int) -> AirHandler:
    volume = reference.size(f"VAV_{k}_FAN", "Design Size Maximum Flow Rate")
    coil = f"VAV_{k}_HEATC"
    heating = _coil(reference, coil, DENSITY * reference.size(f"VAV_{k}", "Adjusted Heating Design Air Flow Rate"))
    # the air handlers' fans differ in pressure and efficiency, of which only the quotient matters here
    power = reference.size(f"VAV_{k}_FAN", "Design Electric Power Consumption")
    fan = Fan(DENSITY * volume, 1017.592, efficiency=volume * 1017.592 / power, air_density=DENSITY)
    least = DENSITY * reference.size(f"VAV_{k}_OA_CONTROLLER", "Minimum Outdoor")
    return AirHandler(fan, None, None, heating, 0.0, least, enthalpy_limit=64_000.0)


def _large_terminals(reference: Reference, boxes: list[str]) -> Terminals:
    coils, largest = [], []
    for box in boxes:
        component, coil = f"{box} VAV BOX COMPONENT", f"{box} VAV BOX REHEAT COIL"
        air = reference.size(component, "Design Size Reheat Coil Sizing Air Volume Flow Rate")
        coils.append(_coil(reference, coil, DENSITY * air))
        largest.append(DENSITY * reference.size(component, "Design Size Maximum Air Flow Rate"))
    flows = np.array([max(a, c.air_flow) for a, c in zip(largest, coils, strict=True)])
    rise = np.array([(flow / c.air_flow) ** 0.8 for flow, c in zip(flows, coils, strict=True)])
    return Terminals(
        design_flow=flows,
        minimum_flow=0.2 * flows,
        heating_flow=0.3 * flows,
        air_film=rise * np.array([c.air_conductance for c in coils]),
        water_film=np.array([c.water_conductance for c in coils]),
        water_flow=np.array([c.water_flow for c in coils]),
        zone=np.arange(len(boxes)),
        air_handler=np.zeros(len(boxes), dtype=int),
    )


def _large_loop(reference: Reference) -> BoilerLoop:
    flow = WATER_DENSITY * reference.size("HEATSYS1 PUMP", "Design Flow Rate")
    # EnergyPlus' pump takes power in proportion to flow: all of its pressure is held, whatever the flow
    power = reference.size("HEATSYS1 PUMP", "Design Power Consumption")
    pump = Pump(flow, HEAD, HEAD, HEAD * flow / WATER_DENSITY / power, minimum_share=0.01)
    return BoilerLoop(
        reference.size("HEATSYS1 BOILER", "Design Size Nominal Capacity"),
        pump,
        efficiency_curve=CONSTANT_EFFICIENCY,
        standing_conductance=0.0,
        pipe_conductance=0.0,
        water_volume=reference.size("HEATSYS1", "Plant Loop Volume"),
        fastest_rise=1.0,
    )


def _coil(reference: Reference, name: str, air_flow: float) -> WaterCoil:
    overall = reference.size(name, "Design Size U-Factor Times Area Value")
    water = WATER_DENSITY * reference.size(name, "Design Size Maximum Water Flow Rate")
    return WaterCoil(overall * (1.0 + FILM_RATIO), overall * (1.0 + FILM_RATIO) / FILM_RATIO, air_flow, water)


def bypass_factor(capacity: float, volume: float, sensible: float) -> float:
    """Bypass factor of a coil with this rated capacity [W], air [m3/s] and sensible heat ratio [-]."""
    psychrolib.SetUnitSystem(psychrolib.SI)
    pressure = 101_325.0
    humidity = psychrolib.GetHumRatioFromTWetBulb(RATED_DRY_BULB, RATED_WET_BULB, pressure)
    entering = psychrolib.GetMoistAirEnthalpy(RATED_DRY_BULB, humidity)
    drop = capacity / (1.204 * volume)
    leaving = psychrolib.GetHumRatioFromEnthalpyAndTDryBulb(entering - (1.0 - sensible) * drop, RATED_DRY_BULB)
    temperature = psychrolib.GetTDryBulbFromEnthalpyAndHumRatio(entering - drop, leaving)
    slope = (humidity - leaving) / (RATED_DRY_BULB - temperature)

    def excess(dew_point: float) -> float:
        saturated = psychrolib.GetSatHumRatio(dew_point, pressure)
        return float(saturated - humidity + slope * (RATED_DRY_BULB - dew_point))

    dew_point = brentq(excess, -5.0, temperature)
    surface = psychrolib.GetSatAirEnthalpy(dew_point, pressure)
    return float((entering - drop - surface) / (entering - surface))


def _replayed(handler: AirHandler, week: pd.DataFrame, k: int, water: FloatArray | float = 355.35) -> AirHandlerReplay:
    return replay_air_handler(
        handler,
        _series(week, _outlet(k), FLOW),
        _series(week, _inlet(k), TEMPERATURE) + FREEZING,
        Conditions(
            None, None, None, _series(week, _outdoor(k), TEMPERATURE) + FREEZING,
            _series(week, "ENVIRONMENT", "Site Outdoor Air Humidity Ratio"), _series(week, _inlet(k), HUMIDITY),
        ),
        AirCommand(_series(week, _outlet(k), SETPOINT) + FREEZING, None, ventilation=_series(week, *VENTILATION)),
        water,
    )  # fmt: skip


def _series(week: pd.DataFrame, key: str, variable: str) -> FloatArray:
    return np.asarray(week[key.upper(), variable], dtype=float)


def _inlet(k: int) -> str:
    return f"VAV_{k} Supply Equipment Inlet Node"


def _outlet(k: int) -> str:
    return f"VAV_{k} Supply Equipment Outlet Node"


def _outdoor(k: int) -> str:
    return f"VAV_{k}_OAInlet Node"


def _add(sums: dict[str, FloatArray], pairs: dict[str, tuple[FloatArray, FloatArray]]) -> None:
    for name, pair in pairs.items():
        sums[name] = sums.get(name, 0.0) + np.stack(pair)


def _energy(pair: FloatArray) -> tuple[float, float]:
    theirs, ours = pair.sum(axis=1) / STEPS_PER_HOUR / 1000.0
    return float(theirs), float(ours)
