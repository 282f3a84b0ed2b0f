"""Effects of sensors, meters and clocks: what is reported of a building, and is not so."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from _worlds import Effect
from scipy.signal import lfilter

from ideal_air_trials.specification import STEP, Spec

if TYPE_CHECKING:
    from ideal_air_trials.plant import Run
    from ideal_air_trials.readings import Readings

_AT_LIMIT = 0.995  # [-], of what a terminal can give
_SMALL_LOAD = 0.15  # [-], of the heating power: stratification is half of its largest there
_COLD_BELOW = 0.3  # [-], of the stratification that warm supply air makes, which cold air does
#: Duct losses: flow of the heating design at which the transfer units hold, as a share of the design's, the zone's
#: temperature there [degC], the least flow [kg/s], and the most units of a small flow [-].
_DESIGN_SHARE, _DESIGN_ZONE, _LEAST_FLOW, _MOST_UNITS = 0.35, 21.0, 1e-6, 0.7
AIR_HEAT_CAPACITY = 1006.0  # [J/kg/K], of the case format


def reported_heat(spec: Spec, run: Run) -> pd.DataFrame:
    """Return the heat that terminals believe to give, shape (n_time, n_zone) [W].

    A terminal with a limited capacity that is at its limit reports what it would give without, at most its power.

    Parameters
    ----------
    spec : Spec
        Of the trial.
    run : Run
        Of its building.
    """
    heat, effect, areas = run.heat.copy(), spec.effect("capacity_limit"), spec.layout.areas()
    if effect is None:
        return heat
    left = 1.0 - effect.parameters["lost_share"]
    for zone in effect.zones:
        given, wanted = run.heat[zone], run.wanted[zone]
        warm, cold = spec.terminal.heating_power * areas[zone], spec.terminal.cooling_power * areas[zone]
        told = given.where(given < _AT_LIMIT * left * warm, wanted.clip(left * warm, warm))
        heat[zone] = told.where(given > -_AT_LIMIT * left * cold, wanted.clip(-cold, -left * cold))
    return heat


def apply_faults(readings: Readings) -> None:
    """Switch on the effects that change what is reported.

    Parameters
    ----------
    readings : Readings
        Changed.
    """
    for effect in readings.spec.effects:
        fault = _FAULTS.get(effect.name)
        if fault is not None:
            fault(readings, effect)


def lagged(values: pd.Series, time_constant: float) -> pd.Series:
    """Return what a sensor of first order shows of values that are constant in a step, shape (n_time,).

    Parameters
    ----------
    values : Series, shape (n_time,)
        True ones.
    time_constant : float
        [s]
    """
    keep = np.exp(-STEP.total_seconds() / time_constant)
    true = values.to_numpy()
    shown, _ = lfilter([1.0 - keep], [1.0, -keep], true, zi=[keep * true[0]])
    return pd.Series(shown, values.index)


def _sensor_bias(readings: Readings, effect: Effect) -> None:
    for zone, bias in effect.parameters["bias_K"].items():
        readings.temperature[zone] += bias


def _sensor_lag(readings: Readings, effect: Effect) -> None:
    for zone in filter(effect.holds, readings.temperature.columns):
        readings.temperature[zone] = lagged(readings.temperature[zone], effect.parameters["time_constant_s"])


def _stratified_room(readings: Readings, effect: Effect) -> None:
    """Let sensors above the middle of a room read more while warm air comes in, and somewhat less while cold does."""
    numbers, areas = effect.parameters, readings.spec.layout.areas()
    for zone in effect.zones:
        heat = readings.heat[zone]
        small = _SMALL_LOAD * readings.spec.terminal.heating_power * areas[zone]
        above = numbers["top_K"] * heat / (heat.abs() + small) * numbers["height_above_middle"]
        above = above.where(above > 0.0, _COLD_BELOW * above)
        readings.temperature[zone] += lagged(above, numbers["time_constant_s"])


def _duct_loss(readings: Readings, effect: Effect) -> None:
    """Report the discharge before a duct in a void, whose transfer units fall with the root of the flow."""
    numbers, spec, areas = effect.parameters, readings.spec, readings.spec.layout.areas()
    rise = spec.terminal.heating_temperature - _DESIGN_ZONE
    for zone in filter(effect.holds, readings.flow.columns):
        flow, given, outdoor = readings.flow[zone], readings.discharge[zone], numbers["outdoor_share"]
        void = (1.0 - outdoor) * readings.temperature[zone] + outdoor * readings.plant.outdoor
        typical = _DESIGN_SHARE * spec.terminal.heating_power * areas[zone] / (AIR_HEAT_CAPACITY * rise)
        units = (numbers["ntu"] * np.sqrt(typical / flow.clip(lower=_LEAST_FLOW))).clip(upper=_MOST_UNITS)
        readings.discharge[zone] = (void + (given - void) * np.exp(units)).where(flow > 0.0, given)


def _flow_gain(readings: Readings, effect: Effect) -> None:
    for zone, gain in effect.parameters["gain"].items():
        readings.flow[zone] *= 1.0 + gain


def _clock_shift(readings: Readings, effect: Effect) -> None:
    """Let the station stamp its values late, or early where minutes are negative."""
    late = pd.Timedelta(minutes=effect.parameters["minutes"])
    readings.station = readings.plant.weather.station(readings.first - late, len(readings.station))


_FAULTS: dict[str, Callable[[Readings, Effect], None]] = {
    "sensor_bias": _sensor_bias, "sensor_lag": _sensor_lag, "stratified_room": _stratified_room,
    "duct_loss": _duct_loss, "flow_gain": _flow_gain, "clock_shift": _clock_shift,
}  # fmt: skip
