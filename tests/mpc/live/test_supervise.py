"""Parts that end are started anew, later each time; the end of all is orderly."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest

from mpc.live import supervise
from mpc.live.page.metrics import process_use
from mpc.live.state import read_state
from mpc.live.supervise import Supervisor


def test_parts_are_started_anew_and_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervise, "_WAIT", 0.05)
    log = tmp_path / "log"
    text = ("import signal, sys, time; log = open({log!r}, 'a', buffering=1); log.write('+{part}\\n')\n"
            "def end(*_):\n    log.write('-{part}\\n'); sys.exit()\n"
            "signal.signal(signal.SIGTERM, end)\nlog.write('!{part}\\n'); time.sleep({life})")  # fmt: skip
    lives = {"guard": 60, "controller": 0}
    parts = Supervisor(
        tmp_path / "site.yaml", tmp_path, tuple(lives),
        lambda part: [sys.executable, "-c", text.format(log=str(log), part=part, life=lives[part])],
    )  # fmt: skip
    end = time.monotonic() + 30.0
    while time.monotonic() < end:
        parts.look()
        seen = log.read_text().split() if log.exists() else []
        if seen.count("+controller") >= 3 and "!guard" in seen:
            break
        time.sleep(0.02)
    assert seen.count("+controller") >= 3 and seen.count("+guard") == 1
    guard = parts.processes["guard"]
    assert read_state(tmp_path / "parts.json")["guard"] == guard.pid
    used = process_use(guard.pid)
    assert used is not None and used[1] > 1e6
    parts.end()
    assert guard.poll() is not None and log.read_text().split()[-1] == "-guard"
    assert process_use(guard.pid) is None
