"""Which effect: evidence of each, probabilities, groups that cannot be told apart, and the verdict."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from calibration.diagnosis.decide import levels
from calibration.diagnosis.decide.name import Summary, VerdictName
from calibration.diagnosis.refit.refit import Refit, promising
from calibration.diagnosis.refit.search import Round, accepted_from
from calibration.diagnosis.screen.gains import Gain
from calibration.diagnosis.screen.regular import Regular
from thermal.effects.catalogue import CATALOGUE
from thermal.effects.effect import ALIKE

#: Standard deviations from the estimate to an end of a 90 % interval [-].
_NINETY = 1.645


class Estimate(NamedTuple):
    """Estimate of a parameter.

    Parameters
    ----------
    value : float
        Estimate [parameter units].
    unit : str
        Its unit.
    interval : tuple of float
        90 % interval [parameter units].
    """

    value: float
    unit: str
    interval: tuple[float, float]


@dataclass(frozen=True)
class Candidate:
    """One effect of the catalogue, as a case sees it.

    Parameters
    ----------
    effect : str
        Its id.
    probability : float
        That it is there [-].
    score : float
        Largest logarithm of a Bayes factor that it reached in any round, fitted or by tangents [-].
    group : tuple of str
        What cannot be told from it on this data, itself included.
    zones : tuple of str
        Where; empty for the whole building.
    parameters : mapping of str to Estimate
        By name.
    retained_share : float
        Share of its signature that calibration cannot imitate [-].
    separate_by : str
        Experiment that would tell it from its group.
    reason : str
        Why the case cannot tell; empty where it can.
    """

    effect: str
    probability: float
    score: float
    group: tuple[str, ...]
    zones: tuple[str, ...]
    parameters: Mapping[str, Estimate]
    retained_share: float
    separate_by: str
    reason: str = ""

    @property
    def testable(self) -> bool:
        """Whether the case can tell."""
        return not self.reason

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``which`` in ``diagnosis.json``."""
        parameters = {name: estimate._asdict() for name, estimate in self.parameters.items()}
        return {**vars(self), "parameters": parameters, "testable": self.testable}


@dataclass(frozen=True)
class Verdict:
    """What a search says.

    Parameters
    ----------
    name : {"no_gap", "named", "group", "unexplained"}
        In a word.
    candidates : tuple of Candidate
        Every effect of the catalogue, the likeliest first.
    set90 : tuple of str
        Effects that hold all present ones with 90 % probability; empty when the answer may be none.
    combinations : mapping of tuple of str to float
        Probability that the effects up to a round are all there are, in the order of the rounds; sums to 1 [-].
    summary : Summary, optional
        What the name follows from, but for faults of the telemetry and gains that recur.
    """

    name: VerdictName
    candidates: tuple[Candidate, ...]
    set90: tuple[str, ...]
    combinations: Mapping[tuple[str, ...], float]
    summary: Summary | None = None


def judge(rounds: Sequence[Round], untestable: Mapping[str, str], left_over: Regular | None = None) -> Verdict:
    """Judge what the rounds of a search found.

    Parameters
    ----------
    rounds : sequence of Round
        Of the search.
    untestable : mapping of str to str
        Effects that the case cannot tell, with the reason.
    left_over : Regular, optional
        What comes back of the errors of the last model, where that says whether something is left over; their size by
        default.
    """
    probability: dict[str, float] = dict.fromkeys(CATALOGUE, 0.0)
    score: dict[str, float] = dict.fromkeys(CATALOGUE, -np.inf)
    best: dict[str, Gain | Refit] = {}
    real = 1.0  # that all rounds before found something that is there
    last = beyond(rounds[-1])
    chain: list[tuple[tuple[str, ...], float]] = []
    for r in rounds:
        gains = gains_of(r)
        found, none = probabilities(levelled(r), accepted_from(r.own))
        for effect, gain in gains.items():
            probability[effect] = max(probability[effect], real * found[effect])
            if gain > score[effect]:
                score[effect] = gain
                best[effect] = _source(r, effect)
        if r.accepted is not None:
            chain.append((tuple(r.before.effects), real * none))
            real *= 1.0 - none
    chain.append((tuple(rounds[-1].after.effects), real))
    summary = summarised(rounds, left_over)
    name = summary.name()
    if name == "unexplained" and chain[1:]:  # what explains a part only is there with no more than that probability
        share = float(np.clip(summary.explained(), 0.0, 1.0))
        probability = {e: share * p for e, p in probability.items()}
    first = [r.accepted.screened.effect for r in rounds if r.accepted is not None and name in ("named", "group")]
    candidates = sorted(
        (_candidate(e, probability[e], score[e], best.get(e), rounds, untestable.get(e, "")) for e in CATALOGUE),
        key=lambda s: (
            first.index(s.effect) if s.effect in first else len(first),  # what is named, as it was found
            -s.probability, -last.get(s.effect, -np.inf), -s.score,
        ),
    )  # fmt: skip
    set90 = _inside(rounds, candidates) if name in ("named", "group") else ()
    return Verdict(name, tuple(candidates), set90, dict(chain), summary)


