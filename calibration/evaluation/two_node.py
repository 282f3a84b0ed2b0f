"""Coupled 2R2C network of a building, fitted to its telemetry alone: a yardstick that knows nothing of the drawing.

Air and mass of each zone, joined to each other, to every boundary, and the air to that of other zones; the sun comes in
through one aperture a zone, and a constant gain is what else there is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calibration.evaluation.intervals import Runs
from thermal._types import FloatArray, IntArray

#: Temperature that the states are counted from [K].
_REFERENCE = 293.15

#: Start of the fit, by floor area: heat capacities of air and mass [kJ/K/m2], conductances between them, to all
#: boundaries from air and from mass [W/K/m2] and aperture [-]: a room of light construction.
_AIR, _MASS, _BETWEEN, _AIR_OUT, _MASS_OUT, _APERTURE = 5.0, 80.0, 8.0, 1.0, 0.5, 0.01

#: Conductance between the air of two zones at the start [W/K].
_PAIR = 5.0

#: Range of a capacity or conductance about its start, on the logarithmic scale [-]: a factor of 1,100.
_RANGE = 7.0

#: Standard deviation of a capacity or conductance about its start, on the logarithmic scale [-], and of an error [K]
#: that it is weighed against: too weak to be felt where a conductance changes any error.
_SPREAD, _DEVIATION = 3.0, 0.3

#: Evaluations of the fit, without those of finite differences.
_EVALUATIONS = 40

#: Longest step that the fit is made with, and time between the errors that it sees [s].
_STEP, _EVERY = 1800.0, 3600.0


@dataclass(frozen=True)
class TwoNodeData:
    """Telemetry of the measured zones, one row a step.

    Parameters
    ----------
    step : float
        Length of a step [s].
    zone, known, held : ndarray, shape (n_time, n_zone)
        Measured temperatures, those a run starts from, and those that zones are held at in a spin-up [K].
    heat : ndarray, shape (n_time, n_zone)
        Metered heat [W].
    boundary : ndarray, shape (n_time, n_boundary)
        Temperatures of the boundaries [K].
    sun : ndarray, shape (n_time, n_sun)
        Global irradiance on the horizontal [W/m2]; no column where it is not measured.
    areas : ndarray, shape (n_zone,)
        Floor areas, for the start of the fit [m2].
    pairs : ndarray of int, shape (n_pair, 2)
        Zones whose air is joined.
    """

    step: float
    zone: FloatArray
    known: FloatArray
    held: FloatArray
    heat: FloatArray
    boundary: FloatArray
    sun: FloatArray
    areas: FloatArray
    pairs: IntArray

    def coarse(self, factor: int, phase: int) -> TwoNodeData:
        """Means over several steps.

        Parameters
        ----------
        factor : int
            Number of steps.
        phase : int
            A step that ends a mean.
        """
        if factor == 1:
            return self
        row = -(-(np.arange(len(self.zone)) - phase % factor) // factor)
        last = np.append(np.flatnonzero(np.diff(row)), len(row) - 1)
        first = np.append(0, last[:-1] + 1)

        def mean(values: FloatArray) -> FloatArray:
            there = np.isfinite(values)
            count = np.add.reduceat(there.astype(float), first, axis=0)
            total = np.add.reduceat(np.where(there, values, 0.0), first, axis=0)
            return np.where(count > 0, total / np.maximum(count, 1.0), np.nan)

        return replace(
            self,
            step=self.step * factor,
            zone=mean(self.zone),
            known=self.known[last],
            held=mean(self.held),
            heat=mean(self.heat),
            boundary=mean(self.boundary),
            sun=mean(self.sun),
        )


@dataclass(frozen=True)
class TwoNode:
    """A fitted network.

    Parameters
    ----------
    data : TwoNodeData
        What drives it.
    point : ndarray, shape (n_parameter,)
        Logarithms of capacities [log(kJ/K)] and conductances [log(W/K)], apertures [m2], gains [W].
    """

    data: TwoNodeData
    point: FloatArray

    @cached_property
    def parts(self) -> list[FloatArray]:
        """Capacities [kJ/K] and conductances [W/K] as in `_sizes`; then apertures [m2] and gains [W]."""
        return _split(self.data, self.point)

    def predict(self, runs: Runs, keep: NDArray[np.int64]) -> FloatArray:
        """Zone temperatures of runs, means over the steps, shape (n_run, n_kept, n_zone) [K].

        Parameters
        ----------
        runs : Runs
            Of one interval.
        keep : ndarray of int
            Steps that are wanted, increasing.
        """
        data, nz = self.data, self.data.zone.shape[1]
        air, mass, between, air_out, mass_out, joined, aperture, gain = self.parts
        air_out, mass_out = air_out.reshape(nz, -1), mass_out.reshape(nz, -1)
        diagonal = np.concatenate([between + air_out.sum(axis=1), between + mass_out.sum(axis=1)])
        a, b = data.pairs.T
        np.add.at(diagonal, a, joined)
        np.add.at(diagonal, b, joined)
        conductance, each = np.diag(diagonal), np.arange(nz)
        conductance[each, nz + each] = conductance[nz + each, each] = -between
        conductance[a, b] = conductance[b, a] = -joined
        # symmetric where states are counted by the root of their capacity, so that modes are orthogonal
        root = 1.0 / np.sqrt(1e3 * np.concatenate([air, mass]))
        rate, modes = np.linalg.eigh(root[:, None] * conductance * root)
        rate, shape = np.maximum(rate, 1e-12), root[:, None] * modes
        decay = np.exp(-rate * data.step)
        boundary = data.boundary - _REFERENCE
        lit = data.sun * aperture if data.sun.size else 0.0
        into = np.hstack([data.heat + boundary @ air_out.T + lit + gain, boundary @ mass_out.T])
        held = self._spun_up(runs, into[:, nz:], diagonal[nz:], between)
        started = np.where(np.isfinite(data.known), data.known, data.held)[runs.starts] - _REFERENCE
        state = np.hstack([started, held[runs.starts - runs.begin]]) / root @ modes
        push = into @ shape * ((1.0 - decay) / rate)
        means = np.empty((keep.size, runs.starts.size, 2 * nz))
        wanted = {int(step): i for i, step in enumerate(keep)}
        for step in range(1, int(keep[-1]) + 1):
            before, state = state, decay * state + push[runs.starts + step]
            if step in wanted:
                means[wanted[step]] = 0.5 * (before + state)
        return np.asarray(_REFERENCE + (means @ shape[:nz].T).transpose(1, 0, 2), dtype=float)

    def _spun_up(self, runs: Runs, into: FloatArray, total: FloatArray, between: FloatArray) -> FloatArray:
        """Temperatures of the masses since the spin-up began, with the air held at what was measured."""
        from scipy.signal import lfilter

        data, last = self.data, int(runs.starts[-1])
        mass = 1e3 * self.parts[1]
        level = (into[runs.begin : last + 1] + between * (data.held[runs.begin : last + 1] - _REFERENCE)) / total
        decay = np.exp(-total * data.step / mass)
        day = max(1, min(int(86400.0 / data.step), int(runs.starts[0]) - runs.begin + 1))
        first = level[:day].mean(axis=0)
        columns = [lfilter([1.0 - d], [1.0, -d], x, zi=[d * x0])[0]
                   for d, x, x0 in zip(decay, level.T, first, strict=True)]  # fmt: skip
        return np.stack(columns, axis=1)


def _sizes(data: TwoNodeData) -> list[int]:
    """Numbers of parameters of each kind; apertures are none where there is no sun."""
    nz, nb = data.zone.shape[1], data.boundary.shape[1]
    return [nz, nz, nz, nz * nb, nz * nb, len(data.pairs), nz * data.sun.shape[1], nz]


def _split(data: TwoNodeData, point: FloatArray) -> list[FloatArray]:
    parts = np.split(point, np.cumsum(_sizes(data))[:-1])
    return [*(np.exp(p) for p in parts[:6]), *parts[6:]]


def fit_two_node(data: TwoNodeData, runs: Sequence[Runs], steps: int) -> TwoNode:
    """Fit the network to runs by least squares.

    Parameters
    ----------
    data : TwoNodeData
        Of the measured zones.
    runs : sequence of Runs
        Of each tuning interval; all residuals lie in it where they start in it.
    steps : int
        N, steps from start to target.
    """
    from scipy.optimize import least_squares

    hour = max(1, round(3600.0 / data.step))
    factor = max(k for k in range(1, hour + 1)
                 if steps % k == 0 and hour % k == 0 and (k == 1 or k * data.step <= _STEP))  # fmt: skip
    phase = int(runs[0].starts[0])
    thin = data.coarse(factor, phase)
    row = -(-(np.arange(len(data.zone)) - phase % factor) // factor)
    runs = [Runs(int(row[r.begin]), row[r.starts], r.skipped) for r in runs]
    stride = max(1, round(_EVERY / thin.step))
    keep = np.arange(steps // factor, 0, -stride)[::-1]
    targets = [np.where(np.isfinite(thin.known[r.starts])[:, None],
                        thin.zone[r.starts[:, None] + keep], np.nan) for r in runs]  # fmt: skip
    seen = [np.isfinite(t) for t in targets]
    areas, nb = data.areas, data.boundary.shape[1]
    scales = [_AIR * areas, _MASS * areas, _BETWEEN * areas, np.repeat(_AIR_OUT * areas / nb, nb),
              np.repeat(_MASS_OUT * areas / nb, nb), np.full(len(data.pairs), _PAIR)]  # fmt: skip
    centre = np.log(np.concatenate(scales))
    aperture = np.repeat(_APERTURE * areas, data.sun.shape[1])
    start = np.concatenate([centre, aperture, np.zeros(len(areas))])
    low, high = np.full(start.size, -np.inf), np.full(start.size, np.inf)
    low[: centre.size], high[: centre.size] = centre - _RANGE, centre + _RANGE
    low[centre.size : centre.size + aperture.size] = 0.0

    def residuals(point: FloatArray) -> FloatArray:
        network = TwoNode(thin, point)
        errors = [(network.predict(r, keep) - t)[s] for r, t, s in zip(runs, targets, seen, strict=True)]
        prior = _DEVIATION / _SPREAD * (point[: centre.size] - centre)
        return np.concatenate([*errors, prior])

    found = least_squares(residuals, start, bounds=(low, high), x_scale="jac", max_nfev=_EVALUATIONS, ftol=1e-4)
    return TwoNode(data, found.x)
