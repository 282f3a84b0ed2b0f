"""Heat that a fitted model lacks in every zone, hour by hour, with its band."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.special import ndtri

from calibration.diagnosis.refit.comparison import Fit
from calibration.estimation.disturbance import DisturbanceModel
from calibration.estimation.filtered import FilterSettings, filter_interval
from calibration.estimation.heat_balance import HOUR, heat_balance, hourly_means
from calibration.estimation.innovations import TuningSettings, air_volumes, tune_disturbance
from calibration.estimation.smoother import averaged_deviation, smooth
from calibration.evaluation.intervals import Interval
from thermal._types import FloatArray
from thermal.model.reduce import ReducedModel, reduced_model

#: Telemetry that the size and the course of the missing heat are tuned on [s]: the last four days that were fitted,
#: of which at most two are a weekend.
_TUNED = 4 * 86400.0

#: Zones beyond which gains are steady, the model is of a smaller order, the missing heat is in proportion to the zones'
#: air, and a day is tuned on: the five hundred states of 123 zones are too many to smooth by.
_MANY_ZONES, _ORDER, _TUNED_MANY = 40, 200, 86400.0

#: Step of a parameter on the estimation scale for the sensitivity of the missing heat [-].
_STEP = 1e-3


@dataclass(frozen=True)
class Missing:
    """Heat that a model needs beside the metered heat to follow the measured zone temperatures.

    Parameters
    ----------
    watts, deviation : DataFrame, shape (n_hour, n_zone)
        Mean over each hour by the stamp of its beginning, positive where the zone gets heat that the model does not
        know of, and its standard deviation [W]; NaN where telemetry is missing in the hour.
    disturbance : DisturbanceModel
        Size and course of the missing heat, and noise of the sensors, that they follow from.
    """

    watts: pd.DataFrame
    deviation: pd.DataFrame
    disturbance: DisturbanceModel

    def band(self, level: float = 0.9) -> tuple[pd.DataFrame, pd.DataFrame]:
        """Lower and upper edge, each of shape (n_hour, n_zone) [W].

        Parameters
        ----------
        level : float
            Probability that the heat lies within [-], hour by hour, between 0 and 1.
        """
        half = float(ndtri(0.5 * (1.0 + level))) * self.deviation
        return self.watts - half, self.watts + half

    @property
    def rms(self) -> FloatArray:
        """Root mean square over the hours of each zone, shape (n_zone,) [W]; NaN where it is not measured."""
        return np.asarray(np.sqrt((self.watts**2).mean()))

    @property
    def by_zone(self) -> dict[str, float]:
        """Root mean square over the hours by zone [W]; 0 where it is not measured."""
        return dict(zip(self.watts.columns, np.nan_to_num(self.rms).tolist(), strict=True))


def missing_heat(
    fit: Fit, intervals: Sequence[Interval], fixed: bool = False, near: DisturbanceModel | None = None
) -> Missing:
    """Estimate the heat that a fitted model lacks on intervals of telemetry, by the hour.

    A Kalman smoother holds the model to the measured temperatures by an autocorrelated heat in every zone
    (`calibration.smooth`). How large that heat is in each zone, how long it lasts, and how noisy the readings are is
    found by the likelihood of the innovations on the last four days of the last tuning interval. The band holds what
    the noise leaves unknown of the heat, and what the fit leaves unknown of the parameters.

    Parameters
    ----------
    fit : Fit
        The model.
    intervals : sequence of Interval
        Less the 12 hours of the least spin-up where the telemetry does not begin before.
    fixed : bool
        Take the parameters as they are: the band is of the noise alone.
    near : DisturbanceModel, optional
        Size and course of the heat that a like model lacks, to begin with.

    Raises
    ------
    FilterError
        When an interval has no room after its spin-up.

    Notes
    -----
    ``Var = r² V + D Σ D'``: V is the smoother's variance of a step, r from `averaged_deviation`, Σ the covariance of
    the parameters, D the sensitivities of the heat that the measured temperatures ask for.
    """
    network, inputs = fit.built.network, fit.built.inputs
    many, model = len(network.zones) > _MANY_ZONES, _small(fit)
    settings = FilterSettings(fit.settings.stepping, "steady" if many else "exact", fit.settings.spin_up_seconds)
    disturbance = tuned_disturbance(fit, near, model)
    parts, measured = [], np.isfinite(inputs.zone)
    for interval in intervals:
        filtered = filter_interval(model, fit.theta, inputs, interval, disturbance, settings)
        found = smooth(filtered)
        rows = np.arange(filtered.begin + 1, filtered.begin + 1 + len(found.stamps))
        known = measured[rows] & measured[rows - 1] & inputs.complete[rows, None]  # before and after, inputs complete
        narrower = averaged_deviation(filtered, max(1, round(HOUR / inputs.step)))
        values = (found.disturbance, (narrower * found.disturbance_deviation) ** 2)
        parts.append(hourly_means(found.stamps, inputs.step, *(np.where(known, v, np.nan) for v in values)))
    stamps = pd.DatetimeIndex(parts[0][0].append([p[0] for p in parts[1:]]))
    watts, variance = (np.concatenate([p[i] for p in parts]) for i in (1, 2))
    if not fixed:
        variance = variance + _parameter_variance(fit, model, intervals)
    heat, deviation = (pd.DataFrame(v, stamps, list(network.zones)) for v in (watts, np.sqrt(variance)))
    return Missing(heat, deviation, disturbance)


def at_start(fit: Fit) -> Fit:
    """Put every parameter of a model back to where its prior puts it.

    Parameters
    ----------
    fit : Fit
        The model.
    """
    parameters = fit.built.network.parameters
    model = reduced_model(fit.built.grid, [np.array([p.start for p in parameters])])
    point = np.array([p.transform(p.start) for p in fit.problem.parameters])
    return replace(fit, model=model, found=replace(fit.found, point=point))


def _small(fit: Fit) -> ReducedModel:
    """Model of a fit, of as many states as can be smoothed by."""
    if len(fit.built.network.zones) > _MANY_ZONES and fit.model.order > _ORDER:
        return reduced_model(fit.built.grid, [fit.theta], order=_ORDER)
    return fit.model


def tuned_disturbance(
    fit: Fit, near: DisturbanceModel | None = None, model: ReducedModel | None = None
) -> DisturbanceModel:
    """Size and course of the missing heat and noise of the sensors, on the last of what was fitted.

    Parameters
    ----------
    fit : Fit
        With the parameters.
    near : DisturbanceModel, optional
        Where to begin.
    model : ReducedModel, optional
        Accurate there, where it is at hand.
    """
    model = model or _small(fit)
    many, last = len(model.network.zones) > _MANY_ZONES, fit.problem.fitted[-1]
    latest = last.end - pd.Timedelta(seconds=_TUNED_MANY if many else _TUNED)
    interval = Interval(max(last.start, latest), last.end)
    settings = TuningSettings(
        fit.settings.stepping, "steady", fit.settings.spin_up_seconds, per_zone=() if many else ("deviation",),
        weights=air_volumes(model.network), start=near, curvature=False,
    )  # fmt: skip
    return tune_disturbance(model, fit.theta, fit.built.inputs, [interval], settings).disturbance


def _parameter_variance(fit: Fit, model: ReducedModel, intervals: Sequence[Interval]) -> FloatArray:
    """Variance of the missing heat that the parameters of a fit leave, shape (n_hour, n_zone) [W²]."""
    point, jacobian, slopes = fit.found.point, fit.found.jacobian, []
    inputs, spin_up = fit.built.inputs, fit.settings.spin_up_seconds
    for i, step in enumerate(_STEP * np.eye(point.size)):
        # a strength at the end of its range is moved inwards only: beyond, heat would flow from cold to warm
        ends = [np.clip(moved, *fit.problem.bounds) for moved in (point - step, point + step)]
        low, high = (heat_balance(model, fit.problem.theta(e), inputs, intervals, spin_up).needed for e in ends)
        slopes.append((high - low) / (ends[1] - ends[0])[i])
    roots = np.tensordot(np.linalg.inv(np.linalg.cholesky(jacobian.T @ jacobian)), np.array(slopes), axes=1)
    return np.asarray((roots**2).sum(axis=0))
