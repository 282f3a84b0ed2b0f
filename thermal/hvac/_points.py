"""The plant's signals under the point names of the case format."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from thermal._types import FloatArray
from thermal.errors import ModelError, describe
from thermal.hvac._air_handler import Heater
from thermal.hvac._coil import valve_position
from thermal.hvac._operations import StepOperations
from thermal.hvac._settings import Settings, settings_of
from thermal.hvac._step import Actions, Conditions, HvacStep
from thermal.hvac._system import HvacSystem

_LEAST = 1e-6  # kg/s: less air is none, and the dampers of an air handler that is off are shut
_TERMINAL = (
    "zone_air_temperature_sensor", "zone_air_heating_temperature_setpoint", "zone_air_cooling_temperature_setpoint",
    "supply_air_flowrate_sensor", "discharge_air_temperature_sensor", "supply_air_damper_percentage_command",
    "heating_water_valve_percentage_command",
)  # fmt: skip
_AIR_HANDLER = (
    "supply_air_temperature_setpoint", "supply_air_temperature_sensor", "mixed_air_temperature_sensor",
    "return_air_temperature_sensor", "outside_air_temperature_sensor", "supply_fan_power_sensor",
    "electrical_power_sensor", "gas_power_sensor",
)  # fmt: skip
_LOOP = (
    "supply_water_temperature_setpoint", "supply_water_temperature_sensor", "return_water_temperature_sensor",
    "gas_power_sensor", "pump_power_sensor",
)  # fmt: skip
_DUCT = ("supply_air_static_pressure_setpoint", "supply_air_static_pressure_sensor")
_PUMP = ("differential_pressure_setpoint", "differential_pressure_sensor")


class HvacPoints:
    """Reads the devices of a plant as telemetry does, without noise.

    Parameters
    ----------
    system : HvacSystem
        The plant.
    terminals, air_handlers : sequence of str
        Names of the devices, in the order of the system.
    boiler : str
        Name of the boiler.
    pressures : bool
        Whether the pressures of ducts and loop are read too, their drives holding the setpoints while they run.

    Raises
    ------
    ModelError
        There are too many names, too few, or the same twice.
    """

    def __init__(
        self,
        system: HvacSystem,
        terminals: Sequence[str],
        air_handlers: Sequence[str],
        boiler: str,
        pressures: bool = False,
    ) -> None:
        wanted = (len(system.terminals), len(system.air_handlers))
        names = [*terminals, *air_handlers, boiler]
        if (len(terminals), len(air_handlers)) != wanted or len(set(names)) != len(names):
            found = f"{len(terminals)} and {len(air_handlers)}, {len(set(names))} of {len(names)} different"
            expected = f"{wanted[0]} terminals and {wanted[1]} air handlers, all named differently"
            raise ModelError(describe("HvacPoints", expected, found))
        self.system, self._ops = system, StepOperations()
        self._heaters = [h.heating if isinstance(h.heating, Heater) else None for h in system.air_handlers]
        self._electric = [h is not None and h.electric for h in self._heaters]
        entities = [(terminals, _TERMINAL), (air_handlers, _AIR_HANDLER), ([boiler], _LOOP)]
        if pressures:
            entities += [(air_handlers, _DUCT), ([boiler], _PUMP)]
        self._pressures = pressures
        #: Columns ``ENTITY/POINT`` in the order of `read`, point by point.
        self.columns = tuple(f"{e}/{p}" for devices, points in entities for p in points for e in devices)

    def read(
        self, conditions: Conditions, actions: Actions, step: HvacStep, discharge: FloatArray | None = None
    ) -> FloatArray:
        """Read all points after a step.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        actions : Actions
            For the step.
        step : HvacStep
            What happened.
        discharge : numpy.ndarray, shape (n_terminal,), optional
            What the sensors in the discharge air say [K]; the step's own by default.

        Returns
        -------
        numpy.ndarray, shape (n_column,)
            In the library's units: kelvin, kg/s, W, shares.
        """
        terminals, settings = self.system.terminals, settings_of(self._ops, self.system, actions)
        zone, outdoor = terminals.zone, conditions.outdoor_temperature
        most = settings.most_airflow
        damper = np.minimum(step.airflow / most, 1.0) * (most > _LEAST)
        coils = zip(self._heaters, step.warmed, strict=True)
        direct = [0.0 if coil is None else done.direct / coil.efficiency for coil, done in coils]
        gas = [0.0 if electric else taken for electric, taken in zip(self._electric, direct, strict=True)]
        meters = [
            m.cooling_power + m.supply_fan_power + m.exhaust_fan_power + taken - burned
            for m, taken, burned in zip(step.mixed, direct, gas, strict=True)
        ]
        return np.concatenate([
            conditions.zone_temperature[zone], conditions.heating_setpoint[zone], conditions.cooling_setpoint[zone],
            step.airflow, step.discharge if discharge is None else discharge, damper,
            valve_position(self._ops, step.valve_flow, terminals.rangeability),
            [
                *settings.supply_air, *step.supply_temperature, *[m.mixed_temperature for m in step.mixed],
                *[m.return_temperature for m in step.mixed], *[outdoor] * len(step.mixed),
                *[m.supply_fan_power for m in step.mixed], *meters, *gas,
                settings.supply_water, step.loop.water, step.return_water, step.fuel_power - sum(gas), step.pump_power,
                *(_pressures(settings) if self._pressures else ()),
            ],
        ])  # fmt: skip


def _pressures(settings: Settings) -> list[float]:
    """Pressures of ducts and loop, setpoints and what sensors say of them [Pa]."""
    static, loop = settings.static_pressure, settings.differential_pressure
    held = [run * pressure for run, pressure in zip(settings.running, static, strict=True)]
    return [*static, *held, loop, settings.boiler * loop]
