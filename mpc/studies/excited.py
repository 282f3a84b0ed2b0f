"""An excitation of a described plant: when, how long, and what came of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from mpc.adapters.described.load import period_of
from mpc.adapters.described.read import read_description
from mpc.errors import PlantError
from mpc.identify.excitation import Excitation, ExcitationSettings
from mpc.identify.machines import Machine
from mpc.identify.telemetry import PlantTelemetry, run_recorded
from mpc.identify.water_regression import decided_water
from mpc.loop.run import ClosedLoopRun
from mpc.scenario.scenario import Scenario
from mpc.studies.described import PlantStudy


@dataclass(frozen=True)
class Experiment:
    """An excitation of a plant, and what it took.

    Parameters
    ----------
    telemetry : PlantTelemetry
        What was seen.
    run : ClosedLoopRun
        The loop.
    scenario : Scenario
        Prices and bands.
    machines : tuple of Machine
        What was set.
    handed_back : float
        Share of the steps of machines that the plant had back [-].
    """

    telemetry: PlantTelemetry
    run: ClosedLoopRun
    scenario: Scenario
    machines: tuple[Machine, ...]
    handed_back: float = field(default=0.0)


def run_experiment(
    study: PlantStudy, days: int, settings: ExcitationSettings, progress: Callable[[str, int, int], None] | None = None
) -> Experiment:
    """Excite a plant.

    Parameters
    ----------
    study : PlantStudy
        Its plant, from its start on; see `experiment_period` for that.
    days : int
        Length [d].
    settings : ExcitationSettings
        Choices.
    progress : callable, optional
        Called with stage, done, total.
    """
    with study.plant() as plant:
        study.steps(plant)  # refuses a plant without forecasts before it runs
        machines = study.machines(plant)
        water = decided_water(study.site, machines)
        excitation = Excitation(machines, plant.control_step, settings, water)
        steps = round(days * 86_400.0 / plant.control_step)
        report = None if progress is None else (lambda done, _: progress("experiment", done, steps))
        run, telemetry = run_recorded(plant, excitation, study.site, steps, report)
        scenario = study.scenario(plant, telemetry)
    return Experiment(telemetry, run, scenario, machines, excitation.handed_back / (steps * len(machines)))


def experiment_period(path: Path, at: str | None, days: int, start: str | None = None) -> tuple[str, str]:
    """Days for an experiment: those before the description's period, or after it where the year has too few before.

    Parameters
    ----------
    path : Path
        The description.
    at : str or None
        Unit or server in the place of its own.
    days : int
        Length [d].
    start : str, optional
        When it begins, in the place of that.

    Returns
    -------
    tuple of str
        Start and end, local.

    Raises
    ------
    PlantError
        When the start is no time.
    """
    if start is not None:
        try:
            return start, str(pd.Timestamp(start) + pd.Timedelta(days=days))
        except ValueError as error:
            raise PlantError("--start", "a local time such as 2023-01-09 00:00", repr(start)) from error
    own, length = period_of(path, read_description(path, at=at))
    begin = own - pd.Timedelta(days=days)
    if begin.year < own.year or begin.day_of_year < 2:
        begin = own + pd.Timedelta(days=length)
    first, last = (f"{time.tz_localize(None):%Y-%m-%d %H:%M}" for time in (begin, begin + pd.Timedelta(days=days)))
    return first, last
