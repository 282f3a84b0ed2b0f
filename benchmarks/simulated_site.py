"""A simulated building to operate: a BACnet/IP device, and the files of a site for it.

Run: ``python benchmarks/simulated_site.py FOLDER --database postgresql:///building``, and in another terminal
``buildingmpc operate FOLDER/site.yaml``. Ctrl-C ends it. Needs ``pip install rusty-bacnet``, the device's stack, which
is not the client's. The building is a hall of two zones; with ``--plant plant.yaml`` it is what that describes, such
as a model of EnergyPlus or a test case of a BOPTEST server, until its period is over.
"""

from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path
from typing import Any

import pandas as pd
from _bacnet_site import SimulatedSite
from _plant_site import PlantSite
from _site_files import write_site

from mpc.errors import MpcError

#: The hall runs as many times faster than real time, so that something happens; the clock of a described plant's site.
RATE, CLOCK_RATE = 10.0, 60.0

ZONES = ("north", "south")

PLANT: dict[str, Any] = {
    "format": 1, "name": "hall",
    "location": {"latitude": 50.8, "longitude": 4.35, "elevation": 100.0, "timezone": "Europe/Brussels"},
    "plant": {"kind": "site"},
    "control_step": 300.0,
    "period": {"start": "2026-01-12 00:00", "days": 1},
    "zones": {
        zone: {"temperature": f"analog-input {k}", "floor_area": 60.0,
               "comfort": {"lower": "20 degC", "upper": "24 degC"}}
        for k, zone in enumerate(ZONES, 2)
    },
    "actuators": {
        f"{zone}/zone_air_heating_temperature_setpoint":
            {"signal": f"analog-value {k}", "range": ["16 degC", "26 degC"]}
        for k, zone in enumerate(ZONES, 1)
    },
    "prices": {"electricity": 0.2, "currency": "EUR"},
    "series": ["weather.csv"],
    "weather": {"outside_air_temperature_sensor": "outdoor"},
    "forecast": {"hours": 12.0},
}  # fmt: skip

_WRITTEN = {"range": ["18 degC", "23 degC"], "rate": 2.0, "release": "relinquish"}
POINTS: dict[str, Any] = {
    "weather_station/outside_air_temperature_sensor": {"at": "analog-input,1", "unit": "degC"},
    "north/zone_air_temperature_sensor": {"at": "analog-input,2", "unit": "degC"},
    "south/zone_air_temperature_sensor": {"at": "analog-input,3", "unit": "degC"},
    "north/heating_power_sensor": {"at": "analog-input,4", "unit": "W"},
    "south/heating_power_sensor": {"at": "analog-input,5", "unit": "W"},
    "north/zone_air_heating_temperature_setpoint":
        {"at": "analog-value,1", "unit": "degC", "mode": "advise"} | _WRITTEN,
    "south/zone_air_heating_temperature_setpoint": {"at": "analog-value,2", "unit": "degC"} | _WRITTEN,
}  # fmt: skip


def hall(folder: Path, device: str, database: str, port: int) -> Path:
    """Write the files of the hall's site, with a forecast of the weather; return the site's file."""
    site = write_site(
        folder, PLANT, POINTS, device, collect=10.0, database={"address": database}, page={"port": port}
    )  # fmt: skip
    stamps = pd.date_range(pd.Timestamp.now(tz="UTC").floor("h") - pd.Timedelta(days=1), periods=24 * 31, freq="1h")
    rows = "".join(f"{stamp:%Y-%m-%d %H:%M}+00:00,275.15\n" for stamp in stamps)
    (folder / "weather.csv").write_text("timestamp,outdoor\n" + rows, encoding="utf-8")
    return site


def main() -> int:
    """Run until it is ended, or a plant's period is over."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--database", default="postgresql:///building")
    parser.add_argument("--port", type=int, default=8080, help="of the page")
    parser.add_argument("--plant", help="a plant.yaml, or a name of a ready description; the hall by default")
    parser.add_argument("--at", help="a unit, or the address of a BOPTEST server, in the place of the plant's own")
    parser.add_argument("--rate", type=float, default=CLOCK_RATE, help="of the clock of the plant's site")
    parser.add_argument("--model", type=Path, help="folder of buildingmpc identify, for mpc; else the rule full_speed")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    building: SimulatedSite | PlantSite | None = None
    try:
        if options.plant is None:
            building = SimulatedSite(RATE)
            site = hall(options.folder, building.start(), options.database, options.port)
        else:
            building = PlantSite.described(options.plant, options.folder, options.rate, options.at)
            site = building.begin(options.database, options.port, options.model)
        print(site, flush=True)
        building.wait()
    except KeyboardInterrupt:
        pass
    except MpcError as error:
        print(error, file=sys.stderr)
        return 2
    finally:
        if building is not None:
            building.stop()
    if isinstance(building, PlantSite):
        told = f"a step began {building.late:.0f} s late at most"
        print(f"ended after {building.hours:.1f} h; {told}, by the site's clock")
    return 0


if __name__ == "__main__":
    sys.exit(main())
