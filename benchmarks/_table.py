"""Writes one table as JSON and Markdown, and into a page between ``<!-- name -->`` and ``<!-- end name -->``."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Lay out a Markdown table.

    Parameters
    ----------
    header : sequence of str, shape (n_column,)
        Column titles, units in brackets.
    rows : iterable of sequences of str, each of shape (n_column,)
        Cells.

    Returns
    -------
    str
        The table, ending in a line break.
    """
    lines = [list(header), ["---"] * len(header), *(list(row) for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def write_table(out: Path, name: str, data: dict[str, Any], text: str, page: Path | None = None) -> None:
    """Write ``name.json`` and ``name.md`` to a folder and, when given, the text into a page.

    Parameters
    ----------
    out : Path
        Folder, made if there is none.
    name : str
        Of the two files and of the page's markers.
    data : dict
        Everything that was measured.
    text : str
        The same as Markdown.
    page : Path, optional
        Page that holds ``<!-- name -->`` and ``<!-- end name -->``; what stands between them is replaced.
    """
    out.mkdir(parents=True, exist_ok=True)
    (out / f"{name}.json").write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    (out / f"{name}.md").write_text(text, encoding="utf-8")
    if page is None:
        return
    start, end = f"<!-- {name} -->\n", f"<!-- end {name} -->"
    old = page.read_text(encoding="utf-8")
    if start not in old or end not in old.split(start, 1)[1]:
        raise SystemExit(f"{page}: expected the lines '{start.strip()}' and '{end}' around the table, found none")
    before, rest = old.split(start, 1)
    page.write_text(before + start + text + end + rest.split(end, 1)[1], encoding="utf-8")
