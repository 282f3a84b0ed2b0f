"""Rounds of screening and re-fitting: one effect after another, each sought with the earlier ones in the model.

Two effects may hide each other, and what is none of them may look like their sum. Both show in the Gram matrix of all
signatures at once, so that every pair is weighed before any model is run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np

from calibration.diagnosis.decide.levels import APART
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.refit import ACCEPTED, HeldOut, Refit, Work, look_again, promising
from calibration.diagnosis.screen.gains import Gain
from calibration.diagnosis.screen.own_nulls import OwnNulls, own_nulls
from calibration.diagnosis.screen.screen import Screening, screen
from calibration.diagnosis.screen.seen import WINDOWS, Seen, look
from calibration.progress import Forward, Progress
from calibration.stages import stage
from thermal.effects.catalogue import CATALOGUE
from thermal.effects.effect import ALIKE

#: Most rounds, and most effects that a round fits anew.
ROUNDS, MOST_REFITS = 8, 4

#: Share of the progress that is left which a round takes [-]: there are two to four.
_SHARE = 0.4

#: Gain by tangents from which an effect is fitted anew [-], and the least share of the best's that it must have.
LEAST_GAIN, LEAST_SHARE = 3.0, 0.4

#: Share of what its tangents promise that the best effect of a round must keep when fitted, else it is fitted from
#: another start too [-].
_KEPT = 0.75

#: Most pairs that a round fits.
MOST_PAIRS = 2


@dataclass(frozen=True)
class Round:
    """What was sought and found with the model of the round before.

    Parameters
    ----------
    before : Fit
        The model that a cause was sought for.
    held_out : HeldOut
        Its held-out errors.
    screening : Screening
        All effects by tangents.
    gains : tuple of Gain
        Them, the best first.
    generic : Gain
        Heat of any shape.
    refits : tuple of Refit
        Effects fitted anew, the best first.
    accepted : Refit or None
        What the next round starts from.
    own : OwnNulls
        What the case shows where nothing is missing, of the first round.
    pair : Refit or None
        The other effect of a pair by which the accepted one was found, fitted with it; its gain is that of both.
    """

    before: Fit
    held_out: HeldOut
    screening: Screening
    gains: tuple[Gain, ...]
    generic: Gain
    refits: tuple[Refit, ...]
    accepted: Refit | None
    own: OwnNulls
    pair: Refit | None = None

    @property
    def after(self) -> Fit:
        """The model that it leaves: with what it accepted, or as it was."""
        return self.before if self.accepted is None else self.accepted.fit

    @property
    def after_held_out(self) -> HeldOut:
        """Held-out errors of the model that it leaves."""
        return self.held_out if self.accepted is None else self.accepted.held_out

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``rounds`` in ``diagnosis.json``."""
        fitted = ("gain", "fall", "worse", "counts")
        return {
            "before": list(self.before.effects),
            "tuning_rms": float(np.sqrt(self.before.found.mean_square)),
            "held_out_mae": self.held_out.mae,
            "generic": self.generic.gain,
            "own_nulls": {"level": self.own.level, "generic": self.own.generic_level},
            "gains": {g.effect: {key: getattr(g, key) for key in ("gain", "zones", "share", "retained")}
                      for g in self.gains},
            "refits": {r.screened.effect: {key: getattr(r, key) for key in fitted} | {"held_out_mae": r.held_out.mae}
                       for r in self.refits},
            "accepted": None if self.accepted is None else self.accepted.screened.effect,
            "pair": None if self.pair is None else {"with": self.pair.screened.effect, "gain": self.pair.gain},
        }  # fmt: skip


@dataclass(frozen=True)
class Pair:
    """What two effects could explain together.

    Parameters
    ----------
    first, second : Gain
        The two, with the strengths that they have together; the first gains more alone.
    gain : float
        Logarithm of the Bayes factor of both against neither, by tangents [-].
    share : float
        Of the squared error that both explain [-].
    """

    first: Gain
    second: Gain
    gain: float
    share: float


