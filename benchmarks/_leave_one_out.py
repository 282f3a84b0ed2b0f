"""Levels of the verdict chosen on all worlds but one, and what they make of that one.

An answer says what its name follows from, so that other levels need no other diagnosis. Chosen is what costs least, the
mean over worlds of the cost of a trial, one level after another; what costs the same stays as it is shipped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np
from _trial_scores import Trial, score

from calibration.diagnosis.decide.levels import LEVELS, Levels
from calibration.diagnosis.decide.name import Summary

#: Multiples of a shipped level that are tried [-].
_TRIED = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0)

#: Cost of a cause that is named and not there, and of an answer that is withheld [-]: as 8 % to 3 %, the rates of nulls
#: that may be left unexplained and named.
_WRONG, _WITHHELD = 1.0, 3.0 / 8.0

#: Times that every level is chosen anew.
_SWEEPS = 2


@dataclass(frozen=True)
class Fold:
    """One world, by levels that were chosen on the others.

    Parameters
    ----------
    world : str
        What was left out.
    levels : Levels
        Chosen on the others.
    chosen : dict
        As `score` gives it for this world by these levels.
    """

    world: str
    levels: Levels
    chosen: dict[str, Any]

    @property
    def moved(self) -> dict[str, float]:
        """Levels that are not the shipped ones."""
        return {name: value for name, value in asdict(self.levels).items() if value != getattr(LEVELS, name)}


def leave_one_out(trials: Sequence[Trial]) -> list[Fold]:
    """Choose levels without each world, and score it by them; nothing where there is one world only.

    Parameters
    ----------
    trials : sequence of Trial
        With their answers.
    """
    worlds = {w: [t for t in trials if t.world == w] for w in sorted({t.world for t in trials})}
    if len(worlds) < 2:
        return []
    folds = []
    for left_out, own in worlds.items():
        levels = choose([others for w, others in worlds.items() if w != left_out])
        folds.append(Fold(left_out, levels, score([judged(t, levels) for t in own])))
    return folds


def choose(worlds: Sequence[Sequence[Trial]]) -> Levels:
    """Choose the levels that cost least.

    Parameters
    ----------
    worlds : sequence of sequence of Trial
        Trials of each world.
    """
    levels, least = LEVELS, _cost(worlds, LEVELS)
    for _ in range(_SWEEPS):
        for field in fields(Levels):
            for factor in _TRIED:
                value = getattr(LEVELS, field.name) * factor
                tried = replace(levels, **{field.name: min(value, 0.95) if "explained" in field.name else value})
                cost = _cost(worlds, tried)
                if cost < least - 1e-12:
                    levels, least = tried, cost
    return levels


def judged(trial: Trial, levels: Levels) -> Trial:
    """Give a trial the name that its answer has by other levels.

    Faults of the telemetry and gains that recur have names that do not follow from levels: these stay.

    Parameters
    ----------
    trial : Trial
        With its answer.
    levels : Levels
        Those to judge by.
    """
    told = trial.answer.get("summary")
    if told is None:
        return trial
    summary = Summary(**told)
    if trial.answer["verdict"] != summary.name():
        return trial
    return replace(trial, answer={**trial.answer, "verdict": summary.name(levels)})


def _cost(worlds: Sequence[Sequence[Trial]], levels: Levels) -> float:
    return float(np.mean([np.mean([_cost_of(judged(t, levels)) for t in trials]) for trials in worlds]))


def _cost_of(t: Trial) -> float:
    verdict = t.answer["verdict"]
    if t.kind == "null" or not t.counted:
        return _WRONG * (t.wrong_name or (t.kind == "null" and t.named)) + _WITHHELD * (verdict == "unexplained")
    if verdict == "unexplained" and t.unexplained_is_right:
        return 0.0
    return _WRONG if t.wrong_name else 0.0 if t.named else _WITHHELD
