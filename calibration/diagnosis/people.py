"""People who have hours of their own in each room: their heat is what a round finds, accepted by left-out days.

A course a zone has seven numbers, which evidence that counts one error a day and zone never pays for; but it recurs,
so that days which a fit has not seen tell it from anything that does not. The ladder of structures has fitted it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.diagnosis.decide.levels import RECURRING, TEMPERATURE
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import Refit, Work
from calibration.diagnosis.refit.search import Round, accepted_from
from calibration.fit.fitted_case import FittedCase
from calibration.fit.ladder import GAINS
from calibration.fit.left_out import values_of


def finds_people(kept: FittedCase) -> bool:
    """Whether the drawing predicts left-out days best with people who have hours of their own in each zone.

    Parameters
    ----------
    kept : FittedCase
        The structure that predicts best.
    """
    return bool(kept.settings.effects.get(GAINS))


def with_people(models: ModelComparison, rounds: Sequence[Round], kept: FittedCase) -> tuple[tuple[Round, ...], Refit]:
    """Let a search go on from the round that lacked people's heat: the last, or the first if the rest made up for it.

    Parameters
    ----------
    models : ModelComparison
        The case as drawn.
    rounds : sequence of Round
        Of the search about the drawing; the last found nothing.
    kept : FittedCase
        The drawing with that heat, and with what was found before or without it.

    Returns
    -------
    tuple
        Rounds before and that one with the heat accepted; and the heat, fitted, which the search goes on with.
    """
    effects = kept.settings.effects
    number = 0 if rounds[0].before.effects.keys() == effects.keys() - {GAINS} else len(rounds) - 1
    begun = rounds[number]
    level = accepted_from(begun.own)
    # what tangents say of it by a schedule, which every case can tell, is what it looks like
    scheduled = next(way for way in begun.screening.ways(GAINS) if not way.zones)
    work = Work(models, begun.before, begun.held_out, begun.screening, level)
    fitted = models.fit(effects, [values_of(kept.best)])
    found = work.weighed([replace(scheduled, zones=tuple(effects[GAINS]))], fitted)
    told = level + TEMPERATURE * float(np.log(RECURRING / (1.0 - RECURRING)))
    found = replace(found, gain=max(found.gain, told), counts=True)
    others = (r for r in begun.refits if r.screened.effect != GAINS)
    refits = sorted((found, *others), key=lambda r: -r.gain)
    return (*rounds[:number], replace(begun, refits=tuple(refits), accepted=found, pair=None)), found
