"""The building of a plant: on the grid, or reduced to its modes, behind the same few methods."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from mpc.errors import PlantError
from thermal import Building, Simulator, SymbolicModel, ThermalNetwork, build_network, reduced_model
from thermal.effects import Chosen
from thermal.errors import describe
from thermal.model import IMPLICIT_EULER, ModalModel, ReducedModel, modal_model
from thermal.signals import REFERENCE_TEMPERATURE

FloatArray = NDArray[np.float64]


class BuildingStep(NamedTuple):
    """What a step did to a building.

    Parameters
    ----------
    mean : ndarray, shape (n_zone,)
        What the zones' sensors read, mean over the step [K].
    reading : ndarray, shape (n_zone,)
        What they read at its end [K].
    """

    mean: FloatArray
    reading: FloatArray


class BuildingFlows(NamedTuple):
    """Heat of a building over its last step.

    Parameters
    ----------
    envelope : float
        Through walls and windows to the boundaries [W].
    effects : float
        From the sources of effects into the building [W].
    storage : float
        Kept in air, walls and furniture [W].
    """

    envelope: float
    effects: float
    storage: float


class BuildingModel(Protocol):
    """A building that steps: what a plant needs of it."""

    @property
    def network(self) -> ThermalNetwork:
        """Zones, boundaries, signals and parameters."""

    @property
    def theta(self) -> FloatArray:
        """Parameter vector, shape (n_parameter,) [parameter units]."""

    @property
    def step_seconds(self) -> float:
        """Length of a step [s]."""

    def reset(self, zone: FloatArray, boundary: FloatArray, signals: FloatArray) -> FloatArray:
        """Start from the steady state that holds the zones at given temperatures; returns what the sensors read.

        Parameters
        ----------
        zone : ndarray, shape (n_zone,)
            Temperatures [K].
        boundary : ndarray, shape (n_boundary,)
            Boundary temperatures [K].
        signals : ndarray, shape (n_signal,)
            Of the effects [signal unit].
        """

    def reseed(self, seed: int) -> None:
        """Start the random numbers anew, where there are any.

        Parameters
        ----------
        seed : int
            0 or more.
        """

    def begin(self, heat: FloatArray, boundary: FloatArray, signals: FloatArray) -> FloatArray:
        """Begin a step: what the zones' sensors would read at its end without supply air, shape (n_zone,) [K].

        Parameters
        ----------
        heat : ndarray, shape (n_zone,)
            Of people, light and equipment into the zones [W].
        boundary : ndarray, shape (n_boundary,)
            Boundary temperatures [K].
        signals : ndarray, shape (n_signal,)
            Of the effects, as far as they are known [signal unit].
        """

    def finish(self, heat: FloatArray, signals: FloatArray) -> BuildingStep:
        """Take the step that was begun.

        Parameters
        ----------
        heat : ndarray, shape (n_zone,)
            Of the supply air into the zones [W].
        signals : ndarray, shape (n_signal,)
            Of the effects [signal unit].
        """

    def flows(self) -> BuildingFlows:
        """Add up the heat of the last step."""

    def save_state(self) -> Any:
        """Everything that the next steps depend on."""

    def restore_state(self, saved: Any) -> None:
        """Return to a saved state.

        Parameters
        ----------
        saved : object
            Of `save_state`.
        """


class GridBuilding:
    """A building on its grid, with the mean of the shuffle or the paper's random one.

    Parameters
    ----------
    simulator : Simulator
        Stepping by implicit Euler.
    """

    def __init__(self, simulator: Simulator) -> None:
        self.simulator, self.network, self.theta = simulator, simulator.network, simulator.theta
        self.step_seconds = simulator.step_seconds
        flow = simulator.matrices.flow
        self._capacity = np.asarray(simulator.matrices.capacity.diagonal())
        self._out = np.asarray(flow.sum(axis=0)).ravel()  # heat that leaves everywhere, per kelvin or signal
        self._before = self._outside = self._gains = self._boundary = np.zeros(0)

    def reset(self, zone: FloatArray, boundary: FloatArray, signals: FloatArray) -> FloatArray:
        """Start from a steady state; see `BuildingModel`.

        Parameters
        ----------
        zone, boundary, signals : ndarray
            As there [K], [K], [signal unit].
        """
        return self.simulator.reset(zone, boundary, signals)

    def reseed(self, seed: int) -> None:
        """Start the random numbers of the shuffle anew.

        Parameters
        ----------
        seed : int
            0 or more.
        """
        saved = self.simulator.save_state()
        if saved["shuffle"] is not None:
            saved["shuffle"] = dict(np.random.default_rng(seed).bit_generator.state)
            self.simulator.restore_state(saved)

    def begin(self, heat: FloatArray, boundary: FloatArray, signals: FloatArray) -> FloatArray:
        """Begin a step; see `BuildingModel`.

        Parameters
        ----------
        heat, boundary, signals : ndarray
            As there [W], [K], [signal unit].
        """
        self._gains, self._boundary = heat, boundary
        saved = self.simulator.save_state()
        self._before = saved["states"]
        self.simulator.step(heat, boundary, signals=signals)
        free = self.simulator.zone_temperatures
        self.simulator.restore_state(saved)
        return free

    def finish(self, heat: FloatArray, signals: FloatArray) -> BuildingStep:
        """Take the step that was begun; see `BuildingModel`.

        Parameters
        ----------
        heat, signals : ndarray
            As there [W], [signal unit].
        """
        self._outside = np.concatenate([self._boundary - REFERENCE_TEMPERATURE, signals])
        mean = self.simulator.step(self._gains + heat, self._boundary, signals=signals)
        return BuildingStep(mean, self.simulator.zone_temperatures)

    def flows(self) -> BuildingFlows:
        """Add up the heat of the last step, as it was before a random shuffle."""
        after, n = self.simulator.stepped_states, self._before.size
        n_boundary = len(self.network.boundaries)
        heat = self._out[n:] * self._outside
        envelope = self._out[:n] @ (after - REFERENCE_TEMPERATURE) + heat[:n_boundary].sum()
        storage = self._capacity @ (after - self._before) / self.step_seconds
        return BuildingFlows(float(envelope), -float(heat[n_boundary:].sum()), float(storage))

    def save_state(self) -> Any:
        """Everything that the next steps depend on."""
        return self.simulator.save_state()

    def restore_state(self, saved: Any) -> None:
        """Return to a saved state.

        Parameters
        ----------
        saved : object
            Of `save_state`.
        """
        self.simulator.restore_state(saved)


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
    """

    def __init__(self, model: ReducedModel, theta: FloatArray | None = None, step_seconds: float = 300.0) -> None:
        if model.network.airflows:
            raise PlantError(describe("building", "one without airflows from zone to zone", "some", "use the grid"))
        self.network, self.step_seconds = model.network, float(step_seconds)
        self.theta = model.theta if theta is None else np.asarray(theta, dtype=float)
        self._modes: ModalModel = modal_model(model.matrices(self.theta))
        modes, propagator = self._modes, self._modes.propagator(self.step_seconds, IMPLICIT_EULER)
        self._end, self._gain = propagator.end, propagator.end_gain
        self._heating = np.ascontiguousarray(modes.heating)
        self._output = np.ascontiguousarray(modes.output)
        if np.allclose(self._output, self._heating.T, rtol=1e-9, atol=1e-12 * float(np.abs(self._output).max())):
            self._output = self._heating.T  # one matrix in the cache instead of two
        self._response = self._output @ (self._gain[:, None] * self._heating)
        self._outside = np.zeros(modes.boundary.shape[1])
        self._state = self._before = self._free_state = self._gained = np.zeros(modes.capacity.size)
        self._reading = self._free = np.zeros(len(self.network.zones))
        self._gains = np.zeros(0)

    @property
    def order(self) -> int:
        """Number of states."""
        return int(self._end.size)

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
        self._state = at_rest * (outside + modes.heating @ heat)
        self._reading = self._output @ self._state
        return self._reading + REFERENCE_TEMPERATURE

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
            self._gains, self._gained = heat, self._heating @ heat
        outside, n = self._outside, boundary.size
        np.subtract(boundary, REFERENCE_TEMPERATURE, out=outside[:n])
        outside[n:] = signals
        pushed = self._modes.boundary @ outside
        pushed += self._gained
        pushed *= self._gain
        self._free_state = self._end * self._state + pushed
        self._free = self._output @ self._free_state
        return self._free + REFERENCE_TEMPERATURE

    def finish(self, heat: FloatArray, signals: FloatArray) -> BuildingStep:
        """Take the step that was begun; see `BuildingModel`.

        Parameters
        ----------
        heat, signals : ndarray
            As there [W], [signal unit].
        """
        pushed, reached = self._heating @ heat, self._free + self._response @ heat
        known = self._outside[self._outside.size - signals.size :]
        if signals.size and not np.array_equal(known, signals):
            change = np.zeros_like(self._outside)
            change[change.size - signals.size :] = signals - known
            moved = self._modes.boundary @ change
            pushed, reached = pushed + moved, reached + self._output @ (self._gain * moved)
            self._outside += change
        pushed *= self._gain
        self._before, self._state = self._state, self._free_state + pushed
        start, self._reading = self._reading, reached
        # with constant inputs implicit Euler's mean over a step is the trapezoid's
        mean = 0.5 * (start + self._reading)
        return BuildingStep(mean + REFERENCE_TEMPERATURE, self._reading + REFERENCE_TEMPERATURE)

    def flows(self) -> BuildingFlows:
        """Add up the heat of the last step."""
        modes, uniform = self._modes, self._modes.uniform
        brought = (uniform @ modes.boundary) * self._outside
        n_boundary = len(self.network.boundaries)
        envelope = uniform @ (modes.conductance * self._state) - brought[:n_boundary].sum()
        storage = uniform @ (modes.capacity * (self._state - self._before)) / self.step_seconds
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
            raise PlantError(describe("state", f"one of order {self._state.size}", f"one of order {state.size}"))
        self._state, self._reading = state.copy(), reading.copy()


def reduced_building(
    building: Building,
    parameters: Mapping[str, float] | None = None,
    *,
    step_seconds: float = 300.0,
    dx: float | None = None,
    effects: tuple[Chosen, ...] = (),
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
    effects : tuple of Chosen
        What is added to the baseline, `thermal.effects.chosen`; strengths are among the parameters.
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
    >>> from thermal import load_bundled_case
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


def zone_response(model: BuildingModel, heat: FloatArray) -> FloatArray:
    """Measure how far heat over a step moves the zones, all of them heated together, shape (n_zone,) [K/W].

    Parameters
    ----------
    model : BuildingModel
        Its state is lost.
    heat : ndarray, shape (n_zone,)
        In proportion to what the zones may get [W], positive.
    """
    network = model.network
    boundary = np.full(len(network.boundaries), REFERENCE_TEMPERATURE)
    none, signals = np.zeros(len(heat)), np.zeros(len(network.signals))
    model.reset(np.full(len(heat), REFERENCE_TEMPERATURE), boundary, signals)
    free = model.begin(none, boundary, signals)
    return np.maximum((model.finish(heat, signals).reading - free) / heat, 1e-9)
