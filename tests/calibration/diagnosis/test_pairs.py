"""Pairs of effects: two that hide each other are found together where the best single effect is neither."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration.diagnosis._pairs import nominate
from calibration.diagnosis._screen import Screening
from thermal.effects import CATALOGUE

FloatArray = NDArray[np.float64]

#: Effects with one strength each, of which the third will look like what is left of the first two.
NAMES = ("roof_exchange", "ground_exchange", "interfloor_exchange", "infiltration")

#: Errors, and their deviation [K].
COUNT, NOISE = 300, 0.1


def screening(signatures: FloatArray, errors: FloatArray) -> Screening:
    """A screening of a model that is linear in its strengths, and has no other parameters."""
    made = Screening.__new__(Screening)
    made.parameters = tuple(CATALOGUE[name].parameters[0] for name in NAMES)
    made.count, made.scale = float(len(errors)), float(len(errors) / np.sum(errors**2))
    made.gram = made.scale * signatures.T @ signatures
    made.score = -made.scale * signatures.T @ errors
    made.prior = np.array([p.prior_deviation for p in made.parameters])
    made.lower = np.array([p.lower for p in made.parameters])
    made.upper = np.array([p.upper for p in made.parameters])
    made._whole, made._elsewhere = made.gram, 0
    made._position = {p.name: i for i, p in enumerate(made.parameters)}
    return made


def planted(strengths: tuple[float, float], seed: int = 4) -> Screening:
    """Errors of the first two effects, which cancel but for an eighth of their size, and of which the third has half."""
    rng = np.random.default_rng(seed)
    shared, own, other, third = rng.standard_normal((4, COUNT))
    signatures = np.column_stack([
        shared + 0.125 * own, -shared + 0.125 * other, 0.1 * (own + other + 0.5 * third), rng.standard_normal(COUNT),
    ])  # fmt: skip
    true = np.array([*strengths, 0.0, 0.0])
    return screening(signatures, NOISE * rng.standard_normal(COUNT) - signatures @ true)


def test_a_pair_that_cancels_is_found_where_two_best_singles_are_not_it() -> None:
    made = planted((0.8, 0.8))
    gains = sorted((made.of(name) for name in NAMES), key=lambda g: -g.gain)
    assert gains[0].effect == "interfloor_exchange"
    assert {g.effect for g in gains[:2]} != {"roof_exchange", "ground_exchange"}
    best, *_ = nominate(made, gains, 3.0)
    assert {best.first.effect, best.second.effect} == {"roof_exchange", "ground_exchange"}
    for g in (best.first, best.second):
        assert list(g.strengths.values()) == pytest.approx([0.8], abs=0.2)
    assert best.gain > gains[0].gain + 6.0


def test_what_one_effect_explains_nominates_no_pair() -> None:
    made = planted((0.8, 0.0))
    gains = sorted((made.of(name) for name in NAMES), key=lambda g: -g.gain)
    assert gains[0].effect == "roof_exchange"
    assert nominate(made, gains, 3.0) == []
    assert nominate(made, gains[:1], 3.0) == []


def test_a_pair_s_gain_is_the_evidence_of_both() -> None:
    """Against the determinant form for Gaussian errors of known size, with strengths well inside their ranges."""
    made = planted((0.5, 0.5))
    first, second = made.of("roof_exchange"), made.of("ground_exchange")
    one, other, gain = made.together(first, second)
    x = np.array([*one.strengths.values(), *other.strengths.values()])
    gram, score, prior = made.gram[:2, :2], made.score[:2], np.diag(made.prior[:2] ** -2.0)
    share = (2.0 * score @ x - x @ gram @ x) / made.count
    sharper = gram / (1.0 - share)
    exact = -0.5 * made.count * np.log1p(-share) - 0.5 * x @ prior @ x + 2.0 * np.log(2.0)
    exact += 0.5 * (np.linalg.slogdet(prior)[1] - np.linalg.slogdet(sharper + prior)[1])
    assert gain == pytest.approx(exact, rel=1e-9)
    assert made.reach(first, second) == pytest.approx(gain, abs=0.5)
