"""The pictures of the README, from a calibration of the bundled case.

Run: ``python benchmarks/readme_pictures.py``. Writes ``readme_growth.svg`` and ``readme_map.svg`` into ``docs/images``.
"""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np

from calibration import calibrate
from mpc.reports.figures.errors import error_growth
from mpc.reports.figures.plan import floor_maps
from thermal import FloorPlans, load_bundled_case

IMAGES = Path(__file__).parents[1] / "docs" / "images"


def main() -> None:
    """Calibrate the bundled case and draw how its error grows, and where it is."""
    case = load_bundled_case()
    plans = case.building.geometry
    if not isinstance(plans, FloorPlans):
        raise SystemExit("the bundled case has no floor plans")
    result = calibrate(case)
    before, after = result.uncalibrated["held_out"], result.calibrated["held_out"]
    error = np.nanmean(after.predictions[0].error, axis=0)
    pictures = {
        "readme_growth": error_growth({"held out": {"before": before, "after": after}})[0],
        "readme_map": floor_maps(plans, case.building.orientation, after.zones, error, "mean error 6 hours ahead")[0],
    }
    for name, picture in pictures.items():
        (IMAGES / f"{name}.svg").write_bytes(base64.b64decode(picture.source.split(",", 1)[1]))


if __name__ == "__main__":
    main()
