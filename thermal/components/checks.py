"""What parameters and actions must satisfy, refused by name."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import ModelError


def in_range(where: str, value: float, unit: str, lowest: float, highest: float, advice: str = "") -> None:
    """Refuse a parameter [its unit] that is no number within its range."""
    if not (isinstance(value, int | float | np.floating | np.integer) and lowest <= value <= highest):
        raise ModelError(where, f"{lowest:g} to {highest:g} {unit}", repr(value), advice)


def all_in_range(
    where: str, values: ArrayLike, size: int, unit: str, lowest: float, highest: float
) -> NDArray[np.float64]:
    """Return one value a device [its unit], spread from a single one; refuse what is no number within the range."""
    try:
        array = np.asarray(values, dtype=float)
        spread = np.array(np.broadcast_to(array, (size,)))
    except (TypeError, ValueError):
        raise ModelError(where, f"a number or {size} of them", f"shape {np.shape(values)}") from None
    bad = ~((spread >= lowest) & (spread <= highest))
    if bad.any():
        first = int(np.argmax(bad))
        raise ModelError(f"{where}[{first}]", f"{lowest:g} to {highest:g} {unit}", repr(float(spread[first])))
    spread.setflags(write=False)
    return spread


def action(name: str, values: NDArray[np.float64], unit: str, lowest: float, highest: float) -> None:
    """Refuse actions or conditions that are not finite or out of range, the first bad one by its place."""
    # arg-extrema are several times faster than extrema, and both find what is not a number
    if not (values.item(values.argmin()) >= lowest and values.item(values.argmax()) <= highest):
        place = int(np.argmax(~((values >= lowest) & (values <= highest))))
        _refuse(f"{name}[{place}]", float(values.flat[place]), unit, lowest, highest)


def scalar_action(name: str, value: float, unit: str, lowest: float, highest: float) -> None:
    """Refuse an action or condition that is not finite or out of range."""
    if not lowest <= value <= highest:
        _refuse(name, value, unit, lowest, highest)


def _refuse(where: str, value: float, unit: str, lowest: float, highest: float) -> None:
    advice = "a setpoint in degC must be converted to K" if unit == "K" and 0.0 < value < lowest else ""
    found = repr(value) if math.isfinite(value) else f"{value} (not finite)"
    raise ModelError(where, f"{lowest:g} to {highest:g} {unit}", found, advice)
