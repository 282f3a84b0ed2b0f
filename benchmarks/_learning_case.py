"""The case that optimal control and learned policies are compared on: an office, its models, its weeks.

The office is generated (12 zones, 600 m2, two floors, seed 1), its plant sized from its loads. What it truly is
(`TRUTH`) differs from the library's starting values, and it has sun, leakage and a leakier facade in the wind, which
the baseline lacks. The models of it are made from three weeks of telemetry before anybody moved in, by the library's
own commands: ``before`` is the calibrated baseline, ``after`` the model of the diagnosis. Both are kept as a
``calibration.json`` in `POLICIES`, beside the policies that were trained with them.

Everybody acts each quarter of an hour on supply air (285 to 300 K, common to both air handlers) and supply water (310
to 355 K), sees the same noisy measurements, and the same forecasts over twelve hours with errors that grow.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import pandas as pd

from calibration import calibrate
from calibration.diagnosis import diagnose, write_diagnosis
from mpc.environment import ControlEnvironment, EconomicReward
from mpc.kpi import StageCost
from mpc.plants import (
    FixedSetpoints,
    ReducedBuilding,
    SensorNoise,
    SimulatedPlant,
    pilot_building,
    pilot_weather,
)
from mpc.scenario import (
    DAY_AHEAD_ERRORS,
    Forecaster,
    InternalGains,
    Scenario,
    StepGrid,
    build_scenario,
    paper_carbon,
    paper_tariff,
)
from mpc.studies import ORDER, control_model
from thermal import Building, Case
from thermal.effects import chosen
from thermal.hvac import HvacSystem
from thermal.model import ReducedModel
from thermal.pilot import size_system

POLICIES = Path(__file__).parent / "policies"

#: Where a policy is trained, and what a plant is: the building itself, or a model of it.
World = Literal["plant", "before", "after"]

EFFECTS = ("solar_gain", "infiltration")
#: Parameters of the building that differ from the library's starting values [parameter units].
TRUTH = {
    "solar_heat_gain_coefficient": 0.3, "infiltration_rate": 0.25, "infiltration_by_wind": 0.03,
    "window_u_value": 1.8, "exterior_wall_conductivity": 0.4, "furniture_heat_capacity": 22000.0,
    "slab_heat_capacity": 110000.0, "interior_film_coefficient": 3.0,
}  # fmt: skip

STEP, CONTROL_STEPS, DX = 300.0, 3, 1.0
HORIZON_HOURS = 12.0
BLOCK_ENDS = (0.5, 1.0, 2.0, 3.0, 4.5, 6.0, 9.0, 12.0)  # h, of what a policy sees of the forecast
DISCOMFORT_PRICE = 1.0  # currency/K/h of a zone, of training and of the stage cost that all are judged by
WARM_UP_DAYS = 3

#: Weeks that policies and controllers are judged on, with weather of seeds that nothing else has.
TEST_WEEKS = {"winter": ("2024-01-15", 901), "spring": ("2024-04-15", 902), "summer": ("2024-07-15", 903)}
#: Weeks that training curves are judged on.
VALIDATION_WEEKS = {"winter": ("2023-02-06", 801), "summer": ("2023-08-07", 802)}
#: Weeks that policies are trained on: every other of two years.
TRAINING_WEEKS = {
    f"{start:%Y-%m-%d}": (f"{start:%Y-%m-%d}", 1000 + k)
    for k, start in enumerate(pd.date_range("2021-01-04", periods=52, freq="14D"))
}


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
    return build_scenario(office(size), grid, weather, paper_tariff(), carbon=paper_carbon(), gains=gains, seed=seed)


@cache
def known_model(world: World, size: Size = FULL, folder: Path = POLICIES, order: int = ORDER) -> ReducedModel:
    """Make the reduced model of the building as it is, or as a model has it, with a number of states at most."""
    if world == "plant":
        return control_model(office(size), TRUTH, dx=DX, effects=chosen(EFFECTS), order=order)
    if size != FULL:  # tests have no telemetry: a model that is wrong in the same ways
        return control_model(office(size), dx=DX, order=order)
    return control_model(office(), model_file(world, folder), order=order)


def building_model(world: World, size: Size = FULL) -> ReducedBuilding:
    """Make the building as it is, or as a model has it; a new one each time, as a plant steps it."""
    return ReducedBuilding(known_model(world, size), step_seconds=STEP)


def model_file(world: World, folder: Path = POLICIES) -> Path:
    """Where the parameters of a model of the building are."""
    return folder / f"model_{world}_diagnosis.json"


def make_plant(
    week: tuple[str, int], model: ReducedBuilding, *, bound: bool = False, size: Size = FULL
) -> SimulatedPlant:
    """Make the plant of a week; that of the bound has exact sensors and knows the weather and the people that come."""
    scenario = scenario_of(*week, size.days + HORIZON_HOURS / 24.0, size=size)
    errors = None if bound else DAY_AHEAD_ERRORS
    forecaster = Forecaster(
        scenario, round(HORIZON_HOURS * 3600.0 / STEP), errors, occupancy="actual" if bound else "expected",
        seed=week[1],
    )  # fmt: skip
    return SimulatedPlant(
        scenario, sized(size), model, control_steps=CONTROL_STEPS, noise=None if bound else SensorNoise(),
        forecaster=forecaster, warm_up_days=WARM_UP_DAYS, seed=week[1],
    )  # fmt: skip


def environment(
    world: World, weeks: dict[str, tuple[str, int]], discomfort_price: float = DISCOMFORT_PRICE, size: Size = FULL
) -> ControlEnvironment:
    """Make the environment of some weeks in a world."""
    model = building_model(world, size)
    plants = [make_plant(week, model, size=size) for week in weeks.values()]
    return ControlEnvironment(plants, reward=EconomicReward(StageCost(discomfort_price)), block_ends=BLOCK_ENDS)


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


def make_models(folder: Path = POLICIES) -> dict[str, Any]:
    """Calibrate and diagnose; keeps both models and says how far they are from the telemetry."""
    case = commissioning()
    folder.mkdir(parents=True, exist_ok=True)
    baseline = calibrate(case, dx=DX)
    model_file("before", folder).write_text(json.dumps(baseline.to_dict(), indent=1) + "\n", encoding="utf-8")
    found = diagnose(case, dx=DX)
    with TemporaryDirectory() as kept:
        write_diagnosis(found, case, kept, force=True)
        shutil.copyfile(Path(kept) / "calibration.json", model_file("after", folder))
    return {"before": baseline.calibrated["held_out"].metrics.to_dict(), "effects": list(found.final.effects)}
