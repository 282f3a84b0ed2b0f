"""What controllers of a described plant are compared on: its description, a period, and a model where there is one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from mpc.adapters.boptest.scenario import PERIOD_DAYS
from mpc.adapters.described.actuators import described_actuator, described_actuators
from mpc.adapters.described.load import load_plant
from mpc.adapters.described.programs import SiteProgram
from mpc.adapters.described.read import read_description
from mpc.adapters.described.schema import PlantFile
from mpc.adapters.described.seen import seen_scenario
from mpc.baselines.plants import FullSpeed
from mpc.control.identified.controller import IdentifiedController, IdentifiedSettings
from mpc.errors import ControlError, PlantError
from mpc.identify.machines import Machine, check_terminals, find_machines
from mpc.identify.model import PlantModel
from mpc.identify.telemetry import SET, PlantTelemetry, Site
from mpc.loop.actuators import COOLING_SETPOINT, Actuator
from mpc.scenario.scenario import Scenario
from mpc.studies.electric import electric_of

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
    cooling : bool
        Whether it chooses setpoints of cooling.
    """

    path: Path
    at: str | None = None
    start: str | None = None
    end: str | None = None
    model: PlantModel | None = None
    settings: IdentifiedSettings = field(default_factory=IdentifiedSettings)
    actuators: tuple[str, ...] = ()
    cooling: bool = False

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
        areas, source = {name: zone.floor_area for name, zone in file.zones.items()}, file.source
        if source is None:
            return Site(file.name, areas, file.location)
        heats, cools = (source.heating, source.heating_water), (source.cooling, source.cooling_water)
        sheet, name = cools if self._cools else heats
        water = None if name is None else described_actuator(name, file.actuators[name])
        return Site(file.name, areas, file.location, sheet, water)

    @property
    def _cools(self) -> bool:
        """Whether what is controlled cools."""
        if self.model is not None:
            return self.model.sign < 0.0
        return self.cooling or any(name.endswith(COOLING_SETPOINT) for name in self.actuators)

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
            return tuple(found.machine for found in self.model.bound(plant.actuators).maps)
        return self._found(plant.actuators, plant.columns, plant.zone_names)

    def _found(self, actuators: Iterable[Actuator], columns: Any, zones: Any) -> tuple[Machine, ...]:
        """Find machines among actuators: a battery is none."""
        electric, told = electric_of(self.description), self.description.actuators
        of_machines = [a for a in actuators if electric is None or a.name != electric.command]
        sheets = {name: told[name].capacity for name in told}
        found = find_machines(of_machines, columns, zones, self.actuators, sheets, cooling=self.cooling)
        if self.site.capacity:
            check_terminals(found, self.description.zones)
        return found

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
        return self._found(described_actuators(self.description), columns, tuple(self.site.areas))

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
        electric, place = electric_of(self.description), self.site.location
        return IdentifiedController(self.model, plant.actuators, place, self.settings, electric)

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
            asked, side = given.guarantee, "below" if self.study.model.sign > 0.0 else "above"
            found.append(
                f"{asked.share:.3g} of the occupied steps may lie {side} the band: the distance that is kept from it "
                f"is adapted within {asked.lowest:g} to {asked.highest:g} K"
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
