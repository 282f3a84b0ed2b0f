"""Open windows sought again with a fitted model, where what fits best may be their shadow.

When a window stood open is guessed before anything is fitted, and a poor guess lets another effect win that takes heat
at like times. What is seen with that effect's parameters, and without its heat, is the guess of a calibrated building.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calibration.diagnosis.refit.comparison import Fit
from calibration.diagnosis.refit.refit import Refit, Work
from calibration.diagnosis.screen.gains import Gain
from calibration.diagnosis.screen.openings import openings_beyond
from thermal._types import FloatArray
from thermal.effects.catalogue import CATALOGUE

#: The effect whose signal is seen and not measured.
WINDOWS = "window_opening"

#: Most times that a round looks again.
_LOOKS = 2


def look_again(work: Work, gains: Sequence[Gain], refits: Sequence[Refit], best: Refit | None) -> list[Refit]:
    """Fit open windows anew as they are seen beyond the best model, where that is confounded with them.

    The new openings are those of the case from then on where the fit with them gains more than any before; else the
    old ones stay.

    Parameters
    ----------
    work : Work
        Of the round; the openings of its drivers may change.
    gains : sequence of Gain
        Of all effects by tangents.
    refits : sequence of Refit
        Those fitted.
    best : Refit or None
        The one that would be accepted.

    Returns
    -------
    list of Refit
        The refits, the best first, with at most one of open windows.
    """
    screened = next((g for g in gains if g.effect == WINDOWS), None)
    if screened is None or best is None or not _may_be_windows(best.screened.effect):
        return list(refits)
    found, drivers = next((r for r in refits if r.screened.effect == WINDOWS), None), work.bench.drivers
    exposed = {p.member for p in work.made.parameters if p.effect == WINDOWS}
    fit, own = best.fit, best.screened.effect
    for _ in range(_LOOKS):
        opened = openings_beyond(fit.built.grid, _without(fit, own), drivers, fit.built.inputs)
        zones = tuple(z for k, z in enumerate(drivers.zones) if z in exposed and opened[:, k].any())
        if not zones or np.array_equal(opened, drivers.openings):
            break
        before, drivers.openings = drivers.openings, opened
        start = {p.name: fit.values[p.name] for p in fit.built.network.parameters if p.effect != own}
        again = work.refit([replace(screened, zones=zones, places=len(zones))], start)
        if again is None or again.gain <= (screened.gain if found is None else found.gain):
            drivers.openings = before
            break
        found, fit, own = again, again.fit, WINDOWS
    others = [r for r in refits if r.screened.effect != WINDOWS]
    return sorted([*others, *([] if found is None else [found])], key=lambda r: -r.gain)


def _may_be_windows(effect: str) -> bool:
    return effect == WINDOWS or WINDOWS in CATALOGUE[effect].confounders


def _without(fit: Fit, effect: str) -> FloatArray:
    """Parameters of a fit with one effect absent [parameter units]."""
    parameters = fit.built.network.parameters
    return np.array([p.start if p.effect == effect else fit.values[p.name] for p in parameters])
