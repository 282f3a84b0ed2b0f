"""The environment as pure functions of JAX: on a GPU, and within programs that learn there (extra ``[jax]``)."""

from copy import copy
from typing import Any, NamedTuple

import numpy as np

from mpc.environment.vector import VectorEnvironment
from thermal.batch.functional import HAS_JAX, FunctionalProgram

if HAS_JAX:
    import jax
    import jax.numpy as jnp

_CARRIED = ("reading", "missed", "offset", "response", "cycling", "states", "modes")


class EpisodeState(NamedTuple):
    """Where episodes are: what a step begins with, a member in each entry's last axis.

    Parameters
    ----------
    beginning : array of int, shape (member,)
        Which beginning each episode has.
    step : array of int, shape (member,)
        Steps of the plant that were made.
    values : tuple of array, shape (..., member)
        Of the plant [units of `mpc.batch.step.StepInputs`].
    """

    beginning: Any
    step: Any
    values: tuple[Any, ...]


class Tables(NamedTuple):
    """What is known before the first step, with a first axis of beginnings.

    Parameters
    ----------
    rows, seen : array, shape (n, n_steps, width)
        What drives the plant, and forecasts and clock that are observed.
    ends : array of int, shape (n,)
        Steps after which an episode is over.
    measured : array, shape (n, n_column)
        At the start [library's units].
    values : tuple of array, shape (n, ...)
        As those of `EpisodeState`.
    """

    rows: Any
    seen: Any
    ends: Any
    measured: Any
    values: tuple[Any, ...]


