"""Savings of a reporting period against a baseline that was fitted to the days before."""

import math
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mpc.errors import VerificationError
from mpc.verification.baseline import BaselineModel, Fitness, daily_sums, fit_baseline, judge_baseline
from mpc.verification.inference import Estimate, coefficient_parts, sum_error

#: Fewest days of a reporting period [d].
FEWEST_REPORTING = 7

_DAY = 86400.0

#: Factor of the approximation of Reddy and Claridge (HVAC&R Research 6, 2000, 3-17) [-].
_SUM_OF_PREDICTIONS = 1.26


@dataclass(frozen=True, eq=False)
class BeforeAfter:
    """What was avoided in a reporting period (IPMVP: avoided energy consumption, option B or C).

    Parameters
    ----------
    model : BaselineModel
        Fitted to the baseline period.
    fitness : Fitness
        Of the model there.
    saving : Estimate
        Energy of the baseline less that metered, over the reporting period [J].
    baseline_energy : float
        Energy of the baseline over the reporting period [J].
    days : DataFrame, shape (n_day, 4)
        Of both periods: ``power``, ``baseline`` [W], ``outdoor`` [K], ``reporting`` (0 or 1).
    """

    model: BaselineModel
    fitness: Fitness
    saving: Estimate
    baseline_energy: float
    days: pd.DataFrame

    @property
    def share(self) -> Estimate:
        """Saving as a share of the baseline's energy [-]."""
        return self.saving.scaled(1.0 / self.baseline_energy)

    def fractional_uncertainty(self, confidence: float) -> float:
        """Fractional savings uncertainty of ASHRAE Guideline 14-2014, annex B [-].

        Parameters
        ----------
        confidence : float
            Level of the interval [-]; the guideline asks for less than half at 0.68.

        Notes
        -----
        ``dS/S = t 1.26 CV sqrt((n / n') (1 + 2 / n') / m) / F`` with ``n' = n (1 - rho) / (1 + rho)`` and ``F`` the
        share saved. It takes the baseline's days for a sample of the reporting period's and is too small for hourly
        models (Touzani, Granderson, Jump and Rebello, Energy and Buildings 2019); `saving` has the interval that is
        reported.
        """
        n, m, share = self.fitness.days, int(self.days["reporting"].sum()), abs(self.share.value)
        rho = max(0.0, self.fitness.autocorrelation)
        effective = n * (1.0 - rho) / (1.0 + rho)
        daily = self._daily_cv()
        root = math.sqrt(n / effective * (1.0 + 2.0 / effective) / m)
        freedom = max(1.0, effective - self.fitness.parameters)
        t = Estimate(0.0, 1.0, freedom).half_width(confidence)
        return t * _SUM_OF_PREDICTIONS * daily * root / share if share > 0.0 else math.inf

    def _daily_cv(self) -> float:
        """CV(RMSE) of the daily residuals of the baseline period [-]."""
        of = self.days[self.days["reporting"] == 0.0]
        power = of["power"].to_numpy(dtype=float)
        error = power - of["baseline"].to_numpy(dtype=float)
        freedom = max(1, len(of) - (self.fitness.parameters if self.model.kind == "change-point" else 1))
        return float(np.sqrt(error @ error / freedom) / power.mean())


def before_after(
    baseline: pd.DataFrame, reporting: pd.DataFrame, kind: str = "change-point", extra: tuple[str, ...] = ()
) -> BeforeAfter:
    """Fit a baseline to the days before, and hold the days after against it.

    Parameters
    ----------
    baseline, reporting : DataFrame
        Days (``change-point``) or hours (``time-of-week``) of the periods; rows with missing values are left out.
    kind : str
        Of the baseline model.
    extra : tuple of str
        Further columns of days, such as ``occupancy``: a routine adjustment.

    Returns
    -------
    BeforeAfter
        Saving with its standard error.

    Raises
    ------
    VerificationError
        Days are too few, or the kind is not known.

    Notes
    -----
    The saving is ``sum_r f(x_r) - y_r``. Its error has two parts: what the baseline's coefficients and change points
    miss, ``sum_r g_r' (G'G)^-1 sum_d g_d e_d`` with ``g`` the gradient of the model, and the reporting days' own
    residuals, whose long-run variance is taken from the baseline's. Both allow for correlated days
    (`inference.sum_error`).
    """
    columns = ["power", "outdoor", *extra]
    first, second = (part.dropna(subset=columns) for part in (baseline, reporting))
    rows = FEWEST_REPORTING * (24 if kind == "time-of-week" else 1)
    VerificationError.unless(
        len(second) >= rows, "reporting period", f"at least {FEWEST_REPORTING} whole days", f"{len(second)} rows"
    )
    model = fit_baseline(first, kind, extra)
    fitness = judge_baseline(model, first, extra)
    by_hour = kind == "time-of-week"
    gradient, towards = model.gradient(first), model.gradient(second).sum(axis=0)
    residual = first["power"].to_numpy() - model.predict(first)
    rows_of_day, length = (24.0, 3600.0) if by_hour else (1.0, _DAY)
    of_model, freedom = sum_error(rows_of_day * daily_sums(coefficient_parts(gradient, residual, towards), first, kind))
    freed = residual * math.sqrt(len(first) / max(1, len(first) - fitness.parameters))
    noise = rows_of_day * daily_sums(freed, first, kind)
    of_days, _ = sum_error(noise)
    count = len(second) / rows_of_day
    of_noise = of_days * math.sqrt(count / len(noise))
    expected = model.predict(second)
    saved = float(np.sum(expected - second["power"].to_numpy())) * length
    error = math.hypot(of_model, of_noise) * length
    days = _both(model, first, second, kind)
    return BeforeAfter(model, fitness, Estimate(saved, error, freedom), float(expected.sum()) * length, days)


def _both(model: BaselineModel, first: pd.DataFrame, second: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Days of both periods with their baseline."""
    parts = []
    for number, part in enumerate((first, second)):
        table = part[["power", "outdoor"]].assign(baseline=model.predict(part))
        if kind == "time-of-week":
            begins = pd.DatetimeIndex(table.index) - pd.Timedelta(hours=1)
            table = table.groupby(begins.normalize()).mean()
        parts.append(table.assign(reporting=float(number)))
    return pd.concat(parts).rename_axis("timestamp")
