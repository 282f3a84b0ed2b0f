"""One run of a trial's building in EnergyPlus: what its sensors would see, and EnergyPlus' own heat balance."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import date, timedelta
from functools import cache

import numpy as np
import pandas as pd
from _sealed import TrialError
from numpy.typing import NDArray

from mpc.adapters.energyplus.building import zone_table
from mpc.adapters.energyplus.input import InputFile, weather_path
from mpc.adapters.energyplus.process import EnergyPlusProcess, Job, run_energyplus
from mpc.errors import EnergyPlusError
from reference_trials.buildings import Content, inlets, served, source
from reference_trials.specification import RUN_IN_DAYS, WEATHER, YEAR, Spaces, Spec
from thermal.case.building import ZoneTable

STATION = {
    "outside_air_temperature_sensor": "Site Outdoor Air Drybulb Temperature",
    "wind_speed_sensor": "Site Wind Speed",
    "wind_direction_sensor": "Site Wind Direction",
    "horizontal_infrared_irradiance_sensor": "Site Horizontal Infrared Radiation Rate per Area",
    "direct_normal_irradiance_sensor": "Site Direct Solar Radiation Rate per Area",
    "diffuse_horizontal_irradiance_sensor": "Site Diffuse Solar Radiation Rate per Area",
}
#: Heat of a zone's air by EnergyPlus' own account [W].
BALANCE = {
    "gains": "Zone Air Heat Balance Internal Convective Heat Gain Rate",
    "surfaces": "Zone Air Heat Balance Surface Convection Rate",
    "zones": "Zone Air Heat Balance Interzone Air Transfer Rate",
    "outdoor_air": "Zone Air Heat Balance Outdoor Air Transfer Rate",
    "delivered": "Zone Air Heat Balance System Air Transfer Rate",
    "convective": "Zone Air Heat Balance System Convective Heat Gain Rate",
    "storage": "Zone Air Heat Balance Air Energy Storage Rate",
}
AIR_HEAT_CAPACITY = 1006.0  # J/kg/K, of the case format
_LEAST_FLOW = 1e-6  # kg/s: less is none


@dataclass(frozen=True)
class Run:
    """Outputs of a run, run-in left out, stamped at the end of each step.

    Parameters
    ----------
    temperature : DataFrame, shape (n_time, n_zone)
        Means over a step, of served zones and of others [degC].
    flow, discharge : DataFrame, shape (n_time, n_inlet)
        By device [kg/s], and [degC] of the heat, that of the zone where no air flows.
    heating, cooling : DataFrame, shape (n_time, n_served)
        Set points of thermostats [degC].
    station : DataFrame, shape (n_time, 6)
        Weather in the case format's units.
    balance : dict of str to DataFrame, shape (n_time, n_served)
        Terms of `BALANCE` [W].
    """

    temperature: pd.DataFrame
    flow: pd.DataFrame
    discharge: pd.DataFrame
    heating: pd.DataFrame
    cooling: pd.DataFrame
    station: pd.DataFrame
    balance: dict[str, pd.DataFrame]


@cache
def geometry(building: str, spaces: Spaces) -> ZoneTable:
    """Find areas, volumes, layers and neighbours of a building, as EnergyPlus has them with everything on.

    Parameters
    ----------
    building : str
        Key of `REFERENCES`.
    spaces : str
        How plenums and attics are in the table, see `Spec`.
    """
    file = source(building)
    content = file.with_period(date(YEAR, 1, 2), 1, 6)
    content["Output:SQLite"] = {"Output:SQLite 1": {"option_type": "SimpleAndTabular"}}
    zones = tuple(file.of_type("Zone")) if spaces == "zones" else served(file)
    others = tuple(z for z in file.of_type("Zone") if z not in zones)
    with _told(building):
        job = Job(json.dumps(content), "in.epJSON", weather_path(WEATHER[0]), stepped=False)
        files = run_energyplus(job, ["eplusout.sql"])
    with closing(sqlite3.connect(":memory:")) as database:
        database.deserialize(files["eplusout.sql"])
        return zone_table(database, file, zones, others)


def simulate(spec: Spec, content: Content) -> Run:
    """Run a trial's building.

    Parameters
    ----------
    spec : Spec
        Of the trial.
    content : dict
        Its objects, effects in.

    Raises
    ------
    TrialError
        When EnergyPlus broke off.
    """
    file = InputFile(content, spec.building)
    first = date.fromisoformat(spec.start) - timedelta(days=RUN_IN_DAYS)
    days, steps = RUN_IN_DAYS + spec.days, 24 * spec.steps_per_hour
    entries, zones = inlets(file), served(file)
    spaces = tuple(file.of_type("Zone"))
    thermostats = ("Zone Thermostat Heating Setpoint Temperature", "Zone Thermostat Cooling Setpoint Temperature")
    variables = [(output, "Environment") for output in STATION.values()]
    variables += [("Zone Air Temperature", zone) for zone in spaces]
    variables += [(output, i.node) for output in ("System Node Mass Flow Rate", "System Node Temperature")
                  for i in entries]  # fmt: skip
    variables += [(output, zone) for output in (*thermostats, *BALANCE.values()) for zone in zones]
    at = len(STATION) + len(spaces)
    products = [(at + k, at + len(entries) + k) for k in range(len(entries))]
    model = json.dumps(file.with_period(first, days, spec.steps_per_hour))
    with _told(spec.name):
        process = EnergyPlusProcess(Job(model, "in.epJSON", weather_path(spec.weather), variables, products))
        try:
            told = [process.ask(steps, []) for _ in range(days)]
            process.finish()
        finally:
            process.close()
    means = np.concatenate([np.asarray(t["rows"], dtype=float) for t in told])
    stamps = pd.date_range(pd.Timestamp(first), periods=len(means) + 1, freq=f"{60 // spec.steps_per_hour}min")[1:]
    return _run(spec, means, stamps, file)


def _run(spec: Spec, means: NDArray[np.float64], stamps: pd.DatetimeIndex, file: InputFile) -> Run:
    spaces, has_air = tuple(file.of_type("Zone")), served(file)
    devices, rooms = ([getattr(i, name) for i in inlets(file)] for name in ("device", "zone"))
    kept = slice(RUN_IN_DAYS * 24 * spec.steps_per_hour, None)
    sizes = (len(STATION), len(spaces), len(devices), len(devices), *(len(has_air),) * (2 + len(BALANCE)), len(devices))
    parts = iter(np.split(means, np.cumsum(sizes)[:-1], axis=1))

    def table(values: NDArray[np.float64], columns: Iterable[str]) -> pd.DataFrame:
        return pd.DataFrame(values[kept], stamps[kept], list(columns))

    station, temperature = table(next(parts), STATION), table(next(parts), spaces)
    flow, _ = next(parts), next(parts)
    heating, cooling = (table(next(parts), has_air) for _ in range(2))
    balance = {name: table(next(parts), has_air) for name in BALANCE}
    flowing = flow > _LEAST_FLOW
    warm = np.divide(next(parts), flow, out=np.zeros_like(flow), where=flowing)
    discharge = table(warm, devices).where(flowing[kept], temperature[rooms].to_numpy())
    return Run(temperature, table(np.where(flowing, flow, 0.0), devices), discharge, heating, cooling, station, balance)


@contextmanager
def _told(name: str) -> Iterator[None]:
    """Turn an error of EnergyPlus into one of a trial."""
    try:
        yield
    except EnergyPlusError as error:
        raise TrialError(f"{name}: {error}") from error
