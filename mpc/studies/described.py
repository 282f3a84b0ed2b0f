"""What controllers of a described plant are compared on: its description, a period, and a model where there is one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from mpc.adapters.boptest.scenario import PERIOD_DAYS
from mpc.adapters.described.actuators import described_actuators
from mpc.adapters.described.load import load_plant, period_of
from mpc.adapters.described.programs import SiteProgram
from mpc.adapters.described.read import read_description
from mpc.adapters.described.schema import PlantFile
from mpc.adapters.described.seen import seen_scenario
from mpc.baselines.plants import FullSpeed
from mpc.control.identified.controller import IdentifiedController, IdentifiedSettings
from mpc.control.identified.electric import Electric, Photovoltaic
from mpc.errors import ControlError, PlantError
from mpc.identify.excitation import Excitation, ExcitationSettings
from mpc.identify.machines import Machine, find_machines
from mpc.identify.model import PlantModel
from mpc.identify.telemetry import SET, PlantTelemetry, Site, run_recorded
from mpc.loop.actuators import Actuator
from mpc.loop.run import ClosedLoopRun
from mpc.scenario.scenario import Scenario
from thermal.components.battery import Battery

#: Warm-up before an experiment or a run whose period is given by its start [d], as of BOPTEST.
WARM_UP_DAYS = 7.0


@dataclass(frozen=True, eq=False)
class PlantStudy:
    """A described plant over a period.

    Parameters
    ----------
    path : Path
        The ``plant.yaml``, or the name of a ready one.
    at : str, optional
        A unit or server in the place of the description's own.
    start, end : str, optional
        Local, ISO 8601; the description's own period by default.
    model : PlantModel, optional
        For controllers that need one.
    settings : IdentifiedSettings
        Of optimal control.
    actuators : tuple of str
        What is controlled where there is no model; `find_machines` chooses by default.
    """

    path: Path
    at: str | None = None
    start: str | None = None
    end: str | None = None
    model: PlantModel | None = None
    settings: IdentifiedSettings = field(default_factory=IdentifiedSettings)
    actuators: tuple[str, ...] = ()

    decided = "the machines' runs and loads"

    @cached_property
    def description(self) -> PlantFile:
        """As read, for the period."""
        return read_description(self.path, at=self.at, changes=self._changes)

    @cached_property
    def _changes(self) -> dict[str, Any]:
        if self.start is None and self.end is None:
            return {}
        if self.start is None or self.end is None:
            raise PlantError("period", "--start and --end, or neither", f"{self.start} to {self.end}")
        begin, end = pd.Timestamp(self.start), pd.Timestamp(self.end)
        days = (end - begin).total_seconds() / 86_400.0
        PlantError.unless(days > 0.0, "period", "an end after the start", f"{self.start} to {self.end}")
        return {"period": {"start": str(self.start), "days": days, "warm_up_days": WARM_UP_DAYS}}

    @property
    def name(self) -> str:
        """Of the plant."""
        return self.description.name

    @property
    def site(self) -> Site:
        """Zones and place."""
        file = self.description
        return Site(file.name, {name: zone.floor_area for name, zone in file.zones.items()}, file.location)

    def plant(self) -> Any:
        """Make the plant, to be reset, and freed by leaving a ``with`` block."""
        return load_plant(self.path, at=self.at, changes=self._changes)

    def scenario(self, plant: Any, seen: PlantTelemetry) -> Scenario:
        """Scenario that a run's indicators are measured by.

        Parameters
        ----------
        plant : ForeignPlant
            Of this study.
        seen : PlantTelemetry
            Of the run: a server's scenario is what it forecast for each step.

        Raises
        ------
        PlantError
            When the description says too little.
        """
        forecaster = getattr(plant, "forecaster", None)
        if forecaster is None:
            return seen_scenario(self.description, seen.frame, seen.step)
        return forecaster.scenario  # type: ignore[no-any-return]

    def steps(self, plant: Any) -> int:
        """Count the control steps of a run.

        Parameters
        ----------
        plant : ForeignPlant
            Of this study.

        Raises
        ------
        PlantError
            When nothing forecasts weather, prices and bands, which controllers and indicators need.
        """
        forecaster, file = getattr(plant, "forecaster", None), self.description
        if forecaster is not None:
            return int(forecaster.scenario.grid.n_steps - forecaster.horizon)
        expected, advice = "weather, prices and bands in its description", "name `weather` and `prices`"
        PlantError.unless(file.plant.kind == "boptest", f"plant {self.name}", expected, "none", advice)
        days = PERIOD_DAYS if isinstance(file.period, str) else file.period.days
        return round(days * 86_400.0 / float(plant.control_step))

    def machines(self, plant: Any) -> tuple[Machine, ...]:
        """Actuators that are controlled.

        Parameters
        ----------
        plant : ForeignPlant
            Of this study.
        """
        if self.model is not None:
            return tuple(found.machine for found in self.model.maps)
        actuators = self._of_machines(plant.actuators)
        return find_machines(actuators, plant.columns, plant.zone_names, self.actuators, self._capacities)

    def _of_machines(self, actuators: Iterable[Actuator]) -> tuple[Actuator, ...]:
        """Leave out the battery's, which is not identified."""
        electric = self.electric
        return tuple(a for a in actuators if electric is None or a.name != electric.command)

    @property
    def _capacities(self) -> dict[str, tuple[tuple[float, float], ...]]:
        """What data sheets say, by actuator."""
        return {name: entry.capacity for name, entry in self.description.actuators.items()}

    def seen_machines(self, seen: PlantTelemetry) -> tuple[Machine, ...]:
        """Actuators that are controlled, where there is telemetry: a real building has no program to ask.

        Parameters
        ----------
        seen : PlantTelemetry
            Of the plant.
        """
        if not isinstance(self.description.plant, SiteProgram):
            with self.plant() as there:
                return self.machines(there)
        columns = [str(name) for name in seen.frame if not str(name).startswith(SET)]
        actuators = self._of_machines(described_actuators(self.description))
        return find_machines(actuators, columns, tuple(self.site.areas), self.actuators, self._capacities)

    def optimal(self, plant: Any) -> IdentifiedController:
        """Make optimal control.

        Parameters
        ----------
        plant : ForeignPlant
            Of this study.

        Raises
        ------
        ControlError
            When there is no model, or it is of another control step.
        """
        if self.model is None:
            raise ControlError("mpc", "a model of the plant", "none", "pass --model, from: buildingmpc identify")
        ControlError.unless(
            abs(self.model.step - plant.control_step) < 1e-6, "mpc", f"steps of {self.model.step:g} s of its model",
            f"{plant.control_step:g} s", "identify the plant anew",
        )  # fmt: skip
        return IdentifiedController(self.model, plant.actuators, self.site.location, self.settings, self.electric)

    @property
    def electric(self) -> Electric | None:
        """Battery, photovoltaics and charges; None where electricity has a price only."""
        entry, prices = self.description.electric, self.description.prices
        demand = 0.0 if prices is None or prices.demand is None else prices.demand
        if entry is None:
            return Electric(demand=demand) if demand else None
        modules = None if entry.photovoltaic is None else Photovoltaic(**entry.photovoltaic.model_dump())
        told = entry.battery
        if told is None:
            return Electric(photovoltaic=modules, feed_in=entry.feed_in, demand=demand)
        battery = Battery(told.capacity, told.power, told.charging, told.discharging)
        return Electric(battery, told.command, told.level, modules, entry.feed_in, demand)

    def full_speed(self, plant: Any) -> FullSpeed:
        """Make the rule.

        Parameters
        ----------
        plant : ForeignPlant
            Of this study.
        """
        return FullSpeed(self.machines(plant))


