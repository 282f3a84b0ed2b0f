"""Nightly evaluation of a site: a fault planted on day 20 of 60, on which night it is told, and by which name.

Small offices (`_monitored_years.py`) of four or five zones, in which on day 20 a heating valve begins to leak, a zone's
temperature sensor drifts away over five days, or blinds are left down; and once nothing. Their points lie in a
PostgreSQL server as live operation keeps them, and the evaluation of ``operate`` runs on the nights after as if each
were now, with the days before as its past. The first 14 days are taken for sound.

Told are the first night on which the page shows a change that began within a week of day 20, its name, and what the
page says after 60 days. Anything else that is shown, on any night that was run, is a false alarm.

Run: ``python benchmarks/nightly.py --seeds 600-603 --out results/nightly --publish``; some six minutes.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

import pandas as pd
from _monitored_years import make_year
from _nightly_site import make_site
from _postgres import PostgresServer
from _seeds import seed_range
from _table import markdown, write

DAY, DAYS, REFERENCE, OFF = 20, 60, 14, 7

#: Kind of `_monitored_years`, days over which it comes, and what the page should call it.
FAULTS: dict[str, tuple[str, float]] = {
    "heating valve stuck open": ("valve_leak", 0.0),
    "sensor drifts away": ("sensor_bias", 5.0),
    "blinds left down": ("blinds_down", 0.0),
    "nothing": ("", 0.0),
}

#: Nights on which the evaluation runs: from the first that a week can be watched before, until the change is told, and
#: at the end.
NIGHTS = (*range(DAY + 2, DAY + 15), DAY + 21, DAY + 28, DAYS)


def run(fault: str, seed: int, address: str, folder: Path) -> dict[str, Any]:
    """Evaluate the nights of one office."""
    kind, over = FAULTS[fault]
    case, change = make_year(seed, bool(kind), DAYS, kind, start=DAY, over=over) if kind else make_year(
        seed, False, DAYS
    )  # fmt: skip
    nightly = make_site(folder, case, address, f"{kind or 'nothing'}_{seed}", REFERENCE)
    begin = case.stamps[0].normalize()
    found: dict[str, Any] = {"fault": fault, "seed": seed, "zones": list(change.zones), "size": change.size,
                             "night": None, "false": 0, "seconds": []}  # fmt: skip
    nights = NIGHTS if kind else (DAY + 8, DAY + 20, DAYS)
    for night in nights:
        if found["night"] is not None and night != DAYS:
            continue
        used = time.process_time()
        state = nightly.evaluate((begin + pd.Timedelta(days=night, hours=2.5)).timestamp())
        found["seconds"].append(time.process_time() - used)
        if state["trouble"]:
            raise RuntimeError(f"{fault}, seed {seed}, night {night}: {state['trouble']}")
        days = [(pd.Timestamp(one["since"]) - begin.tz_localize(None)).days for one in state["events"]]
        hits = [one for one, since in zip(state["events"], days, strict=True) if kind and abs(since - DAY) <= OFF]
        found["false"] += len(state["events"]) - min(len(hits), 1)
        if hits and found["night"] is None:
            found |= {"night": night - DAY, "first": hits[0]["what"]}
        right = bool(hits) and hits[0]["effect"] in change.effects and all(z in hits[0]["where"] for z in change.zones)
        if night == DAYS:
            found |= {"sentence": state["sentence"], "since": days, "last": hits[0] if hits else None, "right": right}
    return found


def report(rows: list[dict[str, Any]]) -> str:
    """Lay out the table."""
    lines = [
        [row["fault"], row["seed"], ", ".join(row["zones"]) or "-",
         "-" if row["night"] is None else f"{row['night']}", row.get("first", "-"),
         row["last"]["what"] if row["last"] else "-", row["last"]["where"] if row["last"] else "-",
         row["last"]["since"] if row["last"] else "-", "yes" if row["right"] else "-", row["false"]]
        for row in rows
    ]  # fmt: skip
    heads = ("fault on day 20", "seed", "where", "told after [nights]", "called then", "called on day 60",
             "place on day 60", "since", "name and place right", "others told")  # fmt: skip
    seconds = sorted(second for row in rows for second in row["seconds"])
    told = "Day 20 is 2023-01-22; the first night that is evaluated is the second after it. A night takes "
    return f"{markdown(heads, lines)}\n{told}{seconds[len(seconds) // 2]:.1f} CPU seconds (median).\n"


def main() -> None:
    """Run all, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=seed_range, required=True)
    parser.add_argument("--out", type=Path, default=Path("results/nightly"))
    parser.add_argument("--publish", action="store_true")
    options = parser.parse_args()
    top, rows = Path(tempfile.mkdtemp(prefix="nightly")), []
    top.chmod(0o755)
    data = top / "pg"
    data.mkdir()
    server = PostgresServer(data)
    server.start()
    try:
        for fault in FAULTS:
            for seed in options.seeds:
                rows.append(run(fault, seed, server.address, top / f"{fault} {seed}"))
                print(f"{fault}, {seed}: night {rows[-1]['night']}: {rows[-1]['sentence']}", flush=True)
    finally:
        server.stop()
        shutil.rmtree(top, ignore_errors=True)
    text = report(rows)
    write(options.out, "nightly", text, rows, options.publish)
    print(text)


if __name__ == "__main__":
    main()
