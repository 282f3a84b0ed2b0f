"""What an experiment says: the odds between a group's members after it, and the diagnosis that goes on from it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from calibration.diagnosis.decide.levels import TEMPERATURE
from calibration.diagnosis.decide.name import VerdictName
from calibration.diagnosis.decide.verdict import Candidate, Verdict
from calibration.diagnosis.diagnosis import Diagnosis, diagnose
from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings
from calibration.experiment.members import Question, comparison, fit_members, without
from calibration.experiment.odds import ODDS, needed
from calibration.progress import Progress
from thermal.case.case import Case


@dataclass(frozen=True)
class Outcome:
    """What an experiment says of the members of a group.

    Parameters
    ----------
    evidence : mapping of str to float
        Logarithm of the marginal likelihood of the experiment's errors given those before it, by effect, but for a
        constant [-].
    before : mapping of str to float
        The same of the errors before it [-].
    odds : float
        From which one is named [-].
    interval : Interval
        Of the experiment.
    """

    evidence: Mapping[str, float]
    before: Mapping[str, float]
    odds: float
    interval: Interval

    @property
    def ranked(self) -> tuple[str, ...]:
        """Members, the likeliest by the experiment first."""
        return tuple(sorted(self.evidence, key=lambda e: -self.evidence[e]))

    @property
    def log_odds(self) -> float:
        """Logarithm of the Bayes factor of the likeliest against the next, by the experiment alone [-]."""
        first, second = self.ranked[:2]
        return self.evidence[first] - self.evidence[second]

    @property
    def probability(self) -> dict[str, float]:
        """Probability of each member where all were as likely before the experiment [-]."""
        top = max(self.evidence.values())
        weight = {e: float(np.exp((v - top) / TEMPERATURE)) for e, v in self.evidence.items()}
        return {e: w / sum(weight.values()) for e, w in weight.items()}

    @property
    def named(self) -> str | None:
        """The member that the experiment tells from all others, and that is not less likely by all telemetry."""
        first = self.ranked[0]
        whole = {e: v + self.before[e] for e, v in self.evidence.items()}
        agrees = whole[first] >= max(whole.values()) - 1e-9
        return first if agrees and self.log_odds >= needed(self.odds) else None

    def to_dict(self) -> dict[str, Any]:
        """Entry ``experiment`` in ``diagnosis.json``, and ``outcome`` in ``experiment.json``."""
        ends = {"start": self.interval.start.isoformat(), "end": self.interval.end.isoformat()}
        return {
            "named": self.named, "probability": self.probability, "log_odds": self.log_odds,
            "log_odds_needed": needed(self.odds), "evidence": dict(self.evidence), "before": dict(self.before),
            "odds": self.odds, "interval": ends,
        }  # fmt: skip


def weigh_experiment(
    case: Case, question: Question, interval: Interval, model: ModelSettings | None = None, odds: float = ODDS
) -> Outcome:
    """Say what an experiment's telemetry says of the members of a group.

    Each member's model is fitted to the telemetry before the experiment, and again with it; what the logarithm of its
    marginal likelihood changes by is that of the experiment given the past. Members differ in it by the logarithm of
    their Bayes factor.

    Parameters
    ----------
    case : Case
        Telemetry that holds the experiment.
    question : Question
        The members, and the intervals before it.
    interval : Interval
        Of the experiment.
    model : ModelSettings, optional
        Of the baseline.
    odds : float
        From which one is named [-].

    Raises
    ------
    CalibrationError
        When the telemetry does not hold the experiment.
    """
    _check_held(case, interval)
    settings = model or ModelSettings()
    past = fit_members(comparison(case, question, settings), question)
    starts = {m.effect: m.fit.values for m in past}
    both = fit_members(comparison(case, question, settings, [interval]), question, starts)
    before = {m.effect: m.fit.evidence for m in past}
    after = {m.effect: m.fit.evidence for m in both if m.effect in before}
    CalibrationError.unless(len(after) > 1, "members", "two models that can be fitted", list(after))
    return Outcome({e: v - before[e] for e, v in after.items()}, {e: before[e] for e in after}, odds, interval)


def _check_held(case: Case, interval: Interval) -> None:
    """Refuse telemetry that does not hold an experiment."""
    held = case.stamps[0] <= interval.start and interval.end <= case.stamps[-1]
    found = f"{case.stamps[0]} to {case.stamps[-1]}"
    CalibrationError.unless(held, "experiment", f"telemetry from {interval.start} to {interval.end}", found)


def narrowed(verdict: Verdict, outcome: Outcome) -> Verdict:
    """Let an experiment say which of a group is there.

    Where what comes first is one of its members and the experiment names one of them, that one comes first and has no
    group with the others, whose probability is what the experiment leaves them.

    Parameters
    ----------
    verdict : Verdict
        Of a diagnosis of telemetry with the experiment.
    outcome : Outcome
        Of the experiment.
    """
    first, named = verdict.candidates[0], outcome.named
    if named is None or first.effect not in outcome.evidence or verdict.name not in ("named", "group"):
        return verdict
    share, whole = outcome.probability, first.probability

    def judged(c: Candidate) -> Candidate:
        if c.effect not in share:
            return replace(c, group=tuple(e for e in c.group if e not in share)) if c.effect != named else c
        group = tuple(e for e in c.group if e == c.effect or (c.effect == named and e not in share))
        return replace(c, probability=whole * share[c.effect], group=group)

    moved = [judged(c) for c in verdict.candidates]
    order = sorted(moved, key=lambda c: (c.effect != named, -c.probability if c.effect in share else 0.0))
    head = order[0]
    rest = [c for c in moved if c.effect != named]
    name: VerdictName = "named" if len(head.group) == 1 else "group"
    set90 = tuple(e for e in verdict.set90 if e == named or e not in share)
    return replace(verdict, name=name, candidates=(head, *rest), set90=set90 if named in set90 else (named, *set90))


def diagnose_further(
    case: Case, question: Question, interval: Interval, model: ModelSettings | None = None, odds: float = ODDS,
    known: Sequence[str] = (), ruled_out: Sequence[str] = (), progress: Progress | None = None,
) -> tuple[Diagnosis, Outcome]:  # fmt: skip
    """Diagnose a case whose telemetry holds an experiment: its days tune too, and it says which of the group is there.

    Parameters
    ----------
    case : Case
        Telemetry that holds the experiment.
    question : Question
        What it was to answer.
    interval : Interval
        Of the experiment.
    model : ModelSettings, optional
        Of the baseline.
    odds : float
        From which one of the group is named [-].
    known, ruled_out : sequence of str
        As in `diagnose`; those that are known are in the models of all members, and neither is a member any more.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    CalibrationError
        When the telemetry does not hold the experiment, or fewer than two members are left.
    """
    settings = model or ModelSettings()
    _check_held(case, interval)
    question = without(question, known, ruled_out)
    apart = [
        i if i.end < interval.start else replace(i, end=interval.start - pd.Timedelta(seconds=case.step))
        for i in question.judged
    ]
    found = diagnose(
        case, (*question.tuned, interval), apart, dx=settings.dx, known=known, ruled_out=ruled_out,
        progress=progress,
    )  # fmt: skip
    outcome = weigh_experiment(case, question, interval, settings, odds)
    return replace(found, verdict=narrowed(found.verdict, outcome)), outcome


def joined(before: pd.DataFrame, after: pd.DataFrame) -> pd.DataFrame:
    """Telemetry of the past and what follows it, in the columns of the past.

    Parameters
    ----------
    before, after : DataFrame
        Telemetry of both [library's units].

    Raises
    ------
    CalibrationError
        When the later telemetry lacks columns of the past.
    """
    lacking = [str(c) for c in before.columns if c not in after.columns]
    advice = "record the same points"
    CalibrationError.unless(not lacking, "telemetry of the experiment", "all points of the case", lacking[:3], advice)
    return pd.concat([before, after.loc[after.index > before.index[-1], before.columns]])
