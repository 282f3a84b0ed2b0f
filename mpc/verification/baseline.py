"""Baseline models of metered energy: change points of the outdoor temperature, and time of week with temperature."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from mpc.errors import VerificationError
from mpc.scenario.grid import hours_of_week
from mpc.scenario.rates import HOUR
from mpc.verification.inference import lag_one
from thermal._types import FloatArray, IntArray

#: Candidates of change points: percentiles of the outdoor temperature [%].
_CANDIDATES = np.arange(10.0, 91.0, 5.0)

#: Share of an hour of the week that must be above a fit to temperature for the hour to be an occupied one [-], and the
#: temperatures of that fit [K]: 50 and 65 degF (Mathieu et al. 2011).
_OCCUPIED, _HEATS_BELOW, _COOLS_ABOVE = 0.65, 283.15, 291.48

#: Intervals of temperature, in each of which the energy is linear in it (Mathieu et al. 2011).
_INTERVALS = 6

#: Parts that days are divided into to test a model on those that it was not fitted to.
_PARTS = 5

#: Fewest days of a fit [d].
FEWEST_DAYS = 14

KINDS = ("change-point", "time-of-week")


@dataclass(frozen=True, eq=False)
class BaselineModel:
    """A fitted baseline.

    Parameters
    ----------
    kind : str
        ``change-point`` by day or ``time-of-week`` by hour.
    form : str
        Which of the change-point models: ``mean``, ``heating``, ``cooling``, ``heating and cooling``; else the kind.
    change_points : mapping of str to float
        ``heating`` below and ``cooling`` above which the energy rises [K].
    names : tuple of str
        Of the coefficients.
    coefficients : ndarray, shape (n_coefficient,)
        [W], and [W/K] of temperatures.
    occupied : frozenset of int
        Hours of the week that are occupied; empty by day.
    knots : tuple of float
        Temperatures between which the energy is linear [K]; empty by day.
    """

    kind: str
    form: str
    change_points: Mapping[str, float]
    names: tuple[str, ...]
    coefficients: FloatArray
    occupied: frozenset[int] = frozenset()
    knots: tuple[float, ...] = ()

    def design(self, table: pd.DataFrame) -> FloatArray:
        """Columns of the regression.

        Parameters
        ----------
        table : DataFrame, shape (n_row, n_column)
            Days or hours, as the kind needs them, with ``outdoor`` [K].

        Returns
        -------
        ndarray, shape (n_row, n_coefficient)
            [-] and [K].
        """
        if self.kind == "time-of-week":
            return _hourly_design(table, self.occupied, np.array(self.knots))
        return np.column_stack([column for _, column in _daily_columns(table, self.change_points, self.names)])

    def gradient(self, table: pd.DataFrame) -> FloatArray:
        """Sensitivity of the power to all that was fitted: coefficients, then change points.

        Parameters
        ----------
        table : DataFrame, shape (n_row, n_column)
            As for `design`.

        Returns
        -------
        ndarray, shape (n_row, n_coefficient + n_change_point)
            [-], [K] and [W/K]: at a change point the energy has a corner, whose two sides are told by the sign.
        """
        columns, outdoor = [self.design(table)], table["outdoor"].to_numpy()
        for name, point in self.change_points.items():
            slope = self.coefficients[self.names.index(name)]
            beyond = outdoor < point if name == "heating" else outdoor > point
            columns.append((slope if name == "heating" else -slope) * beyond[:, None].astype(float))
        return np.hstack(columns)

    def predict(self, table: pd.DataFrame) -> FloatArray:
        """Power of the baseline [W], shape (n_row,).

        Parameters
        ----------
        table : DataFrame
            As for `design`.
        """
        return self.design(table) @ self.coefficients


@dataclass(frozen=True)
class Fitness:
    """How well a baseline describes energy (ASHRAE Guideline 14-2014, section 4).

    Parameters
    ----------
    cv_rmse : float
        Root mean square error, with degrees of freedom, over the mean [-].
    nmbe : float
        Mean error (measured less modelled) over the mean [-].
    r_squared : float
        Share of the variance [-].
    held_out_cv_rmse, held_out_nmbe : float
        The same on parts of the days that a fit had not seen [-]; the NMBE is the largest of any part.
    autocorrelation : float
        Of the daily residuals, from a day to the next [-].
    days : int
        Days of the fit.
    parameters : int
        Coefficients and change points.
    """

    cv_rmse: float
    nmbe: float
    r_squared: float
    held_out_cv_rmse: float
    held_out_nmbe: float
    autocorrelation: float
    days: int
    parameters: int


def fit_baseline(table: pd.DataFrame, kind: str = "change-point", extra: tuple[str, ...] = ()) -> BaselineModel:
    """Fit a baseline by least squares.

    Parameters
    ----------
    table : DataFrame
        Days (``change-point``) or hours (``time-of-week``) with ``power`` [W] and ``outdoor`` [K], none missing.
    kind : str
        ``change-point`` or ``time-of-week``.
    extra : tuple of str
        Further columns of days that the energy is linear in, such as ``acts``.

    Raises
    ------
    VerificationError
        The kind is not known, or days are too few.

    Notes
    -----
    By day, with ``(x)+`` the positive part: ``E = a + w weekend + h (T_h - T)+ + c (T - T_c)+``, with one, both or none
    of the change points; form and change points have the lowest BIC (ASHRAE RP-1050; Kissock, Haberl and Claridge,
    ASHRAE Trans. 109(2), 2003). By hour: one constant an hour of the week, and a piecewise linear temperature for
    occupied and other hours (Mathieu, Price, Kiliccote and Piette, IEEE Trans. Smart Grid 2, 2011, 507-518).
    """
    VerificationError.unless_known(kind, KINDS, "baseline", "a kind of model")
    if kind == "time-of-week":
        return _fit_hourly(table)
    few = f"at least {FEWEST_DAYS} days"
    VerificationError.unless(len(table) >= FEWEST_DAYS, "baseline", few, f"{len(table)}", "widen the interval")
    power, outdoor = table["power"].to_numpy(), table["outdoor"].to_numpy()
    best: tuple[float, BaselineModel] | None = None
    weekend = ("weekend",) if 2 <= table["weekend"].sum() <= len(table) - 2 else ()
    for form, points in _forms(outdoor):
        names = ("constant", *weekend, *points, *extra)
        design = np.column_stack([column for _, column in _daily_columns(table, points, names)])
        found, _, rank, _ = np.linalg.lstsq(design, power, rcond=None)
        if rank < design.shape[1]:
            continue
        squares = max(float(np.sum((power - design @ found) ** 2)), 1e-12 * float(power @ power))
        score = len(power) * np.log(squares / len(power)) + (len(names) + len(points)) * np.log(len(power))
        if best is None or score < best[0]:
            best = score, BaselineModel(kind, form, points, names, found)
    if best is None:
        advice = "leave out the column that is constant, or follows from another"
        raise VerificationError("baseline", f"days that tell {', '.join(extra)} apart from the rest", "none", advice)
    return best[1]


def _forms(outdoor: FloatArray) -> Iterator[tuple[str, dict[str, float]]]:
    """Forms of the daily model with candidates of their change points."""
    yield "mean", {}
    temperatures = np.unique(np.percentile(outdoor, _CANDIDATES))
    for point in temperatures:
        yield "heating", {"heating": float(point)}
        yield "cooling", {"cooling": float(point)}
    coarse = temperatures[::2]
    for low in coarse:
        for high in coarse[coarse > low]:
            yield "heating and cooling", {"heating": float(low), "cooling": float(high)}


def _daily_columns(
    table: pd.DataFrame, points: Mapping[str, float], names: tuple[str, ...]
) -> Iterator[tuple[str, FloatArray]]:
    outdoor = table["outdoor"].to_numpy()
    for name in names:
        if name == "constant":
            yield name, np.ones(len(table))
        elif name == "heating":
            yield name, np.maximum(points[name] - outdoor, 0.0)
        elif name == "cooling":
            yield name, np.maximum(outdoor - points[name], 0.0)
        else:
            yield name, table[name].to_numpy(dtype=float)


def _hours_of(table: pd.DataFrame) -> IntArray:
    """Hours of the week of a table by hour."""
    return hours_of_week(pd.DatetimeIndex(table.index), HOUR)


def _fit_hourly(table: pd.DataFrame) -> BaselineModel:
    weeks = len(table) / 168.0
    VerificationError.unless(weeks >= 4.0, "baseline", "4 weeks of hours", f"{weeks:.1f}", "use --model change-point")
    outdoor, power, hour = table["outdoor"].to_numpy(), table["power"].to_numpy(), _hours_of(table)
    rough = np.column_stack(
        [np.ones(len(table)), np.maximum(_HEATS_BELOW - outdoor, 0.0), np.maximum(outdoor - _COOLS_ABOVE, 0.0)]
    )
    above = power > rough @ np.linalg.lstsq(rough, power, rcond=None)[0]
    share = np.bincount(hour, weights=above, minlength=168) / np.maximum(1, np.bincount(hour, minlength=168))
    occupied = frozenset(np.flatnonzero(share > _OCCUPIED).tolist())
    knots = np.unique(np.percentile(outdoor, np.linspace(0.0, 100.0, _INTERVALS + 1)))
    design = _hourly_design(table, occupied, knots)
    found = np.linalg.lstsq(design, power, rcond=None)[0]
    names = tuple(f"column {k}" for k in range(design.shape[1]))
    return BaselineModel(
        "time-of-week", "time of week and temperature", {}, names, found, occupied, tuple(knots.tolist())
    )


def _hourly_design(table: pd.DataFrame, occupied: frozenset[int], knots: FloatArray) -> FloatArray:
    hour, outdoor = _hours_of(table), table["outdoor"].to_numpy()
    of_week = (hour[:, None] == np.arange(168)).astype(float)
    low, high = knots[:-1].copy(), knots[1:].copy()
    low[0], high[-1] = -np.inf, np.inf  # beyond the ends the first and the last line go on
    start = np.concatenate([[knots[1]], knots[1:-1]])
    parts = np.where(low == -np.inf, np.minimum(outdoor[:, None] - start, 0.0),
                     np.clip(outdoor[:, None], low, high) - start)  # fmt: skip
    works = np.isin(hour, [*occupied])[:, None]
    return np.hstack([of_week, parts * works, parts * ~works])


def judge_baseline(
    model: BaselineModel, table: pd.DataFrame, extra: tuple[str, ...] = (), *, hold_out: bool = True
) -> Fitness:
    """Say how well a baseline describes the table that it was fitted to, and parts that a fit had not seen.

    Parameters
    ----------
    model : BaselineModel
        Fitted to the table.
    table : DataFrame
        Days or hours.
    extra : tuple of str
        As it was fitted with.
    hold_out : bool
        Whether parts are held out, which takes five fits.
    """
    power = table["power"].to_numpy()
    mean, error = float(power.mean()), power - model.predict(table)
    parameters = int(np.linalg.matrix_rank(model.design(table))) + len(model.change_points)
    freedom = max(1, len(power) - parameters)
    days = daily_sums(error, table, model.kind)
    held = _held_out(model.kind, table, extra) if hold_out else []
    return Fitness(
        float(np.sqrt(error @ error / freedom)) / mean, float(error.sum()) / freedom / mean,
        1.0 - float(error @ error) / float(np.sum((power - mean) ** 2)),
        float(np.sqrt(np.mean(np.concatenate(held) ** 2))) / mean if held else np.nan,
        max((float(part.mean()) / mean for part in held), key=abs, default=np.nan),
        lag_one(days), len(days), parameters,
    )  # fmt: skip


def _held_out(kind: str, table: pd.DataFrame, extra: tuple[str, ...]) -> list[FloatArray]:
    """Errors on each of some parts in a row, by models fitted to the others."""
    errors = []
    for rows in np.array_split(np.arange(len(table)), _PARTS):
        try:
            model = fit_baseline(table.drop(table.index[rows]), kind, extra)
        except VerificationError:
            return []
        part = table.iloc[rows]
        errors.append(part["power"].to_numpy() - model.predict(part))
    return errors


def daily_sums(values: FloatArray, table: pd.DataFrame, kind: str) -> FloatArray:
    """Means by day of values by row, shape (n_day,); the values themselves where rows are days.

    Parameters
    ----------
    values : ndarray, shape (n_row,)
        [any].
    table : DataFrame
        That they are of.
    kind : str
        Of the model.
    """
    if kind != "time-of-week":
        return values
    begins = pd.DatetimeIndex(table.index) - pd.Timedelta(hours=1)
    return np.asarray(pd.Series(values).groupby(begins.normalize()).mean(), dtype=float)


def describe(model: BaselineModel) -> dict[str, Any]:
    """Plain types of a baseline, for files.

    Parameters
    ----------
    model : BaselineModel
        Fitted.
    """
    by_hour = model.kind == "time-of-week"
    named = {} if by_hour else dict(zip(model.names, model.coefficients.tolist(), strict=True))
    return {"kind": model.kind, "form": model.form, "change_points": dict(model.change_points), "coefficients": named}
