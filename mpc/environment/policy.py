"""Learned policies without the library that trained them: a small network in NumPy, as a controller."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mpc.environment.features import clock
from mpc.environment.layout import ActionLayout, Observation, ObservationLayout
from mpc.errors import MpcError
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray

#: What a layer applies to its sums.
Activation = Literal["tanh", "relu"]


@dataclass(frozen=True, eq=False)
class ActorNetwork:
    """The mean of a Gaussian policy: dense layers, in single precision as they were trained.

    Parameters
    ----------
    weights : tuple of ndarray, shape (n_out, n_in)
        Of each layer, the last one gives the action [-].
    biases : tuple of ndarray, shape (n_out,)
        Of each layer [-].
    activation : str
        ``tanh`` or ``relu``, after every layer but the last.
    squashed : bool
        Whether the action is the hyperbolic tangent of the last layer, as in soft actor-critic; otherwise it is cut at
        -1 and 1, as in proximal policy optimisation.
    about : mapping
        How it was trained, as plain values.

    Raises
    ------
    MpcError
        When layers do not fit each other or a number is not finite.

    Examples
    --------
    >>> double = ActorNetwork((np.array([[2.0]]),), (np.zeros(1),), "tanh", squashed=False)
    >>> double.act([0.25]).tolist(), double.act([3.0]).tolist()
    ([0.5], [1.0])
    """

    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]
    activation: Activation
    squashed: bool
    about: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        MpcError.unless_known(self.activation, get_args(Activation), "network: activation", "a known one")
        for name in ("weights", "biases"):
            object.__setattr__(self, name, tuple(np.asarray(v, dtype=np.float32) for v in getattr(self, name)))
        shapes = [(w.shape, b.shape) for w, b in zip(self.weights, self.biases, strict=False)]
        fit = len(self.weights) == len(self.biases) > 0 and all(len(w) == 2 and b == (w[0],) for w, b in shapes)
        chained = fit and all(a[0][0] == b[0][1] for a, b in pairwise(shapes))
        fine = chained and all(np.isfinite(v).all() for v in (*self.weights, *self.biases))
        MpcError.unless(fine, "network", "finite layers that fit each other", shapes)

    @property
    def inputs(self) -> int:
        """Length of an observation."""
        return int(self.weights[0].shape[1])

    def act(self, observation: ArrayLike) -> NDArray[np.float32]:
        """Choose the most likely action.

        Parameters
        ----------
        observation : array_like, shape (n_feature,)
            Of an environment [-].

        Returns
        -------
        ndarray of float32, shape (n_action,)
            From -1 to 1 [-].
        """
        x = np.asarray(observation, dtype=np.float32)
        for k, (w, b) in enumerate(zip(self.weights, self.biases, strict=True)):
            x = w @ x + b
            if k < len(self.weights) - 1:
                x = np.tanh(x) if self.activation == "tanh" else np.maximum(x, np.float32(0.0))
        return np.tanh(x) if self.squashed else np.clip(x, np.float32(-1.0), np.float32(1.0))

    def save(self, path: str | PathLike[str]) -> None:
        """Write to a compressed ``.npz`` file of plain arrays and a text.

        Parameters
        ----------
        path : str or path-like
            File to write.
        """
        layers = {f"{name}{k}": v for name in ("weights", "biases") for k, v in enumerate(getattr(self, name))}
        about = json.dumps({"activation": self.activation, "squashed": self.squashed, "about": dict(self.about)})
        with Path(path).open("wb") as file:
            np.savez_compressed(file, about=np.array(about), **layers)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> ActorNetwork:
        """Read what `save` wrote; nothing in the file is executed.

        Parameters
        ----------
        path : str or path-like
            File to read.

        Raises
        ------
        MpcError
            When it is no such file.
        """
        try:
            with np.load(path, allow_pickle=False) as file:
                about = json.loads(str(file["about"]))
                count = sum(name.startswith("weights") for name in file.files)
                layers = {n: tuple(file[f"{n}{k}"] for k in range(count)) for n in ("weights", "biases")}
            return cls(layers["weights"], layers["biases"], about["activation"], about["squashed"], about["about"])
        except (OSError, KeyError, ValueError, TypeError, EOFError) as error:
            found = f"{type(error).__name__}: {error}"
            raise MpcError(str(path), "a file that ActorNetwork.save wrote", found) from error

    @classmethod
    def of_stable_baselines(cls, model: Any, about: Mapping[str, Any] | None = None) -> ActorNetwork:
        """Take the actor out of a model of Stable-Baselines3.

        Parameters
        ----------
        model : stable_baselines3.PPO or stable_baselines3.SAC
            With a policy of dense layers and the library's own preprocessing.
        about : mapping, optional
            How it was trained.

        Raises
        ------
        MpcError
            When the model is of another kind.
        """
        state = {name: value.detach().cpu().numpy() for name, value in model.policy.state_dict().items()}
        heads = {"PPO": ("mlp_extractor.policy_net", "action_net"), "SAC": ("actor.latent_pi", "actor.mu")}
        kind = type(model).__name__
        MpcError.unless(kind in heads, "model", "PPO or SAC of Stable-Baselines3", kind)
        body, last = heads[kind]
        numbers = sorted({int(n.split(".")[-2]) for n in state if n.startswith(f"{body}.") and n.endswith("weight")})
        layers = [*(f"{body}.{n}" for n in numbers), last]
        activation = str(model.policy.activation_fn.__name__).lower()
        return cls(
            tuple(state[f"{name}.weight"] for name in layers), tuple(state[f"{name}.bias"] for name in layers),
            activation, kind == "SAC", about or {},  # type: ignore[arg-type]
        )  # fmt: skip


class PolicyController:
    """A learned policy as a controller, on any plant that has the measurements that it was trained with.

    Parameters
    ----------
    network : ActorNetwork
        The policy.
    layout : ObservationLayout
        Of the environment that it was trained in.
    actions : ActionLayout
        The same.

    Raises
    ------
    MpcError
        When the policy is of another environment.
    """

    def __init__(self, network: ActorNetwork, layout: ObservationLayout, actions: ActionLayout) -> None:
        found = network.inputs, int(network.weights[-1].shape[0])
        expected = f"{len(layout)} inputs and {len(actions)} actions"
        MpcError.unless(found == (len(layout), len(actions)), "policy", expected, f"{found[0]} and {found[1]}")
        self.network, self.layout, self.actions = network, layout, actions
        self._ahead: FloatArray | None = None

    def observe(self, measurements: Measurements, forecast: Forecast | None) -> Observation:
        """Make the observation that the environment would have made.

        Parameters
        ----------
        measurements : Measurements
            Of the control step that has just ended.
        forecast : Forecast or None
            Of what comes; None where it is late: the last one counts, or the middle of every range.
        """
        outlook = self.layout.outlook
        if outlook is not None and forecast is not None:
            self._ahead = outlook.of_forecast(forecast)
        elif outlook is not None and self._ahead is None:
            self._ahead = np.zeros(len(outlook.features))
        now = clock(measurements.seconds, measurements.layout.timezone)
        return self.layout.observe(measurements.values_array, self._ahead, now)

    def step(self, measurements: Measurements, forecast: Forecast | None) -> dict[str, float]:
        """Choose setpoints for the next control step.

        Parameters
        ----------
        measurements : Measurements
            Of the control step that has just ended.
        forecast : Forecast or None
            Of what comes.

        Returns
        -------
        dict of str to float
            Setpoints by ``ENTITY/POINT`` [K].
        """
        return self.actions.setpoints(self.network.act(self.observe(measurements, forecast)))
