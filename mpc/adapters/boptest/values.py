"""Arguments of requests: numbers and names from whatever a client has sent."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from mpc.errors import BoptestRequestError
from thermal.errors import nearest

#: Most values that one answer holds.
MOST_VALUES = 5_000_000


def number(name: str, value: Any, lowest: float = -math.inf, highest: float = math.inf) -> float:
    """Read a number as BOPTEST does, from a number or its text.

    Parameters
    ----------
    name : str
        Of the argument, for the message.
    value : object
        As it was sent.
    lowest, highest : float
        Range [unit of the argument].

    Raises
    ------
    BoptestRequestError
        When it is no finite number, or out of range.
    """
    try:
        found = float(value) if isinstance(value, int | float | str) else math.nan
    except (ValueError, OverflowError):
        found = math.nan
    if not math.isfinite(found):
        raise BoptestRequestError(
            f"Invalid value {_short(value)} for {name}. Value must be a finite number, or text that is one, but is "
            f"{type(value).__name__}."
        )
    if not lowest <= found <= highest:
        raise BoptestRequestError(
            f"Invalid value {_short(value)} for {name}. Value must be from {lowest:g} to {highest:g}."
        )
    return found


def flag(name: str, value: Any) -> bool:
    """Read the value of an activation.

    Parameters
    ----------
    name : str
        Of the input, for the message.
    value : object
        1 or 0, true or false, or text of one.

    Raises
    ------
    BoptestRequestError
        When it is neither.
    """
    text = str(value).strip().lower() if isinstance(value, bool | int | float | str) else ""
    if text in ("1", "1.0", "true"):
        return True
    if text in ("0", "0.0", "false"):
        return False
    raise BoptestRequestError(f"Invalid value {_short(value)} for input {name}. It must be 1 or 0, true or false.")


def names(argument: str, value: Any, known: Iterable[str]) -> list[str]:
    """Read a list of names.

    Parameters
    ----------
    argument : str
        Its name, for the message.
    value : object
        A list of names, or a single one.
    known : iterable of str
        What may stand there.

    Raises
    ------
    BoptestRequestError
        When it is no list of names, or a name is not known.
    """
    listed = [value] if isinstance(value, str) else value
    if not isinstance(listed, list) or not all(isinstance(name, str) for name in listed):
        raise BoptestRequestError(f"Invalid value for {argument}. It must be a list of names, but is {_short(value)}.")
    allowed = set(known)
    for name in listed:
        if name not in allowed:
            advice = nearest(name[:200], allowed)
            raise BoptestRequestError(f"Invalid point name {_short(name)} in parameter {argument}. {advice}".rstrip())
    return list(dict.fromkeys(listed))


def choice(name: str, value: Any, known: Mapping[str, Any], none: bool = False) -> str | None:
    """Read a setting that is one of some names.

    Parameters
    ----------
    name : str
        Of the setting, for the message.
    value : object
        As it was sent.
    known : mapping
        What it may be.
    none : bool
        Whether ``none`` and null are settings, too.

    Raises
    ------
    BoptestRequestError
        When it is none of them.
    """
    if none and (value is None or value == "none"):
        return None
    if not isinstance(value, str) or value not in known:
        raise BoptestRequestError(
            f"Scenario parameter {name} is {_short(value)}, but should be one of {', '.join(known)}."
        )
    return value


def time_or_infinite(name: str, value: Any) -> float:
    """Read a time that may be infinite, as clients ask for all that there is [s].

    Parameters
    ----------
    name : str
        Of the argument, for the message.
    value : object
        As it was sent.

    Raises
    ------
    BoptestRequestError
        When it is no number.
    """
    if isinstance(value, int | float | str) and str(value).strip().lower().lstrip("+-") in ("inf", "infinity"):
        return -math.inf if str(value).strip().startswith("-") else math.inf
    return number(f"parameter {name}", value)


def required(body: Mapping[str, Any], *arguments: str) -> list[Any]:
    """Take arguments that a request must have, and no others.

    Parameters
    ----------
    body : mapping
        Arguments by name.
    *arguments : str
        Their names.

    Raises
    ------
    BoptestRequestError
        Which one is missing or unknown.
    """
    for name in arguments:
        if name not in body:
            raise BoptestRequestError(f"Missing argument {name}. The request takes {', '.join(arguments)}.")
    allowed(body, arguments)
    return [body[name] for name in arguments]


def allowed(body: Mapping[str, Any], arguments: Iterable[str]) -> None:
    """Refuse arguments that a request does not take.

    Parameters
    ----------
    body : mapping
        Arguments by name.
    arguments : iterable of str
        What it takes.

    Raises
    ------
    BoptestRequestError
        Which one is unknown.
    """
    known = list(arguments)
    for name in body:
        if name not in known:
            raise BoptestRequestError(f"Unexpected argument {_short(name)}. The request takes {', '.join(known)}.")


def _short(value: Any) -> str:
    """Text of what was sent, cut where it is long."""
    try:
        text = repr(value)
    except ValueError:  # an integer of more digits than Python writes
        text = "a very long number"
    return text if len(text) <= 100 else f"{text[:100]}..."
