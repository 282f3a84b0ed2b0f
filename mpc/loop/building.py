"""The building of a plant: what it is asked for, and the one on the grid."""

from typing import Any, NamedTuple, Protocol

import numpy as np

from thermal._types import FloatArray
from thermal.model.simulator import Simulator
from thermal.network.network import ThermalNetwork
from thermal.units import REFERENCE_TEMPERATURE


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
    return np.maximum((model.finish(heat, signals + network.emitted @ heat).reading - free) / heat, 1e-9)
