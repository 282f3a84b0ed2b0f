"""Monitoring of simulated years: how soon a change is noticed, whether its name is right, and how often there is none.

Years of small offices (`_monitored_years.py`), half of them with one change on a day that is drawn, which in half of
these is mended after three to ten weeks, and half without. ``buildingmpc monitor`` sees the case alone; labels are
sealed beside it. A change is *noticed* by the first event whose alarm comes on its day or later and whose day of change
is no more than a week off. Every other event that begins something, and every alarm that was withdrawn, is a false
alarm. *Right first* counts effects that are the name of a noticed change.

Seeds below 100, and those from 1000 on, are for development (thresholds and priors were chosen on 0 to 9 with a change
and 1000 to 1003 without); those from 100 on confirm.
Run from the repository's root; an interrupted run goes on where it was::

    python benchmarks/monitoring.py --seeds 100-139 --out results/monitoring
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from _code import code
from _monitored_years import DAYS, make_year
from _table import markdown, publish, write
from blind_trials import seed_range

from calibration.monitoring.monitor import monitor

NAME = "monitoring"

#: Days by which the day of a change may be off, and quiet seeds, which are others than those of changes.
_OFF, _QUIET = 7, 10_000


def wilson(hits: int, of: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927)."""
    if of == 0:
        return 0.0, 1.0
    z, p = 1.959964, hits / of
    middle, half = p + z * z / (2 * of), z * np.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    return float((middle - half) / (1 + z * z / of)), float((middle + half) / (1 + z * z / of))


def answer(seed: int, changed: bool, out: Path) -> str:
    """Make a year, watch it, and keep label and answer apart."""
    name = f"{'change' if changed else 'quiet'}_{seed}"
    files = {kind: out / kind / f"{name}.json" for kind in ("sealed", "answers")}
    if files["answers"].exists():
        return "there already"
    case, change = make_year(seed if changed else seed + _QUIET, changed)
    began = time.process_time()
    found = monitor(case, progress=None)
    told = {
        "events": [vars(e) for e in found.events], "withdrawn": list(found.course.withdrawn),
        "reference": found.settings.reference_days, "seconds": time.process_time() - began, "code": code(),
        "zones": len(case.building.zone_names),
    }  # fmt: skip
    for kind, content in (("sealed", change.to_dict()), ("answers", told)):
        files[kind].parent.mkdir(parents=True, exist_ok=True)
        part = files[kind].with_suffix(".part")
        part.write_text(json.dumps(content), encoding="utf-8")
        part.replace(files[kind])
    return ", ".join(f"{e.effect} since day {e.since}" for e in found.events) or "nothing"


def scored(change: dict[str, Any], told: dict[str, Any]) -> dict[str, Any]:
    """Score one year."""
    events, kind = told["events"], change["kind"]
    hits = [e for e in events if kind and e["alarm"] >= change["start"] and abs(e["since"] - change["start"]) <= _OFF]
    first = min(hits, key=lambda e: e["alarm"]) if hits else None
    end = change["end"]
    reopened = [e for e in events if kind and end < DAYS and abs(e["since"] - end) <= _OFF and e is not first]
    false = len([e for e in events if e is not first and e not in reopened]) + len(told["withdrawn"])
    row: dict[str, Any] = {"kind": kind or "nothing", "false": false, "seconds": told["seconds"],
                           "years": (DAYS - told["reference"]) / 365.25, "mended": bool(kind) and end < DAYS}
    if first is not None:
        row |= {"delay": first["alarm"] - change["start"], "named": first["effect"],
                "right": first["effect"] in change["effects"], "place": set(change["zones"]) <= set(first["zones"]),
                "closed": first["end"] is not None and abs(first["end"] - end) <= _OFF}  # fmt: skip
    return row


