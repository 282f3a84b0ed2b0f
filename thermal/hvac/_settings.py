"""What actions mean for the devices of a plant."""

from __future__ import annotations

from typing import NamedTuple

from thermal.hvac._operations import Operations, Value
from thermal.hvac._step import Actions
from thermal.hvac._system import HvacSystem


class Settings(NamedTuple):
    """Actions as devices take them: one value an air handler, and what pressures drive.

    Parameters
    ----------
    supply_air : tuple of Value
        Setpoints of the supply air [K].
    supply_water : Value
        Setpoint of the supply water [K].
    static_pressure : tuple of Value
        In the ducts [Pa].
    differential_pressure : Value
        Of the loop [Pa].
    running : tuple of Value
        1 while the fans of an air handler run, else 0 [-].
    boiler : Value
        1 while boiler and pump run, else 0 [-].
    ventilation : tuple of Value
        Share of the minimum of outdoor air [-].
    most_airflow : Value
        That goes through open dampers, one a terminal [kg/s].
    opening : Value
        Water through open valves over the design flow [-].
    """

    supply_air: tuple[Value, ...]
    supply_water: Value
    static_pressure: tuple[Value, ...]
    differential_pressure: Value
    running: tuple[Value, ...]
    boiler: Value
    ventilation: tuple[Value, ...]
    most_airflow: Value
    opening: Value


def settings_of(ops: Operations, system: HvacSystem, actions: Actions) -> Settings:
    """Lay actions out for the devices.

    Parameters
    ----------
    ops : Operations
        Arithmetic.
    system : HvacSystem
        The plant.
    actions : Actions
        Of the supervisory controller.
    """
    n, designs, root = len(system.air_handlers), system.static_pressures, ops.scalar.sqrt
    running, design = _each(actions.running, n), system.loop.pump.differential_pressure
    statics = designs if actions.static_pressure is None else _each(actions.static_pressure, n)
    pressure = design if actions.differential_pressure is None else actions.differential_pressure
    reaches = [run * root(p / usual) for run, p, usual in zip(running, statics, designs, strict=True)]
    return Settings(
        _each(actions.supply_air_temperature, n), actions.supply_water_temperature, statics, pressure, running,
        actions.boiler, _each(actions.ventilation, n), system.terminals.most_airflow(ops, reaches),
        actions.boiler * root(pressure / design),
    )  # fmt: skip


def _each(values: Value, n: int) -> tuple[Value, ...]:
    """One value an air handler, where all may have the same."""
    return tuple(values) if isinstance(values, tuple | list) else (values,) * n