class FunctionalEnvironment:
    """`VectorEnvironment` without memory: each step takes a state and gives the next, for as many members as wanted.

    The equations are those that the vector environment has traced. `jax.jit` compiles `step`, `jax.lax.scan` repeats
    it; with a policy in the same function nothing leaves the GPU.

    Parameters
    ----------
    worlds : VectorEnvironment
        Each of its members is a beginning, with its building, weather and people, that episodes are drawn from; it
        gives the precision, and is reset.
    seed : int
        Of the beginnings.

    Attributes
    ----------
    tables : Tables
        What steps read. A compiled function holds those that it refers to; `with_tables` lets it take them.

    Raises
    ------
    MissingExtraError
        Without JAX.

    Notes
    -----
    Noise, and which beginning an episode has, are drawn from the key, so that runs are not those that the vector
    environment makes of a seed, but as likely. Episodes end as there, and the next begins in the same step
    (`AutoresetMode.SAME_STEP`). Indicators are not kept.

    Examples
    --------
    >>> world = FunctionalEnvironment(VectorEnvironment(single, 64))  # doctest: +SKIP
    >>> key, state, seen = jax.random.key(0), *world.reset(jax.random.key(1), 4096)  # doctest: +SKIP
    >>> state, seen, reward, ended, final = jax.jit(world.step)(state, policy(seen), key)  # doctest: +SKIP
    """

    def __init__(self, worlds: VectorEnvironment, seed: int = 0) -> None:
        batch, layout = worlds.batch, worlds.single.layout
        given, done = batch.traced.inputs, batch.traced.results
        carried = [*(getattr(given, name) for name in _CARRIED), *given.matrices]
        self._advance = FunctionalProgram(
            batch.traced.tape, [given.row, given.actions, given.noise, *carried],
            [done.measured, done.reward, *carried], batch.dtype,
        )  # fmt: skip
        tape, seen, scaled = layout.trace(len(batch.plants[0].columns), worlds.view)
        self._scaled = FunctionalProgram(tape, [seen], [scaled], batch.dtype)
        worlds.reset(seed=seed)
        members = worlds.num_envs
        rows, beside, *values = (
            _last_first(v, members) for v in (batch.rows(), worlds.rows(), *(batch.of(v) for v in carried))
        )
        tables = Tables(rows, beside, worlds.ends[batch.plant_of], batch.measured.T.copy(), tuple(values))
        self.tables = jax.tree.map(jnp.asarray, tables)
        #: Length of an action.
        self.actions = len(worlds.single.actions)
        ends = np.eye(self.actions) * 2.0 - 1.0
        self._lowest = worlds.setpoints(-np.ones_like(ends[:1])).astype(batch.dtype)
        self._spans = worlds.setpoints(ends).astype(batch.dtype) - self._lowest
        self._noise, self._each, self._of_mean = len(given.noise), worlds.each, worlds.reward_of_mean

    def with_tables(self, tables: Tables) -> "FunctionalEnvironment":
        """Give the same environment with other tables, such as those that a compiled function was given.

        Parameters
        ----------
        tables : Tables
            Of the same shapes.
        """
        other = copy(self)
        other.tables = tables
        return other

    def reset(self, key: Any, members: int) -> tuple[EpisodeState, Any]:
        """Begin an episode in each member.

        Parameters
        ----------
        key : jax.Array
            Of random numbers.
        members : int
            How many.

        Returns
        -------
        tuple
            State, and observations, shape (member, n_feature) [-].
        """
        return self.begin(jax.random.randint(key, (members,), 0, len(self.tables.ends)))

    def step(self, state: EpisodeState, actions: Any, key: Any) -> tuple[EpisodeState, Any, Any, Any, Any]:
        """Hold an action a member for a control step.

        Parameters
        ----------
        state : EpisodeState
            Where episodes are.
        actions : array, shape (member, n_action)
            From -1 to 1, cut there [-].
        key : jax.Array
            Of random numbers, another one each step.

        Returns
        -------
        tuple
            State, observations (member, n_feature), rewards (member,), which episodes ended (member,), and observations
            as they were before those began anew.
        """
        again, *keys = jax.random.split(key, 1 + self._each)
        dtype = self._lowest.dtype
        noise = [jax.random.normal(k, (self._noise, len(state.step)), dtype) for k in keys]
        state, measured, reward = self.advance(state, actions, noise)
        final, ended = self.observe(state, measured), state.step >= self.tables.ends[state.beginning]

        def begun(state: EpisodeState, seen: Any) -> tuple[EpisodeState, Any]:
            fresh, first = self.reset(again, len(state.step))
            state = jax.tree.map(lambda new, old: jnp.where(ended, new, old), fresh, state)
            return state, jnp.where(ended[:, None], first, seen)

        # few steps end an episode, and where buildings differ each member's matrices are laid out anew
        state, seen = jax.lax.cond(ended.any(), begun, lambda *as_they_are: as_they_are, state, final)
        return state, seen, reward, ended, final

    def advance(self, state: EpisodeState, actions: Any, noise: Any) -> tuple[EpisodeState, Any, Any]:
        """Advance the plants by a control step.

        Parameters
        ----------
        state : EpisodeState
            Where episodes are.
        actions : array, shape (member, n_action)
            As in `step` [-].
        noise : sequence of array, shape (n_noise, member)
            Random numbers, for each step of the plant within the control step [-].

        Returns
        -------
        tuple
            State, mean measurements (n_column, member) [library's units], rewards (member,).
        """
        shares = jnp.clip(0.5 * (actions.T.astype(self._lowest.dtype) + 1.0), 0.0, 1.0)
        setpoints = self._lowest + jnp.matmul(self._spans, shares, precision=jax.lax.Precision.HIGHEST)
        total, reward, values = 0.0, 0.0, list(state.values)
        for k, drawn in enumerate(noise):
            row = self._row(self.tables.rows, state.beginning, state.step + k)
            measured, worth, *values = self._advance(row, setpoints, drawn, *values)
            total, reward = total + measured, reward + worth
        state = EpisodeState(state.beginning, state.step + self._each, tuple(values))
        return state, total / self._each, reward / (self._each if self._of_mean else 1.0)

    def begin(self, beginning: Any) -> tuple[EpisodeState, Any]:
        """Begin chosen episodes.

        Parameters
        ----------
        beginning : array of int, shape (member,)
            Which beginning each member has.

        Returns
        -------
        tuple
            As `reset`.
        """
        values = tuple(jnp.moveaxis(v[beginning], 0, -1) for v in self.tables.values)
        state = EpisodeState(beginning, jnp.zeros_like(beginning), values)
        return state, self.observe(state, self.tables.measured[beginning].T)

    def observe(self, state: EpisodeState, measured: Any) -> Any:
        """Give observations, shape (member, n_feature) [-].

        Parameters
        ----------
        state : EpisodeState
            Where episodes are.
        measured : array, shape (n_column, member)
            As `advance` gives them [library's units].
        """
        (own,) = self._scaled(measured)
        beside = self._row(self.tables.seen, state.beginning, state.step)
        return jnp.concatenate([own, beside]).T

    def _row(self, table: Any, beginning: Any, step: Any) -> Any:
        return table[beginning, jnp.minimum(step, table.shape[1] - 1)].T


def _last_first(values: Any, members: int) -> Any:
    """Turn what has a last axis of members, or of length one, to a copy with a first one of them."""
    return np.moveaxis(np.broadcast_to(values, (*values.shape[:-1], members)), -1, 0).copy()

