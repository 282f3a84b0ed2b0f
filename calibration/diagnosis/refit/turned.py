"""A drawing whose north is wrong: what was found, with the sun in it, is likelier about a building that is turned."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from calibration.diagnosis.decide.verdict import judge
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
from calibration.diagnosis.refit.refit import ACCEPTED, CHANCE, NO_WORSE, growth, held_out
from calibration.diagnosis.refit.search import Round, search
from calibration.fit.fitted_case import is_large
from calibration.fit.starts import FAILURES
from calibration.progress import Progress

#: Effects that come from a side.
_SUN = ("solar_gain", "solar_opaque")

#: Steps of angles [deg]: half of what tells a facade from the next, then a few degrees.
_STEPS = (45.0, 12.0)

#: Angle up to which a building stands as it is drawn [deg]: shade on one side looks like a few degrees.
_LEAST = 5.0

#: Curvature of the evidence over a step up to which it is flat, as fits are not exact [-].
_FLAT = 0.1

#: Evaluations of a fit at another angle, from the estimate at the one before.
_EVALUATIONS = 6


def turn(
    models: ModelComparison, rounds: Sequence[Round], candidates: Sequence[str], progress: Progress | None = None
) -> tuple[ModelComparison, tuple[Round, ...]]:
    """Search anew about a building that is turned, where the sun says that its drawing's north is wrong.

    The sun that was found, or, where something is missing that no effect explains, the sun that was not.

    Its evidence is followed uphill. An angle pays for having been chosen among all, and must then be better evidence as
    clearly as any name, and predict held-out days no worse.

    Parameters
    ----------
    models : ModelComparison
        The case.
    rounds : sequence of Round
        Of the search about the building as drawn.
    candidates : sequence of str
        Effects that the case can tell.
    progress : callable, optional
        Called with stage, done, total.

    Returns
    -------
    tuple
        What was searched in the end, and its rounds.
    """
    final, told = rounds[-1].after, judge(rounds, {}).name
    hidden = told == "unexplained" and _SUN[0] in candidates  # from the wrong side it explains too little to be found
    sunlit = any(effect in final.effects for effect in _SUN)
    if not (sunlit or hidden) or is_large(models.case.building.zone_names):
        return models, tuple(rounds)
    with suppress(*FAILURES):
        drawn = _fit(models, final) if sunlit else models.fit({**final.effects, _SUN[0]: ()}, [final.values])
        least = max(final.evidence, drawn.evidence) + ACCEPTED
        angle, fit, price = _climbed(models, 0.0, drawn, _STEPS[0])
        if fit.evidence - price > least:
            angle, fit, price = _climbed(models, angle, fit, _STEPS[1])
        if abs(angle) <= _LEAST or fit.evidence - price <= least:
            return models, tuple(rounds)
        own = _turned(models, angle)
        grown, error = growth(rounds[-1].after_held_out, held_out(own, fit))
        if grown <= NO_WORSE + CHANCE * error:
            known = rounds[0].before.effects
            baseline = own.fit(known, [rounds[0].before.values])
            again = search(own, baseline, held_out(own, baseline), candidates, progress)
            # a search may stop at less than what was turned, and is no better than the drawing then
            if any(effect in again[-1].after.effects for effect in _SUN) and again[-1].after.evidence - price > least:
                return own, again
    return models, tuple(rounds)


def _climbed(models: ModelComparison, angle: float, fit: Fit, step: float) -> tuple[float, Fit, float]:
    """Follow the evidence uphill by steps of an angle, then to the top of a parabola: there, its fit, its price [-].

    The price is that of having chosen an angle of all: a flat prior over a normal posterior's width.
    """
    fits = {angle: fit}
    while True:
        sides = [_wrapped(angle + side * step) for side in (-1.0, 1.0)]
        fits |= {side: _fit(_turned(models, side), fits[angle]) for side in sides if side not in fits}
        best = max(fits, key=lambda tried: fits[tried].evidence)
        if best == angle:
            break
        angle = best
    low, peak, high = (fits[tried].evidence for tried in (sides[0], angle, sides[1]))
    if (bent := 2.0 * peak - low - high) > _FLAT:
        top = _wrapped(angle + 0.5 * step * (high - low) / bent)
        fits[top] = _fit(_turned(models, top), fits[angle])
        angle = max((angle, top), key=lambda tried: fits[tried].evidence)
    return angle, fits[angle], max(0.0, float(np.log(360.0 / step * np.sqrt(max(bent, _FLAT) / (2.0 * np.pi)))))


def _wrapped(angle: float) -> float:
    """Bring an angle to -180 to 180 deg, in tenths."""
    return round((angle + 180.0) % 360.0 - 180.0, 1)


def _turned(models: ModelComparison, angle: float) -> ModelComparison:
    """Give the case a building that is turned, on the same days."""
    return models.built_as(replace(models.settings, structure=replace(models.settings.structure, turned=angle)))


def _fit(models: ModelComparison, known: Fit) -> Fit:
    return models.fit(known.effects, [known.values], evaluations=_EVALUATIONS)
