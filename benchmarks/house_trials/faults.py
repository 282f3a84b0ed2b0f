"""Faults of sensors, meters and clocks, put into what the house reports."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pvlib
from _worlds import Effect
from energyplus_trials import climate
from scipy.signal import lfilter

from house_trials.readings import Readings

_STEP = climate.STEP.total_seconds()


def apply_faults(readings: Readings) -> None:
    """Put the faults of a trial into its readings.

    Parameters
    ----------
    readings : Readings
        Of the trial; changed.
    """
    for effect in readings.spec.effects:
        fault = _FAULTS.get(effect.name)
        if fault is not None:
            fault(readings, effect)


def _bias(readings: Readings, effect: Effect) -> None:
    for room, bias in effect.parameters["bias_K"].items():
        readings.temperature[room] += bias


def _lag(readings: Readings, effect: Effect) -> None:
    keep = np.exp(-_STEP / effect.parameters["time_constant_s"])
    for room in readings.temperature:
        values = readings.temperature[room].to_numpy()
        readings.temperature[room] = lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])[0]


def _gain(readings: Readings, effect: Effect) -> None:
    n = len(readings.heat)
    share = np.linspace(0.0, 2.0, n) if effect.form == "drift" else np.ones(n)
    for room in effect.zones or readings.heat.columns:
        readings.heat[room] = readings.heat[room] * (1.0 + effect.parameters["gain"] * share)


def _clock(readings: Readings, effect: Effect) -> None:
    table = readings.station if effect.form == "station" else readings.heat
    seconds = np.arange(len(table)) * _STEP
    for column in table:
        table[column] = np.interp(seconds, seconds + 60.0 * effect.parameters["minutes"], table[column].to_numpy())


def _sunlit(readings: Readings, effect: Effect) -> None:
    """Let the sun shine on a sensor through a window of some azimuth, whatever reaches the house."""
    place, station = readings.spec.climate, readings.plant.station
    middle = (station.index - climate.STEP / 2).tz_localize(climate.timezone(place))
    sun = pvlib.solarposition.get_solarposition(middle, place.latitude, place.longitude, place.elevation)
    incidence = pvlib.irradiance.aoi(90.0, effect.parameters["azimuth_deg"], sun["apparent_zenith"], sun["azimuth"])
    direct = station["direct_normal_irradiance_sensor"].to_numpy() * np.maximum(np.cos(np.radians(incidence)), 0.0)
    for room in effect.zones:
        readings.temperature[room] += effect.parameters["kelvin_at_1000_W_m2"] * np.asarray(direct) / 1000.0


def _swapped(readings: Readings, effect: Effect) -> None:
    first, second = effect.zones
    readings.temperature[[first, second]] = readings.temperature[[second, first]].to_numpy()


def _wrong_station(readings: Readings, effect: Effect) -> None:
    """Report the air of another place: warmer, and more so at night."""
    hour = pd.DatetimeIndex(readings.station.index).hour
    night = np.where((hour < 7) | (hour >= 20), effect.parameters["night_K"], 0.0)
    readings.station["outside_air_temperature_sensor"] += effect.parameters["offset_K"] + night


_FAULTS: dict[str, Callable[[Readings, Effect], None]] = {
    "sensor_bias": _bias, "sensor_lag": _lag, "flow_gain": _gain, "meter_drift": _gain, "clock_shift": _clock,
    "sunlit_sensor": _sunlit, "swapped_sensors": _swapped, "wrong_station": _wrong_station,
}  # fmt: skip
