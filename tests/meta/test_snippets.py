"""What README and documentation print is right: commands and their options are there, imports resolve, and what is quick runs."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer.main
from typer.testing import CliRunner

from mpc.cli.app import app
from thermal.data import bundled_case_path

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SHELL, PYTHON = ("sh", "bash", "console", ""), ("python",)

#: Commands that are run here as they are printed, with the bundled case for CASE.
RUN = ("check", "effects", "doctor")

#: Other commands, and why they are only looked at here: whether command, options and arguments are there.
NOT_RUN = {
    "demo": "a minute; run by tests/mpc/studies/test_demo.py",
    "calibrate": "half a minute; run by tests/mpc/test_cli.py",
    "diagnose": "a minute; run by tests/mpc/test_cli_diagnose.py",
    "evaluate": "takes the result of calibrate; run by tests/mpc/test_cli.py",
    "simulate": "takes the result of calibrate; run by tests/mpc/test_cli.py",
    "experiment": "takes the result of diagnose; run by tests/mpc/test_cli_experiment.py",
    "monitor": "minutes; run by tests/calibration/monitoring",
    "identify": "half a minute; run by tests/mpc/adapters/described/test_identify_command.py",
    "control": "minutes; run by tests/mpc/test_cli_control.py",
    "compare": "minutes; run by tests/mpc/test_cli_control.py",
    "operate": "until it is interrupted; run by tests/mpc/test_cli_operate.py",
    "replay": "takes the log of operate; run by tests/mpc/test_cli_operate.py",
    "serve": "until it is interrupted; run by tests/mpc/test_cli_serve.py",
    "label": "until it is interrupted; run by tests/mpc/test_cli_label.py",
    "import-telemetry": "needs a table of one's own; run by tests/mpc/test_cli_import.py",
    "import-plan": "needs drawings of one's own; run by tests/mpc/test_cli_import.py",
    "import-devices": "needs a list of one's own; run by tests/mpc/test_cli_import.py",
}

#: Pages whose Python is run here as it is printed, block by block. Doctests and guides have tests of their own; of the
#: others syntax and imports are looked at, since they need minutes, a building of one's own, or another program.
PYTHON_RUN = ("linear_model.md", "kpis.md")


def blocks(kinds: tuple[str, ...]) -> Iterator[tuple[Path, int, str]]:
    """Page, line and text of each block of code."""
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for match in re.finditer(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
            if match[1] in kinds:
                yield page, text[: match.start()].count("\n") + 2, match[2]


def commands() -> Iterator[tuple[str, list[str]]]:
    """Place and words of each printed call of the command, behind its name."""
    for page, line, text in blocks(SHELL):
        for call in text.replace("\\\n", " ").splitlines():
            for part in call.split(" && "):
                words = shlex.split(part, comments=True)
                if words and Path(words[0]).name == "buildingmpc":
                    yield f"{page.name}:{line}", words[1:]


COMMANDS = list(commands())


def test_every_printed_command_and_its_options_are_there() -> None:
    group: Any = typer.main.get_command(app)
    wrong = []
    for place, words in COMMANDS:
        at = words.index("--plugin") + 2 if "--plugin" in words else 0
        name, *rest = words[at:]
        try:
            group.commands[name].make_context(name, rest)
        except Exception as error:
            wrong.append(f"{place}: {' '.join(words)}: {type(error).__name__}: {error}")
        if name not in (*RUN, *NOT_RUN):
            wrong.append(f"{place}: {name}: neither run nor listed with a reason")
    wrong += [f"{name}: {why}: no such test" for name, why in NOT_RUN.items() for path in re.findall(r"tests/[\w/.]+", why) if not (ROOT / path).exists()]
    assert len(COMMANDS) > 20 and not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    "words", sorted({tuple(words) for _, words in COMMANDS if words[0] in RUN and "CASE" in words}), ids=" ".join
)
def test_what_is_quick_runs_as_printed(words: tuple[str, ...], tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    answer = CliRunner().invoke(app, [str(bundled_case_path()) if word == "CASE" else word for word in words])
    assert answer.exit_code == 0, answer.output


def code(text: str) -> str:
    """Statements of a block, without the answers of a session."""
    if ">>> " not in text:
        return text
    lines = [line for line in text.splitlines() if line.startswith((">>> ", "... "))]
    return "\n".join(line[4:] for line in lines)


def test_imports_of_every_printed_python_resolve() -> None:
    wrong, seen = [], 0
    for page, line, text in blocks(PYTHON):
        try:
            tree = ast.parse(code(text))
        except SyntaxError as error:
            wrong.append(f"{page.name}:{line + (error.lineno or 1) - 1}: {error.msg}")
            continue
        for statement in ast.walk(tree):
            if isinstance(statement, ast.Import | ast.ImportFrom):
                seen += 1
                try:
                    exec(compile(ast.Module([statement], []), f"{page.name}:{line}", "exec"), {})
                except ImportError as error:
                    names = {alias.name for alias in statement.names} | {getattr(statement, "module", "")}
                    if not {"gymnasium", "my_controller"} & names and "extra" not in str(error):
                        wrong.append(f"{page.name}:{line}: {ast.unparse(statement)}: {error}")
    assert seen > 40 and not wrong, "\n".join(wrong)


@pytest.mark.parametrize("page", PYTHON_RUN)
def test_python_that_is_quick_runs_as_printed(page: str, tmp_path: Path, monkeypatch: Any) -> None:
    from mpc.kpi.kpis import KPIS

    monkeypatch.chdir(tmp_path)
    before, names = dict(KPIS), {"__name__": page.removesuffix(".md")}
    found = [(line, text) for path, line, text in blocks(PYTHON) if path.name == page]
    try:
        for line, text in found:
            exec(compile(text, f"{page}:{line}", "exec"), names)
    finally:
        KPIS.clear()
        KPIS.update(before)
    assert found
