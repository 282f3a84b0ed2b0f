"""What gains are worth: of effects that count and that do not, of a pair, and the probabilities that follow."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calibration.diagnosis.decide.levels import DOUBTFUL, SMALL, TEMPERATURE, usual
from calibration.diagnosis.refit.refit import ACCEPTED, Refit, promising
from calibration.diagnosis.refit.search import Round


def gains_of(r: Round) -> dict[str, float]:
    """Gain of every effect of a round: fitted where it was, by tangents otherwise.

    It is little where it does not count, or promises little.

    Parameters
    ----------
    r : Round
        Of the search.
    """
    gains = {g.effect: g.gain if promising(r.before, g.share) else min(g.gain, SMALL) for g in r.gains}
    return gains | {x.screened.effect: _worth(x) for x in r.refits} | _led(r)


def levelled(r: Round) -> dict[str, float]:
    """Gains by which probabilities are told: of what does not count, what it gains beyond nulls, and little.

    Parameters
    ----------
    r : Round
        Of the search.
    """
    fitted = {x.screened.effect: x for x in r.refits}
    sure = {e for e, x in fitted.items() if x.counts} | set(_led(r))
    worth = {e: min(gain, SMALL) for e, gain in beyond(r).items()}
    worth |= {e: min(worth[e], DOUBTFUL) for e, x in fitted.items() if x.worse}
    return worth | {e: gain for e, gain in raw(r).items() if e in sure}


def beyond(r: Round) -> dict[str, float]:
    """Gains; once an effect is in the model, beyond nulls: what it leaves looks like what answers to anything.

    Parameters
    ----------
    r : Round
        Of the search.
    """
    return {e: gain - usual(e) * bool(r.before.effects) for e, gain in raw(r).items()}


def raw(r: Round) -> dict[str, float]:
    """Gain of every effect of a round, whether it counts or not.

    Parameters
    ----------
    r : Round
        Of the search.
    """
    return {g.effect: g.gain for g in r.gains} | {x.screened.effect: x.gain for x in r.refits} | _led(r)


def _worth(fitted: Refit) -> float:
    return fitted.gain if fitted.counts else min(fitted.gain, DOUBTFUL if fitted.worse else SMALL)


def _led(r: Round) -> dict[str, float]:
    """Gain of an accepted effect that is not the first by its own.

    Found as one of a pair, it has that of both, less the price of the other; preferred for what it does on held-out
    days, it takes the place of the one that gains more.
    """
    if r.accepted is None:
        return {}
    mine = r.accepted.screened.effect
    if r.pair is not None:
        return {mine: r.pair.gain - ACCEPTED}
    most = max((x for x in r.refits if x.counts), key=lambda x: x.gain, default=r.accepted)
    return {most.screened.effect: r.accepted.gain, mine: most.gain} if most.gain > r.accepted.gain else {}


def probabilities(gains: Mapping[str, float]) -> tuple[dict[str, float], float]:
    """Share of each effect against all others and none, and that of none, whose gain is that at which effects count.

    Parameters
    ----------
    gains : mapping of str to float
        By effect, such as `levelled` [-].
    """
    top = max(*gains.values(), ACCEPTED)
    weight = {effect: float(np.exp((gain - top) / TEMPERATURE)) for effect, gain in gains.items()}
    none = float(np.exp((ACCEPTED - top) / TEMPERATURE))
    whole = sum(weight.values()) + none
    return {effect: w / whole for effect, w in weight.items()}, none / whole
