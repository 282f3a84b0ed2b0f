"""The plant as a controller may believe it to be: devices of `thermal.components` at the sizes that EnergyPlus found.

Cooling coils of chilled water have a constant coefficient of performance. Electric reheat is a hot-water loop that
loses nothing, with coils that give whatever the discharge temperature asks for: its "fuel" stands for electricity.
"""

import numpy as np

from mpc.adapters.energyplus.building import EnergyPlusBuilding
from mpc.adapters.energyplus.layout import AirLoop, Terminal
from thermal.components.air_handler import AirHandler
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.cooling_coil import CoolingCoil
from thermal.components.curves import CONSTANT_EFFICIENCY, Biquadratic
from thermal.components.fan import Fan
from thermal.components.heater import Heater
from thermal.components.pump import Pump
from thermal.components.terminals import Terminals
from thermal.components.thermostat import Thermostat
from thermal.components.water_coil import WaterCoil
from thermal.system.system import HvacSystem, vav_system
from thermal.units import air_density

_WATER = 983.0  # kg/m3, as `thermal.components` has it
_FILMS = 0.5  # hA of the air over that of the water, of EnergyPlus' coils
_TIGHT = 0.3  # K: EnergyPlus' thermostats hold their setpoint; a narrow range stands for that
_WARMEST = 323.15  # K, of the discharge air in the reference buildings' sizing
_CHILLED = 279.82  # K, of the reference buildings' chilled water
_TOWER = 0.04  # of chilled-water pump, tower and its pump per cooling, at the Large Office's sizes
_CHILLER_COP = 5.5  # where the chiller does not say its own
_PLENTY = 5.0  # NTU of a coil that stands for electric resistance
_CONSTANT = Biquadratic((1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (-50.0, 50.0), (-50.0, 60.0), "no dependence")


def controller_system(source: EnergyPlusBuilding, price_ratio: float = 1.0) -> HvacSystem:
    """Make a building's plant at EnergyPlus' sizes.

    Parameters
    ----------
    source : EnergyPlusBuilding
        The building.
    price_ratio : float
        Price of fuel over that of electricity [-], 0.1 to 1. It counts with electric reheat only, which is then as
        dear as it is: so much "fuel" as costs what its electricity does.

    Returns
    -------
    HvacSystem
        For a predictor. With electric reheat its fuel is the reheat's electricity over `price_ratio`, and the gas of
        heating coils.

    Raises
    ------
    EnergyPlusError
        When a size is missing.
    ModelError
        When the parts do not fit each other.
    """
    density = air_density(source.building.location.elevation)
    handlers = tuple(_air_handler(source, loop, density) for loop in source.layout.air_loops)
    return vav_system(handlers, _loop(source, price_ratio), _terminals(source, density), Thermostat(_TIGHT))


def _terminals(source: EnergyPlusBuilding, density: float) -> Terminals:
    every = source.layout.terminals
    largest = np.array([density * source.size(t.name, "Design Size Maximum Air Flow Rate") for t in every])
    least = largest * np.array([t.minimum_share for t in every])
    coils = [_reheat(source, t, float(m)) for t, m in zip(every, least, strict=True)]
    rise = np.array([(flow / coil.air_flow) ** 0.8 for flow, coil in zip(largest, coils, strict=True)])
    loops = [k for k, loop in enumerate(source.layout.air_loops) for _ in loop.terminals]
    return Terminals(
        design_flow=largest,
        minimum_flow=least,
        heating_flow=least,
        air_film=rise * np.array([coil.air_conductance for coil in coils]),
        water_film=np.array([coil.water_conductance for coil in coils]),
        water_flow=np.array([coil.water_flow for coil in coils]),
        zone=np.array([source.layout.zones.index(t.zone) for t in every]),
        air_handler=np.array(loops),
        discharge_limit=_WARMEST,
        reheat_first=1.0,
    )


def _reheat(source: EnergyPlusBuilding, terminal: Terminal, flow: float) -> WaterCoil:
    if terminal.water_node:
        return _coil(source, terminal.coil, flow)
    films = 2.0 * _PLENTY * 1006.0 * flow if terminal.coil else 1e-3
    return WaterCoil(films, films, flow, flow)


def _coil(source: EnergyPlusBuilding, name: str, flow: float) -> WaterCoil:
    overall = source.size(name, "Design Size U-Factor Times Area Value")
    water = _WATER * source.size(name, "Design Size Maximum Water Flow Rate")
    return WaterCoil(overall * (1.0 + _FILMS), overall * (1.0 + _FILMS) / _FILMS, flow, water)


def _air_handler(source: EnergyPlusBuilding, loop: AirLoop, density: float) -> AirHandler:
    volume = source.size(loop.name, "Design Supply Air Flow Rate")
    kind, name = loop.of_kind("Fan:")[0]
    fields = source.source.find(kind, name)
    pressure = float(fields.get("pressure_rise") or fields["design_pressure_rise"])
    power = source.size(name, "Design Electric Power Consumption")
    fan = Fan(density * volume, pressure, min(250.0, pressure), volume * pressure / power, air_density=density)
    outdoor = density * source.size(loop.controller, "Minimum Outdoor Air Flow Rate") if loop.controller else 0.0
    heating: WaterCoil | Heater | None = None
    for kind, name in loop.of_kind("Coil:Heating:"):
        if kind == "Coil:Heating:Water":
            heating = _coil(source, name, density * source.size(loop.name, "Adjusted Heating Design Air Flow Rate"))
        else:
            electric = kind == "Coil:Heating:Electric"
            fields = source.source.find(kind, name)
            efficiency = 1.0 if electric else float(fields.get("burner_efficiency", 0.8))
            heating = Heater(source.size(name, "Design Size Nominal Capacity"), efficiency, electric)
    return AirHandler(fan, None, _cooling(source, loop), heating, 0.0, outdoor, enthalpy_limit=64_000.0)


def _cooling(source: EnergyPlusBuilding, loop: AirLoop) -> CoolingCoil | None:
    for kind, name in loop.of_kind("Coil:Cooling:"):
        if kind == "Coil:Cooling:DX:TwoSpeed":
            return CoolingCoil(
                source.size(name, "Design Size High Speed Gross Rated Total Cooling Capacity"), coldest=275.15
            )
        if kind.startswith("Coil:Cooling:DX"):
            return CoolingCoil(source.size(name, "Design Size Gross Rated Total Cooling Capacity"), coldest=275.15)
        if kind == "Coil:Cooling:Water":
            load = source.size(name, "Design Size Design Coil Load")
            cop = [float(f["reference_cop"]) for _, _, f in source.source.begins("Chiller:") if "reference_cop" in f]
            return CoolingCoil(
                load, cop[0] if cop else _CHILLER_COP, chilled_water=_CHILLED, auxiliaries=_TOWER,
                capacity_curve=_CONSTANT, input_curve=_CONSTANT,
            )  # fmt: skip
    return None


def _loop(source: EnergyPlusBuilding, price_ratio: float) -> BoilerLoop:
    bare = {"standing_conductance": 0.0, "pipe_conductance": 0.0, "fastest_rise": 1.0}
    if not source.layout.water_loops:
        flow = float(_terminals(source, 1.0).water_flow.sum())
        pump = Pump(flow, 5_000.0, 1_000.0, 0.95, 0.01, 0.0)
        # heat per "fuel" is the ratio, which is below what a boiler's efficiency may be: its curve has the rest
        efficiency = max(price_ratio, 0.5)
        curve = Biquadratic((price_ratio / efficiency, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 1.0), (0.0, 100.0), "price")
        return BoilerLoop(1e7, pump, efficiency, curve, water_volume=1e-3, **bare)
    loop = source.layout.water_loops[0]
    boilers = [source.source.find(kind, name) for kind, name in loop.boilers]
    capacity = sum(source.size(name, "Design Size Nominal Capacity") for _, name in loop.boilers)
    flow = _WATER * source.size(loop.name, "Maximum Loop Flow Rate")
    power = source.size(loop.pumps[0][1], "Design Power Consumption")
    head = float(source.source.find(*loop.pumps[0]).get("design_pump_head", 179_352.0))
    pump = Pump(flow, head, head, head * flow / _WATER / power, 0.01)
    return BoilerLoop(
        capacity, pump, float(boilers[0]["nominal_thermal_efficiency"]), CONSTANT_EFFICIENCY,
        water_volume=source.size(loop.name, "Plant Loop Volume"), **bare,
    )  # fmt: skip
