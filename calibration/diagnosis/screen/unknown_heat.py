"""Errors of a fitted model by the day, with their derivatives by its parameters and by heat of unknown cause."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calibration.diagnosis.refit.comparison import Effects, ModelComparison
from calibration.evaluation.intervals import Runs
from calibration.fit.problem import Problem
from thermal._types import BoolArray, FloatArray, IntArray
from thermal.effects.effect import Chosen
from thermal.effects.unknown import UNKNOWN, inputs_of
from thermal.inputs.provider import IRRADIANCE
from thermal.model.reduce import reduced_model
from thermal.network.build import Extension
from thermal.parameters import Parameter


@dataclass(frozen=True)
class DailyErrors:
    """Squared errors of every tuning day as they change with the parameters, to first order in the errors.

    Parameters
    ----------
    parameters : tuple of Parameter, length n_parameter
        Of the model, and of heat of unknown cause in every zone, which is absent.
    days : ndarray of int, shape (n_day,)
        Midnights, as numbers that grow with time [-].
    gram : ndarray, shape (n_day, n_parameter, n_parameter)
        Products of the derivatives on the estimation scale [K²].
    score : ndarray, shape (n_day, n_parameter)
        Products of derivatives and errors [K²].
    squared : ndarray, shape (n_day,)
        Squared errors [K²].
    size : ndarray, shape (n_day,)
        Number of errors [-].
    count : float
        How many independent ones they are [-].
    kinds : tuple of str
        Heat of unknown cause that the case can tell, keys of `UNKNOWN`.
    """

    parameters: tuple[Parameter, ...]
    days: IntArray
    gram: FloatArray
    score: FloatArray
    squared: FloatArray
    size: FloatArray
    count: float
    kinds: tuple[str, ...]

    @property
    def own(self) -> BoolArray:
        """Which parameters are the model's, shape (n_parameter,)."""
        return np.array([p.effect not in self.kinds for p in self.parameters])

    def of(self, effect: str, zone: str = "") -> BoolArray:
        """Which parameters are heat of one kind, shape (n_parameter,).

        Parameters
        ----------
        effect : str
            Key of `UNKNOWN`.
        zone : str
            Where; everywhere by default.
        """
        return np.array([p.effect == effect and zone in ("", p.member) for p in self.parameters])

    def solve(self, days: BoolArray, basis: FloatArray, precision: FloatArray, scale: float) -> FloatArray:
        """Coefficients of some directions that lower the errors of some days most, shape (n,) [-].

        Parameters
        ----------
        days : ndarray of bool, shape (n_day,)
            Which.
        basis : ndarray, shape (n_parameter, n)
            Directions on the estimation scale [-].
        precision : ndarray, shape (n,)
            Of each coefficient before any data [-].
        scale : float
            Independent errors per squared error [1/K²].
        """
        gram, score = basis.T @ self.gram[days].sum(axis=0) @ basis, self.score[days].sum(axis=0) @ basis
        return np.asarray(np.linalg.solve(scale * gram + np.diag(precision), -scale * score))

    def after(self, change: FloatArray) -> FloatArray:
        """Squared errors of every day with changed parameters, shape (n_day,) [K²].

        Parameters
        ----------
        change : ndarray, shape (n_parameter,)
            On the estimation scale [-].
        """
        return np.asarray(self.squared + 2.0 * self.score @ change + (self.gram @ change) @ change)


def days_of_runs(problem: Problem, runs: Runs) -> IntArray:
    """Midnight before the middle of every run, as numbers that grow with time, shape (n_run,) [-].

    Parameters
    ----------
    problem : Problem
        That they are part of.
    runs : Runs
        The runs.
    """
    return np.asarray(problem.inputs.stamps[runs.starts + problem.steps // 2].normalize().asi8)


def daily_errors(
    models: ModelComparison,
    effects: Effects,
    values: Mapping[str, float],
    further: Sequence[Extension] = (),
    kinds: Sequence[str] = tuple(UNKNOWN),
) -> DailyErrors:
    """Linearise the errors of the tuning runs about a model, with heat of unknown cause in every zone.

    Parameters
    ----------
    models : ModelComparison
        The case.
    effects : mapping of str to sequence of str
        Effects of the model with their zones.
    values : mapping of str to float
        Its parameters by name [parameter units].
    further : sequence of Extension
        What else the model has.
    kinds : sequence of str
        Keys of `UNKNOWN`; what the case does not measure, and what the effects have, is left out.
    """
    drivers = models.drivers
    unknown = {"sun"} if drivers.estimates(IRRADIANCE) else set()  # an estimate is too rough to learn a course from
    told = [e for e in kinds if e not in effects and not drivers.lacks(inputs_of(e)) and not unknown & {*inputs_of(e)}]
    built = models.build(effects, [*further, *(Chosen(UNKNOWN[e]) for e in told)])
    theta = built.theta(values)
    problem, model = models.problem(built, theta), reduced_model(built.grid, [theta])
    errors, days, jacobians = [], [], []
    for runs in problem.runs:
        error, slopes = problem.errors(model, theta, runs, slopes=True)
        known = np.isfinite(error)
        errors.append(error[known])
        days.append(np.broadcast_to(days_of_runs(problem, runs)[:, None, None], error.shape)[known])
        jacobians.append((np.asarray(slopes) * problem.slopes(theta))[known])
    error, jacobian = np.concatenate(errors), np.concatenate(jacobians)
    there, index = np.unique(np.concatenate(days), return_inverse=True)
    rows = [index == d for d in range(there.size)]
    return DailyErrors(
        tuple(built.network.parameters), there, np.array([jacobian[r].T @ jacobian[r] for r in rows]),
        np.array([jacobian[r].T @ error[r] for r in rows]), np.array([float(error[r] @ error[r]) for r in rows]),
        np.array([float(r.sum()) for r in rows]),
        problem.effective_size(), tuple(told),
    )  # fmt: skip
