"""Cross-validation: no day judges a model that has seen it, jackknife in closed form, executors, failures."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from calibration import CalibrationError, CrossValidation, Interval, cross_validate
from calibration.evaluation.intervals import select_runs
from calibration.evaluation.n_step import Evaluation, Predictions
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit import cross_validation as module
from calibration.fit.problem import tuning_problem
from mpc.reports.identifiability import cross_validation_sentences
from thermal import Case, build_network, load_bundled_case, replay_inputs

STEPS = 72
WALL = "exterior_wall_conductivity"


def evaluation(case: Case, interval: Interval, error: float) -> Evaluation:
    """Hourly runs with the same error in all of five zones."""
    stamps = case.stamps[(case.stamps >= interval.start) & (case.stamps <= interval.end)][::12]
    start = pd.DatetimeIndex(stamps - pd.Timedelta(hours=6))
    simulated = np.full((len(start), 1, 5), 293.0 + error)
    part = Predictions(
        interval, start, simulated, np.full_like(simulated, 293.0), np.array([STEPS]), simulated[:, 0], 0
    )
    return Evaluation(STEPS, 300.0, (part,), tuple("abcde"))


class Calibration:
    """Stands for `calibrate`: what each fold finds depends on its first held-out day alone."""

    def __init__(self, values: Sequence[float], errors: Sequence[float], fail: int | None = None) -> None:
        self.values, self.errors, self.fail = values, errors, fail
        self.calls: list[tuple[tuple[Interval, ...], tuple[Interval, ...], Mapping[str, Any]]] = []

    def __call__(
        self, case: Case, tune: tuple[Interval, ...], hold_out: tuple[Interval, ...], **settings: Any
    ) -> SimpleNamespace:
        self.calls.append((tune, hold_out, settings))
        first, last = case.stamps[0], case.stamps[-1]
        number = int(len(self.values) * ((hold_out[0].start - first) / (last - first)) + 0.5)
        if number == self.fail:
            raise CalibrationError("no run")
        estimate = SimpleNamespace(
            name=WALL, value=np.exp(self.values[number]), standard_error=0.1 * np.exp(self.values[number])
        )
        fixed = SimpleNamespace(name="window_u_value", value=1.0, standard_error=None)
        judged = evaluation(case, hold_out[0], self.errors[number])
        solver = SimpleNamespace(status="Solve_Succeeded")
        return SimpleNamespace(parameters=(estimate, fixed), calibrated={"held_out": judged}, solver=solver)


def run(monkeypatch: pytest.MonkeyPatch, fake: Calibration, folds: int, **given: Any) -> CrossValidation:
    monkeypatch.setattr(module, "calibrate", fake)
    return cross_validate(load_bundled_case(), folds, **given)


def test_mean_error_and_jackknife_are_those_of_the_folds(monkeypatch: pytest.MonkeyPatch) -> None:
    values, errors = [0.0, 0.3, -0.1, 0.2, 0.1], [0.1, 0.2, 0.3, 0.2, 0.2]
    found = run(monkeypatch, Calibration(values, errors), 5)
    assert found.mae == pytest.approx(0.2)
    assert found.standard_error == pytest.approx(np.std(errors, ddof=1) / np.sqrt(5))
    assert [f.mae for f in found.folds] == pytest.approx(errors)
    (wall,) = found.parameters
    assert wall.deviation == pytest.approx(np.std(values, ddof=1))
    assert wall.jackknife_error == pytest.approx(np.sqrt(0.8 * np.sum((np.array(values) - 0.1) ** 2)))
    assert wall.standard_error == pytest.approx(0.1)
    assert wall.moves
    sentences = cross_validation_sentences(found)
    assert "misses by 0.200 K, give or take 0.032 K (5 folds)" in sentences[0]
    assert "moves exterior wall conductivity by more than" in sentences[1]


def test_jackknife_of_a_mean_is_its_standard_error() -> None:
    """Estimates that leave one block of a mean out spread by σ/√K times (K-1)/K times √K... in closed form."""
    rng = np.random.default_rng(0)
    blocks = rng.standard_normal(8)
    left_out = [(blocks.sum() - b) / 7.0 for b in blocks]
    folds = [
        module.Fold((), (), 0.0, 0.0, {}, {WALL: z}, {WALL: 1.0}) for z in left_out
    ]  # fmt: skip
    (found,) = module._spreads(folds)
    assert found.jackknife_error == pytest.approx(np.std(blocks, ddof=1) / np.sqrt(8))


@pytest.mark.parametrize("folds", [2, 5, 10])
def test_no_residual_of_a_fold_is_near_the_days_that_it_is_judged_on(
    monkeypatch: pytest.MonkeyPatch, folds: int
) -> None:
    """All days are held out once; tuning residuals end before any judged run starts, and begin after its days."""
    fake, case = Calibration([0.0] * folds, [0.1] * folds), load_bundled_case()
    run(monkeypatch, fake, folds)
    inputs = replay_inputs(case, build_network(case.building, dx=1.5))
    judged = []
    for tune, hold_out, _ in fake.calls:
        problem = tuning_problem(case, tune, CalibrationSettings(dx=1.5))
        seen = np.concatenate([(r.starts[:, None] + problem.keep).ravel() for r in problem.runs])
        begun = np.concatenate([r.starts for r in problem.runs])
        for held in hold_out:
            runs = select_runs(inputs, held, STEPS)
            first, last = runs.starts.min(), runs.starts.max() + STEPS
            before, after = seen[seen < last], begun[begun > first]
            assert before.size == 0 or before.max() < inputs.stamps.searchsorted(held.start) - STEPS
            assert before.size == 0 or before.max() <= first
            assert after.size == 0 or after.min() >= last
            judged.append((held.start, held.end))
    assert all(b[0] - a[1] == pd.Timedelta(minutes=5) for a, b in pairwise(sorted(judged)))
    assert sorted(judged)[0][0] == case.stamps[0]
    assert sorted(judged)[-1][1] == case.stamps[-1]


def test_only_the_given_telemetry_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    stamps = load_bundled_case().stamps
    parts = [Interval(stamps[0], stamps[863]), Interval(stamps[1440], stamps[2303])]
    fake = Calibration([0.0] * 12, [0.1] * 12)
    run(monkeypatch, fake, 3, intervals=parts)
    for tune, hold_out, _ in fake.calls:
        for interval in (*tune, *hold_out):
            assert any(p.start <= interval.start and interval.end <= p.end for p in parts)
    assert [[i.start for i in held] for _, held, _ in fake.calls] == [
        [parts[0].start], [stamps[576], parts[1].start], [stamps[1728]]
    ]  # fmt: skip


def test_errors_by_day_are_of_local_days() -> None:
    stamps = pd.DatetimeIndex(["2023-03-02T00:00-05:00", "2023-03-02T00:05-05:00", "2023-03-02T23:00-05:00"])
    assert module.local_days(stamps.tz_convert("Etc/GMT+5")).tolist() == ["2023-03-01", "2023-03-02", "2023-03-02"]


def test_an_executor_gives_the_same_in_the_same_order(monkeypatch: pytest.MonkeyPatch) -> None:
    values, errors = [0.0, 0.3, -0.1, 0.2, 0.1], [0.1, 0.2, 0.3, 0.2, 0.2]
    here = run(monkeypatch, Calibration(values, errors), 5)
    told: list[Any] = []
    with ThreadPoolExecutor(3) as pool:
        there = run(monkeypatch, Calibration(values, errors), 5, executor=pool, progress=lambda *a: told.append(a))
    assert there == here
    assert told == [("cross-validate", n, 5) for n in range(1, 6)]


def test_a_fold_that_fails_is_reported_beside_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    found = run(monkeypatch, Calibration([0.0] * 5, [0.1] * 5, fail=2), 5)
    assert [f.failure for f in found.folds] == [None, None, "CalibrationError: no run", None, None]
    assert found.mae == pytest.approx(0.1)
    assert "1 of 5 folds failed" in cross_validation_sentences(found)[1]
    with pytest.raises(CalibrationError, match="fewer than two folds succeeded"):
        run(monkeypatch, Calibration([0.0] * 2, [0.1] * 2, fail=1), 2)


def test_settings_reach_the_calibration(monkeypatch: pytest.MonkeyPatch) -> None:
    fake = Calibration([0.0] * 2, [0.1] * 2)
    run(monkeypatch, fake, 2, settings={"dx": 1.5, "fixed": {WALL: 0.3}})
    assert all(call[2] == {"settings": CalibrationSettings(dx=1.5, fixed={WALL: 0.3})} for call in fake.calls)


@pytest.mark.parametrize(
    ("folds", "settings", "message"),
    [
        (1, {}, "folds: expected 2 to 10, the days of telemetry to use, found 1"),
        (11, {}, "folds: expected 2 to 10"),
        (2, {"tune": []}, "chooses 'tune' itself"),
        (2, {"dy": 1.0}, "calibrate takes no 'dy'"),
    ],
)
def test_bad_input_is_refused(folds: int, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        cross_validate(load_bundled_case(), folds, settings)


def test_a_real_case_in_two_folds() -> None:
    """Three days, two of them or one left out in turn: held-out errors of a coarse model, parameters on the estimation scale."""
    case = load_bundled_case()
    found = cross_validate(
        case, 2, {"dx": 1.5, "starts": 1}, intervals=[Interval(case.stamps[0], case.stamps[3 * 288 - 1])]
    )
    assert all(f.failure is None for f in found.folds)
    assert 0.1 < found.mae < 1.5
    assert [sorted(f.by_day or {}) for f in found.folds] == [["2023-03-01", "2023-03-02"], ["2023-03-03"]]
    shuffle = {p.name: p for p in found.parameters}["shuffle_probability"]
    assert shuffle.standard_error == pytest.approx(1.95, rel=0.2)
    assert not shuffle.moves
    assert json.loads(json.dumps(found.to_dict()))["folds"][0]["tuning"]
