"""Scores of blind trials by world: what holds in buildings that the diagnosis was not tuned on, and each failure."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from _leave_one_out import Fold, leave_one_out
from _table import markdown, publish, write
from _trial_answers import SEALED, read_trials
from _trial_scores import Rate, Trial, gap_of, score
from spoilt_buildings import read as read_spoilt

NAME = "blind_trials_worlds"

#: Rates of a table by world, by what they are called there.
_COLUMNS = {
    "nulls named": "nulls named",
    "nulls unexplained": "nulls unexplained",
    "singles right first": "right first",
    "right group": "right group",
    "abstained": "abstained",
    "wrong names of all": "wrong name, of all trials",
    "a wrong one beside a right name": "a wrong one beside a right name",
    "90 % sets cover": "90 % set covers",
    "outside unexplained": "outside called unexplained",
}


def failure(t: Trial) -> str:
    """Say what is wrong with an answer; empty where nothing is.

    Parameters
    ----------
    t : Trial
        With its answer.
    """
    verdict = t.answer["verdict"]
    if t.kind == "null":
        return {"no_gap": "", "unexplained": "unexplained"}.get(verdict, "named")
    if not t.counted or (verdict == "unexplained" and t.unexplained_is_right):
        return ""
    if t.wrong_name:
        return "wrong name"
    if not t.named:
        return "abstained, right first" if t.right_first else "abstained"
    if not t.right_first:
        return "in the group, not first"
    return "a wrong one beside it" if t.further_wrong else ""


def failures(trials: Sequence[Trial]) -> list[list[str]]:
    """Lay out one row a trial whose answer is wrong.

    Parameters
    ----------
    trials : sequence of Trial
        With their answers.
    """
    rows = []
    for t in sorted(trials, key=lambda t: (t.world, t.kind, t.building, t.name)):
        said = failure(t)
        if not said:
            continue
        first = t.answer["which"][0]
        where = f" in {len(first['zones'])} zones" if first["zones"] else ""
        twin = f" (twin {t.twins[0]:.3f})" if t.twins else ""
        rows.append([
            t.world, t.building or "-", t.name, ", ".join(t.labels) or "nothing", f"{gap_of(t.answer):.3f}{twin}",
            t.answer["verdict"], f"{first['effect']} ({first['probability']:.0%}){where}", said,
        ])  # fmt: skip
    return rows


def by_world(trials: Sequence[Trial]) -> dict[str, dict[str, Any]]:
    """Score the trials of each world, and all.

    Parameters
    ----------
    trials : sequence of Trial
        With their answers.
    """
    worlds = sorted({t.world for t in trials})
    found = {w: score([t for t in trials if t.world == w]) for w in worlds}
    return found if len(worlds) < 2 else found | {"all": score(trials)}


def report_worlds(outs: Sequence[Path], published: bool) -> str:
    """Score what is answered in several folders, by world.

    Parameters
    ----------
    outs : sequence of Path
        Folders of trials; the tables go to the first.
    published : bool
        Also replace the table between its marks.
    """
    trials = [t for out in outs for t in _read(out)]
    if not trials:
        raise SystemExit(f"{', '.join(map(str, outs))}: expected answered trials, found none; run `diagnose` first")
    scored = by_world(trials)
    versions = sorted({str(t.answer.get("code")) for t in trials})
    seeds = "confirmation" if all(t.confirmation for t in trials) else "development"
    hidden = sum(not t.counted for t in trials)
    head = (f"{len(trials)} trials of {seeds} seeds, method {', '.join(versions)}; {hidden} whose effects leave no gap "
            "over 0.05 K are not counted.")  # fmt: skip
    table = markdown(("world", *_COLUMNS), [[name, *_cells(rates["rates"])] for name, rates in scored.items()])
    columns = ("world", "building", "trial", "holds", "gap [K]", "verdict", "first", "what is wrong")
    folds = leave_one_out(trials)
    page = f"{head}\n\n{table}\n{_folds(folds)}Each failure:\n\n{markdown(columns, failures(trials))}"
    plain = {w: {**s, "rates": {name: r.to_dict() for name, r in s["rates"].items()}} for w, s in scored.items()}
    plain |= {f"without {f.world}": {"levels": f.moved, "rates": {n: r.to_dict() for n, r in f.chosen["rates"].items()}}
              for f in folds}  # fmt: skip
    write(outs[0], NAME, page, plain, published=False)
    if published:
        publish(NAME, page)
    return page


def _read(out: Path) -> list[Trial]:
    """Open the seals of a folder of either kind: of made buildings, or of measured ones whose telemetry was spoilt."""
    first = next(iter(sorted((out / SEALED).glob("*.json"))), None)
    if first is not None and "source" in json.loads(first.read_text(encoding="utf-8")):
        return [trial for _, trial in read_spoilt(out).values()]
    return read_trials(out)


def _folds(folds: Sequence[Fold]) -> str:
    """Lay out what levels chosen on the other worlds make of each."""
    if not folds:
        return ""
    rows = [
        [f.world, ", ".join(f"{k} {v:g}" for k, v in f.moved.items()) or "as shipped", *_cells(f.chosen["rates"])]
        for f in folds
    ]
    return f"By levels that the other worlds choose:\n\n{markdown(('world', 'levels', *_COLUMNS), rows)}\n"


def _cells(rates: Mapping[str, Rate]) -> list[str]:
    chosen = [rates[name] for name in _COLUMNS.values()]
    return [
        f"{r.share:.0%} ({r.hits} of {r.of}; {r.interval[0]:.0%} to {r.interval[1]:.0%})" if r.of else "-"
        for r in chosen
    ]
