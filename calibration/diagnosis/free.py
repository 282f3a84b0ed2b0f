"""Where a drawing does not hold: the search goes on about a building whose masses, couplings and sun are free."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calibration.diagnosis.decide.levels import RECURRING
from calibration.diagnosis.decide.name import VerdictName
from calibration.diagnosis.decide.verdict import Verdict, raw
from calibration.diagnosis.known import reasons_of
from calibration.diagnosis.refit.comparison import Effects, Fit, ModelComparison
from calibration.diagnosis.refit.refit import beyond_a_step, held_out
from calibration.diagnosis.refit.search import Round, search
from calibration.diagnosis.screen.regular import Regular, regular
from calibration.evaluation.settings import CalibrationSettings
from calibration.fit.fitted_case import FittedCase, fit_case
from calibration.fit.ladder import ADVANCE, CLOCK, GAINS
from calibration.fit.left_out import left_out, values_of
from calibration.fit.result import Rung
from calibration.progress import Forward, Progress
from thermal.case.building import GeometryQuality
from thermal.effects.catalogue import CATALOGUE
from thermal.network.structure import Structure

#: Share by which a free structure must predict left-out days better than the building as drawn with what was found [-].
#: Of 32 blind trials of offices that were answered with a name or left unexplained one is better by 13 %, one by 12,
#: the others by 6 at most; of the Twin House N2, whose names were wrong in part, by 25; of three measured houses by 40
#: to 90.
FAILS = 0.2

#: The same with a name for what a free structure has without one. Couplings of rooms are air between them: it must be
#: better by what any structure has to be. Of six houses and offices with open doors that are named one is predicted 7 %
#: better by a free structure, one 2 %, the others worse; measured ones with another fault that were told air between
#: rooms, 16 % (a heater's power unknown) and 17 % (a wrong meter). A sensor that is wrong by as much all the time is
#: the same as constant heat in its zone and those beside it, but for the air that is supplied, and a fault: rare, so
#: that the drawing with it has to be better. With six true ones it is, by 15 % and more (three offices, two houses, a
#: practice case); with those of the Twin House O5, which nobody knows of, it is not.
_IMITATED = {"zone_mixing": ADVANCE, "sensor_bias": 0.0}

#: Why an effect is not sought beside a free structure that has none by itself.
_ALONE = "nothing of it shows beside the drawing, so that a free structure alone cannot tell it"

#: Name of the sun, and of a structure with what was found.
SUN, FOUND = "solar_gain", "found"

#: Share of the lumped structure's error on left-out days below which a gain that recurs in each zone has a name [-]: on
#: development seeds of houses and EnergyPlus' reference buildings 0.44, 0.54 and 0.84 where people's heat is missing,
#: 0.74 and more in 31 nulls but one that the drawing fits (what cycles, and heated floors, recur a little); 0.71 in a
#: measured house.
_RECURS = 0.6


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
        The structure with the effects that were accepted, unless it predicts better by itself.
    rungs : tuple of Rung
        Structures by their errors, and this one with the effects.
    """

    models: ModelComparison
    rounds: tuple[Round, ...]
    untestable: dict[str, str]
    left_over: Regular
    kept: FittedCase
    rungs: tuple[Rung, ...]


def held_against(rounds: Sequence[Round], quality: GeometryQuality) -> tuple[Fit, ...]:
    """Models of the drawing of which a free structure must beat one: with what was found, and of a guess without it.

    What differs between zones that nobody has measured looks like meters that are wrong or air between them.

    Parameters
    ----------
    rounds : sequence of Round
        Of the search about the drawing.
    quality : {"surveyed", "approximate", "generic"}
        How the geometry was come by.
    """
    final = rounds[-1].after
    guessed = quality == "generic" and rounds[0].accepted is not None
    return (rounds[0].before, final) if guessed else (final,)


