"""Which actuators of a plant are controlled, and which sensors tell what they do."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mpc.errors import PlantError
from mpc.identify.telemetry import SET, PlantTelemetry
from mpc.loop.actuators import HEATING_SETPOINT, Actuator
from thermal._types import FloatArray
from thermal.case.points import HEATING_POWER

#: A command of a machine, or the setpoint of a zone's own controller.
Role = Literal["machine", "setpoint"]

#: Words of a point that make its actuator a helper of the machine it belongs to, which the plant runs by itself.
_HELPERS = re.compile(r"(^|_)(fan|pump|valve|damper)(_|$)")

#: Powers of a machine itself, in the order of choice where its heat is not measured.
_POWERS = ("electrical_power_sensor", "gas_power_sensor")

#: Share of the largest values that a full load is read from [-], robust against single steps.
FULL = 0.98


@dataclass(frozen=True)
class Machine:
    """An actuator that is controlled, and its sensors.

    Parameters
    ----------
    actuator : Actuator
        What is set.
    role : str
        ``machine`` or ``setpoint``.
    serves : tuple of str
        Zones that its heat may go to.
    heat : str
        Column with its heat; empty where it is not measured.
    power : str
        Column with what it buys; empty for the plant's meters.
    capacity : tuple of tuple of float
        Of a setpoint whose machine has a data sheet: outdoor air [K], rising, and the most heat there [W].
    """

    actuator: Actuator
    role: Role
    serves: tuple[str, ...]
    heat: str = ""
    power: str = ""
    capacity: tuple[tuple[float, float], ...] = ()

    @property
    def name(self) -> str:
        """Of the actuator."""
        return self.actuator.name

    def signal(self, telemetry: PlantTelemetry) -> FloatArray:
        """Heat, or what is bought in its place, shape (n_time,) [W].

        Parameters
        ----------
        telemetry : PlantTelemetry
            Of the plant.
        """
        if self.heat or self.power:
            return telemetry.column(self.heat or self.power)
        bought = telemetry.bought
        return np.asarray(bought - np.quantile(bought, 1.0 - FULL))

    def level(self, telemetry: PlantTelemetry) -> FloatArray:
        """Load as a share of full load, shape (n_time,) [-]; NaN while nothing says it.

        That of a machine is its command, as it was set, else as the plant measures it under the actuator's own name.
        Where none was recorded, and of setpoints, it is the share of the heat of full load, the 98th percentile of what
        was seen, and may be more than 1.

        Parameters
        ----------
        telemetry : PlantTelemetry
            Of the plant.
        """
        low, high = self.actuator.lowest, self.actuator.highest
        told = [telemetry.frame[c] for c in (f"{SET}{self.name}", self.name) if c in telemetry.frame]
        if self.role == "machine" and any(values.notna().any() for values in told):
            command = told[0] if len(told) == 1 else told[0].fillna(told[1])
            return np.asarray((command.to_numpy(dtype=float) - low) / (high - low))
        return np.maximum(self.signal(telemetry) / self.full(telemetry), 0.0)

    def full(self, telemetry: PlantTelemetry) -> float:
        """Heat of full load [W].

        Parameters
        ----------
        telemetry : PlantTelemetry
            Of the plant.

        Raises
        ------
        PlantError
            When it never ran.
        """
        full = float(np.quantile(self.signal(telemetry), FULL))
        PlantError.unless(full > 1.0, f"telemetry: {self.name}", "heat or power at some time", f"{full:g} W")
        return full


def find_machines(
    actuators: Sequence[Actuator],
    columns: Sequence[str],
    zones: Sequence[str],
    wanted: Sequence[str] = (),
    capacities: Mapping[str, tuple[tuple[float, float], ...]] | None = None,
) -> tuple[Machine, ...]:
    """Choose the actuators that are controlled: commands of machines, else setpoints of zones.

    Fans, pumps, valves and dampers are left to the plant where it has other machines: they follow these.

    Parameters
    ----------
    actuators : sequence of Actuator
        Of the plant.
    columns : sequence of str
        What it measures.
    zones : sequence of str
        Names.
    wanted : sequence of str
        Names of actuators in the place of that choice.
    capacities : mapping of str to tuple, optional
        By actuator, what a data sheet says: outdoor air [K] and heat [W], see `Machine`.

    Raises
    ------
    PlantError
        When there is none, a wanted one is not there, or a data sheet is of one that is no setpoint with measured heat.
    """
    sheets = {name: pairs for name, pairs in (capacities or {}).items() if pairs}
    by_name = {a.name: a for a in actuators}
    for name in wanted:
        PlantError.unless_known(name, by_name, "actuators", "one of the plant")
    points = {name: name.rpartition("/")[2] for name in by_name}
    setpoints = [name for name in by_name if points[name] == HEATING_SETPOINT]
    commands = [name for name, a in by_name.items() if a.unit == "1"]
    main = [name for name in commands if not _HELPERS.search(points[name])]
    chosen = [*wanted] or main or commands or setpoints
    expected = "a command of a machine, or a zone_air_heating_temperature_setpoint"
    PlantError.unless(chosen, "actuators", expected, ", ".join(by_name) or "none")
    heats = [c for c in columns if c.rpartition("/")[2] == HEATING_POWER]
    made = []
    for name in chosen:
        entity = name.rpartition("/")[0]
        role: Role = "setpoint" if name in setpoints else "machine"
        own = [c for c in heats if c.rpartition("/")[0] == entity]
        heat = own[0] if own else heats[0] if len(heats) == len(chosen) == 1 else ""
        beside = (entity, heat.rpartition("/")[0])
        power = next((f"{e}/{p}" for e in beside if e for p in _POWERS if f"{e}/{p}" in columns), "")
        PlantError.unless(
            heat or power or len(chosen) == 1, f"actuator {name}", f"a sensor {entity}/{HEATING_POWER} or {_POWERS[0]}",
            "none", "add it to `measurements`, so that machines can be told apart",
        )  # fmt: skip
        PlantError.unless(
            name not in sheets or (role == "setpoint" and heat), f"actuators.{name}.capacity",
            "a setpoint whose heat is measured", "a command" if role == "machine" else "no heat",
        )  # fmt: skip
        made.append(Machine(by_name[name], role, _served(entity, zones), heat, power, sheets.get(name, ())))
    return tuple(made)


def _served(entity: str, zones: Sequence[str]) -> tuple[str, ...]:
    """Zones of an entity: the one of its name, or whose last word it ends in as ``fan_coil_north``; else all."""
    own = [z for z in zones if z == entity] or [z for z in zones if z.split("_")[-1] == entity.split("_")[-1]]
    return (own[0],) if len(own) == 1 else tuple(zones)
