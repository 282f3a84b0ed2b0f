"""Regressions of what is measured on the loads of machines, and their errors on days that they have not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from mpc.errors import PlantError
from mpc.identify.curves import Curve, features_of
from thermal._types import BoolArray, FloatArray

#: Spread of a temperature below which nothing is said of its effect [K].
_TOLD = 0.5

#: A level up to this is none [-].
IDLE = 1e-6

#: Levels of the command that count as one [-].
SAME = 0.05

#: Parts of the days of which each is left out once.
_FOLDS = 5

#: What is left out of a machine's features, one after the other, until more load does not seem to cost less; after the
#: last it has no part in what is bought.
_ORDER = ("emitter", "command^2 outdoor", "command^2", "outdoor", "standing")
_NO_PART = len(_ORDER) + 1

#: Squared error on left-out days over that of a larger set of features, from which on a smaller one is taken [-].
BETTER = 0.9

#: Loads between which power has to rise, and quantiles of the temperatures at which it has to [-].
_LOADS, _ENDS = (0.0, 0.5, 1.0), (0.02, 0.98)

#: Steps over which errors of a regression may hang together (Newey and West 1987, doi:10.2307/1913610): an hour.
_LAGS = 4


@dataclass(frozen=True, eq=False)
class Loads:
    """Loads of the machines and temperatures that their maps hang on, one row a step.

    Parameters
    ----------
    level : ndarray, shape (n_time, n_machine)
        Loads [-]; NaN while unknown.
    outdoor : ndarray, shape (n_time,)
        Outdoor air [K].
    emitter : ndarray, shape (n_time, n_machine)
        Temperature of what each machine heats [K]; `EMITTER` where it is not known.
    """

    level: FloatArray
    outdoor: FloatArray
    emitter: FloatArray

    @property
    def known(self) -> BoolArray:
        """Steps whose loads are all known, shape (n_time,)."""
        return np.asarray(np.isfinite(self.level).all(axis=1))

    def features(self, m: int) -> dict[str, FloatArray]:
        """Features of a machine that its loads tell apart.

        Parameters
        ----------
        m : int
            Which machine.
        """
        rows = self.known
        u, emitter, outdoor = self.level[rows, m], self.emitter[rows, m], self.outdoor[rows]
        found = features_of((u > IDLE).astype(float), u, outdoor, emitter)
        running = u > IDLE
        levels = np.unique(np.round(u[running] / SAME))
        left_out = {
            "standing": len(levels) < 2,
            "command^2": len(levels) < 3,
            "outdoor": running.sum() < 8 or np.std(outdoor[running]) < _TOLD,
            "emitter": running.sum() < 8 or np.std(emitter[running]) < _TOLD,
            "command^2 outdoor": len(levels) < 3 or np.std(outdoor[running]) < _TOLD,
        }
        return {name: values for name, values in found.items() if not left_out.get(name, False)}


def _design(
    loads: Loads, rows: BoolArray, left_out: Mapping[int, int], base: bool
) -> tuple[FloatArray, list[tuple[int, str]]]:
    """Columns of a regression on some rows, by machine and feature; a constant first, where something may be left.

    `left_out` says of each machine how many of `_ORDER` are left out.
    """
    columns, owners = ([np.ones(int(rows.sum()))], [(-1, "constant")]) if base else ([], [])
    for m, count in left_out.items():
        told = loads.features(m) if count < _NO_PART else {}
        for name in (name for name in told if name not in _ORDER[:count]):
            column = told[name][rows[loads.known]]
            if name != "standing" or not (base and column.all()):
                columns.append(column)
                owners.append((m, name))
    return np.column_stack(columns), owners


def _on_all_steps(design: FloatArray, rows: BoolArray) -> FloatArray:
    """Columns on some rows as columns on all steps, NaN on the others, shape (n_time, n_column)."""
    whole = np.full((len(rows), design.shape[1]), np.nan)
    whole[rows] = design
    return whole


def design_of(loads: Loads, machines: Sequence[int]) -> FloatArray:
    """Columns of a regression, a constant first, shape (n_time, n_column); NaN where a load is unknown.

    Parameters
    ----------
    loads : Loads
        Of all machines.
    machines : sequence of int
        Which machines have a part in it.
    """
    design, _ = _design(loads, loads.known, dict.fromkeys(machines, 0), True)
    return _on_all_steps(design, loads.known)


def left_out_error(design: FloatArray, values: FloatArray, per_day: int) -> float:
    """Mean squared error of a regression on days that it has not seen [W2]: each fifth of the days is left out once.

    Parameters
    ----------
    design : ndarray, shape (n_time, n_column)
        Columns [their own]; rows that are not finite do not count.
    values : ndarray, shape (n_time,)
        Measured [W].
    per_day : int
        Steps of a day.
    """
    rows = np.flatnonzero(np.isfinite(values) & np.isfinite(design).all(axis=1))
    fold, known, seen = (rows // per_day) % _FOLDS, design[rows], values[rows]
    errors = np.empty(len(seen))
    for k in range(_FOLDS):
        out = fold == k
        errors[out] = known[out] @ np.linalg.lstsq(known[~out], seen[~out])[0] - seen[out]
    return float(np.mean(errors**2))


def regress(
    loads: Loads, values: FloatArray, machines: Sequence[int], *, base: bool = True
) -> tuple[list[Curve], float]:
    """Regress what is measured on the features of machines, a constant beside them.

    Parameters
    ----------
    loads : Loads
        Of all machines.
    values : ndarray, shape (n_time,)
        Measured [W].
    machines : sequence of int
        Which machines have a part in it.
    base : bool
        Whether something may be left when all machines are off; nothing tells that from the standing part of a machine
        that never stops, which is then counted to it.

    Returns
    -------
    list of Curve
        One a machine.
    float
        The constant [W].

    Raises
    ------
    PlantError
        When there are too few steps with known loads.
    """
    curves, constant, _ = _fitted(loads, values, dict.fromkeys(machines, 0), base)
    return list(curves.values()), constant


def _fitted(
    loads: Loads, values: FloatArray, left_out: Mapping[int, int], base: bool
) -> tuple[dict[int, Curve], float, FloatArray]:
    """Regress with so much left out of each machine: curves by machine, the constant [W], columns on all steps."""
    rows = loads.known & np.isfinite(values)
    design, owners = _design(loads, rows, left_out, base)
    found, deviations = least_squares(design, values[rows])
    curves = {m: curve_of([name if owner == m else "" for owner, name in owners], found, deviations) for m in left_out}
    return curves, float(found[0]) if base else 0.0, _on_all_steps(design, rows)


def regress_power(
    loads: Loads, values: FloatArray, machines: Sequence[int], per_day: int
) -> tuple[list[Curve], float]:
    """Regress what is bought on the features of machines, so that more load of none costs less.

    Loads of many rooms rise and fall together, and a regression on all of their features gives some a negative price
    of heat, which a controller would take for a source of money. So of a machine whose power does not rise with its
    load in the weather that was seen features are left out until it does; one whose heat itself seems to have a
    negative price has no part in what is bought. More is left out, the same of all, while that predicts left-out days
    a tenth better. Of machines that buy less the more they give, such as cogeneration, nothing is known.

    Parameters
    ----------
    loads : Loads
        Of all machines.
    values : ndarray, shape (n_time,)
        Bought [W].
    machines : sequence of int
        One at least, which may have a part in it.
    per_day : int
        Steps of a day.

    Returns
    -------
    list of Curve
        One a machine, without coefficients where it has no part.
    float
        What is bought whatever they do [W].

    Raises
    ------
    PlantError
        When there are too few steps with known loads.
    """
    left_out = dict.fromkeys(machines, 0)
    curves, base, design = _rising(loads, values, left_out)
    error = left_out_error(design, values, per_day)
    while min(left_out.values()) < _NO_PART:
        left_out = {m: min(count + 1, _NO_PART) for m, count in left_out.items()}
        smaller = _rising(loads, values, left_out)
        found = left_out_error(smaller[2], values, per_day)
        if not found < BETTER * error:
            break
        (curves, base, _), error = smaller, found
    return curves, base


def _rising(loads: Loads, values: FloatArray, left_out: dict[int, int]) -> tuple[list[Curve], float, FloatArray]:
    """Regress as `_fitted`, with more left out of machines whose power would fall with their load.

    `left_out` becomes what was left out.
    """
    while True:
        curves, constant, design = _fitted(loads, values, left_out, True)
        falling = [m for m, curve in curves.items() if not _rises(curve, loads, m)]
        if not falling:
            return list(curves.values()), constant, design
        for m in falling:
            left_out[m] += 1


def _rises(curve: Curve, loads: Loads, m: int) -> bool:
    """Tell whether power rises with a machine's load, in the weather and at the temperatures that were seen."""
    part, seen = curve.without_standing(), (loads.outdoor[loads.known], loads.emitter[loads.known, m])
    return all(
        min(np.diff([float(part(1.0, u, *at)) for u in _LOADS])) >= 0.0
        for at in product(*(np.quantile(values, _ENDS) for values in seen))
    )


