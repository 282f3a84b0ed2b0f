"""How much heat a machine gives at most over outdoor air, of machines that a zone's own controller runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from thermal._types import FloatArray

#: Outdoor air that is told apart [K]: capacities of air-source machines change by some percent over it.
BIN = 2.0

#: How far a setpoint must lie above the air at the end of a step for the machine to have given all it could [K].
OUT_OF_REACH = 0.3

#: Prior of the largest load: its mean is the full load [-], where heat pumps are rated [K]; standard deviations of its
#: level [-], of its slope [1/K] (machines of air source lose 1 to 3 % of their capacity a kelvin), of what is neither,
#: over a length [K], as of a compressor that stops or a resistance that comes in, and of a step's reading [-].
_MEAN, _AT = 1.0, 280.15
_LEVEL, _SLOPE, _SHAPE, _LENGTH, _READING = 0.2, 0.02, 0.2, 5.0, 0.05

#: The same of a machine with a data sheet, whose capacity is the mean, as shares of it: certified ones are within 8 %
#: (Eurovent), and air flow, defrost and ducts take some more. A step's outdoor air is told to half a kelvin [K].
_SHEET_LEVEL, _SHEET_SHAPE, _TOLD = 0.1, 0.1, 0.5

#: Medians of the fifths of a normal distribution, in standard deviations [-].
_FIFTHS = np.array([-1.2816, -0.5244, 0.0, 0.5244, 1.2816])

#: Load above which a machine runs [-].
RUNS = 0.05

#: Least load that is relied on [-].
_LEAST = 0.1


@dataclass
class HeatLimit:
    """Largest load of a machine over outdoor air, a Gaussian process that learns from steps at the limit.

    What is relied on is a standard deviation below the mean (Rasmussen and Williams 2006, Gaussian processes for
    machine learning, eq. 2.25 and 2.26): within the weather that was seen that is the load that was reached, and the
    farther from it the less. Of each `BIN` of outdoor air the last reading counts.

    Parameters
    ----------
    seen : iterable of tuple of float
        Outdoor air [K] and load [-] of steps at the limit.
    sheet : sequence of tuple of float
        Outdoor air [K], rising, and largest load [-] of a data sheet, on straight lines between them: the mean of the
        prior. Sheets have edges, where a compressor stops or a resistance comes in: the mean of the loads within the
        error of an outdoor temperature is relied on, and a reading between them says nothing. Their least would have a
        building heated all day for a compressor that may stop at night.

    Examples
    --------
    >>> import numpy as np
    >>> limit = HeatLimit([(275.0, 1.0), (270.0, 0.9)])
    >>> bool(limit.at(np.array([270.0]))[0] > limit.at(np.array([258.0]))[0])
    True
    """

    seen: Iterable[tuple[float, float]] = ()
    sheet: Sequence[tuple[float, float]] = ()
    _bins: dict[int, tuple[float, float]] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        for outdoor, load in self.seen:
            self.learn(outdoor, load)

    def learn(self, outdoor: float, load: float) -> None:
        """Take a step at the limit.

        Parameters
        ----------
        outdoor : float
            Outdoor air [K].
        load : float
            Reached [-].
        """
        self._bins[bin_of(outdoor)] = (outdoor, load)

    @property
    def readings(self) -> tuple[tuple[float, float], ...]:
        """Outdoor air [K], rising, and load [-] of the last step at the limit in each `BIN`."""
        return tuple(sorted(self._bins.values()))

    def knows(self, outdoor: float) -> bool:
        """Tell whether there is a reading within the `BIN` of an outdoor temperature.

        Parameters
        ----------
        outdoor : float
            [K].
        """
        return bin_of(outdoor) in self._bins

    def at(self, outdoor: FloatArray, error: FloatArray | float = 0.0) -> FloatArray:
        """Load that is relied on, shape (n,) [-].

        Parameters
        ----------
        outdoor : ndarray, shape (n,)
            Outdoor air [K].
        error : ndarray, shape (n,), or float
            Its standard deviation where it is forecast [K].
        """
        mean, deviation = self._posterior(outdoor, error)
        return mean if not self._bins else np.asarray(np.maximum(mean - deviation, _LEAST))

    def expected(self, outdoor: FloatArray, error: FloatArray | float = 0.0) -> FloatArray:
        """Load that is expected before anything was seen, shape (n,) [-].

        Parameters
        ----------
        outdoor, error : ndarray, shape (n,), or float
            As of `at` [K].
        """
        return np.asarray(self._near(outdoor, error).mean(axis=0))

    def likely(self, outdoor: FloatArray) -> FloatArray:
        """Load that is expected, shape (n,) [-].

        Parameters
        ----------
        outdoor : ndarray, shape (n,)
            Outdoor air [K].
        """
        return self._posterior(outdoor, 0.0)[0]

    def _posterior(self, outdoor: FloatArray, error: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Mean and standard deviation of the load, shape (n,) [-]."""
        expected = self.expected(outdoor, error)
        level, slope, shape = self._spreads
        variance = self._mean(outdoor) ** 2 * (level**2 + (slope * (outdoor - _AT)) ** 2 + shape**2)
        if not self._bins:
            return expected, np.sqrt(variance)
        at, load = np.array([*self._bins.values()]).T
        own = self._kernel(at, at) + _READING**2 * np.eye(at.size)
        cross, factor = self._kernel(outdoor, at), cho_factor(own)
        near = self._near(at, _TOLD)
        mean = expected + cross @ cho_solve(factor, load - np.clip(load, near.min(axis=0), near.max(axis=0)))
        variance = variance - np.einsum("ij,ji->i", cross, cho_solve(factor, cross.T))
        return np.asarray(mean), np.sqrt(np.maximum(variance, 0.0))

    @property
    def _spreads(self) -> tuple[float, float, float]:
        return (_SHEET_LEVEL, 0.0, _SHEET_SHAPE) if self.sheet else (_LEVEL, _SLOPE, _SHAPE)

    def _near(self, outdoor: FloatArray, error: FloatArray | float) -> FloatArray:
        """Give loads that are equally likely within the error of outdoor temperatures, shape (5, n) [-]."""
        return self._mean(outdoor + _FIFTHS[:, None] * np.asarray(error))

    def _mean(self, outdoor: FloatArray) -> FloatArray:
        """Load that is expected before anything was seen [-]."""
        if not self.sheet:
            return np.full(outdoor.shape, _MEAN)
        return np.asarray(np.interp(outdoor, *np.array(self.sheet).T))

    def _kernel(self, a: FloatArray, b: FloatArray) -> FloatArray:
        level, slope, shape = self._spreads
        straight = level**2 + slope**2 * np.outer(a - _AT, b - _AT)
        shares = straight + shape**2 * np.exp(-0.5 * ((a[:, None] - b) / _LENGTH) ** 2)
        return np.asarray(np.outer(self._mean(a), self._mean(b)) * shares)


def bin_of(outdoor: float) -> int:
    """Tell the bin of an outdoor temperature.

    Parameters
    ----------
    outdoor : float
        [K].
    """
    return round(outdoor / BIN)


def limits_of(outdoor: FloatArray, level: FloatArray, above: FloatArray) -> tuple[tuple[float, float], ...]:
    """Find steps at which a setpoint was out of reach, or the load full: outdoor air [K], most load of each bin [-].

    Parameters
    ----------
    outdoor : ndarray, shape (n_time,)
        Outdoor air [K].
    level : ndarray, shape (n_time,)
        Loads [-].
    above : ndarray, shape (n_time,)
        How far the setpoint lies above the zone's air [K].
    """
    found: dict[int, tuple[float, float]] = {}
    for k in np.flatnonzero((above > OUT_OF_REACH) & (level > RUNS) | (level >= 1.0)):
        known = found.get(bin_of(outdoor[k]))
        if known is None or level[k] > known[1]:
            found[bin_of(outdoor[k])] = (float(outdoor[k]), float(level[k]))
    return tuple(sorted(found.values()))
