"""Make a case of the size of the paper's pilot building, and a small one of the same kind."""

import sys

from thermal import Case
from thermal.pilot.building import PilotSettings, generate_pilot


def small(path: str) -> Case:
    """Generate an office of 600 m2 with 12 zones and two days of telemetry."""
    return generate_pilot(path, PilotSettings(floor_area=600.0, zones=12, days=2.0, cell_size=1.0), seed=1)


if __name__ == "__main__":
    case = generate_pilot(sys.argv[1] if len(sys.argv) > 1 else "pilot")
    print(f"{case.building.name}: {len(case.building.zone_names)} zones, {len(case.building.devices)} devices")
