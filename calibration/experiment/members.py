"""Members of a group: the effects that a diagnosis cannot tell apart, each with a model that explains the past."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from calibration.diagnosis.decide.levels import IN_SET
from calibration.diagnosis.known import reasons_of
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings, read_settings
from thermal.case.case import Case, local_timestamp
from thermal.effects.catalogue import CATALOGUE, like
from thermal.errors import ModelError

#: Evaluations of the fit of a member: it starts at the best one's parameters.
_EVALUATIONS = 10

#: Least weight of a member's probability [-]: a group says that its members cannot be told apart, however sure the
#: first of it looks; the same from which an effect belongs to the 90 % set.
_LEAST = IN_SET

#: What reading a file raises that is not as it was written.
_MALFORMED = (KeyError, IndexError, TypeError, ValueError, AttributeError)


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


@dataclass(frozen=True)
class Planned:
    """What ``experiment.json`` says of an experiment.

    Parameters
    ----------
    question : Question
        What it was to answer.
    interval : Interval
        When it was.
    odds : float
        From which one is named [-].
    model : ModelSettings
        Of the models that it was designed with.
    """

    question: Question
    interval: Interval
    odds: float
    model: ModelSettings


def question_of(
    case: Case, diagnosis: Mapping[str, Any], members: Sequence[str] = (),
    known: Mapping[str, Sequence[str]] | None = None,
) -> Question:  # fmt: skip
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
    known : mapping of str to sequence of str, optional
        Effects in the diagnosis' final model, with their zones: those that are no members stay in it.

    Raises
    ------
    CalibrationError
        When the diagnosis is not one of this case, has found no gap, or leaves no choice between two effects.
    """
    where = "diagnosis"
    try:
        which = {str(entry["effect"]): _entry(entry) for entry in diagnosis["which"]}
        name, (first, *_) = diagnosis["case"], which
        group = _names(diagnosis["which"][0]["group"])
        parts = diagnosis["intervals"]
        tuned, judged = (_intervals(parts[key], key, case) for key in ("tuning", "held_out"))
        accepted = [_names(step["effects"])[-1] for step in diagnosis["how_far"] if step["effects"]]
    except _MALFORMED as error:
        raise CalibrationError(where, "what `buildingmpc diagnose` writes", _wrong(error)) from error
    same = name == case.building.name
    CalibrationError.unless(same, where, f"one of the case {case.building.name!r}", f"one of {name!r}")
    for effect in members:
        tells = effect in CATALOGUE and effect in which and which[effect].testable
        CalibrationError.unless(tells, "members", "effects that the case can tell", f"{effect!r}; {like(effect)}")
    chosen = list(dict.fromkeys(members))
    if members:
        CalibrationError.unless(len(chosen) > 1, "members", "two different effects or more", ", ".join(members))
    else:
        gap = diagnosis.get("verdict") != "no_gap"
        CalibrationError.unless(gap, where, "one that found a gap", "the verdict 'no_gap'", "else name --members")
        likely = [e for e, entry in which.items() if entry.probability >= IN_SET and entry.testable]
        chosen = list(group) if len(group) > 1 else likely
    if len(chosen) < 2:
        found = f"the verdict {diagnosis.get('verdict')!r} with {first} alone"
        raise CalibrationError(where, "two effects or more that cannot be told apart", found, "name --members")
    for effect in chosen:
        advice = like(effect) if effect not in CATALOGUE else ""
        there = effect in CATALOGUE and effect in which
        CalibrationError.unless(there, where, "a group of effects that it lists", repr(effect), advice)
    asked = {e: which[e].zones or (which[first].zones if CATALOGUE[e].zonal else ()) for e in chosen}
    kept = {e: tuple(zones) for e, zones in (known or {}).items()} | {e: which[e].zones for e in accepted if e in which}
    weight = {e: max(which[e].probability, _LEAST) for e in chosen}
    return Question(
        {e: _inside(e, z, case, where) for e, z in asked.items()},
        {e: _inside(e, z, case, where) for e, z in kept.items() if e in CATALOGUE and e not in chosen},
        tuned, judged, {e: w / sum(weight.values()) for e, w in weight.items()},
    )  # fmt: skip


