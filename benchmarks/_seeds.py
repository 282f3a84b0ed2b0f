"""Seeds on the command line."""

from __future__ import annotations

import argparse


def seed_range(text: str) -> range:
    """Read `A-B`, both included, or one seed.

    Parameters
    ----------
    text : str
        Of the command line.
    """
    first, _, last = text.partition("-")
    try:
        found = range(int(first), int(last or first) + 1)
    except ValueError:
        found = range(0)
    if not found:
        raise argparse.ArgumentTypeError(f"expected seeds such as 0-19, found {text!r}")
    return found
