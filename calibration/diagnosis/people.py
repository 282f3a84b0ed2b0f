"""People who have hours of their own in each room: their heat is what a round finds, accepted by left-out days.

A course a zone has seven numbers, which evidence that counts one error a day and zone never pays for; but it recurs,
so that days which a fit has not seen tell it from anything that does not. The ladder of structures has fitted it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.diagnosis.decide.levels import TEMPERATURE
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import Refit, Work
from calibration.diagnosis.refit.search import Round, accepted_from
from calibration.diagnosis.screen.gains import Gain
from calibration.fit.fitted_case import FittedCase
from calibration.fit.ladder import GAINS
from calibration.fit.left_out import values_of

#: Probability of people's heat that left-out days show [-], as of a gain that recurs about a lumped structure.
SURE = 0.9


def finds_people(kept: FittedCase | None) -> bool:
    """Whether the drawing predicts left-out days best with people who have hours of their own in each zone.

    Parameters
    ----------
    kept : FittedCase or None
        The structure that predicts best, where that is not the drawing.
    """
    return kept is not None and bool(kept.settings.effects.get(GAINS))


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
    # what tangents say of it by a schedule tells where it looks like others
    scheduled = next((g for g in begun.gains if g.effect == GAINS), None)
    nothing = np.zeros(0)
    gain = scheduled or Gain(GAINS, (), 0.0, 0.0, {}, {}, 1.0, nothing, nothing.astype(np.int64))
    work = Work(models, begun.before, begun.held_out, begun.screening, level)
    fitted = models.fit(effects, [values_of(kept.best)])
    found = work.weighed([replace(gain, zones=tuple(effects[GAINS]))], fitted)
    found = replace(found, gain=max(found.gain, level + TEMPERATURE * float(np.log(SURE / (1.0 - SURE)))), counts=True)
    others = (r for r in begun.refits if r.screened.effect != GAINS)
    refits = sorted((found, *others), key=lambda r: -r.gain)
    return (*rounds[:number], replace(begun, refits=tuple(refits), accepted=found, pair=None)), found
