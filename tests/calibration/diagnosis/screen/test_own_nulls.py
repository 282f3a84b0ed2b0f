"""A case's own nulls: draws are screened as the telemetry is, and levels hold at their rate."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.diagnosis.screen.own_nulls import FALSE_ALARM, OwnNulls, _gains_of
from calibration.diagnosis.screen.screen import Screening
from thermal._types import FloatArray
from thermal.effects.catalogue import CATALOGUE

ZONES = ("A", "B", "C", "D")
COUNT, DRAWS = 200, 40


def made(seed: int = 1) -> tuple[Screening, FloatArray]:
    """A screening of a meter's error a zone and of the roof, one fitted parameter following; and scores of draws."""
    rng = np.random.default_rng(seed)
    gain, roof = (CATALOGUE[e].parameters[0] for e in ("flow_gain", "roof_exchange"))
    found = Screening.__new__(Screening)
    found.parameters = (*(gain.of("zone", z) for z in ZONES), roof, CATALOGUE["ground_exchange"].parameters[0])
    n = len(found.parameters)
    signatures = rng.standard_normal((COUNT, n)) + 0.5 * rng.standard_normal((COUNT, 1))
    errors = rng.standard_normal(COUNT)
    found.count, found.scale = float(COUNT), float(COUNT / np.sum(errors**2))
    found.prior = np.array([p.prior_deviation for p in found.parameters])
    found.lower, found.upper = (np.array([getattr(p, end) for p in found.parameters]) for end in ("lower", "upper"))
    found.elsewhere = 0
    found._levels, found._twins, found._tied = {}, {}, range(0)
    found._whole, found._slope = found.scale * signatures.T @ signatures, -found.scale * signatures.T @ errors
    found._start = found._point = np.zeros(n)
    found._project(np.arange(n) == n - 1)
    found.jacobian = signatures
    return found, found.scores_of(rng.standard_normal((DRAWS, COUNT)) * 3.0)


def test_scores_of_the_errors_themselves_are_those_of_the_fit() -> None:
    rng = np.random.default_rng(7)
    screening, _ = made()
    errors = rng.standard_normal(COUNT)
    assert screening.jacobian is not None
    screening._slope = -screening.scale * screening.jacobian.T @ errors
    screening._project(screening._known)
    scaled = np.sqrt(screening.count / screening.scale / np.sum(errors**2))
    assert screening.scores_of(errors[None])[0] == pytest.approx(scaled * screening.score)
    assert screening.scores_of(5.0 * errors[None])[0] == pytest.approx(scaled * screening.score)  # of any size


@pytest.mark.parametrize("effect", ["flow_gain", "roof_exchange"])
def test_draws_are_screened_as_the_telemetry_is(effect: str) -> None:
    """Zone by zone, with the price of having chosen them: one draw after another by `Screening` itself."""
    screening, scores = made()
    together, _ = _gains_of(screening, effect, scores)
    for row, gain in zip(scores, together, strict=True):
        screening.score = row
        assert gain == pytest.approx(screening.of(effect).gain, abs=2e-3)


def test_strengths_that_are_not_there_gain_and_cost_nothing() -> None:
    screening, scores = made()
    index = screening.strengths_of("flow_gain")
    none = np.zeros((DRAWS, index.size), dtype=bool)
    solve = screening.programme.solve
    assert solve(index, scores, none).gain == pytest.approx(np.zeros(DRAWS))
    one = none.copy()
    one[:, 2] = True
    assert solve(index, scores, one).gain == pytest.approx(solve(index[2:3], scores).gain, abs=1e-6)


def test_levels_hold_at_their_rate_and_go_on_beyond_the_draws() -> None:
    rng = np.random.default_rng(3)
    largest = np.sort(rng.exponential(2.0, 2000))
    own = OwnNulls(largest, {"flow_gain": largest - 1.0, "roof_exchange": -largest}, largest)
    fresh = rng.exponential(2.0, 20_000)
    assert np.mean(fresh > own.level) == pytest.approx(FALSE_ALARM, abs=0.01)
    assert own.usual("flow_gain") == pytest.approx(own.level - 1.0)
    assert own.usual("roof_exchange") == own.usual("solar_gain") == 0.0
    for gain in (1.0, 4.0, 8.0):
        assert own.p_value(gain) == pytest.approx(np.exp(-gain / 2.0), rel=0.3)
    tail = [own.p_value(float(largest[-1]) + far) for far in (0.0, 2.0, 4.0)]
    assert tail[1] / tail[2] == pytest.approx(np.exp(1.0), rel=0.1)


def test_sensitivities_that_were_let_go_are_said() -> None:
    screening, _ = made()
    screening.jacobian = None
    with pytest.raises(ValueError, match="let go"):
        screening.scores_of(np.ones((1, COUNT)))
