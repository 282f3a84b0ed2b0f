"""Challenge of what a search found: slabs and furniture of each zone's own, which no instrument is to blame for.

A drawing has one value for the masses of all zones, and zones differ in them. What that leaves is taken for a meter
that is wrong zone by zone, and gains as much as a true one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from calibration.diagnosis.decide.verdict import judge
from calibration.diagnosis.refit.comparison import Effects, Fit, ModelComparison
from calibration.diagnosis.refit.refit import ACCEPTED, held_out
from calibration.diagnosis.refit.search import Round, search
from calibration.errors import CalibrationError
from calibration.fit.fitted_case import is_large
from calibration.fit.ladder import MASSES
from calibration.progress import Progress
from thermal.errors import ModelError
from thermal.parameters import Scope

#: Effects that give a zone a part of its metered heat more or less, as another mass of the zone seems to.
_LIKE_MASSES = frozenset({"flow_gain", "duct_loss", "capacity_limit"})

#: What says itself that masses are not as drawn.
_MASS = "hidden_mass"


def challenge(
    models: ModelComparison, rounds: Sequence[Round], candidates: Sequence[str], progress: Progress | None = None
) -> tuple[ModelComparison, tuple[Round, ...]]:
    """Search anew about a building with masses by zone, where these are better evidence than what was found.

    They are weighed against what was found, alone and beside as much of it as does not act as masses do: what zones
    differ in takes further effects to imitate, and hides what is missing. Where something is left that no effect
    explains, they are weighed against nothing.

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
    final = rounds[-1].after
    name = judge(rounds, {}).name
    zones, parameters = models.case.building.zone_names, rounds[0].before.built.network.parameters
    scopes: dict[str, Scope] = {p.base: "zone" for p in parameters if p.base in MASSES}
    if len(zones) < 2 or is_large(zones) or not scopes or name == "no_gap" or _MASS in final.effects:
        return models, tuple(rounds)
    settings = replace(models.settings, scopes={**models.settings.scopes, **scopes})
    zoned = replace(models, settings=settings, tune=models.tuned, hold_out=models.judged)
    zoned.drivers.openings = models.drivers.openings
    known = dict(rounds[0].before.effects)
    try:
        for effects, least in _rivals(rounds, known):
            other = zoned.fit(effects, [_values(final, effects)])
            if other.evidence >= least:
                baseline = other if effects == known else zoned.fit(known, [_values(final, known)])
                return zoned, search(zoned, baseline, held_out(zoned, baseline), candidates, progress)
    except (ArithmeticError, np.linalg.LinAlgError, CalibrationError, ModelError):
        pass
    return models, tuple(rounds)


def _rivals(rounds: Sequence[Round], known: Effects) -> Iterator[tuple[Effects, float]]:
    """Parts of what was found, from nothing on, and the evidence that masses by zone must have beside each.

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
