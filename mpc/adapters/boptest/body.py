"""Bodies of requests: JSON or a form, of a bounded size, into arguments by name."""

from __future__ import annotations

import json
from typing import Any
from urllib.parse import parse_qsl

from mpc.errors import BoptestRequestError

#: Longest body that is read [bytes].
LONGEST_BODY = 1_000_000

_FORM = "application/x-www-form-urlencoded"
_MOST_FIELDS = 20_000


def read_body(body: bytes, content_type: str) -> dict[str, Any]:
    """Read the arguments of a request; an empty body has none.

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
        return _form(text)
    try:
        found = json.loads(text)
    except RecursionError as error:
        raise BoptestRequestError("The body is no JSON: too many brackets within each other.") from error
    except ValueError as error:
        raise BoptestRequestError(f"The body is no JSON: {str(error)[:200]}.") from error
    if not isinstance(found, dict):
        raise BoptestRequestError(f"The body must be a JSON object, but is {type(found).__name__}.")
    return found


def _form(text: str) -> dict[str, Any]:
    """Fields of a form; one that comes several times is a list."""
    try:
        pairs = parse_qsl(text, keep_blank_values=True, max_num_fields=_MOST_FIELDS)
    except ValueError as error:
        raise BoptestRequestError(f"The body is no form: {error}.") from error
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name not in found:
            found[name] = value
        elif isinstance(found[name], list):
            found[name].append(value)
        else:
            found[name] = [found[name], value]
    return found