def doubted(verdict: Verdict, effects: Collection[str]) -> Verdict:
    """Cap the probability of effects whose signals explain as much on other days, or that do not repeat.

    Parameters
    ----------
    verdict : Verdict
        From `judge`.
    effects : collection of str
        Whose tests are void.
    """
    capped = (
        replace(c, probability=min(c.probability, levels.VOID)) if c.effect in effects else c
        for c in verdict.candidates
    )
    return replace(verdict, candidates=tuple(capped))


def _inside(rounds: Sequence[Round], candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Effects of the 90 % set: those that are likely enough, and what cannot be told from one that was accepted."""
    alike = {e for r in rounds if r.accepted is not None for e in group_of(r, r.accepted.screened.effect)}
    return tuple(s.effect for s in candidates if s.probability >= levels.IN_SET or s.effect in alike)


def group_of(r: Round, effect: str) -> tuple[str, ...]:
    """Effects of a round that cannot be told from one of them, itself first.

    Parameters
    ----------
    r : Round
        Of the search.
    effect : str
        Its id.
    """
    gains = raw(r)
    own = next((g for g in r.gains if g.effect == effect), None)
    alike = [effect]
    level = accepted_from(r.own)
    if gains[effect] <= level:  # what hardly gains is not there, whatever else looks like it
        return (effect,)
    for g in r.gains:
        if g.effect == effect:
            continue
        near = abs(gains[g.effect] - gains[effect]) < levels.APART
        rival = gains[g.effect] > max(level, levels.RIVAL * gains[effect]) and (
            (own is not None and abs(r.screening.cosine(own, g)) > levels.ALIKE)
            or g.effect in CATALOGUE[effect].confounders
        )
        if near or rival:
            alike.append(g.effect)
    return tuple(alike)


def summarised(rounds: Sequence[Round], left_over: Regular | None = None) -> Summary:
    """Summarise what the name of a verdict follows from.

    Parameters
    ----------
    rounds, left_over
        As in `judge`.
    """
    first, last, fit = rounds[0], rounds[-1], rounds[-1].after
    before, after = first.before.found.mean_square, fit.found.mean_square
    back = found = None
    if left_over is not None:
        back = left_over.counts
        found = (before - after) / max(before - after + left_over.explains * back, 1e-12)
    group = () if first.accepted is None else group_of(first, first.accepted.screened.effect)
    zones = fit.by_zone[fit.by_zone > 0.0]
    return Summary(
        first.accepted is not None, len(group), 1.0 - after / before,
        1.0 - (last.after_held_out.mae / first.held_out.mae) ** 2, float(np.sqrt(after)), fit.change,
        float(zones.max() / zones.mean()), first.generic.gain, first.own.generic_level, back, found,
    )  # fmt: skip


def generic_from(r: Round) -> float:
    """Gain from which heat of any shape says that something is missing [-].

    Parameters
    ----------
    r : Round
        Of the search.
    """
    return max(levels.LEVELS.generic, r.own.generic_level)


def _source(r: Round, effect: str) -> Gain | Refit:
    fitted = next((x for x in r.refits if x.screened.effect == effect), None)
    return fitted or next(g for g in r.gains if g.effect == effect)


def _candidate(
    effect: str, probability: float, score: float, best: Gain | Refit | None, rounds: Sequence[Round], reason: str
) -> Candidate:
    told_by = CATALOGUE[effect].separated_by
    if best is None:
        return Candidate(effect, 0.0, 0.0, (effect,), (), {}, 0.0, told_by, reason)
    gain = best.screened if isinstance(best, Refit) else best
    home = next(r for r in rounds if any(found is best for found in (*r.gains, *r.refits)))
    group = group_of(home, effect)[: levels.LARGEST_GROUP]
    zones = () if gain.zones == ALIKE else best.zones
    return Candidate(effect, probability, score, group, zones, _parameters(best, effect), gain.retained, told_by)


def _parameters(best: Gain | Refit, effect: str) -> dict[str, Estimate]:
    """Estimates of an effect's parameters with 90 % intervals: of the fit, or by tangents where it was not fitted."""
    told = {}
    if isinstance(best, Gain):
        kinds = {p.name: p for p in CATALOGUE[effect].parameters}
        for name, value in best.strengths.items():
            kind, reach = kinds[name.partition("@")[0]], _NINETY * best.deviations[name]
            low, high = (float(np.clip(value + s * reach, kind.lower, kind.upper)) for s in (-1.0, 1.0))
            told[name] = Estimate(value, kind.unit, (low, high))
        return told
    for p, z, spread in zip(best.fit.problem.parameters, best.fit.found.point, best.fit.deviations, strict=True):
        if p.effect == effect and p.name in best.fit.told:
            low, high = (float(np.clip(p.inverse(z + s * _NINETY * spread), p.lower, p.upper)) for s in (-1.0, 1.0))
            told[p.name] = Estimate(float(p.inverse(z)), p.unit, (low, high))
    return told


def gains_of(r: Round) -> dict[str, float]:
    """Gain of every effect of a round: fitted where it was, by tangents otherwise.

    It is little where it does not count, or promises little.

    Parameters
    ----------
    r : Round
        Of the search.
    """
    gains = {g.effect: g.gain if promising(r.before, g.share) else min(g.gain, levels.SMALL) for g in r.gains}
    return gains | {x.screened.effect: _evidence(x) for x in r.refits} | _led(r)


def chance_of(r: Round) -> float:
    """Bound the probability of as large a gain where nothing is missing [-].

    By the case's own nulls, and by what holds for any evidence: a Bayes factor exceeds B with a probability of 1/B at
    most where its denominator is true (Ville 1939, Markov's inequality), with several effects of their number over B.
    The larger of the two counts.

    Parameters
    ----------
    r : Round
        The first of the search.
    """
    gains = gains_of(r)
    most = max(gains.values(), default=0.0)
    return float(max(min(1.0, len(gains) * np.exp(-most)), r.own.p_value(most)))


def levelled(r: Round) -> dict[str, float]:
    """Gains by which probabilities are told: of what does not count, what it gains beyond nulls, and little.

    Parameters
    ----------
    r : Round
        Of the search.
    """
    fitted = {x.screened.effect: x for x in r.refits}
    sure = {e for e, x in fitted.items() if x.counts} | set(_led(r))
    evidence = {e: min(gain, levels.SMALL) for e, gain in beyond(r).items()}
    evidence |= {e: min(evidence[e], levels.DOUBTFUL) for e, x in fitted.items() if x.worse}
    return evidence | {e: gain for e, gain in raw(r).items() if e in sure}


def beyond(r: Round) -> dict[str, float]:
    """Gains; once an effect is in the model, beyond nulls: what it leaves looks like what answers to anything.

    Parameters
    ----------
    r : Round
        Of the search.
    """
    return {e: gain - r.own.usual(e) * bool(r.before.effects) for e, gain in raw(r).items()}


def raw(r: Round) -> dict[str, float]:
    """Gain of every effect of a round, whether it counts or not.

    Parameters
    ----------
    r : Round
        Of the search.
    """
    return {g.effect: g.gain for g in r.gains} | {x.screened.effect: x.gain for x in r.refits} | _led(r)


def _evidence(fitted: Refit) -> float:
    return fitted.gain if fitted.counts else min(fitted.gain, levels.DOUBTFUL if fitted.worse else levels.SMALL)


def _led(r: Round) -> dict[str, float]:
    """Gain of an accepted effect that is not the first by its own.

    Found as one of a pair, it has that of both, less the price of the other; preferred for what it does on held-out
    days, it takes the place of the one that gains more.
    """
    if r.accepted is None:
        return {}
    mine = r.accepted.screened.effect
    if r.pair is not None:
        return {mine: r.pair.gain - accepted_from(r.own)}
    most = max((x for x in r.refits if x.counts), key=lambda x: x.gain, default=r.accepted)
    return {most.screened.effect: r.accepted.gain, mine: most.gain} if most.gain > r.accepted.gain else {}


def probabilities(gains: Mapping[str, float], level: float) -> tuple[dict[str, float], float]:
    """Share of each effect against all others and none, and that of none, whose gain is that at which effects count.

    Parameters
    ----------
    gains : mapping of str to float
        By effect, such as `levelled` [-].
    level : float
        Gain from which an effect is accepted [-].
    """
    top = max([*gains.values(), level])
    weight = {effect: float(np.exp((gain - top) / levels.TEMPERATURE)) for effect, gain in gains.items()}
    none = float(np.exp((level - top) / levels.TEMPERATURE))
    whole = sum(weight.values()) + none
    return {effect: w / whole for effect, w in weight.items()}, none / whole
