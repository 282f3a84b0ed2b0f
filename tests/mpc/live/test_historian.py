"""The historian against a real PostgreSQL: what was acknowledged is there, once, whatever fell down in between."""

from __future__ import annotations

import dataclasses
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mpc.errors import HistorianError
from mpc.live.historian.recorder import Recorder
from mpc.live.historian.samples import Samples
from mpc.live.historian.spool import Spool
from mpc.live.historian.store import Historian, migrations

START = pd.Timestamp("2026-01-10", tz="UTC")


def batch(first: int, count: int = 3, points: int = 2) -> Samples:
    """Samples of minutes from one on; the value tells minute and point."""
    names = [f"zone_{k}/zone_air_temperature_sensor" for _ in range(count) for k in range(points)]
    minutes = np.repeat(np.arange(first, first + count), points)
    return Samples(names, START.timestamp() + 60.0 * minutes, minutes + 0.1 * np.tile(np.arange(points), count))


@pytest.fixture
def historian(postgres: Any, request: pytest.FixtureRequest) -> Any:
    with Historian(postgres.address, schema=request.node.name.removeprefix("test_")[:60]) as found:
        yield found


def test_written_is_read(historian: Historian) -> None:
    assert historian.migrate() == historian.migrate() == max(migrations())
    samples = batch(0)
    values = samples.values.copy()
    values[1] = np.nan
    assert historian.write(dataclasses.replace(samples, values=values), {"zone_0/zone_air_temperature_sensor": "K"}) == 6
    assert historian.write(batch(2)) == 4  # the two of minute 2 were there
    table = historian.read(["zone_1/zone_air_temperature_sensor", "zone_0/zone_air_temperature_sensor"], START,
                           START + pd.Timedelta("4min"))  # fmt: skip
    assert list(table.index) == list(pd.date_range(START, periods=4, freq="1min"))
    np.testing.assert_array_equal(table.to_numpy(), [[np.nan, 0.0], [1.1, 1.0], [2.1, 2.0], [3.1, 3.0]])
    at = START.timestamp() + 240.0
    assert historian.latest() == {f"zone_{k}/zone_air_temperature_sensor": (at, 4 + 0.1 * k) for k in (0, 1)}
    assert historian.latest(["zone_1/zone_air_temperature_sensor"], before=at - 1.0) == {
        "zone_1/zone_air_temperature_sensor": (at - 60.0, 3.1)
    }
    points = historian.points()
    assert points["samples"].tolist() == [5, 5] and points["unit"].fillna("").tolist() == ["K", ""]
    assert historian.trim(START + pd.Timedelta("2min")) == 4
    assert historian.points()["first"].tolist() == [START + pd.Timedelta("2min")] * 2
    with pytest.raises(HistorianError, match="nearest valid one is 'zone_1/"):
        historian.read(["zone_7/zone_air_temperature_sensor"], START, START)


def test_processes_migrate_together(historian: Historian) -> None:
    others = [Historian(historian.address, historian.schema) for _ in range(3)]
    errors: list[HistorianError] = []

    def work(one: Historian) -> None:
        try:
            one.migrate()
        except HistorianError as error:
            errors.append(error)
        one.close()

    threads = [threading.Thread(target=work, args=(one,)) for one in others]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert not errors and historian.points().empty


def test_no_acknowledged_sample_is_lost(historian: Historian, postgres: Any, tmp_path: Path) -> None:
    clock = [0.0]
    recorder = Recorder(historian, Spool(tmp_path / "spool"), retry=10.0, now=lambda: clock[0])
    assert recorder.record(batch(0)) == "committed"
    postgres.stop()
    try:
        assert [recorder.record(batch(k)) for k in (3, 6)] == ["spooled"] * 2 and "historian" in recorder.trouble
        assert not Spool(tmp_path / "spool").empty  # another process would find them
    finally:
        postgres.start()
    assert recorder.record(batch(9)) == "spooled"  # it looks again after 10 s only
    clock[0] = 11.0
    assert recorder.record(batch(12)) == "committed" and recorder.spool.empty and not recorder.trouble
    assert historian.points()["samples"].tolist() == [15, 15]


def test_spool_keeps_batches_bit_for_bit_and_leaves_a_torn_line_out(tmp_path: Path) -> None:
    spool = Spool(tmp_path)
    first = dataclasses.replace(batch(0), values=np.array([0.1 + 0.2, np.nan, 1e-300, -0.0, 5.0, 1 / 3]))
    spool.append(first)
    with (tmp_path / "00000000.jsonl").open("ab") as file:
        file.write(b'{"names": ["zone_0')  # the power went
    spool = Spool(tmp_path)
    spool.append(batch(3))
    assert [p.name for p in sorted(tmp_path.glob("*"))] == ["00000000.jsonl", "00000001.jsonl"]
    taken: list[Samples] = []

    def write(samples: Samples) -> None:
        if len(taken) == 1 and not broken:
            broken.append(True)
            raise HistorianError("historian: write", "a database that answers", "none")
        taken.append(samples)

    broken: list[bool] = []
    with pytest.raises(HistorianError):
        spool.drain(write)
    assert spool.drain(write) == 6 and spool.empty
    assert taken[0].values.tobytes() == first.values.tobytes() or np.array_equal(taken[0].values, first.values, True)
    assert list(taken[0].names) == list(first.names) and len(taken) == 2


def test_a_full_spool_acknowledges_nothing(tmp_path: Path) -> None:
    spool = Spool(tmp_path, most=400)
    spool.append(batch(0, count=1))
    with pytest.raises(HistorianError, match="at most 400 bytes"):
        spool.append(batch(1))
    taken: list[Samples] = []
    assert spool.drain(taken.append) == 2


@pytest.mark.parametrize("schema", ["x; drop table point", "", "Upper", 'a"b'])
def test_the_name_of_a_schema_is_no_way_in(schema: str) -> None:
    pytest.importorskip("psycopg", reason="needs the extra [live]")
    with pytest.raises(HistorianError, match="lower-case letters"):
        Historian("postgresql:///", schema=schema)
