"""The office of 12 zones that optimal control and learned policies are compared on: plant, models, weeks.

The office is generated (12 zones, 600 m2, two floors, seed 1), its plant sized from its loads. What it truly is
(`TRUTH`) differs from the library's starting values, and it has sun, leakage and a leakier facade in the wind, which
the baseline lacks. The models of it are made from three weeks of telemetry before anybody moved in, by the library's
own commands: ``before`` is the calibrated baseline, ``after`` the model of the diagnosis. Both are kept as a
``calibration.json`` beside the policies that were trained with them.

Everybody acts each quarter of an hour on supply air (285 to 300 K, common to both air handlers) and supply water (310
to 355 K), sees the same noisy measurements, and the same forecasts over twelve hours with errors that grow.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar

import pandas as pd
from _site import POLICIES, Site, Week, World

from calibration import CalibrationSettings, calibrate
from calibration.diagnosis.diagnosis import diagnose
from mpc.baselines.guideline36 import Guideline36
from mpc.baselines.rules import OutdoorReset, day_schedule
from mpc.control.controller.controller import MpcController
from mpc.control.controller.site import ControllerSettings
from mpc.control.problem.horizon import Horizon
from mpc.control.solvers.uncertainty import Margin
from mpc.environment.environment import ScenarioPlant
from mpc.environment.layout import SUPPLY_SETPOINTS
from mpc.loop.make import pilot_weather
from mpc.loop.noise import SensorNoise
from mpc.loop.plant import Controller
from mpc.loop.reduced import ReducedBuilding
from mpc.loop.run import FixedSetpoints
from mpc.loop.simulated import SimulatedPlant
from mpc.model import ORDER, control_model
from mpc.reports.diagnosis import write_diagnosis
from mpc.scenario.forecast import DAY_AHEAD_ERRORS, Forecaster
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import paper_carbon, paper_tariff
from mpc.studies.optimal_control import default_horizon, make_controller, make_sampling_controller, site_points
from mpc.studies.registry import KnownState
from thermal import Building, Case
from thermal.effects.catalogue import chosen
from thermal.model.reduce import ReducedModel
from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system
from thermal.system.system import HvacSystem

EFFECTS = ("solar_gain", "infiltration")
#: Parameters of the building that differ from the library's starting values [parameter units].
TRUTH = {
    "solar_heat_gain_coefficient": 0.3, "infiltration_rate": 0.25, "infiltration_by_wind": 0.03,
    "window_u_value": 1.8, "exterior_wall_conductivity": 0.4, "furniture_heat_capacity": 22000.0,
    "slab_heat_capacity": 110000.0, "interior_film_coefficient": 3.0,
}  # fmt: skip

STEP, CONTROL_STEPS, DX = 300.0, 3, 1.0
HORIZON_HOURS = 12.0
WARM_UP_DAYS = 3
#: What do-mpc solves: steps of a quarter of an hour, fewer of them and fewer modes, for the sake of its time.
PEER_HOURS, PEER_ORDER = 6.0, 30
_MODELS: dict[str, World] = {"mpc_before": "before", "mpc_after": "after", "bound": "plant"}


@dataclass(frozen=True)
class Size:
    """How much of the case is run; `SMOKE` is for tests.

    Parameters
    ----------
    zones : int
        Of the office.
    floor_area : float
        Of all floors [m2].
    days : int
        Length of the weeks [d].
    """

    zones: int = 12
    floor_area: float = 600.0
    days: int = 7


FULL, SMOKE = Size(), Size(zones=4, floor_area=200.0, days=1)


@cache
def office(size: Size = FULL) -> Building:
    """Draw the building."""
    return pilot_building(1, floor_area=size.floor_area, zones=size.zones, name="office")


@cache
def sized(size: Size = FULL) -> HvacSystem:
    """Size its plant."""
    return size_system(office(size))


def scenario_of(start: str, seed: int, days: float, gains: InternalGains | None = None, size: Size = FULL) -> Scenario:
    """Make weather, people and prices from a day on."""
    begin = pd.Timestamp(start)
    grid = StepGrid.between(start, (begin + pd.Timedelta(days=days)).isoformat(), STEP, office(size))
    weather = pilot_weather(seed, start, int(days) + 1.0)
    everybody = build_scenario(office(size), grid, weather, paper_tariff(), carbon=paper_carbon(), gains=gains)
    return everybody.redrawn(seed)


@cache
def known_model(world: World, size: Size = FULL, order: int = ORDER) -> ReducedModel:
    """Make the reduced model of the building as it is, or as a model has it, with a number of states at most."""
    if world == "plant":
        return control_model(office(size), TRUTH, dx=DX, effects=chosen(EFFECTS), order=order)
    if size != FULL:  # tests have no telemetry: a model that is wrong in the same ways
        return control_model(office(size), dx=DX, order=order)
    return control_model(office(), model_file(world), order=order)


def building_model(world: World, size: Size = FULL) -> ReducedBuilding:
    """Make the building as it is, or as a model has it; a new one each time, as a plant steps it."""
    return ReducedBuilding(known_model(world, size), step_seconds=STEP)


def model_file(world: World) -> Path:
    """Where the parameters of a model of the building are."""
    return POLICIES / "office" / f"model_{world}_diagnosis.json"


def posterior_file() -> Path:
    """Where the models are that the diagnosis leaves possible."""
    return POLICIES / "office" / "posterior.json"


@dataclass(frozen=True)
class OfficeSite(Site):
    """The office, whole or small.

    Parameters
    ----------
    size : Size
        How much of it.
    """

    size: Size = FULL

    key = "office"
    hours_a_step = CONTROL_STEPS * STEP / 3600.0
    block_ends = (0.5, 1.0, 2.0, 3.0, 4.5, 6.0, 9.0, 12.0)
    actions = SUPPLY_SETPOINTS
    discomfort_price, reward_scale = 1.0, 10.0
    budget: ClassVar[Mapping[str, int]] = {"ppo": 150_000, "sac": 30_000}
    rules = ("floor", "schedule", "reset", "guideline36")
    optimal = ("mpc_before", "mpc_after", "bound")
    sampling = ("mpc_sampling",)
    #: do-mpc, and our solver on the very problem that do-mpc solves.
    peers = ("do_mpc", "mpc_as_do_mpc")
    #: Weather of seeds that nothing else has.
    test_weeks: ClassVar[Mapping[str, Week]] = {
        "winter": ("2024-01-15", 901),
        "spring": ("2024-04-15", 902),
        "summer": ("2024-07-15", 903),
    }
    validation_weeks: ClassVar[Mapping[str, Week]] = {"winter": ("2023-02-06", 801), "summer": ("2023-08-07", 802)}
    #: Every other of two years.
    training_weeks: ClassVar[Mapping[str, Week]] = {
        f"{start:%Y-%m-%d}": (f"{start:%Y-%m-%d}", 1000 + k)
        for k, start in enumerate(pd.date_range("2021-01-04", periods=52, freq="14D"))
    }

    @property
    def name(self) -> str:
        """For tables."""
        return f"our office, {self.size.zones} zones, {self.size.floor_area:.0f} m2"

    @property
    def days(self) -> int:
        """Length of the weeks [d]."""
        return self.size.days

    def plant(self, week: Week, world: World = "plant", *, bound: bool = False) -> SimulatedPlant:
        """Make the plant of a week; that of the bound has exact sensors and knows the weather and who comes."""
        scenario = scenario_of(*week, self.size.days + HORIZON_HOURS / 24.0, size=self.size)
        errors = None if bound else DAY_AHEAD_ERRORS
        forecaster = Forecaster(
            scenario, round(HORIZON_HOURS * 3600.0 / STEP), errors, occupancy="actual" if bound else "expected",
            seed=week[1],
        )  # fmt: skip
        return SimulatedPlant(
            scenario, sized(self.size), building_model(world, self.size), control_steps=CONTROL_STEPS,
            noise=None if bound else SensorNoise(), forecaster=forecaster, warm_up_days=WARM_UP_DAYS, seed=week[1],
        )  # fmt: skip

    def controller(self, name: str, price: float, plant: ScenarioPlant) -> Controller:
        """Make a controller that does not learn."""
        if not isinstance(plant, SimulatedPlant):
            raise TypeError(f"expected a plant of this site, found {type(plant).__name__}")
        if name in self.peers:
            return self.peer(name, price, plant)
        if name in self.optimal:
            model = known_model(_MODELS[name], self.size)
            return make_controller(
                model, plant, settings=ControllerSettings(comfort_price=price),
                horizon=default_horizon(plant.control_step, HORIZON_HOURS),
                observer=KnownState(model, plant) if name == "bound" else None,
            )  # fmt: skip
        if name in self.sampling:
            model, settings = known_model("after", self.size), ControllerSettings(comfort_price=price)
            return make_sampling_controller(model, plant, settings=settings, hours=HORIZON_HOURS)
        required = tuple(a for a in plant.actuators if a.required)
        points = site_points(office(self.size), plant.devices)
        if name == "floor":
            kinds = {"supply_air_temperature_setpoint": 300.0, "supply_water_temperature_setpoint": 310.0}
            return FixedSetpoints(kinds, required)
        if name == "schedule":
            return day_schedule(required)
        if name == "reset":
            return OutdoorReset(required, points.weather_station)
        return Guideline36(points, plant.system.terminals.air_handler.tolist(), required)

    def make_models(self, work: Path) -> None:
        """Record telemetry, calibrate and diagnose; keeps both models in `policies`."""
        case = commissioning()
        self.policies.mkdir(parents=True, exist_ok=True)
        baseline = calibrate(case, settings=CalibrationSettings(dx=DX))
        model_file("before").write_text(json.dumps(baseline.to_dict(), indent=1) + "\n", encoding="utf-8")
        write_diagnosis(diagnose(case, dx=DX), case, work / self.key, force=True)
        shutil.copyfile(work / self.key / "calibration.json", model_file("after"))
        shutil.copyfile(work / self.key / "posterior.json", posterior_file())

    def peer(self, name: str, price: float, plant: SimulatedPlant, hours: float = PEER_HOURS) -> MpcController:
        """Make optimal control with do-mpc as its solver, or with ours on the same problem."""
        model = known_model("after", self.size, order=PEER_ORDER)
        steps = round(hours * 3600.0 / plant.control_step)
        # do-mpc's slacks are linear from the edge of a band on: a margin belongs to a penalty that begins softly
        back_off = Margin(0.0) if name == "do_mpc" else None
        ours = make_controller(
            model, plant, settings=ControllerSettings(comfort_price=price, back_off=back_off),
            horizon=Horizon.regular(hours, plant.control_step, steps),
        )  # fmt: skip
        if name == "mpc_as_do_mpc":
            return ours
        from _do_mpc_loop import do_mpc_controller  # needs do-mpc

        return do_mpc_controller(ours)


def commissioning() -> Case:
    """Record three weeks before anybody moved in, under changing supply setpoints."""
    nobody = InternalGains(sensible=0.0, latent=0.0, equipment=0.0, lights=0.0)
    scenario = scenario_of("2023-10-02", 700, 21.0, nobody)
    plant = SimulatedPlant(scenario, sized(), building_model("plant"), noise=SensorNoise(), warm_up_days=WARM_UP_DAYS)
    hours = {0.0: 293.0, 6.0: 287.0, 9.0: 291.0, 12.0: 286.0, 15.0: 293.0, 18.0: 289.0}
    chosen_by_hour = {hour: {"supply_air_temperature_setpoint": air} for hour, air in hours.items()}
    rule = FixedSetpoints({"supply_water_temperature_setpoint": 330.0}, plant.actuators, chosen_by_hour)
    seen = plant.reset(700)
    while not plant.finished:
        seen = plant.step(rule.step(seen, None))
    return plant.case()
