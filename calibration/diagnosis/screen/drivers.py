"""What heat of unknown cause may answer to: the clock, the weather."""

from functools import partial

import numpy as np

from thermal._types import FloatArray
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import Signal, on_plane

#: Hours of a bin of the day [h].
BIN = 3


def _hours(inputs: InputProvider, first: int) -> FloatArray:
    hour = np.asarray(inputs.stamps.hour)
    return ((hour >= first) & (hour < first + BIN)).astype(float)


def _weekend(inputs: InputProvider) -> FloatArray:
    return (np.asarray(inputs.stamps.day_of_week) >= 5).astype(float)


def _outdoor(inputs: InputProvider) -> FloatArray:
    return np.asarray(inputs.outdoor - inputs.outdoor.mean())


def _sun(inputs: InputProvider, azimuth: float, tilt: float) -> FloatArray:
    return np.asarray(on_plane(inputs, azimuth, tilt)) / 100.0


def _wind(inputs: InputProvider) -> FloatArray:
    return np.asarray(inputs.wind * (inputs.usual.mean(axis=1) - inputs.outdoor)) / 10.0


def _sky(inputs: InputProvider) -> FloatArray:
    return np.asarray(inputs.sky - np.mean(inputs.sky)) / 100.0


#: Every part of the day, 1 while it lasts.
BINS = tuple(Signal(f"{h} to {h + BIN} h", "1", partial(_hours, first=h)) for h in range(0, 24, BIN))

WEEKEND = Signal("weekend", "1", _weekend)

OUTDOOR = Signal("outdoor temperature about its mean", "K", _outdoor, ("outdoor",))

#: Sun on four walls and on the roof, in hundreds of W/m2.
SUNS = tuple(
    Signal(f"sun at {a:g} deg, tilt {t:g}", "hW/m^2", partial(_sun, azimuth=a, tilt=t), ("sun",))
    for a, t in ((0.0, 90.0), (90.0, 90.0), (180.0, 90.0), (270.0, 90.0), (0.0, 0.0))
)

#: Wind times how much warmer it usually is indoors, in tens of m/s K.
WIND = Signal("wind and cold", "dam/s*K", _wind, ("wind", "outdoor", "usual"))

SKY = Signal("sky about its mean", "hW/m^2", _sky, ("sky",))
