"""README and documentation print what works: blocks of code run as they stand; of those that take long, or that cannot be run here, commands and imports are there."""

from __future__ import annotations

import ast
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import typer.main

from mpc.cli.app import app

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def runner() -> Any:
    """Give the module that knows the pages' blocks and runs them."""
    import importlib

    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        return importlib.import_module("_snippets")
    finally:
        sys.path.remove(str(ROOT / "benchmarks"))


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_blocks_run_as_printed(page: Path, runner: Any) -> None:
    """Those that are quick; the slow ones are run by hand, with benchmarks/documented_snippets.py: they take too long for every run."""
    failed = [f"{o.where}\n{o.said}" for o in runner.run_page(page) if not o.passed]
    assert not failed, "\n".join(failed)


def test_every_block_is_run_or_says_why_not(runner: Any) -> None:
    blocks, wrong = [], []
    for page in PAGES:
        found, text = runner.snippets(page), page.read_text(encoding="utf-8")
        fences = len(re.findall(r"^ *```", text, re.MULTILINE))
        if fences != 2 * len(found) or text.count("<!-- snippet:") != sum(bool(s.mark) for s in found):
            wrong.append(
                f"{page.name}: expected a mark on the line above a fence, and fences at the left; found {fences} fences"
            )
        blocks += found
    wrong += [
        f"{s.where}: expected sh, console, python or a title; found '{s.language}', '{s.mark}'"
        for s in blocks
        if not s.kind
    ]
    wrong += [
        f"{s.where}: {path}: no such file"
        for s in blocks
        for path in re.findall(r"(?:tests|benchmarks)/[\w/.]+", s.reason)
        if not (ROOT / path).exists()
    ]
    run = [s for s in blocks if s.kind in ("quick", "slow")]
    assert not wrong, "\n".join(wrong)
    assert 2 * len(run) > 3 * sum(s.kind == "not run" for s in blocks) and len(run) > 50


def test_every_printed_command_and_its_options_are_there(runner: Any) -> None:
    group: Any = typer.main.get_command(app)
    wrong, seen = [], 0
    for snippet in (s for page in PAGES for s in runner.snippets(page) if s.language in runner.SHELL):
        lines = re.sub(r"^\$ ", "", snippet.text, flags=re.MULTILINE).replace("\\\n", " ").splitlines()
        for part in (part for line in lines if "'" not in line for part in line.split(" && ")):
            words = shlex.split(part, comments=True)
            if not words or Path(words[0]).name != "buildingmpc":
                continue
            seen += 1
            words = words[1:]
            while words[0] == "--plugin":
                words = words[2:]
            try:
                group.commands[words[0]].make_context(words[0], words[1:])
            except Exception as error:
                wrong.append(f"{snippet.where}: {' '.join(words)}: {type(error).__name__}: {error}")
    assert seen > 40 and not wrong, "\n".join(wrong)


def test_imports_of_every_printed_python_resolve(runner: Any) -> None:
    wrong, seen = [], 0
    for snippet in (s for page in PAGES for s in runner.snippets(page) if s.language == "python"):
        text = snippet.text
        if ">>> " in text:
            text = "\n".join(line[4:] for line in text.splitlines() if line.startswith((">>> ", "... ")))
        for statement in ast.walk(ast.parse(text)):
            if isinstance(statement, ast.Import | ast.ImportFrom):
                seen += 1
                try:
                    exec(compile(ast.Module([statement], []), snippet.where, "exec"), {})
                except ImportError as error:
                    names = {alias.name for alias in statement.names} | {getattr(statement, "module", "")}
                    if not {"gymnasium", "stable_baselines3", "night_machines"} & names and "extra" not in str(error):
                        wrong.append(f"{snippet.where}: {ast.unparse(statement)}: {error}")
    assert seen > 40 and not wrong, "\n".join(wrong)


def test_output_is_compared_loosely(runner: Any) -> None:
    said = "Case is valid: 6 zones on 299 m²,\n  14.0 days.\nmore"
    assert runner.agrees("6 zones on 300 m², ... days", said)
    assert not runner.agrees("6 zones on 200 m²", said) and not runner.agrees("7 rooms", said)


def test_what_fails_is_told(runner: Any, tmp_path: Path, monkeypatch: Any) -> None:
    """A command that fails, an output and an answer that differ, and a statement that raises fail the page, and end it."""
    fence = "`" * 3
    wrong = {
        "sh": "false\necho on", "console": "$ echo 3 rooms\n4 rooms", "python": ">>> 1 + 1\n3\n",
    }  # fmt: skip
    monkeypatch.setattr(runner, "ROOT", tmp_path)
    for language, text in {**wrong, "python3": ""}.items():
        page = tmp_path / "page.md"
        kind, text = ("python", "raise ValueError('here')") if language == "python3" else (language, text)
        page.write_text(f"{fence}{kind}\n{text}\n{fence}\n\n{fence}sh\necho later\n{fence}\n", encoding="utf-8")
        first, *later = runner.run_page(page)
        assert not first.passed and first.where == "page.md:2" and not later
    assert "here" in first.said


def test_what_a_page_started_ends_with_its_runner(tmp_path: Path) -> None:
    """A server in the background and the page's process are gone after the runner was killed."""
    fence, where = "`" * 3, tmp_path / "where"
    page, docs = tmp_path / "page.md", f"echo $$ > {where}.new; mv {where}.new {where}; echo http://here; exec sleep 60"
    page.write_text(
        f"<!-- snippet: background -->\n{fence}sh\n{docs}\n{fence}\n\n{fence}sh\nsleep 60\n{fence}\n", encoding="utf-8"
    )
    call = f"import _snippets; _snippets.ROOT = _snippets.Path({str(tmp_path)!r}); _snippets.run_page(_snippets.Path({str(page)!r}))"
    path = os.pathsep.join(filter(None, [str(ROOT / "benchmarks"), os.environ.get("PYTHONPATH", "")]))
    with subprocess.Popen([sys.executable, "-c", call], env={**os.environ, "PYTHONPATH": path}) as runner:
        assert _comes(where.exists)
        runner.kill()
    server = int(where.read_text())
    assert _comes(lambda: not _runs(server))


def _runs(process: int) -> bool:
    """Whether a process is there, and no mere entry that nobody has asked for."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = subprocess.run(
        ["ps", "-o", "stat=", "-p", str(process)], capture_output=True, text=True, check=False
    ).stdout
    return bool(state.strip()) and not state.startswith("Z")


def _comes(true: Callable[[], bool], limit: float = 30.0) -> bool:
    """Whether something becomes true within some seconds."""
    end = time.monotonic() + limit
    while not true() and time.monotonic() < end:
        time.sleep(0.05)
    return true()
