"""A plant of ours seen through the points of another building: what a policy for that building can learn on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import Actuator
from mpc.loop.history import RecentSteps
from mpc.loop.plant import Measurements, PointLayout
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.components.operations import Value


@dataclass(frozen=True, eq=False)
class PointView:
    """Other points than a plant's own.

    Parameters
    ----------
    columns : tuple of str
        What is measured, ``ENTITY/POINT``.
    matrix : ndarray, shape (n_column, n_own)
        What of the plant's own measurements each is made of [library's units of the column over those of the plant].
    constant : ndarray, shape (n_column,)
        What is added [library's units].
    held : mapping of str to float
        Setpoints that nobody acts upon [K] or [Pa].
    """

    columns: tuple[str, ...]
    matrix: FloatArray
    constant: FloatArray
    held: Mapping[str, float]

    def of(self, own: Value) -> Value:
        """Give the columns.

        Parameters
        ----------
        own : Value, shape (n_own,)
            Measurements of the plant, or such that are traced [library's units].
        """
        return self.matrix @ own + self.constant

    def same(self, other: "PointView") -> bool:
        """Tell whether another view shows and holds the same.

        Parameters
        ----------
        other : PointView
            The other.
        """
        alike = self.columns == other.columns and self.held == other.held
        return alike and np.array_equal(self.matrix, other.matrix) and np.array_equal(self.constant, other.constant)


class ViewedPlant:
    """A plant with the measurements and actuators of another one, such as the building that it is a model of.

    Parameters
    ----------
    plant : SimulatedPlant
        What is stepped.
    view : PointView
        What is seen and held of it.
    actuators : sequence of Actuator
        What is set beside `PointView.held`, under the plant's own names.
    steps : int, optional
        Of the scenario, after which it is finished; all that it has by default.

    Raises
    ------
    PlantError
        When the view is of another plant.
    """

    def __init__(
        self, plant: SimulatedPlant, view: PointView, actuators: Sequence[Actuator], steps: int | None = None
    ) -> None:
        shapes = (len(view.columns), len(plant.columns)), (len(view.columns),)
        found = view.matrix.shape, view.constant.shape
        PlantError.unless(found == shapes, "view", f"matrix and constant of shapes {shapes}", str(found))
        known = [a.name for a in plant.actuators]
        for name in (*view.held, *(a.name for a in actuators)):
            PlantError.unless_known(name, known, "view", "an actuator of the plant")
        self.plant, self.view, self.actuators = plant, view, tuple(actuators)
        self.scenario, self.forecaster = plant.scenario, plant.forecaster
        self.control_step, self.zone_names = plant.control_step, plant.zone_names
        self._steps = plant.scenario.grid.n_steps if steps is None else steps
        self._layout = PointLayout(view.columns, plant.scenario.building.location.timezone)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the measurements."""
        return self.view.columns

    @property
    def finished(self) -> bool:
        """Whether the run is over."""
        return self.plant.now + self.plant.control_steps > self._steps

    def reset(self, seed: int | None = None) -> Measurements:
        """Start anew.

        Parameters
        ----------
        seed : int, optional
            Of people and noise.
        """
        return self._seen(self.plant.reset(seed))

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Hold setpoints for a control step.

        Parameters
        ----------
        actions : mapping of str to float
            Of `actuators` [K] or [Pa].
        """
        return self._seen(self.plant.step({**actions, **self.view.held}))

    def forecast(self) -> Forecast:
        """Forecast the steps from now on."""
        return self.plant.forecast()

    def record(self) -> PlantRecord:
        """Give the run since the reset."""
        return self.plant.record()

    def recent(self, steps: int) -> RecentSteps:
        """Give the last steps of `record`.

        Parameters
        ----------
        steps : int
            How many of the plant's own steps.
        """
        return self.plant.recent(steps)

    def _seen(self, own: Measurements) -> Measurements:
        return Measurements(self._layout, own.seconds, lambda: self.view.of(own.values_array))


def seen_through(plants: Sequence[Any]) -> tuple[list[Any], PointView | None]:
    """Give what is stepped of plants, and the view that they are seen through; None where all are seen as they are.

    Parameters
    ----------
    plants : sequence of Plant
        The plants.

    Raises
    ------
    PlantError
        When they have different views.
    """
    views = [plant.view if isinstance(plant, ViewedPlant) else None for plant in plants]
    first = views[0]
    for k, view in enumerate(views):
        same = view is first or (view is not None and first is not None and view.same(first))
        PlantError.unless(same, f"view: plant {k}", "the view of plant 0", "another")
    return [plant.plant if isinstance(plant, ViewedPlant) else plant for plant in plants], first
