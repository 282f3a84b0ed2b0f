"""The plant's signals under the point names of the case format."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal.errors import HvacParameterError, describe
from thermal.hvac._air_handler import AirHandler, Heater, Warmed
from thermal.hvac._coil import valve_position
from thermal.hvac._operations import StepOperations
from thermal.hvac._step import Actions, Conditions, HvacStep
from thermal.hvac._system import HvacSystem

FloatArray = NDArray[np.float64]

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

    Raises
    ------
    HvacParameterError
        There are too many names, too few, or the same twice.
    """

    def __init__(self, system: HvacSystem, terminals: Sequence[str], air_handlers: Sequence[str], boiler: str) -> None:
        wanted = (len(system.terminals), len(system.air_handlers))
        names = [*terminals, *air_handlers, boiler]
        if (len(terminals), len(air_handlers)) != wanted or len(set(names)) != len(names):
            found = f"{len(terminals)} and {len(air_handlers)}, {len(set(names))} of {len(names)} different"
            expected = f"{wanted[0]} terminals and {wanted[1]} air handlers, all named differently"
            raise HvacParameterError(describe("HvacPoints", expected, found))
        self.system, self._operations, zone = system, StepOperations(), system.terminals.zone
        #: Zone of each terminal; all of them where each zone has one, in order.
        self.zone: Any = slice(None) if np.array_equal(zone, np.arange(system.zone_count)) else zone
        self._designs = [h.supply_fan.static_pressure for h in system.air_handlers]
        entities = [(terminals, _TERMINAL), (air_handlers, _AIR_HANDLER), ([boiler], _LOOP)]
        #: Columns ``ENTITY/POINT`` in the order of `read`, point by point.
        self.columns = tuple(f"{e}/{p}" for devices, points in entities for p in points for e in devices)

    def read(self, conditions: Conditions, actions: Actions, step: HvacStep) -> FloatArray:
        """Read all points after a step.

        Parameters
        ----------
        conditions : Conditions
            Of the step.
        actions : Actions
            For the step.
        step : HvacStep
            What happened.

        Returns
        -------
        numpy.ndarray, shape (n_column,)
            In the library's units: kelvin, kg/s, W, shares.
        """
        terminals, zone, n = self.system.terminals, self.zone, len(self.system.terminals)
        reach = [run * math.sqrt(pressure / design) for run, pressure, design in zip(
            self._each(actions.running), self._each(actions.static_pressure), self._designs, strict=True)]  # fmt: skip
        full = terminals.design_flow * np.array(reach)[terminals.air_handler]
        values = np.empty(len(self.columns))
        own = values[: len(_TERMINAL) * n].reshape(len(_TERMINAL), n)
        own[0], own[1] = conditions.zone_temperature[zone], conditions.heating_setpoint[zone]
        own[2], own[3], own[4] = conditions.cooling_setpoint[zone], step.airflow, step.discharge
        open_share = step.airflow / full if min(reach) > 0.0 else _divided(step.airflow, full)
        np.minimum(open_share, 1.0, out=own[5])
        own[6] = valve_position(self._operations, step.valve_flow, terminals.rangeability)
        gas, heating = zip(*map(_heater_powers, self.system.air_handlers, step.warmed), strict=True)
        mixed = step.mixed
        electric = [
            m.cooling_power + m.supply_fan_power + m.exhaust_fan_power + h for m, h in zip(mixed, heating, strict=True)
        ]
        values[len(_TERMINAL) * n :] = [
            *self._each(actions.supply_air_temperature), *step.supply_temperature,
            *(m.mixed_temperature for m in mixed), *(m.return_temperature for m in mixed),
            *([conditions.outdoor_temperature] * len(mixed)), *(m.supply_fan_power for m in mixed), *electric, *gas,
            actions.supply_water_temperature, step.loop.water, step.return_water, step.fuel_power - sum(gas),
            step.pump_power,
        ]  # fmt: skip
        return values

    def _each(self, values: Any) -> Sequence[float]:
        """Give a value of each air handler; design pressures where there is none."""
        if values is None:
            return self._designs
        return values if isinstance(values, tuple | list) else [values] * len(self._designs)


def _divided(flow: FloatArray, full: FloatArray) -> FloatArray:
    """Divide flows by those of open dampers, 0 where the fans are off."""
    return np.divide(flow, full, out=np.zeros(len(full)), where=full > 0.0)


def _heater_powers(handler: AirHandler, warmed: Warmed) -> tuple[float, float]:
    """Gas and electricity that an air handler's own heater takes [W]."""
    heater = handler.heating
    if not isinstance(heater, Heater):
        return 0.0, 0.0
    power = warmed.direct / heater.efficiency
    return (0.0, power) if heater.electric else (power, 0.0)
