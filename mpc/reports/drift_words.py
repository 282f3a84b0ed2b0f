"""How the error of free runs grows, in plain words."""

import numpy as np

from calibration.diagnosis.decide.where import DriftCurve
from mpc.reports.page import duration, kelvin

#: Share of the last value from which the growth of an error counts as levelled off [-].
_LEVEL = 0.8


def drift_sentence(found: str, before: DriftCurve, after: DriftCurve | None = None) -> str:
    """Say what the growth of the error tells.

    Parameters
    ----------
    found : str
        What the final model is called, such as ``with the effect found``.
    before : DriftCurve
        Of the calibrated model.
    after : DriftCurve, optional
        Of the final model, where it has an effect.
    """
    text = f"Left to itself, the calibrated model's error {growth_words(before)}; it is {end_words(before)}."
    if after is None:
        return text
    if after.kind == before.kind != "hump":
        slope = f"{max(0.0, after.slope):.2f}"
        return f"{text} {found.capitalize()} it grows alike (slope {slope}) and is {end_words(after)}."
    return f"{text} {found.capitalize()} it {growth_words(after)}; it is {end_words(after)}."


def growth_words(curve: DriftCurve) -> str:
    """Say how the error of free runs grows and what makes it so.

    Parameters
    ----------
    curve : DriftCurve
        Of a model.
    """
    how = f"slope {max(0.0, curve.slope):.2f}"
    if curve.hump is not None:
        at, top, low = curve.hump
        return (
            f"is largest {duration(at)} after the start ({kelvin(top)} K) and then falls to {kelvin(low)} K, as "
            "where the mass of air and furniture is wrong or a sensor lags"
        )
    if curve.kind == "sensors":
        cause = "as where readings are off, or air has yet to mix after a switch"
        return f"is there from the first step and hardly grows ({how}), {cause}"
    if curve.kind == "random":
        return f"grows with the square root of time at first ({how}), as where heat comes and goes at random"
    return f"grows nearly in proportion to time at first ({how}), as where heat is missing for hours on end"


def end_words(curve: DriftCurve) -> str:
    """Say where the error of free runs ends, and how soon it is near that.

    Parameters
    ----------
    curve : DriftCurve
        Of a model.
    """
    last, span = float(curve.rms[-1]), f"{curve.seconds[-1] / 3600.0:g} hours"
    near = float(curve.seconds[int(np.argmax(curve.rms >= _LEVEL * last))])
    ends = f"{kelvin(last)} K after {span}"
    if near <= curve.seconds[0] or curve.kind in ("sensors", "hump"):
        return ends
    if near > 0.5 * curve.seconds[-1]:
        return f"{ends}, and still grows there"
    about = f"{near / 3600.0:.0f} hours" if near >= 5400.0 else duration(near)
    return f"{ends}, four fifths of which it has after {about}"
