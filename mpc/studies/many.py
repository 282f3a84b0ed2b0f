"""Jobs of many cases beside calibration and diagnosis: plants that are identified, controllers that are compared."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from calibration.fleet.job import Done, Files, Job
from calibration.fleet.settings import Settings
from calibration.fleet.store import Store, is_url
from calibration.results import to_json
from mpc.errors import ControlError, MpcError
from mpc.identify.excitation import ExcitationSettings
from mpc.identify.identify import Identified
from mpc.identify.identify import identify as identify_plant
from mpc.kpi.rewards import DISCOMFORT_PRICE
from mpc.loop.noise import SensorNoise
from mpc.reports.control import comparison_files
from mpc.reports.identify import identified_files
from mpc.scenario.forecast import DAY_AHEAD_ERRORS
from mpc.scenario.from_text import read_comfort, read_tariff
from mpc.scenario.weather_files import read_epw, weather_of_case
from mpc.studies.described import PlantStudy
from mpc.studies.excited import Experiment, experiment_period, run_experiment
from mpc.studies.run import compare_controllers
from mpc.studies.study import Study, StudySettings, make_study
from thermal.case.case import Case
from thermal.errors import nearest

#: File by which a folder is known as that of a described plant.
PLANT = "plant.yaml"

#: Settings of the two jobs, with their defaults.
IDENTIFICATION: dict[str, Any] = {"days": 14, "start": None, "actuators": (), "cooling": False, "seed": 0}
COMPARISON: dict[str, Any] = {
    "controllers": (), "start": None, "end": None, "parameters": None, "controller_parameters": None, "dx": None,
    "plant": "reduced", "comfort_price": None, "weather": None, "tariff": None, "gas_price": None, "currency": None,
    "comfort": None, "exact": False, "seed": 0,
}  # fmt: skip

#: Leaves the files of a job as they are, or has them look as another process shows them.
Shown = Callable[[Files], Files]


def identification_job(shown: Shown = lambda files: files) -> Job:
    """Make the job of a described plant that is identified, as `buildingmpc identify` does it.

    Parameters
    ----------
    shown : callable
        Changes what makes the files of the results.
    """
    spell = partial(_spell, "identify", IDENTIFICATION)
    return Job(spell, _identified, shown(identified_files), _plant_file, PLANT)


def comparison_job(shown: Shown = lambda files: files) -> Job:
    """Make the job of a case whose controllers are compared, as `buildingmpc compare` does it.

    Parameters
    ----------
    shown : callable
        Changes what makes the files of the results.
    """
    return Job(partial(_spell, "compare", COMPARISON), _compared, shown(comparison_files))


def study_of(case: Case, given: Mapping[str, Any]) -> Study:
    """Put together what controllers of a case are compared on.

    Parameters
    ----------
    case : Case
        Building and weather.
    given : mapping of str to Any
        Settings by name, those of `COMPARISON` where one is not there.
    """
    chosen = {**COMPARISON, **given}
    if chosen["start"] is None or chosen["end"] is None:
        raise ControlError("control of a case", "--start and --end", f"{chosen['start']} and {chosen['end']}")
    price, exact = chosen["comfort_price"], chosen["exact"]
    settings = StudySettings(
        parameters=chosen["parameters"], controller_parameters=chosen["controller_parameters"], dx=chosen["dx"],
        kind=chosen["plant"], tariff=read_tariff(chosen["tariff"], chosen["gas_price"], chosen["currency"]),
        comfort=None if chosen["comfort"] is None else read_comfort(chosen["comfort"]),
        noise=None if exact else SensorNoise(), errors={} if exact else DAY_AHEAD_ERRORS,
        comfort_price=DISCOMFORT_PRICE if price is None else price, seed=chosen["seed"],
    )  # fmt: skip
    weather = weather_of_case(case) if chosen["weather"] is None else read_epw(chosen["weather"])
    return make_study(case.building, weather, chosen["start"], chosen["end"], settings)


def _spell(command: str, defaults: Mapping[str, Any], settings: Settings | None) -> dict[str, Any]:
    """Refuse what a command does not take, and spell the rest as a record does."""
    given = settings if isinstance(settings, Mapping) else {}
    for name in given:
        if name not in defaults:
            raise MpcError(f"settings: {command} takes no {name!r}; {nearest(name, defaults)}")
    spelled: dict[str, Any] = json.loads(to_json({**defaults, **given}))
    return spelled


def _plant_file(folder: Path) -> Path:
    return folder / PLANT


def _identified(path: Path, settings: Settings) -> Done:
    """Excite a described plant, and identify it."""
    given = {**IDENTIFICATION, **(settings if isinstance(settings, Mapping) else {})}
    begin, end = experiment_period(path, None, given["days"], given["start"])
    study = PlantStudy(path, None, begin, end, actuators=tuple(given["actuators"]), cooling=given["cooling"])
    made = run_experiment(study, given["days"], ExcitationSettings(seed=given["seed"]))
    found = identify_plant(made.telemetry, made.machines)
    result: tuple[Identified, Experiment] = (found, made)
    return Done(result, "identified", tables={"errors": [e.to_dict() for e in found.errors]})


def _compared(case: Case, settings: Settings) -> Done:
    """Compare the controllers of a case; parameters lie in results of a fleet, in a folder of its name."""
    given = dict(settings if isinstance(settings, Mapping) else {})
    with tempfile.TemporaryDirectory() as made:
        for name in ("parameters", "controller_parameters"):
            if given.get(name) is not None:
                given[name] = _parameters(str(given[name]), _name(case), Path(made) / f"{name}.json")
        study = study_of(case, given)
    found = compare_controllers(study, list(given["controllers"]))
    rows = [
        {"controller": r.controller, "cost": r.cost, "objective": r.objective, "discomfort": r.kpis.tdis_tot,
         "energy": r.kpis.ener_tot, "currency": r.kpis.currency}
        for r in found.runs
    ]  # fmt: skip
    return Done(found, "compared", tables={"controllers": rows})


def _name(case: Case) -> str:
    """Name of the folder of a case."""
    return case.building.name if case.path is None else case.path.name


def _parameters(place: str, case: str, copy: Path) -> Path:
    """Find the parameters of a case in results of many; those at a URL are copied."""
    if not is_url(place):
        return Path(place) / case / "calibration.json"
    copy.write_bytes(Store(place).at(case).read("calibration.json"))
    return copy
