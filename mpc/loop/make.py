"""Plants from a building and its weather in one call, and the pilot building as a case folder."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Literal

import pandas as pd

from mpc.errors import PlantError
from mpc.loop.building import BuildingModel, GridBuilding
from mpc.loop.extras import RadiantGains, check_extras
from mpc.loop.noise import SensorNoise
from mpc.loop.reduced import reduced_building
from mpc.loop.run import FixedSetpoints
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.carbon import CarbonIntensity
from mpc.scenario.forecaster import Forecaster
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import Occupancy
from mpc.scenario.paper import paper_carbon, paper_tariff
from mpc.scenario.scenario import build_scenario
from mpc.scenario.tariff import Tariff
from mpc.scenario.weather import Weather
from thermal.case.building import Building
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.save import save_case
from thermal.effects.effect import Chosen
from thermal.errors import describe
from thermal.model.simulator import Simulator
from thermal.network.extension import Extension
from thermal.pilot.building import pilot_building
from thermal.pilot.sizing import size_system
from thermal.pilot.weather import MOUNTAIN_VIEW, generate_weather
from thermal.system.system import HvacSystem

ModelKind = Literal["reduced", "grid", "random"]


def simulated_plant(
    building: Building,
    weather: Weather,
    start: str,
    end: str,
    *,
    step_seconds: float = 300.0,
    model: ModelKind = "reduced",
    dx: float | None = None,
    parameters: Mapping[str, float] | None = None,
    effects: tuple[Chosen, ...] = (),
    order: int | None = None,
    system: HvacSystem | None = None,
    occupancy: Occupancy | None = None,
    gains: InternalGains | None = None,
    tariff: Tariff | None = None,
    carbon: CarbonIntensity | None = None,
    control_steps: int = 1,
    noise: SensorNoise | None = None,
    horizon: int | None = None,
    warm_up_days: int = 1,
    pressures: bool = False,
    seed: int = 0,
) -> SimulatedPlant:
    """Make a plant of a building in one call; `SimulatedPlant` has every choice.

    Parameters
    ----------
    building : Building
        With devices of types ``vav``, ``ahu`` and ``boiler``.
    weather : Weather
        Covers the time.
    start, end : str
        ISO 8601; without an offset local to the building.
    step_seconds : float
        Step of the plant [s].
    model : {"reduced", "grid", "random"}
        The building reduced to its modes, on the grid with the mean of the shuffle, or with the random one.
    dx : float, optional
        Distance between control volumes of a plan [m].
    parameters : mapping of str to float, optional
        Of the building, by name [parameter units]; starts for the rest.
    effects : tuple of Chosen
        What the building has and the baseline lacks, `thermal.effects.chosen`.
    order : int, optional
        Largest number of states of a reduced building.
    system : HvacSystem, optional
        Its plant; sized by `thermal.pilot.size_system` by default.
    occupancy : Occupancy, optional
        People; an office's schedule by default.
    gains : InternalGains, optional
        Heat of people, light and equipment; an office's, all of it into the air, by default.
    tariff : Tariff, optional
        Prices; those of the paper's simulator by default.
    carbon : CarbonIntensity, optional
        Emissions; those of the paper's simulator by default.
    control_steps : int
        Steps of the plant in a control step.
    noise : SensorNoise, optional
        Errors of what is measured; none by default.
    horizon : int, optional
        Steps of the forecasts, perfect ones; none by default.
    warm_up_days : int
        How often the first day is run before the start [d].
    pressures : bool
        Whether the pressures of ducts and loop are measured.
    seed : int
        Of all that is random.

    Returns
    -------
    SimulatedPlant
        To be reset.

    Raises
    ------
    PlantError
        When the parts do not fit each other, the kind of model is not known, or the building cannot have an effect.
    """
    grid = StepGrid.between(start, end, step_seconds, building)
    scenario = build_scenario(
        building, grid, weather, tariff or paper_tariff(), carbon=carbon or paper_carbon(), occupancy=occupancy,
        gains=gains, seed=seed,
    )  # fmt: skip
    built: BuildingModel
    system = system or size_system(building)
    radiates = scenario.heat.radiates or "radiant_heat" in system.heating
    extras: tuple[Extension, ...] = (*effects, RadiantGains()) if radiates else effects
    if model == "reduced":
        built = reduced_building(building, parameters, step_seconds=step_seconds, dx=dx, effects=extras, order=order)
    elif model in ("grid", "random"):
        shuffle: Literal["mean", "random"] = "random" if model == "random" else "mean"
        built = GridBuilding(
            Simulator(building, parameters, step_seconds, dx, shuffle=shuffle, seed=seed, effects=extras)
        )
    else:
        raise PlantError(describe("model", "'reduced', 'grid' or 'random'", repr(model)))
    check_extras(effects, built.network)
    return SimulatedPlant(
        scenario, system, built, control_steps=control_steps, noise=noise,
        forecaster=None if horizon is None else Forecaster(scenario, horizon), warm_up_days=warm_up_days,
        pressures=pressures, seed=seed,
    )  # fmt: skip


def pilot_weather(seed: int, start: str, days: float, step_seconds: float = 300.0) -> Weather:
    """Make weather of the pilot building's town.

    Parameters
    ----------
    seed : int
        Same seed, same weather; 0 or more.
    start : str
        Local time of its begin, ISO 8601 without offset.
    days : float
        Length [d].
    step_seconds : float
        Step [s].

    Returns
    -------
    Weather
        Of `thermal.pilot.generate_weather`.
    """
    frame = generate_weather(seed, start=start, days=days, step_seconds=step_seconds)
    return Weather(frame.rename(columns=lambda column: column.rpartition("/")[2]), MOUNTAIN_VIEW)


def save_pilot(
    path: str | PathLike[str],
    *,
    seed: int = 0,
    start: str = "2023-01-09",
    days: int = 14,
    floor_area: float = 6317.0,
    zones: int = 123,
    floors: int = 2,
    dx: float = 0.5,
    model: ModelKind = "reduced",
    effects: tuple[Chosen, ...] = (),
    parameters: Mapping[str, float] | None = None,
    noise: SensorNoise | None = None,
    setpoints: Mapping[str, float] | None = None,
    pressures: bool = False,
    overwrite: bool = False,
) -> Case:
    """Run the pilot building in closed loop and save plans, devices and telemetry as a case folder.

    Beside the zones' points the telemetry has those of air handlers, boiler and chiller: setpoints, commands, water and
    air temperatures, meters.

    Parameters
    ----------
    path : str or path-like
        Folder to make.
    seed : int
        Of building, weather, shuffle and noise; 0 or more.
    start : str
        Local day of its begin, ISO 8601.
    days : int
        Length [d].
    floor_area : float
        Of all floors together [m2].
    zones, floors : int
        On all floors together; number of storeys.
    dx : float
        Distance between control volumes [m].
    model : {"reduced", "grid", "random"}
        As in `simulated_plant`.
    effects : tuple of Chosen
        What the building has and the baseline lacks.
    parameters : mapping of str to float, optional
        Of the building [parameter units].
    noise : SensorNoise, optional
        Errors of sensors; the defaults of `SensorNoise` by default.
    setpoints : mapping of str to float, optional
        By kind of action [K] or [Pa]; those of `SimulatedPlant.default_actions` by default.
    pressures : bool
        Whether the pressures of ducts and loop are measured; the case is then one of format 2.
    overwrite : bool
        Whether a case that is there already is replaced.

    Returns
    -------
    Case
        As it was saved and loaded again.
    """
    building = pilot_building(seed, floor_area=floor_area, zones=zones, floors=floors)
    end = (pd.Timestamp(start) + pd.Timedelta(days=days)).isoformat()
    plant = simulated_plant(
        building, pilot_weather(seed, start, days), start, end, model=model, dx=dx, effects=effects,
        parameters=parameters, noise=noise or SensorNoise(), pressures=pressures, seed=seed,
    )  # fmt: skip
    plant.reset()
    chosen = dict(plant.default_actions)
    if setpoints:
        chosen |= FixedSetpoints(setpoints, plant.actuators).at_hour(0.0)
    while not plant.finished:
        plant.step(chosen)
    return load_case(save_case(plant.case(), path, overwrite=overwrite))