def search(
    models: ModelComparison, baseline: Fit, errors: HeldOut, candidates: Sequence[str], progress: Progress | None = None
) -> tuple[Round, ...]:
    """Seek effects in rounds until none gains enough.

    Parameters
    ----------
    models : ModelComparison
        The case.
    baseline : Fit
        The calibrated model without any effect.
    errors : HeldOut
        Its held-out errors.
    candidates : sequence of str
        Effects that the case can tell.
    progress : callable, optional
        Called with stage, done, total.
    """
    whole, sought = Forward(progress), _Sought((), baseline, errors, Seen.of(models.drivers))
    while not sought.over and len(sought.done) < ROUNDS:
        number = len(sought.done) + 1
        part = whole.part(_SHARE, f"round {number}")
        sought = stage(f"round {number}", partial(_with_seen, models, sought, candidates, part))
        sought.seen.give(models.drivers)  # of a round that was done before an interruption, too
    return sought.done


@dataclass(frozen=True)
class _Sought:
    """Where the search is: rounds done, the model that the next begins with, its held-out errors, and what is seen."""

    done: tuple[Round, ...]
    fit: Fit
    errors: HeldOut
    seen: Seen
    ahead: Refit | None = None
    own: OwnNulls | None = None
    over: bool = False


def _with_seen(models: ModelComparison, sought: _Sought, candidates: Sequence[str], part: Progress) -> _Sought:
    """Do a round, and tell when windows are seen to stand open, and heat to be on, after it."""
    return replace(_next_round(models, sought, candidates, part), seen=Seen.of(models.drivers))


def _next_round(models: ModelComparison, sought: _Sought, candidates: Sequence[str], part: Progress) -> _Sought:
    """Screen and fit with the model of the round before, or give that round anew with what the last one accepted."""
    done, fit, errors, ahead, own = sought.done, sought.fit, sought.errors, sought.ahead, sought.own
    part("screening", 0, 1)
    open_ = [e for e in candidates if all(r in fit.effects for r in CATALOGUE[e].requires)]
    look(fit.built.grid, fit.theta, models.drivers, fit.built.inputs, (fit if ahead is None else ahead.fit).effects)
    made, gains, generic = screen(models, fit, open_)
    if own is not None:
        made.jacobian = None
    exchanged = _exchanged(models, done, made, open_)
    if exchanged is not None:
        after, errors, done = exchanged.after, exchanged.after_held_out, (*done[:-2], exchanged)
        return replace(sought, done=done, fit=after, errors=errors, ahead=exchanged.pair, own=own)
    work = Work(models, fit, errors, made, ACCEPTED if own is None else accepted_from(own))
    part("fitting effects", 1, 4)
    refits = _refits(work, gains, ahead)
    part("looking at zones and pairs", 3, 4)
    refits = look_again(work, gains, refits, _first(errors, refits))
    best = _first(errors, refits)
    if own is None:
        own = own_nulls(made, fit if best is None else best.fit, open_)
        work = replace(work, level=accepted_from(own))
        refits = [replace(r, counts=r.counts and r.gain > work.level) for r in refits]
        best = _first(errors, refits)
    chosen = _best_pair(work, gains, refits, best) if ahead is None else None
    pair = None
    if chosen is not None:
        best, pair = chosen
        refits = sorted({id(r): r for r in (*refits, best)}.values(), key=lambda r: -r.gain)
    done = (*done, Round(fit, errors, made, tuple(gains), generic, tuple(refits), best, own, pair))
    if best is None:
        return replace(sought, done=done, over=True)
    return replace(sought, done=done, fit=best.fit, errors=best.held_out, ahead=pair, own=own)


def accepted_from(own: OwnNulls) -> float:
    """Gain from which an effect is accepted: more than what a case without it shows, by chance or by its structure [-].

    Parameters
    ----------
    own : OwnNulls
        Of the case.
    """
    return max(ACCEPTED, own.level)


