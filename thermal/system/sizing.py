"""Sizes of a building's plant from its loads: terminals, air handlers, boiler, as a designer takes them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from thermal._types import FloatArray
from thermal.case.building import Building, FloorPlans, ZoneTable
from thermal.case.plan import zone_floor_areas
from thermal.components.air_handler import AirHandler
from thermal.components.battery import Battery
from thermal.components.chiller_loop import ChillerLoop
from thermal.components.component import Component
from thermal.components.cooling_coil import CoolingCoil
from thermal.components.fan import Fan
from thermal.components.fan_coils import FanCoils
from thermal.components.mixing_valve import MixingValve
from thermal.components.radiators import HeatedFloors
from thermal.components.registry import COMPONENTS
from thermal.components.terminals import Terminals
from thermal.components.thermostat import Thermostat
from thermal.components.water_coil import WaterCoil
from thermal.components.zone_units import ZoneUnits
from thermal.errors import ModelError
from thermal.model.matrices import SymbolicModel
from thermal.model.step import Stepper
from thermal.network.build import build_network
from thermal.system.connections import Connection
from thermal.system.devices import DeviceGraph, device_graph
from thermal.system.system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY, air_density

_LONG_RUN = 1e8  # s: one implicit step to the steady state
_COARSE = 1.0  # m: loads need no finer grid
_HEATING_SHARE = 0.5  # largest heating flow over design flow: the most that ASHRAE 90.1 lets boxes reheat
_DIVERSITY = 0.85  # zones do not peak together: air handlers carry this share of the terminals' flow


@dataclass(frozen=True)
class DesignConditions:
    """What a plant is sized for.

    Parameters
    ----------
    winter_outdoor : float
        Outdoor temperature [K]; the default is the 99.6 % one of the paper's pilot building's town (ASHRAE Fundamentals
        2017, ch. 14, Moffett Field 3 degC) less 3 K.
    heating, cooling : float
        Temperatures of the zones in winter and summer [K].
    supply_air, supply_water : float
        Of air and hot water at design [K].
    gains : float
        Of people, light and equipment at the most [W/m2]; the default is a reference office's (Deru et al. 2011).
    sun : float
        That enters through glass at the most, per glazed area [W/m2]: 500 W/m2 through a coefficient of 0.4.
    oversizing : float
        Of terminals and boiler in heating [-], 1 to 3; the default is ASHRAE 90.1-2019's (appendix G).
    least_flow : float
        Of terminals per floor area [kg/s/m2]; the default is half a cubic foot a minute per square foot.

    Raises
    ------
    ModelError
        When temperatures are out of order or a number is out of its range.
    """

    winter_outdoor: float = 273.15
    heating: float = 294.15
    cooling: float = 297.15
    supply_air: float = 285.95
    supply_water: float = 355.35
    gains: float = 26.0
    sun: float = 200.0
    oversizing: float = 1.25
    least_flow: float = 0.003

    def __post_init__(self) -> None:
        rising = (200.0, self.winter_outdoor, self.supply_air, self.heating, self.cooling, self.supply_water, 373.15)
        if not (np.diff(rising) > 0.0).all():
            raise ModelError("design conditions", "temperatures in order", f"{rising[1:-1]} K")
        if not (1.0 <= self.oversizing <= 3.0 and min(self.gains, self.sun) >= 0.0 and self.least_flow > 0.0):
            found = f"{self.oversizing}, {self.gains}, {self.sun} and {self.least_flow}"
            raise ModelError("design conditions", "positive loads, oversizing from 1 to 3", found)


def size_system(
    building: Building, design: DesignConditions | None = None, thermostat: Thermostat | None = None
) -> HvacSystem:
    """Size the plant of a building: a terminal with reheat a zone, an air handler a device of type ``ahu``, one boiler.

    Other devices in zones, such as radiators or fan coils, get the loads of their zones, by the `sized` of their class;
    a building in which they are in every zone, with no terminal and no air handler, has none. What makes the hot water
    is of the class of the first device that does, or a boiler; a tank stands between, and a mixing valve before floors.
    Heating loads are those of the steady state in the winter, from the building's model with its starting parameters;
    cooling flows are those of gains, sun and warmth outdoors. Which air handler feeds which zone says
    `thermal.system.devices.device_graph`.

    Parameters
    ----------
    building : Building
        With floor plans or a zone table, and its devices; without any of type ``ahu`` it gets one.
    design : DesignConditions, optional
        What it is sized for.
    thermostat : Thermostat, optional
        Of every zone.

    Returns
    -------
    HvacSystem
        One terminal a zone, in the order of the zones.

    Raises
    ------
    ModelError
        When a device is fed by one that the building does not have, or its class cannot be sized.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> system = size_system(load_bundled_case().building)
    >>> len(system.terminals), bool(system.loop.capacity > 0.0)
    (5, True)
    """
    at, areas = design or DesignConditions(), _floor_areas(building)
    loss = np.maximum(_heat_loss(building, at), 0.0) * at.oversizing
    summer = at.gains * areas + at.sun * _glass(building) + loss / (at.heating - at.winter_outdoor) * 11.0
    drop, rise = at.cooling - at.supply_air, 305.15 - at.heating
    flow = np.maximum(summer / (AIR_HEAT_CAPACITY * drop), at.least_flow * areas)
    flow = np.maximum(flow, loss / (AIR_HEAT_CAPACITY * rise * _HEATING_SHARE))
    reheat = loss + AIR_HEAT_CAPACITY * _HEATING_SHARE * flow * (at.heating - at.supply_air)
    graph = device_graph(building)
    parts: dict[str, Component] = {}
    for kind, devices in graph.emitters.items():  # those of a zone share the heat that it loses, and its cooling
        zone = np.array([building.zone_names.index(str(device.zone)) for device in devices], dtype=np.intp)
        share = 1.0 / np.bincount(zone)[zone]
        heat, cooling = (load[zone] * share for load in (loss, summer))
        given: dict[str, Any] = {"cooling": cooling} if issubclass(COMPONENTS[kind], ZoneUnits) else {}
        parts[kind.upper()] = COMPONENTS[kind].sized(heat, zone, **given)
        if isinstance(group := parts[kind.upper()], FanCoils) and not graph.chills:
            parts[kind.upper()] = replace(group, cools=False)
    if graph.has_battery:
        parts[Battery.device.upper()] = Battery.sized(float(areas.sum()))
    capacity = float(loss.sum())
    if graph.has_air:
        terminals = Terminals.sized(
            flow, reheat, air_handler=graph.serving, water_temperature=at.supply_water, supply_temperature=at.supply_air
        )
        density = air_density(building.location.elevation)
        numbers = range(graph.serving.max() + 1)
        handlers = {f"AHU_{k}": _air_handler(float(flow[graph.serving == k].sum()), at, density) for k in numbers}
        coils = [h.heating for h in handlers.values() if isinstance(h.heating, WaterCoil)]
        capacity = float(reheat.sum()) + sum(c.air_flow * AIR_HEAT_CAPACITY * 12.0 for c in coils)
        parts = {"VAV": terminals, **handlers, **parts}
    return joined(parts, graph, capacity, float(summer.sum()), thermostat)


def joined(
    parts: Mapping[str, Component], graph: DeviceGraph, capacity: float, cooling: float, thermostat: Thermostat | None
) -> HvacSystem:
    """Join what stands in zones and air handlers with what makes water for them, sized for it.

    Parameters
    ----------
    parts : mapping of str to Component
        Terminals, air handlers and groups, by name.
    graph : DeviceGraph
        Of the building's devices.
    capacity, cooling : float
        Largest heat and cold of the water [W].
    thermostat : Thermostat or None
        Of every zone.
    """
    handlers = tuple(name for name, part in parts.items() if isinstance(part, AirHandler))
    links = [Connection("VAV", "supply_air", handlers)] if handlers else []
    wet = {name: part for name, part in parts.items() if _draws(part, "water")}
    cold = {name: part for name, part in parts.items() if _draws(part, "chilled_water")}
    made: dict[str, Component] = {}
    floors = [name for name in wet if isinstance(parts[name], HeatedFloors)]
    chain = [kind for kind in graph.water if kind != MixingValve.device or floors]
    flow = float(sum(_water(part) for part in wet.values()))
    before = ""
    for kind in chain if wet else ():
        valve = kind == MixingValve.device
        through = sum(_water(parts[name]) for name in floors) if valve else flow
        made[kind.upper()] = part = COMPONENTS[kind].sized(capacity, float(through))
        links += [Connection(kind.upper(), port.name, (before,)) for port in part.connectors if not port.supplies]
        before = before if valve else kind.upper()
    valve_name = MixingValve.device.upper()
    for name in wet:
        supplier = valve_name if name in floors and valve_name in made else before
        links.append(Connection(name, "hot_water", (supplier,)))
    if cold:
        chiller = ChillerLoop.device.upper()
        through = sum(np.sum(part.chilled_flow) for part in cold.values() if isinstance(part, FanCoils))
        made[chiller] = ChillerLoop.sized(cooling, float(through))
        links += [Connection(name, "chilled_water", (chiller,)) for name in cold]
    return HvacSystem({**parts, **made}, tuple(links), thermostat or Thermostat())


def _draws(part: Component, quantity: str) -> bool:
    """Whether a component draws water of a kind."""
    coil = isinstance(part, AirHandler) and not isinstance(part.heating, WaterCoil)
    return not coil and any(p.quantity == quantity and not p.supplies for p in part.connectors)


def _water(part: Component) -> float:
    """Hot water through the open valves of a component [kg/s]."""
    drawing: Any = part.heating if isinstance(part, AirHandler) else part
    return float(np.sum(drawing.water_flow))


def _air_handler(flow: float, at: DesignConditions, density: float) -> AirHandler:
    """Size an air handler for the flow of its terminals: fans, cooling, and heating of the winter's mixed air."""
    supplied = _DIVERSITY * flow
    cooling = 1.3 * AIR_HEAT_CAPACITY * supplied * (at.cooling + 1.0 - at.supply_air)  # a quarter is latent
    power, mixed = 12.0 * AIR_HEAT_CAPACITY * supplied, at.supply_air - 4.0
    heating = WaterCoil.sized(power, supplied, mixed, water_temperature=at.supply_water)
    supply, exhaust = (Fan(supplied, 1000.0, 250.0, air_density=density),
                       Fan(supplied, 300.0, 100.0, air_density=density))  # fmt: skip
    return AirHandler(supply, exhaust, CoolingCoil(cooling), heating, enthalpy_limit=64_000.0)


