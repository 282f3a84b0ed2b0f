"""Challenge of what a search found: slabs and furniture of each zone's own, which no instrument is to blame for.

A drawing has one value for the masses of all zones, and zones differ in them. What that leaves is taken for a meter
that is wrong zone by zone, and gains as much as a true one.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.diagnosis.decide.verdict import judge
from calibration.diagnosis.refit.comparison import Fit, ModelComparison
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

    They are weighed against all that was found, or against that part of it which acts as masses do; and where something
    is left that no effect explains, against nothing.

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
    zoned = ModelComparison(models.case, settings, models.tuned, models.judged, models.horizon)
    known = dict(rounds[0].before.effects)
    kept = {e: z for e, z in final.effects.items() if e not in _LIKE_MASSES or e in known}
    kept = known if len(kept) == len(final.effects) else kept
    # a name has to beat what needs none as clearly as it beat nothing; what needs none has to beat nothing so too
    margin = ACCEPTED + _price(rounds) if final.effects.keys() - known else -ACCEPTED
    try:
        other = zoned.fit(kept, [_values(final, kept)])
        if other.evidence < final.evidence - margin:
            return models, tuple(rounds)
        baseline = other if kept == known else zoned.fit(known, [_values(final, known)])
    except (ArithmeticError, np.linalg.LinAlgError, CalibrationError, ModelError):
        return models, tuple(rounds)
    return zoned, search(zoned, baseline, held_out(zoned, baseline), candidates, progress)


def _price(rounds: Sequence[Round]) -> float:
    """Evidence that the choice of zones has cost what was accepted [-]."""
    accepted = [(r, r.accepted.gain) for r in rounds if r.accepted is not None]
    return sum(r.after.evidence - r.before.evidence - gain for r, gain in accepted)


def _values(fit: Fit, effects: dict[str, tuple[str, ...]]) -> dict[str, float]:
    """Parameters of a fit, its common ones for each zone, those of other effects left out [parameter units]."""
    parameters = fit.built.network.parameters
    return {p.name: fit.values[p.name] for p in parameters if p.effect is None or p.effect in effects}
