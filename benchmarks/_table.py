"""Tables of the benchmarks: JSON and Markdown beside each other, and the marked sections of README and docs."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]


def markdown(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Lay out a Markdown table; floats are given to three significant digits."""

    def cell(value: Any) -> str:
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    return "\n".join([*lines, *("| " + " | ".join(cell(v) for v in row) + " |" for row in rows)]) + "\n"


def keep(path: Path, data: Any) -> None:
    """Write the JSON of a finished run, whole or not at all: a run that is interrupted goes on without it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    os.replace(part, path)


def write(out: Path, name: str, table: str, data: Any, published: bool) -> None:
    """Write ``name.json`` and ``name.md`` to ``out`` and, if asked, the table between its marks in README or docs."""
    out.mkdir(parents=True, exist_ok=True)
    (out / f"{name}.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (out / f"{name}.md").write_text(table, encoding="utf-8")
    if published:
        publish(name, table)


def publish(name: str, table: str) -> None:
    """Replace the section of a name, on the page of README and documentation that has its marks."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    marked = [page for page in pages if f"<!-- begin {name} -->" in page.read_text(encoding="utf-8")]
    if len(marked) != 1:
        found = ", ".join(str(page.relative_to(ROOT)) for page in marked) or "none"
        raise SystemExit(
            f"{name}: expected the marks <!-- begin {name} --> on one page of README and docs, found {found}"
        )
    replace_section(marked[0], name, table)


def replace_section(page: Path, name: str, table: str) -> None:
    """Replace what stands between ``<!-- begin NAME -->`` and ``<!-- end NAME -->``."""
    text = page.read_text(encoding="utf-8")
    begin, end = f"<!-- begin {name} -->\n", f"<!-- end {name} -->"
    if begin not in text or end not in text:
        raise SystemExit(f"{page}: expected the marks {begin.strip()} and {end}")
    head, rest = text.split(begin, 1)
    page.write_text(head + begin + table.rstrip() + "\n" + end + rest.split(end, 1)[1], encoding="utf-8")
