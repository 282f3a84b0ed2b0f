"""The plants by name, and the folder of each: EnergyPlus' input, prices and a ``plant.yaml``."""

from __future__ import annotations

import json
import os
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import yaml
from energyplus_trials.frame import STEPS_PER_HOUR

from foreign_models import flats, house, office, shop
from foreign_models.drawn import drawn_plants
from foreign_models.foreign_plant import ForeignPlant
from foreign_models.heat_pump import Chiller
from foreign_models.periods import DAYS, WARM_UP
from foreign_models.prices import dynamic_prices
from foreign_models.vav_boxes import FLOOR, SCHOOL
from foreign_models.vav_boxes import WEATHER as CHICAGO
from mpc.adapters.energyplus.input import weather_path
from mpc.scenario.weather_files import read_epw

STATION = {
    "outside_air_temperature_sensor": "Site Outdoor Air Drybulb Temperature",
    "direct_normal_irradiance_sensor": "Site Direct Solar Radiation Rate per Area",
    "diffuse_horizontal_irradiance_sensor": "Site Diffuse Solar Radiation Rate per Area",
    "wind_speed_sensor": "Site Wind Speed",
}


SUMMER, COOLED = shop.Shop(cooled=True), office.Office(chiller=Chiller(40_000.0, 3.2, standing=0.15, minimum=0.2))

PLANTS = {
    "house": ForeignPlant(
        "House of 192 m2 for five, heated floor, air-to-water heat pump of 12 kW", house.house, house.description
    ),
    "flats": ForeignPlant("Three flats of 70 m2 with electric baseboards", flats.flats, flats.description),
    "office": ForeignPlant(
        "Office of 480 m2, four zones with fan coils, air-to-water heat pump of 40 kW",
        office.office,
        office.description,
    ),
    "shop": ForeignPlant("Shop of 216 m2 with a unitary heat pump of 24 kW", shop.shop, shop.description),
    "vav_floor": ForeignPlant(
        "Storey of 1661 m2 of the Medium Office, five VAV boxes with electric reheat, air handler with a gas furnace",
        FLOOR.model,
        FLOOR.description,
        CHICAGO,
    ),
    "vav_school": ForeignPlant(
        "Wing of 1344 m2 of the Primary School, five VAV boxes and their air handler on hot water",
        SCHOOL.model,
        SCHOOL.description,
        CHICAGO,
    ),
    "cooled_shop": ForeignPlant(
        "The same shop in summer", partial(shop.shop, SUMMER), partial(shop.description, SUMMER), cooled=True
    ),
    "cooled_office": ForeignPlant(
        "The same office in summer, with a chiller of 40 kW",
        partial(office.office, COOLED),
        partial(office.description, COOLED),
        cooled=True,
    ),
}

#: Those of the table, and those that are drawn.
ALL = PLANTS | drawn_plants()


def describe(name: str, errors: str = "day_ahead") -> dict[str, Any]:
    """Return the ``plant.yaml`` of a plant, in the coldest two weeks, or the hottest.

    Parameters
    ----------
    name : str
        One of `ALL`.
    errors : str
        Of its weather forecasts: ``day_ahead`` or ``none``.
    """
    plant = ALL[name]
    weather = weather_path(plant.weather)
    place = read_epw(weather).location
    told = plant.description()
    station = {f"weather_station/{point}": f"Environment, {variable}" for point, variable in STATION.items()}
    return {
        "format": 1, "name": name, "about": plant.about,
        "location": {"latitude": place.latitude, "longitude": place.longitude, "elevation": place.elevation,
                     "timezone": place.timezone},
        "plant": {"kind": "energyplus", "model": f"{name}.epJSON", "weather": plant.weather,
                  "steps_per_hour": STEPS_PER_HOUR},
        "control_step": 900.0,
        "period": {"start": plant.begin, "days": DAYS, "warm_up_days": WARM_UP},
        "zones": told["zones"],
        "measurements": told["measurements"] | station,
        "actuators": told["actuators"],
        **({"source": told["source"]} if "source" in told else {}),
        "energy": told["energy"],
        "prices": {"electricity": "dynamic", "currency": "EUR"} | told.get("prices", {}),
        "series": ["prices.csv"],
        "forecast": {"hours": 24.0, "errors": errors},
    }  # fmt: skip


def write_plant(name: str, out: Path, errors: str = "day_ahead") -> Path:
    """Write the folder of a plant.

    Parameters
    ----------
    name : str
        One of `ALL`.
    out : Path
        Where folders of plants are; that of this one is made anew.
    errors : str
        Of its weather forecasts: ``day_ahead`` or ``none``.

    Returns
    -------
    Path
        The ``plant.yaml``.
    """
    told, folder = describe(name, errors), out / name
    folder.mkdir(parents=True, exist_ok=True)
    prices = dynamic_prices(told["location"]["timezone"]).to_csv(index=False)
    _whole(folder / f"{name}.epJSON", json.dumps(ALL[name].model(), indent=1))
    _whole(folder / "prices.csv", prices)
    _whole(folder / "plant.yaml", yaml.safe_dump(told, sort_keys=False, width=120, default_flow_style=None))
    return folder / "plant.yaml"


def _whole(path: Path, text: str) -> None:
    """Write a file, whole or not at all."""
    with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False, encoding="utf-8") as part:
        part.write(text)
    os.replace(part.name, path)
