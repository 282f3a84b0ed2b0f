"""A table of a real PostgreSQL server becomes telemetry; skipped where the server or its driver is not installed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from thermal.errors import PlanError
from thermal.intake.source import read_table

sqlalchemy = pytest.importorskip("sqlalchemy", reason="needs the extra [telemetry]")
pytest.importorskip("psycopg", reason="needs the extra [telemetry]")


@pytest.fixture(scope="module")
def server(postgres: str) -> str:
    """Address of a server with a long and a wide table."""
    engine = sqlalchemy.create_engine("postgresql+psycopg" + postgres.removeprefix("postgresql"))
    index = pd.date_range("2023-01-09", periods=48, freq="30min", tz="Europe/Berlin", name="time")
    frame = pd.DataFrame({"room temp": 20.0 + np.sin(np.arange(48.0)), "V1 airflow": np.arange(48.0)}, index=index)
    frame.to_sql("wide", engine)
    frame.reset_index().melt("time", var_name="point").to_sql("readings", engine, index=False)
    engine.dispose()
    return postgres


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
