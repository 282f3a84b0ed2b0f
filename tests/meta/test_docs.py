"""The documentation names every parameter, unit and point, and everything that it points to exists."""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from thermal.case.points import POINT_TYPES
from thermal.effects.catalogue import CATALOGUE
from thermal.parameters import PARAMETERS
from thermal.units import QUANTITIES

Check = Callable[[list[str]], None]

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
NOMENCLATURE = DOCS / "nomenclature.md"
CODE_PATH = re.compile(r"`((?:thermal|calibration|mpc|benchmarks|examples|tests)/[\w/.]+)`")
LINK = re.compile(r"\]\((?!https?:|#)([^)#\s]+)")
HOME = re.compile(r"https://(?:github|raw\.githubusercontent)\.com/buildingmpc/buildingmpc/(?:blob/)?main/([^)#\s]+)")


def cells(name: str) -> list[str]:
    """Cells of the nomenclature's row of a name, backticks removed."""
    rows = [line for line in NOMENCLATURE.read_text(encoding="utf-8").splitlines() if line.startswith(f"| `{name}` |")]
    return [cell.strip(" `") for cell in rows[0].strip("|").split(" | ")] if rows else []


def test_nomenclature_has_every_parameter_and_point_with_its_unit(expect_none: Check) -> None:
    units = {name: p.unit for name, p in PARAMETERS.items()}
    units |= {p.name: p.unit for effect in CATALOGUE.values() for p in effect.parameters}
    units |= {name: QUANTITIES[point.quantity].file_unit for name, point in POINT_TYPES.items()}
    wrong = [name for name, unit in units.items() if unit not in cells(name)]
    expect_none([f"docs/nomenclature.md:1: has no row '| `{n}` | ...' with a cell '{units[n]}'; add it" for n in wrong])


def test_what_the_documentation_points_to_exists(expect_none: Check) -> None:
    problems = []
    for page in [*DOCS.glob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]:
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
            relative = [t for t in LINK.findall(line) if not t.startswith("api/")]  # made while the site is built
            whole = (*CODE_PATH.findall(line), *HOME.findall(line))
            targets = [*(page.parent / t for t in relative), *(ROOT / t for t in whole)]
            at = f"{page.relative_to(ROOT)}:{number}"
            lost = [t.relative_to(ROOT) for t in targets if not t.exists()]
            problems += [f"{at}: points to {t}, which is not there" for t in lost]
    expect_none(problems)


def test_search_of_the_site_asks_no_other_site(expect_none: Check) -> None:
    # The theme's plugin for pages read from a folder loads a stand-in for workers from elsewhere, unless one is named here.
    config = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    stands_in = re.findall(r"^  polyfills: \[(.*iframe-worker.*)\]", config, re.MULTILINE)
    missing = not stands_in or not (DOCS / stands_in[0]).is_file()
    expect_none(["mkdocs.yml:1: expected extra.polyfills with a file of docs/, iframe-worker.js"] * missing)


def test_the_index_links_every_page(expect_none: Check) -> None:
    linked = set(LINK.findall((DOCS / "index.md").read_text(encoding="utf-8")))
    missing = [page.name for page in sorted(DOCS.glob("*.md")) if page.name not in linked | {"index.md"}]
    expect_none([f"docs/index.md:1: does not link {name}; add a row" for name in missing])


def test_the_readme_has_the_published_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    summary = importlib.import_module("summary").summary()
    assert summary.strip() in (ROOT / "README.md").read_text(encoding="utf-8"), "run benchmarks/summary.py"
