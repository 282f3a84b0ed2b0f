"""Tables of the calibration benchmark: held-out errors by case, medians by method, and every number of every case."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from _table import ROOT, markdown

#: Errors of the library's first version, and the commit whose README gives them.
FIRST = Path(__file__).parent / "first_accuracy.json"

INTERVALS = ("a", "b", "c", "held out")
DETAILS = ("(a) [K]", "(b) [K]", "(c) [K]", "held out [K]", "evaluations", "CPU [s]", "on a bound")


def first_version(commit: str | None = None) -> dict[str, Any]:
    """Read the errors of the first version; with a commit, write them from its README before."""
    if commit is not None:
        git = ("git", "-C", str(ROOT))
        full = subprocess.run([*git, "rev-parse", commit], check=True, capture_output=True, text=True).stdout.strip()
        page = subprocess.run([*git, "show", f"{full}:README.md"], check=True, capture_output=True, text=True).stdout
        FIRST.write_text(json.dumps({"commit": full, "cases": accuracy_table(page)}, indent=1) + "\n", encoding="utf-8")
    return dict(json.loads(FIRST.read_text(encoding="utf-8")))


def accuracy_table(page: str) -> dict[str, dict[str, float]]:
    """Read held-out errors [K] before and after calibration, by case, from `baseline_accuracy.py`'s table in a page."""
    text = page.split("<!-- begin baseline_accuracy -->\n", 1)[1].split("<!-- end baseline_accuracy -->", 1)[0]
    columns, _, *rows = ([cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line)
    named = [dict(zip(columns, row, strict=True)) for row in rows]
    kinds = ("uncalibrated", "calibrated")
    return {row["case"]: {kind: float(row[f"{kind} [K]"]) for kind in kinds} for row in named}


def report(lines: Sequence[dict[str, Any]], failed: dict[str, str], first: dict[str, Any]) -> tuple[str, str, str]:
    """Make the table of medians, that of cases, and the whole page of the cases measured."""
    if not lines:
        raise SystemExit(f"calibration: expected at least one case that was measured, found {failed or 'none'}")
    methods = [row["method"] for row in lines[0]["rows"]]
    columns = ["case", *methods[:-1], "first version", methods[-1]]
    by_case = f"Held-out MAE [K] by case:\n\n{markdown(columns, list(_held_out(lines, methods, first)))}"
    short = "\n".join(
        [
            f"Medians over {len(lines)} cases:\n",
            markdown(["method", *DETAILS], list(_medians(lines, methods))),
            f"{remarks(lines, failed, first)}\n",
        ]
    )
    rows = [[line["case"], row["method"], *_details([row])] for line in lines for row in line["rows"]]
    page = f"{by_case}\n{short}\nBy case and method:\n\n{markdown(['case', 'method', *DETAILS], rows)}"
    return short, by_case, page


def _held_out(lines: Sequence[dict[str, Any]], methods: Sequence[str], first: dict[str, Any]) -> Iterator[list[str]]:
    table = []
    for line in lines:
        errors = [row["errors"]["held out"]["mae"] for row in line["rows"]]
        before = first["cases"].get(line["case"], {}).get("calibrated", np.nan)
        table.append([*errors[:-1], before, errors[-1]])
        yield [line["case"], *map(_kelvin, table[-1])]
    known = np.array(table)[np.isfinite(table).all(axis=1)]
    if len(known):
        yield [f"median of {len(known)}", *map(_kelvin, np.median(known, axis=0))]


def _medians(lines: Sequence[dict[str, Any]], methods: Sequence[str]) -> Iterator[list[str]]:
    for number, method in enumerate(methods):
        yield [method, *_details([line["rows"][number] for line in lines])]


def _details(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Cells of one method, medians over rows of several cases."""
    cells = []
    for key in INTERVALS:
        text = _kelvin(float(np.median([row["errors"][key]["mae"] for row in rows])))
        cells.append(f"({text})" if all(key in row["tuned_on"] for row in rows) else text)
    evaluations, seconds, bounds = (
        float(np.median(values))
        for values in (
            [row["evaluations"] for row in rows],
            [row["cpu_seconds"] for row in rows],
            [len(row["on_bound"]) for row in rows],
        )
    )
    of = max(row["of"] for row in rows)
    return [*cells, f"{evaluations:.0f}", f"{seconds:.0f}", f"{bounds:g} of {of}" if of else "-"]


def _kelvin(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "-"


def remarks(lines: Sequence[dict[str, Any]], failed: dict[str, str], first: dict[str, Any]) -> str:
    """Say what else belongs to the numbers."""
    study = lines[0]["study"]
    (morning, noon), day = study["hours"], study["day"] or "the first weekday with three days of spin-up"
    sentences = [
        f"MAE six hours ahead. (a) {day} from {morning}; (b) the same hours of the next day; (c) that day from {noon}; "
        "held out: the last third of the telemetry, a run every hour. In brackets what a method was tuned on.",
        f"Paper: best of {study['evaluations']} settings in eight ranges by its metric on (a), seed {study['seed']}.",
        "Its structure: air and walls alone. Bayesian: settings placed by a Gaussian process, not a Sobol sequence.",
        "Ours: all of the model's parameters, evaluations mostly of reduced models with derivatives, CPU of the call.",
        f"First version: README of {first['commit'][:7]}.",
    ]
    unsolved = [
        f"{line['case']} ({row['method']})"
        for line in lines
        for row in line["rows"]
        if not row.get("solver", {}).get("success", True)
    ]
    if unsolved:
        sentences.append(f"**Did not converge,** counted like the others: {', '.join(unsolved)}.")
    if len({line["code"] for line in lines}) > 1:
        sentences.append(
            "**The cases were measured with different versions of the code; measure again before quoting.**"
        )
    if failed:
        sentences.append(f"**{len(failed)} cases failed:** {'; '.join(f'{c}: {why}' for c, why in failed.items())}")
    return " ".join(sentences)
