"""Signals: time series that drive the sources of a network, made of inputs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from thermal._types import FloatArray
from thermal.inputs.provider import InputProvider


@dataclass(frozen=True)
class Signal:
    """A time series that drives sources of a network.

    Parameters
    ----------
    name : str
        Unique within a network.
    unit : str
        Its unit.
    of : callable
        Makes it from the inputs, shape (n_time,) [unit].
    inputs : tuple of str
        What it is made of and cannot do without, names of `INPUTS`; by default what every source has, the time.
    """

    name: str
    unit: str
    of: Callable[[InputProvider], FloatArray]
    inputs: tuple[str, ...] = ()


def signal_values(signals: Sequence[Signal], inputs: InputProvider) -> FloatArray:
    """Make signals from inputs.

    Parameters
    ----------
    signals : sequence of Signal
        Such as `ThermalNetwork.signals`.
    inputs : InputProvider
        Of a case, a scenario, a forecast or a feed.

    Returns
    -------
    ndarray, shape (n_time, n_signal)
        One column a signal [signal unit].

    Raises
    ------
    EffectError
        When the source lacks what a signal is made of.
    """
    for signal in signals:
        inputs.need(*signal.inputs)
    return np.column_stack([np.empty((len(inputs.stamps), 0)), *(s.of(inputs) for s in signals)])
