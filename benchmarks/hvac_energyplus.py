"""Our plant beside EnergyPlus' in its reference offices, a winter and a summer week in Chicago.

EnergyPlus runs the Medium Office (air handlers with direct expansion and gas coils) and the Large Office (hot-water
loop with reheat and heating coils) by themselves. Our devices get its sizes, and each week its zones' air: return air
temperatures and humidities, air flows, setpoints, weather, and the discharge temperatures that the terminals hold. They
give mixing, coil loads, compressor, fans, hot water, pump and fuel. Energies that neither model counts more than 1 kWh
of are left out.

Run: ``python benchmarks/hvac_energyplus.py --out results/hvac [--publish]`` with the extra ``[energyplus]``; a minute
on one core. Writes ``hvac_energyplus.json`` and ``.md``; with ``--publish`` also the table in ``hvac.md``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from _hvac_offices import Compared, air_handler_outputs, compare_large, compare_medium, loop_outputs
from _hvac_reference import WEATHER, ReferenceRunError, reference_weeks
from _table import markdown, write

LEAST = 1.0  # kWh: energies below this on both sides say nothing
FLOORS = ("bot", "mid", "top")
BOXES = ["Basement", *(f"Core_{'bottom' if f == 'bot' else f}" for f in FLOORS),
         *(f"Perimeter_{f}_ZN_{k}" for f in FLOORS for k in (1, 2, 3, 4))]  # fmt: skip


def compared() -> list[tuple[str, Compared]]:
    """Run both buildings and compare."""
    medium = reference_weeks("RefBldgMediumOfficeNew2004_Chicago.idf", air_handler_outputs((1, 2, 3)))
    outputs = [*air_handler_outputs((1, 2, 3, 5)), *loop_outputs(BOXES)]
    large = reference_weeks("RefBldgLargeOfficeNew2004_Chicago.idf", outputs)
    found = [("Medium Office", row) for row in compare_medium(medium)]
    found += [("Large Office", row) for row in compare_large(large, BOXES)]
    return [(building, row) for building, row in found if max(row.reference, row.ours) > LEAST]


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/hvac"))
    parser.add_argument("--publish", action="store_true", help="replace the table between its marks")
    options = parser.parse_args()
    try:
        rows = compared()
    except ReferenceRunError as error:
        print(error, file=sys.stderr)
        return 1
    cells = [
        (building, row.season, row.quantity, f"{row.reference:.0f}", f"{row.ours:.0f}", f"{_percent(row):+.1f} %")
        for building, row in rows
    ]
    table = markdown(("building", "week", "energy", "EnergyPlus, kWh", "ours, kWh", "difference"), cells)
    data = {
        "weather": WEATHER,
        "rows": [{"building": b, **row._asdict(), "difference_percent": _percent(row)} for b, row in rows],
        "largest_difference_percent": max(abs(_percent(row)) for _, row in rows),
    }
    write(options.out, "hvac_energyplus", table, data, options.publish)
    print(table)
    return 0


def _percent(row: Compared) -> float:
    return 100.0 * (row.ours - row.reference) / max(row.reference, LEAST)


if __name__ == "__main__":
    sys.exit(main())
