"""Signals: time series that drive the sources of a network, made of inputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

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

    @classmethod
    def made(
        cls, name: str, unit: str, of: Callable[..., FloatArray], *inputs: str, given: Mapping[str, object]
    ) -> Signal:
        """Signal that is made of inputs and of what stays the same, such as a zone's name.

        Parameters
        ----------
        name, unit : str
            As above.
        of : callable
            Makes it from the inputs and what is given, shape (n_time,) [unit].
        *inputs : str
            What it is made of.
        given : mapping
            What is passed on to ``of``, by name.
        """
        return cls(name, unit, partial(of, **given), inputs)


def of_zone(inputs: InputProvider, name: str, zone: str, factor: float = 1.0) -> FloatArray:
    """One zone's column of an input, shape (n_time,).

    Parameters
    ----------
    inputs : InputProvider
        Source of the input.
    name, zone : str
        Input and zone.
    factor : float
        What it is multiplied by [-].
    """
    return np.asarray(factor * inputs.values(name)[:, inputs.zones.index(zone)])


def zone_signal(name: str, unit: str, of: str, zone: str, factor: float = 1.0) -> Signal:
    """Signal that is one zone's column of an input.

    Parameters
    ----------
    name, unit : str
        Of the signal.
    of, zone : str
        Input and zone.
    factor : float
        What it is multiplied by [-].
    """
    return Signal.made(name, unit, of_zone, of, given={"name": of, "zone": zone, "factor": factor})


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


def _always(inputs: InputProvider, value: float) -> FloatArray:
    return np.full(len(inputs.stamps), value)


#: A signal that is 1 throughout.
CONSTANT = Signal.made("constant", "1", _always, given={"value": 1.0})

#: A temperature that stays at the reference; what differs from it acts as heat.
STEADY = Signal.made("constant temperature", "K", _always, given={"value": 0.0})


def on_plane(inputs: InputProvider, azimuth: float, tilt: float) -> FloatArray:
    """Irradiance on a plane, shape (n_time,) [W/m2].

    Parameters
    ----------
    inputs : InputProvider
        With the sun.
    azimuth, tilt : float
        Clockwise from north, and of the normal from the vertical [deg].
    """
    return np.asarray(sum(inputs.sun.plane(azimuth, tilt)))


#: Periods of heat that recurs from day to day [h].
_PERIODS = (24.0, 12.0, 8.0)


def _wave(of: Callable[[FloatArray], FloatArray], period: float, hours: FloatArray) -> FloatArray:
    return of(2.0 * np.pi * hours / period)


def _by_clock(inputs: InputProvider, of: Callable[[FloatArray], FloatArray]) -> FloatArray:
    return of(inputs.clock)


def daily_waves() -> dict[str, Callable[[FloatArray], FloatArray]]:
    """Sine and cosine of each period by name, as functions of the hour of the day."""
    return {
        f"{of.__name__} of {period:g} h": partial(_wave, of, period) for period in _PERIODS for of in (np.sin, np.cos)
    }


#: Sines and cosines of the clock on the wall, of which heat that recurs from day to day is made.
DAILY = tuple(Signal.made(name, "1", _by_clock, given={"of": of}) for name, of in daily_waves().items())
