"""Heat that a model needs to follow the measured zone temperatures, against the heat that was metered."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy.sparse as sp
from numpy.typing import NDArray

from calibration.estimation.filtered import FilterSettings, rows_of
from calibration.estimation.state_space import REFERENCE
from calibration.evaluation.intervals import Interval
from thermal._types import FloatArray
from thermal.model.case_replay import LEAST_SPIN_UP, SPIN_UP, Inputs, spin_up
from thermal.model.matrices import Matrices, SymbolicModel
from thermal.units import AIR_HEAT_CAPACITY

#: Limits of ASHRAE Guideline 14-2014 for a whole-building simulation calibrated on hourly data [-].
NMBE_LIMIT, CV_RMSE_LIMIT = 0.10, 0.30

#: What a calibrated simulation costs in degrees of freedom: the guideline's p of 1.
FITTED = 1

#: The guideline's averages [s]; of longer steps, each is one.
HOUR = 3600.0

#: A mean below this share of the root mean square is near zero [-], and a ratio to it means nothing.
LEAST_MEAN = 0.1

#: Fewest averages that a statistic is made of: a day.
FEWEST = 24


@dataclass(frozen=True)
class HeatFit:
    """Normalised errors of heat, as ASHRAE Guideline 14 defines them for energy.

    Parameters
    ----------
    count : int
        Number of averages n.
    mean : float
        Mean metered heat [W].
    nmbe : float
        Normalised mean bias error, metered minus needed over ``(n - 1)`` times the mean's magnitude [-].
    cv_rmse : float
        Coefficient of variation of the root mean square error, over ``n - 1`` [-].
    """

    count: int
    mean: float
    nmbe: float
    cv_rmse: float

    @property
    def met(self) -> bool:
        """Whether both are within the guideline's limits for hourly energy."""
        return bool(abs(self.nmbe) <= NMBE_LIMIT and self.cv_rmse <= CV_RMSE_LIMIT)


@dataclass(frozen=True)
class HeatBalance:
    """Metered heat and the heat that a model needs, hour by hour.

    Parameters
    ----------
    stamps : DatetimeIndex, length n_time
        Beginnings of the averages.
    zones : tuple of str
        Zone names.
    metered, needed : ndarray, shape (n_time, n_zone)
        Heat given to the zones [W]; NaN where an input or the zone's temperature is missing in any of an hour's steps.
    """

    stamps: pd.DatetimeIndex
    zones: tuple[str, ...]
    metered: FloatArray
    needed: FloatArray

    def building(self) -> tuple[FloatArray, FloatArray]:
        """Metered and needed heat of all measured zones together, shape (n_time,) [W]; NaN where one is missing."""
        seen = np.isfinite(self.needed).any(axis=0)
        return self.metered[:, seen].sum(axis=1), self.needed[:, seen].sum(axis=1)

    def of_building(self) -> HeatFit | None:
        """Fit of all measured zones together; None where there are no 24 averages or a mean near zero."""
        return _heat_fit(*self.building())

    def by_zone(self) -> dict[str, HeatFit | None]:
        """Fit of each zone."""
        return {z: _heat_fit(self.metered[:, i], self.needed[:, i]) for i, z in enumerate(self.zones)}


def _heat_fit(metered: FloatArray, needed: FloatArray, fewest: int = FEWEST) -> HeatFit | None:
    """NMBE and CV(RMSE) of heat.

    ``NMBE = Σ (m - s) / ((n - p) |mean m|)`` and ``CV(RMSE) = sqrt(Σ (m - s)² / (n - p)) / |mean m|`` with p = 1
    (ASHRAE Guideline 14-2014). They are ratios to a mean, so they are for energy only: a temperature
    has no zero to be a share of.

    Parameters
    ----------
    metered, needed : ndarray, shape (n_time,)
        Heat [W]; what is NaN is left out.
    fewest : int
        Fewest values [-].

    Returns
    -------
    HeatFit or None
        None for fewer values, or when their mean is near zero.

    Examples
    --------
    >>> found = _heat_fit(np.array([100.0, 200.0, 300.0]), np.array([110.0, 180.0, 280.0]), fewest=3)
    >>> round(found.nmbe, 3), round(found.cv_rmse, 3)
    (0.075, 0.106)
    """
    there = np.isfinite(metered) & np.isfinite(needed)
    m, s = metered[there], needed[there]
    if m.size < max(fewest, FITTED + 1):
        return None
    mean = float(m.mean())
    if abs(mean) <= LEAST_MEAN * float(np.sqrt(np.mean(m**2))):
        return None
    free, error = m.size - FITTED, m - s
    return HeatFit(
        m.size, mean, float(error.sum() / free / abs(mean)), float(np.sqrt((error**2).sum() / free) / abs(mean))
    )


