"""The audit log: a chain that shows every change, and replays that repeat decisions bit for bit."""

from __future__ import annotations

import gzip
import json
import os
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from mpc.errors import LiveError
from mpc.live.audit import NOTHING, AuditLog, canonical, log_files, log_lines, read_log
from mpc.live.guard.decide import Guard
from mpc.live.guard.rules import GuardRules, Limits, PointRule
from mpc.live.replay import Replay, replay_log, replay_logs

SET = "hall/supply_air_temperature_setpoint"
RULES = GuardRules(
    "c" * 64, Limits(900.0, 60.0, 180.0, 1350.0, 900.0, 5.0, 900.0, 3600.0),
    {SET: PointRule("act", 285.0, 295.0, 0.0, "relinquish", 13)}, {},
)  # fmt: skip


def guarded(folder: Path, ticks: int = 6) -> Path:
    """Log of a guard that takes a plan, follows it and doubts in the end."""
    guard = Guard(RULES)
    log = AuditLog(folder, "guard", lambda: {"code": "x", "rules": RULES.to_dict(), "state": guard.state.to_dict()})
    log.append("start", {"code": "x", "rules": RULES.to_dict(), "modes": {}, "held_before": {}, "wall": 0.0})
    slots: dict[str, float] = {}
    for k in range(ticks):
        plan = {"number": 1, "made": 60.0, "configuration": "c" * 64, "status": "planned", "values": {SET: 290.1 + 0.2},
                "inputs": {}}  # fmt: skip
        tick = {
            "mono": 60.0 * k, "wall": 60.0 * k, "beat": 60.0 * min(k, 3), "stopping": False, "results": {SET: ""}, "ordered": 60.0 * k - 60.0,
            "messages": [{"kind": "plan", "plan": plan}] if k == 1 else [],
            "readings": {SET: {"value": 290.0, "slots": dict(slots), "error": ""}},
        }  # fmt: skip
        decision = guard.decide(tick)
        log.append("tick", {"tick": tick, "decision": decision})
        slots = {"13": decision["writes"][SET]} if decision["writes"] else {} if decision["releases"] else slots
    log.close()
    return log.path


def test_a_log_replays(tmp_path: Path) -> None:
    path = guarded(tmp_path)
    found = replay_log(path, earlier=Replay(last=NOTHING))
    assert found.fine and found.lines == 7 and found.decisions == 6
    assert found.notes and "was written by x" in found.notes[0]
    decisions = [e["content"]["decision"] for _, e in read_log(path) if e["kind"] == "tick"]
    assert decisions[1]["writes"] == {SET: 290.1 + 0.2} and decisions[2]["held"]


@pytest.mark.parametrize(
    ("spoil", "line"),
    [
        (lambda lines: [*lines[:3], lines[3].replace(b"290.3", b"299.9"), *lines[4:]], "line 4"),
        (lambda lines: lines[:2] + lines[3:], "line 3"),
        (lambda lines: [*lines[:3], lines[2], *lines[3:]], "line 4"),
        (lambda lines: [lines[0], lines[2], lines[1], *lines[3:]], "line 2"),
        (lambda lines: [*lines[:4], b"{}\n", *lines[4:]], "line 5"),
        (lambda lines: [*lines[:4], b"\xff[\n", *lines[4:]], "line 5"),
        (lambda lines: lines[1:], "line 1"),
    ],
)
def test_what_breaks_the_chain_is_named(tmp_path: Path, spoil: Any, line: str) -> None:
    path = guarded(tmp_path)
    path.write_bytes(b"".join(spoil(path.read_bytes().splitlines(keepends=True))))
    found = replay_log(path, earlier=Replay(last=NOTHING))
    assert not found.fine and f"{path.name}: {line}:" in found.broken


def test_a_decision_that_was_forged_with_its_chain_does_not_replay(tmp_path: Path) -> None:
    entries = [e for _, e in read_log(guarded(tmp_path / "a"))]
    log = AuditLog(tmp_path / "b", "guard", dict)
    for entry in entries:
        if entry["kind"] == "tick" and entry["content"]["decision"]["writes"]:
            entry["content"]["decision"]["writes"][SET] = 291.0
        log.append(entry["kind"], entry["content"])
    log.close()
    found = replay_log(log.path)
    assert not found.broken and found.different == ["guard-000000.jsonl: line 3: other writes"]


def test_files_go_on_from_each_other_and_a_torn_line_is_left_out(tmp_path: Path) -> None:
    first = guarded(tmp_path)
    with first.open("ab") as file:
        file.write(b'{"n": 7, "torn')
    second = guarded(tmp_path)
    assert second.name == "guard-000001.jsonl"
    assert all(one.fine for one in replay_logs([first, second]).values())
    assert "before it" in replay_log(second, earlier=Replay(last=NOTHING)).broken


