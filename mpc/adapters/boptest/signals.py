"""Signals of a plant by BOPTEST's conventions: names, units, ranges and descriptions, and their values after a step."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

from mpc.loop.actuators import (
    DIFFERENTIAL_PRESSURE,
    STATIC_PRESSURE,
)
from mpc.loop.conversion import SIGNAL_UNITS
from mpc.loop.history import PlantStep
from mpc.loop.simulated import SimulatedPlant
from thermal._types import FloatArray
from thermal.case.points import POINT_TYPES, split_column
from thermal.system.system import HvacSystem

Metadata = dict[str, dict[str, Any]]

#: Outputs beside the sensors': true power of the whole plant, means over the plant's step that ends at their time [W].
ELECTRICITY_OUTPUT, GAS_OUTPUT = "reaPEle_y", "reaPGas_y"

_MEANINGS = {
    STATIC_PRESSURE: "setpoint of the supply air's static pressure",
    DIFFERENTIAL_PRESSURE: "setpoint of the heating water's differential pressure",
}


class ObservedPlant(SimulatedPlant):
    """A simulated plant that hands out the step it has just taken."""

    @property
    def last_step(self) -> PlantStep:
        """What the last step of the plant did."""
        return self._kept()[-1]

    @property
    def zone_temperature(self) -> FloatArray:
        """True temperatures of the zones now, shape (n_zone,) [K]."""
        return self._loop.air


def _signal_names(names: Iterable[str]) -> dict[str, str]:
    """Make names of signals of names of points: letters, digits and underscores, each once.

    Parameters
    ----------
    names : iterable of str
        Such as ``ENTITY/POINT``.

    Returns
    -------
    dict of str to str
        Signal by point.

    Examples
    --------
    >>> _signal_names(["AHU 1/gas_power_sensor", "AHU-1/gas_power_sensor"])["AHU-1/gas_power_sensor"]
    'AHU_1_gas_power_sensor_2'
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in names:
        plain = signal = re.sub(r"\W+", "_", name)
        count = 1
        while signal in taken:
            count += 1
            signal = f"{plain}_{count}"
        taken.add(signal)
        found[name] = signal
    return found


class PlantSignals:
    """What of a plant is seen and set through BOPTEST's API.

    Parameters
    ----------
    plant : SimulatedPlant
        Any run of it.

    Attributes
    ----------
    columns : tuple of str
        Of the plant's measurements.
    outputs : tuple of str
        Names of the measurements, ``<name>_y``.
    inputs : dict of str to Actuator
        By the name of the signal, ``<name>_u``.
    """

    def __init__(self, plant: SimulatedPlant) -> None:
        self.columns = plant.columns
        sensors = _signal_names(plant.columns)
        zones = _signal_names(plant.zone_names)
        self._zones = {f"reaTZon_{signal}_y": zone for zone, signal in zones.items()}
        self._sensors = {f"{signal}_y": column for column, signal in sensors.items()}
        self.outputs = (*self._sensors, *self._zones, ELECTRICITY_OUTPUT, GAS_OUTPUT)
        setters = _signal_names(actuator.name for actuator in plant.actuators)
        self.inputs = {f"{setters[actuator.name]}_u": actuator for actuator in plant.actuators}
        self.input_names = tuple(name for u in self.inputs for name in (u, activation(u)))
        self._reads = [_reader(a.name, plant.system, plant.zone_names)
                       for a in plant.actuators]  # fmt: skip

    def measurement_metadata(self) -> Metadata:
        """Describe each output with its unit, as `GET /measurements` does."""
        found: Metadata = {}
        for name, column in self._sensors.items():
            kind = POINT_TYPES[split_column(column, "plant")[1]]
            found[name] = _entry(f"{column}: {kind.meaning}, mean over the last step", SIGNAL_UNITS[kind.quantity])
        for name, zone in self._zones.items():
            found[name] = _entry(f"Air temperature of zone {zone} at this time, without errors of sensors", "K")
        found[ELECTRICITY_OUTPUT] = _entry("Electric power of the whole plant, mean over the last step", "W")
        found[GAS_OUTPUT] = _entry("Gas power of the whole plant (upper heating value), mean over the last step", "W")
        return found

    def input_metadata(self) -> Metadata:
        """Describe each input with its unit and range, as `GET /inputs` does."""
        found: Metadata = {}
        for name, actuator in self.inputs.items():
            point = actuator.name.rpartition("/")[2]
            meaning = _MEANINGS.get(point) or POINT_TYPES[point].meaning
            found[name] = _entry(f"{actuator.name}: {meaning}", actuator.unit, actuator.lowest, actuator.highest)
            found[activation(name)] = _entry(f"Activation of {name}: 1 overwrites, 0 leaves the building's own", None)
        return found

    def output_values(self, seen: FloatArray, step: PlantStep | None, zones: FloatArray) -> list[float]:
        """Values of all outputs, in their order.

        Parameters
        ----------
        seen : ndarray, shape (n_column,)
            What the sensors say [library's units].
        step : PlantStep or None
            The last step; None before the first.
        zones : ndarray, shape (n_zone,)
            True temperatures now [K].
        """
        powers = [0.0, 0.0] if step is None else [float(step.done.electric_power), float(step.done.fuel_power)]
        return [*seen.tolist(), *zones.tolist(), *powers]

    def input_values(self, step: PlantStep) -> list[float]:
        """Values that the plant used in a step, in the order of the inputs: the building's own where not overwritten.

        Parameters
        ----------
        step : PlantStep
            The step.
        """
        return [float(read(step)) for read in self._reads]


def activation(name: str) -> str:
    """Name the signal that activates an input.

    Parameters
    ----------
    name : str
        Of the input, ``<name>_u``.
    """
    return f"{name.removesuffix('_u')}_activate"


def _entry(text: str, unit: str | None, lowest: float | None = None, highest: float | None = None) -> dict[str, Any]:
    return {"Unit": unit, "Description": text, "Minimum": lowest, "Maximum": highest}


def _reader(name: str, system: HvacSystem, zones: Sequence[str]) -> Any:
    """Find where a step holds the value of an actuator."""
    entity, _, kind = name.rpartition("/")
    if name in system.actuators:
        return lambda step: step.actions.get(name, system.defaults.get(name))
    zone = zones.index(entity)
    return lambda step: getattr(step.conditions, kind)[zone]
