"""Requests of clients, as they come over the wire: bodies, numbers, names and overwritten inputs, each checked."""

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple
from urllib.parse import parse_qs

from mpc.adapters.foreign import activation
from mpc.errors import BoptestRequestError
from mpc.loop.actuators import Actuator
from thermal.errors import nearest

#: Longest body that is read [bytes].
LONGEST_BODY = 1_000_000

#: Most values that one answer holds.
MOST_VALUES = 1_000_000

_FORM = "application/x-www-form-urlencoded"
_MOST_FIELDS = 20_000


class Answer(NamedTuple):
    """What a request is answered with, beside the status 200.

    Parameters
    ----------
    message : str
        For people.
    payload : object
        What was asked for, of plain types.
    """

    message: str
    payload: Any


def read_body(body: bytes, content_type: str) -> dict[str, Any]:
    """Read the arguments of a request; an empty body has none, and a field that comes several times is a list.

    Parameters
    ----------
    body : bytes
        As it was sent.
    content_type : str
        What it says to be: a form, or else JSON.

    Raises
    ------
    BoptestRequestError
        When it cannot be read, or is no object.

    Examples
    --------
    >>> read_body(b"step=900", "application/x-www-form-urlencoded")
    {'step': '900'}
    >>> read_body(b'{"step": 900}', "application/json")
    {'step': 900}
    """
    if not body.strip():
        return {}
    try:
        text = body.decode("utf-8")
    except UnicodeDecodeError as error:
        raise BoptestRequestError(f"The body is no UTF-8: {error.reason} at byte {error.start}.") from error
    if content_type.partition(";")[0].strip().lower() == _FORM:
        try:
            fields = parse_qs(text, keep_blank_values=True, max_num_fields=_MOST_FIELDS)
        except ValueError as error:
            raise BoptestRequestError(f"The body is no form: {error}.") from error
        return {name: values[0] if len(values) == 1 else values for name, values in fields.items()}
    try:
        found = json.loads(text)
    except RecursionError as error:
        raise BoptestRequestError("The body is no JSON: too many brackets within each other.") from error
    except ValueError as error:
        raise BoptestRequestError(f"The body is no JSON: {str(error)[:200]}.") from error
    if not isinstance(found, dict):
        raise BoptestRequestError(f"The body must be a JSON object, but is {type(found).__name__}.")
    return found


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
    allowed = dict.fromkeys(known)  # in their order, so that an advice is the same each time
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


class _Overwrites(NamedTuple):
    """Inputs that a step overwrites.

    Parameters
    ----------
    given : dict of str to float
        Setpoints by actuator, within their ranges [unit of the actuator].
    active : tuple of str
        Names of the inputs.
    warnings : str
        What was clipped, in BOPTEST's words; empty when nothing was.
    """

    given: dict[str, float]
    active: tuple[str, ...]
    warnings: str


def read_overwrites(body: Mapping[str, Any], inputs: Mapping[str, Actuator]) -> _Overwrites:
    """Read the arguments of an advance; values out of range are clipped, as BOPTEST does.

    Parameters
    ----------
    body : mapping
        Values and activations by name.
    inputs : mapping of str to Actuator
        By the name of the signal.

    Raises
    ------
    BoptestRequestError
        When a name is unknown, a value is no number, or an active input has none.
    """
    values = {name: value for name, value in body.items() if name in inputs}
    switches = {activation(name): name for name in inputs}
    for name in body:
        if name not in values and name not in switches:
            raise BoptestRequestError(f"Unexpected input variable: {name[:200]}.")
    warnings: list[str] = []
    used = {n: _clipped(n, value, inputs[n], warnings) for n, value in values.items() if value is not None}
    given: dict[str, float] = {}
    active: list[str] = []
    for switch, name in switches.items():
        if body.get(switch) is not None and flag(switch, body[switch]):
            if name not in used:
                raise BoptestRequestError(f"Input {switch} is 1, but {name} has no value.")
            given[inputs[name].name] = used[name]
            active.append(name)
    return _Overwrites(given, tuple(active), ";".join(warnings))


def _clipped(name: str, value: Any, actuator: Actuator, warnings: list[str]) -> float:
    """Move a value into the range of its input, with a warning where it was not there."""
    found = number(f"input {name}", value)
    used = min(max(found, actuator.lowest), actuator.highest)
    if used != found:
        side = "above maximum" if found > used else "below minimum"
        warnings.append(f"WARNING: value of {found} for {name} is {side} of {used}.  Using {used}. ")
    return used


def _short(value: Any) -> str:
    """Text of what was sent, cut where it is long."""
    try:
        text = repr(value)
    except ValueError:  # an integer of more digits than Python writes
        text = "a very long number"
    return text if len(text) <= 100 else f"{text[:100]}..."
