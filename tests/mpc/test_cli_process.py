"""The console command as a process: exit codes, streams, start-up, and the progress bar of a terminal."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mpc.cli import console as _console
from thermal.data import bundled_case_path

HEAVY = ("casadi", "matplotlib", "numpy", "pandas", "scipy", "thermal.case", "thermal.model", "calibration.fit")


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mpc.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", timeout=120, check=False)


@pytest.mark.long
def test_stdout_is_json_alone() -> None:
    answer = run("check", bundled_case_path(), "--json")
    assert (answer.returncode, answer.stderr) == (0, "")
    assert json.loads(answer.stdout)["name"] == "bundled_case"


def test_bad_input_leaves_with_2_and_no_traceback(tmp_path: Path) -> None:
    answer = run("calibrate", tmp_path, "--out", tmp_path / "out")
    assert (answer.returncode, answer.stdout) == (2, "")
    assert answer.stderr.startswith("error: CaseError: ") and "Traceback" not in answer.stderr
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_command_leaves_with_2() -> None:
    answer = run("calibrat", "x")
    assert (answer.returncode, answer.stdout) == (2, "")
    assert "calibrate" in answer.stderr and "Traceback" not in answer.stderr


def test_help_loads_nothing_heavy() -> None:
    code = (
        "import sys\nfrom mpc.cli import main\ntry:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
        f"print([m for m in {HEAVY!r} if m in sys.modules], file=sys.stderr)"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code, "--help"], capture_output=True, text=True, timeout=60, check=True
    )
    assert "calibrate" in answer.stdout
    assert answer.stderr.strip() == "[]"


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
def test_a_bar_appears_on_a_terminal_only_and_only_after_a_while(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_console, "PATIENCE", 0.2)
    monkeypatch.setenv("TERM", "xterm")
    main_end, terminal = os.openpty()
    with os.fdopen(terminal, "w", encoding="utf-8") as stream:
        monkeypatch.setattr(sys, "stderr", stream)
        with _console.Waiting("short") as waiting:
            waiting("work", 1, 2)
        with _console.Waiting("long") as waiting:
            waiting("work", 1, 2)
            time.sleep(0.6)
            waiting("work", 2, 2)
            time.sleep(0.2)
        stream.flush()
        shown = os.read(main_end, 100_000).decode("utf-8")
    os.close(main_end)
    assert "long: work" in shown and "short" not in shown


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
def test_the_bar_never_goes_back_and_says_how_long_it_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_console, "PATIENCE", 0.05)
    monkeypatch.setenv("TERM", "xterm")
    main_end, terminal = os.openpty()
    with os.fdopen(terminal, "w", encoding="utf-8") as stream:
        monkeypatch.setattr(sys, "stderr", stream)
        with _console.Waiting("long") as waiting:
            shares = []
            for done, total in ((1, 4), (0, 0), (1, 2), (1, 8), (3, 4), (0, 4)):
                waiting("work", done, total)
                time.sleep(0.12)
                assert waiting._bar is not None
                shares.append(waiting._bar.tasks[0].completed)
        stream.flush()
        shown = os.read(main_end, 100_000).decode("utf-8")
    os.close(main_end)
    assert shares == [0.25, 0.25, 0.5, 0.5, 0.75, 0.75]
    assert "left about" in shown and "0:00:0" in shown


def test_no_bar_without_a_terminal(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(_console, "PATIENCE", 0.01)
    with _console.Waiting("long") as waiting:
        time.sleep(0.1)
        waiting("work", 1, 2)
    assert capfd.readouterr() == ("", "")
