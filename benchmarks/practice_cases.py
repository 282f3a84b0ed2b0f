"""Verdicts of the diagnosis on labelled practice cases and on measured buildings, beside what they hold.

Each case is diagnosed in a process of its own, which gets the case folder and nothing else; an interrupted run goes on
where it was. Cases without a label are measured buildings, whose truth nobody here knows.

Run from the repository's root::

    pip install -e .
    python benchmarks/practice_cases.py --cases ../shared/cases --out results/practice [--publish]

``--publish`` replaces the table in ``docs/diagnosis_trials.md``.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from _table import markdown, publish, write
from _trial_answers import answer_cases

NAME = "practice_cases"

#: What labels and answers are called in the table.
_COLUMNS = ("case", "holds", "verdict", "first", "cannot be told from", "accepted, in order", "MAE [K]", "closed", "s")


def rows(answers: Mapping[str, Mapping[str, Any]], labels: Mapping[str, list[str]]) -> list[list[str]]:
    """Lay out one row a case.

    Parameters
    ----------
    answers : mapping of str to mapping
        Contents of ``diagnosis.json`` by case.
    labels : mapping of str to list of str
        Effects that a case holds; measured buildings have none.
    """
    found = []
    for name, a in sorted(answers.items()):
        first = a["which"][0]
        steps = a["how_far"]
        last = steps[-1] if steps else None
        truth = labels.get(name)
        errors = [a["gap"]["mae"]] + ([last["held_out_mae_after"]] if last else [])
        found.append([
            name,
            "measured" if truth is None else ", ".join(truth) or "nothing",
            a["verdict"],
            f"{first['effect']} ({first['probability']:.0%})" if first["probability"] >= 0.005 else "-",
            ", ".join(first["group"][1:]) or "-",
            ", ".join(last["effects"]) if last else "-",
            " → ".join(f"{e:.3f}" for e in errors) + f" (floor {a['gap']['floor']:.3f})",
            f"{last['share_closed']:.0%}" if last and last["share_closed"] is not None else "-",
            f"{a['seconds']:.0f}",
        ])  # fmt: skip
    return found


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=Path, required=True, help="folder of case folders, with labels.json")
    parser.add_argument("--out", type=Path, required=True, help="folder of the answers and the table")
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1), help="processes at a time")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    file = options.cases / "labels.json"
    if not file.is_file():
        raise SystemExit(f"{file}: expected the labels of the cases beside them, found none")
    labels = {entry["case"]: list(entry["effects"]) for entry in json.loads(file.read_text(encoding="utf-8"))}
    folder = options.out / "answers"
    folder.mkdir(parents=True, exist_ok=True)
    cases = sorted(p for p in options.cases.iterdir() if (p / "building.yaml").is_file())
    failed = answer_cases(cases, folder, options.workers)
    answers = {p.name: folder / f"{p.name}.json" for p in cases}
    known = {n: json.loads(f.read_text(encoding="utf-8")) for n, f in answers.items() if f.exists()}
    versions = ", ".join(sorted({str(a.get("code")) for a in known.values()}))
    table = f"Method {versions}.\n\n{markdown(_COLUMNS, rows(known, labels))}"
    write(options.out, NAME, table, known, published=False)
    if options.publish:
        publish(NAME, table)
    print(table)
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
