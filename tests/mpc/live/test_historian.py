"""The historian against a real PostgreSQL: what was acknowledged is there, once, whatever fell down in between."""

from __future__ import annotations

import asyncio
import dataclasses
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from mpc.errors import HistorianError
from mpc.live.clock import Clock
from mpc.live.collector import Collector
from mpc.live.historian.recorder import Recorder
from mpc.live.historian.samples import Samples
from mpc.live.historian.spool import Spool
from mpc.live.historian.store import Historian, migrations
from mpc.live.links.link import reading
from mpc.live.site import Site
from thermal.case.building import Building, Location, ZoneEntry, ZoneTable
from thermal.errors import PlanError
from thermal.intake.historian import historian_telemetry, pack_days

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


class Readings:
    """A connection that shows what the minute says, without a number in one of them."""

    minute = 0

    async def read(self, names: Any, slots: bool) -> dict[str, Any]:
        return {name: reading(None if self.minute == 7 else 293.0 + 0.1 * self.minute) for name in names}


def test_a_case_comes_of_what_the_collector_wrote_and_retention_takes_packed_days(
    historian: Historian, tmp_path: Path
) -> None:
    plant = {
        "format": 1, "name": "hall", "plant": {"kind": "site"}, "control_step": 300.0,
        "location": {"latitude": 48.0, "longitude": 12.0, "elevation": 0.0, "timezone": "UTC"},
        "period": {"start": "2026-01-12 00:00", "days": 1}, "zones": {"room": {"temperature": "x", "floor_area": 20.0}},
    }  # fmt: skip
    point, later = "room/zone_air_temperature_sensor", START + pd.Timedelta(days=40)
    entry = {
        "format": 1, "name": "hall", "plant": "plant.yaml", "controller": "full_speed",
        "database": {"address": historian.address, "schema": historian.schema, "retention": 30},
        "connections": {"hall": {"kind": "bacnet", "address": "127.0.0.1:9"}},
        "points": {point: {"connection": "hall", "at": "analog-input,1"}},
    }  # fmt: skip
    (tmp_path / "plant.yaml").write_text(yaml.safe_dump(plant))
    (tmp_path / "site.yaml").write_text(yaml.safe_dump(entry))

    class Minutes(Clock):
        now = START

        def wall(self) -> float:
            return float(self.now.timestamp())

    clock, link = Minutes(), Readings()

    async def collect() -> None:
        collector = Collector(Site(tmp_path / "site.yaml"), clock)
        for link.minute in range(1, 21):
            clock.now = START + pd.Timedelta(minutes=link.minute)
            await collector.collect({"hall": link})  # type: ignore[dict-item]
        assert pack_days(historian.address, START + pd.Timedelta(days=1), historian.schema) == 1
        found = read()
        clock.now = later
        await collector.collect({"hall": link})  # type: ignore[dict-item]
        collector.log.close()
        collector.recorder.historian.close()
        room = found.telemetry.frame[point]
        assert room.to_numpy() == pytest.approx(293.0 + 0.1 * np.array([3.0, (6 + 8 + 9 + 10) / 4.0, 13.0, 18.0]))

    def read() -> Any:
        site = Location(latitude=48, longitude=12, elevation=0, timezone="UTC")
        table = ZoneTable((ZoneEntry(name="room", volume=50, floor_area=20),))
        period = START, START + pd.Timedelta("20min")
        return historian_telemetry(Building("hall", site, 0.0, table, ()), historian.address, period, 300.0,
                                   schema=historian.schema)  # fmt: skip

    asyncio.run(collect())
    with pytest.raises(PlanError, match="expected samples"):  # older than the retention, packed or not
        read()
    assert historian.points()["samples"].tolist() == [1]
