"""Scores of blind trials on answers made up by hand."""

from __future__ import annotations

import importlib.util
import math
import sys
from pathlib import Path
from typing import Any

import pytest

_spec = importlib.util.spec_from_file_location(
    "_trial_scores", Path(__file__).parents[2] / "benchmarks" / "_trial_scores.py"
)
assert _spec is not None and _spec.loader is not None
scores = sys.modules.setdefault("_trial_scores", importlib.util.module_from_spec(_spec))
_spec.loader.exec_module(scores)
Rate, Trial, score, trial_of = scores.Rate, scores.Trial, scores.score, scores.trial_of


def answer(verdict: str, first: str, group: tuple[str, ...] = (), mae: float = 0.3, **more: Any) -> dict[str, Any]:
    effects = [first, *[e for e in ("solar_gain", "infiltration", "roof_exchange", "sensor_bias") if e != first]]
    which = [
        {
            "effect": e,
            "probability": 0.8 / (k + 1) ** 3,
            "group": list(group) if not k else [e],
            "zones": [],
            "testable": True,
        }
        for k, e in enumerate(effects)
    ]
    how_far = [{"share_closed": 0.9, "effects": [first]}] if verdict in ("named", "group") else []
    return {
        "verdict": verdict, "which": which, "set90": [first], "gap": {"mae": mae}, "how_far": how_far, "seconds": 20.0
    } | more  # fmt: skip


def trial(kind: str, truths: tuple[str, ...], told: dict[str, Any], twin: float = 0.05, strength: float = 1.0) -> Trial:
    effects = [
        {"name": t, "answers": [t], "strength": strength, "zones": [], "unexplained_is_right": kind == "outside"}
        for t in truths
    ]
    return trial_of("made_up", {"kind": kind, "effects": effects, "stream": 0}, told, [twin] * len(truths))


TRIALS = [
    trial("null", (), answer("no_gap", "solar_gain", mae=0.05)),
    trial("null", (), answer("named", "solar_gain", ("solar_gain",), mae=0.06)),
    trial("null", (), answer("unexplained", "solar_gain", mae=0.08)),
    trial("single", ("solar_gain",), answer("named", "solar_gain", ("solar_gain",)), strength=0.5),
    trial("single", ("infiltration",), answer("group", "solar_gain", ("solar_gain", "infiltration"))),
    trial("single", ("roof_exchange",), answer("named", "solar_gain", ("solar_gain",)), strength=1.5),
    trial("single", ("roof_exchange",), answer("no_gap", "solar_gain", mae=0.07)),  # leaves no gap
    trial("pair", ("solar_gain", "infiltration"), answer("named", "infiltration", ("infiltration",))),
    trial("outside", ("ghosts",), answer("unexplained", "sensor_bias")),
    trial("outside", ("ghosts",), answer("named", "sensor_bias", ("sensor_bias",))),
]


def test_rates_are_of_the_trials_that_count() -> None:
    rates = score(TRIALS)["rates"]
    wanted = {
        "nulls named": (1, 3),
        "nulls unexplained": (1, 3),
        "right first": (1, 3),
        "right group": (2, 3),
        "right in the first three": (3, 3),
        "named right": (2, 3),
        "abstained": (0, 3),
        "wrong name, of all trials": (3, 10),
        "a wrong one beside a right name": (0, 2),
        "outside called unexplained": (1, 2),
        "both of a pair in the first two": (1, 1),
        "90 % set covers": (1, 4),
    }
    for name, (hits, of) in wanted.items():
        assert (rates[name].hits, rates[name].of) == (hits, of), name


