"""A simulated building to operate: a BACnet/IP device of two zones, and the files of a site for it.

Run: ``python benchmarks/simulated_site.py FOLDER --database postgresql:///building``, and in another terminal
``buildingmpc operate FOLDER/site.yaml``. Ctrl-C ends it. Needs ``pip install rusty-bacnet``, the device's stack, which
is not the client's.
"""

from __future__ import annotations

import argparse
import signal
from pathlib import Path

import pandas as pd
from _bacnet_site import SimulatedSite

#: The building runs as many times faster than real time, so that something happens.
RATE = 10.0

ZONES = ("north", "south")

PLANT = """format: 1
name: hall
location: {latitude: 50.8, longitude: 4.35, elevation: 100.0, timezone: Europe/Brussels}
plant: {kind: site}
control_step: 300.0
period: {start: 2026-01-12 00:00, days: 1}
zones:
  north: {temperature: "analog-input 2", floor_area: 60.0, comfort: {lower: 20 degC, upper: 24 degC}}
  south: {temperature: "analog-input 3", floor_area: 60.0, comfort: {lower: 20 degC, upper: 24 degC}}
actuators:
  north/zone_air_heating_temperature_setpoint: {signal: "analog-value 1", range: [16 degC, 26 degC]}
  south/zone_air_heating_temperature_setpoint: {signal: "analog-value 2", range: [16 degC, 26 degC]}
prices: {electricity: 0.2, currency: EUR}
series: [weather.csv]
weather: {outside_air_temperature_sensor: outdoor}
forecast: {hours: 12.0}
"""

SITE = """format: 1
name: hall
plant: plant.yaml
controller: full_speed
collect: 10.0
database: {{address: '{database}'}}
page: {{port: {port}}}
connections:
  hall: {{kind: bacnet, address: '{device}'}}
points:
  weather_station/outside_air_temperature_sensor: {{connection: hall, at: "analog-input,1", unit: degC}}
  north/zone_air_temperature_sensor: {{connection: hall, at: "analog-input,2", unit: degC}}
  south/zone_air_temperature_sensor: {{connection: hall, at: "analog-input,3", unit: degC}}
  north/zone_air_heating_temperature_setpoint:
    {{connection: hall, at: "analog-value,1", unit: degC, mode: advise, range: [18 degC, 23 degC], rate: 2.0,
     release: relinquish}}
  south/zone_air_heating_temperature_setpoint:
    {{connection: hall, at: "analog-value,2", unit: degC, range: [18 degC, 23 degC], rate: 2.0, release: relinquish}}
"""


def write_site(folder: Path, device: str, database: str, port: int = 8080) -> Path:
    """Write plant.yaml, site.yaml and a forecast of the weather; return the site's file."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "plant.yaml").write_text(PLANT, encoding="utf-8")
    site = folder / "site.yaml"
    site.write_text(SITE.format(database=database, port=port, device=device), encoding="utf-8")
    stamps = pd.date_range(pd.Timestamp.now(tz="UTC").floor("h") - pd.Timedelta(days=1), periods=24 * 31, freq="1h")
    rows = "".join(f"{stamp:%Y-%m-%d %H:%M}+00:00,275.15\n" for stamp in stamps)
    (folder / "weather.csv").write_text("timestamp,outdoor\n" + rows, encoding="utf-8")
    return site


def main() -> None:
    """Run until it is ended."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--database", default="postgresql:///building")
    parser.add_argument("--port", type=int, default=8080, help="of the page")
    options = parser.parse_args()
    building = SimulatedSite(RATE)
    print(write_site(options.folder, building.start(), options.database, options.port), flush=True)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        signal.pause()
    except KeyboardInterrupt:
        building.stop()


if __name__ == "__main__":
    main()
