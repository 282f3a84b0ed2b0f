"""Requests of operators: signed, for once, for a short time."""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mpc.errors import LiveError
from mpc.live.audit import canonical

#: How long a request may be under way, besides the guard's own wait between two looks [s].
VALID = 60.0

_SHAPES: Mapping[str, Mapping[str, Any]] = {
    "mode": {"points": list, "mode": str, "by": str, "nonce": str, "expires": int | float, "signature": str},
    "approve": {"points": list, "plan": int, "by": str, "nonce": str, "expires": int | float, "signature": str},
}  # fmt: skip


def operator_key(folder: Path) -> bytes:
    """Read the key that requests are signed by; made where there is none, for this user alone.

    Parameters
    ----------
    folder : Path
        Of the site's logs.
    """
    path = folder / "operator.key"
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        key = bytes.fromhex(path.read_text(encoding="ascii").strip())
        LiveError.unless(len(key) >= 32, "operator.key", "32 bytes in hexadecimal", f"{len(key)}", "delete the file")
        return key
    with os.fdopen(handle, "w", encoding="ascii") as file:
        file.write(secrets.token_hex(32))
    return operator_key(folder)


def sign(request: Mapping[str, Any], key: bytes, wall: float, by: str, tick: float = 0.0) -> dict[str, Any]:
    """Complete a request of an operator.

    Parameters
    ----------
    request : mapping
        ``kind`` (``mode`` or ``approve``), ``points``, and ``mode`` or ``plan``.
    key : bytes
        Of `operator_key`.
    wall : float
        Wall clock [s].
    by : str
        Who asks, for the log.
    tick : float
        Time between two looks of the guard [s]: a request waits for the next one.
    """
    made = {**request, "by": by, "nonce": secrets.token_hex(16), "expires": wall + VALID + 2.0 * tick}
    return made | {"signature": _signature(made, key)}


def checked_request(message: Mapping[str, Any], key: bytes) -> dict[str, Any]:
    """Take a request without its signature, and with ``invalid``, why it is none of an operator; empty where it is.

    Parameters
    ----------
    message : mapping
        As it came.
    key : bytes
        Of `operator_key`.
    """
    shape = _SHAPES.get(str(message.get("kind")), {})
    whole = set(message) == {"kind", *shape} and all(isinstance(message[k], kind) for k, kind in shape.items())
    if not shape or not whole or not all(isinstance(point, str) for point in message["points"]):
        told = {"kind": "mode", "points": [], "mode": "", "by": "", "nonce": "", "expires": 0.0}
        return told | {"invalid": "it is no request of the format"}
    request = {k: v for k, v in message.items() if k != "signature"}
    good = hmac.compare_digest(_signature(request, key).encode(), str(message["signature"]).encode())
    return request | {"invalid": "" if good else "its signature is not an operator's"}


def _signature(request: Mapping[str, Any], key: bytes) -> str:
    return hmac.new(key, canonical(request).encode(), hashlib.sha256).hexdigest()
