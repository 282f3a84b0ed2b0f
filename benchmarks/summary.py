"""The table of the README: one line each for diagnosis, prediction, control and speed, read from the published tables.

Run: ``python benchmarks/summary.py`` after a benchmark has published; ``tests/meta`` holds the README against it.
"""

from __future__ import annotations

import re
from itertools import dropwhile, takewhile
from pathlib import Path

from _table import ROOT, markdown, replace_section

#: Address of the pages that the README links, whole, since the README is also the description of the package.
DOCS = "https://github.com/buildingmpc/buildingmpc/blob/main/docs"


def section(name: str) -> list[str]:
    """Lines of a published section of ``docs/``."""
    for page in sorted((ROOT / "docs").glob("*.md")):
        found = re.search(rf"<!-- begin {name} -->\n(.*?)<!-- end {name} -->", page.read_text(encoding="utf-8"), re.S)
        if found:
            return found[1].splitlines()
    raise SystemExit(f"{name}: expected the marks <!-- begin {name} --> on a page of docs, found none")


def rows(name: str) -> dict[str, dict[str, str]]:
    """Cells of the first table of a section, by the first cell of the row and by the column."""
    lines = dropwhile(lambda line: line[:1] != "|", section(name))
    lines = takewhile(lambda line: line[:1] == "|", lines)
    table = [[cell.strip(" *") for cell in line.strip("|").split("|")] for line in lines]
    head, _, *body = table
    return {row[0]: dict(zip(head, row, strict=True)) for row in body}


def _short(rate: str) -> str:
    """Leave the interval of a rate out."""
    return f"{rate.partition(';')[0]})"


def summary() -> str:
    """Lay out the table of the README."""
    trials, worlds, models = rows("blind_trials_fresh"), rows("blind_trials_worlds")["all"], rows("calibration")
    weeks, day, solvers = rows("mpc_closed_loop_short"), rows("closed_loop_speed"), rows("mpc_peers_short")
    first, wrong = trials["right first"], trials["wrong name, of all trials"]
    error = {name: row["held out [K]"] for name, row in models.items()}
    shares = sorted(float(row["share of the perfect-forecast savings"].rstrip("%")) for row in weeks.values())
    milliseconds = day["a step, mean (least) [ms]"]["reduced, from 0.5 m"].split()[0]
    solver = solvers["ours: fatrop in stages"]
    lines = [
        ("diagnosis", f"right effect first in {first['share']} ({first['number']}) of blind trials of offices with a "
                      f"gap over 0.05 K, in {_short(worlds['singles right first'])} over five worlds of buildings, "
                      f"measured ones among them; wrong names in {wrong['share']} and "
                      f"{_short(worlds['wrong names of all'])} of all",
         "results", "how-often-the-diagnosis-is-right"),
        ("prediction", f"{error['ours']} K six hours ahead on held-out days; uncalibrated {error['uncalibrated']}, the "
                       f"paper's calibration {error['paper, its structure']} (medians)", "validation", ""),
        ("control", f"{shares[0]:.0f} to {shares[-1]:.0f}% of the savings that a perfect forecast would allow, in "
                    "weeks of three seasons of an office of 123 zones", "mpc", "against-rules"),
        ("speed", f"{float(milliseconds) * 1e3:.0f} µs a step of 123 zones with their HVAC; optimal control "
                  f"{solver['times as fast']} times as fast as do-mpc's defaults", "closed_loop", ""),
    ]  # fmt: skip
    cells = [(f"[{name}]({DOCS}/{page}.md{'#' + at if at else ''})", text) for name, text, page, at in lines]
    return markdown(("", "result"), cells)


def main() -> None:
    """Write the table between its marks in the README."""
    replace_section(Path(ROOT / "README.md"), "summary", summary())


if __name__ == "__main__":
    main()
