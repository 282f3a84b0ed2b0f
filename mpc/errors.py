"""The error family of the package."""

from __future__ import annotations


class MpcError(Exception):
    """Base of every error that `mpc` raises on purpose."""