def heat_balance(
    model: SymbolicModel,
    theta: FloatArray,
    inputs: Inputs,
    intervals: Sequence[Interval],
    spin_up_seconds: float = SPIN_UP,
) -> HeatBalance:
    """Heat that a model needs to follow the measured zone temperatures on intervals of telemetry, by the hour.

    Parameters
    ----------
    model : SymbolicModel
        Reduced, or a small grid.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    inputs : Inputs
        The telemetry.
    intervals : sequence of Interval
        Less the 12 hours of the least spin-up where the telemetry does not begin before.
    spin_up_seconds : float
        Telemetry before an interval that the spin-up may use [s].

    Raises
    ------
    FilterError
        When an interval has no room after its spin-up.
    """
    matrices, parts = model.matrices(theta), []
    for interval in intervals:
        begin, at, stop = rows_of(inputs, interval, FilterSettings(spin_up_seconds=spin_up_seconds))
        rows = np.arange(at + 1, stop + 1)
        steps = _step_balance(matrices, inputs, begin, rows, model.network.airflows)
        parts.append(hourly_means(inputs.stamps[rows], inputs.step, *steps))
    stamps = parts[0][0].append([p[0] for p in parts[1:]])
    metered, needed = (np.concatenate([p[i] for p in parts]) for i in (1, 2))
    return HeatBalance(pd.DatetimeIndex(stamps), model.network.zones, metered, needed)


def step_balance(
    model: SymbolicModel, theta: FloatArray, inputs: Inputs
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Metered heat and that which a model needs, step by step over all telemetry but the least spin-up.

    Parameters
    ----------
    model : SymbolicModel
        Reduced, or a small grid.
    theta : ndarray, shape (n_parameter,)
        Parameter values [parameter units].
    inputs : Inputs
        The telemetry.

    Returns
    -------
    tuple of ndarray
        Rows of the steps, shape (n,), none where telemetry is shorter; metered and needed heat, shape (n, n_zone) [W],
        NaN where an input or the zone's temperature is missing.
    """
    rows = np.arange(int(np.ceil(LEAST_SPIN_UP / inputs.step)) + 1, len(inputs.stamps))
    if rows.size < 2:
        none = np.empty((0, len(model.network.zones)))
        return rows[:0], none, none
    return rows, *_step_balance(model.matrices(theta), inputs, 0, rows, model.network.airflows)


def _step_balance(
    matrices: Matrices, inputs: Inputs, begin: int, rows: NDArray[np.int64], airflows: tuple[tuple[int, int], ...]
) -> tuple[FloatArray, FloatArray]:
    """Metered and needed heat of single steps, NaN where either is not known."""
    needed = _needed_heat(matrices, inputs, begin, rows, airflows)
    # the last value is held through a gap; where the sensor speaks again, the jump is no heat
    known = np.isfinite(inputs.zone[rows]) & np.isfinite(inputs.zone[rows - 1]) & inputs.complete[rows, None]
    return np.where(known, inputs.heat[rows], np.nan), np.where(known, needed, np.nan)


def _needed_heat(
    matrices: Matrices, inputs: Inputs, begin: int, rows: NDArray[np.int64], airflows: tuple[tuple[int, int], ...] = ()
) -> FloatArray:
    """Heat of single steps that holds the zones at their measured temperatures.

    The zones are led along the measured temperatures since ``begin``; what is missing in ``C dT/dt + K T - B u`` is the
    heat, less what other zones' air brings. An unmeasured zone is left free and needs what it was given.

    Parameters
    ----------
    matrices : Matrices
        The model at one θ.
    inputs : Inputs
        The telemetry; a measured temperature is taken as that of the end of its step.
    begin : int
        First stamp of the spin-up.
    rows : ndarray of int, shape (n_time,)
        Steps, by the stamps of their ends, one after the other, the first after ``begin``.
    airflows : tuple of (int, int)
        Source and target zone of each directed airflow.

    Returns
    -------
    ndarray, shape (n_time, n_zone)
        Needed heat, mean over each step [W].
    """
    at = np.concatenate([rows[:1] - 1, rows])
    states, _ = spin_up(matrices, inputs, begin, at)
    states = states - REFERENCE * matrices.uniform[:, None]
    end, outside = states[:, 1:], inputs.boundary[rows].T - REFERENCE
    missing = matrices.capacity @ np.diff(states) / inputs.step + matrices.flow @ np.vstack([end, outside])
    heating = matrices.heating.toarray() if sp.issparse(matrices.heating) else np.asarray(matrices.heating)
    heat = np.linalg.lstsq(heating, missing, rcond=None)[0].T
    zone = (matrices.observation @ end).T
    for i, (source, target) in enumerate(airflows):
        brought = AIR_HEAT_CAPACITY * inputs.airflow[rows, i] * (zone[:, source] - zone[:, target])
        heat[:, target] -= brought
    return np.asarray(heat)


def hourly_means(
    stamps: pd.DatetimeIndex, step: float, *values: FloatArray
) -> tuple[pd.DatetimeIndex, *tuple[FloatArray, ...]]:
    """Average over whole hours, with the stamps of their beginnings; NaN where a step of the hour is missing or NaN.

    Parameters
    ----------
    stamps : DatetimeIndex, length n_time
        Ends of the steps.
    step : float
        Step [s]; where it is an hour or more, each step is an average.
    *values : ndarray, shape (n_time, ...)
        What is averaged [any unit].
    """
    begins = stamps - pd.Timedelta(seconds=step)
    if step >= HOUR:
        return begins, *values
    hours = begins.tz_convert("UTC").floor("h")  # an hour exists once there, also where clocks are set back
    first = np.flatnonzero(np.concatenate([[True], hours[1:] != hours[:-1]]))
    whole = np.diff(np.append(first, len(hours))) == round(HOUR / step)
    means = [np.add.reduceat(v, first, axis=0)[whole] * step / HOUR for v in values]
    return hours[first][whole].tz_convert(stamps.tz), *means
