"""Bodies of requests: JSON up to a size, and what it has to hold."""

import json
from typing import Any, TypeVar

from fastapi import Request
from pydantic import TypeAdapter, ValidationError

from thermal.errors import LabelError, OversizedFileError
from thermal.plan.guard import first_fault

MOST_WORDS = 100_000  # bytes of a request that is no draft

Wanted = TypeVar("Wanted")


async def read_json(request: Request, most: int = MOST_WORDS) -> Any:
    """Read the body of a request.

    Parameters
    ----------
    request : Request
        With JSON in UTF-8.
    most : int
        Largest size [bytes].

    Returns
    -------
    object
        Plain types.

    Raises
    ------
    LabelError
        It is no JSON, or blocks within blocks without end.
    OversizedFileError
        It is larger.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip()
    LabelError.unless(kind == "application/json", "content-type", "application/json", repr(kind[:60]))
    parts, size = [], 0
    async for chunk in request.stream():
        size += len(chunk)
        OversizedFileError.unless(size <= most, "body", f"at most {most / 1e6:g} MB", "more")
        parts.append(chunk)
    try:
        return json.loads(b"".join(parts))
    except (ValueError, RecursionError) as error:  # ValueError: no UTF-8, no JSON, an integer of 5000 digits
        raise LabelError("body", "JSON", f"{type(error).__name__}: {error}"[:200]) from error


def checked(wanted: type[Wanted], content: Any, where: str) -> Wanted:
    """Make what is wanted of a body, or say what does not fit.

    Parameters
    ----------
    wanted : type
        A model, or a list of one.
    content : object
        Plain types.
    where : str
        For the message.

    Returns
    -------
    object
        Of that type.

    Raises
    ------
    LabelError
        The first thing that does not fit.
    """
    try:
        return TypeAdapter(wanted).validate_python(content)
    except ValidationError as error:
        raise LabelError(*first_fault(error, where)) from error


def entry(content: Any, key: str) -> Any:
    """Value of a key of a body.

    Parameters
    ----------
    content : object
        Plain types.
    key : str
        Of the value.

    Raises
    ------
    LabelError
        The body is no object that has it.
    """
    there = isinstance(content, dict) and key in content
    LabelError.unless(there, "body", f"an object with the key {key!r}", repr(content)[:80])
    return content[key]
