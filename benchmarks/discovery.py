"""Points of a network named in three habits, matched to the devices of a generated office: how many are right.

Names are generated (`_network_names.py`): short names of control contractors, words of integrators under the device's
name, and opaque objects with a description and sometimes without a unit; one point in seven or eight is none of the
library's. The three habits and the library's abbreviations were written by the same people: real sites differ more
between each other than these do. Three abbreviations
(disch, sup, rht) were added after a look at seeds 0 to 3, which hold the same words as all others.

Run: ``python benchmarks/discovery.py --seeds 10-29 --out results/discovery``; some ten seconds.
Writes ``discovery.json`` and ``.md``.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from _network_names import HABITS, network_points
from _seeds import seed_range
from _table import markdown, write

from thermal.pilot.building import pilot_building
from thermal.plan.discovery import propose


def main() -> None:
    """Run the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=seed_range, default=seed_range("10-29"))
    parser.add_argument("--publish", action="store_true")
    parser.add_argument("--out", type=Path, default=Path("results/discovery"))
    arguments = parser.parse_args()
    counts = {habit: Counter[str]() for habit in HABITS}
    wrong = []
    for seed in arguments.seeds:
        building = pilot_building(seed, floor_area=600.0, zones=12, name="office")
        for habit in HABITS:
            listed = list(network_points(building, habit, seed))
            truth = {point.address: what for point, what in listed}
            for found in propose([point for point, _ in listed], building).points:
                entity, point = truth[found.address]
                right = (found.entity, found.point) == (entity, point)
                what = "others" if not entity else "points"
                counts[habit][what] += 1
                counts[habit][f"{what} {found.status}"] += 1
                counts[habit][f"{what} right, {found.status}"] += right
                if found.status == "matched" and not right:
                    seen = f"{found.device} | {found.name} | {found.description}"
                    wrong.append(f"seed {seed}, {habit}: {seen} -> {found.entity}/{found.point}")
    rows = [[habit, *_row(c)] for habit, c in counts.items()]
    header = ["habit", "points", "right", "right, called doubtful", "wrong", "wrong, called doubtful", "unmatched",
              "other points", "taken for one", "called doubtful"]  # fmt: skip
    told = f"Seeds {arguments.seeds[0]} to {arguments.seeds[-1]}. "
    told += "Matched and wrong:\n\n" + "".join(f"- {w}\n" for w in wrong) if wrong else "None is matched and wrong.\n"
    text = f"{markdown(header, rows)}\n{told}"
    data = {"seeds": [*arguments.seeds], "counts": {h: dict(c) for h, c in counts.items()}, "wrong": wrong}
    write(arguments.out, "discovery", text, data, arguments.publish)
    print(text)


def _row(c: Counter[str]) -> list[str | int]:
    """Cells of a habit."""
    right, doubtful = c["points right, matched"], c["points right, doubtful"]
    shares = [right, doubtful, c["points matched"] - right, c["points doubtful"] - doubtful, c["points unmatched"]]
    told = [_share(part, c["points"]) for part in shares]
    return [c["points"], *told, c["others"], c["others matched"], c["others doubtful"]]


def _share(part: int, whole: int) -> str:
    return f"{100.0 * part / max(1, whole):.1f} %"


if __name__ == "__main__":
    main()
