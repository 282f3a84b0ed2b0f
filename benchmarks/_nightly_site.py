"""A site whose historian has weeks of a simulated office, as a collector would have kept them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from mpc.live.historian.samples import Samples
from mpc.live.historian.store import Historian
from mpc.live.nightly import Nightly
from mpc.live.site import Site
from thermal import Case, save_case


def make_site(folder: Path, case: Case, address: str, schema: str, reference_days: int) -> Nightly:
    """Write the files of a site, fill its historian, and give its nightly evaluation."""
    save_case(case, folder / "case")
    zones = [d.name for d in case.building.devices if d.zone]
    frame, place = case.telemetry.frame, case.building.location
    plant = {
        "format": 1, "name": case.building.name, "plant": {"kind": "site"}, "control_step": 900.0,
        "location": {"latitude": place.latitude, "longitude": place.longitude, "elevation": place.elevation,
                     "timezone": place.timezone},
        "period": {"start": f"{case.stamps[0]:%Y-%m-%d} 00:00", "days": 1},
        "zones": {zone: {"temperature": "x", "floor_area": 20.0} for zone in zones},
        "actuators": {f"{zones[0]}/zone_air_heating_temperature_setpoint": {
            "signal": "y", "range": ["16 degC", "26 degC"]}},
    }  # fmt: skip
    site = {
        "format": 1, "name": case.building.name, "plant": "plant.yaml", "controller": "full_speed",
        "database": {"address": address, "schema": schema},
        "connections": {"office": {"kind": "bacnet", "address": "127.0.0.1:47809"}},
        "points": {str(name): {"connection": "office", "at": f"analog-input,{k}"} for k, name in enumerate(frame)},
        "nightly": {"building": "case", "begin": f"{case.stamps[0]:%Y-%m-%d}", "reference_days": reference_days,
                    "step": case.step},
    }  # fmt: skip
    for name, content in (("plant.yaml", plant), ("site.yaml", site)):
        (folder / name).write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    with Historian(address, schema) as historian:
        historian.migrate()
        seconds = np.array([stamp.timestamp() for stamp in pd.DatetimeIndex(frame.index)])
        for name in frame:
            values = frame[name].to_numpy(dtype=float)
            historian.write(Samples([str(name)] * len(values), seconds, values))
    return Nightly(Site(folder / "site.yaml"))
