"""From what EnergyPlus computed to what sensors report."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from ideal_air_trials import weather
from ideal_air_trials.faults import AIR_HEAT_CAPACITY, reported_heat
from ideal_air_trials.plant import Plant, Run
from ideal_air_trials.specification import NOISE, STEP, STEPS_PER_DAY, generator

UNITS: Mapping[str, str] = weather.POINTS | {
    "zone_air_temperature_sensor": "degC",
    "supply_air_flowrate_sensor": "kg/s",
    "discharge_air_temperature_sensor": "degC",
}
#: Standard deviations of sensors [K], [K], [-] of the flow, [K], and the resolution of zones' [K].
_TEMPERATURE_NOISE, _OUTDOOR_NOISE, _FLOW_NOISE, _DISCHARGE_NOISE = 0.03, 0.06, 0.006, 0.05
_RESOLUTION = 0.02
#: Least differences of supply air to the zone that terminals heat and cool with [K].
_LEAST_HEATING, _LEAST_COOLING = 4.0, -3.0
_LEAST_HEAT = 0.5  # [W], terminals are shut below


class Readings:
    """What sensors would report if they had no noise; effects of sensors and meters change it.

    Ideal air has no flow that is worth measuring: its flow here is the one that would carry its heat at the terminal's
    supply temperature, so that ``flow * 1006 * (discharge - zone)`` is the heat that EnergyPlus gave.

    Parameters
    ----------
    plant : Plant
        The building that was run.
    run : Run
        What came out.

    Attributes
    ----------
    temperature, flow, discharge : DataFrame, shape (n_time, n_zone)
        [degC], [kg/s], [degC]; lead included.
    heat : DataFrame, shape (n_time, n_zone)
        That meters tell [W].
    station : DataFrame, shape (n_reported, 6)
        In the case format's units, without the lead.
    """

    def __init__(self, plant: Plant, run: Run) -> None:
        self.plant, self.spec = plant, plant.spec
        self.temperature = run.temperature.copy()
        self.heat = reported_heat(plant.spec, run)
        terminal, zone = plant.spec.terminal, run.temperature
        heating = self.heat > 0.0
        middle = (zone + zone.shift(1).fillna(zone)) / 2.0
        warmer = (terminal.heating_temperature - middle).clip(lower=_LEAST_HEATING)
        colder = (terminal.cooling_temperature - middle).clip(upper=_LEAST_COOLING)
        difference = warmer.where(heating, colder)
        self.flow = (self.heat / (AIR_HEAT_CAPACITY * difference)).where(self.heat.abs() > _LEAST_HEAT, 0.0)
        self.discharge = (zone + difference).where(self.flow > 0.0, zone)
        self.station = plant.weather.station(self.first, plant.spec.days * STEPS_PER_DAY)

    @property
    def first(self) -> pd.Timestamp:
        """When the telemetry begins, standard time without zone."""
        return pd.Timestamp(self.spec.climate.start)

    def telemetry(self) -> pd.DataFrame:
        """Return the telemetry without the lead, with noise, columns `ENTITY/POINT`."""
        rng, n = generator(self.spec.stream, self.spec.seed, NOISE), len(self.station)
        columns = {f"weather_station/{point}": self.station[point].to_numpy() for point in weather.POINTS}
        outdoor = "weather_station/outside_air_temperature_sensor"
        columns[outdoor] = columns[outdoor] + rng.normal(0.0, _OUTDOOR_NOISE, n)
        for zone in self.spec.zone_names:
            temperature, flow, discharge = (
                table[zone].to_numpy()[-n:] for table in (self.temperature, self.flow, self.discharge)
            )
            noise = rng.normal(0.0, 1.0, (3, n))
            measured = temperature + _TEMPERATURE_NOISE * noise[0]
            columns[f"VAV_{zone}/zone_air_temperature_sensor"] = np.round(measured / _RESOLUTION) * _RESOLUTION
            columns[f"VAV_{zone}/supply_air_flowrate_sensor"] = np.maximum(flow * (1.0 + _FLOW_NOISE * noise[1]), 0.0)
            columns[f"VAV_{zone}/discharge_air_temperature_sensor"] = discharge + _DISCHARGE_NOISE * noise[2]
        ends = pd.date_range(self.first + STEP, periods=n, freq=STEP, tz=self.plant.weather.timezone, name="timestamp")
        return pd.DataFrame(columns, ends).astype(np.float32)
