"""The perfect bound: optimal control that knows model, state, weather and people."""

from __future__ import annotations

import numpy as np

from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.kalman import KalmanFilter
from mpc.control.controller.observer import Observer
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.studies.controller import LASTING, SENSOR_NOISE, UNMEASURED, held_space
from thermal._types import FloatArray
from thermal.model.modal import modal_model
from thermal.model.reduce import ReducedModel

#: Unmeasured heat of a plant that is known, but for the random shuffle of its air [W/m2].
SHUFFLED = 1.0


def knowing_observer(model: ReducedModel, plant: SimulatedPlant) -> Observer | DisturbanceModel:
    """Make the observer of a controller that has the plant's own parameters.

    Parameters
    ----------
    model : ReducedModel
        With the parameters of the plant's building.
    plant : SimulatedPlant
        To be controlled.

    Returns
    -------
    Observer or DisturbanceModel
        `KnownState` where the plant's building is such a model; else hardly any unmeasured heat is expected.
    """
    if isinstance(plant.model, ReducedBuilding):
        return KnownState(model, plant)
    return DisturbanceModel(SHUFFLED * plant.scenario.areas, LASTING, SENSOR_NOISE)


class KnownState(Observer):
    """Reads the state off the plant's building in the place of estimating it; there is no unmeasured heat.

    Parameters
    ----------
    model : ReducedModel
        That the plant's building was made of.
    plant : SimulatedPlant
        Whose building is a `ReducedBuilding` of that model.
    """

    def __init__(self, model: ReducedModel, plant: SimulatedPlant) -> None:
        modes = modal_model(model.matrices(model.theta))
        expected = DisturbanceModel(UNMEASURED * plant.scenario.areas, LASTING, SENSOR_NOISE)
        super().__init__(KalmanFilter(held_space(modes, plant.control_step), expected), modes)
        self._plant = plant

    def start(self, zone: FloatArray, boundary: FloatArray) -> None:
        """Take the state.

        Parameters
        ----------
        zone, boundary : ndarray
            Without effect [K].
        """
        building = self._plant.model
        if isinstance(building, ReducedBuilding):
            self.state[: self.order] = building.modal_state

    def update(self, zone: FloatArray, heat: FloatArray, boundary: FloatArray) -> FloatArray:
        """Take the state.

        Parameters
        ----------
        zone, heat, boundary : ndarray
            Without effect [K], [W], [K].

        Returns
        -------
        ndarray, shape (n_zone,)
            Innovations: none [K].
        """
        self.start(zone, boundary)
        return np.zeros(len(zone))
