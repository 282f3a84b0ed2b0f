"""Standard errors of daily series that remember the day before, and intervals made of them."""

import math
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from thermal._types import FloatArray

#: Cosine transforms for `n` days: ``0.4 n^(2/3)``, the rule of Lazarus, Lewis, Stock and Watson (2018).
_TRANSFORMS = 0.4


class Estimate(NamedTuple):
    """A number with its standard error.

    Parameters
    ----------
    value : float
        Estimate [any].
    error : float
        Standard error [as value].
    freedom : float
        Degrees of freedom of its Student distribution [-].
    """

    value: float
    error: float
    freedom: float

    def interval(self, confidence: float) -> tuple[float, float]:
        """Give the ends of the two-sided interval.

        Parameters
        ----------
        confidence : float
            Its level, between 0 and 1 [-].
        """
        half = self.half_width(confidence)
        return self.value - half, self.value + half

    def half_width(self, confidence: float) -> float:
        """Half of the width of the two-sided interval [as value].

        Parameters
        ----------
        confidence : float
            Its level, between 0 and 1 [-].
        """
        return float(student.ppf(0.5 + 0.5 * confidence, self.freedom)) * self.error

    @property
    def p_value(self) -> float:
        """Two-sided probability of a value this far from zero where the truth is zero [-]."""
        if self.error == 0.0:
            return 0.0 if self.value else 1.0
        return float(2.0 * student.sf(abs(self.value) / self.error, self.freedom))

    def scaled(self, factor: float) -> "Estimate":
        """Multiply by a number.

        Parameters
        ----------
        factor : float
            The number [any].
        """
        return Estimate(self.value * factor, self.error * abs(factor), self.freedom)

    def less(self, other: "Estimate") -> "Estimate":
        """Difference from an independent estimate, with the degrees of freedom of Welch and Satterthwaite.

        Parameters
        ----------
        other : Estimate
            That is subtracted.
        """
        first, second = self.error**2, other.error**2
        below = first**2 / self.freedom + second**2 / other.freedom
        freedom = (first + second) ** 2 / below if below > 0.0 else min(self.freedom, other.freedom)
        return Estimate(self.value - other.value, math.sqrt(first + second), freedom)


def sum_error(parts: FloatArray) -> tuple[float, float]:
    """Give the standard error of a sum of daily parts that may be correlated, and its degrees of freedom.

    Parameters
    ----------
    parts : ndarray, shape (n_day,)
        What each day adds, in the order of time [any].

    Returns
    -------
    tuple of float
        Standard error [as parts] and degrees of freedom [-].

    Notes
    -----
    The equal-weighted cosine estimator (Lazarus, Lewis, Stock and Watson, J. Bus. Econ. Stat. 36, 2018, 541-559): with
    ``L_j = sqrt(2/n) sum_d cos(pi j (d - 1/2) / n) u_d`` for ``j = 1..B``, the long-run variance is the mean of
    ``L_j^2``, and the statistic has a Student distribution with ``B`` degrees of freedom whatever the correlation, as
    long as it dies out within ``n / B`` days. A usual HAC interval with normal quantiles is too short for a month of
    days.
    """
    n = len(parts)
    count = max(2, math.ceil(_TRANSFORMS * n ** (2.0 / 3.0)))
    phases = np.pi * np.outer(np.arange(1, count + 1), np.arange(n) + 0.5) / n
    transformed = np.sqrt(2.0 / n) * np.cos(phases) @ parts
    return float(math.sqrt(n * np.mean(transformed**2))), float(count)


def coefficient_parts(design: FloatArray, residual: FloatArray, towards: FloatArray) -> FloatArray:
    """Say what each row adds to the error of a sum of coefficients of least squares, shape (n_row,).

    Parameters
    ----------
    design : ndarray, shape (n_row, n_coefficient)
        Of the regression [any].
    residual : ndarray, shape (n_row,)
        Of the fit [any].
    towards : ndarray, shape (n_coefficient,)
        Weights of the coefficients in the sum [any].

    Notes
    -----
    ``towards' (X'X)^-1 x_d e_d / (1 - h_d)``: residuals are brought to what they would be had their row not been in the
    fit (HC3: MacKinnon and White, J. Econometrics 29, 1985, 305-325).
    """
    inverse = np.linalg.pinv(design.T @ design, hermitian=True)
    leverage = np.einsum("di,ij,dj->d", design, inverse, design)
    return np.asarray((design @ inverse @ towards) * residual / np.maximum(1.0 - leverage, 1e-3))


def mean_estimate(values: FloatArray) -> Estimate:
    """Mean of a daily series with its standard error.

    Parameters
    ----------
    values : ndarray, shape (n_day,)
        In the order of time [any].
    """
    error, freedom = sum_error((values - values.mean()) / len(values))
    return Estimate(float(values.mean()), error, freedom)


def lag_one(residuals: FloatArray) -> float:
    """Correlation of residuals with those of the day before, with its bias for few days taken out [-].

    Parameters
    ----------
    residuals : ndarray, shape (n_day,)
        In the order of time [any].

    Notes
    -----
    ``r + (1 + 3 r) / n`` (Marriott and Pope, Biometrika 41, 1954, 390-402), kept below 0.95.
    """
    total = float(residuals @ residuals)
    r = float(residuals[1:] @ residuals[:-1]) / total if total > 0.0 else 0.0
    return min(0.95, r + (1.0 + 3.0 * r) / len(residuals))
