"""Our components beside EnergyPlus' of the same kind over a year in Chicago, one by one.

EnergyPlus runs three models of ours: plant components on a loop of their own under a load that goes with the weather,
boxes of 100 m2 each heated and cooled by one kind of unit, and a box in the sun with a pane a side. Ours get what
EnergyPlus' component meets in each quarter of an hour - weather, zone air, water, the load or the share of time that it
runs - and the same ratings and curves. What is compared is the energy that follows over the year. Thermostats and the
buildings themselves are not.

Run: ``python benchmarks/components_energyplus.py --out results/components [--publish]`` with the extra
``[energyplus]``; a minute on one core. Writes ``components_energyplus.json`` and ``.md``; with ``--publish`` also the
table in ``hvac.md``.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import _component_plants
import _component_sun
import _component_zones
from _component_models import Row
from _hvac_reference import WEATHER, ReferenceRunError
from _table import markdown, write


def compared() -> list[Row]:
    """Run EnergyPlus' models and ours."""
    found = []
    for part in (_component_plants, _component_zones, _component_sun):
        with tempfile.TemporaryDirectory(prefix="energyplus_") as folder:
            found += part.compared(Path(folder))
    return found


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/components"))
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    try:
        rows = compared()
    except ReferenceRunError as error:
        print(error, file=sys.stderr)
        return 1
    cells = [
        (r.component, f"`{r.model}`", r.energy, f"{r.reference:.0f}", f"{r.ours:.0f}", f"{_percent(r):+.1f} %")
        for r in rows
    ]
    table = markdown(("component", "EnergyPlus object", "energy", "EnergyPlus, kWh", "ours, kWh", "difference"), cells)
    worst: dict[str, float] = {}
    for r in rows:
        worst[r.component] = max(worst.get(r.component, 0.0), abs(_percent(r)))
    data = {
        "weather": WEATHER,
        "rows": [{**r._asdict(), "difference_percent": _percent(r)} for r in rows],
        "largest_difference_percent": worst,
        "components_within_5_percent": sum(value <= 5.0 for value in worst.values()),
    }
    write(options.out, "components_energyplus", table, data, options.publish)
    print(table)
    return 0


def _percent(r: Row) -> float:
    return 100.0 * (r.ours / r.reference - 1.0)


if __name__ == "__main__":
    sys.exit(main())
