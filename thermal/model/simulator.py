"""The stepping simulator: the plant of closed-loop tests, with the paper's random shuffle or its mean."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np

from thermal._types import FloatArray
from thermal.case.building import Building
from thermal.errors import ModelError
from thermal.model.matrices import SymbolicModel
from thermal.model.step import SCHEMES, Stepper
from thermal.network.build import Extension, build_network
from thermal.network.structure import SHUFFLE_STEP
from thermal.parameters import Scope
from thermal.shuffle.random import RandomShuffle
from thermal.units import REFERENCE_TEMPERATURE

#: One long implicit step to the steady state of a reset [s], three years.
_STEADY_STEP = 1e8

#: The mean of the shuffle needs a rate above zero [-].
_LEAST_PROBABILITY = 1e-3

#: Temperatures outside of this range are refused as inputs [K].
PLAUSIBLE = (173.15, 373.15)


@dataclass(frozen=True)
class Shuffle:
    """How the air of a zone is mixed.

    Parameters
    ----------
    kind : {"mean", "random"}
        The mean of the shuffle as a term of the model, or the paper's random one after each step.
    probability : float, optional
        Probability of the shuffle per 300 s [-], in [0, 1]; ``shuffle_probability`` of the parameters by default.
    reach : float, optional
        Reach of the shuffle [m]; None is the whole zone.
    seed : int
        Seed of the random shuffle.

    Raises
    ------
    ModelError
        When the kind is unknown, or the probability none.
    """

    kind: Literal["mean", "random"] = "mean"
    probability: float | None = None
    reach: float | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if self.probability is not None and not 0.0 <= self.probability <= 1.0:
            raise ModelError(f"probability: expected a number from 0 to 1, got {self.probability}")
        ModelError.unless(self.kind in ("mean", "random"), "shuffle", "'mean' or 'random'", repr(self.kind))


class Simulator:
    """Steps a building from zone heats and boundary temperatures.

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
    scheme : str
        ``implicit_euler`` or ``tr_bdf2``.
    shuffle : Shuffle or {"mean", "random"}
        How the air of a zone is mixed.
    scopes : mapping of str to {"global", "zone"}, optional
        Parameters with one value a zone, as they were calibrated.
    effects : sequence of Extension
        What is added to the baseline: effects of the catalogue, `thermal.effects.catalogue.chosen`.

    Raises
    ------
    ModelError
        When an option is unknown, or a parameter is not of this building.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.model.simulator import Simulator
    >>> plant = Simulator(load_bundled_case().building, dx=1.0)
    >>> start = plant.reset(np.full(5, 293.15), np.array([273.15]))
    >>> bool((plant.step(np.zeros(5), np.array([273.15])) < start).all())
    True
    """

    def __init__(
        self,
        building: Building,
        parameters: Mapping[str, float] | None = None,
        step_seconds: float = 300.0,
        dx: float | None = None,
        scheme: str = "implicit_euler",
        shuffle: Shuffle | Literal["mean", "random"] = "mean",
        scopes: Mapping[str, Scope] | None = None,
        effects: Sequence[Extension] = (),
    ) -> None:
        ModelError.unless_known(scheme, SCHEMES, "scheme", f"one of {', '.join(sorted(SCHEMES))}")
        if not (np.isfinite(step_seconds) and step_seconds > 0):
            raise ModelError(f"step_seconds: expected a positive number of seconds, got {step_seconds}")
        mixing = shuffle if isinstance(shuffle, Shuffle) else Shuffle(shuffle)
        probability, random = mixing.probability, mixing.kind == "random"
        build = partial(build_network, building, dx=dx, reach=mixing.reach, scopes=scopes, effects=effects)
        self.network = network = build(mean_shuffle=not random)
        # a steady state or a spin-up needs the mean of the shuffle, also where the steps shuffle at random
        self.model = SymbolicModel(network)
        self._start_model = SymbolicModel(build()) if random else self.model
        given = dict(parameters or {})
        names = [p.name for p in self._start_model.network.parameters]
        if probability is not None and "shuffle_probability" in names:
            given["shuffle_probability"] = probability if random else max(probability, _LEAST_PROBABILITY)
        start = dict(zip(names, self._start_model.network.values(given), strict=True))
        self.probability = float(start.get("shuffle_probability", 0.0))
        self._start_theta = np.array(
            [max(v, _LEAST_PROBABILITY) if n == "shuffle_probability" else v for n, v in start.items()]
        )
        self.step_seconds = float(step_seconds)
        self.theta = np.array([start[p.name] for p in network.parameters])
        self.matrices = self.model.matrices(self.theta)
        self._stepper = Stepper(self.matrices, self.step_seconds, SCHEMES[scheme])
        self._air = np.flatnonzero(network.kind == "air")
        self._shuffle = self._random_shuffle(mixing) if random else None
        self._states: FloatArray | None = None
        self._stepped: FloatArray | None = None
        self._elapsed = 0.0
        # signals that stand for a temperature are counted from the reference; without any, nothing need be
        self._reference = REFERENCE_TEMPERATURE if network.signals else 0.0

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Zones, the order of every zone axis."""
        return self.network.zones

    @property
    def states(self) -> FloatArray:
        """Temperatures of all control volumes, shape (n_node,) [K]; a copy."""
        return self._current()[:, 0].copy()

    @property
    def stepped_states(self) -> FloatArray:
        """Temperatures at the end of the last step, before a random shuffle, shape (n_node,) [K]; a copy."""
        return self.states if self._stepped is None else self._stepped[:, 0].copy()

    @property
    def zone_temperatures(self) -> FloatArray:
        """What the zones' sensors read now, shape (n_zone,) [K]: the means of the air, unless a sensor lags behind."""
        return np.asarray(self.network.reading @ self._current())[:, 0]

    def reset(
        self,
        zone_temperatures: FloatArray,
        boundary_temperatures: FloatArray | None = None,
        signals: FloatArray | None = None,
    ) -> FloatArray:
        """Start from the steady state that holds the zones at given temperatures.

        Parameters
        ----------
        zone_temperatures : ndarray, shape (n_zone,)
            Zone means [K].
        boundary_temperatures : ndarray, shape (n_boundary,), optional
            Boundary temperatures [K]; the mean of the zones by default.
        signals : ndarray, shape (n_signal,), optional
            Signals of the effects [signal unit]; none are needed in the baseline.

        Returns
        -------
        ndarray, shape (n_zone,)
            Zone means [K].
        """
        zone = self._checked("zone_temperatures", zone_temperatures, len(self.network.zones), PLAUSIBLE)
        if boundary_temperatures is None:
            boundary_temperatures = np.full(len(self.network.boundaries), zone.mean())
        outside, zero = self._outside(boundary_temperatures, signals), self._reference
        matrices = self._start_model.matrices(self._start_theta)
        start = (zone.mean() - zero) * matrices.uniform[:, None]
        states, _, _ = Stepper(matrices, _STEADY_STEP).hold(start, outside, zone[:, None] - zero)
        if self._shuffle is not None:  # the star nodes stand for the mean of the shuffle, which this simulator has not
            states = states[self._start_model.network.kind != "mixing"]
        self._states, self._stepped, self._elapsed = states + zero, None, 0.0
        return self.zone_temperatures

    def _outside(self, boundary_temperatures: FloatArray, signals: FloatArray | None) -> FloatArray:
        """Boundary temperatures, counted from the reference, then signals, shape (n_boundary, 1)."""
        network = self.network
        boundary = self._checked("boundary_temperatures", boundary_temperatures, len(network.boundaries), PLAUSIBLE)
        given = self._checked("signals", np.empty(0) if signals is None else signals, len(network.signals))
        return np.concatenate([boundary - self._reference, given])[:, None]

    def step(
        self,
        zone_heat: FloatArray,
        boundary_temperatures: FloatArray,
        airflow: FloatArray | None = None,
        signals: FloatArray | None = None,
    ) -> FloatArray:
        """Advance one step.

        Parameters
        ----------
        zone_heat : ndarray, shape (n_zone,)
            Heat given to each zone during the step [W], positive into the zone.
        boundary_temperatures : ndarray, shape (n_boundary,)
            Boundary temperatures during the step [K].
        airflow : ndarray, shape (n_airflow,), optional
            Directed airflows during the step [kg/s]; zero by default.
        signals : ndarray, shape (n_signal,), optional
            Signals of the effects during the step [signal unit], as `thermal.inputs.signals.signal_values` makes
            them of telemetry; none are needed in the baseline.

        Returns
        -------
        ndarray, shape (n_zone,)
            Zone means over the step [K].

        Raises
        ------
        ModelError
            When an input has another shape, or a value that is not finite or not a plausible temperature.
        """
        network = self.network
        heat = self._checked("zone_heat", zone_heat, len(network.zones))
        outside, zero = self._outside(boundary_temperatures, signals), self._reference
        n_flow = len(network.airflows)
        flow = self._checked("airflow", np.zeros(n_flow) if airflow is None else airflow, n_flow, (0.0, np.inf))
        states, mean, _, _ = self._stepper.advance(self._current() - zero, outside, heat[:, None], flow[:, None])
        self._states = self._stepped = states + zero
        self._shuffle_when_due()
        return np.asarray(mean[:, 0] + zero)

    def field(self, floor: int) -> FloatArray:
        """Temperatures of one floor of a plan on its grid, shape (n_row, n_column) [K]; NaN outside.

        On a coarsened grid air and wall can share a place: the air is shown.

        Parameters
        ----------
        floor : int
            Floor number, lowest first.
        """
        place = self.network.place
        mine = place[:, 0] == floor
        ModelError.unless(floor >= 0 and mine.any(), "floor", "a floor of a plan", floor)
        out = np.full(self.network.floor_shapes[floor], np.nan)
        for shown in (mine & (self.network.kind != "air"), mine & (self.network.kind == "air")):
            out[place[shown, 1], place[shown, 2]] = self._current()[shown, 0]
        return out

    def _shuffle_when_due(self) -> None:
        """Shuffle once for every 300 s that have passed, the step that the probability belongs to."""
        if self._shuffle is None or self._states is None:
            return
        self._elapsed += self.step_seconds
        while self._elapsed >= SHUFFLE_STEP:
            self._elapsed -= SHUFFLE_STEP
            self._states = self._states.copy()
            self._states[self._air, 0] = self._shuffle.apply(self._states[self._air, 0])

    def save_state(self) -> dict[str, Any]:
        """Everything that the next steps depend on, for `restore_state`."""
        shuffle = None if self._shuffle is None else self._shuffle.state
        return {"states": self.states, "shuffle": shuffle, "elapsed": self._elapsed}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Return to a saved state; what follows is bit for bit what followed then.

        Parameters
        ----------
        saved : mapping
            From `save_state`.

        Raises
        ------
        ModelError
            When it is the state of another building.
        """
        states = np.array(saved["states"], dtype=float)
        if states.shape != (self.network.n_node,):
            raise ModelError("state", f"{self.network.n_node} temperatures of this building", str(states.shape))
        self._states, self._stepped = states[:, None], None
        self._elapsed = float(saved["elapsed"])
        if self._shuffle is not None:
            self._shuffle.restore(saved["shuffle"])

    def _current(self) -> FloatArray:
        if self._states is None:
            raise ModelError("simulator: call reset() before the first step")
        return self._states

    def _random_shuffle(self, mixing: Shuffle) -> RandomShuffle:
        """Make the shuffle over the air volumes, each zone within one floor."""
        network, air = self.network, self._air
        zones = [np.flatnonzero(network.zone[air] == z) for z in range(len(network.zones))]
        positions = network.place[air][:, 1:] * network.spacing if network.spacing else np.zeros((air.size, 2))
        capacities = np.asarray(self.matrices.capacity.diagonal())[air]
        return RandomShuffle(zones, positions, self.probability, mixing.reach, mixing.seed, capacities=capacities)

    @staticmethod
    def _checked(name: str, value: FloatArray, n: int, limits: tuple[float, float] | None = None) -> FloatArray:
        array = np.asarray(value, dtype=float)
        if array.shape != (n,):
            raise ModelError(f"{name}: expected shape ({n},), got {array.shape}")
        bad = ~np.isfinite(array)
        if limits is not None:
            bad |= (array < limits[0]) | (array > limits[1])
        if bad.any():
            where = int(np.flatnonzero(bad)[0])
            wanted = "finite values"
            if limits is not None:
                wanted = f"kelvin from {limits[0]} to {limits[1]}" if limits == PLAUSIBLE else "a flow of zero or more"
            raise ModelError(f"{name}[{where}]: expected {wanted}, got {array[where]}")
        return array