def _heat_loss(building: Building, at: DesignConditions) -> FloatArray:
    """Heat that holds the zones at their temperature in the winter, shape (n_zone,) [W]."""
    network = build_network(building, dx=_COARSE if isinstance(building.geometry, FloorPlans) else None)
    matrices = SymbolicModel(network).matrices(network.start())
    outside = np.full((matrices.n_boundary, 1), at.winter_outdoor)
    zones = np.full((len(network.zones), 1), at.heating)
    stepper = Stepper(matrices, _LONG_RUN)
    return stepper.hold(at.heating * matrices.uniform[:, None], outside, zones)[2]


def _floor_areas(building: Building) -> FloatArray:
    """Floor area of each zone, shape (n_zone,) [m2]."""
    if isinstance(building.geometry, ZoneTable):
        return np.array([zone.floor_area for zone in building.geometry.zones])
    areas = zone_floor_areas(building.geometry)
    return np.array([areas[zone] for zone in building.zone_names])


def _glass(building: Building) -> FloatArray:
    """Glazed area of each zone, shape (n_zone,) [m2]."""
    if isinstance(building.geometry, ZoneTable):
        windows = [s for s in building.geometry.surfaces if s.kind == "window"]
        return np.array([sum(s.area for s in windows if s.zone == zone) for zone in building.zone_names], dtype=float)
    glazing = building.geometry.glazing
    return np.array([sum(glazing.get(zone, {}).values()) for zone in building.zone_names], dtype=float)