@dataclass(frozen=True, eq=False)
class SeenStudy:
    """A study of a described plant once its scenario is known: what reports and comparisons say of it.

    Parameters
    ----------
    study : PlantStudy
        What was run.
    scenario : Scenario
        Weather, people, prices and bands on the control steps.
    steps : int
        Control steps of the run.
    """

    study: PlantStudy
    scenario: Scenario
    steps: int

    @property
    def name(self) -> str:
        """Of the plant."""
        return self.study.name

    @property
    def stamps(self) -> pd.DatetimeIndex:
        """Ends of the run's steps, local."""
        return self.scenario.grid.stamps[: self.steps]

    @property
    def decided(self) -> str:
        """What optimal control decides on, in words."""
        return self.study.decided

    @property
    def hours(self) -> float:
        """How far optimal control looks ahead [h]."""
        return self.study.description.forecast.hours

    @property
    def comfort_price(self) -> float:
        """Of a zone's kelvin outside of its band for an hour [currency/K/h]."""
        return self.study.settings.comfort_price

    @property
    def about(self) -> str:
        """What stands for the building, in words."""
        return f"The plant is {self.setup}"

    @property
    def setup(self) -> str:
        """What stands for the building, and how well its weather is foreseen, in words."""
        file = self.study.description
        kind = {"fmu": "a functional mock-up unit", "boptest": "a test case of a BOPTEST server",
                "energyplus": "a building of EnergyPlus"}[file.plant.kind]  # fmt: skip
        return f"{kind}, control steps of {file.control_step:g} s, weather forecast {self.forecast}"

    @property
    def forecast(self) -> str:
        """Whether forecasts are ``perfect`` or ``with errors``."""
        return "perfect" if self.study.description.forecast.errors == "none" else "with errors"

    @property
    def facts(self) -> dict[str, Any]:
        """What stands for the building, for a file."""
        return {"building": self.study.description.plant.kind, "step_seconds": self.scenario.grid.step}

    @property
    def seed(self) -> int:
        """Of forecasts' errors."""
        return self.study.description.forecast.seed

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed, in words."""
        given = self.study.settings
        if self.study.model is None:
            return ()
        found = [f"a start of a machine counts {given.start_price:g} {self.scenario.currency} for optimal control, and "
                 f"it makes {given.starts} in 24 hours at most"]  # fmt: skip
        if given.guarantee is not None:
            asked = given.guarantee
            found.append(
                f"{asked.share:.3g} of the occupied steps may lie below the band: the distance that is kept from it is "
                f"adapted within {asked.lowest:g} to {asked.highest:g} K"
            )
        return tuple(found)


@dataclass(frozen=True, eq=False)
class RecordedPlant:
    """What a run of a described plant left: its telemetry.

    Parameters
    ----------
    seen : PlantTelemetry
        Of the run.
    columns : tuple of str
        What the plant measures.
    control_step : float
        [s].
    """

    seen: PlantTelemetry
    columns: tuple[str, ...]
    control_step: float

    def telemetry(self) -> pd.DataFrame:
        """Telemetry with what was set, forecast and bought [library's units]."""
        return self.seen.frame


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
        excitation = Excitation(machines, plant.control_step, settings)
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