def _first(before: HeldOut, refits: Sequence[Refit]) -> Refit | None:
    """Of the effects that count the one that gains most; of those it cannot be told from, the held-out days decide.

    Only where they can: their errors must be as much more probable as gains must differ to tell effects apart.
    """
    counting = [r for r in refits if r.counts]
    if not counting:
        return None
    best = counting[0]
    near = [r for r in counting if r.gain > best.gain - APART]
    other = max(near, key=lambda r: r.gain + _held_out_gain(before, r))
    return other if _better(before, other, best) else best


def _held_out_gain(before: HeldOut, r: Refit) -> float:
    zones = len(r.fit.built.network.zones)
    return before.days.size * zones * float(np.log(before.mae / max(r.held_out.mae, 1e-9)))


def _better(before: HeldOut, one: Refit, other: Refit) -> bool:
    """Whether what gains about as much as another, or more, is the likelier with its held-out days."""
    gained = one.gain - other.gain
    return gained > -APART and gained + _held_out_gain(before, one) - _held_out_gain(before, other) > APART


def _refits(work: Work, gains: Sequence[Gain], ahead: Refit | None) -> list[Refit]:
    """Fit the few best anew, lesser ones too as long as none counts, and what the best is confounded with.

    What a pair of the round before was accepted with is there already, and counts.
    """
    found: list[Refit] = []
    if ahead is not None:
        found.append(replace(work.weighed([ahead.screened], ahead.fit), counts=True))

    for g in [g for g in gains if g.gain > LEAST_GAIN and promising(work.fit, g.share)][:MOST_REFITS]:
        if g.gain < LEAST_SHARE * gains[0].gain and any(r.counts for r in found):
            break
        if ahead is None or ahead.screened.effect != g.effect:
            tries = [work.refit([g], work.made.promised(g))]
            kept = 0.0 if tries[0] is None else tries[0].gain
            if g is gains[0] and kept < _KEPT * g.gain:  # a calibrated θ may have hidden it
                tries.append(work.refit([g], work.accepted | dict(g.strengths)))
            if g.zones == ALIKE:
                apart = (w for w in work.made.apart(g.effect) if w.gain > LEAST_GAIN)
                tries.extend(work.refit([w], work.made.promised(w)) for w in apart)
            found.extend(_best_of(work, [t for t in tries if t is not None]))
    best = max((r for r in found if r.counts), key=lambda r: r.gain, default=None)
    if best is not None and best.screened.zones:
        fitted = {r.screened.effect for r in found} | {WINDOWS}  # these are sought anew, not only fitted: `look_again`
        for g in gains:
            there_too = CATALOGUE[g.effect].alike if best.screened.zones == ALIKE else CATALOGUE[g.effect].takes_zones
            confounded = g.effect in CATALOGUE[best.screened.effect].confounders
            there_too &= not (CATALOGUE[g.effect].courses and work.made.is_everywhere(best.screened.zones))
            # tangents at no strength may miss where it is, or what it does
            if confounded and there_too and g.effect not in fitted:
                chosen = best.screened
                there = replace(g, zones=chosen.zones, places=max(g.places, chosen.places))
                other = work.refit([there], work.accepted)
                found.extend([] if other is None else [other])
    return sorted(found, key=lambda r: -r.gain)


def _best_of(work: Work, tries: Sequence[Refit]) -> list[Refit]:
    """Choose among fits of one effect: by gain, and whether zones are alike by their held-out days too.

    The name is the same either way, but a model with one strength where zones differ predicts worse, and loses to a
    structure that is free in each zone, and the name with it (a practice case with air between zones).
    """
    both = len({t.screened.zones == ALIKE for t in tries}) > 1
    worth = [t.gain + (_held_out_gain(work.held_out, t) if both else 0.0) for t in tries]
    return [tries[int(np.argmax(worth))]] if tries else []


