"""What EnergyPlus gets of a trial's building, and what a run gives."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from energyplus_trials import climate, model
from energyplus_trials.errors import EnergyPlusRunError
from energyplus_trials.frame import SITE_OUTPUTS, Objects, constant
from energyplus_trials.process import DRIVE, WEATHER, run_worker
from energyplus_trials.specification import TrialSpec

RUN_IN_DAYS = 10
_WORKER = Path(__file__).with_name("worker.py")
# What EnergyPlus may say of every building of this kind, and why it does no harm: results leave through the runtime
# interface, not through files; volumes are given; the wet bulb, that of very dry air too, is used for nothing.
_EXPECTED = re.compile(
    r"No reporting elements have been requested|CalculateZoneVolume|PsyTwbFnTdbWPb|\(PsyPsatFnTemp\)|^$"
)
# Entity and name that we give it, and EnergyPlus's name and key.
Variable = tuple[str, str, str, str]


@dataclass
class Plant:
    """What EnergyPlus gets: the null's input until effects change it.

    Parameters
    ----------
    spec : TrialSpec
        Of the trial.
    station : DataFrame, shape (n_time, 6)
        Weather of run-in and telemetry that the station sees.
    objects : dict
        EnergyPlus objects by class and name.
    drive : dict
        Series of driven schedules, shape (n_time,), by schedule.
    laws : list of dict
        Heat that depends on the building's state.
    sun : bool
        Whether the sun reaches the building.
    sky : float
        Share of the difference between air and sky that does [-].
    """

    spec: TrialSpec
    station: pd.DataFrame
    objects: Objects
    drive: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    laws: list[dict[str, Any]] = field(default_factory=list)
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

    def add_schedule(self, name: str, values: NDArray[np.float64] | float) -> str:
        """Add a schedule that follows a series, and return its name.

        Parameters
        ----------
        name : str
            Of the schedule.
        values : ndarray, shape (n_time,), or float
            Its values.
        """
        series = np.broadcast_to(np.asarray(values, dtype=float), (len(self.station),))
        self.add("Schedule:Constant", name, **constant(float(series[0])))
        if np.ptp(series) > 0.0:
            self.drive[name] = series
        return name


def simulate(plant: Plant, audit: Sequence[Variable] = ()) -> pd.DataFrame:
    """Run EnergyPlus and return the outputs of run-in and telemetry, columns (entity, output), ends of intervals.

    Parameters
    ----------
    plant : Plant
        With set points and effects.
    audit : sequence of Variable
        Further outputs.

    Returns
    -------
    DataFrame
        Of zones and of `site`, in EnergyPlus's units [degC], [kg/s], [W], [W/m2]; what EnergyPlus warned of is in
        `attrs["warnings"]`.

    Raises
    ------
    EnergyPlusRunError
        Stopped, severe errors, or steps without values.
    """
    variables = [("site", ours, name, "Environment") for ours, name in SITE_OUTPUTS.items()]
    for zone in plant.spec.zone_names:
        outputs = model.ZONE_OUTPUTS.items()
        variables += [(zone, ours, name, key.format(zone=zone)) for ours, (name, key) in outputs]
    variables += audit
    weather = climate.building_weather(plant.station, sun=plant.sun, sky=plant.sky)
    with tempfile.TemporaryDirectory(prefix="energyplus_") as name:
        values, warnings = _run(Path(name), plant, weather, variables)
    if np.isnan(values).any():
        raise EnergyPlusRunError(f"{plant.spec.name}: {int(np.isnan(values).any(axis=1).sum())} steps without values")
    columns = pd.MultiIndex.from_tuples([variable[:2] for variable in variables])
    results = pd.DataFrame(values, plant.station.index, columns)
    results.attrs["warnings"] = warnings
    return results


def _run(
    folder: Path, plant: Plant, weather: pd.DataFrame, variables: Sequence[Variable]
) -> tuple[NDArray[np.float64], list[str]]:
    """Return the values, shape (n_time, n_variable), and what EnergyPlus warned of."""
    climate.write_epw(folder / WEATHER, weather, plant.spec.climate)
    drive = np.column_stack(list(plant.drive.values()))
    np.savez(folder / DRIVE, names=np.array(list(plant.drive)), values=drive)
    job = {"result": str(folder / "result.npy"), "laws": plant.laws, "variables": variables, "rows": len(weather),
           "first_day": int(plant.starts[0].day_of_year)}  # fmt: skip
    warnings = run_worker(folder, _WORKER, plant.objects, job, plant.spec.name)
    return np.load(folder / "result.npy"), [warning for warning in warnings if not _EXPECTED.search(warning)]
