"""From what EnergyPlus computed to what the building's sensors report."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from energyplus_trials import climate, model
from energyplus_trials.errors import EnergyPlusRunError
from energyplus_trials.frame import SITE_OUTPUTS
from energyplus_trials.specification import TrialSpec, stream_generator

AIR_HEAT_CAPACITY = 1006.0  # [J/kg/K], of the case format
HEAT_TOLERANCE = 0.01  # [-], of a zone's mean absolute heat
MOIST_TOLERANCE = 0.04
LEAST_HEAT = 1.0  # [W/m2], mean absolute heat that the tolerance is taken of at least
UNITS: Mapping[str, str] = climate.POINTS | {
    "zone_air_temperature_sensor": "degC",
    "supply_air_flowrate_sensor": "kg/s",
    "discharge_air_temperature_sensor": "degC",
}
_NOISE = 9  # purpose of random numbers

Series = NDArray[np.float64]


class Readings:
    """What sensors would report if they had no noise; effects of sensors and meters change it.

    Parameters
    ----------
    spec : TrialSpec
        Of the trial.
    results : DataFrame, shape (n_time, n_output)
        As `plant.simulate` returns it, run-in included.
    station : DataFrame, shape (n_time, 6)
        Weather that the station sees.

    Attributes
    ----------
    temperature, flow, discharge : DataFrame, shape (n_time, n_zone)
        [degC], [kg/s], [degC]; the temperature is the mean of a step, as the format wants it.
    station : DataFrame, shape (n_time, 6)
        In the case format's units.
    """

    def __init__(self, spec: TrialSpec, results: pd.DataFrame, station: pd.DataFrame) -> None:
        self.spec, self.results, self.station = spec, results, station.copy()
        zones = list(spec.zone_names)
        end = results.xs("temperature", axis=1, level=1)[zones]
        self.temperature = (end + end.shift(1).bfill()) / 2.0
        self.flow = results.xs("flow", axis=1, level=1)[zones]
        self.discharge = results.xs("discharge", axis=1, level=1)[zones].where(self.flow > 0.0, self._idle())

    def _idle(self) -> pd.DataFrame:
        """Return what discharge sensors read in still air: the room's, or that of the floor's ducts."""
        if self.spec.use.idle_discharge == "room":
            return self.temperature
        floors = [zone.partition("_")[0] for zone in self.spec.zone_names]
        return self.temperature.T.groupby(floors).transform("mean").T

    @property
    def on(self) -> pd.DataFrame:
        """Whether air flows, shape (n_time, n_zone)."""
        return self.flow > 0.0

    def telemetry(self) -> pd.DataFrame:
        """Return the telemetry without the run-in, with noise, columns `ENTITY/POINT`."""
        spec, use = self.spec, self.spec.use
        rng = stream_generator(spec.stream, spec.seed, _NOISE)
        rows = slice(-spec.days * climate.STEPS_PER_DAY, None)
        station = self.station.iloc[rows]
        n = len(station)
        columns = {f"weather_station/{point}": station[point].to_numpy() for point in climate.POINTS}
        outdoor = "weather_station/outside_air_temperature_sensor"
        columns[outdoor] = columns[outdoor] + rng.normal(0.0, use.outdoor_noise, n)
        for zone in spec.zone_names:
            temperature, flow, discharge = (
                table[zone].to_numpy()[rows] for table in (self.temperature, self.flow, self.discharge)
            )
            measured = temperature + rng.normal(0.0, use.temperature_noise, n)
            rounded = np.round(measured / use.temperature_resolution) * use.temperature_resolution
            columns[f"VAV_{zone}/zone_air_temperature_sensor"] = rounded
            columns[f"VAV_{zone}/supply_air_flowrate_sensor"] = flow * (1.0 + rng.normal(0.0, use.flow_noise, n))
            measured = discharge + rng.normal(0.0, use.discharge_noise, n)
            columns[f"VAV_{zone}/discharge_air_temperature_sensor"] = measured
        index = pd.DatetimeIndex(station.index, name="timestamp").tz_localize(climate.timezone(spec.climate))
        return pd.DataFrame(columns, index=index).astype(np.float32)


def check_run(spec: TrialSpec, results: pd.DataFrame, weather: pd.DataFrame) -> dict[str, float]:
    """Compare metered heat with EnergyPlus's heat balance, and its weather with what it was given.

    Parameters
    ----------
    spec : TrialSpec
        Of the trial.
    results : DataFrame, shape (n_time, n_output)
        As `plant.simulate` returns it.
    weather : DataFrame, shape (n_time, 6)
        That the plant got.

    Returns
    -------
    dict
        Deviation of the metered heat by zone, as a share of the mean absolute heat [-].

    Raises
    ------
    EnergyPlusRunError
        One of them differs.
    """
    for point in SITE_OUTPUTS:
        if point == "wind_direction_sensor":  # 0 is 360
            continue
        # in the mean, since EnergyPlus's own sun rises a minute earlier or later
        off = float((results["site", point] - weather[point]).abs().mean())
        if not off <= 1e-3 * weather[point].abs().mean() + 1e-3:
            raise EnergyPlusRunError(f"{spec.name}: EnergyPlus's {point} differs from what it was given by {off:.3g}")
    moist = spec.has("latent_load")  # moist air has another heat capacity: part of that effect
    tolerance = MOIST_TOLERANCE if moist else HEAT_TOLERANCE
    found = {}
    for zone in spec.zone_names:
        outputs = results[zone]
        metered = outputs["flow"] * AIR_HEAT_CAPACITY * (outputs["discharge"] - outputs["temperature"])
        scale = max(float(outputs["heat"].abs().mean()), LEAST_HEAT * model.area(spec, zone))
        found[zone] = float((metered - outputs["heat"]).abs().mean()) / scale
        if not found[zone] <= tolerance:
            raise EnergyPlusRunError(
                f"{spec.name}: metered heat of {zone} is off by {found[zone]:.2%} of {scale:.0f} W; "
                f"at most {tolerance:.0%} is expected"
            )
    return found
