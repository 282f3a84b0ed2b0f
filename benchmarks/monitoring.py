"""Monitoring of simulated years: how soon a change is noticed, whether its name is right, how often there is none.

Years of small offices (`_monitored_years.py`) or, with ``--world house``, heating seasons of EnergyPlus houses of
another maker (`_monitored_houses.py`), each with one change on a day that is drawn, which in half of these is mended
after three weeks to ten, and once more without. ``buildingmpc monitor`` sees the case alone; labels are sealed beside
it.

Not every change can be seen: a capacity that is lost in May shows when the load comes. What a change does to the errors
is known here, from the same year without it. An oracle that is told this, and has the filter's noise, has the evidence
``½ Σ_d gᵀ V⁻¹ g`` for the change by day on average, g what is left of it in the innovations; from the day on which this
exceeds the threshold of an alarm the change *shows*, and where it never does, no detector finds it but by luck.

A change is *noticed* by the first event whose alarm comes on its day or later and whose day of change is no more than a
week before it, and no more than a week after it began to show. Every other event that begins something, and every alarm
that was withdrawn, is a false alarm. *Right first* counts effects that are the name of a noticed change. Delays count
from the day of the change, whether it shows then or not.

Seeds below 100 are for development: the weights of effects were chosen on 0 to 9, sizes of changes, what ages and how
names are told apart on 2, 3, 5, 6, 8, 10 to 19, 23, 25, 26 and 28 with and without a change, what strengths may have
been from the beginning and the threshold on 33, 35, 43 and 45. 100 to 118 have been tabulated once, in years whose open
doors were not stable, 144 to 183 by the values before these; 184 to 203, 220 to 239 and 240 to 259 by versions before
clocks were told by weather that is moved and capacity by the seasons. Of those 226 to 229, 231, 236, 239, 241 and 243
to 258 were looked at for that; 260 to 299 confirm it. Of the houses 0 to 7 were looked at, to see that they can be
watched, and 20 to 35, after which windows are as wide as rooms let them be and a heater that is off, or on and gives
less than it says, counts as a meter too. 60 to 94 have been tabulated by the method as it came from the offices, 100 to
139 once heat that begins was sought alike everywhere. How long evidence has to last was chosen on 0 to 35 and seen on
100 to 139 and the offices 220 to 239; laws of windows and limits of strengths on the windows among 65 to 121. The
houses 140 to 160 and the offices 311 to 323 and 325 to 364 confirm that.

Run from the repository's root; an interrupted run goes on where it was::

    python benchmarks/monitoring.py --seeds 325-364 --out results/monitoring --publish
    python benchmarks/monitoring.py --world house --seeds 140-160 --out results/monitoring_houses --publish
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import _monitored_houses
import _monitored_years
import numpy as np
from _code import code
from _monitored_years import Change, evidence_of_oracle
from _seeds import seed_range
from _table import markdown, publish, write

from calibration.monitoring.course import THRESHOLD
from calibration.monitoring.monitor import REFERENCE_DAYS, monitor
from thermal import Case


class World(NamedTuple):
    """A maker of years.

    Parameters
    ----------
    name : str
        Of its table.
    make : callable
        Case and change of a seed, with the change or without.
    days : int
        Length of its telemetry [d].
    told : str
        What its years are called.
    """

    name: str
    make: Callable[[int, bool], tuple[Case, Change]]
    days: int
    told: str


WORLDS = {
    "office": World("monitoring", _monitored_years.make_year, _monitored_years.DAYS, "years"),
    "house": World("monitoring_houses", _monitored_houses.make_year, _monitored_houses.DAYS, "seasons"),
}

#: Days by which the day of a change may be off.
_OFF = 7


def wilson(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927)."""
    if of == 0:
        return 0.0, 1.0
    z, p = 1.959964, hits / of
    middle, half = p + z * z / (2 * of), z * np.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    return float((middle - half) / (1 + z * z / of)), float((middle + half) / (1 + z * z / of))


