"""Effects of sensors, meters and clocks: what is reported differs from what is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pvlib
from _worlds import Effect
from scipy.signal import lfilter

from energyplus_trials import climate, model
from energyplus_trials.readings import Readings


def apply_faults(readings: Readings) -> None:
    """Switch on the effects that change what is reported.

    Parameters
    ----------
    readings : Readings
        Of the building as it is; changed.
    """
    for effect in readings.spec.effects:
        fault = FAULTS.get(effect.name)
        if fault is not None:
            fault(readings, effect)


def _zones(readings: Readings, effect: Effect) -> list[str]:
    return list(effect.zones or readings.spec.zone_names)


def _sensor_bias(readings: Readings, effect: Effect) -> None:
    for zone, bias in effect.parameters["bias_K"].items():
        readings.temperature[zone] += bias


def _sensor_lag(readings: Readings, effect: Effect) -> None:
    """First-order lag ``τ dy/dt = T - y``, exact for a temperature that is constant in a step."""
    keep = np.exp(-climate.STEP.total_seconds() / effect.parameters["time_constant_s"])
    for zone in _zones(readings, effect):
        true = readings.temperature[zone].to_numpy()
        readings.temperature[zone] = lfilter([1.0 - keep], [1.0, -keep], true, zi=[keep * true[0]])[0]


def _duct_loss(readings: Readings, effect: Effect) -> None:
    """Report the discharge before the duct: ``T_reported = T_void + (T - T_void) e^NTU``, the void at the floor's mean.

    `by_flow` has the NTU of a constant loss coefficient at half of the zone's largest flow, so that little air loses
    more of its heat.
    """
    for zone in _zones(readings, effect):
        flow = readings.flow[zone].to_numpy()
        floor = [z for z in readings.spec.zone_names if z.partition("_")[0] == zone.partition("_")[0]]
        void = readings.temperature[floor].mean(axis=1).to_numpy()
        ntu = np.full(len(flow), effect.parameters["ntu"])
        if effect.form == "by_flow":
            ntu = np.minimum(ntu * 0.5 * max(flow.max(), 1e-9) / np.maximum(flow, 1e-9), 1.0)
        delivered = readings.discharge[zone].to_numpy()
        readings.discharge[zone] = np.where(flow > 0.0, void + (delivered - void) * np.exp(ntu), delivered)


def _flow_gain(readings: Readings, effect: Effect) -> None:
    """Scale the reported flow; `drift` grows from nothing to twice the gain over the telemetry."""
    n = len(readings.flow)
    ramp = np.ones(n)
    if effect.form == "drift":
        days = readings.spec.days * climate.STEPS_PER_DAY
        ramp = 2.0 * np.clip(np.arange(days - n, days) / days, 0.0, 1.0)
    for zone in _zones(readings, effect):
        readings.flow[zone] *= 1.0 + effect.parameters["gain"] * ramp


def _capacity_limit(readings: Readings, effect: Effect) -> None:
    """Report the flow that a stuck damper is told to give: the design flow where all that it lets through flows."""
    for zone in _zones(readings, effect):
        flow, lost = readings.flow[zone], effect.parameters["lost_share"]
        full = flow >= 0.99 * (1.0 - lost) * model.design_flow(readings.spec, zone)
        readings.flow[zone] = flow.where(~full, flow / (1.0 - lost))


def _clock_shift(readings: Readings, effect: Effect) -> None:
    """Stamp the station's values some steps late (or early)."""
    readings.station = readings.station.shift(effect.parameters["steps"]).ffill().bfill()


def _stratification(readings: Readings, effect: Effect) -> None:
    """Leave warm supply air below the ceiling: the sensor reads less than the mean while heating."""
    for zone in _zones(readings, effect):
        rise = (readings.discharge[zone] - readings.temperature[zone]).clip(lower=0.0)
        filling = readings.flow[zone] / max(readings.flow[zone].max(), 1e-9)
        readings.temperature[zone] -= effect.parameters["share"] * rise * np.sqrt(filling)


def _wrong_station(readings: Readings, effect: Effect) -> None:
    """Report the weather of a warmer place nearby, warmer most at night."""
    name = "outside_air_temperature_sensor"
    hour = (readings.station.index.hour + readings.station.index.minute / 60.0).to_numpy()
    night = 0.5 * (1.0 + np.cos(2.0 * np.pi * (hour - 4.0) / 24.0))
    readings.station[name] += effect.parameters["offset_K"] + effect.parameters["night_K"] * night


def _swapped_sensors(readings: Readings, effect: Effect) -> None:
    """Give each of two zones the other's terminal."""
    one, other = effect.zones
    for table in (readings.flow, readings.discharge):
        table[[one, other]] = table[[other, one]].to_numpy()


def _sunlit_sensor(readings: Readings, effect: Effect) -> None:
    """Let the sun shine on a sensor through a window."""
    place = readings.spec.climate
    middle = pd.DatetimeIndex(readings.station.index - climate.STEP / 2).tz_localize(climate.timezone(place))
    sun = pvlib.solarposition.get_solarposition(middle, place.latitude, place.longitude, place.elevation)
    cosine = pvlib.irradiance.aoi_projection(
        90.0, effect.parameters["azimuth_deg"], sun["apparent_zenith"], sun["azimuth"]
    )
    direct = readings.station["direct_normal_irradiance_sensor"].to_numpy() * np.clip(cosine.to_numpy(), 0.0, None)
    for zone in effect.zones:
        readings.temperature[zone] += effect.parameters["kelvin_at_1000_W_m2"] * direct / 1000.0


FAULTS: dict[str, Callable[[Readings, Effect], None]] = {
    "sensor_bias": _sensor_bias,
    "sensor_lag": _sensor_lag,
    "duct_loss": _duct_loss,
    "flow_gain": _flow_gain,
    "meter_drift": _flow_gain,
    "capacity_limit": _capacity_limit,
    "clock_shift": _clock_shift,
    "stratification": _stratification,
    "wrong_station": _wrong_station,
    "swapped_sensors": _swapped_sensors,
    "sunlit_sensor": _sunlit_sensor,
}
