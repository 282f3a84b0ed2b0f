"""Sessions: one window has a case, others are told; one program has it, others are told."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from thermal.errors import SessionHeldError
from thermal.plan.page import sessions as _sessions
from thermal.plan.page.sessions import Sessions


def test_one_window_has_the_case(tmp_path: Path) -> None:
    sessions = Sessions(tmp_path)
    assert sessions.open("a") == {"mine": True}
    told = sessions.open("b")
    assert told["mine"] is False and told["seen"] >= 0.0
    with pytest.raises(SessionHeldError, match="another window"):
        sessions.check("b")
    sessions.check("a")
    assert sessions.open("b", take_over=True) == {"mine": True}
    with pytest.raises(SessionHeldError, match="another window"):
        sessions.check("a")


def test_a_window_that_is_loaded_anew_or_closed_gives_it_on(tmp_path: Path) -> None:
    sessions = Sessions(tmp_path)
    sessions.open("a")
    assert sessions.open("a2", previous="a") == {"mine": True}
    sessions.close("a")  # late: it is not that window's any more
    sessions.check("a2")
    sessions.close("a2")
    assert sessions.open("b") == {"mine": True}


def test_a_silent_window_loses_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sessions = Sessions(tmp_path)
    sessions.open("a")
    monkeypatch.setattr(_sessions, "PATIENCE", -1.0)
    assert sessions.open("b") == {"mine": True}


def lock(folder: Path, process: object) -> None:
    """Write the lock of another program."""
    (folder / "open.json").write_text(json.dumps({"program": "x", "process": process, "since": "today"}), "utf-8")


def test_another_program_is_told_unless_it_takes_over(tmp_path: Path) -> None:
    lock(tmp_path, os.getppid())
    with pytest.raises(SessionHeldError, match=f"process {os.getppid()} has open since today"):
        Sessions(tmp_path)
    sessions = Sessions(tmp_path, take_over=True)
    sessions.open("a")
    lock(tmp_path, os.getppid())  # and back again
    with pytest.raises(SessionHeldError, match="another program"):
        sessions.check("a")
    sessions.end()
    assert (tmp_path / "open.json").exists()


@pytest.mark.parametrize("process", [2**22 + 12345, -1, "spam", None, 10**30])
def test_the_lock_of_a_program_that_is_gone_does_not_count(tmp_path: Path, process: object) -> None:
    lock(tmp_path, process)
    Sessions(tmp_path).end()
    assert not (tmp_path / "open.json").exists()
