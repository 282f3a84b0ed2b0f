"""From what EnergyPlus computed to what the house's sensors and meters report."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from energyplus_trials import climate
from energyplus_trials.errors import EnergyPlusRunError
from energyplus_trials.frame import SITE_OUTPUTS
from energyplus_trials.specification import stream_generator
from scipy.signal import lfilter

from house_trials.people import Series
from house_trials.plant import Plant, Results
from house_trials.specification import HouseSpec

HEAT_TOLERANCE = 0.01  # [-], of a room's mean absolute heat
LEAST_HEAT = 1.0  # [W/m2], mean heat that the tolerance is taken of at least
UNITS: Mapping[str, str] = climate.POINTS | {
    "zone_air_temperature_sensor": "degC",
    "heating_power_sensor": "W",
    "occupancy_count_sensor": "dimensionless",
}
RESOLUTION = 0.1  # [K], of thermometers in houses
WHOLE = "house"  # the one zone of a house with one meter
_NOISE = 109  # purpose of random numbers
_STEP = climate.STEP.total_seconds()


class Readings:
    """What sensors would report if they had no noise; faults of sensors and meters change it.

    Parameters
    ----------
    plant : Plant
        The house that was run.
    results : Results
        Of the run.

    Attributes
    ----------
    temperature : DataFrame, shape (n_time, n_room)
        Means of the steps [degC].
    heat : DataFrame, shape (n_time, n_heated)
        Metered [W].
    station : DataFrame, shape (n_time, 6)
        In the case format's units.
    """

    def __init__(self, plant: Plant, results: Results) -> None:
        spec = plant.spec
        self.plant, self.spec, self.station = plant, spec, plant.station.copy()
        end = results.outputs.xs("temperature", axis=1, level=1)[list(spec.zone_names)]
        self.temperature = (end + end.shift(1).bfill()) / 2.0
        self.heat = results.given.copy()
        for room, heater in plant.heaters.items():
            if spec.has("meter_at_boiler"):
                self.heat[room] = results.asked[room]
            elif heater["limit"] < 1.0:  # the heater says what it would give
                self.heat[room] = emitted(results.asked[room].to_numpy(), heater["lag"])

    def telemetry(self) -> pd.DataFrame:
        """Return the telemetry without the run-in, averaged, with noise, columns `ENTITY/POINT`."""
        spec, use = self.spec, self.spec.sensors
        rng = stream_generator(spec.stream, spec.seed, _NOISE)
        told = {f"weather_station/{point}": self.station[point] for point in climate.POINTS}
        temperature, heat = self.temperature, self.heat
        if spec.heating.meter == "house":
            areas = np.array([spec.room(room).area for room in temperature])
            temperature = pd.DataFrame({WHOLE: temperature.to_numpy() @ areas / areas.sum()}, temperature.index)
            heat = pd.DataFrame({WHOLE: heat.sum(axis=1)})
        told |= {f"{zone}/zone_air_temperature_sensor": temperature[zone] for zone in temperature}
        told |= {f"{device(spec, zone)}/heating_power_sensor": heat[zone] for zone in heat}
        for place in measured_places(spec):
            told[f"{place}/zone_air_temperature_sensor"] = pd.Series(self.plant.drive[place], temperature.index)
        if use.counted:
            zone = WHOLE if spec.heating.meter == "house" else spec.zone_names[0]
            told[f"{zone}/occupancy_count_sensor"] = pd.Series(self.plant.people.home, temperature.index)
        table = pd.DataFrame(told).resample(f"{use.minutes}min", closed="right", label="right").mean()
        table = table.iloc[-spec.days * 24 * 60 // use.minutes :]
        for column in table:
            name, n = str(column).partition("/")[2], len(table)
            if name == "zone_air_temperature_sensor":
                measured = table[column] + rng.normal(0.0, use.temperature_noise, n)
                table[column] = (measured / RESOLUTION).round() * RESOLUTION
            elif name == "outside_air_temperature_sensor":
                measured = table[column] + rng.normal(0.0, use.outdoor_noise, n)
                table[column] = (measured / RESOLUTION).round() * RESOLUTION
            elif name == "heating_power_sensor":
                measured = table[column] * (1.0 + rng.normal(0.0, use.power_noise, n))
                table[column] = (measured / use.power_resolution).round() * use.power_resolution
        table.index = pd.DatetimeIndex(table.index, name="timestamp").tz_localize(climate.timezone(spec.climate))
        return table.astype(np.float32)


def emitted(asked: Series, lag: float) -> Series:
    """Return the mean heat of a radiator that is given water of a power, by step.

    Parameters
    ----------
    asked : ndarray, shape (n_time,)
        Constant in each step [W].
    lag : float
        Its time constant [s].
    """
    if lag <= 0.0:
        return asked
    kept = np.exp(-_STEP / lag)
    stored = lfilter([1.0 - kept], [1.0, -kept], asked)
    before = np.concatenate([[0.0], stored[:-1]])
    return np.asarray(asked + (before - asked) * (1.0 - kept) * lag / _STEP)


def device(spec: HouseSpec, zone: str) -> str:
    """Return the name of a zone's heater.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    zone : str
        Its name in the case.
    """
    if zone == WHOLE:
        return "BOILER"
    return f"{'HEATER' if spec.heating.emitter == 'electric' else 'CIRCUIT'}_{zone}"


def measured_places(spec: HouseSpec) -> tuple[str, ...]:
    """Return the places beside the rooms whose temperature is measured: attic and cellar.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    """
    top = () if spec.has("unmeasured_attic") else (spec.house.top,)
    return tuple(place for place in (*top, spec.house.bottom) if place in ("attic", "cellar"))


def check_run(plant: Plant, results: Results) -> float:
    """Compare heat and weather with EnergyPlus's own account, and return the largest deviation of a room's heat [-].

    Parameters
    ----------
    plant : Plant
        The house that was run.
    results : Results
        Of the run.

    Raises
    ------
    EnergyPlusRunError
        One of them differs.
    """
    spec, outputs = plant.spec, results.outputs
    weather = climate.building_weather(plant.station, sun=plant.sun, sky=plant.sky)
    for point in SITE_OUTPUTS:
        if point == "wind_direction_sensor":  # 0 is 360
            continue
        # in the mean, since EnergyPlus's own sun rises a minute earlier or later
        off = float((outputs["site", point] - weather[point]).abs().mean())
        if not off <= 1e-3 * weather[point].abs().mean() + 1e-3:
            raise EnergyPlusRunError(f"{spec.name}: EnergyPlus's {point} differs from what it was given by {off:.3g}")
    largest = 0.0
    for room in spec.zone_names:
        expected = plant.gains.get(room, np.zeros(len(outputs)))
        heater = plant.heaters.get(room)
        if heater is not None and heater["floor"]:
            told, wanted = results.given[room].to_numpy(), results.asked[room].to_numpy() * heater["limit"]
        else:
            radiator = 0.0 if heater is None else (1.0 - spec.heating.radiant) * results.given[room].to_numpy()
            told, wanted = outputs[room, "convective"].to_numpy(), expected + radiator
        scale = max(float(np.abs(wanted).mean()), LEAST_HEAT * spec.room(room).area)
        off = float(np.abs(told - wanted).mean()) / scale
        if not off <= HEAT_TOLERANCE:
            raise EnergyPlusRunError(
                f"{spec.name}: heat of {room} is off by {off:.2%} of {scale:.0f} W; "
                f"at most {HEAT_TOLERANCE:.0%} is expected"
            )
        largest = max(largest, off)
    return largest
