"""A controller on a foreign plant for two weeks, and what came of it."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from _foreign_rules import FullSpeed, Own, ProportionalIntegral
from foreign_models.periods import DAYS, WARM_UP, starts
from foreign_models.plants import PLANTS, write_plant

from mpc.adapters.described.load import load_plant
from mpc.adapters.energyplus.input import weather_path
from mpc.adapters.energyplus.signals import EnergyPlusSignalPlant
from mpc.errors import PlantError
from mpc.kpi.kpis import measure_kpis
from mpc.loop.plant import Controller, Measurements
from mpc.loop.run import ClosedLoopRun, run_closed_loop
from mpc.scenario.forecast import Forecast
from mpc.scenario.scenario import Scenario

#: Starts are those of compressors: of what has these points and this name.
_COMPRESSOR = "heat_pump/electrical_power_sensor"
_RUNS = 200.0  # W that a compressor draws when it runs; crankcase heaters draw 50
_COLD = 0.01  # K below the band that count as time below it

RULES = {
    "own": lambda plant: Own(),
    "rule": lambda plant: FullSpeed(plant.actuators, plant.zone_names),
    "long rule": lambda plant: FullSpeed(plant.actuators, plant.zone_names, lead=6.0),
    "pi": lambda plant: ProportionalIntegral(plant.actuators, plant.zone_names),
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


def period(name: str, which: str) -> dict[str, Any]:
    """Return the period of a description: ``coldest`` or ``typical`` of a plant."""
    begin = starts(weather_path(PLANTS[name].weather))[which]
    return {"start": begin, "days": DAYS, "warm_up_days": WARM_UP}


def run_rule(name: str, which: str, controller: str, folder: Path) -> dict[str, Any]:
    """Let a rule run a plant, or its own control."""
    with load_plant(write_plant(name, folder), changes={"period": period(name, which)}) as plant:
        timed = Timed(RULES[controller](plant))
        run = run_closed_loop(plant, timed, forecasts=controller != "own")
        return account(run, scenario_of(plant), timed.seconds)


def scenario_of(plant: EnergyPlusSignalPlant) -> Scenario:
    """Return prices and bands of a plant."""
    if plant.forecaster is None:
        raise PlantError("foreign plant", "prices in its description", "none")
    return plant.forecaster.scenario


def account(run: ClosedLoopRun, scenario: Scenario, seconds: list[float]) -> dict[str, Any]:
    """Measure a run.

    Parameters
    ----------
    run : ClosedLoopRun
        Two weeks.
    scenario : Scenario
        Prices and bands.
    seconds : list of float
        CPU time of each action [s].
    """
    kpis = measure_kpis(run.record, scenario)
    parts = round(scenario.grid.step / run.record.step)
    lower = np.repeat(scenario.lower, parts, axis=0)[: run.record.n_steps]
    cold = (run.record.zone_temperature[1:] < lower - _COLD).sum(axis=0) * run.record.step / 3600.0
    days = kpis.hours / 24.0
    return {
        "cost": kpis.cost_tot, "energy": kpis.ener_tot, "discomfort": kpis.tdis_tot,
        "below": float(np.mean([z.below for z in kpis.zones])), "above": float(np.mean([z.above for z in kpis.zones])),
        "zones": {z.zone: {"below": z.below, "above": z.above, "largest_below": z.largest_below} for z in kpis.zones},
        "hours_below": float(cold.mean()), "starts_a_day": _starts(run.measurements, days),
        "cpu_seconds": float(np.sum(seconds)), "days": days,
    }  # fmt: skip


def _starts(measurements: pd.DataFrame, days: float) -> float | None:
    """Count the compressor's starts a day that control steps show; None where there is none."""
    if _COMPRESSOR not in measurements:
        return None
    on = measurements[_COMPRESSOR].to_numpy() > _RUNS
    return float((on[1:] & ~on[:-1]).sum()) / days
