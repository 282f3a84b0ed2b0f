"""What controllers are compared on: a building with its plant, a stretch of time, weather, people and prices."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from calibration.evaluation.settings import ModelSettings
from mpc.control.controller.site import ControllerSettings
from mpc.errors import PlantError
from mpc.kpi.rewards import DISCOMFORT_PRICE
from mpc.loop.building import BuildingModel
from mpc.loop.make import SimulationSettings, equip
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.model import ORDER, BuildingParameters, model_settings, reduced
from mpc.scenario.forecast import ErrorGrowth, Forecaster
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.scenario import Scenario
from mpc.scenario.weather import Weather
from mpc.studies.optimal_control import MODEL_STEP
from thermal.case.building import Building
from thermal.effects.catalogue import chosen
from thermal.effects.gains import INTERNAL_GAINS, has_people
from thermal.model.reduce import ReducedModel
from thermal.system.sizing import size_system
from thermal.system.system import HvacSystem

#: How far forecasts reach [h].
HORIZON_HOURS = 12.0

_DAY = pd.Timedelta(days=1)


@dataclass(frozen=True, kw_only=True)
class StudySettings(SimulationSettings):
    """Choices of `make_study`, beside those of `SimulationSettings`.

    Parameters
    ----------
    controller_parameters : str, Path, CalibrationResult or mapping of str to float, optional
        What optimal control believes [parameter units]; the same by default.
    order : int, optional
        Largest number of states of the controller's model.
    errors : mapping of str to ErrorGrowth
        Of the weather forecast; empty is a perfect one.
    comfort_price : float
        Of a zone's kelvin outside of its band for an hour [currency/K/h].
    control_step : float
        Time between two actions of optimal control [s]; rules act every `MODEL_STEP`.
    """

    controller_parameters: BuildingParameters | None = None
    order: int | None = ORDER
    errors: Mapping[str, ErrorGrowth] = field(default_factory=dict)
    comfort_price: float = DISCOMFORT_PRICE
    control_step: float = 900.0


@dataclass(frozen=True, eq=False)
class Study:
    """A building in closed loop over an interval, for one controller after the other; made by `make_study`.

    Parameters
    ----------
    name : str
        Name of the case.
    scenario : Scenario
        Weather, people and prices of the run and of the last forecast, in steps of `MODEL_STEP`.
    steps : int
        Steps of the run.
    system : HvacSystem
        HVAC system of the plant.
    truth : ReducedModel
        The plant's building, few states: what the perfect bound knows.
    model : ReducedModel
        What optimal control believes of the building.
    built : ModelSettings
        How the plant's building is built.
    settings : StudySettings
        What was chosen.
    notes : tuple of str
        What was assumed, in words.
    weather : str
        Where the weather is from, in words.
    """

    name: str
    scenario: Scenario
    steps: int
    system: HvacSystem
    truth: ReducedModel
    model: ReducedModel
    built: ModelSettings
    settings: StudySettings
    notes: tuple[str, ...] = ()
    weather: str = "as measured with the case"

    decided = "supply air and water"
    hours = HORIZON_HOURS
    about = (
        "The plant is simulated: the building of the case with the parameters given, in closed loop with air handlers, "
        "terminals and a boiler"
    )

    @property
    def comfort_price(self) -> float:
        """Of a zone's kelvin outside of its band for an hour [currency/K/h]."""
        return self.settings.comfort_price

    @property
    def facts(self) -> dict[str, Any]:
        """How the plant is simulated, for a file."""
        given = self.settings
        return {"building": given.kind, "step_seconds": self.scenario.grid.step, "noise": given.noise is not None,
                "effects": list(self.built.effects)}  # fmt: skip

    @property
    def setup(self) -> str:
        """How the plant is simulated, in words."""
        given = self.settings
        sensors = "sensors with noise" if given.noise else "exact sensors"
        weather = "with errors" if given.errors else "perfect"
        step = self.scenario.grid.step
        return f"building {given.kind}, steps of {step:g} s, {sensors}, weather forecast {weather}"

    @property
    def forecast(self) -> str:
        """Whether forecasts are ``perfect`` or ``with errors``."""
        return "with errors" if self.settings.errors else "perfect"

    @property
    def seed(self) -> int:
        """Of all that is random."""
        return self.settings.seed

    @property
    def building(self) -> Building:
        """The building, with its devices."""
        return self.scenario.building

    @property
    def stamps(self) -> pd.DatetimeIndex:
        """Ends of the run's steps, local."""
        return self.scenario.grid.stamps[: self.steps]

    @property
    def controller_settings(self) -> ControllerSettings:
        """Prices of discomfort and of demand, for optimal control."""
        demand = tuple(self.settings.tariff.demand)
        return ControllerSettings(comfort_price=self.settings.comfort_price, demand=demand)

    def plant(self, control_step: float, *, bound: bool = False) -> SimulatedPlant:
        """Make the plant, to be reset.

        Parameters
        ----------
        control_step : float
            Time between two actions [s], a multiple of `MODEL_STEP`.
        bound : bool
            The plant of the perfect bound: its sensors are exact, and forecasts know weather and people; of kind
            ``reduced`` its building is `truth` itself, whose state can be read.

        Raises
        ------
        PlantError
            When the control step is none.
        """
        count = round(control_step / MODEL_STEP)
        fits = count >= 1 and abs(count * MODEL_STEP - control_step) <= 1e-6
        PlantError.unless(fits, "control step", f"a multiple of {MODEL_STEP:g} s", f"{control_step:g} s")
        ahead = round(HORIZON_HOURS * 3600.0 / MODEL_STEP)
        forecaster = Forecaster(
            self.scenario, ahead, {} if bound else self.settings.errors,
            occupancy="actual" if bound else "expected", seed=self.settings.seed,
        )  # fmt: skip
        given, truth = self.settings, self.truth
        if bound and given.kind == "reduced":
            building: BuildingModel = ReducedBuilding(truth, step_seconds=MODEL_STEP)
        else:
            effects = chosen(self.built.effects)
            building = given.building_model(self.building, truth.grid, truth.theta, self.built, effects, MODEL_STEP)
        return SimulatedPlant(
            self.scenario, self.system, building, control_steps=count, forecaster=forecaster,
            noise=None if bound else given.noise, seed=given.seed,
        )  # fmt: skip


