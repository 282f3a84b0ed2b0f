"""Test cases of a user's building, and of the generated pilot."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pandas as pd

from calibration.evaluation.case_model import case_model
from mpc.adapters.boptest.case import BoptestCase
from mpc.errors import BoptestError
from mpc.loop.building import BuildingModel
from mpc.loop.make import pilot_weather
from mpc.loop.reduced import ReducedBuilding
from mpc.scenario.weather import Weather
from mpc.scenario.weather_files import read_epw, read_tmy3, read_weather_csv, weather_of_case
from thermal._types import FloatArray
from thermal.case.building import Building, Device
from thermal.case.case import Case
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import reduced_model
from thermal.network.build import build_network
from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system

_PILOT_START, _PILOT_STEP = "2023-01-01", 3600.0  # of a year of made weather; step in s


def case_to_serve(
    case: Case,
    parameters: str | Path | None = None,
    *,
    weather: str | Path | None = None,
    step_seconds: float = 300.0,
    dx: float | None = None,
    name: str | None = None,
) -> BoptestCase:
    """Make a test case of a case: its building as calibrated, under a plant sized for it.

    Parameters
    ----------
    case : Case
        Building and telemetry, whose weather drives the plant unless a file does.
    parameters : str or Path, optional
        A ``calibration.json`` of it, with its effects; before calibration by default.
    weather : str or Path, optional
        An EPW file, or a ``.csv`` in TMY3's format or with a column a weather point, so that tests may run at any time
        of the year.
    step_seconds : float
        Step of the plant [s].
    dx : float, optional
        Distance between control volumes of a plan [m].
    name : str, optional
        Of the test case; the building's by default.

    Returns
    -------
    BoptestCase
        To be served.

    Raises
    ------
    BoptestError
        When the weather file is of no known kind.
    """
    settled = case_model(case, parameters, dx=dx)
    building = with_plant(case.building)
    boundaries = case.boundary_temperatures()
    beside = {name: boundaries[name] for name in settled.grid.network.boundaries[1:]}
    source = weather_of_case(case) if weather is None else _weather(Path(weather), building)
    return _served(name or building.name, building, source, settled.grid, settled.theta, step_seconds, beside)


def pilot_to_serve(
    seed: int = 0,
    *,
    floor_area: float = 6317.0,
    zones: int = 123,
    floors: int = 2,
    step_seconds: float = 300.0,
    dx: float = 0.5,
    days: float = 367.0,
    name: str = "pilot",
) -> BoptestCase:
    """Make a test case of the generated pilot building, with a year of its weather and the first days of the next.

    Parameters
    ----------
    seed : int
        Of building and weather; 0 or more.
    floor_area : float
        Of all floors together [m2].
    zones, floors : int
        On all floors together; number of storeys.
    step_seconds : float
        Step of the plant [s].
    dx : float
        Distance between control volumes [m].
    days : float
        How long the weather goes on from the begin of 2023 [d].
    name : str
        Of the test case.

    Returns
    -------
    BoptestCase
        To be served.

    Examples
    --------
    >>> served = pilot_to_serve(1, floor_area=600.0, zones=12, dx=1.0)
    >>> sorted(served.periods)[:2], served.covered[0]
    (['mix_day', 'peak_cool_day'], 0.0)
    """
    building = pilot_building(seed, floor_area=floor_area, zones=zones, floors=floors)
    network = build_network(building, dx=dx)
    weather, grid = pilot_weather(seed, _PILOT_START, days, _PILOT_STEP), SymbolicModel(network)
    return _served(name, building, weather, grid, network.start(), step_seconds, {})


def with_plant(building: Building) -> Building:
    """Give a building the devices of a plant that it lacks: a terminal a zone, an air handler and a boiler.

    Parameters
    ----------
    building : Building
        Whose list may lack them, or name several terminals a zone.
    """
    kinds = ("vav", "ahu", "boiler", "chiller")
    listed = {kind: [d for d in building.devices if d.type == kind] for kind in kinds}
    terminals = [
        next((d for d in listed["vav"] if d.zone == zone), Device(name=f"VAV_{zone}", type="vav", zone=zone))
        for zone in building.zone_names
    ]
    central = [
        *(listed["ahu"] or [Device(name="AHU", type="ahu")]),
        *(listed["boiler"][:1] or [Device(name="BOILER", type="boiler")]),
        *listed["chiller"][:1],
    ]
    others = [d for d in building.devices if d.type not in kinds]
    return replace(building, devices=(*terminals, *central, *others))


def _plain_name(name: str) -> str:
    """Make the name of a test case, which stands in addresses.

    Parameters
    ----------
    name : str
        Of a building.

    Examples
    --------
    >>> _plain_name("Town hall, 2nd floor")
    'Town_hall_2nd_floor'
    """
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name).strip("_") or "building"


def _served(
    name: str, building: Building, weather: Weather, grid: SymbolicModel, theta: FloatArray, step: float,
    boundaries: Mapping[str, pd.Series],
) -> BoptestCase:  # fmt: skip
    """Join the parts of a case, whose plants each get a reduced model of their own."""
    reduced, hvac = reduced_model(grid, [theta]), size_system(building)

    def make_model() -> BuildingModel:
        return ReducedBuilding(reduced, theta, step)

    return BoptestCase(_plain_name(name), building, weather, make_model, hvac, step, boundaries=boundaries)


def _weather(path: Path, building: Building) -> Weather:
    """Read a weather file by its ending, and TMY3's by its second line."""
    if path.suffix.lower() == ".epw":
        return read_epw(path)
    if path.suffix.lower() != ".csv":
        raise BoptestError(f"weather file {path.name}", "an ending .epw or .csv", repr(path.suffix))
    try:
        with path.open(encoding="utf-8", errors="replace") as lines:
            second = [next(lines, ""), next(lines, "")][1]
    except OSError as error:
        raise BoptestError(f"weather file {path}: {error.strerror or error}") from error
    return read_tmy3(path) if second.startswith("Date (") else read_weather_csv(path, building.location)
