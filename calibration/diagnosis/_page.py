"""What a diagnosis leaves behind: its numbers as JSON and Parquet, its final model, and a page for the building's manager."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from calibration import _figures as figures
from calibration._page import clock, counted, duration, kelvin, render, signed, significant, unit, watts
from calibration._report_evaluation import CELSIUS, subtitle
from calibration._results import check_results_folder, write_results
from calibration.diagnosis._diagnose import Diagnosis
from calibration.diagnosis._final import Replay, both_predictions, final_calibration, missing_table, replays
from calibration.diagnosis._statistics import statistics_content
from calibration.diagnosis._verdict import Suspect
from calibration.diagnosis._where import Share
from calibration.diagnosis._words import accepted, ahead, called, diagnosis_verdict, in_zones, listed, suspect, sure
from thermal import Case, FloorPlans
from thermal.effects import CATALOGUE

#: Effects shown at the top: those at least so probable [-], and how many at least and at most.
_LIKELY, _FEWEST, _MOST = 0.05, 3, 6

#: Rows of a table of zones, and of parts of the day and the building.
_MOST_ZONES, _MOST_PARTS = 24, 10

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
        "missing_watts.parquet": missing_table(before, after),
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
        "found": bool(accepted(result)),
        "ahead": ahead(result),
        "cards": _cards(result),
        "suspects": [_suspect_entry(result, s) for s in suspects],
        "next": _measure_next(result),
        "untestable": [(called(s.effect).capitalize(), s.reason) for s in result.verdict.suspects if not s.testable],
        **_where_content(result, case, before, after),
        "waterfall": _waterfall(result),
        "tests": _placebo_sentences(result),
        "panels": _panels(before, after),
        "statistics": statistics_content(result),
        "reproduce": _reproduce(result, case),
    }


def _cards(result: Diagnosis) -> list[tuple[str, str]]:
    cards = [(f"{kelvin(result.gap)} K", f"error of the calibrated model, {ahead(result)}")]
    if result.steps:
        last = result.steps[-1]
        share = "–" if last.share_closed is None else f"{min(100.0, 100 * last.share_closed):.0f} %"
        told = "of the gap closed" if last.share_closed is not None else "share closed: gap too small to say"
        cards += [(f"{kelvin(last.after)} K", "with the effects found"), (share, told)]
    cards.append((f"{kelvin(result.floor)} K", "floor: no regular missing heat would take it lower"))
    if result.steps:
        best = suspect(result, accepted(result)[0].screened.effect)
        cards.append((sure(best.probability), f"probability of {called(best.effect)}"))
    return cards


def _shown(result: Diagnosis) -> list[Suspect]:
    inside = {r.screened.effect for r in accepted(result)}
    testable = [s for s in result.verdict.suspects if s.testable]
    likely = [s for s in testable if s.probability >= _LIKELY or s.effect in inside][:_MOST]
    return likely if len(likely) >= _FEWEST else testable[:_FEWEST]


def _suspect_entry(result: Diagnosis, s: Suspect) -> dict[str, Any]:
    inside = s.effect in {r.screened.effect for r in accepted(result)}
    alike = [called(e) for e in s.group if e != s.effect] if inside or result.verdict.name == "unexplained" else []
    return {
        "name": called(s.effect).capitalize(),
        "probability": sure(s.probability),
        "width": f"{100 * s.probability:.1f}",
        "accepted": inside,
        "where": in_zones(s.zones),
        "acts_on": CATALOGUE[s.effect].acts_on,
        "values": _values(s) if inside else [],
        "alike": listed(alike, "or") if alike else "",
        "separate_by": s.separate_by,
    }


def _values(s: Suspect) -> list[str]:
    spelled = []
    for name, (value, of, (low, high)) in list(s.parameters.items())[:_MOST_VALUES]:
        shift, text = (CELSIUS, "°C") if of == "K" and "temperature" in name else (0.0, unit(of).replace("*", "·"))
        base, _, member = name.partition("@")
        place = f" ({member.replace('facade:', 'facade at ')})" if member else ""
        told = significant(value - shift) + ("" if text == "–" else f" {text}")
        if np.isfinite(low) and np.isfinite(high):
            told += f" (90 %: {significant(low - shift)} to {significant(high - shift)})"
        spelled.append(f"{base.replace('_', ' ')}{place}: {told}")
    more = len(s.parameters) - _MOST_VALUES
    return [*spelled, f"and {more} more"] if more > 0 else spelled


def _measure_next(result: Diagnosis) -> list[tuple[str, str]]:
    """What would tell effects of the verdict apart, or confirm the one that was named."""
    if result.verdict.name == "no_gap":
        return []
    names = [r.screened.effect for r in accepted(result)]
    for name in list(names) or [result.verdict.suspects[0].effect]:
        names += [e for e in (name, *suspect(result, name).group) if e not in names]
    return [(called(e).capitalize(), CATALOGUE[e].separated_by) for e in names if CATALOGUE[e].separated_by]


def _where_content(result: Diagnosis, case: Case, before: Replay, after: Replay | None) -> dict[str, Any]:
    where, geometry = result.where, case.building.geometry
    zones = list(before.missing.columns)
    sizes = [_rms(r.missing) for r in (before, after) if r is not None]
    maps: list[figures.Picture] = []
    if isinstance(geometry, FloorPlans):
        top = max(1.0, float(np.nanmax(sizes[0], initial=1.0)))
        for heat, title in zip(sizes, ("calibrated model", "with the effects found"), strict=False):
            maps += figures.heat_maps(geometry, case.building.orientation, zones, heat, title, top)
    shares = {s.name: s for s in where.zones}
    means = before.missing.mean()
    worst = sorted(range(len(zones)), key=lambda i: -shares[zones[i]].share)
    rows = [
        {
            "zone": zones[i],
            "share": f"{shares[zones[i]].share:.0%}".replace("%", " %"),
            "width": f"{100 * shares[zones[i]].share:.1f}",
            "mean": _signed_watts(float(means.iloc[i])),
            "sizes": [watts(float(s[i])) for s in sizes],
        }
        for i in worst[:_MOST_ZONES]
    ]
    parts = [p for p in (*where.groups, *where.modes.values()) if p.predictions > 0.0]
    parts = sorted(parts, key=lambda p: p.predictions - p.share)[:_MOST_PARTS]
    return {
        "sentence": where.sentence,
        "maps": maps,
        "zones": rows,
        "zone_count": len(zones),
        "parts": [_part(p) for p in parts],
        "hours": figures.hour_bars(where.hours),
    }


def _part(p: Share) -> dict[str, str]:
    name = p.name if p.name.startswith(("in ", "with")) else f"in {p.name}" if p.name[:3] == "the" else p.name
    return {
        "name": name.capitalize() if name.startswith("in the ") or " " not in name else name[0].upper() + name[1:],
        "share": f"{100 * p.share:.0f} %",
        "width": f"{100 * p.share:.1f}",
        "predictions": f"{100 * p.predictions:.0f} %",
        "mark": f"{100 * p.predictions:.1f}",
        "interval": f"{100 * p.interval[0]:.0f} to {100 * p.interval[1]:.0f} %",
    }


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
    for step, r in zip(result.steps, result.rounds, strict=False):
        name = called(step.effects[-1])
        if step.shuffled is not None:
            real = step.shuffled > step.after
            verdict = "so its course over these very days is what explains" if real else "so be careful with this one"
            sentences.append(
                f"With the days of {name} shuffled the error is {kelvin(step.shuffled)} K instead of "
                f"{kelvin(step.after)} K, {verdict}."
            )
        others = [x for x in r.refits if x is not r.accepted]
        if step.runner_up is not None and others:
            sentences.append(
                f"The next best in its place, {called(others[0].screened.effect)}, reaches {kelvin(step.runner_up)} K."
            )
    return sentences


def _panels(before: Replay, after: Replay | None) -> list[figures.Picture]:
    both = [r.evaluation for r in (before, after) if r is not None]
    series = [figures.series_of_runs(e) for e in both]
    errors = [{z: e["mae"] for z, e in one.by_zone().items()} for one in both]
    return figures.change_panels(series[0], series[1] if len(series) > 1 else None, both[0].zones, errors)


def _rms(missing: pd.DataFrame) -> Any:
    return np.sqrt((missing**2).mean()).to_numpy()


def _signed_watts(value: float) -> str:
    return ("+" if value > 0 else "") + watts(value) if np.isfinite(value) else "not known"


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
