"""A real PostgreSQL server, started and stopped by the tests; skipped where it or its driver is not installed."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest


def programs() -> Path | None:
    """Folder with initdb and postgres: Debian keeps them out of the path."""
    places = [*sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)]
    found = shutil.which("initdb")
    return next(
        (p for p in [*([Path(found).resolve().parent] if found else []), *places] if (p / "initdb").exists()), None
    )


@pytest.fixture(scope="session")
def postgres(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a server of its own on a Unix socket."""
    pytest.importorskip("psycopg", reason="needs the extra [telemetry]")
    binaries = programs()
    if binaries is None:
        pytest.skip("needs a PostgreSQL server (Debian: apt install postgresql)")
    folder = tmp_path_factory.mktemp("postgres")
    as_user: list[str] = []
    if os.geteuid() == 0:  # the server refuses to run as root
        runner = shutil.which("runuser")
        if runner is None or subprocess.run(["id", "postgres"], capture_output=True, check=False).returncode:
            pytest.skip("PostgreSQL does not run as root, and there is no user postgres to run it as")
        as_user = [runner, "-u", "postgres", "--"]
        for place in (folder, *folder.parents):
            if str(place).startswith(str(tmp_path_factory.getbasetemp().parent)):
                place.chmod(0o755)
        shutil.chown(folder, "postgres")
    data, options = folder / "data", f"-k {folder} -c listen_addresses='' -c fsync=off"
    begin = subprocess.run(
        [*as_user, str(binaries / "initdb"), "-D", str(data), "-U", "tester", "-A", "trust", "--no-sync"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if begin.returncode:
        pytest.skip(f"PostgreSQL's initdb does not work here: {begin.stderr.strip()[-200:]}")
    control = [*as_user, str(binaries / "pg_ctl"), "-D", str(data), "-w", "-o", options, "-l", str(folder / "log")]
    subprocess.run([*control, "start"], check=True, capture_output=True)
    yield f"postgresql://tester:secret@/postgres?host={folder}"
    subprocess.run([*control, "-m", "immediate", "stop"], check=True, capture_output=True)
