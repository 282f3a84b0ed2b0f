"""Runs of machines that run whole or not at all: how long, how long not, and how many starts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mpc.identify.maps import MachineMap
from thermal._types import FloatArray

#: A duty above this is a run [-].
HALF = 0.5


@dataclass(frozen=True)
class RunSettings:
    """Limits and price of runs.

    Parameters
    ----------
    most : float
        Starts that may be used at once [-].
    back : float
        Starts that come back with each step [-].
    hold : int
        Shortest run and shortest rest, in steps.
    price : float
        Of a start [currency].
    """

    most: float
    back: float
    hold: int
    price: float


@dataclass
class Runs:
    """Runs of a machine in duty: whether it runs, since how many steps, and the starts that it has left.

    Parameters
    ----------
    machine : int
        Its place among the machines.
    settings : RunSettings
        Limits and price.
    """

    machine: int
    settings: RunSettings
    left: float = field(init=False)
    on: bool = field(default=False, init=False)
    since: int = field(default=1_000_000, init=False)

    def __post_init__(self) -> None:
        self.left = self.settings.most

    def possible(self) -> tuple[bool, ...]:
        """Whether it may be on or off next, by run times and the limit of starts."""
        if self.since < self.settings.hold:
            return (self.on,)
        return (False,) if not self.on and self.left < 1.0 else (True, False)

    def block(self, on: bool, count: int) -> int:
        """Tell the steps that a choice holds: a shortest run, or a rest until there is a start again; else one.

        Parameters
        ----------
        on : bool
            The choice.
        count : int
            Steps of the horizon.
        """
        if not on:
            back = self.settings.back
            wait = (1.0 - self.left) / back if back > 0.0 else np.inf if self.left < 1.0 else 0.0
            return int(np.clip(np.ceil(wait - 1e-9), 1, count))
        return max(self.settings.hold - self.since, 1) if self.on else self.settings.hold

    def starting(self, on: bool, later: FloatArray) -> float:
        """Price the starts that follow from a choice [currency].

        What is off and will run later starts once either way. What has run n steps shares its start among them: another
        step makes that c / n cheaper, which is what an end of the run forgoes.

        Parameters
        ----------
        on : bool
            The choice.
        later : ndarray, shape (n,)
            Duties that are planned after it [-].
        """
        price = self.settings.price * self.settings.most / max(self.left, 0.5)
        if on:
            return 0.0 if self.on else price
        if float(later.sum()) <= HALF:
            return 0.0
        return price / max(self.since, 1) if self.on else price

    def note(self, level: float) -> None:
        """Write down whether it runs.

        Parameters
        ----------
        level : float
            Its duty in the coming step [-].
        """
        on = level > HALF
        self.left = min(self.left - float(on and not self.on) + self.settings.back, self.settings.most)
        self.since = 1 if on != self.on else self.since + 1
        self.on = on


def command_of(found: MachineMap, level: float) -> float:
    """Value of a machine's actuator for a level [its unit].

    Parameters
    ----------
    found : MachineMap
        Of a machine that is commanded.
    level : float
        Duty or load [-].
    """
    actuator = found.machine.actuator
    low, high = actuator.lowest, actuator.highest
    if found.operation == "duty":
        return high if level > HALF else low
    value = low + level * (high - low)
    if actuator.minimum is not None and value < actuator.minimum:
        return actuator.minimum if value > 0.5 * (low + actuator.minimum) else low
    return float(np.clip(value, low, high))
