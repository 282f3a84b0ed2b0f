"""Files of a simulated site: site.yaml, a plant.yaml of kind `site`, and tables of forecasts that go on with it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from mpc.adapters.described.schema import Period, PlantFile
from mpc.scenario.forecast import Forecast
from mpc.scenario.gains import InternalGains
from mpc.scenario.weather import WEATHER_POINTS

#: Tables of what lies on straight lines between its values, and of what holds until the next one.
WEATHER, OTHER = "weather.csv", "forecasts.csv"

#: Time before now that tables keep [s].
KEPT = 7200.0

#: Control steps by which forecasts reach further than is asked for: a plan is made of those of the step before, too.
AHEAD = 4


def write_site(
    folder: Path, plant: Mapping[str, Any], points: Mapping[str, Any], device: str, **more: Any
) -> Path:
    """Write plant.yaml and site.yaml of a building behind one device; return the site's file.

    Parameters
    ----------
    folder : Path
        Made where it is not there.
    plant : mapping
        The plant.yaml.
    points : mapping
        Of the site's file, without their connection.
    device : str
        Address of the device.
    more
        Other keys of the site's file.
    """
    folder.mkdir(parents=True, exist_ok=True)
    link = {"kind": "bacnet", "address": device}
    site = {"format": 1, "name": plant["name"], "plant": "plant.yaml", "controller": "full_speed"} | more | {
        "connections": {"hall": link}, "points": {name: {"connection": "hall", **one} for name, one in points.items()}
    }  # fmt: skip
    for name, content in (("plant.yaml", plant), ("site.yaml", site)):
        _whole(folder / name, yaml.safe_dump(content, sort_keys=False, width=120, default_flow_style=None))
    return folder / "site.yaml"


def described_site(
    file: PlantFile, points: Mapping[str, str], forecast: pd.DataFrame, start: pd.Timestamp
) -> dict[str, Any]:
    """Describe a plant as a real building: the same zones, actuators and prices, signals of a device, tables of series.

    Parameters
    ----------
    file : PlantFile
        Description of the plant.
    points : mapping of str to str
        Object of the device by ``ENTITY/POINT``.
    forecast : DataFrame
        A first forecast, whose columns the tables have.
    start : Timestamp
        When it begins, local.
    """
    # its unions are told apart by functions that know what a file holds, not what was read: they would warn
    told = file.model_dump(mode="json", exclude_defaults=True, warnings=False)
    for name, zone in told["zones"].items():
        zone["temperature"] = points[f"{name}/zone_air_temperature_sensor"]
        zone["comfort"] = {edge: f"{name}/comfort_{edge}_temperature" for edge in ("lower", "upper")}
        people = f"{name}/occupancy_count_sensor"
        zone["people"] = people if people in forecast else 0.0
        zone["gains"] = f"{name}/gains" if f"{name}/gains" in forecast else 0.0
    for name, entry in told.get("actuators", {}).items():
        told["actuators"][name] = {k: v for k, v in entry.items() if k not in ("unit", "release")}
        told["actuators"][name]["signal"] = points[name]
    told["measurements"] = {name: points[name] for name in file.measurements}
    told["plant"], told["series"] = {"kind": "site"}, [WEATHER, OTHER]
    told["weather"] = {point: point for point in WEATHER_POINTS if point in forecast}
    told["prices"] = told.get("prices", {}) | _of_table("price", forecast)
    if "electricity_carbon_intensity" in forecast and forecast["electricity_carbon_intensity"].any():
        told["emissions"] = told.get("emissions", {}) | _of_table("carbon_intensity", forecast)
    told["forecast"] = {"hours": file.forecast.hours}
    told.pop("energy", None)  # sums of signals that the device does not have
    if not isinstance(file.period, Period):
        told["period"] = {"start": f"{start:%Y-%m-%d %H:%M}", "days": 1}
    return {"format": 1, "name": file.name} | told


def _of_table(what: str, forecast: pd.DataFrame) -> dict[str, str]:
    return {kind: f"{kind}_{what}" for kind in ("electricity", "gas") if f"{kind}_{what}" in forecast}


class ForecastTables:
    """The tables of a site, rewritten with each forecast of its plant.

    Parameters
    ----------
    folder : Path
        Of the site.
    step : float
        Of the forecasts [s].
    """

    def __init__(self, folder: Path, step: float) -> None:
        self.folder, self.step = folder, pd.Timedelta(seconds=step)
        self._known = pd.DataFrame()

    def write(self, forecast: Forecast) -> pd.DataFrame:
        """Write the latest that is known of each step, and the last hours; return it by the begins of the steps."""
        fresh = forecast.to_frame().dropna(axis="columns", how="all")
        fresh = fresh.join(_gains(fresh))
        fresh.index = pd.DatetimeIndex(fresh.index).tz_convert("UTC") - self.step
        known = fresh.combine_first(self._known) if len(self._known) else fresh
        self._known = known = known[known.index >= fresh.index[0] - pd.Timedelta(seconds=KEPT)]
        # a mean of the weather over a step stands in its middle; before the first the same was
        weather = known[[column for column in known if column in WEATHER_POINTS]]
        middles = pd.concat([weather.iloc[:1].set_axis(known.index[:1] - self.step / 2), weather.set_axis(
            pd.DatetimeIndex(known.index) + self.step / 2)])  # fmt: skip
        others = known[[column for column in known if column not in weather and "internal_gain" not in column]]
        for name, table in ((WEATHER, middles), (OTHER, others)):
            stamps = [f"{stamp:%Y-%m-%d %H:%M:%S}+00:00" for stamp in pd.DatetimeIndex(table.index)]
            _whole(self.folder / name, table.set_axis(pd.Index(stamps, name="timestamp")).to_csv())
        return known


def _gains(forecast: pd.DataFrame) -> pd.DataFrame:
    """Heat of lights and equipment [W] in the zones that have any beside people's."""
    found = {}
    for column in forecast.filter(like="/internal_gain"):
        zone = column.rpartition("/")[0]
        people = forecast.get(f"{zone}/occupancy_count_sensor", 0.0)
        others = (forecast[column] - InternalGains.sensible * people).clip(lower=0.0)
        if others.max() > 1e-6:
            found[f"{zone}/gains"] = others
    return pd.DataFrame(found, index=forecast.index)


def _whole(path: Path, text: str) -> None:
    """Write a file, whole or not at all: others read it meanwhile."""
    part = path.with_suffix(f"{path.suffix}.part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)
