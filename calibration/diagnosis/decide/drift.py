"""Drift: how the error of a free run grows with time, and what its slope on logarithmic axes says of its cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from calibration.diagnosis.refit.comparison import Fit
from calibration.errors import NotEnoughDataError
from calibration.evaluation.intervals import Interval, Runs, select_runs
from calibration.evaluation.n_step import Wanted, predict_runs
from thermal._types import FloatArray
from thermal.model.replay import Inputs

Kind = Literal["sensors", "random", "persistent", "hump"]

#: Length of the runs where the telemetry allows [s], and steps of them that are kept at most.
_LENGTH, _KEPT = 86400.0, 48

#: Time between starts beyond the hour's whole steps [steps]: runs that all start on the hour would have every switch of
#: a schedule at the same place.
_OFF_THE_HOUR = 1

#: The curve grows until it is this share of its largest [-], or for so many points; what follows is the end of growth.
_GROWN, _FEWEST = 0.6, 4

#: Borders of the slopes 0, 1/2 and 1 [-]. The upper is below the middle: walls that warm after the air pull the slope
#: of a persistent heat down, and nothing pulls that of a random one up.
_HARDLY, _RANDOM = 0.25, 0.62

#: Steepest slope that is sought [-]: no heat makes a temperature run ahead of time.
_STEEPEST = 1.1

#: Where a wrong mass or lag shows [s], and the least ratio to the smallest error of the six hours after [-].
_HUMP, _HIGHER, _AFTER = (600.0, 3600.0), 1.1, 21600.0


@dataclass(frozen=True)
class DriftCurve:
    """Root mean square error over runs and zones by time since the start.

    Parameters
    ----------
    seconds : ndarray, shape (n_kept,)
        Time since the start, ends of steps [s].
    rms : ndarray, shape (n_kept,)
        Error [K].

    Examples
    --------
    >>> time = 300.0 * np.arange(1, 289)
    >>> walk = DriftCurve(time, 0.1 * np.sqrt(time / 300.0))
    >>> walk.kind, round(walk.slope, 2)
    ('random', 0.5)
    """

    seconds: FloatArray
    rms: FloatArray

    @cached_property
    def slope(self) -> float:
        """Slope p on logarithmic axes while the error grows [-].

        ``E² = s² + a² (1 - exp(-t/τ))^2p``: beside an error s that is there from the start, and before it levels off
        with τ, it grows as t^p. s and τ are tried on a grid, a and p follow by least squares of log E.
        """
        time, error = self._growth()
        best, slope = np.inf, 0.0
        target = np.log(error)
        for share in np.concatenate([[0.0], np.linspace(0.3, 0.95, 14)]):
            floor = (share * float(error.min())) ** 2
            grown = 0.5 * np.log(error**2 - floor)
            for time_constant in [*(time[-1] * np.geomspace(0.3, 5.0, 12)), np.inf]:
                x = np.log(time if np.isinf(time_constant) else -np.expm1(-time / time_constant))
                p, a = np.polyfit(x, grown, 1)
                misfit = float(np.mean((0.5 * np.log(floor + np.exp(2.0 * (a + p * x))) - target) ** 2))
                if misfit < best and -0.1 <= p <= _STEEPEST:
                    best, slope = misfit, float(p)
        return slope

    @cached_property
    def hump(self) -> tuple[float, float, float] | None:
        """When the error is largest in the first hour [s], how large [K], and to what it falls [K]; None without."""
        inside = (self.seconds >= _HUMP[0]) & (self.seconds <= _HUMP[1])
        if not inside.any():
            return None
        top = int(np.argmax(np.where(inside, self.rms, -np.inf)))
        after = (self.seconds > self.seconds[top]) & (self.seconds <= self.seconds[top] + _AFTER)
        if not after.any() or self.rms[top] < _HIGHER * max(float(self.rms[after].min()), float(self.rms[0])):
            return None
        return float(self.seconds[top]), float(self.rms[top]), float(self.rms[after].min())

    @property
    def kind(self) -> Kind:
        """What such a curve comes from: slope 0 sensors, 1/2 random heat, 1 persistent heat, a hump mass or lag."""
        if self.hump is not None:
            return "hump"
        if self.slope < _HARDLY:
            return "sensors"
        return "random" if self.slope < _RANDOM else "persistent"

    def _growth(self) -> tuple[FloatArray, FloatArray]:
        """Find times and errors while it grows; all of a curve that begins near its top."""
        error = np.maximum(self.rms, 1e-9)
        enough = _GROWN * float(error.max())
        if error[0] >= enough:
            return self.seconds, error
        count = max(int(np.argmax(error >= enough)) + 1, _FEWEST)
        return self.seconds[:count], error[:count]


def drift_of(fit: Fit, intervals: Sequence[Interval]) -> DriftCurve:
    """Error of a fitted model's free runs over a day, or as long as the telemetry allows.

    Parameters
    ----------
    fit : Fit
        The model.
    intervals : sequence of Interval
        Where the runs end.

    Raises
    ------
    NotEnoughDataError
        When there is no room for a run of a single step.
    """
    inputs, matrices = fit.built.inputs, fit.model.matrices(fit.theta)
    steps, runs = _longest(inputs, intervals, fit.settings.spin_up_seconds)
    keep = np.unique(np.round(np.geomspace(1, steps, min(steps, _KEPT))).astype(np.int64))
    squared = np.zeros(len(keep))
    count = np.zeros(len(keep))
    for interval, chosen in zip(intervals, runs, strict=True):
        found = predict_runs(fit.model, matrices, inputs, interval, Wanted(chosen, keep), fit.settings.stepping)
        error = (found.simulated - found.measured) ** 2
        squared += np.nansum(error, axis=(0, 2))
        count += np.isfinite(error).sum(axis=(0, 2))
    return DriftCurve(np.asarray(keep * inputs.step, dtype=float), np.sqrt(squared / np.maximum(count, 1)))


def _longest(inputs: Inputs, intervals: Sequence[Interval], spin_up_seconds: float) -> tuple[int, list[Runs]]:
    """Count the steps of a day and find the runs of each interval; half as many until every interval has a run."""
    steps = max(1, round(_LENGTH / inputs.step))
    every = inputs.step * (max(1, round(3600.0 / inputs.step)) + _OFF_THE_HOUR)
    while steps:
        try:
            runs = [select_runs(inputs, i, steps, every=every, spin_up=spin_up_seconds) for i in intervals]
        except NotEnoughDataError:
            runs = []
        if runs and all(r.starts.size for r in runs):
            return steps, runs
        steps //= 2
    raise NotEnoughDataError(f"drift: expected room for a run of one step in each of {len(intervals)} intervals")
