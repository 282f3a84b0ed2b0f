"""A PostgreSQL server for the historian."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest


@pytest.fixture(scope="session")
def postgres(start_postgres: Callable[[str], Any]) -> Any:
    """A server that runs; a test that stops it starts it again."""
    return start_postgres("live")
