"""Small buildings with components drawn at random, identified and controlled without an edit of code.

Buildings are those of `foreign_models.drawn`, in EnergyPlus: houses with heated floors and heat pumps, flats with
baseboards, shops with unitary heat pumps, offices whose fan coils share a heat pump, dwellings with radiators on a gas
boiler, and in summer shops and offices that are cooled; fabric, size, people, hours, machines and place are drawn. Each
is excited for two weeks beside its coldest or hottest period, identified, and controlled for some days of that period
at an hourly price, beside its own control and the rule at full speed. What fails is named.

Run: ``python benchmarks/fleet_of_plants.py --out results/fleet_of_plants [--publish]`` with the extra ``[energyplus]``;
an hour of CPU time for the default. What is finished is kept, one file a building. Writes
``fleet_of_plants.json`` and ``.md``; with ``--publish`` also the table in ``docs/foreign_plants.md``.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import pandas as pd
from _code import code
from _foreign_runs import account, drive, identified
from _table import keep, markdown, write
from foreign_models.drawn import drawn_plants
from foreign_models.plants import ALL

from mpc.errors import EnergyPlusError, MpcError

DAYS = 7
CONTROLLERS = ("own", "rule", "mpc")
COLUMNS = (
    "building", "what", "MPC against own, %", "against the rule, %",
    "below the band, in summer above it, K h a zone: own, rule, MPC", "starts a day", "CPU, s: identify, MPC",
)  # fmt: skip


def perform(name: str, out: Path, days: int) -> dict[str, Any]:
    """Identify and control a building, or read what came of it; a failure is a result."""
    path = out / name / f"{days}_days.json"
    if path.exists():
        return dict(json.loads(path.read_text(encoding="utf-8")))
    data: dict[str, Any] = {"building": name, "about": ALL[name].about, "days": days, "code": code()}
    begin = pd.Timestamp(ALL[name].begin)
    stage = "identify"
    try:
        data["identify_cpu_seconds"] = identified(name, out)[1]["identify_cpu_seconds"]
        for stage in CONTROLLERS:
            loop, scenario, timed, _ = drive(name, stage, out, begin, days)
            data[stage] = account(loop, scenario, timed.seconds)
    except EnergyPlusError:
        raise
    except MpcError as error:
        data["failure"] = f"{stage}: {error}"
    keep(path, data)
    return data


def table_of(found: list[dict[str, Any]]) -> str:
    """Lay the results out, failures with their reason."""
    rows = []
    for row in found:
        head = (row["building"].removeprefix("drawn_"), row["about"])
        if "failure" in row:
            rows.append((*head, f"failed: {row['failure']}", *[""] * (len(COLUMNS) - 3)))
            continue
        own, rule, mpc = (row[name] for name in CONTROLLERS)
        starts_a_day = mpc["starts_a_day"]
        rows.append((
            *head, *(f"{100.0 * (mpc['cost'] / other['cost'] - 1.0):+.1f}" for other in (own, rule)),
            ", ".join(f"{each['above' if ALL[row['building']].cooled else 'below']:.2f}" for each in (own, rule, mpc)),
            "-" if not starts_a_day else f"{starts_a_day:.1f}",
            f"{row['identify_cpu_seconds']:.0f}, {mpc['cpu_seconds']:.0f}",
        ))  # fmt: skip
    return markdown(COLUMNS, rows)


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark."""
    names = list(drawn_plants())
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/fleet_of_plants"))
    parser.add_argument("--buildings", nargs="+", default=names, choices=names)
    parser.add_argument("--days", type=int, default=DAYS, help="that are controlled")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args(arguments)
    found = []
    try:
        for name in options.buildings:
            found.append(perform(name, options.out, options.days))
            print(f"{name}: {found[-1].get('failure', 'controlled')}", flush=True)
    except EnergyPlusError as error:
        print(error, file=sys.stderr)
        return 1
    table = table_of(found)
    write(options.out, "fleet_of_plants", table, found, options.publish)
    print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
