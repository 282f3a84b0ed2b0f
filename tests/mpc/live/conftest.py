"""A PostgreSQL server, started and stopped by the tests; skipped by name where it or its driver is absent."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"


@pytest.fixture(scope="session")
def helper() -> Callable[[str], ModuleType]:
    """Load a module of the benchmarks, which are scripts of one folder and no package."""

    def load(name: str) -> ModuleType:
        if name not in sys.modules:
            spec = importlib.util.spec_from_file_location(name, BENCHMARKS / f"{name}.py")
            assert spec is not None and spec.loader is not None
            sys.modules[name] = module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
        return sys.modules[name]

    return load


@pytest.fixture(scope="session")
def postgres(tmp_path_factory: pytest.TempPathFactory, helper: Callable[[str], ModuleType]) -> Iterator[Any]:
    """A server that runs; a test that stops it starts it again."""
    pytest.importorskip("psycopg", reason="needs the extra [live]")
    folder = tmp_path_factory.mktemp("postgres")
    for place in (folder, *folder.parents):
        if str(place).startswith(str(tmp_path_factory.getbasetemp().parent)):
            place.chmod(0o755)
    try:
        server = helper("_postgres").PostgresServer(folder)
    except RuntimeError as error:
        pytest.skip(str(error))
    server.start()
    yield server
    server.stop()