def report(out: Path, published: bool) -> str:
    """Score what is answered, and lay out the tables."""
    rows = []
    for path in sorted((out / "answers").glob("*.json")):
        label = json.loads((out / "sealed" / path.name).read_text(encoding="utf-8"))
        rows.append(scored(label, json.loads(path.read_text(encoding="utf-8"))) | {"year": path.stem, **{
            k: label[k] for k in ("zones", "size", "start", "end")}})  # fmt: skip
    if not rows:
        raise SystemExit(f"{out}: expected answered years, found none")
    quiet, changed = [r for r in rows if r["kind"] == "nothing"], [r for r in rows if r["kind"] != "nothing"]
    noticed = [r for r in changed if "delay" in r]
    mended = [r for r in noticed if r["mended"]]
    delays = [r["delay"] if "delay" in r else np.inf for r in changed]
    lines: list[list[Any]] = []
    if quiet:
        years = sum(r["years"] for r in quiet)
        lines.append(["false alarms a building-year, quiet years", f"{sum(r['false'] for r in quiet) / years:.2f}",
                      f"{sum(r['false'] for r in quiet)} in {years:.1f} years, withdrawn ones among them"])
        lines.append(["quiet years without any alarm", *_share(sum(r["false"] == 0 for r in quiet), len(quiet))])
    if changed:
        years = sum(r["years"] for r in changed)
        lines.append(["false alarms a building-year, years with a change",
                      f"{sum(r['false'] for r in changed) / years:.2f}", f"{years:.1f} years"])
        middle = float(np.median(delays))
        lines.append(["median delay, years not noticed as infinite", f"{middle:.0f} days" if np.isfinite(middle) else
                      "infinite", f"{len(noticed)} of {len(changed)} noticed"])
        lines.append(["noticed within 5 days", *_share(sum(d <= 5 for d in delays), len(changed))])
        right = sum(r.get("right", False) for r in changed)
        lines.append(["right first, of all changes", *_share(right, len(changed))])
        lines.append(["right first, of those noticed", *_share(sum(r["right"] for r in noticed), len(noticed))])
        lines.append(["zone right, of right names", *_share(sum(r["place"] for r in noticed if r["right"]),
                                                            sum(r["right"] for r in noticed))])
        lines.append(["end found within a week, of mended and noticed", *_share(sum(r["closed"] for r in mended),
                                                                                len(mended))])
    kinds = sorted({r["kind"] for r in changed})
    by_kind = [_of_kind(k, [r for r in changed if r["kind"] == k]) for k in kinds]
    failures = [
        [r["year"], r["kind"], ", ".join(r["zones"]) or "-", f"{r['size']:.2g}",
         "not noticed" if "delay" not in r else f"after {r['delay']} days", r.get("named", "-"), r["false"]]
        for r in rows if r["false"] or (r["kind"] != "nothing" and not r.get("right", False))
    ]  # fmt: skip
    seconds = float(np.median([r["seconds"] for r in rows]))
    text = (
        f"{len(changed)} years with a change and {len(quiet)} without; {seconds:.0f} CPU seconds a year (median).\n\n"
        + markdown(("", "", "95 % interval, or of what"), lines)
        + "\n" + markdown(("what changes", "years", "noticed", "median delay [d]", "right first"), by_kind)
        + "\nEvery year with a wrong answer:\n\n"
        + markdown(("year", "what changed", "where", "size", "noticed", "called", "false alarms"), failures)
    )  # fmt: skip
    write(out, NAME, text, rows, published=False)
    if published:
        publish(NAME, text)
    return text


def _share(hits: int, of: int) -> list[str]:
    low, high = wilson(hits, of)
    return [f"{hits} of {of}" + (f", {hits / of:.0%}" if of else ""), f"{low:.0%} to {high:.0%}"]


def _of_kind(kind: str, rows: list[dict[str, Any]]) -> list[Any]:
    delays = [r["delay"] if "delay" in r else np.inf for r in rows]
    middle = float(np.median(delays))
    told = f"{middle:.0f}" if np.isfinite(middle) else "-"
    return [kind, len(rows), sum("delay" in r for r in rows), told, sum(r.get("right", False) for r in rows)]


def main() -> None:
    """Make what is not there, watch it, and tabulate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=seed_range, required=True, help="first and last, such as 100-139")
    parser.add_argument("--out", type=Path, default=Path("results/monitoring"), help="folder of labels and answers")
    parser.add_argument("--report", action="store_true", help="only tabulate what is answered")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    if not options.report:
        for seed in options.seeds:
            for changed in (True, False):
                print(f"{seed} {'change' if changed else 'quiet'}: {answer(seed, changed, options.out)}", flush=True)
    print(report(options.out, options.publish))


if __name__ == "__main__":
    main()
