"""Members of a group: the effects that a diagnosis cannot tell apart, each with a model that explains the past."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration.diagnosis.decide.levels import IN_SET
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings
from thermal.case.case import Case, local_timestamp
from thermal.effects.catalogue import CATALOGUE, like
from thermal.errors import ModelError

#: Evaluations of the fit of a member: it starts at the best one's parameters.
_EVALUATIONS = 10

#: Least weight of a member's probability [-]: a group says that its members cannot be told apart, however sure the
#: first of it looks; the same from which an effect belongs to the 90 % set.
_LEAST = IN_SET


@dataclass(frozen=True)
class Question:
    """What an experiment has to answer: which one of some effects is there.

    Parameters
    ----------
    members : mapping of str to tuple of str
        Effects that cannot be told apart, each with its zones; none is the whole building.
    known : mapping of str to tuple of str
        Effects that are in the model whichever of them it is.
    tuned, judged : tuple of Interval
        Where models were fitted and judged.
    prior : mapping of str to float
        Probability of each member before the experiment; they sum to 1 [-].
    """

    members: Mapping[str, tuple[str, ...]]
    known: Mapping[str, tuple[str, ...]]
    tuned: tuple[Interval, ...]
    judged: tuple[Interval, ...]
    prior: Mapping[str, float]


@dataclass(frozen=True)
class Member:
    """An effect of a group and the model with it.

    Parameters
    ----------
    effect : str
        Its id.
    zones : tuple of str
        Where; empty for the whole building.
    fit : Fit
        The model, fitted to the telemetry.
    """

    effect: str
    zones: tuple[str, ...]
    fit: Fit


def question_of(case: Case, diagnosis: Mapping[str, Any], members: Sequence[str] = ()) -> Question:
    """Read from a diagnosis what an experiment has to answer.

    Parameters
    ----------
    case : Case
        That was diagnosed.
    diagnosis : mapping
        Contents of ``diagnosis.json``.
    members : sequence of str
        Effects to tell apart; by default the group of the first one, or where it has none, what is as probable as
        belongs to the 90 % set.

    Raises
    ------
    CalibrationError
        When the diagnosis is not one of this case, or leaves no choice between two effects.
    """
    try:
        which = {str(entry["effect"]): entry for entry in diagnosis["which"]}
        name, first = diagnosis["case"], diagnosis["which"][0]
        tuned, judged = (
            tuple(Interval(*(local_timestamp(i[end], case.building) for end in ("start", "end"))) for i in found)
            for found in (diagnosis["intervals"][key] for key in ("tuning", "held_out"))
        )
        accepted = [str(step["effects"][-1]) for step in diagnosis["how_far"] if step["effects"]]
    except (KeyError, IndexError, TypeError, AttributeError) as error:
        raise CalibrationError("diagnosis", "what `buildingmpc diagnose` writes", f"{error!r} is missing") from error
    same = name == case.building.name
    CalibrationError.unless(same, "diagnosis", f"one of the case {case.building.name!r}", f"one of {name!r}")
    for effect in members:
        known = effect in CATALOGUE and which.get(effect, {}).get("testable", False)
        CalibrationError.unless(known, "members", "effects that the case can tell", f"{effect!r}; {like(effect)}")
    likely = [e for e, entry in which.items() if entry["probability"] >= IN_SET and entry["testable"]]
    group = [e for e in first["group"] if e in CATALOGUE]
    chosen = list(dict.fromkeys(members)) or (group if len(group) > 1 else likely)
    if len(chosen) < 2:
        found = f"the verdict {diagnosis.get('verdict')!r} with {first['effect']} alone"
        raise CalibrationError("diagnosis", "two effects or more that cannot be told apart", found, "name --members")
    zones = tuple(first["zones"])
    where = {e: tuple(which[e]["zones"]) or (zones if CATALOGUE[e].zonal else ()) for e in chosen}
    kept = {e: tuple(which[e]["zones"]) for e in accepted if e in which and e not in chosen}
    weight = {e: max(float(which[e]["probability"]), _LEAST) for e in chosen}
    prior = {e: w / sum(weight.values()) for e, w in weight.items()}
    return Question(
        {e: _inside(e, z, case) for e, z in where.items()}, {e: _inside(e, z, case) for e, z in kept.items()},
        tuned, judged, prior,
    )  # fmt: skip


def read_experiment(path: Path, case: Case) -> tuple[Question, Interval, float]:
    """Read what an experiment was to answer, when it was, and the odds from which one is named.

    Parameters
    ----------
    path : Path
        ``experiment.json``.
    case : Case
        Telemetry that holds it.

    Raises
    ------
    CalibrationError
        When the file is not what `buildingmpc experiment` writes for this case.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        name, odds = content["case"], float(content["odds"])
        where = {e: tuple(map(str, entry["zones"])) for e, entry in content["members"].items()}
        known = {e: tuple(map(str, zones)) for e, zones in content["known"].items()}
        parts = [
            tuple(Interval(*(local_timestamp(i[end], case.building) for end in ("start", "end"))) for i in found)
            for found in (*(content["intervals"][key] for key in ("tuning", "held_out")), [content])
        ]
        prior = {e: float(content["prior"][e]) for e in where}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        expected = "experiment.json as `buildingmpc experiment` writes it"
        raise CalibrationError(str(path), expected, repr(error)) from error
    same = name == case.building.name
    CalibrationError.unless(same, str(path), f"an experiment for {case.building.name!r}", f"one for {name!r}")
    return Question(where, known, parts[0], parts[1], prior), parts[2][0], odds


