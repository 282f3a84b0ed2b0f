"""Challenge of what a search found: what no instrument is to blame for, and no drawing tells.

A drawing has one value for the slabs and furniture of all zones, and zones differ in them; one that is no survey is
wrong in what lies between rooms and outdoor, too. What that leaves is taken for a meter that is wrong zone by zone, and
gains as much as a true one. Films and light contents are chosen before anything is sought, when what is missing may
hide them: then sensors seem to lag once it is found. Heat of people, leaks and the sun are alike in all rooms at first,
as watts per floor area, air changes and glass; what rooms differ in is then taken for their sensors and meters.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

from calibration.diagnosis.decide.verdict import judge
from calibration.diagnosis.refit.comparison import Effects, Fit, ModelComparison
from calibration.diagnosis.refit.refit import ACCEPTED, held_out
from calibration.diagnosis.refit.search import Round, search
from calibration.fit.fitted_case import is_large
from calibration.fit.ladder import by_zone
from calibration.fit.starts import FAILURES
from calibration.fit.undrawn import BY_EVIDENCE, UNDRAWN, is_another
from calibration.progress import Progress
from thermal.effects.catalogue import CATALOGUE
from thermal.network.structure import MAY_DIFFER
from thermal.parameters import Scope

#: Effects that give a zone a part of its metered heat more or less, as another mass of the zone seems to, or later.
_LIKE_MASSES = frozenset({"flow_gain", "duct_loss", "capacity_limit", "sensor_lag"})

#: What says itself that masses are not as drawn.
_MASS = "hidden_mass"


def challenge(
    models: ModelComparison, rounds: Sequence[Round], candidates: Sequence[str], progress: Progress | None = None
) -> tuple[ModelComparison, tuple[Round, ...]]:
    """Search anew about a building in another structure, where that is better evidence than what was found.

    With masses by zone, with losses by zone where the drawing is no survey, with films or light contents, or with
    rooms that differ in an effect that was found in all.

    They are weighed against what was found, alone and beside as much of it as does not act as masses do: what zones
    differ in takes further effects to imitate, and hides what is missing. Where something is left that no effect
    explains, they are weighed against nothing. A building of one zone has no others to differ from.

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
    final, zones = rounds[-1].after, models.case.building.zone_names
    told = judge(rounds, {}).name != "no_gap" and _MASS not in final.effects
    if is_large(zones) or not told:
        return models, tuple(rounds)
    known = dict(rounds[0].before.effects)
    others = list(_others(models, rounds[0].before))
    for effects, least in _rivals(rounds, known):
        fits = [(own, _fit(own, effects, final, least)) for own in (*others, *_differing(models, effects, final))]
        better = [(own, fit) for own, fit in fits if fit is not None and fit.evidence >= least]
        for own, other in sorted(better, key=lambda found: -found[1].evidence):
            with suppress(*FAILURES):
                baseline = other if effects == known else own.fit(known, [_values(final, known)])
                again = search(own, baseline, held_out(own, baseline), candidates, progress)
                # of several effects a search may find the first alone, and what it stops at is no better then
                if again[-1].after.evidence >= least:
                    return own, again
        if better:
            break
    return models, tuple(rounds)


def _fit(models: ModelComparison, effects: Effects, final: Fit, least: float) -> Fit | None:
    """Fit effects from where they were found, while they may reach an evidence; None where that fails."""
    try:
        return models.fit(effects, [_values(final, effects)], least=least)
    except FAILURES:
        return None


def _others(models: ModelComparison, drawn: Fit) -> Iterator[ModelComparison]:
    """Give each zone a value of its own of what a drawing has one of, or the building what no drawing tells."""
    settings, told = models.settings, {p.base for p in drawn.built.network.parameters}
    for names in by_zone(models.case.building) if len(models.case.building.zone_names) > 1 else ():
        scopes: dict[str, Scope] = {name: "zone" for name in names if name in told and name not in settings.scopes}
        if scopes:
            yield models.built_as(replace(settings, scopes={**settings.scopes, **scopes}))
    for name in BY_EVIDENCE:
        other = models.built_as(replace(settings, structure=UNDRAWN[name].put(settings.structure)))
        if is_another(other.build(drawn.effects).network, drawn.built.network):
            yield other


def _differing(models: ModelComparison, effects: Effects, final: Fit) -> Iterator[ModelComparison]:
    """Let rooms differ in each effect of the whole building, where all else that was found is of single rooms."""
    left, structure = [e for e in final.effects if e not in effects], models.settings.structure
    if len(models.case.building.zone_names) == 1 or not all(CATALOGUE[e].takes_zones for e in left):
        return
    for effect in (e for e, where in effects.items() if e in MAY_DIFFER and not where):
        uneven = tuple(sorted({*structure.uneven, effect}))
        yield models.built_as(replace(models.settings, structure=replace(structure, uneven=uneven)))


def _rivals(rounds: Sequence[Round], known: Effects) -> Iterator[tuple[Effects, float]]:
    """Parts of what was found, from nothing on, and the evidence that a building by zone must have beside each.

    A name has to beat what needs none as clearly as it beat nothing; masses that need as many have to beat these so.
    """
    accepted = [(r, r.accepted) for r in rounds if r.accepted is not None]
    final, seen = rounds[-1].after, set()
    for dropped in range(len(accepted), -1, -1):
        before = final if not dropped else accepted[-dropped][0].before
        kept = {e: z for e, z in before.effects.items() if e in final.effects and (e in known or e not in _LIKE_MASSES)}
        if (names := frozenset(kept)) in seen:
            continue
        seen.add(names)
        left = [(r, a) for r, a in accepted if a.screened.effect not in kept]
        # evidence that the choice of zones has cost what is left
        price = sum(r.after.evidence - r.before.evidence - a.gain for r, a in left)
        yield kept, final.evidence - (ACCEPTED + price if left else -ACCEPTED)


def _values(fit: Fit, effects: Effects) -> dict[str, float]:
    """Parameters of a fit, its common ones for each zone, those of other effects left out [parameter units]."""
    parameters = fit.built.network.parameters
    return {p.name: fit.values[p.name] for p in parameters if p.effect is None or p.effect in effects}
