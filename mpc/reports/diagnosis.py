"""What a diagnosis leaves behind: its numbers, the final model, and a page for those who run the building."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Any

import pandas as pd

from calibration.diagnosis.decide.levels import LARGEST_GROUP
from calibration.diagnosis.decide.verdict import Suspect
from calibration.diagnosis.diagnosis import Diagnosis
from calibration.diagnosis.refit.final import (
    Replay,
    both_predictions,
    describe_fit,
    final_calibration,
    missing_table,
    replays,
)
from calibration.results import check_results_folder, write_results
from mpc.reports import figures
from mpc.reports.diagnosis_statistics import statistics_content
from mpc.reports.diagnosis_where import where_content
from mpc.reports.diagnosis_words import (
    accepted,
    ahead,
    alike,
    called,
    diagnosis_verdict,
    in_zones,
    listed,
    rivals,
    sure,
    suspect,
)
from mpc.reports.evaluation import CELSIUS, subtitle
from mpc.reports.page import clock, counted, duration, kelvin, render, signed, significant, unit
from thermal.case.case import Case
from thermal.effects.catalogue import CATALOGUE

#: Effects shown at the top: those at least so probable [-], and how many at least and at most.
_LIKELY, _FEWEST, _MOST = 0.05, 3, 6

#: Parameters of an effect that are spelled out.
_MOST_VALUES = 4


def write_diagnosis(result: Diagnosis, case: Case, out: str | Path, force: bool = False) -> Path:
    """Write what a diagnosis found: numbers, series, the final model and a page.

    Files are ``diagnosis.json``, ``calibration.json`` of the model with all accepted effects, ``missing_watts.parquet``
    by zone and hour, ``predictions.parquet`` of the held-out runs without and with effects, and ``report.html``.

    Parameters
    ----------
    result : Diagnosis
        From `diagnose`.
    case : Case
        The case it was made on.
    out : str or Path
        Folder, made if need be.
    force : bool
        Replace earlier results.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ResultsExistError
        When the folder holds something and ``force`` is not set.
    """
    check_results_folder(out, force)
    before, after = replays(result)
    files: dict[str, Any] = {
        "diagnosis.json": result.to_dict(),
        "calibration.json": final_calibration(result),
        "missing_watts.parquet": missing_table(result, after),
        "predictions.parquet": both_predictions(before, after),
        "report.html": render("diagnosis", _content(result, case, before, after)),
    }
    return write_results(out, files, force) / "report.html"


def _content(result: Diagnosis, case: Case, before: Replay, after: Replay | None) -> dict[str, Any]:
    suspects = _shown(result)
    return {
        "case": result.case,
        "subtitle": subtitle(case, before.evaluation),
        "verdict": diagnosis_verdict(result),
        "fine": result.verdict.name != "unexplained",
        "found": _found(result),
        "ahead": ahead(result),
        "cards": _cards(result),
        "suspects": [_suspect_entry(result, s) for s in suspects],
        "next": _measure_next(result),
        "untestable": [
            (called(s.effect).capitalize(), s.reason.replace("_sensor", "").replace("_", " "))
            for s in result.verdict.suspects
            if not s.testable
        ],
        **where_content(result, case, before, after, _found(result)),
        "waterfall": _waterfall(result),
        "tests": _placebo_sentences(result),
        "panels": _panels(before, after, _found(result)),
        "statistics": statistics_content(result),
        "reproduce": _reproduce(result, case),
    }


def _found(result: Diagnosis) -> str:
    """Call the final model beside the baseline; nothing where it has no effect."""
    count = len(accepted(result))
    return f"with the effect{'s' if count > 1 else ''} found" if count else ""


def _cards(result: Diagnosis) -> list[tuple[str, str]]:
    cards = [(f"{kelvin(result.gap)} K", f"error of the calibrated model, {ahead(result)}")]
    if result.steps:
        last = result.steps[-1]
        share = "–" if last.share_closed is None else f"{min(100.0, 100 * last.share_closed):.0f} %"
        told = "of what could be closed" if last.share_closed is not None else "share closed: gap too small to say"
        cards += [(f"{kelvin(last.after)} K", _found(result)), (share, told)]
    cards.append((f"{kelvin(result.floor)} K", "floor: no regular missing heat would take it lower"))
    found = accepted(result)
    best = suspect(result, found[0].screened.effect) if found else result.verdict.suspects[0]
    told = "probability of" if found else "is the highest probability of any effect:"
    return [*cards, (sure(best.probability), f"{told} {called(best.effect)}")]


def _shown(result: Diagnosis) -> list[Suspect]:
    inside = {r.screened.effect for r in accepted(result)}
    testable = [s for s in result.verdict.suspects if s.testable]
    likely = [s for s in testable if s.probability >= _LIKELY or s.effect in inside][:_MOST]
    return likely if len(likely) >= _FEWEST else testable[:_FEWEST]


def _suspect_entry(result: Diagnosis, s: Suspect) -> dict[str, Any]:
    fitted = next((r for r in accepted(result) if r.screened.effect == s.effect), None)
    shown = fitted is not None or result.verdict.name == "unexplained"
    group = rivals(result, s.effect) if fitted is not None else alike(result, s.effect)
    others = [called(e) for e in group[:LARGEST_GROUP] if e != s.effect] if shown else []
    return {
        "name": called(s.effect).capitalize(),
        "probability": sure(s.probability),
        "width": f"{100 * s.probability:.1f}",
        "accepted": fitted is not None,
        "where": in_zones(s.zones if fitted is None else fitted.screened.zones),
        "acts_on": CATALOGUE[s.effect].acts_on,
        "values": [] if fitted is None else _values(result, s.effect),
        "alike": listed(others, "or") if others else "",
        "separate_by": s.separate_by,
    }


def _values(result: Diagnosis, effect: str) -> list[str]:
    """Spell the parameters of an effect as the final model has them."""
    own = {p.name for p in CATALOGUE[effect].parameters}
    found = [p for p in describe_fit(result.final) if p.name.partition("@")[0] in own]
    spelled = []
    for p in found[:_MOST_VALUES]:
        base, _, member = p.name.partition("@")
        shift, of = (CELSIUS, "°C") if p.unit == "K" and "temperature" in base else (0.0, unit(p.unit))
        place = f" ({member.replace('facade:', 'facade at ').replace(' deg', '°')})" if member else ""
        told = significant(p.value - shift) + ("" if of == "–" else f" {of.replace('*', '·')}")
        if p.interval90 is not None:
            ends = sorted((*p.interval90, p.value))  # at the end of a range the estimate may lie outside
            low, high = (significant(end - shift) for end in (ends[0], ends[-1]))
            told += f" (90 %: up to {high})" if p.value == 0.0 else f" (90 %: {low} to {high})"
        if p.at_bound and p.value != 0.0:
            told += ", at the end of its range"
        spelled.append(f"{base.replace('_', ' ').replace('u value', 'U-value')}{place}: {told}")
    more = len(found) - _MOST_VALUES
    return [*spelled, f"and {more} more"] if more > 0 else spelled


def _measure_next(result: Diagnosis) -> list[tuple[str, str]]:
    """List what would tell effects of the verdict apart, or confirm the one that was named."""
    if result.verdict.name == "no_gap":
        return []
    names = [r.screened.effect for r in accepted(result)]
    for name in list(names) or [result.verdict.suspects[0].effect]:
        names += [e for e in (name, *rivals(result, name)[:LARGEST_GROUP]) if e not in names]
    return [(called(e).capitalize(), CATALOGUE[e].separated_by) for e in names if CATALOGUE[e].separated_by]


def _waterfall(result: Diagnosis) -> list[dict[str, Any]]:
    """Rows of held-out errors, from the baseline by each effect to the floor; bars in % of the largest."""
    values = [result.gap, *(s.after for s in result.steps)]
    top = max([*values, result.floor, 1e-9])
    rows = [_bar("The calibrated model", result.gap, result.gap, top, "")]
    for i, step in enumerate(result.steps):
        change = step.after - values[i]
        rows.append(_bar(f"+ {called(step.effects[-1])}", step.after, values[i], top, f"{signed(change)} K"))
    rows.append(_bar("Floor: with regular heat of any kind added", result.floor, result.floor, top, "floor"))
    return rows


def _bar(name: str, value: float, previous: float, top: float, change: str) -> dict[str, Any]:
    low, high = min(value, previous), max(value, previous)
    return {
        "name": name,
        "value": f"{kelvin(value)} K",
        "change": "" if change == "floor" else change,
        "floor": change == "floor",
        "solid": f"{100 * low / top:.1f}",
        "delta": f"{100 * (high - low) / top:.1f}",
        "worse": value > previous,
    }


def _placebo_sentences(result: Diagnosis) -> list[str]:
    sentences = []
    for i, (step, r) in enumerate(zip(result.steps, result.rounds, strict=False)):
        name = called(step.effects[-1])
        real = step.shuffled is None or step.shuffled > step.after
        if step.shuffled is not None and (i == 0 or not real):
            verdict = "their course over these very days is what explains" if real else "be careful with this effect"
            sentences.append(
                f"With the signals behind {name} put on other days the error is {kelvin(step.shuffled)} K instead of "
                f"{kelvin(step.after)} K: {verdict}."
            )
        others = [x for x in r.refits if x is not r.accepted]
        if step.runner_up is not None and others and (i == 0 or step.runner_up < step.after):
            other = called(others[0].screened.effect)
            sentences.append(f"In place of {name}, the next best, {other}, reaches {kelvin(step.runner_up)} K.")
    return sentences


def _panels(before: Replay, after: Replay | None, found: str) -> list[figures.Picture]:
    both = [r.evaluation for r in (before, after) if r is not None]
    series = [figures.series_of_runs(e) for e in both]
    errors = [{z: e["mae"] for z, e in one.by_zone().items()} for one in both]
    models = dict(zip(("calibrated model", found), series, strict=False))
    return figures.change_panels(models, both[0].zones, errors)


def _reproduce(result: Diagnosis, case: Case) -> list[tuple[str, str]]:
    parts = ["buildingmpc diagnose CASE --out RESULTS"]
    parts += [f"--tune {i.start.isoformat()}/{i.end.isoformat()}" for i in result.tuned]
    parts += [f"--hold-out {i.start.isoformat()}/{i.end.isoformat()}" for i in result.judged]
    parts += [f"--horizon {result.horizon}"]
    parts += [f"--dx {result.settings.dx:g}"] if result.settings.dx is not None else []
    span = f"{clock(case.stamps[0])} to {clock(case.stamps[-1])} every {duration(case.step)}"
    return [
        ("case", f"{result.case}, {span}"),
        ("version", f"buildingmpc {result.version}, Python {platform.python_version()}, pandas {pd.__version__}"),
        ("time", f"{result.seconds:.0f} s for {counted(len(result.rounds), 'round')}"),
        ("command", " ".join(parts)),
    ]