def answer(world: World, seed: int, out: Path) -> str:
    """Make a year with a change and without, watch both, and keep labels and answers apart."""
    names = {True: f"change_{seed}", False: f"quiet_{seed}"}
    if all((out / "answers" / f"{name}.json").exists() for name in names.values()):
        return "there already"
    watched, labels, answers = {}, {}, {}
    for changed in names:
        case, change = world.make(seed, changed)
        began = time.process_time()
        found = watched[changed] = monitor(case, progress=None)
        answers[changed] = {
            "events": [vars(e) for e in found.events], "withdrawn": list(found.course.withdrawn),
            "reference": found.settings.reference_days, "seconds": time.process_time() - began, "code": code(),
            "zones": len(case.building.zone_names),
        }  # fmt: skip
        labels[changed] = change.to_dict() | {"oracle": 0.0, "shows": None, "days": world.days, "world": world.name}
    label = labels[True]
    by_day = evidence_of_oracle(watched[True].days, watched[False].days, REFERENCE_DAYS)
    evidence = np.cumsum(by_day[label["start"] : label["end"]])
    shows = np.flatnonzero(evidence > THRESHOLD)
    label |= {"oracle": float(evidence[-1]), "shows": label["start"] + int(shows[0]) if shows.size else None}
    for changed, name in names.items():
        _keep(out / "sealed" / f"{name}.json", labels[changed])
        _keep(out / "answers" / f"{name}.json", answers[changed])
    return "; ".join(
        f"{name}: " + (", ".join(f"{e.effect} since day {e.since}" for e in watched[changed].events) or "nothing")
        for changed, name in names.items()
    )


def _keep(path: Path, content: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(content), encoding="utf-8")
    part.replace(path)


def scored(change: dict[str, Any], told: dict[str, Any]) -> dict[str, Any]:
    """Score one year."""
    events, kind, start, days = told["events"], change["kind"], change["start"], change["days"]
    last = max(start, change["shows"] or start) + _OFF
    hits = [e for e in events if kind and e["alarm"] >= start and start - _OFF <= e["since"] <= last]
    first = min(hits, key=lambda e: e["alarm"]) if hits else None
    end = change["end"]
    reopened = [e for e in events if kind and end < days and abs(e["since"] - end) <= _OFF and e is not first]
    false = len([e for e in events if e is not first and e not in reopened]) + len(told["withdrawn"])
    row: dict[str, Any] = {"kind": kind or "nothing", "false": false, "seconds": told["seconds"],
                           "years": (days - told["reference"]) / 365.25, "mended": bool(kind) and end < days}
    if first is not None:
        row |= {"delay": first["alarm"] - start, "named": first["effect"],
                "right": first["effect"] in change["effects"], "place": set(change["zones"]) <= set(first["zones"]),
                "closed": first["end"] is not None and abs(first["end"] - end) <= _OFF}  # fmt: skip
    return row


def report(world: World, out: Path, published: bool) -> str:
    """Score what is answered, and lay out the tables."""
    rows = []
    for path in sorted((out / "answers").glob("*.json")):
        label = json.loads((out / "sealed" / path.name).read_text(encoding="utf-8"))
        if label.get("world", WORLDS["office"].name) != world.name:
            raise SystemExit(f"{out}: expected {world.name}, found {label['world']}; name another --out")
        label.setdefault("days", world.days)  # folders of the offices from before there were houses
        rows.append(scored(label, json.loads(path.read_text(encoding="utf-8"))) | {"year": path.stem, **{
            k: label[k] for k in ("zones", "size", "start", "end", "oracle", "shows")}})  # fmt: skip
    if not rows:
        raise SystemExit(f"{out}: expected answered years, found none")
    quiet, changed = [r for r in rows if r["kind"] == "nothing"], [r for r in rows if r["kind"] != "nothing"]
    lines = _of_quiet(quiet) + _of_changed(changed)
    kinds = sorted({r["kind"] for r in changed})
    by_kind = [_of_kind(k, [r for r in changed if r["kind"] == k]) for k in kinds]
    failures = [
        [r["year"], r["kind"], ", ".join(r["zones"]) or "-", f"{r['size']:.2g}",
         _seen_by_oracle(r), "not noticed" if "delay" not in r else f"after {r['delay']} days", r.get("named", "-"),
         r["false"]]
        for r in rows if r["false"] or (r["kind"] != "nothing" and not r.get("right", False))
    ]  # fmt: skip
    seconds = float(np.median([r["seconds"] for r in rows]))
    text = (
        f"{len(changed)} {world.told} with a change and {len(quiet)} without; {seconds:.0f} CPU seconds each "
        "(median).\n\n"
        + markdown(("", "", "95 % interval, or of what"), lines)
        + "\n" + markdown(("what changes", "years", "shows", "noticed", "median delay [d]", "right first"), by_kind)
        + "\nEvery year with a wrong answer:\n\n"
        + markdown(("year", "what changed", "where", "size", "shows", "noticed", "called", "false alarms"), failures)
    )  # fmt: skip
    write(out, world.name, text, rows, published=False)
    if published:
        publish(world.name, text)
    return text


