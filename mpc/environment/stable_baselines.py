"""The vector environment as Stable-Baselines3 takes it (extra ``[rl]``)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from mpc.environment.vector import VectorEnvironment
from mpc.errors import MpcError
from thermal.errors import MissingExtraError

try:
    from stable_baselines3.common.vec_env import VecEnv
except ImportError as _error:
    raise MissingExtraError(
        'this adapter needs Stable-Baselines3, which the extra brings: pip install "buildingmpc[rl]"'
    ) from _error


class StableBaselinesVector(VecEnv):
    """A vector environment with the methods that algorithms of Stable-Baselines3 call.

    Parameters
    ----------
    world : VectorEnvironment
        That resets in the same step, as theirs do: ``autoreset_mode=AutoresetMode.SAME_STEP``.

    Raises
    ------
    MpcError
        When it resets in the next step.

    Examples
    --------
    >>> world = StableBaselinesVector(VectorEnvironment(single, 512, autoreset_mode=same_step))  # doctest: +SKIP
    >>> PPO("MlpPolicy", world, n_steps=64, batch_size=8192).learn(1_000_000)  # doctest: +SKIP
    """

    def __init__(self, world: VectorEnvironment) -> None:
        mode = world.metadata["autoreset_mode"]
        expected, advice = "AutoresetMode.SAME_STEP, as Stable-Baselines3 resets", "make it with autoreset_mode"
        MpcError.unless(mode is AutoresetMode.SAME_STEP, "autoreset_mode", expected, str(mode), advice)
        self.world, self.render_mode = world, world.render_mode
        self._actions: Any = None
        super().__init__(world.num_envs, world.single_observation_space, world.single_action_space)

    def reset(self) -> Any:
        """Begin an episode in all members, by the seeds and options that were given; gives first observations."""
        seeds = [None if s is None else int(s) for s in self._seeds]
        seen, infos = self.world.reset(seed=seeds if any(s is not None for s in seeds) else None)
        self.reset_infos = [_of_member(infos, k) for k in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return seen

    def step_async(self, actions: Any) -> None:
        """Take down what is done next.

        Parameters
        ----------
        actions : ndarray, shape (num_envs, n_action)
            From -1 to 1 [-].
        """
        self._actions = actions

    def step_wait(self) -> Any:
        """Do it: observations, rewards, whether episodes ended, and a dict of infos a member."""
        seen, rewards, _, truncated, infos = self.world.step(self._actions)
        told: list[dict[str, Any]] = [{"TimeLimit.truncated": False} for _ in range(self.num_envs)]
        for k in np.flatnonzero(truncated).tolist():
            told[k] = {
                **_of_member(infos["final_info"], k), "TimeLimit.truncated": True,
                "terminal_observation": infos["final_obs"][k],
            }  # fmt: skip
            self.reset_infos[k] = _of_member(infos, k)
        return seen, rewards.astype(np.float32), truncated, told

    def close(self) -> None:
        """Close the plants."""
        self.world.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Give an attribute that members have in common, once for each.

        Parameters
        ----------
        attr_name : str
            Its name.
        indices : int or sequence of int, optional
            Members; all by default.
        """
        value = getattr(self.world if hasattr(self.world, attr_name) else self.world.single, attr_name)
        return [value] * len(self._members(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refuse: members have no attributes of their own.

        Parameters
        ----------
        attr_name : str
            Its name.
        value : object
            Any.
        indices : int or sequence of int, optional
            Members.
        """
        raise MpcError("set_attr", "attributes of the vector as a whole", repr(attr_name), "set them on `world`")

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Refuse: members have no methods of their own.

        Parameters
        ----------
        method_name : str
            Its name.
        *method_args : Any
            Of the method.
        indices : int or sequence of int, optional
            Members.
        **method_kwargs : Any
            Of the method.
        """
        raise MpcError("env_method", "methods of the vector as a whole", repr(method_name), "call them on `world`")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Tell which members are wrapped: none.

        Parameters
        ----------
        wrapper_class : type
            Of the wrapper.
        indices : int or sequence of int, optional
            Members; all by default.
        """
        return [False] * len(self._members(indices))

    def get_images(self) -> Sequence[Any]:
        """Pictures of all members."""
        return self.world.render() or ()

    def _members(self, indices: Any) -> list[int]:
        return list(range(self.num_envs)) if indices is None else [int(k) for k in np.atleast_1d(indices)]


def _of_member(infos: dict[str, Any], member: int) -> dict[str, Any]:
    """Infos of a member, out of those of all."""
    names = (name for name in infos if f"_{name}" in infos and name not in ("final_obs", "final_info"))
    found = {name: infos[name][member] for name in names if infos[f"_{name}"][member]}
    return {name: value.item() if isinstance(value, np.generic) else value for name, value in found.items()}
