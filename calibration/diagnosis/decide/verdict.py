"""Which effect: probabilities, groups that cannot be told apart, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from calibration.diagnosis.decide.evidence import beyond, gains_of, levelled, probabilities, raw
from calibration.diagnosis.decide.levels import (
    ALIKE,
    APART,
    CONCENTRATED,
    EXPLAINED,
    EXPLAINED_OF_MUCH,
    GENERIC_GAP,
    IN_SET,
    LARGEST_GROUP,
    LEFT_IN_A_ZONE,
    LEFT_OF_CHANGE,
    LEFT_OVER,
    RIVAL,
)
from calibration.diagnosis.refit.comparison import Fit
from calibration.diagnosis.refit.refit import ACCEPTED, Refit
from calibration.diagnosis.refit.search import Round
from calibration.diagnosis.screen.gains import Gain
from thermal.effects.catalogue import CATALOGUE

#: Standard deviations from the estimate to an end of a 90 % interval [-].
_NINETY = 1.645

VerdictName = Literal["no_gap", "named", "group", "unexplained"]


@dataclass(frozen=True)
class Suspect:
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
    parameters : mapping of str to (float, str, (float, float))
        Estimate, unit and 90 % interval by name.
    retained_share : float
        Share of its signature that calibration cannot imitate [-].
    separate_by : str
        Experiment that would tell it from its group.
    testable : bool
        Whether the case can tell.
    reason : str
        Why not, where it cannot.
    """

    effect: str
    probability: float
    score: float
    group: tuple[str, ...]
    zones: tuple[str, ...]
    parameters: Mapping[str, tuple[float, str, tuple[float, float]]]
    retained_share: float
    separate_by: str
    testable: bool
    reason: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``which`` in ``diagnosis.json``."""
        return {
            "effect": self.effect,
            "probability": self.probability,
            "score": self.score,
            "group": list(self.group),
            "zones": list(self.zones),
            "parameters": {
                name: {"value": value, "unit": unit, "interval": list(ends)}
                for name, (value, unit, ends) in self.parameters.items()
            },
            "retained_share": self.retained_share,
            "separate_by": self.separate_by,
            "testable": self.testable,
            "reason": self.reason,
        }


@dataclass(frozen=True)
class Verdict:
    """What a search says.

    Parameters
    ----------
    name : {"no_gap", "named", "group", "unexplained"}
        In a word.
    suspects : tuple of Suspect
        Every effect of the catalogue, the likeliest first.
    set90 : tuple of str
        Effects that hold all present ones with 90 % probability; empty when the answer may be none.
    combinations : mapping of tuple of str to float
        Probability that the effects up to a round are all there are, in the order of the rounds; sums to 1 [-].
    """

    name: VerdictName
    suspects: tuple[Suspect, ...]
    set90: tuple[str, ...]
    combinations: Mapping[tuple[str, ...], float]


def judge(rounds: Sequence[Round], untestable: Mapping[str, str]) -> Verdict:
    """Judge what the rounds of a search found.

    Parameters
    ----------
    rounds : sequence of Round
        Of the search.
    untestable : mapping of str to str
        Effects that the case cannot tell, with the reason.
    """
    probability: dict[str, float] = dict.fromkeys(CATALOGUE, 0.0)
    score: dict[str, float] = dict.fromkeys(CATALOGUE, -np.inf)
    best: dict[str, Gain | Refit] = {}
    real = 1.0  # that all rounds before found something that is there
    last = beyond(rounds[-1])
    chain: list[tuple[tuple[str, ...], float]] = []
    for r in rounds:
        gains = gains_of(r)
        found, none = probabilities(levelled(r))
        for effect, gain in gains.items():
            probability[effect] = max(probability[effect], real * found[effect])
            if gain > score[effect]:
                score[effect] = gain
                best[effect] = _source(r, effect)
        if r.accepted is not None:
            chain.append((tuple(r.before.effects), real * none))
            real *= 1.0 - none
    chain.append((tuple(rounds[-1].after.effects), real))
    name = _name(rounds)
    if name == "unexplained" and chain[1:]:  # what explains a part only is there with no more than that probability
        share = float(np.clip(_explained(rounds, _left_over(rounds[-1].after)), 0.0, 1.0))
        probability = {e: share * p for e, p in probability.items()}
    suspects = sorted(
        (_suspect(e, probability[e], score[e], best.get(e), rounds, untestable.get(e)) for e in CATALOGUE),
        key=lambda s: (-s.probability, -last.get(s.effect, -np.inf), -s.score),
    )
    return Verdict(name, tuple(suspects), _inside(rounds, suspects) if name in ("named", "group") else (), dict(chain))


def _inside(rounds: Sequence[Round], suspects: Sequence[Suspect]) -> tuple[str, ...]:
    """Effects of the 90 % set: those that are likely enough, and what cannot be told from one that was accepted."""
    alike = {e for r in rounds if r.accepted is not None for e in group_of(r, r.accepted.screened.effect)}
    return tuple(s.effect for s in suspects if s.probability >= IN_SET or s.effect in alike)


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
    if gains[effect] <= ACCEPTED:  # what hardly gains is not there, whatever else looks like it
        return (effect,)
    for g in r.gains:
        if g.effect == effect:
            continue
        near = abs(gains[g.effect] - gains[effect]) < APART
        rival = gains[g.effect] > ACCEPTED and (
            (own is not None and abs(r.screening.cosine(own, g)) > ALIKE)
            or (g.effect in CATALOGUE[effect].confounders and gains[g.effect] > RIVAL * gains[effect])
        )
        if near or rival:
            alike.append(g.effect)
    return tuple(alike)


def _name(rounds: Sequence[Round]) -> VerdictName:
    first, final = rounds[0], rounds[-1].after
    left_over = _left_over(final)
    if first.accepted is not None and _explained(rounds, left_over) >= (EXPLAINED_OF_MUCH if left_over else EXPLAINED):
        size = len(group_of(first, first.accepted.screened.effect))
        if size <= LARGEST_GROUP:
            return "named" if size == 1 else "group"
        return "unexplained"
    gap = first.accepted is not None or first.generic.gain > GENERIC_GAP or left_over
    return "unexplained" if gap else "no_gap"


def _explained(rounds: Sequence[Round], left_over: bool) -> float:
    """Share of the squared error that is explained: where it was fitted, or held out unless much is left over."""
    first, last = rounds[0], rounds[-1]
    tuning = last.after.found.mean_square / first.before.found.mean_square
    held_out = (last.after_held_out.mae / first.held_out.mae) ** 2
    return 1.0 - (tuning if left_over else min(tuning, held_out))


def _left_over(fit: Fit) -> bool:
    """Whether the errors of a model are larger than what cases without a missing effect keep."""
    zones = fit.by_zone[fit.by_zone > 0.0]
    size = float(np.sqrt(fit.found.mean_square))
    return size > max(LEFT_OVER, LEFT_OF_CHANGE * fit.change) or (
        size > LEFT_IN_A_ZONE and float(zones.max() / zones.mean()) > CONCENTRATED
    )


def _source(r: Round, effect: str) -> Gain | Refit:
    fitted = next((x for x in r.refits if x.screened.effect == effect), None)
    return fitted or next(g for g in r.gains if g.effect == effect)


def _suspect(
    effect: str,
    probability: float,
    score: float,
    best: Gain | Refit | None,
    rounds: Sequence[Round],
    reason: str | None,
) -> Suspect:
    known = CATALOGUE[effect]
    if best is None:
        return Suspect(effect, 0.0, 0.0, (effect,), (), {}, 0.0, known.separated_by, reason is None, reason or "")
    gain = best.screened if isinstance(best, Refit) else best
    home = next(r for r in rounds if any(found is best for found in (*r.gains, *r.refits)))
    return Suspect(
        effect, probability, score, group_of(home, effect)[:LARGEST_GROUP], gain.zones, _parameters(best, effect),
        gain.retained, known.separated_by, True,
    )  # fmt: skip


def _parameters(best: Gain | Refit, effect: str) -> dict[str, tuple[float, str, tuple[float, float]]]:
    """Estimates of an effect's parameters with 90 % intervals: of the fit, or by tangents where it was not fitted."""
    if isinstance(best, Gain):
        kinds = {p.name: p for p in CATALOGUE[effect].parameters}
        told = {}
        for name, value in best.strengths.items():
            kind, reach = kinds[name.partition("@")[0]], _NINETY * best.deviations[name]
            ends = [float(np.clip(value + s * reach, kind.lower, kind.upper)) for s in (-1.0, 1.0)]
            told[name] = (value, kind.unit, (ends[0], ends[1]))
        return told
    problem, found, spread = best.fit.problem, best.fit.found, best.fit.deviations
    told = {}
    for i, p in enumerate(problem.parameters):
        if p.effect == effect:
            z = found.point[i]
            ends = [float(np.clip(p.inverse(z + s * _NINETY * spread[i]), p.lower, p.upper)) for s in (-1.0, 1.0)]
            told[p.name] = (float(p.inverse(z)), p.unit, (ends[0], ends[1]))
    return told
