"""One thread for linear algebra, scripts of the benchmarks, and PostgreSQL servers of one's own."""

from __future__ import annotations

import importlib.util
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

import pytest

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    # before NumPy is loaded: the matrices are small, and a second thread costs more than it gives
    os.environ.setdefault(_name, "1")

SCRIPTS = Path(__file__).parents[1] / "benchmarks"


@pytest.fixture(scope="session")
def script() -> Callable[[str], ModuleType]:
    """Load a script of the benchmarks, which are scripts of one folder and no package, by the name that its neighbours
    import it by; what it imports from them comes first."""

    def load(name: str) -> ModuleType:
        if name not in sys.modules:
            spec = importlib.util.spec_from_file_location(name, SCRIPTS / f"{name}.py")
            assert spec is not None and spec.loader is not None
            sys.modules[name] = module = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(module)
        return sys.modules[name]

    return load


@pytest.fixture(scope="session")
def bundled_case_in(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Write the bundled case in longer steps than its five minutes: what is made of it takes half as long."""
    import pandas as pd  # once threads are limited

    from thermal.data import bundled_case_path

    def write(step: str) -> Path:
        folder = tmp_path_factory.mktemp("coarse") / "coarse"
        shutil.copytree(bundled_case_path(), folder)
        telemetry = pd.read_parquet(folder / "telemetry.parquet")
        telemetry.resample(step, closed="right", label="right").mean().to_parquet(folder / "telemetry.parquet")
        return folder

    return write


@pytest.fixture(scope="session")
def start_postgres(script: Callable[[str], ModuleType]) -> Iterator[Callable[[str], Any]]:
    """Start a PostgreSQL server for tests of an extra; they are skipped by name where it or its driver is absent."""
    with ExitStack() as ends:

        def start(extra: str) -> Any:
            pytest.importorskip("psycopg", reason=f"needs the extra [{extra}]")
            # not below pytest's own folder: that is for one user alone, and the server does not run as root
            folder = Path(ends.enter_context(TemporaryDirectory(prefix="postgres_")))
            folder.chmod(0o755)
            try:
                server = script("_postgres").PostgresServer(folder)
            except RuntimeError as error:
                pytest.skip(str(error))
            server.start()
            ends.callback(server.stop)
            return server

        yield start