def must_be_better_by(found: Collection[str]) -> float:
    """Share by which a free structure must predict left-out days better than the drawing with what was found [-].

    Parameters
    ----------
    found : collection of str
        Effects, without those that somebody knows to be there.
    """
    return min((_IMITATED[e] for e in found if e in _IMITATED), default=FAILS)


def drawing_fails(rungs: Sequence[Rung], kept: FittedCase | None, least: float) -> bool:
    """Whether a free structure predicts days that it has not seen so much better that the drawing says little.

    Parameters
    ----------
    rungs : sequence of Rung
        The building as drawn with what was found first.
    kept : FittedCase or None
        What predicts left-out days best, where that is not the first.
    least : float
        From `must_be_better_by` [-].
    """
    if kept is None or not kept.settings.structure.lumped:
        return False
    return next(r for r in rungs if r.chosen).left_out_mae < (1.0 - least) * rungs[0].left_out_mae


def recurs(rungs: Sequence[Rung]) -> tuple[float, float] | None:
    """Errors on left-out days without and with a gain that recurs from day to day, where that is people's heat [K].

    Its course differs from zone to zone, so that no schedule of the catalogue has it.

    Parameters
    ----------
    rungs : sequence of Rung
        Structures by their errors.
    """
    errors = {r.name: r.left_out_mae for r in rungs}
    without, with_it = errors.get("lumped"), errors.get("recurring")
    if without is None or with_it is None or with_it > _RECURS * without:
        return None
    return without, with_it


def with_recurring(verdict: Verdict, free: Free, rungs: Sequence[Rung]) -> Verdict:
    """Name people's heat where a free structure holds it.

    Parameters
    ----------
    verdict : Verdict
        From `judge`, about the structure.
    free : Free
        What was sought about it.
    rungs : sequence of Rung
        Structures by their errors.
    """
    structure = free.kept.settings.structure
    own = next(c for c in verdict.candidates if c.effect == GAINS)
    there = {r.accepted.screened.effect for r in free.rounds if r.accepted is not None}
    plain = not structure.recurring or recurs(rungs) is None or GAINS in free.rounds[-1].after.effects
    if plain or not own.testable or verdict.name == "unexplained":
        return verdict
    told = replace(own, probability=RECURRING, group=(GAINS,), zones=(), parameters={})
    ahead = [c for c in verdict.candidates if c.effect in there and verdict.name in ("named", "group")]
    rest = [c for c in verdict.candidates if c is not own and c not in ahead]
    chain = {e: (1.0 - RECURRING) * p for e, p in verdict.combinations.items()}
    chain |= {(*e, GAINS): RECURRING * p for e, p in verdict.combinations.items()}
    name: VerdictName = "named" if verdict.name == "no_gap" else verdict.name
    set90 = tuple(dict.fromkeys((*verdict.set90, GAINS)))
    return replace(verdict, name=name, candidates=(*ahead, told, *rest), set90=set90, combinations=chain)


def is_recurring(verdict: Verdict) -> bool:
    """Whether `with_recurring` has named people's heat: it has no strength of a schedule.

    Parameters
    ----------
    verdict : Verdict
        Of a diagnosis.
    """
    own = next(c for c in verdict.candidates if c.effect == GAINS)
    return verdict.name in ("named", "group") and own.probability == RECURRING and not own.parameters


def only_beside_a_free_structure(rounds: Sequence[Round]) -> set[str]:
    """Effects that explain nothing beside the drawing, in any round: less than they cost, by tangents and fitted.

    What is wrong with two masses a zone looks like an effect too, and so does what is wrong with a drawing; but they
    are wrong in different ways. In a strip mall without any missing effect valves that leak in all ten zones gain 360
    beside a free structure, and -5 beside the drawing. What a free structure may have by itself is none of these: the
    sun, a gain that recurs and weather that is moved are held against the structure.

    Parameters
    ----------
    rounds : sequence of Round
        Of the search about the drawing.
    """
    gains = [item for r in rounds for item in raw(r).items()]
    return {e for e, _ in gains} - {e for e, gain in gains if gain >= 0.0} - {SUN, GAINS, CLOCK}


