"""Calibration beside the paper's own method: errors on its three intervals and held out, evaluations, seconds, bounds.

Every case of ``--cases`` that has floor plans is calibrated seven ways: not at all; by the paper's 100 evaluations of
its metric over its eight ranges, in its structure of the model (air and walls) and in ours (slabs, furniture and a
radiant node beside them), each by a plain search and by a Bayesian one; by `calibration.calibrate` on the same six
hours; and by it on the first two thirds of the telemetry. The plain search is the paper's row: it says "100 iterations"
and nothing of how. `_paper_search.py` has searches, ranges and how its parameters map to ours, `_calibration_study.py`
the intervals and what is shared, so that methods differ in nothing but method.

Run: ``python benchmarks/calibration.py --out results/calibration [--cases CASES] [--publish]``; some three minutes a
case on a core. Each case is one file of ``cases/`` in ``--out`` as soon as it is done: run the same command again after
an interruption and it goes on where it was.

Errors of the first version, beside these, are read from ``first_accuracy.json``: the table of ``baseline_accuracy.py``
in the README of the commit that it names, written by ``--first-version COMMIT``.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path


def hand_on_to_the_package() -> None:
    """Put the package ``calibration`` in this script's place.

    Python looks for modules beside a script first, so any script of this folder that imports the package gets here.
    """
    beside, path = Path(__file__).resolve().parent, sys.path
    sys.path = [p for p in path if Path(p).resolve() != beside]
    del sys.modules["calibration"]
    try:
        importlib.import_module("calibration")
    finally:
        sys.path = path


if __name__ == "calibration":
    hand_on_to_the_package()
elif __name__ == "__main__":
    from _calibration_command import main

    main(str(__doc__))
