"""Control of plants that the library was not made for, beside their own control, rules and peers.

The plants are those of `make_foreign_plants.py`, in EnergyPlus: a house with a heated floor and an air-to-water heat
pump, flats with electric baseboards, an office with fan coils, a shop with a unitary heat pump. Each runs two weeks in
the coldest and in a typical period of its place, after a week under its own control, at an hourly price.

- *own*: the plant's own control;
- *rule*: without a model: machines at full speed on and off, thermostats at the lower edge of the band, both with
  set-back and a lead of 3 h; *long rule*: with a lead of 6 h;
- *pi*: a PI to the speed of a machine that has one;
- *mpc*: the library's, after an experiment of two weeks beside the coldest period (``identify``, then ``control``),
  with weather forecasts that are wrong as day-ahead ones are; *mpc perfect*: the same with the weather that comes;
- *mpc price P*, *mpc edge B* (``--prices``, ``--edges``): as *mpc*, but a kelvin hour below the band counts P rather
  than 10, or the lower edges are moved by B: what optimal control costs at the comfort of a rule;
- *do-mpc*: as *mpc*, every problem solved by do-mpc (extra ``[benchmarks]``), some ten minutes of CPU a run;
- *sac*: a policy trained on the model that *mpc* has (extra ``[rl]``), of a plant whose machine is run whole.

Run: ``python benchmarks/foreign_plants.py --out results/foreign_plants [--publish]`` with the extra ``[energyplus]``.
What is finished is kept, one file a run, and the same command goes on from there; ``--finished`` lays out what there is
so far. Writes ``foreign_plants.json`` and ``.md``; with ``--publish`` also the table in ``docs/foreign_plants.md``.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

from _code import code
from _foreign_runs import CONTROLLERS, run
from _table import keep, markdown, write
from foreign_models.plants import PLANTS

from mpc.errors import EnergyPlusError, MpcError

PERIODS = ("coldest", "hottest", "typical")
TITLES = {
    "own": "own control", "rule": "full speed or set-back, lead 3 h", "long rule": "the same, lead 6 h", "pi": "PI",
    "mpc": "MPC, identified", "mpc perfect": "the same, weather known",
    "do-mpc": "the same, solved by do-mpc", "sac": "SAC, trained on the same model",
}  # fmt: skip
_TOLD = {
    "mpc price": "MPC, a kelvin hour below counts {:g} EUR", "mpc edge": "MPC, lower edge moved by {:g} K",
}  # fmt: skip
COLUMNS = ("plant", "period", "controller", "cost, EUR/m²", "against own, %", "below the band, K h a zone",
           "above, K h a zone", "time below, h a zone", "starts a day", "CPU, s")  # fmt: skip


def wanted(name: str, controllers: list[str]) -> list[str]:
    """List the controllers that a plant can have: PI and policy need a machine with a speed."""
    told = PLANTS[name].description()
    has_speed = any(entry.get("kind") == "modulating" for entry in told["actuators"].values())
    return [each for each in controllers if each not in ("pi", "sac") or has_speed]


def title_of(controller: str) -> str:
    """Words of a controller."""
    kind, _, told = controller.rpartition(" ")
    return _TOLD[kind].format(float(told)) if kind in _TOLD else TITLES[controller]


def file_of(name: str, which: str, controller: str, out: Path) -> Path:
    """File of a run."""
    return out / name / f"{which}_{controller.replace(' ', '_')}.json"


def perform(name: str, which: str, controller: str, out: Path) -> dict[str, Any]:
    """Do a run, or read what came of it; a failure is a result."""
    path = file_of(name, which, controller, out)
    if path.exists():
        return dict(json.loads(path.read_text(encoding="utf-8")))
    data: dict[str, Any] = {"plant": name, "period": which, "controller": controller, "code": code()}
    try:
        data |= run(name, which, controller, out)
    except EnergyPlusError:
        raise
    except MpcError as error:
        data["failure"] = str(error)
    keep(path, data)
    return data


def table_of(runs: list[dict[str, Any]]) -> str:
    """Lay the results out, failures with their reason."""
    own = {(r["plant"], r["period"]): r["cost"] for r in runs if r["controller"] == "own" and "cost" in r}
    rows = []
    for row in runs:
        head = (row["plant"], row["period"], title_of(row["controller"]))
        if "failure" in row:
            rows.append((*head, f"failed: {row['failure']}", *[""] * (len(COLUMNS) - 4)))
            continue
        hours = row["hours_above" if PLANTS[row["plant"]].cooled else "hours_below"]
        base, starts = own.get((row["plant"], row["period"]), math.nan), row["starts_a_day"]
        rows.append((
            *head, f"{row['cost']:.3f}", f"{100.0 * (row['cost'] / base - 1.0):+.1f}", f"{row['below']:.2f}",
            f"{row['above']:.2f}", f"{hours:.1f}", "-" if not starts else f"{starts:.1f}",
            f"{row['cpu_seconds']:.0f}" if row["cpu_seconds"] >= 10.0 else f"{row['cpu_seconds']:.1f}",
        ))  # fmt: skip
    return markdown(COLUMNS, rows)


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/foreign_plants"))
    parser.add_argument("--plants", nargs="+", default=list(PLANTS), choices=list(PLANTS))
    parser.add_argument("--periods", nargs="+", default=list(PERIODS), choices=list(PERIODS))
    parser.add_argument("--controllers", nargs="+", default=list(CONTROLLERS), choices=list(CONTROLLERS))
    parser.add_argument("--prices", nargs="+", type=float, default=[], help="of discomfort, for rows beside [EUR/K/h]")
    parser.add_argument("--edges", nargs="+", type=float, default=[], help="moves of the lower edges, the same [K]")
    parser.add_argument("--finished", action="store_true", help="lay out the runs that are there, without new ones")
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args(arguments)
    told = [f"mpc price {p:g}" for p in options.prices] + [f"mpc edge {b:g}" for b in options.edges]
    runs = []
    try:
        for name in options.plants:
            for which in (period for period in options.periods if period in PLANTS[name].starts):
                for controller in wanted(name, options.controllers + told):
                    if options.finished and not file_of(name, which, controller, options.out).exists():
                        continue
                    runs.append(perform(name, which, controller, options.out))
                    cost = runs[-1].get("cost", math.nan)
                    print(f"{name} {which} {controller}: {cost:.3f} EUR/m2", flush=True)
    except EnergyPlusError as error:
        print(error, file=sys.stderr)
        return 1
    table = table_of(runs)
    write(options.out, "foreign_plants", table, runs, options.publish)
    print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
