"""A void permutation test caps what is said of an effect."""

import pytest

from calibration.diagnosis.decide.levels import VOID
from calibration.diagnosis.decide.verdict import Candidate, Verdict, doubted


def candidate(effect: str, probability: float) -> Candidate:
    return Candidate(effect, probability, 9.0, (effect,), (), {}, 0.9, "")


def test_an_effect_that_explains_as_much_on_other_days_is_no_more_than_likely() -> None:
    two = (candidate("solar_gain", 0.99), candidate("blinds", 0.3), candidate("roof_exchange", 0.2))
    verdict = Verdict("named", two, ("solar_gain",), {("solar_gain",): 1.0})
    capped = doubted(verdict, {"solar_gain", "blinds"})
    assert [c.probability for c in capped.candidates] == pytest.approx([VOID, 0.3, 0.2])
    assert [c.effect for c in capped.candidates] == ["solar_gain", "blinds", "roof_exchange"]
    assert doubted(verdict, ()).candidates == two and capped.name == "named"
