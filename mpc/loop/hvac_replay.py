"""Terminals, air handlers and hot water, each replayed by what telemetry says of its surroundings."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pandas as pd

from mpc.errors import MpcError
from mpc.loop.actuators import DIFFERENTIAL_PRESSURE
from mpc.loop.sensors import PlantDevices
from thermal._types import FloatArray
from thermal.case.points import ZONE_TEMPERATURE
from thermal.components.boiler_loop import BoilerLoop
from thermal.components.component import Conditions
from thermal.components.moist_air import WATER_HEAT_CAPACITY
from thermal.components.streams import AirCommand
from thermal.components.water_coil import WaterCoil
from thermal.errors import nearest
from thermal.system.component_replay import TerminalReplay, replay_air_handler, replay_loop, replay_terminals
from thermal.system.system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY

_LEAST_SHARE = 0.02  # of the design flow: less is a fan that is off


class Gap(NamedTuple):
    """What is compared.

    Parameters
    ----------
    subsystem, device, signal, unit : str
        As in `SubsystemGap`.
    """

    subsystem: str
    device: str
    signal: str
    unit: str


class Replayed(NamedTuple):
    """A signal that was replayed.

    Parameters
    ----------
    gap : Gap
        What it is.
    error : ndarray, shape (n_time,)
        Model minus measurement [unit of the gap].
    heat : ndarray, shape (n_time,)
        The same as heat or power [W].
    handled : ndarray, shape (n_time,)
        What the device handles [W].
    hourly : bool
        Whether values are means over hours already.
    """

    gap: Gap
    error: FloatArray
    heat: FloatArray
    handled: FloatArray
    hourly: bool = False


class Measured:
    """What telemetry says of a plant, as arrays in the order of its devices.

    Parameters
    ----------
    frame : DataFrame, shape (n_time, n_column)
        Usable telemetry [library's units].
    devices : PlantDevices
        Names.
    system : HvacSystem
        The plant.
    step : float
        Of the telemetry [s].
    """

    def __init__(self, frame: pd.DataFrame, devices: PlantDevices, system: HvacSystem, step: float) -> None:
        self._frame, self._devices, self.step = frame, devices, step
        terminals, handlers = devices.terminals, devices.air_handlers
        self.flow = self._of(terminals, "supply_air_flowrate_sensor")
        self.discharge = self._of(terminals, "discharge_air_temperature_sensor")
        self.zone = self._of(terminals, ZONE_TEMPERATURE)
        self.damper = self._of(terminals, "supply_air_damper_percentage_command")
        self.valve = self._of(terminals, "heating_water_valve_percentage_command")
        self.supply = self._of(handlers, "supply_air_temperature_sensor")
        self.supply_setpoint = self._of(handlers, "supply_air_temperature_setpoint")
        self.mixed = self._of(handlers, "mixed_air_temperature_sensor")
        self.returning = self._of(handlers, "return_air_temperature_sensor")
        self.outdoor = self._of(handlers, "outside_air_temperature_sensor")
        self.fan_power = self._of(handlers, "supply_fan_power_sensor")
        boiler = [devices.boiler]
        self.water = self._of(boiler, "supply_water_temperature_sensor")[:, 0]
        self.water_setpoint = self._of(boiler, "supply_water_temperature_setpoint")[:, 0]
        if system.of_kind(BoilerLoop):
            self.gas = self._of(boiler, "gas_power_sensor")[:, 0]
        self.entering = self.supply[:, system.terminals.air_handler]
        self.static = self._pressure(handlers, "supply_air_static_pressure_sensor", system.static_pressures)
        usual = system.defaults.get(next(iter(system.by_point.get(DIFFERENTIAL_PRESSURE, ())), ""), 1.0)
        self.differential = self._pressure((devices.boiler,), "differential_pressure_sensor", (usual,))[:, 0]
        self.differential_share = self.differential / usual
        # what is missing keeps its last value where a replay runs on, and is not compared
        self.running = self.flow > _LEAST_SHARE * system.terminals.design_flow
        of_handler = system.terminals.members
        self.supplied = np.nan_to_num(self.flow) @ of_handler
        self.handling = self.supplied > _LEAST_SHARE * (system.terminals.design_flow @ of_handler)

    def power(self, device: str) -> FloatArray:
        """Electric power of a device, shape (n_time,) [W].

        Parameters
        ----------
        device : str
            Name.
        """
        return self._of([device], "electrical_power_sensor")[:, 0]

    def _pressure(self, devices: tuple[str, ...], point: str, usual: tuple[float, ...]) -> FloatArray:
        """Pressures as they were measured, the design ones where they were not, shape (n_time, n_device) [Pa]."""
        columns = [f"{device}/{point}" for device in devices]
        frame = self._frame.reindex(columns=columns).ffill().bfill()
        return np.where(frame.isna(), np.array(usual), np.maximum(frame.to_numpy(dtype=float), 1.0))

    def _of(self, devices: tuple[str, ...] | list[str], point: str) -> FloatArray:
        columns = [f"{device}/{point}" for device in devices]
        for column in columns:
            if column not in self._frame or self._frame[column].isna().all():
                advice = nearest(column, [c for c in self._frame.columns if str(c).endswith(point)])
                raise MpcError("replay: telemetry", f"a usable column {column!r}", "none", advice)
        return self._frame[columns].ffill().bfill().to_numpy(dtype=float)


def replay_plant(
    seen: Measured, system: HvacSystem, devices: PlantDevices, ventilation: FloatArray | float, room: float
) -> list[Replayed]:
    """Replay terminals, air handlers and, of a boiler, hot water.

    Parameters
    ----------
    seen : Measured
        Telemetry.
    system : HvacSystem
        What the plant is thought to be.
    devices : PlantDevices
        Names.
    ventilation : ndarray or float
        Share of the minimum of outdoor air that was asked for [-].
    room : float
        Temperature of the plant room [K].
    """
    statics = seen.static / np.array(system.static_pressures)
    terminals = replay_terminals(
        system.terminals, seen.damper, seen.valve, seen.entering, seen.water,
        statics[:, system.terminals.air_handler], seen.differential_share,
    )  # fmt: skip
    found = _terminals(seen, terminals, devices)
    heating, drawn = np.zeros(len(seen.water)), terminals.water_flow.sum(axis=1)
    compressors = np.zeros(len(seen.water))
    for k, name in enumerate(devices.air_handlers):
        parts, heat, water, compressor = _air_handler(seen, system, k, name, ventilation, devices.chiller is None)
        found += parts
        heating, drawn, compressors = heating + heat, drawn + water, compressors + compressor
    if devices.chiller is not None:
        measured = seen.power(devices.chiller)
        error = compressors - measured
        power = Gap("air handler", devices.chiller, "refrigeration power", "W")
        found.append(Replayed(power, error, error, measured))
    reheat = AIR_HEAT_CAPACITY * seen.flow * np.maximum(seen.discharge - seen.entering, 0.0)
    if not system.of_kind(BoilerLoop):  # other suppliers have no replay by themselves
        return found
    return found + _hot_water(seen, system, devices.boiler, reheat.sum(axis=1) + heating, drawn, room)


def _terminals(seen: Measured, replayed: TerminalReplay, devices: PlantDevices) -> list[Replayed]:
    """Air flow and discharge temperature of the terminals, both as heat at the zone's temperature."""
    rate, lift, found = AIR_HEAT_CAPACITY * seen.flow, seen.discharge - seen.zone, []
    moved = rate * np.maximum(np.abs(lift), np.abs(seen.discharge - seen.entering))
    for k, name in enumerate(devices.terminals):
        on = seen.running[:, k]
        flow = np.where(on, replayed.airflow[:, k] - seen.flow[:, k], np.nan)
        warm = np.where(on, replayed.discharge[:, k] - seen.discharge[:, k], np.nan)
        handled = np.where(on, moved[:, k], np.nan)
        of_flow, of_air = Gap("terminal", name, "air flow", "kg/s"), Gap("terminal", name, "discharge temperature", "K")
        found.append(Replayed(of_flow, flow, AIR_HEAT_CAPACITY * flow * lift[:, k], handled))
        found.append(Replayed(of_air, warm, rate[:, k] * warm, handled))
    return found


def _air_handler(
    seen: Measured, system: HvacSystem, k: int, name: str, ventilation: FloatArray | float, own_meter: bool
) -> tuple[list[Replayed], FloatArray, FloatArray, FloatArray]:
    """Mixing box, coils and fans of an air handler; the heat and the water of its coil, and its compressor's power."""
    handler, flow = system.air_handlers[k], np.where(seen.handling[:, k], seen.supplied[:, k], 0.0)
    on, rate = seen.handling[:, k], AIR_HEAT_CAPACITY * flow
    static = seen.static[:, k]
    outdoor, setpoint, mixed = seen.outdoor[:, k], seen.supply_setpoint[:, k], seen.mixed[:, k]
    conditions = Conditions(None, None, None, outdoor)
    command = AirCommand(setpoint, static, ventilation=ventilation)
    whole = replay_air_handler(handler, flow, seen.returning[:, k], conditions, command, seen.water)
    # the coils alone: air comes as it was measured behind the mixing box
    closed = replace(handler, economizer=False, minimum_outdoor_share=0.0, minimum_outdoor_flow=0.0, exhaust_fan=None)
    coils = replay_air_handler(closed, flow, mixed, conditions, command._replace(ventilation=1.0), seen.water)

    def gap(signal: str, model: FloatArray, real: FloatArray, scale: FloatArray | float, most: FloatArray) -> Replayed:
        error, unit = np.where(on, model - real, np.nan), "W" if isinstance(scale, float) else "K"
        return Replayed(Gap("air handler", name, signal, unit), error, scale * error, np.where(on, most, np.nan))

    mixing = rate * np.maximum(np.abs(seen.returning[:, k] - outdoor), 1.0)
    warming = rate * np.maximum(np.abs(seen.supply[:, k] - mixed), 1.0)
    parts = [
        gap("mixed air temperature", whole.mixed.mixed_temperature, mixed, rate, mixing),
        gap("supply air temperature", coils.supply_temperature, seen.supply[:, k], rate, warming),
        gap("supply fan power", whole.mixed.supply_fan_power, seen.fan_power[:, k], 1.0, seen.fan_power[:, k]),
    ]
    if own_meter:
        power = seen.power(name)
        parts.append(gap("electric power", whole.electric_power, power, 1.0, power))
    heat = np.zeros(len(flow))
    if isinstance(handler.heating, WaterCoil):
        rise = np.divide(handler.supply_fan.heat_to_air * seen.fan_power[:, k], rate, out=np.zeros(len(flow)), where=on)
        heat = rate * np.maximum(seen.supply[:, k] - rise - mixed, 0.0)
        heat = np.where(coils.heating > 0.0, heat, 0.0)  # no noise where the coil is closed
    return parts, heat, coils.water_flow, np.where(on, coils.mixed.cooling_power, 0.0)


def _hot_water(
    seen: Measured, system: HvacSystem, boiler: str, load: FloatArray, drawn: FloatArray, room: float
) -> list[Replayed]:
    """Supply temperature and gas of the boiler under the heat that coils took."""
    loop, on = system.loop, seen.handling.any(axis=1)
    flow = np.where(on, np.maximum(drawn, 1e-9), 0.0)
    heat, first = np.where(on, load, 0.0), float(seen.water[0])
    replayed = replay_loop(loop, heat, flow, seen.water_setpoint, seen.step, first, room, seen.differential)
    pumped = np.maximum(flow, loop.pump.minimum_share * loop.pump.design_flow)
    warm = np.where(on, replayed.supply_temperature - seen.water, np.nan)
    water = Gap("hot water", boiler, "supply water temperature", "K")
    gas = np.where(on, replayed.fuel_power - seen.gas, np.nan)
    handled = np.where(on, np.maximum(load, seen.gas), np.nan)
    # a temperature counts as the heat that the circulating water carries by it
    return [
        Replayed(water, warm, WATER_HEAT_CAPACITY * pumped * warm, handled),
        Replayed(Gap("hot water", boiler, "gas power", "W"), gas, gas, handled),
    ]