def test_a_full_file_is_turned_and_compressed_and_each_replays_by_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mpc.live.audit.LARGEST", 4000)
    guarded(tmp_path, ticks=40)
    deadline = time.monotonic() + 20.0
    while len(list(tmp_path.glob("*.gz"))) < len(log_files(tmp_path)) - 1 and time.monotonic() < deadline:
        time.sleep(0.01)
    files = log_files(tmp_path, "guard")
    assert len(files) > 4 and [file.suffix for file in files] == [".gz"] * (len(files) - 1) + [".jsonl"]
    together = replay_logs(files)
    assert all(one.fine for one in together.values()) and sum(one.decisions for one in together.values()) == 40
    alone = [replay_log(file) for file in files]
    assert all(one.fine for one in alone) and [one.decisions for one in alone] == [
        one.decisions for one in together.values()
    ]
    assert "before it" in replay_logs([files[0], files[2]])[files[2]].broken  # a file is missing
    first = gzip.decompress(files[1].read_bytes())
    files[1].with_suffix("").write_bytes(first)  # as one that was killed while it compressed leaves it
    assert log_files(tmp_path)[1].suffix == ".jsonl" and len(log_files(tmp_path)) == len(files)
    files[2].write_bytes(files[2].read_bytes()[:-9])
    assert "a whole compressed file" in replay_log(files[2]).broken
    (tmp_path / "guard-000000.jsonl.part").touch()
    monkeypatch.undo()
    guarded(tmp_path)
    assert not list(tmp_path.glob("*.part"))


def test_a_state_that_was_forged_where_a_file_turns_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mpc.live.audit.LARGEST", 4000)
    guarded(tmp_path / "a", ticks=12)
    log: AuditLog | None = None
    monkeypatch.setattr("mpc.live.audit.LARGEST", 10**9)
    for number, path in enumerate(log_files(tmp_path / "a")):
        log = AuditLog(tmp_path / "b", "guard", dict)
        for _, entry in read_log(path):
            if number and entry["kind"] == "turned":
                entry["content"]["state"]["modes"][SET] = "shadow"
            log.append(entry["kind"], entry["content"])
        log.close()
    second = list(replay_logs(log_files(tmp_path / "b")).values())[1]
    assert "line 1: another state than that at the end of the file before" in second.different[0]


def test_a_turn_that_fails_is_told_and_one_that_comes_too_late_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mpc.live.audit.LARGEST", 100)
    log = AuditLog(tmp_path, "guard", dict)
    (tmp_path / "guard-000001.jsonl").touch()  # there already
    with pytest.raises(LiveError, match="a folder that can be written to"):
        log.append("tick", {"text": "x" * 100})
    log.close()
    with pytest.raises(LiveError, match="one that is open"):
        log.append("tick", {})
    monkeypatch.undo()

    begun, go = threading.Event(), threading.Event()
    late = AuditLog(tmp_path, "late", dict)
    fsync = os.fsync

    def hangs(handle: int) -> None:
        begun.set()
        go.wait(20.0)
        fsync(handle)

    monkeypatch.setattr("mpc.live.audit.LARGEST", 100)
    monkeypatch.setattr("mpc.live.audit.os.fsync", hangs)
    thread = threading.Thread(target=late.append, args=("tick", {"text": "x" * 100}))
    thread.start()
    begun.wait(20.0)
    late.close()  # which does not wait
    go.set()
    thread.join(20.0)
    assert log_files(tmp_path, "late") == [late.path]
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(late._file)


def test_other_files_beside_and_one_that_is_compressed_meanwhile(tmp_path: Path) -> None:
    path = guarded(tmp_path)
    (tmp_path / "guard-000000-copy.jsonl").write_bytes(path.read_bytes())
    assert log_files(tmp_path) == [path] == log_files(tmp_path, "guard")
    lines = log_lines(path)
    path.with_name(path.name + ".gz").write_bytes(gzip.compress(path.read_bytes()))
    path.unlink()
    assert log_lines(path) == lines


def test_only_finite_numbers_of_one_spelling() -> None:
    assert canonical({"b": 0.1 + 0.2, "a": -0.0}) == '{"a":-0.0,"b":0.30000000000000004}'
    with pytest.raises(ValueError, match="not JSON compliant"):
        canonical({"x": float("nan")})
    assert json.loads(canonical(1e-323)) == 1e-323


def test_no_log_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(LiveError, match="no such file"):
        replay_log(tmp_path / "guard-000000.jsonl")
