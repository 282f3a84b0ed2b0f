"""A case of the size of the paper's pilot building, generated from a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from thermal.case.building import Building, Location
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.save import save_case
from thermal.errors import CaseError
from thermal.model.simulator import Simulator
from thermal.pilot.building import devices, generate_office
from thermal.pilot.telemetry import Plant, Progress, TelemetrySettings, generate_telemetry
from thermal.pilot.weather import MOUNTAIN_VIEW, Period

#: Makes the plant of a building that goes in steps of so many seconds [s].
PlantFactory = Callable[[Building, float], Plant]


def _own_simulator(building: Building, step_seconds: float) -> Plant:
    """Make the default plant: the grid model with the mean of the shuffle."""
    return Simulator(building, step_seconds=step_seconds)


@dataclass(frozen=True)
class PilotSettings(Period):
    """Size, place and period of a generated office.

    Parameters
    ----------
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
    start, days, spin_up_days, step_seconds
        As in `Period` [-, d, d, s].
    """

    floor_area: float = 6317.0
    zones: int = 123
    floors: int = 2
    cell_size: float = 0.5
    orientation: float = 0.0
    location: Location = MOUNTAIN_VIEW
    name: str = "pilot"


def generate_pilot(
    path: str | PathLike[str],
    settings: PilotSettings | None = None,
    *,
    seed: int = 0,
    plant_factory: PlantFactory = _own_simulator,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Case:
    """Draw an office, run it through some weather, and save plans and telemetry as a case folder.

    Parameters
    ----------
    path : str or path-like
        Folder to make.
    settings : PilotSettings, optional
        Size, place and period.
    seed : int
        Same seed, same case [-]; 0 or more.
    plant_factory : callable
        Called as ``plant_factory(building, step_seconds)``; returns the plant that produces the telemetry.
        The library's own stepping simulator with its starting parameters by default.
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
    at, target = settings or PilotSettings(), Path(path)
    if target.exists() and not overwrite and (not target.is_dir() or any(target.iterdir())):  # before the long part
        advice = "choose another folder or pass overwrite=True"
        raise CaseError(str(target), "no folder or an empty one", "something there", advice)
    plans = generate_office(seed, floor_area=at.floor_area, zones=at.zones, floors=at.floors, cell_size=at.cell_size)
    building = Building(at.name, at.location, at.orientation, plans, devices(plans))
    weather = at.weather(seed, at.location, building.weather_station)
    sensors = TelemetrySettings(seed, at.spin_up_days, building.weather_station)
    telemetry = generate_telemetry(plant_factory(building, at.step_seconds), plans, weather, sensors, progress=progress)
    save_case(Case(building, telemetry), target, overwrite=overwrite)
    return load_case(target)