def _best_pair(
    work: Work, gains: Sequence[Gain], refits: Sequence[Refit], best: Refit | None
) -> tuple[Refit, Refit] | None:
    """Fit the pairs that promise more than any single effect; the members of one that keeps it, the first one alone.

    A pair that the best single effect is part of needs no search: the next round finds the other.

    Parameters
    ----------
    work : Work
        Of the round.
    gains : sequence of Gain
        Single effects, the best first.
    refits : sequence of Refit
        Those fitted.
    best : Refit or None
        The one that is accepted if no pair is.

    Returns
    -------
    tuple of Refit, or None
        The member that gains more alone, fitted alone; and the other, fitted with it, with the gain of both.
    """
    pairs = [p for p in nominate(work.made, gains, LEAST_GAIN) if promising(work.fit, p.share)]
    if not pairs or (best is not None and _within(best, pairs[0])):
        return None
    single = max((r.gain for r in refits), default=0.0)
    fitted = [work.refit([p.first, p.second], work.made.promised(p.first, p.second)) for p in pairs[:MOST_PAIRS]]
    kept = [(r, p) for r, p in zip(fitted, pairs, strict=False) if r is not None and r.counts]
    if not kept:
        return None
    both, pair = max(kept, key=lambda k: k[0].gain)
    if both.gain < single + work.level or (best is not None and _within(best, pair)):
        return None
    known = {r.screened.effect: r for r in refits if r.screened.zones == pair.first.zones}
    first = known.get(pair.first.effect) or work.refit([pair.first], work.made.promised(pair.first))
    return None if first is None else (first, both)


def nominate(made: Screening, gains: Sequence[Gain], least: float) -> list[Pair]:
    """Pairs that gain more than the best single effect by tangents, the best first.

    Parameters
    ----------
    made : Screening
        Gram matrix of all.
    gains : sequence of Gain
        Single effects, the best first.
    least : float
        By how much a pair must gain more than the best single effect [-].
    """
    if len(gains) < 2:
        return []
    least += max(gains[0].gain, 0.0)
    found = []
    for first, second in combinations(gains, 2):
        if made.reach(first, second) > least:
            pair = Pair(*made.together(first, second))
            if pair.gain > least and all(np.any(g.direction) for g in (pair.first, pair.second)):
                found.append(pair)
    return sorted(found, key=lambda p: -p.gain)


def _exchanged(
    models: ModelComparison, done: Sequence[Round], made: Screening, candidates: Sequence[str]
) -> Round | None:
    """Give the round before the last anew, led by what the last one accepted, where another effect fits that better.

    What was accepted while much was missing may have stood for two effects; now that the second is in the model, the
    third may explain the rest of it better. Tangents about the model with both say which, without another screening.

    Parameters
    ----------
    models : ModelComparison
        The case.
    done : sequence of Round
        So far.
    made : Screening
        Of the model with what they accepted.
    candidates : sequence of str
        Effects that the case can tell with these in the model.
    """
    if len(done) < 2 or done[-2].accepted is None or done[-1].accepted is None or done[-2].pair is not None:
        return None
    before, (first, second) = done[-2], (done[-2].accepted.screened, done[-1].accepted)
    kept = second.fit.effects
    if any(first.effect in CATALOGUE[e].requires for e in kept):
        return None
    less = made.without(first.effect)
    free = [e for e in candidates if e not in kept and first.effect not in CATALOGUE[e].requires]
    other = max((less.of(e) for e in free), key=lambda g: g.gain, default=None)
    if other is None or other.gain < less.of(first.effect).gain - APART:
        return None
    work = Work(models, before.before, before.held_out, before.screening, accepted_from(before.own))
    both = work.weighed([first, second.screened], second.fit)
    instead = work.refit([second.screened, other], less.promised(other))
    if instead is None or not instead.counts or not _better(before.held_out, instead, both):
        return None
    known = (r for r in before.refits if r.screened.effect == second.screened.effect)
    alone = next((r for r in known if r.screened.zones == second.screened.zones), None)
    alone = alone or work.refit([second.screened], work.accepted)
    if alone is None:
        return None
    refits = sorted({id(r): r for r in (*before.refits, alone)}.values(), key=lambda r: -r.gain)
    return replace(before, refits=tuple(refits), accepted=alone, pair=instead)


def _within(single: Refit, pair: Pair) -> bool:
    return single.screened.effect in (pair.first.effect, pair.second.effect)
