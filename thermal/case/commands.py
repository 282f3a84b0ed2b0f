"""Devices whose heat no meter tells: it follows from valves, dampers, or a counter where their water is heated."""

from collections.abc import Collection, Iterator, Sequence

import pandas as pd

from thermal.case.building import Building, Commanded, Device
from thermal.case.points import DISCHARGE_TEMPERATURE, HEATING_POWER, SUPPLY_FLOW
from thermal.units import AIR_HEAT_CAPACITY

DAMPER, VALVE = "supply_air_damper_percentage_command", "heating_water_valve_percentage_command"
_SUPPLY_AIR, _SUPPLY_WATER = "supply_air_temperature_sensor", "supply_water_temperature_sensor"
GAS = "gas_power_sensor"

#: Room and difference of water to room that an open valve's heat is for [K] (EN 442-2: 75/65/20 degC gives 50 K).
_ROOM, _EXCESS = 293.15, 50.0


def command_signals(building: Building, frame: pd.DataFrame, temperatures: pd.DataFrame) -> pd.DataFrame:
    """Give what the parameters of `Building.commanded` are multiplied by.

    Parameters
    ----------
    building
        With such devices.
    frame
        Usable telemetry, shape (n_time, n_column) [library's units].
    temperatures
        Of the zones, shape (n_time, n_zone) [K].

    Returns
    -------
    DataFrame
        Shape (n_time, n_commanded), NaN where something is missing: of a damper the heat that fully open it brings per
        flow [J/kg]; of a valve its opening, times the water's excess temperature over 50 K where that is measured [-];
        of a counter the power [W].
    """
    signals = {}
    for number, own in enumerate(building.commanded):
        first, *rest = (frame[column] for column in own.columns)
        if own.kind == "damper":
            signals[number] = first * AIR_HEAT_CAPACITY * (rest[0] - temperatures[own.zone])
        else:
            signals[number] = first * ((rest[0] - _ROOM) / _EXCESS) if rest else first
    return pd.DataFrame(signals, index=frame.index, dtype=float)


def commanded_devices(building: Building, columns: Collection[str]) -> tuple[Commanded, ...]:
    """Find devices whose heat has to be fitted.

    Parameters
    ----------
    building
        With its devices and what they are fed by.
    columns
        Names of the telemetry's columns.
    """
    return tuple(found for device in building.devices for found in _of_device(building, device, columns))


def _of_device(building: Building, device: Device, columns: Collection[str]) -> Iterator[Commanded]:
    if device.zone is None:
        return
    flow, discharge, power, damper, valve = told = _told(device, columns)
    air, water = air_column(building, device, columns), _fed(building, device, (_SUPPLY_WATER,), columns)
    if damper and not flow and air is not None:
        yield Commanded(device.name, device.zone, "damper", (f"{device.name}/{DAMPER}", air))
    if valve and not power and not (discharge and (flow or damper)):
        yield Commanded(device.name, device.zone, "valve", (f"{device.name}/{VALVE}", *([water] if water else [])))
    if not any(told):
        counter = _fed(building, device, (HEATING_POWER, GAS), columns)
        if counter is None:
            return
        others = _fed_by(building, counter.partition("/")[0])
        if not any(any(_told(d, columns)) for d in others):
            yield Commanded(device.name, device.zone, "counter", (counter,))


def air_column(building: Building, device: Device, columns: Collection[str]) -> str | None:
    """Where the temperature of a terminal's air is measured: by itself, or where the air is made that it lets pass.

    Air that a coil of the terminal warms is that of its air handler if the coil's valve tells the rest.

    Parameters
    ----------
    building
        With its devices and what they are fed by.
    device
        The terminal.
    columns
        Names of the telemetry's columns.
    """
    own = f"{device.name}/{DISCHARGE_TEMPERATURE}"
    if own in columns:
        return own
    kinds = {d.name: d.type for d in building.devices}
    warmed = any(kinds[name] == "boiler" for name in device.fed_by)
    told = not warmed or f"{device.name}/{VALVE}" in columns
    return _fed(building, device, (_SUPPLY_AIR, DISCHARGE_TEMPERATURE), columns) if told else None


def _fed(building: Building, device: Device, points: Sequence[str], columns: Collection[str]) -> str | None:
    """First column of these points that a device's feeders have, the nearest first."""
    by_name, feeders = {d.name: d for d in building.devices}, list(device.fed_by)
    for name in feeders:
        found = next((f"{name}/{point}" for point in points if f"{name}/{point}" in columns), None)
        if found is not None:
            return found
        feeders += [f for f in by_name[name].fed_by if f not in feeders]
    return None


def _fed_by(building: Building, feeder: str) -> list[Device]:
    """Devices of zones that a feeder feeds, through others too."""
    reached = {feeder}
    for _ in building.devices:
        reached |= {d.name for d in building.devices if reached & set(d.fed_by)}
    return [d for d in building.devices if d.name in reached and d.zone is not None]


def _told(device: Device, columns: Collection[str]) -> tuple[bool, ...]:
    """Which points of a device tell its heat: flow, discharge temperature, power, damper, valve."""
    points = (SUPPLY_FLOW, DISCHARGE_TEMPERATURE, HEATING_POWER, DAMPER, VALVE)
    return tuple(f"{device.name}/{point}" in columns for point in points)
