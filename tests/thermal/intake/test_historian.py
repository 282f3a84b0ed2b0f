"""A historian in a real PostgreSQL becomes a case: means, held commands, packed days, late samples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mpc.live.historian.store import Historian
from thermal import load_case, save_case
from thermal.case.building import Building, Device, Location, ZoneEntry, ZoneTable
from thermal.case.case import Case
from thermal.case.telemetry import Telemetry
from thermal.errors import CaseError, PlanError
from thermal.intake.historian import historian_telemetry, pack_days, read_historian

START, END = pd.Timestamp("2026-01-05", tz="Europe/Berlin"), pd.Timestamp("2026-01-08", tz="Europe/Berlin")
ROOM, DAMPER, FLOW = "room/zone_air_temperature_sensor", "V1/supply_air_damper_percentage_command", "V1/supply_air_flowrate_sensor"  # fmt: skip


@pytest.fixture(scope="module")
def samples() -> dict[str, pd.Series]:
    """A temperature every minute, a flow every ten, a command on change."""
    minutes = pd.date_range(START + pd.Timedelta(minutes=1), END, freq="1min")
    tens = minutes[9::10]
    changes = pd.DatetimeIndex([START, START + pd.Timedelta(hours=30), START + pd.Timedelta(hours=30.5)])
    return {
        ROOM: pd.Series(294.0 + np.sin(np.arange(len(minutes)) / 200.0), index=minutes).drop(minutes[600:700]),
        FLOW: pd.Series(0.1 + 0.01 * np.arange(len(tens)), index=tens),
        DAMPER: pd.Series([0.2, 0.8, 0.4], index=changes),
    }


@pytest.fixture(scope="module")
def historian(postgres: str, samples: dict[str, pd.Series]) -> str:
    """Address of a database with the samples in two schemas, in the order of time as a collector writes them."""
    import psycopg

    with psycopg.connect(postgres, autocommit=True) as connection:
        for schema in ("buildingmpc", "late"):
            with Historian(postgres, schema) as own:
                own.migrate()
            connection.execute(f"SET search_path = {schema}")  # type: ignore[arg-type]
            ids = {}
            for name in (*samples, "silent/zone_air_temperature_sensor"):
                found = connection.execute("INSERT INTO point (name) VALUES (%s) RETURNING id", [name]).fetchone()
                ids[name] = found[0] if found else 0
            rows = [(t, ids[n], v) for n, s in samples.items() for t, v in s.items()]
            with connection.cursor().copy("COPY sample (time, point, value) FROM STDIN") as copy:
                for row in sorted(rows):
                    copy.write_row(row)
    return postgres


def test_means_held_values_and_gaps(historian: str, samples: dict[str, pd.Series]) -> None:
    found = read_historian(historian, START, END, 300.0)
    assert set(found) == {ROOM, FLOW, DAMPER}
    room = found[ROOM].values
    exact = samples[ROOM].resample("5min", closed="right", label="right").mean().reindex(room.index)
    assert len(room) == 3 * 288 and room.index[0] == START + pd.Timedelta(minutes=5)
    assert room.to_numpy() == pytest.approx(exact.to_numpy(), abs=1e-9, nan_ok=True) and room.isna().sum() == 20
    flow = found[FLOW].values  # a value stands for the ten minutes before it
    assert flow.to_numpy()[:4] == pytest.approx([0.1, 0.1, 0.11, 0.11])
    damper = found[DAMPER].values
    at = damper.index.get_loc(START + pd.Timedelta(hours=30))
    assert damper.iloc[[3, at + 1, at + 7, -1]].to_numpy() == pytest.approx([0.2, 0.8, 0.4, np.nan], nan_ok=True)
    assert np.isnan(damper.iloc[at - 10])  # held for a day at most


def test_packed_days_are_the_same_and_late_samples_are_packed_again(historian: str) -> None:
    import psycopg

    plain = {step: read_historian(historian, START, END, step, "late") for step in (180.0, 300.0, 900.0)}
    assert pack_days(historian, END, "late") == 3  # of four days in UTC that it touches, the last goes on
    assert pack_days(historian, END, "late") == 0
    for step, found in plain.items():  # of five minutes and more by slots
        packed = read_historian(historian, START, END, step, "late")
        for name, series in found.items():
            assert packed[name].values.to_numpy() == pytest.approx(series.values.to_numpy(), nan_ok=True), name
    late = START + pd.Timedelta(minutes=620)
    with psycopg.connect(historian, autocommit=True) as connection:
        connection.execute(
            "INSERT INTO late.sample SELECT id, %s + g * interval '1 minute', 300.0 FROM late.point, "
            "generate_series(0, 29) g WHERE name = %s", [late, ROOM],
        )  # fmt: skip
    assert pack_days(historian, END, "late") == 1
    again = read_historian(historian, START, END, 900.0, "late")[ROOM].values
    assert again[late + pd.Timedelta(minutes=25)] == pytest.approx(300.0)


def house() -> Building:
    site = Location(latitude=48, longitude=12, elevation=0, timezone="Europe/Berlin")
    table = ZoneTable((ZoneEntry(name="room", volume=50, floor_area=20),))
    return Building("house", site, 0.0, table, (Device(name="V1", type="vav", zone="room"),))


def test_telemetry_and_what_is_refused(historian: str) -> None:
    found = historian_telemetry(house(), historian, (START, END), 900.0)
    assert found.telemetry.step == 900.0 and set(found.telemetry.frame) == {ROOM, FLOW, DAMPER}
    assert found.telemetry.frame[DAMPER].iloc[0] == pytest.approx(0.2)
    with pytest.raises(CaseError, match="divide a day"):
        historian_telemetry(house(), historian, (START, END), 700.0)
    with pytest.raises(PlanError, match="none; look at --start"):
        later = pd.Timedelta(days=90)
        read_historian(historian, START + later, END + later, 300.0)
    with pytest.raises(PlanError, match="lower-case letters"):
        read_historian(historian, START, END, 300.0, "a; DROP TABLE sample")
    with pytest.raises(PlanError, match="relation .*point.* does not exist"):
        read_historian(historian, START, END, 300.0, "nowhere")
    with pytest.raises(PlanError, match="a historian that can be read") as lost:
        read_historian("postgresql://tester:secret@127.0.0.1:1/none", START, END, 300.0)
    assert "secret" not in str(lost.value)


def test_the_command_makes_a_case(historian: str, tmp_path: Path, capsys: Any) -> None:
    from mpc.cli.app import app

    index = pd.date_range(START, periods=2, freq="1h", name="timestamp")
    folder = save_case(Case(house(), Telemetry.from_frame(pd.DataFrame({ROOM: [293.0, 294.0]}, index=index))), tmp_path / "house")  # fmt: skip
    given = ["case", "from", historian, "--building", str(folder), "--out", str(tmp_path / "week")]
    with pytest.raises(SystemExit) as ended:
        app([*given, "--start", "2026-01-05", "--end", "2026-01-08", "--step", "15min"])
    assert ended.value.code == 0 and "3 of 3 columns matched" in capsys.readouterr().out
    made = load_case(tmp_path / "week")
    assert made.step == 900.0 and len(made.stamps) == 288 and (tmp_path / "week" / "points.csv").is_file()
    with pytest.raises(SystemExit) as refused:
        app([*given, "--start", "2026-01-05", "--end", "2026-01-08"])
    assert refused.value.code == 2
