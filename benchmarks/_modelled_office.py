"""A model of EnergyPlus' office in its place: what a policy that is trained in the model learns from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from _energyplus_control import OPERATION
from _energyplus_offices import ELECTRICITY, GAS

from mpc.adapters.energyplus.building import EnergyPlusBuilding
from mpc.adapters.energyplus.plant import EnergyPlusPlant
from mpc.adapters.energyplus.system import controller_system
from mpc.loop.noise import SensorNoise
from mpc.loop.operation import scheduled_operation
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.loop.view import PointView, ViewedPlant
from thermal import Building
from thermal.case.building import Device
from thermal.model.reduce import ReducedModel

#: Our plant has hot water; electric reheat is a loop of this name whose water is always as warm as the coils can use.
_REHEAT, _WATER = "electric_reheat", 323.15  # K
_PLENUM = 293.15  # K: beyond the model's boundaries, which the plant measures


def modelled_office(plant: EnergyPlusPlant, model: ReducedModel) -> ViewedPlant:
    """Make the model of a controller a plant, with the measurements and actuators of the plant that it is a model of.

    Plenums, boundaries of the model, stay at one temperature; the air of an air handler is that of its terminals.

    Parameters
    ----------
    plant : EnergyPlusPlant
        The plant, which is not run.
    model : ReducedModel
        The model, of `modelled_building`.
    """
    source, scenario = plant.source, replace(plant.scenario, building=modelled_building(plant.source))
    air = [a for a in plant.actuators if a.name.endswith("supply_air_temperature_setpoint")]
    inner = SimulatedPlant(
        scenario, controller_system(source, GAS / ELECTRICITY), ReducedBuilding(model, step_seconds=scenario.grid.step),
        scheduled_operation(scenario, len(air), lead_hours=OPERATION.lead_hours, margin=OPERATION.margin),
        control_steps=plant.control_steps, noise=SensorNoise(), forecaster=plant.forecaster,
        limits={"supply_air_temperature_setpoint": (air[0].lowest, air[0].highest)},
        boundaries=dict.fromkeys(model.network.boundaries[1:], _PLENUM),
    )  # fmt: skip
    return ViewedPlant(inner, _view(plant, inner), plant.actuators, plant.steps)


def modelled_building(source: EnergyPlusBuilding) -> Building:
    """Give a building with electric reheat the boiler that our plants have.

    Parameters
    ----------
    source : EnergyPlusBuilding
        The building.
    """
    return replace(source.building, devices=(*source.building.devices, Device(name=_REHEAT, type="boiler")))


def _view(plant: EnergyPlusPlant, inner: SimulatedPlant) -> PointView:
    """See the model's plant through the points of the plant."""
    position = {column: k for k, column in enumerate(inner.columns)}
    matrix, constant = np.zeros((len(plant.columns), len(position))), np.zeros(len(plant.columns))
    handler_of = inner.system.terminals.air_handler.tolist()
    for row, column in enumerate(plant.columns):
        entity, point = column.split("/")
        if column in position:
            matrix[row, position[column]] = 1.0
        elif entity in inner.devices.air_handlers:
            mine = inner.devices.air_handlers.index(entity)
            terminals = [t for t, handler in zip(inner.devices.terminals, handler_of, strict=True) if handler == mine]
            matrix[row, [position[f"{terminal}/{point}"] for terminal in terminals]] = 1.0
        else:
            constant[row] = _PLENUM
    return PointView(plant.columns, matrix, constant, {f"{_REHEAT}/supply_water_temperature_setpoint": _WATER})