def read_experiment(path: Path, case: Case) -> Planned:
    """Read what an experiment was to answer, when it was, and what it was designed with.

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
    expected = "experiment.json as `buildingmpc experiment` writes it"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        name, odds = content["case"], float(content["odds"])
        members = {e: _names(entry["zones"]) for e, entry in content["members"].items()}
        known = {e: _names(zones) for e, zones in content["known"].items()}
        tuned, judged = (_intervals(content["intervals"][key], key, case) for key in ("tuning", "held_out"))
        when = Interval(*(local_timestamp(content[end], case.building) for end in ("start", "end")))
        prior = {e: _share(content["prior"][e]) for e in members}
        content["settings"]["dx"]
    except (OSError, *_MALFORMED) as error:
        raise CalibrationError(str(path), expected, _wrong(error)) from error
    same = name == case.building.name
    CalibrationError.unless(same, str(path), f"an experiment for {case.building.name!r}", f"one for {name!r}")
    CalibrationError.unless(1.0 < odds < np.inf, f"{path}: odds", "a number above 1", odds)
    CalibrationError.unless(len(members) > 1, f"{path}: members", "two effects or more", list(members))
    for effect in (*members, *known):
        CalibrationError.unless(effect in CATALOGUE, str(path), "effects of the catalogue", repr(effect), like(effect))
    where, kept = ({e: _inside(e, z, case, str(path)) for e, z in zones.items()} for zones in (members, known))
    return Planned(Question(where, kept, tuned, judged, prior), when, odds, ModelSettings(**read_settings(path)))


def without(question: Question, known: Sequence[str], ruled_out: Sequence[str]) -> Question:
    """Ask again once somebody knows of some effects that they are there, or that they are not.

    Parameters
    ----------
    question : Question
        As it was asked.
    known, ruled_out : sequence of str
        As in `diagnose`.

    Raises
    ------
    CalibrationError
        When fewer than two members are left.
    """
    told = reasons_of(known, ruled_out)
    members = {e: z for e, z in question.members.items() if e not in told}
    advice = "it has nothing left to tell: diagnose without it"
    expected = "two effects or more that are neither known nor ruled out"
    CalibrationError.unless(len(members) > 1, "members of the experiment", expected, list(members) or "none", advice)
    whole = sum(question.prior[e] for e in members)
    kept = {e: () for e in known} | {e: z for e, z in question.known.items() if e not in ruled_out}
    prior = {e: question.prior[e] / whole if whole > 0.0 else 1.0 / len(members) for e in members}
    return replace(question, members=members, known=kept, prior=prior)


class _Entry(NamedTuple):
    """What a diagnosis says of an effect."""

    probability: float
    zones: tuple[str, ...]
    testable: bool


def _entry(entry: Mapping[str, Any]) -> _Entry:
    return _Entry(_share(entry["probability"]), _names(entry["zones"]), bool(entry["testable"]))


def _share(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= 1.0 + 1e-9:
        raise ValueError(f"the probability {value!r}")
    return float(value)


def _names(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list | tuple) or not all(isinstance(name, str) for name in value):
        raise TypeError(f"{value!r} where a list of names is expected")
    return tuple(value)


def _intervals(found: Sequence[Mapping[str, Any]], key: str, case: Case) -> tuple[Interval, ...]:
    """Read intervals, each with telemetry in it."""
    parts = tuple(Interval(*(local_timestamp(i[end], case.building) for end in ("start", "end"))) for i in found)
    CalibrationError.unless(parts, f"intervals: {key}", "one or more", "none")
    first, last = case.stamps[0], case.stamps[-1]
    for part in parts:
        there = part.start <= last and part.end >= first
        expected = f"some of the telemetry, {first} to {last}"
        CalibrationError.unless(there, f"intervals: {key}", expected, f"{part.start} to {part.end}")
    return parts


def _wrong(error: Exception) -> str:
    """Say what is wrong with a file, in words."""
    return f"no {error.args[0]!r}" if isinstance(error, KeyError) else str(error) or type(error).__name__


def _inside(effect: str, zones: tuple[str, ...], case: Case, where: str) -> tuple[str, ...]:
    """Zones of an effect, as the case orders them: none where it cannot be in some only."""
    there = case.building.zone_names
    for zone in zones:
        CalibrationError.unless_known(zone, there, f"{where}: zones of {effect}", "zones of the case")
    return tuple(z for z in there if z in zones) if CATALOGUE[effect].takes_zones else ()


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
