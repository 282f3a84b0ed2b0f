"""Residual tests: whether innovations are white, zone by zone, and what past inputs still explain of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter
from scipy.stats import chi2, kstwo

from calibration.errors import FilterError
from calibration.estimation.kalman import Filtered
from calibration.results import Plain, plain
from thermal._types import FloatArray
from thermal.model.case_replay import Inputs

#: Lags of the Ljung-Box test [s]: half an hour, two hours, a day.
LAGS = (1800.0, 7200.0, 86400.0)

#: Lags at which innovations are correlated with inputs [s], and the order of the autoregression that whitens those.
_INPUT_LAG, _INPUT_ORDER = 7200.0, 24

#: Fewest values of a zone for a test.
_FEWEST = 30


@dataclass(frozen=True)
class ZoneWhiteness(Plain):
    """Tests of one zone's innovations; NaN where a zone has too few values or a constant series.

    Parameters
    ----------
    count : int
        Number of innovations.
    lag_one : float
        Autocorrelation at one step [-].
    ljung_box : tuple of float
        Statistic at each of the stated lags [-].
    ljung_box_p : tuple of float
        Its probability under white innovations [-].
    periodogram_distance : float
        Largest distance of the cumulated periodogram from the diagonal [-].
    periodogram_p : float
        Its probability under white innovations, by Kolmogorov and Smirnov [-].
    inputs_p : mapping of str to float
        For each input, probability of the correlations of the innovations with it, whitened, at lags up to two
        hours [-].
    """

    count: int
    lag_one: float
    ljung_box: tuple[float, ...]
    ljung_box_p: tuple[float, ...]
    periodogram_distance: float
    periodogram_p: float
    inputs_p: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Whiteness:
    """Whether innovations are white.

    Parameters
    ----------
    zones : mapping of str to ZoneWhiteness
        One a zone.
    lags : tuple of int
        Lags of the Ljung-Box statistics, in steps.
    degrees : tuple of int
        Their degrees of freedom: lags less fitted numbers.
    step : float
        Length of a step [s].
    """

    zones: Mapping[str, ZoneWhiteness]
    lags: tuple[int, ...]
    degrees: tuple[int, ...]
    step: float

    def rejected(self, level: float = 0.05) -> tuple[str, ...]:
        """Zones whose innovations are not white, by the least of their p-values times the number of tests (Bonferroni).

        Parameters
        ----------
        level : float
            Probability that a zone with white innovations is among them [-].
        """
        named = []
        for name, zone in self.zones.items():
            p = np.array([*zone.ljung_box_p, zone.periodogram_p])
            p = p[np.isfinite(p)]
            if p.size and p.size * p.min() < level:
                named.append(name)
        return tuple(named)

    def to_dict(self) -> dict[str, Any]:
        """Values for a file; None where a test was not possible."""
        named = {"step_seconds": self.step, "rejected": self.rejected()}
        return {k: plain(v) for k, v in {**vars(self), **named}.items() if k != "step"}


def whiteness(
    filtered: Filtered,
    zones: Sequence[str],
    inputs: Inputs | None = None,
    *,
    boundaries: Sequence[str] = (),
    lags: Sequence[float] = LAGS,
    fitted: int = 0,
) -> Whiteness:
    """Test the innovations of a filter zone by zone, each over the deviation that the filter gives it.

    - Ljung-Box at the stated lags, from the pairs of innovations that are both there, with ``lags - fitted`` degrees of
      freedom (Ljung and Box 1978, doi:10.1093/biomet/65.2.297).
    - Cumulated periodogram against the diagonal by Kolmogorov and Smirnov (Bartlett 1955; Durbin 1969,
      doi:10.1093/biomet/56.1.1); what is missing counts as zero, which keeps white innovations white.
    - Correlation with inputs, whitened by an autoregression (Box, Jenkins and Reinsel 2008, Time Series Analysis,
      ch. 12): boundary temperatures from lag 0 on; the zone's own heat from lag 1 on, as thermostat and heat meter let
      the heat of a step follow the innovation of the same step.

    A building is no linear model with Gaussian noise: with the thousands of steps of a few weeks every test rejects,
    and what counts is by how much. Compare statistics between models, or with those of simulated data.

    Parameters
    ----------
    filtered : Filtered
        From `KalmanFilter.filter`.
    zones : sequence of str
        Zone names.
    inputs : Inputs, optional
        The telemetry that was filtered, to correlate with its boundary temperatures and heat.
    boundaries : sequence of str
        Their names, as in `ThermalNetwork.boundaries`; needed with ``inputs``.
    lags : sequence of float
        Longest lags of the Ljung-Box statistics [s]; rounded to steps, at least one more than ``fitted``.
    fitted : int
        Numbers fitted to the innovations of each zone [-], taken off the degrees of freedom. Three that were tuned on
        all zones at once count next to nothing for each.

    Raises
    ------
    FilterError
        When names, inputs or lags do not fit the innovations.
    """
    series, step = filtered.standardised, filtered.kalman.space.step
    if len(zones) != series.shape[1]:
        raise FilterError(f"zones: expected {series.shape[1]} names, got {len(zones)}")
    if fitted < 0 or not lags or min(lags) <= 0:
        raise FilterError(f"whiteness: expected positive lags and 0 or more fitted numbers, got {lags} and {fitted}")
    steps = tuple(sorted({max(fitted + 1, round(lag / step)) for lag in lags}))
    exogenous = _exogenous(filtered, inputs, boundaries) if inputs is not None else {}
    found = {}
    for z, name in enumerate(zones):
        own = {key: (v if v.ndim == 1 else v[:, z], first) for key, (v, first) in exogenous.items()}
        found[name] = _zone(series[:, z], steps, fitted, own, max(1, round(_INPUT_LAG / step)))
    return Whiteness(found, steps, tuple(s - fitted for s in steps), step)


def _exogenous(filtered: Filtered, inputs: Inputs, boundaries: Sequence[str]) -> dict[str, tuple[FloatArray, int]]:
    """Name the inputs, each with the first lag at which innovations owe it nothing."""
    rows = slice(filtered.begin + 1, filtered.begin + 1 + len(filtered.stamps))
    if len(boundaries) != inputs.boundary.shape[1] or not inputs.stamps[rows].equals(filtered.stamps):
        raise FilterError(
            f"inputs: expected those that were filtered and names of {inputs.boundary.shape[1]} boundaries, "
            f"got {len(inputs)} rows and {list(boundaries)}"
        )
    named = {name: (inputs.boundary[rows, i], 0) for i, name in enumerate(boundaries)}
    return {**named, "heat": (inputs.heat[rows], 1)}


def _zone(
    series: FloatArray, lags: tuple[int, ...], fitted: int, inputs: Mapping[str, tuple[FloatArray, int]], reach: int
) -> ZoneWhiteness:
    """Test one zone's innovations."""
    from statsmodels.tsa.stattools import acovf  # here: half a second to import, which only reports need

    there = np.isfinite(series)
    count = int(there.sum())
    unknown = tuple(np.nan for _ in lags)
    if count < max(_FEWEST, 2 * lags[0]) or np.ptp(series[there]) == 0.0:
        return ZoneWhiteness(count, np.nan, unknown, unknown, np.nan, np.nan, dict.fromkeys(inputs, np.nan))
    longest = min(lags[-1], count // 2)
    correlation = acovf(series, adjusted=True, fft=False, missing="conservative", nlag=longest)
    correlation = correlation / correlation[0]
    pairs = np.array([np.sum(there[lag:] & there[:-lag]) for lag in range(1, longest + 1)])
    # with nothing missing, n (n + 2) Σ r² / (n - lag) of the biased autocorrelations r
    portmanteau = (count + 2.0) / count * np.cumsum(pairs * correlation[1:] ** 2)
    statistic = tuple(float(portmanteau[lag - 1]) if lag <= longest else np.nan for lag in lags)
    distance, p = _cumulated_periodogram(series)
    return ZoneWhiteness(
        count=count,
        lag_one=float(correlation[1]),
        ljung_box=statistic,
        ljung_box_p=tuple(float(chi2.sf(q, lag - fitted)) for q, lag in zip(statistic, lags, strict=True)),
        periodogram_distance=distance,
        periodogram_p=p,
        inputs_p={name: _cross(series, values, first, reach) for name, (values, first) in inputs.items()},
    )


def _cumulated_periodogram(series: FloatArray) -> tuple[float, float]:
    """Largest distance from the diagonal and its probability; exact for complete Gaussian white noise."""
    filled = np.nan_to_num(series - np.nanmean(series))
    power = np.abs(np.fft.rfft(filled)[1 : (len(filled) - 1) // 2 + 1]) ** 2
    share = np.cumsum(power)[:-1] / power.sum()
    number = np.arange(1, share.size + 1)
    distance = float(max((number / share.size - share).max(), (share - (number - 1) / share.size).max()))
    return distance, float(kstwo.sf(distance, share.size))


def _cross(series: FloatArray, values: FloatArray, first: int, reach: int) -> float:
    """Probability of the correlations with a whitened input at lags ``first`` to ``reach``."""
    from statsmodels.tsa.stattools import acovf

    moved = values - values.mean()
    order = min(_INPUT_ORDER, len(moved) // 10)
    if np.ptp(values) <= 1e-9 * max(1.0, float(np.abs(values).max())) or order < 1:
        return float("nan")
    correlation = acovf(moved, fft=False, nlag=order)
    correlation[0] *= 1.0 + 1e-8  # a sine alone would leave it singular
    coefficients = solve_toeplitz(correlation[:-1], correlation[1:])  # Yule and Walker
    white = lfilter(np.concatenate([[1.0], -coefficients]), [1.0], moved)
    white[:order] = 0.0
    there = np.isfinite(series)
    filled = np.where(there, series - np.nanmean(series), 0.0)
    total, scale = 0.0, float(np.mean(filled[there] ** 2))
    for lag in range(first, reach + 1):
        past = white[: len(white) - lag]
        total += float(filled[lag:] @ past) ** 2 / (scale * float(there[lag:] @ past**2))
    return float(chi2.sf(total, reach + 1 - first))
