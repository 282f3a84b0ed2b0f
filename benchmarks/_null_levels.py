"""Null levels: what development cases without any missing effect show, as the table that the diagnosis ships with."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from _table import ROOT, markdown, publish
from _trial_answers import read_trials

#: The file that the installed diagnosis reads.
SHIPPED = ROOT / "calibration" / "diagnosis" / "null_levels.json"

_QUANTILES = (0.5, 0.9, 0.95, 1.0)


def make_levels(out: Path) -> str:
    """Write the levels of the answered development nulls to the package and to the page of the diagnosis.

    Parameters
    ----------
    out : Path
        Folder of the trials.

    Returns
    -------
    str
        The table.
    """
    nulls = [t for t in read_trials(out) if t.kind == "null"]
    if not nulls:
        raise SystemExit(f"{out}: expected answered trials without effects, found none")
    if any(t.confirmation for t in nulls):
        raise SystemExit(f"{out}: expected development seeds only; nothing may be tuned on the confirmation seeds")
    first = [t.answer["rounds"][0] for t in nulls]
    largest = sorted(max(r["worth"].values()) for r in first)
    effects = sorted({e for r in first for e in r["gains"]})
    rows = {e: [r["worth"][e] for r in first if e in r["gains"]] for e in effects}
    rows["heat of any shape"] = [r["generic"] for r in first]
    levels = {name: np.quantile(values, _QUANTILES).round(2).tolist() for name, values in rows.items()}
    content = {
        "method": sorted({str(t.answer.get("code")) for t in nulls}),
        "trials": [t.name for t in nulls],
        "largest": [round(v, 3) for v in largest],
        "quantiles": list(_QUANTILES),
        "gains": levels,
        "tuning_rms": np.quantile([r["tuning_rms"] for r in first], _QUANTILES).round(4).tolist(),
    }
    SHIPPED.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    table = _table(levels, len(nulls), content)
    publish("null_levels", table)
    return table


def _table(levels: dict[str, list[float]], count: int, content: dict[str, Any]) -> str:
    head = (
        f"{count} development trials without any missing effect, method {', '.join(content['method'])}. "
        f"Largest gain of a case: median {np.median(content['largest']):.1f}, most {max(content['largest']):.1f}. "
        f"Root mean square of its tuning errors: median {content['tuning_rms'][0]:.2f} K, "
        f"most {content['tuning_rms'][-1]:.2f} K.\n\n"
    )
    columns = ("gain of", "median", "90 %", "95 %", "most")
    return head + markdown(columns, [[name, *values] for name, values in levels.items()])
