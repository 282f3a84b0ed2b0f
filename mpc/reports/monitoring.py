"""What a monitoring leaves behind: its words, its page and its files."""

from pathlib import Path
from typing import Any

from calibration.monitoring.course import LASTS, UNKNOWN_CAUSE, Event
from calibration.monitoring.days import USUAL
from calibration.monitoring.monitor import Monitoring
from mpc.reports.diagnosis_words import called, in_zones
from mpc.reports.figures.monitoring import time_line
from mpc.reports.means_found import monitoring_means
from mpc.reports.page import counted, listed, significant, sure, unit, write_report
from thermal.effects.catalogue import CATALOGUE

#: Events that the verdict names.
_MOST = 3


def write_monitoring(found: Monitoring, out: str | Path, *, force: bool = False) -> Path:
    """Write ``monitoring.json``, ``weekly.parquet``, ``daily.parquet`` and ``report.html``.

    Parameters
    ----------
    found : Monitoring
        From `monitor`.
    out : str or Path
        Folder, made if need be.
    force : bool
        Replace earlier results.

    Returns
    -------
    Path
        The page.
    """
    content = {
        "case": found.case, "verdict": monitoring_verdict(found), "means": monitoring_means(found),
        "events": event_rows(found), "horizon": found.settings.horizon,
        "figures": time_line(found), "span": (found.days.dates[0], found.days.dates[-1]),
        "reference": found.settings.reference_days, "threshold": found.course.threshold, "lasts": LASTS,
        "withdrawn": [f"{found.date(day):%Y-%m-%d}" for day in found.course.withdrawn],
        "untestable": [
            *(f"{zone}: {reason}" for zone, reason in found.silent_zones.items()),
            *(f"{called(e)}: {reason}" for e, reason in found.untestable.items()),
        ],
        "parameters": found.parameters,
    }  # fmt: skip
    files = {
        "monitoring.json": monitoring_summary(found), "weekly.parquet": found.weekly(), "daily.parquet": found.daily(),
    }  # fmt: skip
    return write_report(out, "monitoring", content, files, force)


def monitoring_summary(found: Monitoring) -> dict[str, Any]:
    """Contents of ``monitoring.json``.

    Parameters
    ----------
    found : Monitoring
        From `monitor`.
    """
    return {"sentence": monitoring_verdict(found), **found.to_dict()}


def monitoring_verdict(found: Monitoring) -> str:
    """Say in plain words what has changed, and since when.

    Parameters
    ----------
    found : Monitoring
        From `monitor`.
    """
    missed = int((~found.is_watched).sum())
    watched = counted(int(found.is_watched.sum()), "day")
    without = f" {counted(missed, 'day')} more had no usable run." if missed else ""
    if found.silent_zones:
        without += f" Too little was measured {in_zones(list(found.silent_zones))} on the reference days."
    if found.course.waiting is not None:
        without += f" An alarm of {found.date(found.course.waiting):%Y-%m-%d} waits for more days."
    if not found.events:
        return f"Nothing has changed in {watched} that were watched.{without}"
    told = [f"{_what(e)} ({in_zones(e.zones)}), {_when(found, e)}" for e in found.events[-_MOST:]]
    more = len(found.events) - len(told)
    text = f"In {watched} that were watched: {listed(told)}."
    return text + (f" {counted(more, 'earlier change')} beside." if more else "") + without


def event_rows(found: Monitoring) -> list[dict[str, Any]]:
    """Rows of the table of changes.

    Parameters
    ----------
    found : Monitoring
        From `monitor`.
    """
    rows = []
    for e in found.events:
        others = [f"{called(name)} {sure(p)}" for name, p in e.probabilities.items() if name != e.effect]
        rows.append({
            "since": f"{found.date(e.since):%Y-%m-%d}",
            "until": "lasts" if e.end is None else f"{found.date(e.end):%Y-%m-%d}",
            "what": _what(e), "where": in_zones(e.zones), "sure": sure(e.probability),
            "size": _size(e),
            "noticed": f"{found.date(e.alarm):%Y-%m-%d}", "others": "; ".join(others) or "–",
            "told_apart": CATALOGUE[e.effect].separated_by if e.effect in CATALOGUE else "",
        })  # fmt: skip
    return rows


def _size(event: Event) -> str:
    told = f"{significant(event.size, 2)} ± {significant(1.645 * event.deviation, 2)}"
    return told if event.unit in ("1", "", "-") else f"{told} {unit(event.unit)}"


def _what(event: Event) -> str:
    """Call a change by what it is, and whether there is more or less of it."""
    if event.effect == UNKNOWN_CAUSE:
        return f"{'more' if event.size > 0 else 'less'} heat of unknown cause"
    if event.effect in USUAL:  # there from the beginning, so that it can also become less
        return f"{called(event.effect)}, {'more' if event.size > 0 else 'less'} than before"
    return called(event.effect)


def _when(found: Monitoring, event: Event) -> str:
    slowly = f", in the course of {counted(event.over, 'day')}" if event.over else ""
    since = f"since {found.date(event.since):%Y-%m-%d}{slowly}"
    return since if event.end is None else f"{since}, over on {found.date(event.end):%Y-%m-%d}"
