"""A PostgreSQL server with tables to import."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest


@pytest.fixture(scope="session")
def postgres(start_postgres: Callable[[str], Any]) -> str:
    """Address of a server of its own on a Unix socket."""
    return str(start_postgres("telemetry").address)
