"""A building reduced to its modes, as a plant steps it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mpc.errors import PlantError
from mpc.loop.building import BuildingFlows, BuildingStep
from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.model.matrices import SymbolicModel
from thermal.model.modal import ModalModel, modal_model
from thermal.model.reduce import ReducedModel, reduced_model
from thermal.model.step import IMPLICIT_EULER
from thermal.network.build import Extension, build_network
from thermal.units import REFERENCE_TEMPERATURE


class ReducedBuilding:
    """A building reduced to its modes, stepped by implicit Euler as the grid is.

    Parameters
    ----------
    model : ReducedModel
        Such as `thermal.reduced_model` gives it.
    theta : ndarray, shape (n_parameter,), optional
        Parameter values [parameter units]; those that the model was made at by default.
    step_seconds : float
        Time step [s].

    Notes
    -----
    A step takes modes ξ to ``E ξ + g (B u + H q)`` and reads the zones by ``O ξ``, with O the transpose of H where
    sensors do not lag. The states here are ``ξ / √g``: then both products have one matrix, √g H, which stays in the
    processor's cache.
    """

    def __init__(self, model: ReducedModel, theta: FloatArray | None = None, step_seconds: float = 300.0) -> None:
        if model.network.airflows:
            raise PlantError("building", "one without airflows from zone to zone", "some", "use the grid")
        self.network, self.step_seconds = model.network, float(step_seconds)
        self.theta = model.theta if theta is None else np.asarray(theta, dtype=float)
        self._modes: ModalModel = modal_model(model.matrices(self.theta))
        modes, propagator = self._modes, self._modes.propagator(self.step_seconds, IMPLICIT_EULER)
        self._end, self._scale = propagator.end, np.sqrt(propagator.end_gain)
        self._heating = np.ascontiguousarray(self._scale[:, None] * modes.heating)
        self._output = np.ascontiguousarray(modes.output * self._scale)
        if np.allclose(self._output, self._heating.T, rtol=1e-9, atol=1e-12 * float(np.abs(self._output).max())):
            self._output = self._heating.T
        self._driving = np.ascontiguousarray((self._scale[:, None] * modes.boundary).T)
        self._response = self._output @ self._heating
        self._outside = np.zeros(modes.boundary.shape[1])
        self._state = self._before = self._free_state = np.zeros(modes.capacity.size)
        self._reading = self._free = self._rise = np.zeros(len(self.network.zones))
        self._gains = np.zeros(0)

    @property
    def order(self) -> int:
        """Number of states."""
        return int(self._end.size)

    @property
    def modal_state(self) -> FloatArray:
        """Modes of the building's model, from `REFERENCE_TEMPERATURE` on, shape (order,) [K]."""
        return self._scale * self._state

    def counted(self, modal_state: FloatArray) -> FloatArray:
        """Give the state here of modes, the inverse of `modal_state`, shape (order,) [K].

        Parameters
        ----------
        modal_state : ndarray, shape (order,)
            As an observer estimates it [K].
        """
        return np.asarray(modal_state / self._scale)

    def step_matrices(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Give what `begin` and `finish` step with: end, driving, heating, output and response of the states here."""
        return self._end, self._driving.T, self._heating, self._output, self._response

    def reset(self, zone: FloatArray, boundary: FloatArray, signals: FloatArray) -> FloatArray:
        """Start from a steady state; see `BuildingModel`.

        Parameters
        ----------
        zone, boundary, signals : ndarray
            As there [K], [K], [signal unit].
        """
        modes = self._modes
        outside = modes.boundary @ np.concatenate([boundary - REFERENCE_TEMPERATURE, signals])
        at_rest = 1.0 / modes.conductance
        free = modes.observation @ (at_rest * outside)
        gain = modes.observation @ (at_rest[:, None] * modes.heating)
        heat = np.linalg.solve(gain, np.asarray(zone, dtype=float) - REFERENCE_TEMPERATURE - free)
        self._state = at_rest * (outside + modes.heating @ heat) / self._scale
        self._reading = self._output @ self._state + REFERENCE_TEMPERATURE
        return self._reading

    def reseed(self, seed: int) -> None:
        """Nothing is random here.

        Parameters
        ----------
        seed : int
            Without effect.
        """

    def begin(self, heat: FloatArray, boundary: FloatArray, signals: FloatArray) -> FloatArray:
        """Begin a step; see `BuildingModel`.

        Parameters
        ----------
        heat, boundary, signals : ndarray
            As there [W], [K], [signal unit].
        """
        if self._gains is not heat:
            self._gains, self._rise = heat, self._response.dot(heat) + REFERENCE_TEMPERATURE
        outside = boundary - REFERENCE_TEMPERATURE
        if signals.size:
            outside = np.concatenate([outside, signals])
        self._outside = outside
        self._free_state = self._end * self._state + outside.dot(self._driving)
        self._free = self._output.dot(self._free_state) + self._rise
        return self._free

    def finish(self, heat: FloatArray, signals: FloatArray) -> BuildingStep:
        """Take the step that was begun; see `BuildingModel`.

        Parameters
        ----------
        heat, signals : ndarray
            As there [W], [signal unit].
        """
        state = self._free_state + self._heating.dot(self._gains + heat)
        reached = self._free + self._response.dot(heat)
        if signals.size and not np.array_equal(known := self._outside[-signals.size :], signals):
            moved = (signals - known).dot(self._driving[-signals.size :])
            state, reached = state + moved, reached + self._output.dot(moved)
            known[:] = signals
        start, self._before, self._state, self._reading = self._reading, self._state, state, reached
        # with constant inputs implicit Euler's mean over a step is the trapezoid's
        return BuildingStep(0.5 * (start + reached), reached)

    def flows(self) -> BuildingFlows:
        """Add up the heat of the last step."""
        modes, uniform = self._modes, self._modes.uniform
        brought = (uniform @ modes.boundary) * self._outside
        n_boundary = len(self.network.boundaries)
        carried = uniform * self._scale
        envelope = carried @ (modes.conductance * self._state) - brought[:n_boundary].sum()
        storage = carried @ (modes.capacity * (self._state - self._before)) / self.step_seconds
        return BuildingFlows(float(envelope), float(brought[n_boundary:].sum()), float(storage))

    def save_state(self) -> Any:
        """Everything that the next steps depend on."""
        return self._state.copy(), self._reading.copy()

    def restore_state(self, saved: Any) -> None:
        """Return to a saved state.

        Parameters
        ----------
        saved : object
            Of `save_state`.
        """
        state, reading = saved
        if state.shape != self._state.shape:
            raise PlantError("state", f"one of order {self._state.size}", f"one of order {state.size}")
        self._state, self._reading = state.copy(), reading.copy()


def reduced_building(
    building: Building,
    parameters: Mapping[str, float] | None = None,
    *,
    step_seconds: float = 300.0,
    dx: float | None = None,
    effects: Sequence[Extension] = (),
    order: int | None = None,
    tolerance: float | None = None,
) -> ReducedBuilding:
    """Build and reduce a building.

    Parameters
    ----------
    building : Building
        Floor plans or a zone table.
    parameters : mapping of str to float, optional
        Values by name [parameter units]; starts for the rest.
    step_seconds : float
        Time step [s].
    dx : float, optional
        Distance between control volumes of a plan [m].
    effects : sequence of Extension
        What is added to the baseline, `thermal.effects.catalogue.chosen` or `RadiantGains`; strengths are among the
        parameters.
    order : int, optional
        Largest number of states.
    tolerance : float, optional
        Largest error of a zone mean in the certificate's replay [K].

    Returns
    -------
    ReducedBuilding
        Ready to step.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> small = reduced_building(load_bundled_case().building, dx=1.0, order=40)
    >>> none, cold = np.zeros(0), np.array([273.15])
    >>> start = small.reset(np.full(5, 293.15), cold, none)
    >>> bool((small.begin(np.zeros(5), cold, none) < start).all())
    True
    """
    grid = SymbolicModel(build_network(building, dx=dx, effects=effects))
    theta = grid.network.values(parameters or {})
    model = reduced_model(grid, [theta], order=order, tolerance=tolerance)
    return ReducedBuilding(model, theta, step_seconds)
