"""Effects that all zones have with one strength: columns of a screening that are sums of others."""

from collections.abc import Sequence
from dataclasses import replace

from calibration.diagnosis.refit.comparison import is_strength
from thermal.parameters import Parameter


def alike(parameters: Sequence[Parameter], effects: Sequence[str]) -> dict[Parameter, list[int]]:
    """Strengths that zones share where they are alike, with the positions of those that are made one.

    Parameters
    ----------
    parameters : sequence of Parameter
        Of a model with the effects in every zone.
    effects : sequence of str
        That one cause may give all zones.
    """
    found: dict[Parameter, list[int]] = {}
    for i, p in enumerate(parameters):
        if p.effect in effects and p.member is not None and is_strength(p.name, p.effect):
            found.setdefault(replace(p, name=p.base, scope="global", member=None), []).append(i)
    return {p: mine for p, mine in found.items() if len(mine) > 1}
