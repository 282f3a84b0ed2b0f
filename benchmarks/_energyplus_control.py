"""Controllers of `mpc_energyplus`: optimal control with a calibrated model, on EnergyPlus as the plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from _energyplus_offices import CONTROL_STEPS, ELECTRICITY, GAS, STEP

from mpc.adapters.energyplus.plant import EnergyPlusPlant
from mpc.adapters.energyplus.system import controller_system
from mpc.control.controller.controller import MpcController
from mpc.control.controller.site import Action, ControllerSettings
from mpc.control.problem.assembly import ComfortOperation
from mpc.control.problem.channels import Channel
from mpc.control.problem.horizon import Horizon
from mpc.loop.actuators import SUPPLY_AIR, SUPPLY_WATER
from mpc.loop.plant import Measurements
from mpc.model import control_model
from mpc.scenario.forecast import Forecast
from mpc.studies.optimal_control import Site, make_controller
from thermal.effects.catalogue import chosen

#: Schedules as the building has them: setpoints half a kelvin inside of the band, an hour before people count.
OPERATION = ComfortOperation(margin=0.5, lead_hours=1.0, widest_occupied=8.0)
#: Of a square metre that is a kelvin outside of its band for an hour [USD/K/h], assumed: a fifth of a dollar a person.
#: Zones count as equally large.
COMFORT_PRICE = 1e-2
#: Half a day ahead: quarters of an hour for two hours, then halves; 8 blocks that grow.
AHEAD = Horizon.growing([(2.0, 900.0), (10.0, 1800.0)], [0.5, 0.5, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0], CONTROL_STEPS * STEP)
WATER = (323.15, 355.35)  # K: no warmer than the building's own


class MeasuredBoundaries:
    """Signals of a controller's model whose boundaries beside outdoor are measured: their last values are held.

    Parameters
    ----------
    inner : callable
        Signals of the controller, whose boundaries stay.
    names : sequence of str
        Boundaries, in the order of the model.
    """

    def __init__(self, inner: Any, names: Sequence[str]) -> None:
        self._inner, self._names = inner, tuple(names)
        self._values = np.full(len(self._names), 293.15)

    def measure(self, measurements: Mapping[str, float]) -> None:
        """Take in what was measured.

        Parameters
        ----------
        measurements : mapping of str to float
            By ``ENTITY/POINT`` [K].
        """
        seen = np.array([measurements[f"{name}/zone_air_temperature_sensor"] for name in self._names])
        self._values = np.where(np.isfinite(seen), seen, self._values)

    def __call__(self, forecast: Forecast, stamps: pd.DatetimeIndex) -> np.ndarray:
        """Lay out boundaries and signals."""
        values = np.array(self._inner(forecast, stamps))
        values[:, : len(self._names)] = self._values
        return values


@dataclass
class Optimal:
    """Optimal control, and what it said.

    Parameters
    ----------
    controller : MpcController
        Who decides.
    boundaries : MeasuredBoundaries
        Of its model.
    """

    controller: MpcController
    boundaries: MeasuredBoundaries

    def __post_init__(self) -> None:
        self.sources: list[str] = []

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Action:
        """Choose the setpoints of the next control step.

        Parameters
        ----------
        measurements : Measurements
            Of the step that has ended.
        forecast : Forecast or None
            Of what comes.
        """
        self.boundaries.measure(measurements)
        action = self.controller.step(measurements, forecast)
        self.sources.append(str(action.source))
        return action


def optimal(
    plant: EnergyPlusPlant,
    parameters: Mapping[str, float],
    effects: Mapping[str, Sequence[str]] | None = None,
    price: float | None = None,
) -> Optimal:
    """Make the controller of a plant.

    Parameters
    ----------
    plant : EnergyPlusPlant
        Which.
    parameters : mapping of str to float
        Of its model, by name; starts for the rest [parameter units].
    effects : mapping of str to sequence of str, optional
        Effects of its model with their zones; none by default.
    price : float, optional
        Of discomfort in a zone [USD/K/h]; `COMFORT_PRICE` times the mean area by default.
    """
    source = plant.source
    model = control_model(source.building, parameters, effects=chosen(effects or {}))
    limits = {a.name: (a.lowest, a.highest) for a in plant.actuators}
    channels = [
        Channel(SUPPLY_AIR, *limits[f"{name}/{SUPPLY_AIR}"], air_handlers=(k,))
        for k, name in enumerate(source.devices.air_handlers)
    ]
    if source.layout.water_loops:
        channels.append(Channel(SUPPLY_WATER, *WATER))
    others = model.network.boundaries[1:]
    price = COMFORT_PRICE * float(plant.scenario.areas.mean()) if price is None else price
    controller = make_controller(
        model, plant, site=Site(source.building, controller_system(source, GAS / ELECTRICITY), source.devices),
        settings=ControllerSettings(comfort_price=price, operation=OPERATION),
        horizon=AHEAD, channels=channels, boundaries=dict.fromkeys(others, 293.15),
    )  # fmt: skip
    boundaries = MeasuredBoundaries(controller.signals, others)
    controller.signals = boundaries
    return Optimal(controller, boundaries)
