"""What every connection gives and takes; values are in the library's units."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, Protocol


def reading(value: float | None, slots: Mapping[str, float] | None = None, error: str = "") -> dict[str, Any]:
    """Give what a point shows, in plain types.

    Parameters
    ----------
    value : float or None
        [library's unit]; what is not finite becomes None.
    slots : mapping of str to float, optional
        Values by priority that are not empty [library's unit]; None where there are no priorities.
    error : str
        Why it could not be read.
    """
    finite = value is not None and math.isfinite(value)
    kept = None if slots is None else {key: v for key, v in slots.items() if math.isfinite(v)}
    return {"value": float(value) if finite and value is not None else None, "slots": kept, "error": error}


class Link(Protocol):
    """A connection."""

    async def open(self) -> None:
        """Begin; a device that does not answer is no error here."""

    async def read(self, names: Iterable[str], slots: bool) -> dict[str, dict[str, Any]]:
        """Read points, each as `reading`; it never raises for a device's sake.

        Parameters
        ----------
        names : iterable of str
            Of the site's points on this connection.
        slots : bool
            Whether the values by priority are wanted.
        """

    async def write(self, name: str, value: float | None) -> str:
        """Write a value, or give a point back; say why not, or nothing.

        Parameters
        ----------
        name : str
            Point.
        value : float or None
            [library's unit]; None relinquishes.
        """

    async def close(self) -> None:
        """End."""
