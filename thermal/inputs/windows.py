"""Air that passes an open window: by wind and warmth on one side of a room or across it, or whatever they are."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from thermal._types import FloatArray

#: Flow per area [m/s] by the wind's speed [m/s] and the difference of the temperatures [K].
WindowLaw = Callable[[FloatArray, FloatArray], FloatArray]

#: Standard acceleration of free fall [m/s2].
_GRAVITY = 9.80665

#: Height of a window [m], and temperature at which warm air is so much lighter [K].
_HEIGHT, _TEMPERATURE = 1.0, 285.0

#: Air that a wind at an angle drives through an opening over the wind's speed there, which among houses is half of what
#: a station at 10 m on a field measures; and discharge of an opening [-].
_BY_WIND, _DISCHARGE = 0.3 * 0.5, 0.65

#: Wind [m/s] and difference of the temperatures [K] that are usual in winter.
_USUAL = np.array(3.0), np.array(15.0)


def on_one_side(wind: FloatArray, difference: FloatArray) -> FloatArray:
    """Flow per area where air comes and goes by the same window, ``½ (0.001 v² + 0.0035 h |ΔT| + 0.01)^½`` [m/s].

    de Gids and Phaff 1982, Air Infiltration Review 4(1), 1-5.

    Parameters
    ----------
    wind : ndarray
        Speed v [m/s].
    difference : ndarray
        Of the temperatures ΔT [K].

    Examples
    --------
    >>> round(float(on_one_side(np.array(4.0), np.array(10.0))), 3)
    0.123
    """
    return np.asarray(0.5 * np.sqrt(0.001 * wind**2 + 0.0035 * _HEIGHT * np.abs(difference) + 0.01))


def across(wind: FloatArray, difference: FloatArray) -> FloatArray:
    """Flow per area where air leaves by another way than it came in, ``((C_v v)² + C_D² 2 g Δh |ΔT| / T)^½`` [m/s].

    Half of the window's height lies between its middle and where pressures are alike. ASHRAE Handbook Fundamentals,
    chapter 16, flow through large openings, with ``C_v`` of winds at an angle and the wind's speed of chapter 24.

    Parameters
    ----------
    wind : ndarray
        Speed v [m/s].
    difference : ndarray
        Of the temperatures ΔT [K].

    Examples
    --------
    >>> round(float(across(np.array(4.0), np.array(10.0))), 3)
    0.711
    """
    stack = _DISCHARGE**2 * 2.0 * _GRAVITY * 0.5 * _HEIGHT * np.abs(difference) / _TEMPERATURE
    return np.asarray(np.sqrt((_BY_WIND * wind) ** 2 + stack))


def steady(wind: FloatArray, difference: FloatArray) -> FloatArray:
    """Flow per area that neither wind nor warmth changes: a sheltered window, or a fan that is as strong as one [m/s].

    Parameters
    ----------
    wind : ndarray
        Speed [m/s].
    difference : ndarray
        Of the temperatures [K].

    Examples
    --------
    >>> round(float(steady(np.array(4.0), np.array(10.0))), 3)
    0.134
    """
    return np.full(np.broadcast(wind, difference).shape, float(on_one_side(*_USUAL)))


def counted_on_one_side(law: WindowLaw) -> WindowLaw:
    """Count areas in those that pass as much air on one side of a room in usual wind and cold.

    So that areas by one law are comparable to those by another.

    Parameters
    ----------
    law : callable
        One of the laws.

    Examples
    --------
    >>> round(float(counted_on_one_side(across)(*_USUAL) / on_one_side(*_USUAL)), 12)
    1.0
    """
    share = float(on_one_side(*_USUAL) / law(*_USUAL))
    return lambda wind, difference: np.asarray(share * law(wind, difference))