def _inside(effect: str, zones: tuple[str, ...], case: Case) -> tuple[str, ...]:
    """Zones of an effect: none where it cannot be in some only."""
    return tuple(z for z in case.building.zone_names if z in zones) if CATALOGUE[effect].zonal else ()


def comparison(
    case: Case, question: Question, settings: ModelSettings, further: Sequence[Interval] = ()
) -> ModelComparison:
    """Give what fits the members' models.

    Parameters
    ----------
    case : Case
        Building and telemetry.
    question : Question
        With the intervals.
    settings : ModelSettings
        Of the baseline.
    further : sequence of Interval
        To be fitted too, such as an experiment.
    """
    plain = replace(settings, effects={}, normalisation=None)
    return ModelComparison(case, plain, (*question.tuned, *further), question.judged)


def fit_members(
    models: ModelComparison, question: Question, starts: Mapping[str, Mapping[str, float]] | None = None
) -> list[Member]:
    """Fit the model of each member to the telemetry.

    Parameters
    ----------
    models : ModelComparison
        The case.
    question : Question
        The members.
    starts : mapping of str to mapping of str to float
        Where the fit of a member begins, by name [parameter units]; a fit without any of them by default.

    Raises
    ------
    CalibrationError
        When fewer than two of them can be fitted.
    """
    found: list[Member] = []
    common = None if starts else models.fit(question.known, [{}]).values
    for effect, zones in question.members.items():
        begin = dict((starts or {}).get(effect, common or {}))
        try:
            fit = models.fit({**question.known, effect: zones}, [begin], evaluations=_EVALUATIONS)
        except (ArithmeticError, np.linalg.LinAlgError, ModelError):
            continue
        found.append(Member(effect, zones, fit))
    several = len(found) > 1 or bool(starts)
    CalibrationError.unless(several, "members", "two models that can be fitted", [m.effect for m in found])
    return found


def midnight_after(case: Case) -> pd.Timestamp:
    """First local midnight at or after the end of the telemetry.

    Parameters
    ----------
    case : Case
        With telemetry.
    """
    last = case.stamps[-1]
    day = last.normalize()
    return day if day == last else day + pd.DateOffset(days=1)
