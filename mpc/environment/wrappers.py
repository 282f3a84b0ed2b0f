"""Wrappers: actions out of a few levels, and observations scaled by what has been seen."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from mpc.environment.layout import Observation
from mpc.errors import MpcError

Discrete = gymnasium.spaces.MultiDiscrete
_LEAST = 1e-6  # standard deviation of a constant entry, which then counts as 0


def _levels(space: gymnasium.Space[Any], levels: int | Sequence[int]) -> NDArray[np.int64]:
    """Levels of each entry of an action."""
    count = int(np.prod(space.shape or ()))
    each = np.broadcast_to(np.asarray(levels, dtype=np.int64), (count,)) if np.size(levels) in (1, count) else None
    expected = f"2 levels or more, one number or {count}"
    if each is None or each.min() < 2:
        raise MpcError("levels", expected, repr(levels))
    return each


class DiscreteActions(gymnasium.ActionWrapper[Observation, NDArray[np.int64], NDArray[np.float32]]):
    """Actions chosen from levels that are evenly spread over each range.

    Parameters
    ----------
    world : gymnasium.Env
        Such as `ControlEnvironment`.
    levels : int or sequence of int
        Levels of each entry, 2 or more.

    Raises
    ------
    MpcError
        When there are fewer than two levels, or not as many numbers as entries.
    """

    def __init__(self, world: gymnasium.Env[Any, Any], levels: int | Sequence[int] = 5) -> None:
        super().__init__(world)
        self._levels = _levels(world.action_space, levels)
        self.action_space = Discrete(self._levels)

    def action(self, action: NDArray[np.int64]) -> NDArray[np.float32]:
        """Give the action of levels.

        Parameters
        ----------
        action : ndarray of int, shape (n_action,)
            Numbers of levels, from 0.
        """
        return np.asarray(2.0 * np.asarray(action) / (self._levels - 1) - 1.0, dtype=np.float32)


class DiscreteVectorActions(gymnasium.vector.VectorActionWrapper):
    """The same for a vector environment.

    Parameters
    ----------
    world : gymnasium.vector.VectorEnv
        Such as `VectorEnvironment`.
    levels : int or sequence of int
        As in `DiscreteActions`.
    """

    def __init__(self, world: gymnasium.vector.VectorEnv[Any, Any, Any], levels: int | Sequence[int] = 5) -> None:
        super().__init__(world)
        self._levels = _levels(world.single_action_space, levels)
        self.single_action_space = Discrete(self._levels)
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, world.num_envs)

    def actions(self, actions: NDArray[np.int64]) -> NDArray[np.float32]:
        """Give the actions of levels.

        Parameters
        ----------
        actions : ndarray of int, shape (num_envs, n_action)
            Numbers of levels, from 0.
        """
        return np.asarray(2.0 * np.asarray(actions) / (self._levels - 1) - 1.0, dtype=np.float32)


class NormalizedObservations(gymnasium.ObservationWrapper[Observation, Any, Observation]):
    """Observations less a mean, over a standard deviation, both fixed beforehand.

    The ranges of an environment are physical and wide; what a building does in them is narrow. Statistics are those of
    a sample, `NormalizedObservations.measured`, and do not move afterwards: a policy can be moved with its numbers.

    Parameters
    ----------
    world : gymnasium.Env
        Such as `ControlEnvironment`.
    mean, deviation : ndarray, shape (n_feature,)
        Of observations [-]; an entry of no deviation becomes 0.
    """

    def __init__(self, world: gymnasium.Env[Any, Any], mean: NDArray[Any], deviation: NDArray[Any]) -> None:
        super().__init__(world)
        shape = world.observation_space.shape
        fits = np.shape(mean) == shape == np.shape(deviation) and bool((np.asarray(deviation) >= 0.0).all())
        MpcError.unless(fits, "normalization", f"mean and deviation of shape {shape}", f"{np.shape(mean)}")
        self.mean = np.asarray(mean, dtype=np.float32)
        moving = np.asarray(deviation) > _LEAST
        self._factor = np.where(moving, 1.0 / np.maximum(deviation, _LEAST), 0.0).astype(np.float32)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, shape, np.float32)

    @classmethod
    def measured(cls, world: gymnasium.Env[Any, Any], steps: int = 2000, seed: int = 0) -> "NormalizedObservations":
        """Measure mean and deviation under random actions.

        Parameters
        ----------
        world : gymnasium.Env
            It is reset.
        steps : int
            How many.
        seed : int
            Of actions and environment.
        """
        rng, (first, _) = np.random.default_rng(seed), world.reset(seed=seed)
        seen = [first]
        for _ in range(steps):
            action = rng.uniform(-1.0, 1.0, world.action_space.shape).astype(np.float32)
            row, _, terminated, truncated, _ = world.step(action)
            seen.append(world.reset()[0] if terminated or truncated else row)
        rows = np.array(seen, dtype=float)
        return cls(world, rows.mean(axis=0), rows.std(axis=0))

    def observation(self, observation: Observation) -> Observation:
        """Scale an observation.

        Parameters
        ----------
        observation : ndarray, shape (n_feature,)
            Of the environment [-].
        """
        scaled: Observation = (observation - self.mean) * self._factor
        return scaled
