"""A controller on a foreign plant for two weeks, and what came of it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
from _foreign_do_mpc import DoMpcController
from _foreign_rules import ProportionalIntegral
from foreign_models.periods import DAYS
from foreign_models.plants import ALL, write_plant

from mpc.baselines.plants import LEAD, FullSpeed, OwnControl
from mpc.control.identified.conformal import ConformalBackOff
from mpc.control.identified.controller import IdentifiedSettings
from mpc.errors import ControlError
from mpc.identify.excitation import ExcitationSettings
from mpc.identify.identify import identify
from mpc.identify.model import FILE, PlantModel, read_model
from mpc.identify.telemetry import run_recorded
from mpc.kpi.kpis import measure_kpis
from mpc.loop.plant import Controller, Measurements
from mpc.loop.run import ClosedLoopRun
from mpc.scenario.forecast import Forecast
from mpc.scenario.scenario import Scenario
from mpc.studies.described import PlantStudy
from mpc.studies.excited import experiment_period, run_experiment

#: Length of the experiment that a plant is identified on [d].
EXPERIMENT = 14
#: Starts are those of the compressor, by its power.
_COMPRESSOR = "heat_pump/electrical_power_sensor"
_RUNS = 200.0  # W that a compressor draws when it runs; crankcase heaters draw 50
_COLD = 0.01  # K outside the band that count as time outside it

#: Controllers by name, of a study and its plant.
CONTROLLERS: dict[str, Callable[[PlantStudy, Any], Controller]] = {
    "own": lambda study, plant: OwnControl(),
    "rule": lambda study, plant: study.full_speed(plant),
    "long rule": lambda study, plant: FullSpeed(study.machines(plant), lead=2.0 * LEAD),
    "pi": lambda study, plant: ProportionalIntegral(study.machines(plant)),
    "mpc": lambda study, plant: study.optimal(plant),
    "mpc perfect": lambda study, plant: study.optimal(plant),
    "do-mpc": lambda study, plant: DoMpcController(study.optimal(plant), plant.forecaster.horizon),
    "sac": lambda study, plant: _sac(study),
}


@dataclass
class Timed:
    """A controller whose CPU time is kept; EnergyPlus' own is that of another process.

    Parameters
    ----------
    controller : Controller
        That decides.
    """

    controller: Controller
    seconds: list[float] = field(default_factory=list, init=False)

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        """Pass on."""
        begin = time.process_time()
        chosen = self.controller.step(measurements, forecast)
        self.seconds.append(time.process_time() - begin)
        return chosen


def settings_of(controller: str) -> tuple[str, IdentifiedSettings | None]:
    """Read a controller's name: one of `CONTROLLERS`, and the settings that ``mpc price P`` or ``mpc edge B`` tell.

    Parameters
    ----------
    controller : str
        With a price of discomfort [currency/K/h] or a distance from the lower edges [K], which is then kept as it is.
    """
    kind, _, told = controller.partition(" price ")
    if told:
        return kind, IdentifiedSettings(comfort_price=float(told), guarantee=None)
    kind, _, told = controller.partition(" edge ")
    return kind, IdentifiedSettings(back_off=float(told), guarantee=None) if told else None


def run(name: str, which: str, controller: str, out: Path) -> dict[str, Any]:
    """Let a controller run a plant in one of its periods; optimal control is identified first."""
    begin = pd.Timestamp(ALL[name].starts[which])
    kind, settings = settings_of(controller)
    loop, scenario, timed, spent = drive(name, kind, out, begin, DAYS, settings)
    return account(loop, scenario, timed.seconds) | spent


def drive(
    name: str, controller: str, out: Path, begin: pd.Timestamp, days: int, settings: IdentifiedSettings | None = None,
    kept: list[list[float]] | None = None,
) -> tuple[ClosedLoopRun, Scenario, Timed, dict[str, Any]]:  # fmt: skip
    """Close the loop for some days: the run, its scenario, the timed controller, and what a model took.

    Parameters
    ----------
    name, controller, out, begin, days, settings
        Plant, one of `CONTROLLERS`, folder, first day, length [d] and settings of optimal control.
    kept : list of list of float, optional
        Back-off of a run before that this one goes on from, see `ConformalBackOff` [K].
    """
    perfect = controller == "mpc perfect"
    folder = out / ("plants_foreseen" if perfect else "plants")
    path = write_plant(name, folder, "none" if perfect else "day_ahead")
    model, spent = identified(name, out) if "mpc" in controller or controller == "sac" else (None, {})
    if controller == "sac" and model is not None:
        spent = spent | trained(name, path, model)
    first, last = (f"{day:%Y-%m-%d}" for day in (begin, begin + pd.Timedelta(days=days)))
    study = PlantStudy(path, start=first, end=last, model=model, settings=settings or IdentifiedSettings(),
                       cooling=ALL[name].cooled)  # fmt: skip
    with study.plant() as plant:
        timed = Timed(CONTROLLERS[controller](study, plant))
        if kept is not None:
            conformal_of(timed).values = np.array(kept)
        loop, seen = run_recorded(plant, timed, study.site)
        return loop, study.scenario(plant, seen), timed, spent


def conformal_of(timed: Timed) -> ConformalBackOff:
    """Back-off of optimal control that keeps a share."""
    found = getattr(timed.controller, "conformal", None)
    ControlError.unless(isinstance(found, ConformalBackOff), "controller", "one with a guarantee", type(found).__name__)
    return cast(ConformalBackOff, found)


def identified(name: str, out: Path) -> tuple[PlantModel, dict[str, Any]]:
    """Identify a plant by an experiment beside its coldest period, or read what came of it: model, and what it took."""
    path, folder = write_plant(name, out / "plants"), out / "models" / name
    file = folder / "spent.json"
    if not file.exists():
        begin = time.process_time()
        study = PlantStudy(path, None, *experiment_period(path, None, EXPERIMENT), cooling=ALL[name].cooled)
        made = run_experiment(study, EXPERIMENT, ExcitationSettings())
        found = identify(made.telemetry, made.machines)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / FILE).write_text(json.dumps(found.model.to_dict()) + "\n", encoding="utf-8")
        kpis = measure_kpis(made.run.record, made.scenario)
        spent = {"identify_cpu_seconds": time.process_time() - begin, "experiment_cost": kpis.cost_tot,
                 "experiment_discomfort": kpis.tdis_tot}  # fmt: skip
        file.write_text(json.dumps(spent) + "\n", encoding="utf-8")
    return read_model(folder), dict(json.loads(file.read_text(encoding="utf-8")))


def trained(name: str, path: Path, model: PlantModel) -> dict[str, float]:
    """Train SAC on the model of a plant, or read what that took."""
    from _foreign_sac import train

    file = _policy(path)
    took = file.with_suffix(".json")
    if not took.exists():
        took.write_text(json.dumps({"training_cpu_seconds": train(name, path, model, file)}) + "\n", encoding="utf-8")
    return dict(json.loads(took.read_text(encoding="utf-8")))


def _policy(path: Path) -> Path:
    """File of the policy of a plant."""
    return path.parent.parent.parent / "models" / path.parent.name / "sac.zip"


def _sac(study: PlantStudy) -> Controller:
    from _foreign_sac import SacController

    ControlError.unless(study.model is not None, "SAC", "a model of the plant", "none")
    return SacController(_policy(study.path), study.model, study)


def account(loop: ClosedLoopRun, scenario: Scenario, seconds: list[float]) -> dict[str, Any]:
    """Measure a run.

    Parameters
    ----------
    loop : ClosedLoopRun
        Two weeks.
    scenario : Scenario
        Prices and bands.
    seconds : list of float
        CPU time of each action [s].
    """
    record = loop.record
    kpis = measure_kpis(record, scenario)
    parts = round(scenario.grid.step / record.step)
    lower, upper = (np.repeat(edge, parts, axis=0)[: record.n_steps] for edge in (scenario.lower, scenario.upper))
    zone, hours = record.zone_temperature[1:], record.step / 3600.0
    cold, warm = ((by > _COLD).sum(axis=0).mean() * hours for by in (lower - zone, zone - upper))
    days = kpis.hours / 24.0
    return {
        "cost": kpis.cost_tot, "energy": kpis.ener_tot, "discomfort": kpis.tdis_tot,
        "below": float(np.mean([z.below for z in kpis.zones])), "above": float(np.mean([z.above for z in kpis.zones])),
        "zones": {z.zone: {"below": z.below, "above": z.above, "largest_below": z.largest_below} for z in kpis.zones},
        "hours_below": float(cold), "hours_above": float(warm), "starts_a_day": _starts(loop.measurements, days),
        "cpu_seconds": float(np.sum(seconds)), "days": days,
    }  # fmt: skip


def _starts(measurements: pd.DataFrame, days: float) -> float | None:
    """Count the compressor's starts a day that control steps show; None where there is none."""
    if _COMPRESSOR not in measurements:
        return None
    on = measurements[_COMPRESSOR].to_numpy() > _RUNS
    return float((on[1:] & ~on[:-1]).sum()) / days
