"""Sites: what is read, what is refused by name, and the parts that need no network: clocks, forecasts, requests, page."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from mpc.adapters.described.load import load_plant
from mpc.errors import LiveError, MpcError, PlantError
from mpc.live.audit import canonical
from mpc.live.clock import Clock, SimulatedClock, set_clock
from mpc.live.controller import ControlProcess
from mpc.live.guard.decide import Guard
from mpc.live.guard.process import left_before
from mpc.live.guard.rules import GuardRules, rules_of
from mpc.live.guard.socket import Mailbox
from mpc.live.notify import Notifier
from mpc.live.operators import checked_request, operator_key, sign
from mpc.live.outlook import Outlook
from mpc.live.page.access import Access
from mpc.live.picture import DayCost, picture
from mpc.live.planner import Planner, forecast_of_dict, forecast_to_dict, needed_columns
from mpc.live.site import Site
from mpc.live.site_file import NotifyEntry
from thermal.units import to_si

SET = "north/zone_air_heating_temperature_setpoint"
START = pd.Timestamp("2026-01-12 08:00", tz="UTC")
PLANT: dict[str, Any] = {
    "format": 1, "name": "hall", "plant": {"kind": "site"}, "control_step": 900.0,
    "location": {"latitude": 50.8, "longitude": 4.35, "elevation": 100.0, "timezone": "Europe/Brussels"},
    "period": {"start": "2026-01-12 00:00", "days": 1},
    "zones": {"north": {"temperature": "x", "floor_area": 60.0,
                        "comfort": {"lower": "20 degC", "upper": "25 degC"}}},
    "actuators": {SET: {"signal": "y", "range": ["16 degC", "26 degC"]}},
    "prices": {"electricity": 0.2}, "series": ["weather.csv"],
    "weather": {"outside_air_temperature_sensor": "outdoor"}, "forecast": {"hours": 6.0},
}  # fmt: skip
SITE: dict[str, Any] = {
    "format": 1, "name": "hall", "plant": "plant.yaml", "controller": "full_speed",
    "database": {"address": "postgresql:///x"}, "connections": {"hall": {"kind": "bacnet", "address": "127.0.0.1:47809"}},
    "points": {
        "north/zone_air_temperature_sensor": {"connection": "hall", "at": "analog-input,1", "unit": "degC"},
        SET: {"connection": "hall", "at": "analog-value,1", "unit": "degC", "mode": "act",
              "range": ["18 degC", "23 degC"], "rate": 2.0, "release": "relinquish"},
    },
}  # fmt: skip


def make(folder: Path, site: dict[str, Any] | None = None, plant: dict[str, Any] | None = None) -> Site:
    rows = "".join(f"{START + pd.Timedelta(hours=k - 12):%Y-%m-%d %H:%M}+00:00,{275 + k}\n" for k in range(72))
    (folder / "weather.csv").write_text("timestamp,outdoor\n" + rows)
    (folder / "plant.yaml").write_text(yaml.safe_dump(PLANT | (plant or {})))
    (folder / "site.yaml").write_text(yaml.safe_dump(SITE | (site or {})))
    return Site(folder / "site.yaml")


def test_a_site_is_read(tmp_path: Path) -> None:
    site = make(tmp_path)
    rules = rules_of(site)
    assert list(rules.points) == [SET] and rules.points[SET].priority == 13 and rules.points[SET].rate == 2.0
    low, high = to_si(np.array([18.0, 23.0]), "degC", "temperature")
    assert (rules.points[SET].lowest, rules.points[SET].highest) == (low, high)
    assert rules.limits.tick == 60.0 and rules.limits.heartbeat == 180.0 and rules.limits.plan_age == 1350.0
    assert GuardRules.from_dict(json.loads(json.dumps(rules.to_dict()))) == rules
    assert site.conversions[SET].into(20.0) == pytest.approx(293.15) and not site.folder.stat().st_mode & 0o077
    before = site.hash
    assert make(tmp_path).hash == before
    assert make(tmp_path, plant={"name": "other"}).hash != before != make(tmp_path, {"name": "other"}).hash
    with pytest.raises(PlantError, match="operate site.yaml"):
        load_plant(tmp_path / "plant.yaml")


def test_doubts_come_in_one_order_whatever_that_of_the_file(tmp_path: Path) -> None:
    """A log has its keys in order, and what it repeats must be what was decided."""
    other = SET.replace("heating", "cooling")  # behind the first in the file, before it in the log
    actuators = PLANT["actuators"] | {other: PLANT["actuators"][SET] | {"signal": "z"}}
    points = SITE["points"] | {other: SITE["points"][SET] | {"at": "analog-value,2"}}
    assert list(points) != sorted(points)
    (tmp_path / "weather.csv").touch()
    (tmp_path / "plant.yaml").write_text(yaml.safe_dump(PLANT | {"actuators": actuators}, sort_keys=False))
    (tmp_path / "site.yaml").write_text(yaml.safe_dump(SITE | {"points": points}, sort_keys=False))
    rules = rules_of(Site(tmp_path / "site.yaml"))
    unread = {name: {"value": None, "slots": None, "error": "no answer"} for name in (SET, other)}
    tick = {"mono": 0.0, "wall": 0.0, "beat": 0.0, "stopping": False, "results": {}, "ordered": None, "messages": [],
            "readings": unread}  # fmt: skip
    again = Guard(GuardRules.from_dict(json.loads(canonical(rules.to_dict()))))
    first, second = Guard(rules).decide(tick), again.decide(json.loads(canonical(tick)))
    assert len(first["doubts"]) == 2 and canonical(first) == canonical(second)


def point(**change: Any) -> dict[str, Any]:
    return {"points": SITE["points"] | {SET: {**SITE["points"][SET], **change}}}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (point(range=None), "expected range, rate and release of a point in mode act, without range"),
        (point(rate=None, release=None), "without rate, release"),
        (point(mode="on"), "points.north/zone_air_heating_temperature_setpoint.mode: expected 'shadow', 'advise' or 'act'"),
        (point(range=["23 degC", "18 degC"]), "expected a range whose lower end comes first"),
        (point(release="12 degC"), "release value within the range"),
        (point(release="stop"), "release"),
        (point(connection="hal"), "connection: expected a name of `connections`, found 'hal'; the nearest valid one is 'hall'"),
        (point(rat=1.0), "points"),
        ({"points": {SET: SITE["points"][SET]}}, "expected the temperature of each zone"),
        ({"points": SITE["points"] | {"a/b": SITE["points"][SET]}}, "points.a/b: expected ENTITY/POINT"),
        ({"controller": "mpc"}, "model: expected a model for mpc, found none"),
        ({"clock_rate": 10.0, "connections": {"hall": {"kind": "bacnet", "address": "10.0.0.7"}}}, "clock_rate: expected 1"),
        ({"connections": {"hall": {"kind": "mqtt", "host": "127.0.0.1"}}}, "release: expected a value where there are no"),
        ({"connections": {"hall": {"kind": "modbus"}}}, "kind"),
        ({"connections": {"hall": {"kind": "bacnet", "address": "x", "priority": 17}}}, "priority"),
        ({"guard": {"tik": 1.0}}, "guard.tik"),
    ],
)  # fmt: skip
def test_sites_that_do_not_fit(tmp_path: Path, change: dict[str, Any], says: str) -> None:
    with pytest.raises(MpcError, match=re.escape(says)):
        make(tmp_path, change)


def test_simulated_clocks_agree_and_can_be_set(tmp_path: Path) -> None:
    path = tmp_path / "clock.json"
    set_clock(path, 1e9)
    one, other = SimulatedClock(path, 100.0), SimulatedClock(path, 100.0)
    assert 0.0 <= one.wall() - 1e9 < 1000.0 and abs(one.wall() - other.wall()) < 20.0
    before = one.mono()
    set_clock(path, 2e9)
    assert 0.0 <= other.wall() - 2e9 < 1000.0 and 0.0 <= one.mono() - before < 1000.0
    assert one.real(100.0) == 1.0 and Clock().real(5.0) == 5.0
    path.write_text("{")
    with pytest.raises(LiveError, match="simulated clock"):
        one.wall()


def test_forecasts_follow_the_tables(tmp_path: Path) -> None:
    site = make(tmp_path)
    outlook, begin = Outlook(site.plant_path, site.plant), START.timestamp()
    first = outlook.at(begin)
    assert first.table.index[0] == START + pd.Timedelta("15min") and len(first.table) == 24
    # lines from 287 K at 08:00 to 288 K at 09:00: their mean over the first quarter
    assert first.table["outside_air_temperature_sensor"].iloc[0] == pytest.approx(287.125)
    later = outlook.at(begin + 3600.0)
    assert later.table["outside_air_temperature_sensor"].iloc[0] == pytest.approx(288.125)
    text = (tmp_path / "weather.csv").read_text().replace(",288\n", ",298\n")
    (tmp_path / "weather.csv").write_text(text + " ")
    assert outlook.at(begin).table["outside_air_temperature_sensor"].iloc[0] == pytest.approx(288.375)
    with pytest.raises(MpcError, match="weather.csv"):
        outlook.at(begin + 60 * 3600.0)
    again = forecast_of_dict(json.loads(json.dumps(forecast_to_dict(first))))
    pd.testing.assert_frame_equal(again.table, first.table, check_exact=True, check_freq=False, check_names=False)


def test_plans_repeat_and_a_failure_is_a_status(tmp_path: Path) -> None:
    site = make(tmp_path)
    forecast = forecast_to_dict(Outlook(site.plant_path, site.plant).at(START.timestamp()))
    inputs = {"begin": START.timestamp(), "means": {"north/zone_air_temperature_sensor": 291.0}, "forecast": forecast,
              "trouble": ""}  # fmt: skip
    plan = Planner(site).plan(inputs)
    assert plan["status"] == "planned" and plan["values"] == {SET: pytest.approx(293.15)} and plan["other"] == {}
    assert Planner(site).plan(json.loads(json.dumps(inputs))) == plan
    assert Planner(site).plan(inputs | {"trouble": "no historian"})["status"] == "no historian"

    class Bad:
        def __init__(self, value: Any) -> None:
            self.value = value

        def step(self, *_: Any) -> dict[str, float]:
            if isinstance(self.value, Exception):
                raise self.value
            return {SET: self.value, "boiler/valve": 1.0}

    assert "no number" in Planner(site, Bad(float("nan"))).plan(inputs)["status"]
    assert "ZeroDivisionError" in Planner(site, Bad(ZeroDivisionError("x"))).plan(inputs)["status"]
    assert Planner(site, Bad(1.0)).plan(inputs)["other"] == {"boiler/valve": 1.0}
    assert needed_columns(site, Planner(site).controller) == ("north/zone_air_temperature_sensor",)


def test_what_the_page_shows_of_a_plan_and_what_the_day_has_cost(tmp_path: Path) -> None:
    site = make(tmp_path)
    forecast = {"columns": ["electricity_price", "north/comfort_lower_temperature", "north/comfort_upper_temperature"],
                "values": [[0.2, 0.4], [293.15, 291.15], [296.15, None]]}  # fmt: skip
    inputs = {"begin": START.timestamp(), "forecast": forecast, "means": {"hp/electrical_power_sensor": 2000.0}}
    ahead = {"step": 900.0, "zone": [[293.0], [293.5], [293.25]], "power": [[1000.0, 0.0], [4000.0, 0.0]]}
    found = picture(site, {"number": 7, "ahead": ahead}, inputs)
    assert found is not None and found["cost"] == pytest.approx(0.25 * (0.2 + 4 * 0.4))  # kWh of a quarter of an hour
    assert found["zones"]["north"] == {"lower": [293.15, 291.15], "upper": [296.15, None], "expected": [293.0, 293.5, 293.25]}
    assert picture(site, {"number": 8}, inputs)["power"] is None and picture(site, {}, {"forecast": None}) is None  # type: ignore[index]
    assert DayCost(site).add(inputs) is None  # no meter
    day = DayCost(site)
    day.meters = ["hp/electrical_power_sensor"]
    begin = START.timestamp()
    assert day.add(inputs)["cost"] == 0.0  # type: ignore[index] # nobody knows what the step before cost
    told = day.add(inputs | {"begin": begin + 900.0})
    assert told is not None and told["cost"] == pytest.approx(0.5 * 0.2) and told["steps"] == 1
    again = DayCost(site, told)
    again.meters = day.meters
    assert again.add(inputs | {"begin": begin + 900.0}) == told  # a new start counts nothing twice
    assert again.add(inputs | {"begin": begin + 1800.0})["steps"] == 2  # type: ignore[index]
    assert again.add(inputs | {"begin": begin + 3600.0})["steps"] == 2  # type: ignore[index] # a step is missing
    assert again.add(inputs | {"begin": begin + 86_400.0})["steps"] == 0  # type: ignore[index]


def test_measurements_that_bear_no_plan_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("psycopg", reason="needs the extra [live]")
    process = ControlProcess(make(tmp_path, {"guard": {"stuck": 600.0}}))
    zone, now = "north/zone_air_temperature_sensor", [1e9]
    monkeypatch.setattr(process.clock, "wall", lambda: now[0])
    told: dict[str, tuple[float, float]] = {}
    monkeypatch.setattr(process.historian, "latest", lambda columns: told)
    for seen, says in (
        ({}, "is no number"), ({zone: (1e9, float("nan"))}, "is no number"), ({zone: (1e9, 423.15)}, "is 150 degC"),
        ({zone: (1e9 - 200.0, 293.0)}, "is 200 s old"), ({zone: (1e9 + 60.0, 293.0)}, "60 s ahead of the clock"),
        ({zone: (1e9, 293.0)}, ""),
    ):  # fmt: skip
        told.clear()
        told.update(seen)
        assert says in process._trouble(180.0) and bool(says) == bool(process._trouble(180.0))
    now[0] += 660.0
    told[zone] = (now[0], 293.0)
    assert "has not moved for 660 s" in process._trouble(180.0)
    told[zone] = (now[0], 293.1)
    assert process._trouble(180.0) == ""
    process.log.close()


def test_requests_are_an_operators_or_refused(tmp_path: Path) -> None:
    key = operator_key(tmp_path)
    assert key == operator_key(tmp_path) and not (tmp_path / "operator.key").stat().st_mode & 0o077
    good = sign({"kind": "mode", "points": [SET], "mode": "act"}, key, 1000.0, "anna")
    assert checked_request(good, key)["invalid"] == "" and good["expires"] == 1060.0
    for change in ({"mode": "shadow"}, {"points": []}, {"expires": 9e9}, {"by": "bert"}, {"signature": "0" * 64}):
        assert checked_request(good | change, key)["invalid"] == "its signature is not an operator's"
    assert checked_request(good, b"other" * 8)["invalid"]
    for bad in ({}, {"kind": "mode"}, good | {"more": 1}, good | {"points": "x"}, good | {"points": [1]}):
        assert checked_request(bad, key)["invalid"] == "it is no request of the format"


def test_the_mailbox_takes_no_rubbish(tmp_path: Path) -> None:
    box = Mailbox(operator_key(tmp_path), lambda: 5.0)
    for line in (b"", b"{", b"[]", b"1", b'{"kind": 1}', b'{"kind": "plan"}', b'{"kind": "plan", "plan": {"a": NaN}}',
                 b'{"kind": "plan", "plan": {"a": 1e999}}', b'{"kind": "write"}', b"[" * 100_000, b"\xff\xfe"):  # fmt: skip
        assert box.take(line), line
    assert box.empty() == [] and box.beat is None and box.dropped == 11
    assert box.take(b'{"kind": "beat"}') == "" and box.beat == 5.0
    for _ in range(1000):
        box.take(b'{"kind": "plan", "plan": {}}')
    assert len(box.empty()) == 200 and box.empty() == []


def test_a_start_goes_on_with_modes_and_what_was_left(tmp_path: Path) -> None:
    site = make(tmp_path)
    assert left_before(site) == ({}, {})
    line = {"kind": "start", "content": {"rules": {"configuration": site.hash}, "modes": {}, "held_before": {}}}
    tick = {"kind": "tick", "content": {"decision": {"modes": {SET: "shadow"}, "held": {}, "writes": {SET: 291.0}}}}
    path = site.folder / "guard-000000.jsonl"
    path.write_text(json.dumps(line) + "\n" + json.dumps(tick) + '\n{"torn')
    assert left_before(site) == ({SET: "shadow"}, {SET: 291.0})
    more = {"modes": {SET: "act"}, "held_before": {SET: 292.0}}
    turned = {"kind": "turned", "content": {"rules": {"configuration": site.hash}, **more}}
    path.with_name("guard-000001.jsonl").write_text(json.dumps(turned) + "\n")
    assert left_before(site) == ({SET: "act"}, {SET: 292.0})
    path.with_name("guard-000001.jsonl").rename(path.with_name("guard-000001.jsonl.gz"))  # damaged: it is none
    assert left_before(site) == ({SET: "shadow"}, {SET: 291.0})
    line["content"]["rules"] = {"configuration": "another"}  # type: ignore[index]
    path.write_text(json.dumps(line) + "\n" + json.dumps(tick) + "\n")
    assert left_before(site) == ({}, {SET: 291.0})


def test_alarms_are_told_once() -> None:
    notifier = Notifier(NotifyEntry(), "hall")
    assert notifier.tell(["the plan is 10.0 s old"], 0.0) == ["the plan is 10.0 s old"]
    assert notifier.tell(["the plan is 20.5 s old", "x"], 0.0) == ["x"]
    assert notifier.tell([], 0.0) == [] and notifier.tell(["x"], 0.0) == ["x"]


@pytest.mark.parametrize(
    ("host", "asked", "token", "role", "status"),
    [
        ("127.0.0.1", "127.0.0.1:8080", "", "viewer", 0), ("127.0.0.1", "evil.example:8080", "", "viewer", 403),
        ("127.0.0.1", "localhost:8080", "", "operator", 401), ("127.0.0.1", "localhost", "Bearer v", "operator", 403),
        ("127.0.0.1", "localhost", "Bearer o", "operator", 0), ("0.0.0.0", "hall:8080", "", "viewer", 401),
        ("0.0.0.0", "hall:8080", "Bearer v", "viewer", 0), ("0.0.0.0", "hall:8080", "Bearer o", "viewer", 0),
        ("0.0.0.0", "hall:8080", "Basic o", "operator", 401), ("0.0.0.0", "hall:8080", "Bearer x", "viewer", 401),
    ],
)  # fmt: skip
def test_roles_of_the_page(host: str, asked: str, token: str, role: Any, status: int) -> None:
    assert Access(host, {"viewer": "v", "operator": "o"}).refusal(asked, token, role)[0] == status
