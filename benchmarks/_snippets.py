"""Blocks of code of the documentation, run as printed: each page in a folder and a process of its own, in order.

A block is what stands between two fences. In a language that runs (`sh`, `console`, `python`) it runs; with a title it
is written as the file of that name. A comment on the line above, which the pages do not show, says what else counts:

    <!-- snippet: slow -->                      run in the slow set alone, as it takes over some seconds
    <!-- snippet: background -->                left running once it has named its address; ended with its page
    <!-- snippet: needs pyenergyplus -->        run where that module is installed
    <!-- snippet: not run: needs a database --> none of these; with the reason

They may be combined, `slow, background`. A reader is taken to have the checkout's `examples` and `benchmarks`, and
files of the names in `GIVEN`.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import json
import linecache
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(
    r"^(?:<!-- snippet: (?P<mark>[^\n]*?) -->\n)?"
    r"```(?P<language>\w*)(?: title=\"(?P<title>[^\"\n]+)\")?\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
SHELL, PYTHON = ("sh", "console"), ("python",)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
#: Share by which a printed number may differ from the one on the page: fits differ by this from machine to machine.
LOOSE = 0.15
#: Longest wait for a server in the background, and for a block [s].
START_LIMIT, BLOCK_LIMIT = 120.0, 1800.0


@dataclass(frozen=True)
class Snippet:
    """A block of a page: where it stands, what it is, and what its mark says."""

    page: str
    line: int
    language: str
    title: str
    text: str
    mark: str

    @property
    def where(self) -> str:
        """Page and line."""
        return f"{self.page}:{self.line}"

    @property
    def reason(self) -> str:
        """Why it is not run; empty where it is."""
        return self.mark.partition("not run: ")[2]

    @property
    def kind(self) -> str:
        """What is done with it: `file`, `not run`, `slow`, `quick`; empty where mark or language are not known."""
        words = {word.strip() for word in self.mark.split(",")} - {""}
        if self.reason:
            return "not run"
        unknown = {w for w in words - {"slow", "background"} if not w.startswith("needs ")}
        if unknown or not (self.title or self.language in (*SHELL, *PYTHON)):
            return ""
        if self.title:
            return "file"
        return "slow" if "slow" in words else "quick"

    @property
    def missing(self) -> str:
        """A module that the mark names and that is not installed; empty where there is none."""
        named = re.findall(r"needs (\w+)", "" if self.reason else self.mark)
        return next((name for name in named if find_spec(name) is None), "")


@dataclass(frozen=True)
class Outcome:
    """What running a block gave: whether it did what the page says, what it said, and CPU and wall time [s]."""

    where: str
    kind: str
    passed: bool
    said: str
    cpu: float
    wall: float


def pages() -> list[Path]:
    """README and the pages of the documentation."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def snippets(page: Path) -> list[Snippet]:
    """Blocks of a page, in order."""
    text, name = page.read_text(encoding="utf-8"), str(page.relative_to(ROOT))
    found = []
    for block in BLOCK.finditer(text):
        line = text.count("\n", 0, block.start("language")) + 2
        marks = (block["language"], block["title"] or "", block["text"], block["mark"] or "")
        found.append(Snippet(name, line, *marks))
    return found


def run_page(page: Path, *, slow: bool = False) -> list[Outcome]:
    """Run a page's blocks in order, in a folder of their own that holds what a reader is taken to have.

    Parameters
    ----------
    page : Path
        The page.
    slow : bool
        Whether blocks marked as slow run too.

    Returns
    -------
    list of Outcome
        Of each block that ran or was written; after the first that failed nothing is run.
    """
    kinds = ("file", "quick", "slow") if slow else ("file", "quick")
    wanted = [s for s in snippets(page) if s.kind in kinds and not s.missing]
    if all(s.kind == "file" for s in wanted):
        return []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        give(Path(folder), "\n".join(s.text for s in wanted))
        paths = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
        here = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
        answer = _answer(
            json.dumps([asdict(s) for s in wanted]),
            Path(folder),
            {**os.environ, "PATH": paths, "PYTHONPATH": here, "COLUMNS": "120", "NO_COLOR": "1"},
        )
    return [Outcome(**outcome) for outcome in json.loads(answer)]


def _answer(blocks: str, folder: Path, environment: dict[str, str]) -> str:
    """Run blocks in a process that leads a group with all that it starts; nothing of the group is left at the end."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as complaints:
        process = subprocess.Popen(
            [sys.executable, __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=complaints,
            env=environment,
            cwd=folder,
            text=True,
            start_new_session=True,
        )
        stdin, stdout = process.stdin, process.stdout
        if stdin is None or stdout is None:
            raise RuntimeError("pipes were asked for")
        try:
            stdin.write(blocks + "\n")
            stdin.flush()  # it stays open: its end tells the other side that this process is gone
            answer = stdout.read()
            process.wait()
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            stdin.close()
            stdout.close()
        if process.returncode:
            complaints.seek(0)
            said = complaints.read()[-2000:]
            raise RuntimeError(f"{folder}: the process of a page ended with {process.returncode}: {said}")
        return answer


def _end_with_parent() -> None:
    """Wait, in a thread, until the process that gave the blocks is gone, however it ended; then end the group."""
    sys.stdin.read()
    os.killpg(os.getpgrp(), signal.SIGKILL)


def give(folder: Path, text: str) -> None:
    """Put what a reader is taken to have, as far as a page's blocks name it, into a folder."""
    for name in ("benchmarks", "examples"):
        (folder / name).symlink_to(ROOT / name)
    for name, make in GIVEN.items():
        if re.search(rf"\b{re.escape(name)}\b", text):
            make(folder / name)


