"""A table of a real PostgreSQL server becomes telemetry; skipped where the server or its driver is not installed."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from thermal.errors import PlanError
from thermal.intake.source import read_table

sqlalchemy = pytest.importorskip("sqlalchemy", reason="needs the extra [telemetry]")
pytest.importorskip("psycopg", reason="needs the extra [telemetry]")


def programs() -> Path | None:
    """Folder with initdb and postgres: Debian keeps them out of the path."""
    places = [*sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)]
    found = shutil.which("initdb")
    return next(
        (p for p in [*([Path(found).resolve().parent] if found else []), *places] if (p / "initdb").exists()), None
    )


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a server of its own on a Unix socket, with a long and a wide table."""
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
    address = f"postgresql://tester:secret@/postgres?host={folder}"
    engine = sqlalchemy.create_engine("postgresql+psycopg" + address.removeprefix("postgresql"))
    index = pd.date_range("2023-01-09", periods=48, freq="30min", tz="Europe/Berlin", name="time")
    frame = pd.DataFrame({"room temp": 20.0 + np.sin(np.arange(48.0)), "V1 airflow": np.arange(48.0)}, index=index)
    frame.to_sql("wide", engine)
    frame.reset_index().melt("time", var_name="point").to_sql("readings", engine, index=False)
    engine.dispose()
    yield address
    subprocess.run([*control, "-m", "immediate", "stop"], check=True, capture_output=True)


def test_tables_and_queries(server: str) -> None:
    wide = read_table(server, "wide")
    assert list(wide) == ["time", "room temp", "V1 airflow"] and len(wide) == 48
    assert len(read_table(server, "public.readings")) == 96
    chosen = read_table(server, "SELECT * FROM readings WHERE point = 'room temp'")
    assert chosen["value"].to_numpy() == pytest.approx(wide["room temp"].to_numpy())


def test_a_database_is_read_only_and_tells_no_password(server: str) -> None:
    for table, text in (("", "--table: readings, wide|--table: wide, readings"), ("none", "'none'")):
        with pytest.raises(PlanError, match=text):
            read_table(server, table)
    with pytest.raises(PlanError, match="read-only") as refused:
        read_table(server, "WITH gone AS (DELETE FROM readings RETURNING 1) SELECT * FROM gone")
    assert "secret" not in str(refused.value)
    assert len(read_table(server, "readings")) == 96
    with pytest.raises(PlanError, match="a database that can be read") as lost:
        read_table("postgresql://tester:secret@127.0.0.1:1/none", "wide")
    assert "secret" not in str(lost.value)


def test_telemetry_from_a_long_table(server: str, tmp_path: Path) -> None:
    from thermal.case.building import Building, Device, Location, ZoneEntry, ZoneTable
    from thermal.intake.telemetry import ImportSettings, import_telemetry

    site = Location(latitude=48, longitude=12, elevation=0, timezone="Europe/Berlin")
    table = ZoneTable((ZoneEntry(name="room", volume=50, floor_area=20),))
    house = Building("house", site, 0.0, table, (Device(name="V1", type="vav", zone="room"),))
    found = import_telemetry(house, server, ImportSettings(table="readings", step=3600.0))
    assert found.telemetry.step == 3600.0
    assert found.telemetry.frame["V1/supply_air_flowrate_sensor"].iloc[2] == pytest.approx(3.5)
