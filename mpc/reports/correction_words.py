"""What a diagnosis says of heat of unknown cause: what it answers to, where, how much, and how far the error falls."""

from typing import Any

from calibration.diagnosis.diagnosis import Diagnosis
from mpc.reports.page import kelvin, listed, percent, watts
from thermal.effects.unknown import ANSWERS_TO

#: Most kinds of heat that a sentence names, and more zones than this are counted.
_MOST, _MOST_ZONES = 2, 3


def correction_sentence(result: Diagnosis) -> str:
    """Say which heat of unknown cause is certified, and how far the error falls with it; nothing where none is.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    found = result.correction
    if found is None:
        return ""
    kinds = [
        f"{ANSWERS_TO[d.effect]} in {_places(d.zones)} ({_range(d.watts)}, root mean square)"
        for d in found.drivers[:_MOST]
    ]
    more = len(found.drivers) - len(kinds)
    kinds += [f"{more} more kind{'s' if more > 1 else ''}"] if more else []
    text = (
        f" Heat of unknown cause makes up for a part of it: with {listed(kinds)}. It was chosen on some days and "
        f"lowers the errors of others; on held-out days the error falls from {kelvin(found.before.mae)} to "
        f"{kelvin(found.after.mae)} K with it"
    )
    text += f", {percent(min(found.share_closed, 1.0))} of what could be closed." if found.share_closed else "."
    return text + (" For prediction and control calibration.json holds it." if result.taken is found.fit else "")


def faults_sentence(result: Diagnosis) -> str:
    """Say what is wrong with the telemetry itself, and how far the error falls once that is mended.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    if not result.faults:
        return ""
    told = [
        f"{f.seen.what}. With that put right tuning days that are left out are missed by {kelvin(f.after.left_out)} K "
        f"instead of {kelvin(f.before.left_out)} K. Advice: {f.seen.advice}."
        for f in result.faults
    ]
    return f"The telemetry itself is wrong: {' And '.join(told)} All that follows is about the mended telemetry. "


def driver_rows(result: Diagnosis) -> list[dict[str, Any]]:
    """Rows of the page's table of heat of unknown cause.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    """
    if result.correction is None:
        return []
    rows = []
    for d in result.correction.drivers:
        low, high = (sum(e[k] for e in d.interval.values()) for k in (0, 1))
        total = sum(d.mean.values())
        rows.append({
            "answers_to": ANSWERS_TO[d.effect], "zones": _places(d.zones), "watts": _range(d.watts),
            "interval": f"{watts(low)} to {watts(high)}",
            "mean": f"{'+' if total > 0 else ''}{watts(total)}", "share": d.share, "p_value": d.p_value,
        })  # fmt: skip
    return rows


def _places(zones: tuple[str, ...]) -> str:
    return listed(list(zones)) if len(zones) <= _MOST_ZONES else f"{len(zones)} zones"


def _range(sizes: dict[str, float]) -> str:
    low, high = min(sizes.values()), max(sizes.values())
    return watts(low) if watts(low) == watts(high) else f"{watts(low)} to {watts(high)}"
