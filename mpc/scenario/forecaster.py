"""Forecasts of a scenario: perfect, or with errors that grow with the time ahead."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from mpc.errors import ScenarioError
from mpc.scenario.forecast import Forecast
from mpc.scenario.scenario import Scenario
from mpc.scenario.weather import SKY, SUN_POINTS
from thermal._types import FloatArray
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.errors import describe

_STREAM = 12  # of random numbers of a seed

#: What errors are told apart by: points whose error is one and the same.
ERROR_POINTS = {
    "temperature": (OUTDOOR_TEMPERATURE,),
    "wind": ("wind_speed_sensor",),
    "sun": SUN_POINTS,
    "sky": (SKY,),
}


@dataclass(frozen=True)
class ErrorGrowth:
    """Error of a forecast that grows with the time since it was issued.

    ``e_i = φ e_{i-1} + σ sqrt(1 - φ²) w_i``, ``e_0 = 0``, ``φ = exp(-Δt / τ)``: the deviation after a lead t is
    ``σ sqrt(1 - exp(-2 t / τ))`` at any step.

    Parameters
    ----------
    deviation : float
        Standard deviation σ at long leads, 0 or more [K or m/s or W/m2; - for the sun: relative to the truth].
    time_constant : float
        τ [s], positive.

    Raises
    ------
    ScenarioError
        When a number is out of range.

    Examples
    --------
    >>> round(ErrorGrowth(2.0, 86400.0).after(6 * 3600.0), 2)
    1.25
    """

    deviation: float
    time_constant: float

    def __post_init__(self) -> None:
        if not (self.deviation >= 0 and self.time_constant > 0 and np.isfinite(self.deviation)):
            found = f"{self.deviation} and {self.time_constant} s"
            raise ScenarioError(describe("error", "a deviation of 0 or more and a positive time", found))

    def after(self, lead: float) -> float:
        """Tell the standard deviation of the error after a lead [unit of the deviation].

        Parameters
        ----------
        lead : float
            Time since the forecast was issued [s].
        """
        return float(self.deviation * np.sqrt(-np.expm1(-2.0 * lead / self.time_constant)))

    def path(self, rng: np.random.Generator, count: int, step: float) -> FloatArray:
        """Draw the errors of the first steps of a forecast, shape (count,) [unit of the deviation].

        Parameters
        ----------
        rng : numpy.random.Generator
            Where randomness comes from.
        count : int
            Number of steps.
        step : float
            Their length [s].
        """
        keep = np.exp(-step / self.time_constant)
        drive = self.deviation * np.sqrt(1.0 - keep**2) * rng.standard_normal(count)
        return np.asarray(lfilter([1.0], [1.0, -keep], drive), dtype=float)


#: Assumed errors, of the size that day-ahead numerical weather prediction has at a site: 2 K and 1.5 m/s, a third of
#: the sun, 15 W/m2 of the sky. They are no fit to any service: replace them where one is known.
DAY_AHEAD_ERRORS: Mapping[str, ErrorGrowth] = {
    "temperature": ErrorGrowth(2.0, 24 * 3600.0),
    "wind": ErrorGrowth(1.5, 12 * 3600.0),
    "sun": ErrorGrowth(0.3, 6 * 3600.0),
    "sky": ErrorGrowth(15.0, 12 * 3600.0),
}


class Forecaster:
    """Forecasts of a scenario, step by step.

    A forecast is issued anew at the multiples of `issue_every`; in between its errors stay as they are, and the time
    ahead counts from the issue. Random numbers belong to the issue and the point, so that no forecast depends on which
    others were asked for.

    Parameters
    ----------
    scenario : Scenario
        Truth.
    horizon : int
        Steps of a forecast, at least 1.
    errors : mapping of str to ErrorGrowth
        Of ``temperature``, ``wind``, ``sun`` and ``sky``, such as `DAY_AHEAD_ERRORS`; default none: perfect weather.
    occupancy : str
        ``expected`` people and gains (default), or the ``actual`` ones that only a bound may know.
    issue_every : float
        Time between issues [s]; default an hour.
    seed : int
        Of the errors; 0 or more.

    Raises
    ------
    ScenarioError
        When an option is not known or out of range.
    """

    def __init__(
        self,
        scenario: Scenario,
        horizon: int,
        errors: Mapping[str, ErrorGrowth] | None = None,
        *,
        occupancy: Literal["expected", "actual"] = "expected",
        issue_every: float = 3600.0,
        seed: int = 0,
    ) -> None:
        if not 1 <= horizon <= scenario.grid.n_steps or seed < 0 or issue_every <= 0:
            expected = f"a horizon of 1 to {scenario.grid.n_steps} steps, a seed of 0 or more, a time between issues"
            raise ScenarioError(describe("forecaster", expected, f"{horizon}, {seed}, {issue_every} s"))
        if occupancy not in ("expected", "actual"):
            raise ScenarioError(describe("occupancy", "'expected' or 'actual'", repr(occupancy)))
        for name in errors or {}:
            ScenarioError.unless_known(name, ERROR_POINTS, "errors", "a known one")
        self.scenario, self.horizon, self.seed = scenario, horizon, seed
        self.errors, self.issue_every = dict(errors or {}), issue_every
        truth = scenario.to_frame(expected=occupancy == "expected")
        self.columns = tuple(truth)
        self._wrong = {name: np.flatnonzero(truth.columns.isin(ERROR_POINTS[name])) for name in self.errors}
        self._truth = np.ascontiguousarray(truth.to_numpy())
        self._truth.setflags(write=False)
        self._issue: tuple[int, dict[str, FloatArray]] = (-1, {})

    def values(self, k: int) -> FloatArray:
        """Forecast the steps from one on.

        Parameters
        ----------
        k : int
            Number of the step that comes next, from 0.

        Returns
        -------
        ndarray, shape (horizon, n_column)
            Columns as `columns`, in the library's units; not to be written to.

        Raises
        ------
        ScenarioError
            When the scenario ends before the horizon does.
        """
        if not 0 <= k <= len(self._truth) - self.horizon:
            expected = f"a step from 0 to {len(self._truth) - self.horizon}, so that the scenario covers the horizon"
            raise ScenarioError(describe("forecast", expected, repr(k), "make the scenario's grid longer"))
        truth = self._truth[k : k + self.horizon]
        if not self.errors:
            return truth
        values = truth.copy()
        begin = int(self.scenario.grid.edges[k])
        issue = int(begin // self.issue_every)
        since = int((begin - issue * self.issue_every) // self.scenario.grid.step)
        paths = self._paths(issue)
        for name, path in paths.items():
            at, error = self._wrong[name], path[since : since + self.horizon, None]
            if name == "sun":
                values[:, at] *= np.maximum(1.0 + error, 0.0)
            else:
                values[:, at] += error
            if name == "wind":
                values[:, at] = np.maximum(values[:, at], 0.0)
        return values

    def table(self, k: int) -> Forecast:
        """Forecast the steps from one on, as a table with units.

        Parameters
        ----------
        k : int
            Number of the step that comes next, from 0.
        """
        stamps = self.scenario.grid.stamps[k : k + self.horizon]
        return Forecast(pd.DataFrame(self.values(k), index=stamps, columns=list(self.columns)))

    def _paths(self, issue: int) -> dict[str, FloatArray]:
        if self._issue[0] != issue:
            count = self.horizon + int(self.issue_every // self.scenario.grid.step) + 1
            paths = {}
            for name, error in self.errors.items():
                rng = np.random.default_rng([self.seed, _STREAM, issue, zlib.crc32(name.encode())])
                paths[name] = error.path(rng, count, self.scenario.grid.step)
            self._issue = (issue, paths)
        return self._issue[1]
