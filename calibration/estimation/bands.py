"""Predictions that carry the filter's unmeasured heat on, with bands that hold on days that were left out.

A band is as wide as the filter says of each zone and each step ahead, times a factor a zone: the quantile of what
errors on left-out tuning days were of it (Papadopoulos, Vovk and Gammerman 2011, doi:10.1613/jair.3198, for such
normalised conformal predictions). So a disturbance that is no Ornstein-Uhlenbeck process, parameters that the days
leave open and innovations with heavy tails are counted as they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.filtered import evaluate_filter, prepare
from calibration.estimation.gains import Covariance
from calibration.estimation.kalman import KalmanFilter
from calibration.evaluation.carried import LEVEL, Carried
from calibration.evaluation.intervals import Interval
from calibration.evaluation.n_step import Evaluation, EvaluationSettings
from thermal._types import FloatArray
from thermal.model.case_replay import Inputs
from thermal.model.matrices import SymbolicModel

#: Zones beyond which a filter has steady gains: exact ones take minutes there.
_MOST_ZONES = 40


@dataclass(frozen=True)
class Forecaster:
    """A model whose predictions begin from a filter.

    Parameters
    ----------
    model : SymbolicModel
        Reduced.
    inputs : Inputs
        The telemetry.
    disturbance : DisturbanceModel
        Unmeasured heat and sensors, tuned on other intervals than those that are judged.
    settings : EvaluationSettings
        Horizons, time stepping and spin-up.
    """

    model: SymbolicModel
    inputs: Inputs
    disturbance: DisturbanceModel
    settings: EvaluationSettings

    def judge(self, theta: FloatArray, intervals: Sequence[Interval], factors: Mapping[str, float]) -> Carried:
        """Errors of predictions that carry the unmeasured heat on, and how often their bands hold.

        Parameters
        ----------
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        intervals : sequence of Interval
            Where the targets lie.
        factors : mapping of str to float
            Of the bands, by zone [-], see `factors`; empty where none could be made.
        """
        found, deviation = self._predict(theta, intervals)
        own = np.array([factors.get(zone, np.nan) for zone in found.zones])
        share = _shares(found, deviation) / own
        known = np.isfinite(share)
        width = (own * deviation[-1])[known.any(axis=0)]
        return Carried(
            **found.metrics.to_dict(),
            by_horizon=found.by_horizon,
            coverage=float(np.mean(share[known] <= 1.0)) if known.any() else None,
            half_width=float(np.mean(width)) if width.size else None,
        )

    def factors(self, parts: Sequence[Interval], thetas: Sequence[FloatArray]) -> dict[str, float]:
        """Factors of the bands: 90 % quantile of errors over the filter's deviation, by zone [-].

        Parameters
        ----------
        parts : sequence of Interval
            Days that were left out in turn.
        thetas : sequence of ndarray, shape (n_parameter,)
            Fits without each of them [parameter units].
        """
        shares = [_shares(*self._predict(theta, [part])) for part, theta in zip(parts, thetas, strict=True)]
        if not shares:
            return {}
        by_zone = np.concatenate(shares)
        seen = np.isfinite(by_zone).any(axis=0)
        zones = self.model.network.zones
        return {zones[z]: float(np.nanquantile(by_zone[:, z], LEVEL)) for z in np.flatnonzero(seen)}

    def _predict(self, theta: FloatArray, intervals: Sequence[Interval]) -> tuple[Evaluation, FloatArray]:
        """Predictions, and the deviation of what is measured from them after each step, (n_kept, n_zone) [K]."""
        settings = replace(self.settings, trajectories=True)
        measured = np.asarray(np.isfinite(self.inputs.zone).any(axis=0))
        covariance: Covariance = "steady" if measured.size > _MOST_ZONES else "exact"
        found = evaluate_filter(
            self.model, theta, self.inputs, intervals, self.disturbance, settings, covariance=covariance
        )
        kalman = KalmanFilter(prepare(self.model, theta, self.inputs, settings.scheme).space, self.disturbance)
        ahead = kalman.prediction_deviation(found.steps, measured)
        return found, np.sqrt(ahead**2 + kalman.whole.noise_variance)


def _shares(found: Evaluation, deviation: FloatArray) -> FloatArray:
    """Absolute errors over their deviations, (n_run * n_kept, n_zone) [-]; NaN where nothing was measured."""
    errors = np.concatenate([p.simulated - p.measured for p in found.predictions])
    return np.asarray((np.abs(errors) / deviation).reshape(-1, errors.shape[-1]))
