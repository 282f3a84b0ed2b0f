"""Optimal control of the pilot building against rules and the perfect bound: weeks of winter, spring and summer.

The building is the generated pilot (two floors, 6,317 m2, 123 zones, 127 devices, seed 0) with a plant sized from its
loads. It steps on its grid with the paper's random shuffle, its sensors have noise (`SensorNoise`), and weather
forecasts have the errors of day-ahead ones (`DAY_AHEAD_ERRORS`), issued every hour; all controllers meet the same
weather, people, prices (PG&E's time of use as in the paper's simulator) and noise. Optimal control decides the supply
air, common to both air handlers, and the supply water every 15 minutes, 12 hours ahead, on the reduced model with the
building's parameters; rules act every 5 minutes. The bound is the same optimal control of the same building with exact
sensors, and weather and people known in advance.

Cost is that of energy. Discomfort is the mean over zones of the kelvin hours outside of BOPTEST's office band (21 to
24 degC from 6 to 19 o'clock on weekdays, 15 to 30 degC else). Since no two controllers leave zones equally comfortable,
the last columns count a zone's kelvin hour at `PRICE` as optimal control does: cost with discomfort, and the share of
the way from the best rule to the bound.

Every run is a file of its own under ``OUT/runs``, and what is there is not run again. A day of optimal control takes
one to two minutes on one core, one of a rule some ten seconds.

Run: ``python benchmarks/mpc_closed_loop.py --out results/mpc_loop --days 7 [--publish]``; an hour and a half
on one core. Writes ``mpc_closed_loop.json`` and ``.md``; with ``--publish`` also the tables of ``mpc.md`` and README.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd
from _table import keep, markdown, publish, write
from _threads import use_one_thread

from mpc.loop.make import pilot_weather
from mpc.loop.noise import SensorNoise
from mpc.scenario.forecast import DAY_AHEAD_ERRORS
from mpc.studies.run import prediction_errors, run_controller
from mpc.studies.study import Study, StudySettings, make_study
from thermal import Building
from thermal.pilot.building import pilot_building

SEED, DX, PRICE = 0, 0.5, 1.0  # -, m, currency/K/h
SEASONS = {"winter": "2023-01-09", "spring": "2023-04-17", "summer": "2023-07-17"}
RULES = ("schedule", "reset", "guideline36")
CONTROLLERS = (*RULES, "mpc", "bound")
NAMES = {"schedule": "fixed schedule", "reset": "outdoor reset", "guideline36": "Guideline 36",
         "mpc": "optimal control", "bound": "perfect bound"}  # fmt: skip
COLUMNS = (
    "week", "controller", "cost, USD", "discomfort, K h", "energy, kWh/m2", "peak, W/m2", "cost with discomfort, USD",
    "share of the perfect-forecast savings",
)  # fmt: skip


@cache
def building(floor_area: float, zones: int) -> Building:
    """Draw the pilot, or a smaller one."""
    return pilot_building(SEED, floor_area=floor_area, zones=zones)


@cache
def study(season: str, days: float, floor_area: float, zones: int, dx: float, price: float) -> Study:
    """Put a stretch of a season together."""
    start = SEASONS[season]
    end = (pd.Timestamp(start) + pd.Timedelta(days=days)).isoformat()
    settings = StudySettings(
        dx=dx, kind="random", noise=SensorNoise(), errors=DAY_AHEAD_ERRORS, comfort_price=price, seed=SEED
    )
    weather = pilot_weather(SEED, start, math.ceil(days) + 1.0)
    return make_study(building(floor_area, zones), weather, start, end, settings)


def run(season: str, controller: str, options: argparse.Namespace) -> dict[str, Any]:
    """Run a controller through a stretch of a season."""
    made = study(season, options.days, options.floor_area, options.zones, options.dx, options.price)
    begin = time.process_time()
    found = run_controller(made, controller)
    kpis = found.kpis
    return {
        "season": season, "controller": controller, "days": options.days, "zones": options.zones, "dx": options.dx,
        "price": options.price, "cost": found.cost, "tdis": kpis.tdis_tot, "energy": kpis.ener_tot,
        "peak": 1e3 * (kpis.pele_tot or 0.0), "emissions": kpis.emis_tot, "floor_area": kpis.floor_area,
        "objective": found.cost + options.price * options.zones * kpis.tdis_tot,
        "sources": dict(found.sources), "prediction": prediction_errors(found),
        "controller_seconds": 0.0 if kpis.time_rat is None else kpis.time_rat * made.settings.control_step,
        "cpu": time.process_time() - begin,
    }  # fmt: skip


def gather(options: argparse.Namespace) -> list[dict[str, Any]]:
    """Run what has not been run, and read all that was asked for."""
    folder = options.out / "runs"
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for season in options.seasons:
        for controller in options.controllers:
            file = folder / f"{season}_{controller}_{options.days:g}d_{options.zones}z_{options.price:g}.json"
            if not file.exists() and not options.no_run:
                keep(file, run(season, controller, options))
                print(f"{season} {controller}: done", flush=True)
            if file.exists():
                rows.append(json.loads(file.read_text(encoding="utf-8")))
        study.cache_clear()
    return rows


def shares(rows: list[dict[str, Any]]) -> dict[tuple[str, str], float]:
    """Share of the way from the best rule to the bound, by season and controller, cost with discomfort."""
    found = {}
    for season in {row["season"] for row in rows}:
        by = {row["controller"]: row["objective"] for row in rows if row["season"] == season}
        rules = [by[name] for name in RULES if name in by]
        if rules and "bound" in by and min(rules) > by["bound"]:
            best = min(rules)
            found |= {(season, name): (best - value) / (best - by["bound"]) for name, value in by.items()}
    return found


def table(rows: list[dict[str, Any]]) -> str:
    """Lay all runs out."""
    way = shares(rows)
    lines = [
        [
            row["season"] if row["controller"] == rows[0]["controller"] else "", NAMES[row["controller"]],
            f"{row['cost']:.1f}", f"{row['tdis']:.3f}", f"{row['energy']:.3f}", f"{row['peak']:.1f}",
            f"{row['objective']:.1f}",
            f"{way[row['season'], row['controller']]:.0%}"
            if row["controller"] in ("mpc", "bound") and (row["season"], row["controller"]) in way else "",
        ]
        for row in rows
    ]  # fmt: skip
    return markdown(COLUMNS, lines) + "\n" + note(rows[0])


def note(row: dict[str, Any]) -> str:
    """Say what was run."""
    days = "a week" if row["days"] == 7 else "a day" if row["days"] == 1 else f"{row['days']:g} days"
    return (
        f"{row['zones']} zones, {row['floor_area']:,.0f} m2, {days} a season from a Monday; discomfort at "
        f"{row['price']:g} USD a zone's kelvin hour.\n"
    )


def short(rows: list[dict[str, Any]]) -> str:
    """Lay the savings out for the README."""
    by = {(row["season"], row["controller"]): row for row in rows}
    lines = []
    for season in dict.fromkeys(row["season"] for row in rows):
        here = {name: by[season, name] for name in CONTROLLERS if (season, name) in by}
        if "mpc" not in here:
            continue
        cells = [f"{here[name]['cost']:.0f} ({here[name]['tdis']:.2f})" if name in here else "" for name in CONTROLLERS]
        way = shares(rows).get((season, "mpc"))
        lines.append([season, *cells, "" if way is None else f"{way:.0%}"])
    names = (NAMES[name] for name in CONTROLLERS)
    head = ("cost, USD (discomfort, K h)", *names, "share of the perfect-forecast savings")
    return markdown(head, lines) + "\n" + note(rows[0])


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--days", type=float, default=7.0, help="length of each season's run, in quarters of a day")
    parser.add_argument("--seasons", nargs="+", choices=SEASONS, default=list(SEASONS))
    parser.add_argument("--controllers", nargs="+", choices=CONTROLLERS, default=list(CONTROLLERS))
    parser.add_argument("--zones", type=int, default=123)
    parser.add_argument("--floor-area", type=float, default=6317.0)
    parser.add_argument("--dx", type=float, default=DX, help="distance between control volumes [m]")
    parser.add_argument("--price", type=float, default=PRICE, help="of discomfort [currency/K/h]")
    parser.add_argument("--no-run", action="store_true", help="only lay out what has been run")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    return parser.parse_args(arguments)


def main(arguments: list[str] | None = None) -> list[dict[str, Any]]:
    """Run, and write the tables."""
    use_one_thread()
    options = parse(arguments)
    rows = gather(options)
    if not rows:
        raise SystemExit("nothing has been run yet")
    text = table(rows)
    write(options.out, "mpc_closed_loop", text, {"runs": rows}, options.publish)
    if options.publish:
        publish("mpc_closed_loop_short", short(rows))
    print(text)
    return rows


if __name__ == "__main__":
    main()
