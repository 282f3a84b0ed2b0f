"""Setpoints by rule: supply air and water reset by the outdoor temperature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.channels import Channel
from mpc.loop.actuators import SUPPLY_AIR, SUPPLY_WATER
from thermal._types import FloatArray


@dataclass(frozen=True)
class ResetRule:
    """Outdoor reset: straight lines between a cold and a warm day.

    Parameters
    ----------
    cold, warm : float
        Outdoor temperatures between which the setpoints move [K]: defaults -7 and 16 degC.
    air, water : tuple of float
        Setpoints on the cold and on the warm day [K]. Defaults 18 to 13 degC for air (ASHRAE 90.1's reset of 5 K) and
        80 to 50 degC for water.
    """

    cold: float = 266.15
    warm: float = 289.15
    air: tuple[float, float] = (291.15, 286.15)
    water: tuple[float, float] = (353.15, 323.15)

    def setpoints(self, channels: Sequence[Channel], outdoor: float) -> FloatArray:
        """Setpoints at an outdoor temperature, shape (n_channel,) [unit of the channel].

        Parameters
        ----------
        channels : sequence of Channel
            What is decided; pressures and zones get the middle of their range.
        outdoor : float
            Outdoor temperature [K]; what is not finite counts as half-way.
        """
        share = np.clip((outdoor - self.cold) / (self.warm - self.cold), 0.0, 1.0) if np.isfinite(outdoor) else 0.5
        by_rule = {SUPPLY_AIR: self.air, SUPPLY_WATER: self.water}
        values = []
        for channel in channels:
            first, last = by_rule.get(channel.quantity, (0.5 * (channel.lower + channel.upper),) * 2)
            values.append(np.clip(first + share * (last - first), channel.lower, channel.upper))
        return np.array(values)

    def plan(self, predictor: Predictor, outdoor: FloatArray) -> FloatArray:
        """Plan by rule, shape (n_block, n_channel) [unit of the channel].

        Parameters
        ----------
        predictor : Predictor
            Of the horizon.
        outdoor : ndarray, shape (N,)
            Outdoor temperature over each step [K].
        """
        horizon = predictor.horizon
        means = [outdoor[horizon.block_of == b].mean() for b in range(horizon.n_block)]
        return np.stack([self.setpoints(predictor.channels, float(mean)) for mean in means])