def _case(path: Path) -> None:
    from thermal.data import bundled_case_path

    shutil.copytree(str(bundled_case_path()), path)


def _cases(path: Path) -> None:
    for name in ("one", "two"):
        _case(path / name)


def _year(path: Path) -> None:
    from thermal import save_case
    from thermal.pilot.building import pilot_building
    from thermal.pilot.twin import TwinSettings, generate_twin

    office = pilot_building(1, floor_area=250.0, zones=5)
    save_case(generate_twin(office, 0, TwinSettings(days=56.0, dx=1.0))[0], path)


def _weather(path: Path) -> None:
    import pyenergyplus

    files = Path(pyenergyplus.__file__).parent / "data" / "weather"
    shutil.copy(next(files.glob("USA_IL_Chicago*.epw")), path)


#: A case, a folder of cases, a case of two months, and a weather file: what a page may name without having made it.
GIVEN = {"CASE": _case, "CASES": _cases, "YEAR": _year, "town.epw": _weather}


def agrees(wanted: str, found: str) -> bool:
    """Whether output is what a page says: `...` is anything, spaces do not count, numbers nearly agree."""
    pattern, numbers = "", []
    for part in re.split(rf"(\.\.\.|{NUMBER.pattern})", " ".join(wanted.split())):
        if part == "...":
            pattern += ".*?"
        elif NUMBER.fullmatch(part):
            numbers.append(float(part))
            pattern += f"({NUMBER.pattern})"
        else:
            pattern += re.escape(part)
    text = " ".join(found.split())
    return any(
        all(abs(float(number) - w) <= LOOSE * abs(w) for number, w in zip(match.groups(), numbers, strict=True))
        for match in re.finditer(pattern, text)
    )


def shell(snippet: Snippet, background: list[subprocess.Popen[str]]) -> tuple[bool, str]:
    """Run a block of commands; where it has `$` before its commands, the rest is their output."""
    wanted: list[tuple[str, str]] = []
    for line in snippet.text.splitlines(keepends=True) if snippet.text.startswith("$ ") else ():
        if line.startswith("$ "):
            wanted.append((line[2:], ""))
        else:
            wanted[-1] = (wanted[-1][0], wanted[-1][1] + line)
    said = ""
    for command, output in wanted or [(snippet.text, "")]:
        call = ["bash", "-euo", "pipefail", "-c", command]
        if "background" in snippet.mark:
            return start(call, background)
        done = subprocess.run(
            call, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=BLOCK_LIMIT, check=False
        )
        said += done.stdout + done.stderr
        if done.returncode:
            return False, said
        if output and not agrees(output, done.stdout + done.stderr):
            return False, f"expected, loosely\n{output}\ngot\n{done.stdout}{done.stderr}"
    return True, said


def start(call: list[str], background: list[subprocess.Popen[str]]) -> tuple[bool, str]:
    """Start a server and wait until it has named its address."""
    process = subprocess.Popen(
        call,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    background.append(process)
    said, began = "", time.monotonic()
    for line in process.stdout or ():
        said += line
        if "http://" in said or time.monotonic() - began > START_LIMIT:
            break
    return "http://" in said, said


def python(snippet: Snippet, names: dict[str, Any]) -> tuple[bool, str]:
    """Run statements, or a session with the answers that it gives."""
    said = io.StringIO()
    if ">>> " in snippet.text:
        session = doctest.DocTestParser().get_doctest(snippet.text, names, snippet.page, snippet.page, snippet.line - 1)
        runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
        failed, _ = runner.run(session, out=said.write, clear_globs=False)
        names.update(session.globs)
        return not failed, said.getvalue()
    name = f"<{snippet.where}>"
    linecache.cache[name] = (len(snippet.text), None, snippet.text.splitlines(keepends=True), name)
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        try:
            exec(compile(snippet.text, name, "exec"), names)
        except BaseException:
            return False, said.getvalue() + traceback.format_exc()
    return True, said.getvalue()


def used() -> float:
    """CPU time of this process and its children until now [s]."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in both)


def run(blocks: list[Snippet]) -> Iterator[Outcome]:
    """Run blocks in this folder and process, up to the first that fails."""
    module = ModuleType("page")  # classes look up their annotations in it
    sys.modules[module.__name__] = module
    background: list[subprocess.Popen[str]] = []
    try:
        for snippet in blocks:
            cpu, began = used(), time.monotonic()
            if snippet.kind == "file":
                Path(snippet.title).parent.mkdir(parents=True, exist_ok=True)
                Path(snippet.title).write_text(snippet.text, encoding="utf-8")
                passed, said = True, ""
            elif snippet.language in SHELL:
                passed, said = shell(snippet, background)
            else:
                passed, said = python(snippet, module.__dict__)
            yield Outcome(snippet.where, snippet.kind, passed, said[-6000:], used() - cpu, time.monotonic() - began)
            if not passed:
                return
    finally:
        for process in background:
            process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(20.0)  # what is left then goes with the group


if __name__ == "__main__":
    results, real = list[dict[str, Any]](), os.dup(1)
    os.dup2(2, 1)  # what is printed beside sys.stdout must not mix with the answer
    sys.path[0] = ""  # the reader's folder, as for an interpreter that is started there
    given = json.loads(sys.stdin.readline())
    threading.Thread(target=_end_with_parent, daemon=True).start()
    results = [asdict(outcome) for outcome in run([Snippet(**s) for s in given])]
    with os.fdopen(real, "w", encoding="utf-8") as answer:
        json.dump(results, answer)
