"""What controllers are compared on: a building with its plant, a stretch of time, weather, people and prices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, cast, get_args

import numpy as np
import pandas as pd

from calibration.evaluation.settings import ModelSettings
from mpc.control.controller.action import ControllerSettings
from mpc.errors import PlantError
from mpc.kpi.rewards import DISCOMFORT_PRICE
from mpc.loop.building import BuildingModel, GridBuilding
from mpc.loop.noise import SensorNoise
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.carbon import CarbonIntensity
from mpc.scenario.comfort import ComfortBand
from mpc.scenario.forecaster import ErrorGrowth, Forecaster
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import Occupancy
from mpc.scenario.paper import paper_carbon, paper_tariff
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import Tariff
from mpc.scenario.weather import Weather
from mpc.studies.controller import MODEL_STEP
from mpc.studies.devices import equip
from mpc.studies.model import ORDER, model_settings, reduced
from thermal.case.building import Building
from thermal.effects.catalogue import chosen
from thermal.errors import describe, nearest
from thermal.model.reduce import ReducedModel, reduced_model
from thermal.model.simulator import Simulator
from thermal.pilot.sizing import size_system
from thermal.system.system import HvacSystem

#: What steps the plant: the reduced model, its grid with the mean of the shuffle, or with the random shuffle.
PlantKind = Literal["reduced", "grid", "random"]

#: Time between two actions of optimal control, and of rules [s].
CONTROL_STEP = 900.0

#: How far forecasts reach [h].
HORIZON_HOURS = 12.0

_DAY = pd.Timedelta(days=1)


@dataclass(frozen=True, eq=False)
class Study:
    """A building in closed loop over a stretch of time, for one controller after the other; made by `make_study`.

    Parameters
    ----------
    name : str
        Of the case.
    scenario : Scenario
        Weather, people and prices of the run and of the last forecast, in steps of `MODEL_STEP`.
    steps : int
        Steps of the run.
    system : HvacSystem
        The plant.
    truth : ReducedModel
        The plant's building, few states: what the perfect bound knows.
    model : ReducedModel
        What optimal control believes of the building.
    built : ModelSettings
        How the plant's building is built.
    kind : {"reduced", "grid", "random"}
        How the plant's building steps: `mpc.loop.simulated_plant`.
    noise : SensorNoise or None
        Errors of what is measured.
    errors : mapping of str to ErrorGrowth
        Of the weather forecast; empty is a perfect one.
    settings : ControllerSettings
        Of optimal control.
    control_step : float
        Time between two actions of optimal control [s]; rules act every `MODEL_STEP`.
    seed : int
        Of all that is random.
    notes : tuple of str
        What was assumed, in words.
    """

    name: str
    scenario: Scenario
    steps: int
    system: HvacSystem
    truth: ReducedModel
    model: ReducedModel
    built: ModelSettings
    kind: PlantKind = "reduced"
    noise: SensorNoise | None = None
    errors: Mapping[str, ErrorGrowth] = field(default_factory=dict)
    settings: ControllerSettings = field(default_factory=ControllerSettings)
    control_step: float = CONTROL_STEP
    seed: int = 0
    notes: tuple[str, ...] = ()

    @property
    def building(self) -> Building:
        """The building, with its devices."""
        return self.scenario.building

    @property
    def stamps(self) -> pd.DatetimeIndex:
        """Ends of the run's steps, local."""
        return self.scenario.grid.stamps[: self.steps]

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
        if count < 1 or abs(count * MODEL_STEP - control_step) > 1e-6:
            raise PlantError(describe("control step", f"a multiple of {MODEL_STEP:g} s", f"{control_step:g} s"))
        ahead = round(HORIZON_HOURS * 3600.0 / MODEL_STEP)
        forecaster = Forecaster(
            self.scenario, ahead, {} if bound else self.errors, occupancy="actual" if bound else "expected",
            seed=self.seed,
        )  # fmt: skip
        known = bound and self.kind == "reduced"
        building = ReducedBuilding(self.truth, step_seconds=MODEL_STEP) if known else self._plants_building()
        return SimulatedPlant(
            self.scenario, self.system, building, control_steps=count, noise=None if bound else self.noise,
            forecaster=forecaster, seed=self.seed,
        )  # fmt: skip

    def _plants_building(self) -> BuildingModel:
        """Make the building that the plant steps, from the same parameters as the truth."""
        if self.kind == "reduced":
            return ReducedBuilding(reduced_model(self.truth.grid, [self.truth.theta]), step_seconds=MODEL_STEP)
        if self.built.structure != ModelSettings().structure:
            expected = "the usual structure of the model"
            raise PlantError(describe("plant on the grid", expected, "another", "take kind='reduced'"))
        values = zip(self.truth.network.parameters, self.truth.theta, strict=True)
        shuffle: Literal["mean", "random"] = "random" if self.kind == "random" else "mean"
        return GridBuilding(
            Simulator(
                self.building,
                {p.name: float(v) for p, v in values},
                MODEL_STEP,
                self.built.dx,
                shuffle=shuffle,
                reach=self.built.reach,
                seed=self.seed,
                scopes=self.built.scopes,
                effects=chosen(self.built.effects),
            )
        )


