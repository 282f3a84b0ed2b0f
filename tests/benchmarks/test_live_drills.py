"""Drills of operation: what the journal of the wire counts as wrong, and a few real ones with all processes."""

from __future__ import annotations

import shutil
import struct
import tempfile
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
    decode = script("_bacnet_site").decode_write
    assert decode(request(2, 3, 21.5, 13)) == (7, (2, 3), 85, 13, 21.5)
    assert decode(request(2, 1, None, 8)) == (7, (2, 1), 85, 8, None)
    assert decode(b"") is None and decode(bytes([0x81, 0x0A, 0, 17, 1, 4, 0, 5, 1, 12, 0x0C, 0, 0, 0, 2, 0x19, 85])) is None


@pytest.fixture(scope="module")
def drills(script: Callable[[str], ModuleType]) -> ModuleType:
    for name, extra in (("bacpypes3", "live"), ("psycopg", "live"), ("rusty_bacnet", "test")):
        pytest.importorskip(name, reason=f"needs the extra [{extra}]")
    for name in ("_bacnet_site", "_drill_process", "_postgres", "_drill_stack", "_drill_faults", "_table"):
        script(name)
    return script("live_drills")


def test_what_counts_as_a_bad_write(drills: ModuleType, script: Callable[[str], ModuleType]) -> None:
    write = script("_bacnet_site").Write

    def told(*writes: Any) -> list[str]:
        return [text for _, text in drills.bad_writes([write(*one) for one in writes])]

    fine = [(1.0, (2, 1), 85, 13, 20.4, True), (1.15, (2, 1), 85, 13, 20.9, True), (2.0, (2, 1), 85, 13, None, True),
            (3.0, (2, 2), 85, 13, 23.0, True)]  # fmt: skip
    assert told(*fine) == []
    assert "object (2, 3)" in told((1.0, (2, 3), 85, 13, 20.0, True))[0]
    assert "priority 8" in told((1.0, (2, 1), 85, 8, None, True))[0]
    assert "point 2 at 23.5" in told((1.0, (2, 2), 85, 13, 23.5, True))[0]
    assert "from 20.4 to 22.5 in 30 s" in told(fine[0], (1.15, (2, 1), 85, 13, 22.5, True))[0]


#: Parts, the wire, an operator, a clock, the device, the database, a plan: what takes about 20 s of one core.
CHOSEN = (
    "controller killed", "guard killed", "network cut", "operator overrides the first", "clock jumps ahead",
    "writes refused", "database down", "plan out of range",
)  # fmt: skip


def test_real_drills(drills: ModuleType, script: Callable[[str], ModuleType]) -> None:
    if script("_postgres").programs() is None:
        pytest.skip("needs a PostgreSQL server (Debian: apt install postgresql)")
    top = Path(tempfile.mkdtemp(prefix="drills"))  # the database's user must get there, and not into pytest's folders
    top.chmod(0o755)
    lines: list[str] = []
    try:
        one_site = drills.run_drills(len(CHOSEN), 7, top / "site", ",".join(CHOSEN), lines.append)
    finally:
        shutil.rmtree(top, ignore_errors=True)
    found = drills.together([one_site], 1)
    assert sorted(one["fault"] for one in found["drills"]) == sorted(CHOSEN)
    for one in found["drills"]:
        assert not one["bad_writes"] and not one["overridden"] and not one["not_back"], one
        assert not one["late"], one  # a control step is 1.5 s: a machine that stands still for a second fails here
    assert found["lost"] == 0 and found["samples"] > 150 and found["writes"] > 20
    assert found["not_replayed"] == [] and found["decisions"] > 75
    assert "| all | 8 | 0 | 0 | 0 |" in drills.report(found)  # a busy machine may have points given back without need
