"""Answers of a BOPTEST server, checked: what they say is what was asked for, or an error says what came."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from mpc.errors import BoptestError
from mpc.loop.actuators import Actuator
from thermal._types import FloatArray
from thermal.errors import describe

_SAME = 1e-6  # of a value: beyond it another was used


def time_of(values: Any, what: str) -> float:
    """Read the time of measurements [s].

    Parameters
    ----------
    values : object
        Payload of a step or of a start.
    what : str
        Which, for the message.

    Raises
    ------
    BoptestError
        When there is none.
    """
    time = values.get("time") if isinstance(values, dict) else None
    if isinstance(time, bool) or not isinstance(time, int | float) or not math.isfinite(time):
        raise BoptestError(describe(f"measurements of {what}", "their time", repr(values)[:200]))
    return float(time)


def check_step(sent: Mapping[str, float], message: str, values: Any, expected: float) -> None:
    """Refuse an answer that says, openly or not, that the step was another one.

    Parameters
    ----------
    sent : mapping of str to float
        Inputs by name [their units].
    message : str
        Of the server.
    values : object
        Its payload.
    expected : float
        Time after the step [s].

    Raises
    ------
    BoptestError
        When the time is another, or the server used another value than was sent.
    """
    time = time_of(values, "a step")
    if abs(time - expected) > 1e-3:
        raise BoptestError(describe("time of the test", f"{expected:g} s", f"{time:g} s", "does another use it?"))
    for name, value in sent.items():
        used = values.get(name)
        if isinstance(used, int | float) and abs(used - value) > _SAME * max(abs(value), 1.0):
            raise BoptestError(f"input {name}: {value:g} was sent, the server used {used:g}: {message}")
    if "WARNING" in message:
        raise BoptestError(f"the server changed what was sent: {message}")


def actuator_of(name: str, entry: Mapping[str, Any]) -> Actuator:
    """Make an actuator of what a server says of an input.

    Parameters
    ----------
    name : str
        ``ENTITY/POINT``.
    entry : mapping
        Its metadata; null is no limit.
    """
    low, high = entry.get("Minimum"), entry.get("Maximum")
    most = sys.float_info.max
    lowest, highest = (-most if low is None else float(low)), (most if high is None else float(high))
    return Actuator(name, str(entry.get("Unit") or "1"), lowest, highest, required=False)


def regular(payload: Any, points: list[str]) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Bring results to one step, that of most of their times.

    Parameters
    ----------
    payload : object
        Lists of numbers by point, and of their times.
    points : list of str
        Which points.

    Returns
    -------
    tuple
        Times [s], and values by point [their units].

    Raises
    ------
    BoptestError
        When a list is missing, or there are not two values.
    """
    lists = {name: payload.get(name) if isinstance(payload, dict) else None for name in ("time", *points)}
    counts = {len(values) if isinstance(values, list) else -1 for values in lists.values()}
    if len(counts) > 1 or max(counts) < 2:
        raise BoptestError(describe("results", "two or more values of each point", repr(sorted(counts))))
    columns = {name: np.array(values, dtype=float) for name, values in lists.items()}
    times, first = np.unique(columns.pop("time"), return_index=True)
    columns = {name: values[first] for name, values in columns.items()}
    gaps = np.diff(times)
    if np.ptp(gaps) <= 1e-6 * gaps[0]:
        return times, columns
    count = max(round((times[-1] - times[0]) / float(np.median(gaps))), 1)
    even = np.linspace(times[0], times[-1], count + 1)
    return even, {name: np.interp(even, times, values) for name, values in columns.items()}
