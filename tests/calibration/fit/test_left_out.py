"""Tuning days that are left out in turn, and fits of the others by a few Newton steps."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.fitted_case import FittedCase, fit_case
from calibration.fit.least_squares import solve_least_squares
from calibration.fit.left_out import LeftOut, _clear, _parts, left_out
from thermal._types import FloatArray
from thermal.data import load_bundled_case

START = pd.Timestamp("2024-01-01", tz="UTC")


@pytest.fixture(scope="module")
def fitted() -> FittedCase:
    return fit_case(load_bundled_case(), (), (), CalibrationSettings(dx=1.5, starts=1))


def _folds(left: LeftOut) -> list[tuple[list[Interval], FloatArray]]:
    """Parts by the fit that left them out."""
    return [
        ([p for p, t in zip(left.parts, left.thetas, strict=True) if np.array_equal(t, theta)], theta)
        for theta in np.unique(left.thetas, axis=0)
    ]


@pytest.mark.parametrize("days", [1, 7])
def test_newton_steps_end_where_a_fit_without_the_days_does(fitted: FittedCase, days: int) -> None:
    """With four parts of one interval, and with seven intervals, of which each fit leaves every fourth out."""
    best, spin_up = fitted.best, fitted.settings.spin_up_seconds
    (whole,) = fitted.tuned
    cuts = [Interval(a, b) for a, b in pairwise(pd.date_range(whole.start, whole.end, periods=days + 1))]
    left = left_out(best, cuts, spin_up)
    folds = _folds(left)
    assert len(folds) == min(4, len(left.parts)) > 1 and len(left.parts) == max(4, days)
    problem = best.problem
    for parts, theta in folds:
        clear = [_clear(problem.inputs.stamps, r, problem.steps, parts) for r in problem.runs]
        runs = tuple(replace(r, starts=r.starts[own]) for r, own in zip(problem.runs, clear, strict=True))
        rest = tuple(r for r in runs if r.starts.size)
        share = sum(r.starts.size for r in rest) / sum(r.starts.size for r in problem.runs)
        fold = replace(problem, runs=rest, effective=share * problem.effective_size())
        found = solve_least_squares(lambda z, fold=fold: fold.weighted(best.model, z), best.point, *problem.bounds)
        whole = 0.5 * float(np.sum(fold.weighted(best.model, best.point)[0] ** 2))
        steps = 0.5 * float(np.sum(fold.weighted(best.model, problem.point(theta))[0] ** 2))
        assert steps - found.cost < 0.05 * (whole - found.cost) + 1e-3


def test_no_error_is_of_a_day_that_was_fitted(fitted: FittedCase) -> None:
    problem = fitted.best.problem
    for part in _parts(fitted.tuned):
        for runs in problem.runs:
            stamps = problem.inputs.stamps
            kept = replace(runs, starts=runs.starts[_clear(stamps, runs, problem.steps, [part])])
            ends = stamps[kept.starts + problem.steps]
            assert ((ends < part.start) | (stamps[kept.starts] > part.end)).all()


def test_tuning_days_are_cut_into_parts_that_meet() -> None:
    whole = Interval(START, START + pd.Timedelta(days=10))
    parts = _parts([whole])
    assert len(parts) == 4
    assert parts[0].start == whole.start and parts[-1].end == whole.end
    days = [Interval(START + pd.Timedelta(days=2 * k), START + pd.Timedelta(days=2 * k + 1)) for k in range(5)]
    assert _parts(days) == days
    assert len(_parts([Interval(START, START + pd.Timedelta(hours=20))])) == 2
    assert len(_parts([Interval(START, START + pd.Timedelta(hours=10))])) == 1
