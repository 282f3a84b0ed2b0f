"""What a machine buys beyond its map over outdoor air and load, learned from steps: stages, resistances, icing."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from mpc.identify.limits import bin_of
from thermal._types import FloatArray

if TYPE_CHECKING:  # whose module imports this one
    from mpc.identify.maps import Curve

#: A reading: outdoor air [K], load [-], power over that of the map, less 1 [-], and the steps that it is the mean of.
Reading = tuple[float, float, float, float]

#: Loads that are told apart [-], and the least load of a reading: below it what stands by hides what is bought.
_LOADS, _LEAST = 0.1, 0.1

#: Prior of the correction: standard deviation [-], lengths over outdoor air [K] and load [-] and, where there is a data
#: sheet, over the largest load of its outdoor air [-]. A resistance takes three times what a compressor takes for the
#: same heat, of which maps that are smooth take the half; a kelvin of length three is as sharp as two bins tell.
_SPREAD, _OUTDOOR, _LOAD, _EDGE = 0.3, 3.0, 0.2, 0.1

#: Standard deviation of a step's reading [-], as thermostats run machines for parts of a step, and steps of a mean.
_READING, _STEPS = 0.1, 8.0


@dataclass(frozen=True)
class OwnPower:
    """What a machine's own sensor of power says.

    Parameters
    ----------
    curve : Curve
        Power beyond `idle` [W].
    idle : float
        Power while it gives nothing [W].
    readings : tuple of tuple of float
        Power over that of the curve, see `Reading`.
    """

    curve: Curve
    idle: float
    readings: tuple[Reading, ...] = ()


class PowerCorrection:
    """Power of a machine over that of its map, less 1: a Gaussian process over outdoor air and load.

    Its mean is what is counted with (Rasmussen and Williams 2006, Gaussian processes for machine learning, eq. 2.25),
    0 where nothing was seen. Of each bin of outdoor air and load the mean of the last steps counts.

    Parameters
    ----------
    seen : iterable of tuple of float
        Readings, see `Reading`.
    sheet : sequence of tuple of float
        Outdoor air [K], rising, and largest load [-] of a data sheet: beyond an edge of it a machine is another one, of
        which readings before the edge say nothing.

    Examples
    --------
    >>> import numpy as np
    >>> correction = PowerCorrection([(258.0, 0.5, 0.5, 8.0)])
    >>> correction.at(np.array([258.0, 285.0]), np.array([[0.5], [0.5]])).round(2).tolist()
    [[0.49], [0.0]]
    """

    def __init__(self, seen: Iterable[Reading] = (), sheet: Sequence[tuple[float, float]] = ()) -> None:
        self._sheet = np.array(sheet).T if sheet else None
        self._bins: dict[tuple[int, int, int], Reading] = {}
        for reading in seen:
            self._bins[self._key(*reading[:2])] = reading

    @property
    def readings(self) -> tuple[Reading, ...]:
        """What was learned, see `Reading`."""
        return tuple(self._bins[key] for key in sorted(self._bins))

    def learn(self, outdoor: float, load: float, ratio: float) -> None:
        """Take a step.

        Parameters
        ----------
        outdoor : float
            Outdoor air [K].
        load : float
            Of the machine [-]; too small ones are left out.
        ratio : float
            Power over that of the map, less 1 [-].
        """
        if load < _LEAST:
            return
        key = self._key(outdoor, load)
        *means, count = self._bins.get(key, (0.0, 0.0, 0.0, 0.0))
        count = min(count + 1.0, _STEPS)
        new = [mean + (value - mean) / count for mean, value in zip(means, (outdoor, load, ratio), strict=True)]
        self._bins[key] = (new[0], new[1], new[2], count)

    def at(self, outdoor: FloatArray, load: FloatArray) -> FloatArray:
        """Power over that of the map, less 1, shape (n, l) [-].

        Parameters
        ----------
        outdoor : ndarray, shape (n,)
            Outdoor air [K].
        load : ndarray, shape (n, l)
            Of the machine [-].
        """
        if not self._bins:
            return np.zeros(load.shape)
        air, level, ratio, count = np.array([*self._bins.values()]).T
        own = self._kernel(air, level, air, level) + np.diag(_READING**2 / count)
        cross = self._kernel(np.repeat(outdoor, load.shape[1]), load.ravel(), air, level)
        return np.asarray((cross @ cho_solve(cho_factor(own), ratio)).reshape(load.shape))

    def _key(self, outdoor: float, load: float) -> tuple[int, int, int]:
        return bin_of(outdoor), round(float(self._side(np.array([outdoor]))[0]) / _EDGE), round(load / _LOADS)

    def _side(self, outdoor: FloatArray) -> FloatArray:
        """Largest load of the data sheet, which tells the sides of its edges [-]."""
        return np.zeros(outdoor.shape) if self._sheet is None else np.asarray(np.interp(outdoor, *self._sheet))

    def _kernel(self, air: FloatArray, load: FloatArray, of_air: FloatArray, of_load: FloatArray) -> FloatArray:
        apart = ((air[:, None] - of_air) / _OUTDOOR) ** 2 + ((load[:, None] - of_load) / _LOAD) ** 2
        apart += ((self._side(air)[:, None] - self._side(of_air)) / _EDGE) ** 2
        return np.asarray(_SPREAD**2 * np.exp(-0.5 * apart))
