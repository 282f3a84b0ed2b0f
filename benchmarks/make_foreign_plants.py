"""Plants to develop on: EnergyPlus inputs made from its own objects, prices, and a ``plant.yaml`` that loads.

Run: ``python benchmarks/make_foreign_plants.py --out results/foreign_plants/plants`` with the extra ``[energyplus]``.
Then ``load_plant("results/foreign_plants/plants/house/plant.yaml")``, see ``docs/plant.md``.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from foreign_models.plants import PLANTS, write_plant

from mpc.errors import EnergyPlusError


def main() -> int:
    """Write the folders."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("results/foreign_plants/plants"), help="folder of the plants")
    parser.add_argument("--plants", nargs="+", default=list(PLANTS), choices=list(PLANTS))
    options = parser.parse_args()
    try:
        for name in options.plants:
            print(write_plant(name, options.out))
    except EnergyPlusError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
