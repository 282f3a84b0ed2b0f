"""What a diagnosis says where a drawing does not hold, so that effects were sought about a free structure."""

from dataclasses import replace

from calibration.diagnosis.correction import CORRECTED
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.free import FOUND, is_recurring, recurs
from calibration.fit.ladder import CLOCK
from mpc.reports.evaluation import structure_words
from mpc.reports.page import kelvin, listed

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
    found = recurs(result.rungs) if is_recurring(result.verdict) else None
    gains = "" if found is None else (
        "Heat that recurs from day to day, with a course of its own in each zone, is missing: most likely people and "
        f"what they use. It lowers the error of those days from {kelvin(found[0])} to {kelvin(found[1])} K. "
    )  # fmt: skip
    drawing = "as drawn with what was found" if result.rungs[0].name == "named" else "as drawn"
    return (
        f"The drawing does not hold: the building {structure_words(free)} misses tuning days that were left "
        f"out by {kelvin(own)} K, {drawing} by {kelvin(drawn)} K."
        f"{' calibration.json holds it, and effects' if free is others else ' Effects'} were sought about it. "
        f"{_in_its_place(result)}{gains}"
    )


def _in_its_place(result: Diagnosis) -> str:
    """Say what a structure errs by with what was found in place of its own, where it is not what is handed on."""
    named = next((r for r in result.rungs if r.name == FOUND and not r.chosen), None)
    return "" if named is None else (
        "With what was found, below, in the place of what that structure has itself, such as apertures for the sun, it "
        f"misses those days by {kelvin(named.left_out_mae)} K. "
    )  # fmt: skip


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
    moved = result.drawing_fails and any(r.name == "shifted" for r in result.rungs)
    return [e for e in result.rounds[0].before.effects if not (moved and e == CLOCK)]