def _of_quiet(rows: list[dict[str, Any]]) -> list[list[Any]]:
    years, false = sum(r["years"] for r in rows), sum(r["false"] for r in rows)
    return [
        ["false alarms a building-year, quiet years", f"{false / years:.2f}",
         f"{false} in {years:.1f} years, withdrawn ones among them"],
        ["quiet years without any alarm", *_share(sum(r["false"] == 0 for r in rows), len(rows))],
    ]  # fmt: skip


def _of_changed(rows: list[dict[str, Any]]) -> list[list[Any]]:
    showing, noticed = [r for r in rows if r["shows"] is not None], [r for r in rows if "delay" in r]
    mended, right = [r for r in noticed if r["mended"]], [r for r in noticed if r["right"]]
    years, false = sum(r["years"] for r in rows), sum(r["false"] for r in rows)
    delays = np.array([r.get("delay", np.inf) for r in rows])
    after = np.array([r.get("delay", np.inf) - (r["shows"] - r["start"]) for r in showing])
    return [
        ["false alarms a building-year, years with a change", f"{false / years:.2f}", f"{false} in {years:.1f} years"],
        ["changes that show, by the oracle", *_share(len(showing), len(rows))],
        ["median delay, years not noticed as infinite", f"{np.median(delays):.0f} days",
         f"{len(noticed)} of {len(rows)} noticed"],
        ["the same, from the day on which a change shows", f"{np.median(after):.0f} days",
         f"{sum('delay' in r for r in showing)} of {len(showing)} noticed"],
        ["noticed within 5 days", *_share(int((delays <= 5).sum()), len(rows))],
        ["noticed within 5 days of showing, of those that show", *_share(int((after <= 5).sum()), len(showing))],
        ["right first, of all changes", *_share(len(right), len(rows))],
        ["right first, of those that show", *_share(sum(r.get("right", False) for r in showing), len(showing))],
        ["right first, of those noticed", *_share(len(right), len(noticed))],
        ["zone right, of right names", *_share(sum(r["place"] for r in right), len(right))],
        ["end found within a week, of mended and noticed", *_share(sum(r["closed"] for r in mended), len(mended))],
    ]  # fmt: skip


def _share(hits: int, of: int) -> list[str]:
    low, high = wilson(hits, of)
    return [f"{hits} of {of}" + (f", {hits / of:.0%}" if of else ""), f"{low:.0%} to {high:.0%}"]


def _seen_by_oracle(row: dict[str, Any]) -> str:
    if row["kind"] == "nothing":
        return "-"
    return "never" if row["shows"] is None else f"after {row['shows'] - row['start']} days"


def _of_kind(kind: str, rows: list[dict[str, Any]]) -> list[Any]:
    delays = [r["delay"] if "delay" in r else np.inf for r in rows]
    middle = float(np.median(delays))
    told = f"{middle:.0f}" if np.isfinite(middle) else "-"
    shows = sum(r["shows"] is not None for r in rows)
    return [kind, len(rows), shows, sum("delay" in r for r in rows), told, sum(r.get("right", False) for r in rows)]


def main() -> None:
    """Make what is not there, watch it, and tabulate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--world", choices=list(WORLDS), default="office", help="whose years")
    parser.add_argument("--seeds", type=seed_range, required=True, help="first and last, such as 100-139")
    parser.add_argument("--out", type=Path, help="folder of labels and answers, of one world; results/NAME by default")
    parser.add_argument("--report", action="store_true", help="only tabulate what is answered")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    world = WORLDS[options.world]
    out = options.out or Path("results") / world.name
    if not options.report:
        for seed in options.seeds:
            print(f"{seed}: {answer(world, seed, out)}", flush=True)
    print(report(world, out, options.publish))


if __name__ == "__main__":
    main()
