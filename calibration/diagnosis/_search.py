"""Rounds of screening and re-fitting: one effect after another, each sought with the earlier ones in the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calibration._evaluate import Progress
from calibration.diagnosis._bench import Bench, Fit, is_strength
from calibration.diagnosis._held_out import HeldOut, held_out
from calibration.diagnosis._screen import Gain, Screening, choice_of, screen
from calibration.errors import CalibrationError
from thermal import ModelError
from thermal.effects import CATALOGUE

#: Most rounds, and most effects that a round fits anew.
ROUNDS, MOST_REFITS = 8, 4

#: Gain by tangents from which an effect is fitted anew [-], and the least share of the best's that it must have.
LEAST_GAIN, LEAST_SHARE = 3.0, 0.4

#: Evaluations of a fit from one start.
_EVALUATIONS = 6

#: Least fall of an error by which an effect matters to predictions, of the root mean square where it is fitted or of
#: the mean where it is held out, and by how much the latter may grow [K].
MATTERS, NO_WORSE = 0.03, 0.005

#: Gain of the fit from which an effect is accepted [-]; null cases stay below, as with `calibration.diagnosis._levels`.
ACCEPTED = 6.0


@dataclass(frozen=True)
class Refit:
    """An effect fitted together with all that was accepted before.

    Parameters
    ----------
    screened : Gain
        What its tangents promised.
    fit : Fit
        The model with it.
    gain : float
        Logarithm of its Bayes factor against the model without it [-].
    fall : float
        How far the root mean square of the tuning errors falls with it [K].
    held_out : HeldOut
        Held-out errors with it.
    counts : bool
        Whether it may be accepted: beyond doubt, of some size, and no worse where it was not fitted.
    """

    screened: Gain
    fit: Fit
    gain: float
    fall: float
    held_out: HeldOut
    counts: bool


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
    """

    before: Fit
    held_out: HeldOut
    screening: Screening
    gains: tuple[Gain, ...]
    generic: Gain
    refits: tuple[Refit, ...]
    accepted: Refit | None

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
        return {
            "before": list(self.before.effects),
            "tuning_rms": float(np.sqrt(self.before.found.mean_square)),
            "held_out_mae": self.held_out.mae,
            "generic": self.generic.gain,
            "gains": {
                g.effect: {"gain": g.gain, "zones": list(g.zones), "share": g.share, "retained": g.retained}
                for g in self.gains
            },
            "refits": {
                r.screened.effect: {
                    "gain": r.gain, "fall": r.fall, "held_out_mae": r.held_out.mae, "counts": r.counts,
                }
                for r in self.refits
            },
            "accepted": None if self.accepted is None else self.accepted.screened.effect,
        }  # fmt: skip


def search(
    bench: Bench, baseline: Fit, candidates: Sequence[str], progress: Progress | None = None
) -> tuple[Round, ...]:
    """Seek effects in rounds until none gains enough.

    Parameters
    ----------
    bench : Bench
        The case.
    baseline : Fit
        The calibrated model without any effect.
    candidates : sequence of str
        Effects that the case can tell.
    progress : callable, optional
        Called with stage, done, total.
    """
    done: list[Round] = []
    fit, errors = baseline, held_out(bench, baseline)
    for number in range(ROUNDS):
        if progress is not None:
            progress("diagnose", number, ROUNDS)
        open_ = [e for e in candidates if all(r in fit.effects for r in CATALOGUE[e].requires)]
        made, gains, generic = screen(bench, fit, open_)
        refits = _refits(bench, fit, errors, made, gains)
        best = next((r for r in refits if r.counts), None)
        done.append(Round(fit, errors, made, tuple(gains), generic, tuple(refits), best))
        if best is None:
            break
        fit, errors = best.fit, best.held_out
    if progress is not None:
        progress("diagnose", ROUNDS, ROUNDS)
    return tuple(done)


def _refits(bench: Bench, fit: Fit, before: HeldOut, made: Screening, gains: Sequence[Gain]) -> list[Refit]:
    """Fit the few best anew, lesser ones too as long as none counts, and what the best is confounded with."""
    accepted = {p.name: fit.values[p.name] for p in fit.built.network.parameters if p.effect is not None}
    found: list[Refit] = []

    def refit(g: Gain, starts: Sequence[Mapping[str, float]]) -> None:
        try:
            anew = bench.fit({**fit.effects, g.effect: g.zones}, starts, evaluations=_EVALUATIONS)
        except (ArithmeticError, np.linalg.LinAlgError, CalibrationError, ModelError):
            return  # a fit that fails costs that effect only
        found.append(_weighed(bench, fit, before, g, anew))

    for g in [g for g in gains if g.gain > LEAST_GAIN][:MOST_REFITS]:
        if g.gain < LEAST_SHARE * gains[0].gain and any(r.counts for r in found):
            break
        refit(g, [made.promised(g), accepted | dict(g.strengths)] if g is gains[0] else [made.promised(g)])
    best = max((r for r in found if r.counts), key=lambda r: r.gain, default=None)
    if best is not None and best.screened.zones:
        fitted = {r.screened.effect for r in found}
        for g in gains:
            alike = g.effect in CATALOGUE[best.screened.effect].confounders and CATALOGUE[g.effect].zonal
            if alike and g.effect not in fitted:  # tangents at no strength may miss where it is, or what it does
                refit(replace(g, zones=best.screened.zones), [accepted])
    return sorted(found, key=lambda r: -r.gain)


def _weighed(bench: Bench, fit: Fit, before: HeldOut, screened: Gain, anew: Fit) -> Refit:
    """Compare a model with one effect more with the one without it."""
    choice = choice_of(_places(anew, screened.effect), screened.places) if screened.places else 0.0
    gain = float(anew.evidence - fit.evidence - choice)
    fall = float(np.sqrt(fit.found.mean_square) - np.sqrt(anew.found.mean_square))
    errors = held_out(bench, anew)
    closer = before.mae - errors.mae
    counts = gain > ACCEPTED and closer > -NO_WORSE and max(fall, closer) > MATTERS
    return Refit(screened, anew, gain, fall, errors, counts)


def _places(fit: Fit, effect: str) -> int:
    """Count the zones, or pairs of zones, in which a fitted model has an effect."""
    mine = (p for p in fit.problem.parameters if p.effect == effect and is_strength(p.name, effect))
    return len({p.member for p in mine})
