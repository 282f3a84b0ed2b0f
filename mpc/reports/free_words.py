"""What a diagnosis says where a drawing does not hold, so that effects were sought about a free structure."""

from dataclasses import replace

import numpy as np

from calibration.diagnosis.correction import CORRECTED
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.free import GAINS, is_recurring, recurs
from calibration.fit.ladder import CLOCK
from mpc.reports.evaluation import structure_words
from mpc.reports.page import kelvin, listed, sure, watts
from thermal.network.gains import daily_gains

#: Share of the squared error from which a kind of heat is named [-], and most kinds that are.
_SHOWN, _MOST = 0.05, 2


def free_sentence(result: Diagnosis) -> str:
    """Say that the drawing does not hold, and what the rest is about; nothing where it does.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    if not result.drawing_fails:
        return ""
    others = [r for r in result.rungs if r.name != CORRECTED]
    best = min(others, key=lambda r: r.left_out_mae)
    free = [replace(r, chosen=r is best) for r in others] if len(others) < len(result.rungs) else others
    own, drawn = next(r.left_out_mae for r in free if r.chosen), result.rungs[0].left_out_mae
    lumped, people = result.settings.structure.lumped, _recurring_sentence(result)
    drawing = (
        f"{'The drawing does not hold: the' if lumped else 'The'} building {structure_words(free)} misses tuning days "
        f"that were left out by {kelvin(own)} K, as drawn by {kelvin(drawn)} K."
        f"{' calibration.json holds it, and effects' if free is others else ' Effects'} were sought about it. "
    )
    return drawing + people if lumped else people + drawing


def _recurring_sentence(result: Diagnosis) -> str:
    """Say what people's heat does where a structure holds it, and where it swings most; nothing otherwise."""
    found = recurs(result.rungs) if is_recurring(result.verdict) else None
    if found is None:
        return ""
    chance = sure(next(c.probability for c in result.verdict.candidates if c.effect == GAINS))
    courses = {zone: daily_gains(zone, result.final.values) for zone in result.final.built.network.zones}
    zone = max(courses, key=lambda z: float(np.ptp(courses[z])))
    swing, hour = watts(float(np.ptp(courses[zone]))), int(np.argmax(courses[zone]))
    return (
        "Heat that recurs from day to day, with a course of its own in each zone, is missing: most likely people and "
        f"what they use ({chance} sure). It lowers the error of tuning days that were left out from {kelvin(found[0])} "
        f"to {kelvin(found[1])} K. It swings most in zone {zone}, by {swing} per m² of floor, and is largest at "
        f"{hour}:00. "
    )


def comes_back(result: Diagnosis) -> str:
    """Say what is left of the error, and what it answers to; nothing where that was not judged.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    left = result.left_over
    if left is None:
        return ""
    if not left.counts:
        return " What is left of it does not come back on other days with weather or clock: much of it is chance."
    most = [kind for kind in sorted(left.shares, key=lambda k: -left.shares[k]) if left.shares[kind] > _SHOWN]
    to = f", most of all with {listed(most[:_MOST])}" if most else ""
    return f" {kelvin(left.fall)} K of what is left come back on days that were left out{to}."


def known_effects(result: Diagnosis) -> list[str]:
    """Name effects of the baseline that somebody knew of, and that are no part of a free structure.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    moved = result.drawing_fails and any(r.chosen and r.name == "shifted" for r in result.rungs)
    return [e for e in result.rounds[0].before.effects if not (moved and e == CLOCK)]
