"""A case of the size of the paper's pilot building, generated from a seed."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from pathlib import Path

import pandas as pd

from thermal.case.building import Building, Location
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.save import save_case
from thermal.errors import CaseError
from thermal.model.simulator import Simulator
from thermal.pilot.building import devices, generate_office
from thermal.pilot.telemetry import Plant, Progress, generate_telemetry
from thermal.pilot.weather import MOUNTAIN_VIEW, generate_weather

#: Makes the plant of a building that goes in steps of so many seconds [s].
PlantFactory = Callable[[Building, float], Plant]

_STATION = "weather_station"  # as in the shared cases


def generate_pilot(
    path: str | PathLike[str],
    *,
    plant_factory: PlantFactory | None = None,
    seed: int = 0,
    days: float = 14.0,
    spin_up_days: float = 2.0,
    start: str = "2023-10-02",
    step_seconds: float = 300.0,
    floor_area: float = 6317.0,
    zones: int = 123,
    floors: int = 2,
    cell_size: float = 0.5,
    orientation: float = 0.0,
    location: Location = MOUNTAIN_VIEW,
    name: str = "pilot",
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Case:
    """Draw an office, run it through some weather, and save plans and telemetry as a case folder.

    Parameters
    ----------
    path : str or path-like
        Folder to make.
    plant_factory : callable, optional
        Called as ``plant_factory(building, step_seconds)``; returns the plant that produces the telemetry.
        The library's own stepping simulator with its starting parameters by default.
    seed : int
        Same seed, same case; 0 or more.
    days : float
        Length of the telemetry [d], positive.
    spin_up_days : float
        Length that is simulated before it, so that walls and mass forget how they started [d], 0 or more.
    start : str
        Local time at which the first reported interval begins, ISO 8601 without offset.
    step_seconds : float
        Length of an interval [s], positive, up to 3600. The default is the paper's 5 minutes.
    floor_area : float
        Of all floors together [m2], positive; by default that of the paper's pilot building.
    zones : int
        On all floors together [-], at least one a floor; by default as many as the pilot has terminal units.
    floors : int
        Number of storeys [-], at least 1; two in the pilot building.
    cell_size : float
        Side of a plan cell [m], positive. Default as in the shared cases.
    orientation : float
        Direction of the plan's "up" [deg clockwise from north], -360 to 360.
    location : Location
        Where the building stands; by default the paper's pilot building's town.
    name : str
        Of the case.
    overwrite : bool
        Whether a case that is there already is replaced.
    progress : callable, optional
        Called as ``progress(steps_done, steps)`` after every step.

    Returns
    -------
    Case
        As it was saved and loaded again.

    Raises
    ------
    CaseError
        When the folder holds something and `overwrite` is not set.
    ThermalError
        When there is no office of this size.
    ThermalError
        When a length is out of range or the plant does not fit the building.
    """
    target = Path(path)
    if target.exists() and not overwrite and (not target.is_dir() or any(target.iterdir())):  # before the long part
        advice = "choose another folder or pass overwrite=True"
        raise CaseError(str(target), "no folder or an empty one", "something there", advice)
    plans = generate_office(seed, floor_area=floor_area, zones=zones, floors=floors, cell_size=cell_size)
    building = Building(name, location, orientation, plans, devices(plans), (), _STATION)
    weather = generate_weather(
        seed,
        start=str(pd.Timestamp(start) - pd.Timedelta(days=spin_up_days)),
        days=days + spin_up_days,
        step_seconds=step_seconds,
        location=location,
        station=_STATION,
    )
    telemetry = generate_telemetry(
        (plant_factory or _own_simulator)(building, step_seconds),
        plans,
        weather,
        seed=seed,
        spin_up_days=spin_up_days,
        station=_STATION,
        progress=progress,
    )
    save_case(Case(building, telemetry), target, overwrite=overwrite)
    return load_case(target)


def _own_simulator(building: Building, step_seconds: float) -> Plant:
    """Make the default plant: the grid model with the mean of the shuffle."""
    return Simulator(building, step_seconds=step_seconds)
