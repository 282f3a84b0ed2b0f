"""The guides to one's own controller, indicator and effect: the file and the command that stand there work."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from mpc.cli.app import app
from thermal.data import bundled_case_path

DOCS = Path(__file__).parents[2] / "docs"

pytestmark = pytest.mark.usefixtures("blank_pictures")


def follow(guide: str, folder: Path) -> Path:
    """Write the file of a guide and run its command on the bundled case; the folder of its results."""
    text = (DOCS / guide).read_text(encoding="utf-8")
    name = re.search(r'title="(\w+\.py)"', text)
    code, command = (re.search(rf"```{kind}[^\n]*\n(.*?)```", text, re.DOTALL) for kind in ("python", "sh"))
    assert name and code and command, guide
    plugin, out = folder / name[1], folder / "out"
    plugin.write_text(code[1], encoding="utf-8")
    words = shlex.split(command[1])
    assert words[0] == "buildingmpc" and words.count("CASE") == 1 and words[-2] == "--out"
    words = [{name[1]: str(plugin), "CASE": str(bundled_case_path()), words[-1]: str(out)}.get(w, w) for w in words[1:]]
    answer = CliRunner().invoke(app, words)
    assert answer.exit_code == 0, answer.output
    return out


@contextmanager
def kept(registry: dict[str, Any]) -> Iterator[None]:
    """What a plugin registers is gone afterwards."""
    before = dict(registry)
    yield
    registry.clear()
    registry.update(before)


@pytest.mark.long
def test_a_controller_of_ones_own(tmp_path: Path) -> None:
    from mpc.studies.registry import REGISTERED

    with kept(REGISTERED):
        out = follow("own_controller.md", tmp_path)
    found = json.loads((out / "comparison.json").read_text(encoding="utf-8"))["controllers"]
    assert list(found) == ["reset", "by_need"] and found["by_need"]["cost"] > 0.0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Water by need" in page and "Supply water is hotter the colder the coldest zone is." in page


def test_an_indicator_of_ones_own(tmp_path: Path) -> None:
    from mpc.kpi.kpis import KPIS

    with kept(KPIS):
        out = follow("own_kpi.md", tmp_path)
    kpis = json.loads((out / "control.json").read_text(encoding="utf-8"))["kpis"]
    assert 15.0 < kpis["warmest_zone"] < 35.0
    assert "highest temperature of any zone" in (out / "report.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_an_effect_of_ones_own(tmp_path: Path) -> None:
    from thermal.effects.catalogue import CATALOGUE

    with kept(CATALOGUE):
        out = follow("own_effect.md", tmp_path)
    found = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    assert [e["effect"] for e in found["effects"]] == ["night_machines"]
    assert 0.0 <= found["parameters"]["night_heat"]["value"] <= 20.0


def test_a_plugin_that_is_broken_is_named(tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text("import nothing_of_this_name\n", encoding="utf-8")
    missing = str(tmp_path / "not_there.py")
    answer = CliRunner().invoke(app, ["--plugin", missing, "check", str(bundled_case_path())])
    assert answer.exit_code == 2 and answer.stderr.count(missing) == 1 and "Errno" not in answer.stderr
    for name in (str(tmp_path / "broken.py"), "nothing_of_this_name"):
        answer = CliRunner().invoke(app, ["--plugin", name, "check", str(bundled_case_path())])
        assert answer.exit_code == 2 and answer.stdout == ""
        assert "MpcError: --plugin: expected a module that can be imported" in answer.stderr
        assert "nothing_of_this_name" in answer.stderr


def test_an_installed_extension_needs_no_option(monkeypatch: pytest.MonkeyPatch) -> None:
    from importlib.metadata import EntryPoint

    from mpc import plugins

    loaded = []
    monkeypatch.setattr(plugins, "import_module", loaded.append)
    point = EntryPoint("mine", "my_package.my_controller", "buildingmpc.controllers")
    monkeypatch.setattr(plugins, "entry_points", lambda group: [point] if group == point.group else [])
    plugins.load_plugins()
    assert loaded == ["my_package.my_controller"]
