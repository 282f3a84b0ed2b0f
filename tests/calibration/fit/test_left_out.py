"""Tuning days that are left out in turn, and fits of the others by a few Newton steps."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.fitted_case import FittedCase, fit_case
from calibration.fit.least_squares import solve_least_squares
from calibration.fit.left_out import _outside, _parts, left_out
from thermal.data import load_bundled_case

START = pd.Timestamp("2024-01-01", tz="UTC")


@pytest.fixture(scope="module")
def fitted() -> FittedCase:
    return fit_case(load_bundled_case(), (), (), CalibrationSettings(dx=1.5, starts=1))


def test_newton_steps_end_where_a_fit_without_the_days_does(fitted: FittedCase) -> None:
    best, spin_up = fitted.best, fitted.settings.spin_up_seconds
    left = left_out(best, fitted.tuned, spin_up)
    assert len(left.parts) == len(left.thetas) > 1
    problem = best.problem
    for part, theta in zip(left.parts, left.thetas, strict=True):
        runs = tuple(_outside(problem.inputs.stamps, r, problem.steps, part) for r in problem.runs)
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
            kept = _outside(problem.inputs.stamps, runs, problem.steps, part)
            stamps = problem.inputs.stamps
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
