"""What an experiment's odds make of a verdict."""

import pandas as pd
import pytest

from calibration.diagnosis.decide.verdict import Candidate, Verdict
from calibration.evaluation.intervals import Interval
from calibration.experiment.outcome import Outcome, narrowed

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
