"""Blind trials by world: rates of each, and every failure with what is wrong."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest


@pytest.fixture(scope="module")
def worlds(script: Callable[[str], ModuleType], package: Callable[[str], ModuleType]) -> ModuleType:
    package("energyplus_trials.drawing")
    for name in ("_table", "_code", "_seeds", "_trial_scores", "_trial_answers", "_leave_one_out", "spoilt_buildings"):
        script(name)
    return script("_trial_worlds")


def seal(out: Path, name: str, world: str, effect: str | None, verdict: str, first: str, mae: float = 0.3) -> None:
    """Write label and answer of a trial; `first` may be a group, the best guess before the others."""
    effects = [] if effect is None else [
        {"name": effect, "answers": [effect], "strength": 1.0, "zones": [], "unexplained_is_right": False}
    ]  # fmt: skip
    label = {
        "world": world, "building": "hut", "stream": 0, "seed": 0, "kind": "single" if effect else "null",
        "twins": ["twin"] if effect else [], "effects": effects,
    }  # fmt: skip
    group = first.split()
    which = [{"effect": e, "probability": 0.9, "group": group, "zones": [], "testable": True} for e in group]
    answer: dict[str, Any] = {
        "verdict": verdict, "which": which, "set90": group, "gap": {"mae": mae}, "how_far": [], "seconds": 1.0, "code": "x",
    }  # fmt: skip
    for folder, content in (("sealed", label), ("answers", answer)):
        (out / folder).mkdir(exist_ok=True, parents=True)
        (out / folder / f"{name}.json").write_text(json.dumps(content))


def test_worlds_are_scored_apart_and_each_failure_is_told(worlds, tmp_path):
    one, other = tmp_path / "one", tmp_path / "other"
    seal(one, "twin", "huts", None, "no_gap", "roof_exchange", mae=0.1)
    seal(one, "right", "huts", "solar_gain", "named", "solar_gain")
    seal(one, "second", "huts", "solar_gain", "group", "infiltration solar_gain")
    seal(one, "hidden", "huts", "solar_gain", "no_gap", "infiltration", mae=0.12)
    seal(other, "twin", "tents", None, "named", "flow_gain", mae=0.1)
    seal(other, "wrong", "tents", "solar_gain", "named", "flow_gain")
    seal(other, "silent", "tents", "solar_gain", "unexplained", "solar_gain")
    page = worlds.report_worlds([one, other], published=False)
    head, huts, tents, both = page.splitlines()[0], *(
        next(line for line in page.splitlines() if line.startswith(f"| {name} |")) for name in ("huts", "tents", "all")
    )  # fmt: skip
    assert head.startswith("7 trials of development seeds, method x; 1 whose effects leave no gap")
    assert "0% (0 of 1;" in huts and "50% (1 of 2;" in huts and "100% (2 of 2;" in huts
    assert "100% (1 of 1;" in tents and "50% (1 of 2;" in both.split("|")[2]
    wrong = {line.split(" | ")[2]: line.split(" | ")[-1].strip(" |") for line in page.splitlines()[-4:]}
    assert wrong == {
        "second": "in the group, not first", "twin": "named", "wrong": "wrong name", "silent": "abstained, right first"
    }  # fmt: skip
    assert json.loads((one / "blind_trials_worlds.json").read_text())["huts"]["rates"]["right group"]["hits"] == 2


def test_a_folder_without_answers_is_told(worlds, tmp_path):
    with pytest.raises(SystemExit, match="expected answered trials, found none"):
        worlds.report_worlds([tmp_path], published=False)


def test_levels_are_chosen_on_the_other_worlds_and_faults_keep_their_names(worlds):
    """Of two worlds one leaves 0.25 K in nulls, where nothing is missing, and the other 0.1 K."""
    from _leave_one_out import choose, judged, leave_one_out
    from _trial_scores import Trial

    from calibration.diagnosis.decide.levels import LEVELS
    from calibration.diagnosis.decide.name import Summary

    def trial(world: str, left: float, verdict: str | None = None) -> Trial:
        told = Summary(False, 0, 0.0, 0.0, left, 1.0, 1.0, 0.0, 0.0)
        which = [{"effect": "solar_gain", "probability": 0.0, "group": ["solar_gain"], "zones": [], "testable": True}]
        answer = {"verdict": verdict or told.name(), "summary": told.to_dict(), "which": which, "set90": [],
                  "gap": {"mae": left}, "how_far": [], "seconds": 1.0}  # fmt: skip
        return Trial(f"{world} {left}", "null", (), (), 0.0, frozenset(), False, (), answer, world=world)

    loud = [trial("loud", left) for left in (0.23, 0.25, 0.26)]
    quiet = [trial("quiet", 0.1)]
    folds = {f.world: f for f in leave_one_out([*loud, *quiet])}
    assert folds["loud"].levels == LEVELS and folds["loud"].chosen["rates"]["nulls unexplained"].hits == 3
    assert folds["quiet"].levels.left_over > 0.26 and set(folds["quiet"].moved) == {"left_over"}
    assert judged(loud[0], folds["quiet"].levels).answer["verdict"] == "no_gap"
    named = trial("loud", 0.3, verdict="named")  # by a fault of the telemetry
    assert judged(named, choose([loud])).answer["verdict"] == "named"
    assert leave_one_out(loud) == []
