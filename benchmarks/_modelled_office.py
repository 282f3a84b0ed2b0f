"""A model of EnergyPlus' office in its place: what a policy that is trained in the model learns from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from _energyplus_control import OPERATION
from _energyplus_offices import ELECTRICITY, GAS
from numpy.typing import NDArray

from mpc.adapters.energyplus.building import EnergyPlusBuilding
from mpc.adapters.energyplus.plant import EnergyPlusPlant
from mpc.adapters.energyplus.system import controller_system
from mpc.kpi.record import PlantRecord
from mpc.loop.history import RecentSteps
from mpc.loop.noise import SensorNoise
from mpc.loop.operation import scheduled_operation
from mpc.loop.plant import Measurements, PointLayout
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.forecast import Forecast
from thermal import Building
from thermal.case.building import Device
from thermal.model.reduce import ReducedModel

#: Our plant has hot water; electric reheat is a loop of this name whose water is always as warm as the coils can use.
_REHEAT, _WATER = "electric_reheat", 323.15  # K
_PLENUM = 293.15  # K: beyond the model's boundaries, which the plant measures


class ModelledOffice:
    """The model of a controller as plant, with the measurements and actuators of the plant that it is a model of.

    Plenums, boundaries of the model, stay at one temperature; the air of an air handler is that of its terminals.

    Parameters
    ----------
    plant : EnergyPlusPlant
        The plant, which is not run.
    model : ReducedModel
        The model, of `modelled_building`.
    """

    def __init__(self, plant: EnergyPlusPlant, model: ReducedModel) -> None:
        source, building = plant.source, modelled_building(plant.source)
        self.scenario, self.forecaster = replace(plant.scenario, building=building), plant.forecaster
        air = [a for a in plant.actuators if a.name.endswith("supply_air_temperature_setpoint")]
        system = controller_system(source, GAS / ELECTRICITY)
        self._inner = SimulatedPlant(
            self.scenario, system, ReducedBuilding(model, step_seconds=plant.scenario.grid.step),
            scheduled_operation(self.scenario, len(air), lead_hours=OPERATION.lead_hours, margin=OPERATION.margin),
            control_steps=plant.control_steps, noise=SensorNoise(), forecaster=plant.forecaster,
            limits={"supply_air_temperature_setpoint": (air[0].lowest, air[0].highest)},
            boundaries=dict.fromkeys(model.network.boundaries[1:], _PLENUM),
        )  # fmt: skip
        self.actuators, self.control_step, self.zone_names = plant.actuators, plant.control_step, plant.zone_names
        self._layout = PointLayout(plant.columns, building.location.timezone)
        self._reader = _reader(plant, self._inner)
        self._steps = plant.steps

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the measurements, those of the plant."""
        return self._layout.columns

    @property
    def finished(self) -> bool:
        """Whether the run is over."""
        return self._inner.now + self._inner.control_steps > self._steps

    def reset(self, seed: int | None = None) -> Measurements:
        """Start anew.

        Parameters
        ----------
        seed : int, optional
            Of the sensors' noise.
        """
        return self._seen(self._inner.reset(seed))

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Hold setpoints for a control step.

        Parameters
        ----------
        actions : mapping of str to float
            Supply air of the air handlers [K].
        """
        return self._seen(self._inner.step({**actions, f"{_REHEAT}/supply_water_temperature_setpoint": _WATER}))

    def forecast(self) -> Forecast:
        """Forecast the steps from now on."""
        return self._inner.forecast()

    def record(self) -> PlantRecord:
        """Give the run since the reset."""
        return self._inner.record()

    def recent(self, steps: int) -> RecentSteps:
        """Give the last steps of `record`.

        Parameters
        ----------
        steps : int
            How many of the plant's own steps.
        """
        return self._inner.recent(steps)

    def _seen(self, inner: Measurements) -> Measurements:
        return Measurements(self._layout, inner.seconds, lambda: self._reader @ np.append(inner.values_array, _PLENUM))


def modelled_building(source: EnergyPlusBuilding) -> Building:
    """Give a building with electric reheat the boiler that our plants have.

    Parameters
    ----------
    source : EnergyPlusBuilding
        The building.
    """
    return replace(source.building, devices=(*source.building.devices, Device(name=_REHEAT, type="boiler")))


def _reader(plant: EnergyPlusPlant, inner: SimulatedPlant) -> NDArray[np.float64]:
    """Matrix from what the model's plant measures, and the plenums' temperature, to what the plant does."""
    position = {column: k for k, column in enumerate(inner.columns)}
    reader = np.zeros((len(plant.columns), len(position) + 1))
    handler_of = inner.system.terminals.air_handler.tolist()
    for row, column in enumerate(plant.columns):
        entity, point = column.split("/")
        if column in position:
            reader[row, position[column]] = 1.0
        elif entity in inner.devices.air_handlers:
            mine = inner.devices.air_handlers.index(entity)
            terminals = [t for t, handler in zip(inner.devices.terminals, handler_of, strict=True) if handler == mine]
            reader[row, [position[f"{terminal}/{point}"] for terminal in terminals]] = 1.0
        else:
            reader[row, -1] = 1.0
    return reader