def search_free(
    models: ModelComparison,
    rounds: Sequence[Round],
    rungs: tuple[Rung, ...],
    kept: FittedCase,
    known: Sequence[str] = (),
    ruled_out: Sequence[str] = (),
    progress: Progress | None = None,
) -> Free:
    """Seek effects about a free structure.

    How many independent errors it has is what its calibration found of their correlation. The errors of a building that
    people live in are larger than those of an office whose heat is all metered, so that only what comes back counts as
    left over. What the structure itself has found and the catalogue has a name for is sought by its name: the sun, a
    gain that recurs from day to day, and weather that is moved by more than a step of the telemetry, until one is
    found that predicts left-out days about as well. Any other effect must show beside the drawing, too. What is named
    is handed on unless the structure alone predicts them better: its sun has apertures.

    Parameters
    ----------
    models : ModelComparison
        The case as drawn, with its days.
    rounds : sequence of Round
        Of the search about the drawing.
    rungs : tuple of Rung
        Structures by their errors.
    kept : FittedCase
        The free structure.
    known, ruled_out : sequence of str
        As in `diagnose`.
    progress : callable, optional
        Called with stage, done, total.
    """
    chosen, whole, found = kept.settings, kept.settings.structure, kept.best
    ahead = Forward(progress)
    said, alone = {*known, *ruled_out}, only_beside_a_free_structure(rounds)
    attempts: list[tuple[Structure, Effects, str | None]] = [(whole, chosen.effects, None)]
    moved = beyond_a_step(found.problem, found.theta, np.sqrt(np.diag(found.covariance)), CATALOGUE[CLOCK].shifts)
    if CLOCK in chosen.effects and CLOCK not in said and moved:
        attempts.insert(0, (whole, {e: z for e, z in chosen.effects.items() if e != CLOCK}, CLOCK))
    if whole.recurring and GAINS not in said:
        attempts.insert(0, (replace(whole, recurring=False), chosen.effects, GAINS))
    if whole.sun and SUN not in said:
        attempts.insert(0, (replace(whole, sun=False), chosen.effects, SUN))
    for structure, own, sought in attempts:
        settings = replace(
            models.settings, structure=structure, scopes=chosen.scopes, normalisation=chosen.normalisation
        )
        free = ModelComparison(
            models.case, settings, models.tuned, models.judged, models.horizon, weights=found.problem
        )
        untestable = free.untestable()
        untestable |= reasons_of(known, ruled_out, untestable) | dict.fromkeys(own, "part of the structure")
        untestable |= dict.fromkeys(alone - untestable.keys(), _ALONE)
        testable = [e for e in CATALOGUE if e not in untestable]
        baseline = free.fit({**own, **{e: () for e in known}}, [values_of(found)])
        made = search(free, baseline, held_out(free, baseline), testable, ahead.part(0.5))
        final = made[-1].after
        if sought is not None and sought not in final.effects:
            continue
        named = None
        if final.effects.keys() != baseline.effects.keys():
            named = _fit_named(models, replace(chosen, structure=structure), final, ahead.part(0.5))
        if sought is None or (named is not None and named.left_out_mae < (1.0 + ADVANCE) * kept.left_out_mae):
            break
    if named is not None:
        better = kept.left_out_mae < named.left_out_mae
        rungs = tuple(replace(r, chosen=r.chosen and better) for r in rungs)
        rungs += (Rung(FOUND, named.left_out_mae, len(named.best.problem.free), not better),)
        kept = kept if better else named
    return Free(free, made, untestable, regular(free, final), kept, rungs)


def _fit_named(
    models: ModelComparison, settings: CalibrationSettings, final: Fit, progress: Progress | None
) -> FittedCase:
    """Fit a structure with what was found about it, and leave days out."""
    further = replace(settings, effects=dict(final.effects))
    named = fit_case(models.case, models.tuned, models.judged, further, progress, final)
    return replace(named, left=left_out(named.best, models.tuned, settings.spin_up_seconds))
