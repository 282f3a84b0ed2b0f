"""Share of comfort violations that optimal control of identified plants keeps over a season, and what it costs.

Each plant of `make_foreign_plants.py` is identified by an experiment of two weeks and controlled over a heating season,
once for each share of occupied steps that may lie below the band, and once with the edge of the band as it is. Seen is
the share of steps with people, over all zones, whose mean temperature lay below the band; energy is compared with the
run without a guarantee. A season has four pieces that begin every four weeks, each after a week under the plant's own
control; the distance that is kept from the band goes on from piece to piece, whatever else was learned does not.

Run: ``python benchmarks/comfort_guarantee.py --out results/comfort_guarantee [--publish]`` with the extra
``[energyplus]``; fifty minutes of CPU time for the default, half of it with ``--days 14`` of each piece. What is
finished is kept, one file a piece. Writes ``comfort_guarantee.json`` and ``.md``; with ``--publish`` also the table in
``docs/foreign_plants.md``.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _code import code
from _foreign_runs import conformal_of, drive
from _table import keep, markdown, write
from foreign_models.plants import PLANTS

from mpc.control.identified.conformal import Guarantee
from mpc.control.identified.controller import IdentifiedSettings
from mpc.errors import EnergyPlusError
from mpc.kpi.kpis import measure_kpis

#: From the day after the first week of the year on, a piece every four weeks to the end of April.
START, PIECES, EVERY = "2023-01-09", 4, 28
#: Plants of that season: what counts is steps below the band.
HEATED = [name for name, plant in PLANTS.items() if not plant.cooled]
COLUMNS = ("plant", "days", "asked, %", "seen, %", "by piece, %", "distance kept at the end, K",
           "below the band, K h a zone", "energy, kWh/m²", "against none asked, %", "CPU, s")  # fmt: skip


def perform(name: str, share: float, out: Path, days: int, finished: bool) -> dict[str, Any] | None:
    """Run a plant over a season with a share that is asked for, 0 for none, or read what came of it.

    With ``finished`` no further piece is run: None where there is none.
    """
    pieces: list[dict[str, Any]] = []
    for k in range(PIECES):
        start = f"{pd.Timestamp(START) + pd.Timedelta(days=k * EVERY):%Y-%m-%d}"
        path = out / name / f"{start}_{days}_{share:g}.json"
        if not path.exists():
            if finished:
                break
            kept = pieces[-1]["kept"] if pieces and share else None
            keep(path, piece(name, share, out, start, days, kept))
        pieces.append(dict(json.loads(path.read_text(encoding="utf-8"))))
        print(f"{name} {share:g} from {start}: {100.0 * seen(pieces[-1:]):.2f} %", flush=True)
    if not pieces:
        return None
    return {
        "plant": name, "days": len(pieces) * days, "asked": share, "seen": seen(pieces), "kept": pieces[-1]["kept"],
        "by_piece": [seen([each]) for each in pieces], "energies": [each["energy"] for each in pieces], "code": code(),
        **{key: sum(each[key] for each in pieces) for key in ("energy", "cost", "below", "cpu_seconds")},
    }  # fmt: skip


def seen(pieces: list[dict[str, Any]]) -> float:
    """Share of occupied steps below the band [-]."""
    return float(sum(each["outside"] for each in pieces) / sum(each["occupied"] for each in pieces))


def piece(name: str, share: float, out: Path, start: str, days: int, kept: list[list[float]] | None) -> dict[str, Any]:
    """Run a piece of a season, from a back-off that was kept before."""
    settings = IdentifiedSettings(guarantee=Guarantee(share) if share else None)
    loop, scenario, timed, _ = drive(name, "mpc", out, pd.Timestamp(start), days, settings, kept)
    parts = round(scenario.grid.step / loop.record.step)
    zone = 0.5 * (loop.record.zone_temperature[1:] + loop.record.zone_temperature[:-1])
    zone = zone.reshape(-1, parts, zone.shape[1]).mean(axis=1)
    count = len(zone)
    occupied = scenario.expected_occupancy[:count] > 0
    kpis = measure_kpis(loop.record, scenario)
    return {
        "plant": name, "start": start, "days": days, "asked": share, "code": code(),
        "outside": int((zone < scenario.lower[:count])[occupied].sum()), "occupied": int(occupied.sum()),
        "kept": conformal_of(timed).values.tolist() if share else None,
        "energy": kpis.ener_tot, "cost": kpis.cost_tot, "below": sum(z.below for z in kpis.zones) / len(kpis.zones),
        "cpu_seconds": sum(timed.seconds),
    }  # fmt: skip


def table_of(runs: list[dict[str, Any]]) -> str:
    """Lay the results out."""
    none = {row["plant"]: row["energies"] for row in runs if not row["asked"]}
    rows = []
    for row in runs:
        pairs = list(zip(row["energies"], none.get(row["plant"], []), strict=False))  # of the pieces that both have
        mine, base = (sum(each[k] for each in pairs) for k in (0, 1))
        against = f"{100.0 * (mine / base - 1.0):+.2f}" if pairs else ""
        asked = f"{100.0 * row['asked']:g}" if row["asked"] else "none"
        kept = np.ravel(row["kept"]) if row["kept"] else np.zeros(1)
        pieces = ", ".join(f"{100.0 * value:.1f}" for value in row["by_piece"])
        rows.append((row["plant"], row["days"], asked, f"{100.0 * row['seen']:.2f}", pieces,
                     f"{kept.min():.2f} to {kept.max():.2f}", f"{row['below']:.2f}", f"{row['energy']:.3f}", against,
                     f"{row['cpu_seconds']:.0f}"))  # fmt: skip
    return markdown(COLUMNS, rows)


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/comfort_guarantee"))
    parser.add_argument("--plants", nargs="+", default=["shop", "house", "flats"], choices=HEATED)
    parser.add_argument("--shares", nargs="+", type=float, default=[0.0, 0.05])
    parser.add_argument("--days", type=int, default=EVERY, help="of each piece")
    parser.add_argument("--finished", action="store_true", help="lay out the pieces that are there, without new ones")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args(arguments)
    runs = list[dict[str, Any]]()
    try:
        for name in options.plants:
            for share in options.shares:
                row = perform(name, share, options.out, options.days, options.finished)
                runs += [] if row is None else [row]
    except EnergyPlusError as error:
        print(error, file=sys.stderr)
        return 1
    table = table_of(runs)
    write(options.out, "comfort_guarantee", table, runs, options.publish)
    print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
