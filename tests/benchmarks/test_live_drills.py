"""Drills of operation: what the journal of the wire counts as wrong, and fifty real ones with all processes."""

from __future__ import annotations

import json
import struct
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest


def request(object_type: int, number: int, value: float | None, priority: int) -> bytes:
    """A WriteProperty of the present value, byte by byte from ASHRAE Standard 135."""
    body = bytes([0x00, 0x05, 7, 15, 0x0C]) + struct.pack(">I", object_type << 22 | number) + bytes([0x19, 85, 0x3E])
    body += (b"\x00" if value is None else b"\x44" + struct.pack(">f", value)) + bytes([0x3F, 0x49, priority])
    return bytes([0x81, 0x0A]) + struct.pack(">H", 6 + len(body)) + bytes([1, 4]) + body


def test_writes_are_read_off_the_wire(script: Callable[[str], ModuleType]) -> None:
    decode = script("_bacnet_device").decode_write
    assert decode(request(2, 3, 21.5, 13)) == (7, (2, 3), 85, 13, 21.5)
    assert decode(request(2, 1, None, 8)) == (7, (2, 1), 85, 8, None)
    assert decode(b"") is None and decode(bytes([0x81, 0x0A, 0, 17, 1, 4, 0, 5, 1, 12, 0x0C, 0, 0, 0, 2, 0x19, 85])) is None


@pytest.fixture(scope="module")
def drills(script: Callable[[str], ModuleType]) -> ModuleType:
    for name, extra in (("bacpypes3", "live"), ("psycopg", "live"), ("rusty_bacnet", "test")):
        pytest.importorskip(name, reason=f"needs the extra [{extra}]")
    for name in ("_bacnet_device", "_bacnet_site", "_drill_process", "_postgres", "_drill_stack", "_drill_faults", "_table"):
        script(name)
    return script("live_drills")


def test_what_counts_as_a_bad_write(drills: ModuleType, script: Callable[[str], ModuleType]) -> None:
    write = script("_bacnet_device").Write

    def told(*writes: Any) -> list[str]:
        return [text for _, text in drills.bad_writes([write(*one) for one in writes])]

    fine = [(1.0, (2, 1), 85, 13, 20.4, True), (1.15, (2, 1), 85, 13, 20.9, True), (2.0, (2, 1), 85, 13, None, True),
            (3.0, (2, 2), 85, 13, 23.0, True)]  # fmt: skip
    assert told(*fine) == []
    assert "object (2, 3)" in told((1.0, (2, 3), 85, 13, 20.0, True))[0]
    assert "priority 8" in told((1.0, (2, 1), 85, 8, None, True))[0]
    assert "point 2 at 23.5" in told((1.0, (2, 2), 85, 13, 23.5, True))[0]
    assert "from 20.4 to 22.5 in 30 s" in told(fine[0], (1.15, (2, 1), 85, 13, 22.5, True))[0]


@pytest.mark.long
def test_fifty_drills(drills: ModuleType, script: Callable[[str], ModuleType], tmp_path: Path) -> None:
    """Each fault twice; most of the time is waiting, so that two sites run side by side."""
    if script("_postgres").programs() is None:
        pytest.skip("needs a PostgreSQL server (Debian: apt install postgresql)")
    command = [sys.executable, drills.__file__, "--drills", "50", "--seed", "7", "--sites", "2", "--out", str(tmp_path)]
    answer = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600.0)
    assert answer.returncode == 0, answer.stderr
    found = json.loads((tmp_path / "live_drills.json").read_text(encoding="utf-8"))
    times = Counter(one["fault"] for one in found["drills"])
    assert set(times) == set(script("_drill_faults").FAULTS) and sum(times.values()) == 50
    for one in found["drills"]:
        assert not one["bad_writes"] and not one["overridden"] and not one["not_back"], one
    # a control step is 1.5 s: a machine that stands still for a second makes one late, which is not given back never
    late = [one for one in found["drills"] if one["late"]]
    assert len(late) <= 1 and all(one["steps"] is not None for one in late), drills.report(found)
    assert found["lost"] == 0 and found["samples"] > 1000 and found["writes"] > 150
    assert found["not_replayed"] == [] and found["decisions"] > 500
    assert "| all | 50 | 0 | 0 |" in drills.report(found)