def least_squares(design: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coefficients and their standard errors, which bear autocorrelation, shape (n_column,) each [W over columns].

    Parameters
    ----------
    design : ndarray, shape (n, n_column)
        Columns [their own].
    values : ndarray, shape (n,)
        Measured [W].

    Raises
    ------
    PlantError
        When there are too few rows.
    """
    from statsmodels.regression.linear_model import OLS

    rows, count = design.shape
    PlantError.unless(
        rows > 4 * count, "component maps", f"{4 * count} steps with known commands", rows,
        "give more days, or telemetry whose commands are recorded",
    )  # fmt: skip
    found = OLS(values, design).fit(cov_type="HAC", cov_kwds={"maxlags": _LAGS})
    with np.errstate(invalid="ignore"):  # of a feature that says next to nothing the variance may round below zero
        return np.asarray(found.params), np.asarray(found.bse)


def curve_of(names: Sequence[str], coefficients: FloatArray, deviations: FloatArray) -> Curve:
    """Make a curve of the columns that have a name.

    Parameters
    ----------
    names : sequence of str
        Feature of each column; empty of those that are not the curve's.
    coefficients, deviations : ndarray, shape (n_column,)
        And their standard errors [W].
    """
    told = [
        {name: float(value) for name, value in zip(names, values, strict=True) if name}
        for values in (coefficients, deviations)
    ]
    return Curve(*told)
