"""Scenario of a run on a plant that forecasts itself, such as a BOPTEST server, from what it forecast for each step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from mpc.adapters.described.conditions import SeriesBand, SeriesOccupancy, described_building
from mpc.adapters.described.schema import PlantFile
from mpc.errors import PlantError
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.rates import ConstantRate, Rate
from mpc.scenario.scenario import Scenario, build_scenario
from mpc.scenario.tariff import CarbonIntensity, Tariff
from mpc.scenario.weather import WEATHER_POINTS, Weather
from thermal._types import FloatArray


@dataclass(frozen=True, eq=False)
class SeenRate:
    """Values as they were forecast for the steps of a run.

    Parameters
    ----------
    values : ndarray, shape (n_steps,)
        One a step [unit of the quantity].
    """

    values: FloatArray

    def on(self, grid: StepGrid) -> FloatArray:
        """Give the values of the steps, shape (n_steps,).

        Parameters
        ----------
        grid : StepGrid
            Steps of the run.
        """
        PlantError.unless(grid.n_steps == len(self.values), "scenario", f"{len(self.values)} steps", grid.n_steps)
        return self.values


def seen_scenario(file: PlantFile, frame: pd.DataFrame, step: float) -> Scenario:
    """Put together weather, people, prices and bands of a run from its forecasts of the steps themselves.

    Parameters
    ----------
    file : PlantFile
        The description, for zones, place and currency.
    frame : DataFrame, shape (n_steps, n_column)
        Telemetry by the ends of the steps, with the columns of forecasts [units of the library].
    step : float
        Length of a step [s].

    Raises
    ------
    PlantError
        When prices or bands were not forecast.
    """
    edges = [f"{zone}/comfort_{edge}_temperature" for zone in file.zones for edge in ("lower", "upper")]
    missing = [name for name in ("electricity_price", *edges) if name not in frame]
    expected, advice = "prices and comfort bands in the plant's forecasts", "name `weather` and `prices`"
    PlantError.unless(not missing, f"plant {file.name}", expected, f"none of {', '.join(missing)}", advice)

    def rate(column: str) -> Rate:
        return SeenRate(frame[column].to_numpy(dtype=float)) if column in frame else ConstantRate(0.0)

    def known(column: str) -> Rate | None:
        return rate(column) if column in frame else None

    grid = StepGrid(frame.index[0] - pd.Timedelta(seconds=step), step, len(frame))
    people = {zone: rate(f"{zone}/occupancy_count_sensor") for zone in file.zones}
    most = {zone: float(np.max(number.on(grid))) for zone, number in people.items()}
    bands = {
        zone: SeriesBand(
            lower=rate(f"{zone}/comfort_lower_temperature"), upper=rate(f"{zone}/comfort_upper_temperature"),
            where=f"zones.{zone}.comfort",
        )
        for zone in file.zones
    }  # fmt: skip
    carbon = None
    if "electricity_carbon_intensity" in frame:
        kind = "average" if file.emissions is None else file.emissions.kind
        rates = [rate(f"{carrier}_carbon_intensity") for carrier in ("electricity", "gas")]
        carbon = CarbonIntensity(rates[0], kind, rates[1], known("district_heating_carbon_intensity"))
    currency = "EUR" if file.prices is None else file.prices.currency
    weather = frame[[point for point in WEATHER_POINTS if point in frame]]
    return build_scenario(
        described_building(file), grid, Weather(weather, file.location, step=step),
        Tariff(
            rate("electricity_price"), rate("gas_price"), (), currency,
            district_heating=known("district_heating_price"),
        ), carbon=carbon,
        occupancy=SeriesOccupancy(most, by_zone=people), gains=InternalGains(equipment=0.0, lights=0.0), comfort=bands,
    )  # fmt: skip
