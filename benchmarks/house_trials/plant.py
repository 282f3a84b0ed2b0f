"""What EnergyPlus gets of a trial's house, and what a run gives."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from energyplus_trials import climate
from energyplus_trials.errors import EnergyPlusRunError
from energyplus_trials.frame import SITE_OUTPUTS, Objects, constant
from energyplus_trials.process import DRIVE, WEATHER, run_worker

from house_trials import model
from house_trials.draw_effects import heated
from house_trials.people import Household, Series
from house_trials.specification import HouseSpec

RUN_IN_DAYS = 10
#: Outputs of each room.
OUTPUTS = {
    "temperature": "Zone Mean Air Temperature",
    "convective": "Zone Air Heat Balance Internal Convective Heat Gain Rate",
}
_FLOOR = "Zone Radiant HVAC Heating Rate"
_WORKER = Path(__file__).with_name("worker.py")
# What EnergyPlus may say of every house of this kind, and why it does no harm: results leave through the runtime
# interface, not through files; volumes are given; not every construction is used; the wet bulb, that of very dry air
# too, is used for nothing.
_EXPECTED = re.compile(
    r"No reporting elements have been requested|CalculateZoneVolume|PsyTwbFnTdbWPb|\(PsyPsatFnTemp\)"
    r"|nominally unused constructions|^$"
)
# Entity and name that we give it, and EnergyPlus's name and key.
Variable = tuple[str, str, str, str]


@dataclass
class Plant:
    """What EnergyPlus gets: the null's input until effects change it.

    Parameters
    ----------
    spec : HouseSpec
        Of the trial.
    station : DataFrame, shape (n_time, 6)
        Weather of run-in and telemetry that the station sees.
    people : Household
        Who is in.
    set_points : ndarray, shape (n_time, n_room)
        Of the rooms [degC].
    objects : dict
        EnergyPlus objects by class and name.
    drive : dict
        Series of driven schedules, shape (n_time,), by schedule.
    gains : dict
        Heat that the air gets of other sources than heaters, shape (n_time,) by room [W].
    heaters : dict
        What is known of the heater of each heated room, see `worker.Heater`.
    sun : bool
        Whether the sun reaches the house.
    sky : float
        Share of the difference between air and sky that does [-].
    """

    spec: HouseSpec
    station: pd.DataFrame
    people: Household
    set_points: Series
    objects: Objects
    drive: dict[str, Series] = field(default_factory=dict)
    gains: dict[str, Series] = field(default_factory=dict)
    heaters: dict[str, dict[str, Any]] = field(default_factory=dict)
    sun: bool = False
    sky: float = 0.0

    @property
    def starts(self) -> pd.DatetimeIndex:
        """Starts of all intervals of the run."""
        return pd.DatetimeIndex(self.station.index - climate.STEP)

    def add(self, kind: str, name: str, **fields: Any) -> None:
        """Add an object.

        Parameters
        ----------
        kind, name : str
            EnergyPlus class and name.
        **fields
            Of the object.
        """
        self.objects.setdefault(kind, {})[name] = fields

    def follow(self, name: str, values: Series) -> str:
        """Let a schedule follow a series, and return its name.

        Parameters
        ----------
        name : str
            Of the schedule; made where it is not there.
        values : ndarray, shape (n_time,)
            Its values.
        """
        self.objects.setdefault("Schedule:Constant", {})[name] = constant(float(values[0]))
        self.drive[name] = np.asarray(values, dtype=float)
        return name

    def heat(self, room: str, name: str, watts: Series, radiant: float) -> None:
        """Add heat to a room that no meter sees.

        Parameters
        ----------
        room, name : str
            Where, and what.
        watts : ndarray, shape (n_time,)
            Heat [W].
        radiant : float
            Share that surfaces get [-].
        """
        most = max(float(np.abs(watts).max()), 1.0)
        schedule = self.follow(f"{room} {name}", watts / most)
        self.add("OtherEquipment", f"{room} {name}", **model.equipment(room, schedule, most, radiant))
        self.gains[room] = self.gains.get(room, np.zeros(len(watts))) + (1.0 - radiant) * watts


def heaters(spec: HouseSpec) -> dict[str, dict[str, Any]]:
    """Return what is known of the heater of each heated room of a null.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    """
    use, found = spec.heating, {}
    for room in heated(spec):
        floor = model.on_floor(spec, room)
        found[room] = {
            "power": model.heater_power(spec, room), "lag": 0.0 if floor else use.lag, "bias": 0.0, "limit": 1.0,
            "control": "on_off" if floor else use.control, "band": 0.5 if floor else use.band, "floor": floor,
            "schedule": model.heater_schedule(spec, room),
        }  # fmt: skip
    return found


@dataclass(frozen=True)
class Results:
    """What a run gave.

    Parameters
    ----------
    outputs : DataFrame, shape (n_time, n_output)
        Columns (entity, output), of rooms and of `site`; ends of intervals.
    asked, given : DataFrame, shape (n_time, n_heated)
        Power that thermostats ask for and mean heat of radiators, or of heated floors [W].
    warnings : list of str
        Unexpected ones.
    """

    outputs: pd.DataFrame
    asked: pd.DataFrame
    given: pd.DataFrame
    warnings: list[str]


def simulate(plant: Plant, audit: Sequence[Variable] = ()) -> Results:
    """Run EnergyPlus.

    Parameters
    ----------
    plant : Plant
        With set points and effects.
    audit : sequence of Variable
        Further outputs.

    Raises
    ------
    EnergyPlusRunError
        Stopped, severe errors, or steps without values.
    """
    rooms = plant.spec.zone_names
    variables: list[Variable] = [(room, ours, name, room) for room in rooms for ours, name in OUTPUTS.items()]
    variables += [("site", ours, name, "Environment") for ours, name in SITE_OUTPUTS.items()]
    floors = [room for room, law in plant.heaters.items() if law["floor"]]
    variables += [(room, "floor", _FLOOR, f"{room} floor heating") for room in floors]
    variables += audit
    columns = pd.MultiIndex.from_tuples([variable[:2] for variable in variables])
    for room, law in plant.heaters.items():
        law["column"] = columns.get_loc((room, "temperature"))
    with tempfile.TemporaryDirectory(prefix="energyplus_") as name:
        values, heat, warnings = _run(Path(name), plant, variables)
    if np.isnan(values).any():
        raise EnergyPlusRunError(f"{plant.spec.name}: {int(np.isnan(values).any(axis=1).sum())} steps without values")
    outputs = pd.DataFrame(values, plant.station.index, columns)
    asked, given = (pd.DataFrame(heat[:, :, k], plant.station.index, list(plant.heaters)) for k in (0, 1))
    for room in floors:
        given[room] = outputs[room, "floor"]
    return Results(outputs, asked, given, warnings)


def _run(folder: Path, plant: Plant, variables: Sequence[Variable]) -> tuple[Series, Series, list[str]]:
    """Return values, shape (n_time, n_variable), heat, shape (n_time, n_heated, 2), and what EnergyPlus warned of."""
    weather = climate.building_weather(plant.station, sun=plant.sun, sky=plant.sky)
    climate.write_epw(folder / WEATHER, weather, plant.spec.climate)
    drive = np.column_stack(list(plant.drive.values())) if plant.drive else np.zeros((len(weather), 0))
    rooms = [plant.spec.zone_names.index(room) for room in plant.heaters]
    np.savez(
        folder / DRIVE, names=np.array(list(plant.drive)), values=drive, set_points=plant.set_points[:, rooms]
    )
    job = {"result": str(folder / "result.npz"), "rows": len(weather), "heaters": list(plant.heaters.values()),
           "variables": variables, "first_day": int(plant.starts[0].day_of_year)}  # fmt: skip
    warnings = run_worker(folder, _WORKER, plant.objects, job, plant.spec.name)
    with np.load(folder / "result.npz") as result:
        return result["values"], result["heat"], [warning for warning in warnings if not _EXPECTED.search(warning)]