def make_study(
    building: Building, weather: Weather, start: str, end: str, settings: StudySettings | None = None
) -> Study:
    """Put together what controllers are compared on.

    Parameters
    ----------
    building : Building
        Devices of an HVAC system that it lacks are assumed.
    weather : Weather
        Covers the run; where it ends before the last forecast does, its last day comes again.
    start, end : str
        ISO 8601; without an offset local to the building.
    settings : StudySettings, optional
        All that has a default.

    Returns
    -------
    Study
        To run controllers on.

    Raises
    ------
    PlantError
        When the weather does not cover the run.
    """
    given, (ready, notes) = settings or StudySettings(), equip(building)
    grid = StepGrid.between(start, end, MODEL_STEP, ready)
    longer = StepGrid(grid.start, MODEL_STEP, grid.n_steps + round(HORIZON_HOURS * 3600.0 / MODEL_STEP))
    built = model_settings(given.parameters, dx=given.dx)
    if given.system is None:
        notes += ("sizes of the plant follow from the loads of the building",)
    gains = None
    if has_people(building, built.effects):
        gains = InternalGains(sensible=0.0, equipment=0.0, lights=0.0)
        notes += ("heat of people and equipment is that of the calibrated effect, none is added",)
    elif rooms := built.effects.get(INTERNAL_GAINS.id):
        own = ", ".join(rooms)
        notes += (f"heat of the calibrated effect in {own} is there beside people and equipment of all rooms",)
    scenario = given.scenario(ready, longer, _prolonged(weather, grid, longer), gains)
    truth = model = reduced(built, ready, given.parameters, given.order)
    if given.controller_parameters is not None:
        believed = model_settings(given.controller_parameters, dx=given.dx)
        model = reduced(believed, ready, given.controller_parameters, given.order)
    system = given.system or size_system(ready)
    source = _weather_words(weather)
    return Study(building.name, scenario, grid.n_steps, system, truth, model, built, given, notes, source)


def _weather_words(weather: Weather) -> str:
    """Say where weather is from."""
    if weather.estimated:
        return "as measured with the case, but for irradiance, which is estimated from each day's range of temperature"
    if not weather.typical:
        return "as measured with the case"
    place = weather.location
    return f"a typical year from a file, no particular day, at {place.latitude:.2f}°, {place.longitude:.2f}°"


def _prolonged(weather: Weather, run: StepGrid, whole: StepGrid) -> Weather:
    """Let the last day of the weather come again where it ends after the run but before the last forecast."""
    known, last = weather.stamps, whole.stamps[-1]
    if weather.typical or known[-1] >= last:
        return weather
    expected, found = f"values until {run.stamps[-1]}", f"until {known[-1]}"
    PlantError.unless(known[-1] >= run.stamps[-1], "weather", expected, found, "end the run earlier")
    day = weather.frame.loc[known > known[-1] - _DAY]
    count = int(np.ceil((last - known[-1]) / _DAY))
    parts = [weather.frame, *(day.set_axis(day.index + (k + 1) * _DAY) for k in range(count))]
    return replace(weather, frame=pd.concat(parts))
