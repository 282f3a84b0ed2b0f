"""EnergyPlus as a plant in one call."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import pandas as pd

from mpc.adapters.energyplus.building import EnergyPlusBuilding, energyplus_building
from mpc.adapters.energyplus.input import CHICAGO, holidays
from mpc.adapters.energyplus.plant import EnergyPlusPlant, EnergyPlusSettings
from mpc.scenario.forecast import Forecaster
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import Calendar, StepGrid
from mpc.scenario.occupancy import ComfortBand
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import CarbonIntensity, Tariff, paper_tariff
from mpc.scenario.weather_files import read_epw

#: Thermostats of the reference offices, 21 and 24 degC while they run, half a kelvin wider; an hour to get there.
OFFICE_COMFORT = ComfortBand((293.65, 297.65), (288.25, 300.35), weekday=(7.0, 22.0), saturday=(7.0, 18.0))
_UNKNOWN_GAINS = InternalGains(0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class EnergyPlusConditions:
    """What a scenario has beside its weather.

    Parameters
    ----------
    tariff : Tariff
        Prices; those of the paper's simulator by default.
    carbon : CarbonIntensity, optional
        Emissions; not counted by default.
    comfort : ComfortBand, optional
        Of all zones; `OFFICE_COMFORT` with the holidays of the building by default.
    gains : InternalGains
        What forecasts say of people and equipment; nothing by default: who predicts is not told what the building's
        schedules hold.
    """

    tariff: Tariff = field(default_factory=paper_tariff)
    carbon: CarbonIntensity | None = None
    comfort: ComfortBand | None = None
    gains: InternalGains = _UNKNOWN_GAINS


def energyplus_scenario(
    source: EnergyPlusBuilding,
    start: str,
    days: int,
    conditions: EnergyPlusConditions = EnergyPlusConditions(),
    *,
    step_seconds: float = 300.0,
    horizon: int = 0,
) -> Scenario:
    """Make the scenario of a run: its weather file's weather, comfort bands and prices.

    Parameters
    ----------
    source : EnergyPlusBuilding
        The building.
    start : str
        First day, ISO 8601; its day of the week counts.
    days : int
        Length of the run [d].
    conditions : EnergyPlusConditions
        Prices, emissions, comfort and gains.
    step_seconds : float
        Step of the plant [s].
    horizon : int
        Steps that forecasts reach beyond the end.

    Returns
    -------
    Scenario
        From midnight on.
    """
    zone = source.building.location.timezone
    grid = StepGrid(pd.Timestamp(start, tz=zone), step_seconds, round(days * 86_400 / step_seconds) + horizon)
    free = holidays(source.source, range(grid.start.year, grid.start.year + 2))
    return build_scenario(
        source.building, grid, read_epw(source.weather), conditions.tariff, carbon=conditions.carbon,
        comfort=conditions.comfort or replace(OFFICE_COMFORT, calendar=Calendar(free)), gains=conditions.gains,
    )  # fmt: skip


def energyplus_plant(
    name: str | Path,
    start: str,
    days: int,
    settings: EnergyPlusSettings | None = None,
    conditions: EnergyPlusConditions = EnergyPlusConditions(),
    *,
    weather: str | Path = CHICAGO,
    step_seconds: float = 300.0,
    horizon: int | None = None,
) -> EnergyPlusPlant:
    """Make a plant of one of EnergyPlus' buildings; forecasts are the weather file's, without errors.

    For forecasts with errors make an `EnergyPlusPlant` with a `Forecaster` of `energyplus_scenario`.

    Parameters
    ----------
    name : str or Path
        An ``.idf`` file, or one of `reference_buildings`.
    start : str
        First day, ISO 8601; its day of the week counts.
    days : int
        Length of the run [d].
    settings : EnergyPlusSettings, optional
        How it is run and measured.
    conditions : EnergyPlusConditions
        Prices, emissions, comfort and gains.
    weather : str or Path
        An ``.epw`` file, or one of `weather_files`.
    step_seconds : float
        Step of the plant [s], an hour divided by a whole number.
    horizon : int, optional
        Steps of the forecasts; none by default.

    Returns
    -------
    EnergyPlusPlant
        To be reset.

    Raises
    ------
    EnergyPlusError
        When EnergyPlus or a file is missing, or the building's plant is of another kind.
    PlantError
        When the parts do not fit each other.

    Examples
    --------
    >>> plant = energyplus_plant("RefBldgMediumOfficeNew2004_Chicago", "2023-01-09", 7)  # doctest: +SKIP
    """
    source = energyplus_building(name, weather)
    scenario = energyplus_scenario(source, start, days, conditions, step_seconds=step_seconds, horizon=horizon or 0)
    forecaster = None if horizon is None else Forecaster(scenario, horizon)
    return EnergyPlusPlant(source, scenario, days, settings or EnergyPlusSettings(), forecaster)
