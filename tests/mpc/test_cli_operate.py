"""``buildingmpc operate`` and ``buildingmpc replay``: what is read, said and refused, and a guard that runs."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from mpc.cli.app import app
from mpc.live.audit import AuditLog

ROOT = Path(__file__).parents[2]
SET = "north/zone_air_heating_temperature_setpoint"

#: Seconds of the site a second: a guard ends where a busy disk takes half a control step for a line of its log.
RATE = 10.0


def make(folder: Path, device: str = "127.0.0.1:9", mode: str = "act") -> Path:
    plant = {
        "format": 1, "name": "hall", "plant": {"kind": "site"}, "control_step": 60.0,
        "location": {"latitude": 50.8, "longitude": 4.35, "elevation": 100.0, "timezone": "Europe/Brussels"},
        "period": {"start": "2026-01-12 00:00", "days": 1}, "zones": {"north": {"temperature": "x", "floor_area": 60.0}},
        "actuators": {SET: {"signal": "y", "range": ["16 degC", "26 degC"]}},
    }  # fmt: skip
    site = {
        "format": 1, "name": "hall", "plant": "plant.yaml", "controller": "full_speed", "clock_rate": RATE,
        "database": {"address": "postgresql:///none"},
        "connections": {"hall": {"kind": "bacnet", "address": device, "timeout": 0.5}},
        "points": {
            "north/zone_air_temperature_sensor": {"connection": "hall", "at": "analog-input,2", "unit": "degC"},
            SET: {"connection": "hall", "at": "analog-value,1", "unit": "degC", "mode": mode,
                  "range": ["18 degC", "23 degC"], "rate": 2.0, "release": "relinquish"},
        },
    }  # fmt: skip
    (folder / "plant.yaml").write_text(yaml.safe_dump(plant))
    (folder / "site.yaml").write_text(yaml.safe_dump(site))
    return folder / "site.yaml"


def run(*words: Any) -> tuple[int, str]:
    answer = CliRunner().invoke(app, [str(word) for word in words])
    return answer.exit_code, answer.output


def test_a_site_is_checked(tmp_path: Path) -> None:
    code, text = run("operate", make(tmp_path), "--check", "--json")
    told = json.loads(text)
    assert code == 0 and told["points"] == {"north/zone_air_temperature_sensor": "read", SET: "act"}
    assert told["limits"]["tick"] == 6.0 and len(told["configuration"]) == 64
    assert "analog-value,1" in run("operate", tmp_path / "site.yaml", "--check")[1]
    for words, says in (
        (["--status"], "expected a guard that runs"), (["--mode", "shadow"], "expected a guard that runs"),
        (["--part", "gard"], "the nearest valid one is 'guard'"),
    ):  # fmt: skip
        code, text = run("operate", tmp_path / "site.yaml", *words)
        assert code == 2 and says in text
    assert run("operate", tmp_path / "none.yaml", "--check")[0] == 2


def test_logs_are_replayed_in_order(tmp_path: Path) -> None:
    for kind in ("a", "b"):
        log = AuditLog(tmp_path, "collector", dict)
        log.append(kind, {"x": 1})
        log.close()
    code, text = run("replay", tmp_path, "--json")
    assert code == 0 and [one["lines"] for one in json.loads(text).values()] == [1, 1]
    path = tmp_path / "collector-000001.jsonl"
    path.write_text(path.read_text().replace('"x":1', '"x":2'))
    code, text = run("replay", tmp_path)
    assert code == 1 and "collector-000001.jsonl: line 1" in text
    assert run("replay", tmp_path / "none.jsonl")[0] == 2


@pytest.mark.long
def test_a_guard_of_the_command_gives_back_and_listens(
    tmp_path: Path, script: Callable[[str], ModuleType]
) -> None:
    pytest.importorskip("rusty_bacnet", reason="needs a BACnet device of another stack: pip install rusty-bacnet")
    pytest.importorskip("bacpypes3", reason="needs the extra [live]")
    script("_bacnet_device")
    device = script("_bacnet_site").SimulatedSite(RATE)
    path = make(tmp_path, device.start(), "advise")
    device.operate(1, 22.0, 13)  # what a guard left that was killed
    end = time.monotonic() + 60.0
    while not device.held(13) and time.monotonic() < end:
        time.sleep(0.02)
    guard = subprocess.Popen(
        [sys.executable, "-m", "mpc.cli", "operate", str(path), "--part", "guard"], cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])},
    )  # fmt: skip
    try:
        while not (tmp_path / "live" / "guard.sock").exists() and time.monotonic() < end:
            time.sleep(0.02)
        while device.held(13) and time.monotonic() < end:
            time.sleep(0.02)
        assert device.held(13) == {}
        told = json.loads(run("operate", path, "--status", "--json")[1])
        assert told["decision"]["modes"] == {SET: "advise"} and "not been heard of" in told["decision"]["doubts"][0]
        assert run("operate", path, "--approve", "all")[0] == 2  # there is no plan
        for wrong, says in (("actt", "the nearest valid one is 'act'"), ("act:x/y", "one that may be written to")):
            code, text = run("operate", path, "--mode", wrong)
            assert code == 2 and says in text
        code, text = run("operate", path, "--mode", f"shadow:{SET}")
        assert code == 0 and "The guard took it" in text
        while time.monotonic() < end and told["decision"]["modes"] != {SET: "shadow"}:
            told = json.loads(run("operate", path, "--status", "--json")[1])
            time.sleep(0.02)
        assert told["decision"]["modes"] == {SET: "shadow"}
        second = subprocess.run(guard.args, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert second.returncode == 2 and "expected one guard a site" in second.stderr
        guard.send_signal(signal.SIGTERM)
        assert guard.wait(20.0) == 0
    finally:
        guard.kill()
        guard.wait()
        device.stop()
    code, text = run("replay", tmp_path / "live", "--json")
    assert code == 0 and json.loads(text)["guard-000000.jsonl"]["decisions"] >= 2
