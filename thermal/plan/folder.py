"""A case folder from imported plans and devices, before there is telemetry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd

from thermal.case.building import Building
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.case.save import save_case
from thermal.case.schema import Device, Location
from thermal.case.telemetry import INDEX, Telemetry
from thermal.plan.assemble import PlanImport


def building_of(
    found: PlanImport, name: str, location: Location, *, orientation: float = 0.0, devices: Sequence[Device] = ()
) -> Building:
    """Describe a building by its imported plans.

    Parameters
    ----------
    found : PlanImport
        Plans of the building.
    name : str
        Of the case.
    location : Location
        Where it stands.
    orientation : float
        Clockwise from true north to "up" on the drawing of the lowest floor [deg]; the angle by which that drawing was
        turned upright is added.
    devices : sequence of Device
        What serves it.

    Returns
    -------
    Building
        For a case.
    """
    turned = orientation + found.floors[0].survey.turned
    upright = (turned + 180.0) % 360.0 - 180.0
    return Building(name, location, round(upright, 2), found.plans, tuple(devices))


def save_plan_case(building: Building, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
    """Save a building as a case folder that has no telemetry yet.

    Parameters
    ----------
    building : Building
        With plans and devices.
    path : str or path
        Folder to make.
    overwrite : bool
        Whether a case that is there already is replaced. Default: refuse.

    Returns
    -------
    Path
        The folder. It holds a telemetry file of two stamps without a value, which is there to be replaced.

    Raises
    ------
    CaseError
        One of its family: the building does not fit together, or the folder holds something.
    """
    stamps = pd.date_range("2000-01-01", periods=2, freq="5min", tz=building.location.timezone, name=INDEX)
    column = f"{building.weather_station}/{OUTDOOR_TEMPERATURE}"
    telemetry = Telemetry.from_frame(pd.DataFrame({column: [np.nan, np.nan]}, index=stamps))
    return save_case(Case(building=building, telemetry=telemetry, path=Path(path)), path, overwrite=overwrite)


def with_devices(path: str | PathLike[str], devices: Sequence[Device]) -> Case:
    """Load a case and give it other devices.

    Parameters
    ----------
    path : str or path
        Case folder.
    devices : sequence of Device
        All devices it is to have.

    Returns
    -------
    Case
        Not saved yet.

    Raises
    ------
    CaseError
        One of its family: the case does not load.
    """
    case = load_case(path)
    return replace(case, building=replace(case.building, devices=tuple(devices)))
