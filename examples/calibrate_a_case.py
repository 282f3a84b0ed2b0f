"""Calibrate a case folder and say what the data determine."""

import sys

from calibration import CalibrationResult, CalibrationSettings, calibrate
from thermal import load_bundled_case, load_case


def run(path: str | None = None, dx: float | None = None) -> CalibrationResult:
    """Calibrate a case folder, or the bundled case when no path is given."""
    case = load_case(path) if path else load_bundled_case()
    return calibrate(case, settings=CalibrationSettings(dx=dx))


if __name__ == "__main__":
    result = run(sys.argv[1] if len(sys.argv) > 1 else None)
    before, after = result.uncalibrated["held_out"].metrics, result.calibrated["held_out"].metrics
    print(f"held-out {result.horizon} error: {before.mae:.3f} K before, {after.mae:.3f} K after")
    for parameter in result.parameters:
        known = "determined" if parameter.identifiable else "not determined by the data"
        print(f"{parameter.name:40s} {parameter.value:10.4g} {parameter.unit:10s} {known}")
