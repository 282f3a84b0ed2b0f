"""Where a drawing does not hold: the search goes on about a building whose masses, couplings and sun are free."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from calibration.diagnosis.known import reasons_of
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import held_out
from calibration.diagnosis.refit.search import Round, search
from calibration.diagnosis.screen.regular import Regular, regular
from calibration.evaluation.n_step import Progress
from calibration.fit.fitted_case import FittedCase, fit_case
from calibration.fit.left_out import Known, values_of
from calibration.fit.result import Rung
from thermal.effects.catalogue import CATALOGUE

#: Share by which a free structure must predict left-out days better than the building as drawn with what was found [-].
#: Of 32 blind trials of offices that were answered with a name or left unexplained one is better by 13 %, one by 12,
#: the others by 6 at most; of the Twin House N2, whose names were wrong in part, by 25; of three measured houses by 40
#: to 90.
FAILS = 0.2


@dataclass(frozen=True)
class Free:
    """What was sought and found about a free structure.

    Parameters
    ----------
    models : ModelComparison
        The case in this structure.
    rounds : tuple of Round
        Of the search.
    untestable : dict of str to str
        Effects that it cannot tell, with the reason.
    left_over : Regular
        What comes back of the errors of its last model.
    kept : FittedCase
        The structure, with the effects that were accepted.
    """

    models: ModelComparison
    rounds: tuple[Round, ...]
    untestable: dict[str, str]
    left_over: Regular
    kept: FittedCase


def drawing_fails(rungs: Sequence[Rung], kept: FittedCase | None) -> bool:
    """Whether a free structure predicts days that it has not seen so much better that the drawing says little.

    Parameters
    ----------
    rungs : sequence of Rung
        The building as drawn first.
    kept : FittedCase or None
        What predicts left-out days best, where that is not the first.
    """
    if kept is None or not kept.settings.structure.lumped:
        return False
    return next(r for r in rungs if r.chosen).left_out_mae < (1.0 - FAILS) * rungs[0].left_out_mae


def search_free(
    models: ModelComparison,
    kept: FittedCase,
    known: Sequence[str] = (),
    ruled_out: Sequence[str] = (),
    progress: Progress | None = None,
) -> Free:
    """Seek effects about a free structure.

    How many independent errors it has is what its calibration found of their correlation. The errors of a building that
    people live in are larger than those of an office whose heat is all metered, so that only what comes back counts as
    left over.

    Parameters
    ----------
    models : ModelComparison
        The case as drawn, with its days.
    kept : FittedCase
        The free structure.
    known, ruled_out : sequence of str
        As in `diagnose`.
    progress : callable, optional
        Called with stage, done, total.
    """
    chosen = kept.settings
    settings = replace(
        models.settings, structure=chosen.structure, scopes=chosen.scopes, normalisation=chosen.normalisation
    )
    free = ModelComparison(
        models.case, settings, models.tuned, models.judged, models.horizon, weights=kept.best.problem
    )
    untestable = free.untestable()
    untestable |= reasons_of(known, ruled_out, untestable) | dict.fromkeys(chosen.effects, "part of the structure")
    baseline = free.fit({**chosen.effects, **{e: () for e in known}}, [values_of(kept.best)])
    rounds = search(free, baseline, held_out(free, baseline), [e for e in CATALOGUE if e not in untestable], progress)
    final = rounds[-1].after
    if final.effects.keys() != baseline.effects.keys():
        known_fit = Known(final.problem, final.model, final.point)
        kept = fit_case(
            models.case, models.tuned, models.judged, replace(chosen, effects=dict(final.effects)), progress, known_fit
        )
    return Free(free, rounds, untestable, regular(free, final), kept)
