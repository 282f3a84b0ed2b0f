"""What an experiment's odds make of a verdict."""

from dataclasses import dataclass
from typing import Any

import pandas as pd
import pytest

from calibration.diagnosis.decide.verdict import Candidate, Verdict
from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings
from calibration.experiment import outcome as outcome_module
from calibration.experiment.members import Question, comparison, fit_members
from calibration.experiment.outcome import Outcome, diagnose_further, narrowed, weigh_experiment
from thermal.case.case import Case
from thermal.case.points import ZONE_TEMPERATURE
from thermal.case.telemetry import Telemetry
from thermal.data import load_bundled_case

WHEN = Interval(pd.Timestamp("2023-01-23", tz="UTC"), pd.Timestamp("2023-01-25", tz="UTC"))


def verdict() -> Verdict:
    """Make a group of two, and a third effect."""
    group = {
        "flow_gain": ("flow_gain", "duct_loss"),
        "duct_loss": ("duct_loss", "flow_gain"),
        "wind_film": ("wind_film",),
    }
    chances = {"flow_gain": 0.6, "duct_loss": 0.4, "wind_film": 0.05}
    candidates = tuple(Candidate(e, chances[e], 9.0, g, (), {}, 0.5, "") for e, g in group.items())
    return Verdict("group", candidates, ("flow_gain", "duct_loss"), {})


def test_the_named_member_comes_first_and_alone() -> None:
    outcome = Outcome({"flow_gain": 10.0, "duct_loss": 18.0}, {"flow_gain": 5.0, "duct_loss": 5.0}, 20.0, WHEN)
    found = narrowed(verdict(), outcome)
    assert outcome.named == "duct_loss" and outcome.log_odds == 8.0
    assert found.name == "named" and found.candidates[0].effect == "duct_loss"
    assert found.candidates[0].group == ("duct_loss",) and found.set90 == ("duct_loss",)
    assert [c.effect for c in found.candidates[1:]] == ["flow_gain", "wind_film"]
    assert found.candidates[0].probability == pytest.approx(0.6 / (1.0 + 2.718281828**-4.0))


@pytest.mark.parametrize(
    ("evidence", "before"),
    [
        ((10.0, 15.0), (5.0, 5.0)),  # odds of 12 to 1 once evidence is halved
        ((10.0, 18.0), (15.0, 5.0)),  # against all telemetry
    ],
)
def test_too_little_and_what_all_telemetry_contradicts_names_nothing(
    evidence: tuple[float, float], before: tuple[float, float]
) -> None:
    members = ("flow_gain", "duct_loss")
    outcome = Outcome(dict(zip(members, evidence, strict=True)), dict(zip(members, before, strict=True)), 20.0, WHEN)
    assert outcome.named is None
    assert narrowed(verdict(), outcome) == verdict()


@pytest.fixture(scope="module")
def case() -> Case:
    """Give the bundled case by the half hour, with a sensor of one zone that reads 2 K too much."""
    found = load_bundled_case()
    frame = found.telemetry.frame.resample("30min", closed="right", label="right").mean().iloc[:-1]
    frame[f"VAV_F1_N/{ZONE_TEMPERATURE}"] += 2.0
    return Case(found.building, Telemetry.from_frame(frame))


def asked(case: Case) -> tuple[Question, Interval]:
    """Ask whether that sensor is wrong or that zone has more mass, and give the last two days."""
    s = case.stamps
    members = {"sensor_bias": ("F1_N",), "hidden_mass": ("F1_N",)}
    parts = (Interval(s[0], s[191]),), (Interval(s[192], s[-97]),)
    return Question(members, {}, *parts, dict.fromkeys(members, 0.5)), Interval(s[-96], s[-1])


def test_the_experiment_speaks_for_what_is_there(case: Case) -> None:
    question, interval = asked(case)
    model = ModelSettings(dx=3.0)
    found = weigh_experiment(case, question, interval, model)
    assert found.ranked[0] == "sensor_bias" and found.interval == interval
    past = {m.effect: m.fit.evidence for m in fit_members(comparison(case, question, model), question)}
    assert found.before == pytest.approx(past)
    with pytest.raises(CalibrationError, match="telemetry from"):
        weigh_experiment(case, question, Interval(interval.start, interval.end + pd.Timedelta(days=1)), model)


@dataclass(frozen=True)
class Found:
    """Stands for a diagnosis."""

    verdict: Verdict


def test_a_diagnosis_goes_on_with_what_is_known(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {}

    def diagnose(case: Case, tune: Any, hold_out: Any, **more: Any) -> Found:
        given.update(tune=tune, hold_out=hold_out, **more)
        return Found(verdict())

    def weigh(case: Case, question: Question, *rest: Any) -> Outcome:
        given["question"] = question
        return Outcome({"flow_gain": 10.0, "duct_loss": 18.0}, {"flow_gain": 5.0, "duct_loss": 5.0}, 20.0, WHEN)

    monkeypatch.setattr(outcome_module, "diagnose", diagnose)
    monkeypatch.setattr(outcome_module, "weigh_experiment", weigh)
    question, interval = asked(case)
    members = {"flow_gain": (), "duct_loss": (), "infiltration": ()}
    question = Question(members, {}, question.tuned, (Interval(case.stamps[192], case.stamps[-1]),),
                        dict.fromkeys(members, 1.0 / 3.0))  # fmt: skip
    model = ModelSettings(dx=3.0)
    result, outcome = diagnose_further(case, question, interval, model, 20.0, ["solar_gain"], ["infiltration"])
    assert result.verdict == narrowed(verdict(), outcome) and result.verdict.candidates[0].effect == "duct_loss"
    assert set(given["question"].members) == {"flow_gain", "duct_loss"} and given["question"].known == {
        "solar_gain": ()
    }
    assert given["tune"] == (*question.tuned, interval) and given["dx"] == 3.0
    assert given["hold_out"] == [Interval(case.stamps[192], interval.start - pd.Timedelta(minutes=30))]
    assert (given["known"], given["ruled_out"]) == (["solar_gain"], ["infiltration"])
    given.clear()
    with pytest.raises(CalibrationError, match="telemetry from"):
        diagnose_further(case, question, Interval(interval.start, interval.end + pd.Timedelta(days=1)), model)
    with pytest.raises(CalibrationError, match="neither known nor ruled out"):
        diagnose_further(case, question, interval, model, 20.0, ["flow_gain"], ["infiltration"])
    assert not given  # said before the diagnosis