def test_what_is_accepted_beside_a_right_name_has_to_be_there() -> None:
    steps = [{"share_closed": 0.8, "effects": effects} for effects in (["solar_gain"], ["solar_gain", "sensor_bias"])]
    told = answer("named", "solar_gain", how_far=steps)
    alone, both = trial("single", ("solar_gain",), told), trial("pair", ("solar_gain", "sensor_bias"), told)
    own = {**told, "which": [w for w in told["which"] if w["effect"] != "sensor_bias"]}  # what a building is known to have
    assert alone.further_wrong and not both.further_wrong
    assert not trial("single", ("solar_gain",), own).further_wrong
    rate = score([alone, both])["rates"]["a wrong one beside a right name"]
    assert (rate.hits, rate.of) == (1, 2)


def test_what_leaves_no_gap_is_shown_apart() -> None:
    found = score(TRIALS)
    assert found["uncounted"] == {"no_gap": 1, "named": 0, "group": 0, "unexplained": 0}
    assert found["by_effect"]["roof_exchange"]["trials"] == 1
    assert found["by_strength"]["0.35 to 0.7"]["right first"] == 1.0
    assert found["closed"] == pytest.approx(0.9)


def test_reliability_counts_every_stated_probability_once() -> None:
    rows = score(TRIALS)["reliability"]
    assert sum(r["count"] for r in rows) == 4 * 7  # four effects in each of three nulls, three singles and a pair
    for r in rows:
        assert r["from"] - 1e-9 <= r["stated"] <= r["to"] + 1e-9
        assert 0.0 <= r["present"] <= 1.0


def test_intervals_are_those_of_wilson() -> None:
    low, high = Rate(8, 10).interval
    assert (low, high) == (pytest.approx(0.4902, abs=1e-4), pytest.approx(0.9433, abs=1e-4))
    assert math.isnan(Rate(0, 0).share)


def test_without_a_twin_a_trial_counts() -> None:
    assert trial("single", ("solar_gain",), answer("no_gap", "solar_gain"), twin=float("nan")).counted


def test_of_a_pair_only_what_leaves_a_gap_is_asked_for() -> None:
    told = answer("named", "solar_gain", set90=["solar_gain"], mae=0.4)
    label = {
        "kind": "pair", "stream": 0,
        "effects": [
            {"name": e, "answers": [e], "strength": 1.0, "zones": [], "unexplained_is_right": False}
            for e in ("solar_gain", "wind_film")
        ],
    }  # fmt: skip
    hidden, both = (trial_of("made_up", label, told, twins) for twins in ((0.1, 0.39), (0.1, 0.2)))
    assert hidden.shown == (frozenset({"solar_gain"}),) and hidden.counted and hidden.covered
    assert len(both.shown) == 2 and not both.covered
    rates = score([hidden, both])["rates"]
    assert rates["both of a pair in the first two"].to_dict()["of"] == 1
    assert rates["one of a pair first"].share == 1.0


def test_a_strength_is_compared_where_both_are_one_number() -> None:
    told = answer("named", "sensor_bias")
    told["which"][0]["parameters"] = {"sensor_bias@A": {"value": 0.6}, "sensor_bias@B": {"value": 9.0}}
    effect = {"name": "sensor_bias", "answers": ["sensor_bias"], "strength": 1.0, "zones": ["A"],
              "unexplained_is_right": False, "parameters": {"bias_K": {"A": 0.8}}}  # fmt: skip
    found = trial_of("made_up", {"kind": "single", "stream": 0, "effects": [effect]}, told, [0.05])
    assert found.strength_found == pytest.approx(0.75)
    assert score([found])["strength"] == pytest.approx([0.75] * 3)
    assert trial("single", ("solar_gain",), answer("named", "solar_gain")).strength_found is None
    # a meter that reads a fifth too little misses a quarter of what it reads
    told = answer("named", "flow_gain")
    told["which"][0]["parameters"] = {"flow_gain@A": {"value": 0.25}}
    effect |= {"name": "flow_gain", "answers": ["flow_gain"], "parameters": {"gain": -0.2}}
    found = trial_of("made_up", {"kind": "single", "stream": 0, "effects": [effect]}, told, [0.05])
    assert found.strength_found == pytest.approx(1.0)