def check_kind(kind: str) -> PlantKind:
    """Refuse a kind of plant that is not known.

    Parameters
    ----------
    kind : str
        ``reduced``, ``grid`` or ``random``.

    Raises
    ------
    PlantError
        With the nearest one.
    """
    known = get_args(PlantKind)
    if kind not in known:
        raise PlantError(describe("plant", f"one of {', '.join(known)}", repr(kind), nearest(kind, known)))
    return cast(PlantKind, kind)


def make_study(
    building: Building,
    weather: Weather,
    start: str,
    end: str,
    *,
    parameters: str | Path | Mapping[str, float] | None = None,
    controller_parameters: str | Path | Mapping[str, float] | None = None,
    dx: float | None = None,
    kind: PlantKind = "reduced",
    system: HvacSystem | None = None,
    tariff: Tariff | None = None,
    carbon: CarbonIntensity | None = None,
    occupancy: Occupancy | None = None,
    comfort: ComfortBand | None = None,
    noise: SensorNoise | None = None,
    errors: Mapping[str, ErrorGrowth] | None = None,
    comfort_price: float = DISCOMFORT_PRICE,
    control_step: float = CONTROL_STEP,
    order: int | None = ORDER,
    seed: int = 0,
) -> Study:
    """Put together what controllers are compared on.

    Parameters
    ----------
    building : Building
        Devices of a plant that it lacks are assumed.
    weather : Weather
        Covers the run; where it ends before the last forecast does, its last day comes again.
    start, end : str
        ISO 8601; without an offset local to the building.
    parameters : str, Path or mapping of str to float, optional
        Of the building, and so of the plant: a ``calibration.json`` with its effects, or values by name [parameter
        units]; starting values by default.
    controller_parameters : str, Path or mapping of str to float, optional
        What optimal control believes [parameter units]; the same by default.
    dx : float, optional
        Distance between control volumes of a plan [m].
    kind : {"reduced", "grid", "random"}
        How the plant's building steps.
    system : HvacSystem, optional
        Its plant; sized by `thermal.pilot.size_system` by default.
    tariff : Tariff, optional
        Prices; those of the paper's simulator by default.
    carbon : CarbonIntensity, optional
        Emissions; those of the paper's simulator by default.
    occupancy : Occupancy, optional
        People; an office's schedule by default.
    comfort : ComfortBand, optional
        BOPTEST's office by default.
    noise : SensorNoise, optional
        Errors of what is measured; none by default.
    errors : mapping of str to ErrorGrowth, optional
        Of the weather forecast; perfect by default.
    comfort_price : float
        Of a zone's kelvin outside of its band for an hour [currency/K/h].
    control_step : float
        Time between two actions of optimal control [s].
    order : int, optional
        Largest number of states of the controller's model.
    seed : int
        Of all that is random.

    Returns
    -------
    Study
        To run controllers on.

    Raises
    ------
    PlantError
        When the weather does not cover the run.
    """
    ready, notes = equip(building)
    grid = StepGrid.between(start, end, MODEL_STEP, ready)
    longer = StepGrid(grid.start, MODEL_STEP, grid.n_steps + round(HORIZON_HOURS * 3600.0 / MODEL_STEP))
    built = model_settings(parameters, dx=dx)
    if system is None:
        notes += ("sizes of the plant follow from the building's loads (thermal.pilot.size_system)",)
    gains = None
    if "internal_gains" in built.effects:
        gains = InternalGains(sensible=0.0, equipment=0.0, lights=0.0)
        notes += ("heat of people and equipment is that of the calibrated effect, none is added",)
    prices = tariff or paper_tariff()
    scenario = build_scenario(
        ready, longer, _prolonged(weather, grid, longer), prices, carbon=carbon or paper_carbon(),
        occupancy=occupancy, gains=gains, comfort=comfort, seed=seed,
    )  # fmt: skip
    truth = reduced(built, ready, parameters, order)
    model = truth
    if controller_parameters is not None:
        model = reduced(model_settings(controller_parameters, dx=dx), ready, controller_parameters, order)
    return Study(
        building.name, scenario, grid.n_steps, system or size_system(ready), truth, model, built, kind, noise,
        dict(errors or {}), ControllerSettings(comfort_price=comfort_price, demand=tuple(prices.demand)), control_step,
        seed, notes,
    )  # fmt: skip


def _prolonged(weather: Weather, run: StepGrid, whole: StepGrid) -> Weather:
    """Let the last day of the weather come again where it ends after the run but before the last forecast."""
    known, last = weather.stamps, whole.stamps[-1]
    if weather.typical or known[-1] >= last:
        return weather
    if known[-1] < run.stamps[-1]:
        expected = f"values until {run.stamps[-1]}"
        raise PlantError(describe("weather", expected, f"until {known[-1]}", "end the run earlier"))
    day = weather.frame.loc[known > known[-1] - _DAY]
    count = int(np.ceil((last - known[-1]) / _DAY))
    parts = [weather.frame, *(day.set_axis(day.index + (k + 1) * _DAY) for k in range(count))]
    return replace(weather, frame=pd.concat(parts))
