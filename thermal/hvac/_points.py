"""The plant's signals under the point names of the case format."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from thermal.errors import HvacParameterError, describe
from thermal.hvac._air_handler import Heater
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
        self.system = system
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
        system, terminals, ops = self.system, self.system.terminals, StepOperations()
        zone, handlers = terminals.zone, range(len(system.air_handlers))

        def each(values: object, designs: list[float] | None = None) -> list[float]:
            if values is None:
                return designs or []
            return list(values) if isinstance(values, tuple | list) else [values] * len(handlers)  # type: ignore[list-item]

        designs = [h.supply_fan.static_pressure for h in system.air_handlers]
        pressure = np.array(each(actions.static_pressure, designs)) / designs
        reach = np.sqrt(pressure)[terminals.air_handler] * np.array(each(actions.running))[terminals.air_handler]
        damper = np.divide(step.airflow, terminals.design_flow * reach, out=np.zeros(len(zone)), where=reach > 0.0)
        gas = [
            w.direct / h.heating.efficiency if isinstance(h.heating, Heater) and not h.heating.electric else 0.0
            for h, w in zip(system.air_handlers, step.warmed, strict=True)
        ]
        electric = [
            m.cooling_power + m.supply_fan_power + m.exhaust_fan_power
            + (w.direct / h.heating.efficiency if isinstance(h.heating, Heater) and h.heating.electric else 0.0)
            for h, m, w in zip(system.air_handlers, step.mixed, step.warmed, strict=True)
        ]  # fmt: skip
        return np.concatenate([
            conditions.zone_temperature[zone], conditions.heating_setpoint[zone], conditions.cooling_setpoint[zone],
            step.airflow, step.discharge, np.minimum(damper, 1.0),
            valve_position(ops, step.valve_flow, terminals.rangeability),
            each(actions.supply_air_temperature), list(step.supply_temperature),
            [m.mixed_temperature for m in step.mixed], [m.return_temperature for m in step.mixed],
            [conditions.outdoor_temperature] * len(handlers), [m.supply_fan_power for m in step.mixed], electric, gas,
            [actions.supply_water_temperature, step.loop.water, step.return_water, step.fuel_power - sum(gas),
             step.pump_power],
        ])  # fmt: skip
