"""Proximal policy optimisation as one function of JAX: plants, network and optimiser on the same device."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpc.environment.functional import FunctionalEnvironment
from mpc.environment.policy import ActorNetwork
from mpc.errors import MpcError
from thermal.batch.functional import HAS_JAX

if HAS_JAX:
    import jax
    import jax.numpy as jnp
    import optax


@dataclass(frozen=True)
class PpoSettings:
    """How a policy learns (Schulman et al. 2017, arXiv:1707.06347); names and values are those of Stable-Baselines3.

    Parameters
    ----------
    members : int
        Environments at once.
    n_steps, n_batches, n_epochs : int
        Control steps of a roll-out, batches that its samples are shared out to, and times that each is looked at.
    gamma, gae_lambda : float
        Discount, and the share of later errors in an advantage [-].
    clip_range : float
        Largest change of a probability that is rewarded [-].
    learning_rate, max_grad_norm, vf_coef : float
        Of Adam; largest norm of a gradient; weight of the error of values [-].
    log_std_init : float
        Logarithm of the first standard deviation of actions [-].
    reward_scale : float
        What rewards are multiplied by.
    units : tuple of int
        Of the hidden layers.

    Raises
    ------
    MpcError
        When samples cannot be shared out evenly.
    """

    members: int = 512
    n_steps: int = 64
    n_batches: int = 4
    n_epochs: int = 2
    gamma: float = 0.98
    gae_lambda: float = 0.95
    clip_range: float = 0.2
    learning_rate: float = 3e-4
    max_grad_norm: float = 0.5
    vf_coef: float = 0.5
    log_std_init: float = -0.5
    reward_scale: float = 10.0
    units: tuple[int, ...] = (64, 64)

    def __post_init__(self) -> None:
        even = self.n_batches > 0 and self.samples % self.n_batches == 0 and self.samples > 0
        MpcError.unless(even, "PpoSettings", f"{self.samples} samples shared out evenly", f"{self.n_batches} batches")

    @property
    def samples(self) -> int:
        """Control steps of a roll-out, of all members."""
        return self.members * self.n_steps


@dataclass(frozen=True)
class Ppo:
    """Learning in an environment.

    Parameters
    ----------
    world : FunctionalEnvironment
        Where the policy acts.
    settings : PpoSettings
        How it learns.

    Examples
    --------
    >>> learner = Ppo(FunctionalEnvironment(VectorEnvironment(single, 64)))  # doctest: +SKIP
    >>> weights, rewards = jax.jit(learner.learn, static_argnums=1)(jax.random.key(0), 610)  # doctest: +SKIP
    >>> learner.policy(weights).save("policy.npz")  # doctest: +SKIP
    """

    world: FunctionalEnvironment
    settings: PpoSettings = PpoSettings()

    def learn(self, key: Any, rounds: int) -> tuple[Any, Any]:
        """Learn from scratch; to be compiled by `jax.jit` with a fixed number of rounds.

        Parameters
        ----------
        key : jax.Array
            Of random numbers.
        rounds : int
            Roll-outs of `PpoSettings.samples` control steps, each followed by an update.

        Returns
        -------
        weights : dict
            As `policy` takes them.
        rewards : array, shape (rounds,)
            Mean of a control step in each roll-out.
        """
        begin, nets, run = jax.random.split(key, 3)
        state, seen = self.world.reset(begin, self.settings.members)
        weights = self._weights(nets, seen.shape[1], self.world.actions)
        adam = self._optimiser()
        start: Any = weights, adam.init(weights), state, seen
        (weights, *_), rewards = jax.lax.scan(self._round, start, jax.random.split(run, rounds))
        return weights, rewards

    def policy(self, weights: Any, **about: Any) -> ActorNetwork:
        """Give what was learned as a policy in NumPy.

        Parameters
        ----------
        weights : dict
            Of `learn`.
        **about
            How it was trained, as plain values.
        """
        layers = weights["actor"]
        return ActorNetwork(
            tuple(np.asarray(w).T for w, _ in layers), tuple(np.asarray(b) for _, b in layers), "tanh", False, about
        )

    def _optimiser(self) -> Any:
        s = self.settings
        return optax.chain(optax.clip_by_global_norm(s.max_grad_norm), optax.adam(s.learning_rate, eps=1e-5))

    def _weights(self, key: Any, seen: int, actions: int) -> dict[str, Any]:
        """Orthogonal layers: small ones at the end of the actor, so that first actions are about the middle."""
        hidden = self.settings.units

        def layers(key: Any, out: int, last: float) -> list[Any]:
            sizes = [seen, *hidden, out]
            keys = jax.random.split(key, len(sizes) - 1)
            scales = [2.0**0.5] * len(hidden) + [last]
            return [
                (jax.nn.initializers.orthogonal(scale)(k, (a, b)), jnp.zeros(b))
                for k, scale, a, b in zip(keys, scales, sizes[:-1], sizes[1:], strict=True)
            ]

        first, second = jax.random.split(key)
        log_std = jnp.full(actions, self.settings.log_std_init)
        return {"actor": layers(first, actions, 0.01), "critic": layers(second, 1, 1.0), "log_std": log_std}

    def _round(self, carried: Any, key: Any) -> Any:
        """Roll out, and update."""
        weights, moments, state, seen = carried
        acting, learning = jax.random.split(key)

        def act(now: Any, key: Any) -> Any:
            state, seen = now
            for_noise, for_world = jax.random.split(key)
            mean, value = _forward(weights["actor"], seen), _forward(weights["critic"], seen)[:, 0]
            action = mean + jnp.exp(weights["log_std"]) * jax.random.normal(for_noise, mean.shape)
            state, after, reward, ended, final = self.world.step(state, action, for_world)
            reward = reward * self.settings.reward_scale
            beyond = jnp.where(ended, _forward(weights["critic"], final)[:, 0], 0.0)  # truncated, not over
            done = seen, action, _log_probability(weights, mean, action), value, reward, ended, beyond
            return (state, after), done

        keys = jax.random.split(acting, self.settings.n_steps)
        (state, seen), done = jax.lax.scan(act, (state, seen), keys)
        looked_at, action, chance, value, rewards, ended, beyond = done
        advantages = self._advantages(value, rewards, ended, beyond, _forward(weights["critic"], seen)[:, 0])
        rows = looked_at, action, chance, advantages, advantages + value
        flat = jax.tree.map(lambda v: v.reshape(self.settings.samples, *v.shape[2:]), rows)
        orders = jax.random.split(learning, self.settings.n_epochs)
        learned, _ = jax.lax.scan(lambda now, k: self._epoch(now, k, flat), (weights, moments), orders)
        return (*learned, state, seen), rewards.mean() / self.settings.reward_scale

    def _advantages(self, values: Any, rewards: Any, ended: Any, beyond: Any, last: Any) -> Any:
        """Generalised advantage estimation (arXiv:1506.02438), shape (n_steps, member)."""
        s = self.settings
        after = jnp.where(ended, beyond, jnp.concatenate([values[1:], last[None]]))
        errors = rewards + s.gamma * after - values

        def back(advantage: Any, step: Any) -> Any:
            error, over = step
            advantage = error + s.gamma * s.gae_lambda * jnp.where(over, 0.0, advantage)
            return advantage, advantage

        return jax.lax.scan(back, jnp.zeros_like(last), (errors, ended), reverse=True)[1]

    def _epoch(self, learned: Any, key: Any, rows: Any) -> Any:
        """Look at all samples once, in another order."""
        s = self.settings
        order = jax.random.permutation(key, s.samples).reshape(s.n_batches, -1)

        def update(now: Any, chosen: Any) -> Any:
            weights, moments = now
            slope = jax.grad(self._loss)(weights, *(v[chosen] for v in rows))
            change, moments = self._optimiser().update(slope, moments, weights)
            return (optax.apply_updates(weights, change), moments), None

        return jax.lax.scan(update, learned, order)

    def _loss(self, weights: Any, seen: Any, action: Any, before: Any, advantage: Any, target: Any) -> Any:
        s = self.settings
        ratio = jnp.exp(_log_probability(weights, _forward(weights["actor"], seen), action) - before)
        scaled = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        gain = jnp.minimum(ratio * scaled, jnp.clip(ratio, 1.0 - s.clip_range, 1.0 + s.clip_range) * scaled)
        error = _forward(weights["critic"], seen)[:, 0] - target
        return s.vf_coef * (error**2).mean() - gain.mean()


def _forward(layers: Any, x: Any) -> Any:
    for weight, bias in layers[:-1]:
        x = jnp.tanh(x @ weight + bias)
    weight, bias = layers[-1]
    return x @ weight + bias


def _log_probability(weights: Any, mean: Any, action: Any) -> Any:
    """Of actions under normal ones; constants that a ratio does not show are left out."""
    off = (action - mean) / jnp.exp(weights["log_std"])
    return -(0.5 * off**2 + weights["log_std"]).sum(axis=-1)
