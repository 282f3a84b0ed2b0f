"""Where a trial's effects are, and what of them is in sensors and meters rather than in the building."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from mpc.adapters.energyplus.input import InputFile, entity
from reference_trials.buildings import inlets, served
from reference_trials.plant import AIR_HEAT_CAPACITY, Run
from reference_trials.specification import WHERE, Effect, Spec, generator
from thermal.case.building import ZoneTable

#: At strength 1: of zones [K], [s], [-], [-], [W/m2]; of mass per floor area [m2/m2], 60 kJ/m2/K; of a door [m3/s].
BIAS, LAG, GAIN, NTU, LEAK, MASS, DOOR = 0.8, 480.0, 0.22, 0.15, 10.0, 0.29, 0.1
#: How late or early the station's clock is [s].
SHIFT = 1800.0


def resolve(spec: Spec, building: InputFile, table: ZoneTable) -> tuple[Effect, ...]:
    """Say where a trial's effects are and how much they are in numbers.

    Parameters
    ----------
    spec : Spec
        The trial.
    building : InputFile
        Of `buildings.source`.
    table : ZoneTable
        Its zones and surfaces.
    """
    rng = generator(spec, WHERE)
    return tuple(_resolve(name, s, rng, building, table, spec) for name, s in spec.wanted)


def _resolve(
    name: str, s: float, rng: np.random.Generator, building: InputFile, table: ZoneTable, spec: Spec
) -> Effect:
    areas = areas_of(building, table)
    zones = list(areas)
    sign = float(rng.choice([-1.0, 1.0]))
    if name == "sensor_bias":
        some = _some(rng, zones, 1, 2)
        return Effect(name, s, some, {"bias_K": {z: round(sign * BIAS * s, 3) for z in some}})
    if name == "sensor_lag":
        return Effect(name, s, (), {"time_constant_s": round(LAG * s, 1)})
    if name == "flow_gain":
        return Effect(name, s, _some(rng, zones, 2, 4), {"gain": round(sign * GAIN * s, 4)})
    if name == "duct_loss":
        return Effect(name, s, _some(rng, zones, 2, 4), {"ntu": round(NTU * s, 4)})
    if name == "valve_leak":
        coils = [entity(i.zone) for i in inlets(building) if i.kind in ("vav", "fan_coil")]
        return Effect(name, s, _some(rng, list(dict.fromkeys(coils)), 1, 2), {"power_W_m2": round(LEAK * s, 3)})
    if name == "clock_shift":
        steps = max(round(SHIFT * spec.steps_per_hour / 3600.0), 1) * int(sign)
        return Effect(name, s, (), {"steps": steps})
    own = {entity(zone): zone for zone in building.of_type("Zone")}
    if name == "hidden_mass":
        return Effect(name, s, (), {"area_m2": {own[z]: round(MASS * s * a, 2) for z, a in areas.items()}})
    if name == "zone_mixing":
        pairs = {tuple(sorted((f.zone, f.other))) for f in table.surfaces if {f.zone, f.other} <= set(areas)}
        beside = sorted(pairs - {(z, z) for z in zones})
        count = min(int(rng.integers(1, 4)), len(beside))
        doors = [beside[int(k)] for k in np.sort(rng.choice(len(beside), count, replace=False))]
        between = [(own[a], own[b]) for a, b in doors]
        return Effect(
            name, s, tuple(sorted({z for d in doors for z in d})), {"flow_m3_s": round(DOOR * s, 4), "between": between}
        )
    return Effect(name, s)


def _some(rng: np.random.Generator, zones: Sequence[str], low: int, high: int) -> tuple[str, ...]:
    count = min(int(rng.integers(low, high + 1)), len(zones))
    return tuple(sorted(str(z) for z in rng.choice(zones, count, replace=False)))


class Readings:
    """What sensors would report if they had no noise; effects of sensors and meters change it.

    Parameters
    ----------
    run : Run
        Of the building as it is.
    rooms : dict of str to str
        Zone of each device, as the case calls it.
    areas : dict of str to float
        Floor area of the zones that have conditioned air [m2].
    step : float
        [s]
    """

    def __init__(self, run: Run, rooms: dict[str, str], areas: dict[str, float], step: float) -> None:
        self.rooms, self.areas, self.step = rooms, areas, step
        self.temperature = run.temperature.rename(columns=entity)
        self.flow, self.discharge, self.station = run.flow.copy(), run.discharge.copy(), run.station.copy()

    def devices(self, zones: Sequence[str]) -> list[str]:
        """List the devices of zones, of all where there are none.

        Parameters
        ----------
        zones : sequence of str
            As the case calls them.
        """
        return [d for d, zone in self.rooms.items() if not zones or zone in zones]


def apply_faults(readings: Readings, effects: Sequence[Effect]) -> None:
    """Switch on the effects that change what is reported.

    Parameters
    ----------
    readings : Readings
        Changed.
    effects : sequence of Effect
        Of the trial.
    """
    for effect in effects:
        if effect.name in _FAULTS:
            _FAULTS[effect.name](readings, effect)


def _bias(readings: Readings, effect: Effect) -> None:
    for zone, kelvin in effect.parameters["bias_K"].items():
        readings.temperature[zone] += kelvin


def _lag(readings: Readings, effect: Effect) -> None:
    """First-order lag, exact for a temperature that is constant in a step."""
    keep = np.exp(-readings.step / effect.parameters["time_constant_s"])
    for zone in readings.temperature:
        true = readings.temperature[zone].to_numpy()
        readings.temperature[zone] = lfilter([1.0 - keep], [1.0, -keep], true, zi=[keep * true[0]])[0]


def _gain(readings: Readings, effect: Effect) -> None:
    for device in readings.devices(effect.zones):
        readings.flow[device] *= 1.0 + effect.parameters["gain"]


def _duct(readings: Readings, effect: Effect) -> None:
    """Report the discharge before a duct that passes through a void at the mean of the zones' temperatures."""
    void = readings.temperature[list(readings.areas)].mean(axis=1)
    for device in readings.devices(effect.zones):
        given = readings.discharge[device]
        before = void + (given - void) * np.exp(effect.parameters["ntu"])
        readings.discharge[device] = before.where(readings.flow[device] > 0.0, given)


def _leak(readings: Readings, effect: Effect) -> None:
    """Report the discharge before a coil that leaks heat while air flows."""
    for zone in effect.zones:
        device = readings.devices([zone])[0]
        watts = effect.parameters["power_W_m2"] * readings.areas[zone]
        flow = readings.flow[device]
        warmer = watts / (AIR_HEAT_CAPACITY * flow.where(flow > 0.0, np.inf))
        readings.discharge[device] -= warmer


def _clock(readings: Readings, effect: Effect) -> None:
    readings.station = readings.station.shift(effect.parameters["steps"]).ffill().bfill()


_FAULTS: dict[str, Callable[[Readings, Effect], None]] = {
    "sensor_bias": _bias, "sensor_lag": _lag, "flow_gain": _gain, "duct_loss": _duct, "valve_leak": _leak,
    "clock_shift": _clock,
}  # fmt: skip


def areas_of(building: InputFile, table: ZoneTable) -> dict[str, float]:
    """Floor area of each zone that has conditioned air, as the case calls it [m2].

    Parameters
    ----------
    building : InputFile
        Of `buildings.source`.
    table : ZoneTable
        Its zones.
    """
    conditioned = {entity(zone) for zone in served(building)}
    return {zone.name: zone.floor_area for zone in table.zones if zone.name in conditioned}


def zones_of(building: InputFile) -> dict[str, str]:
    """Zone of each device, both as the case calls them.

    Parameters
    ----------
    building : InputFile
        Of `buildings.source`.
    """
    return {i.device: entity(i.zone) for i in inlets(building)}


def station_values(station: pd.DataFrame) -> dict[str, pd.Series]:
    """Put the weather into the library's units.

    Parameters
    ----------
    station : DataFrame, shape (n_time, 6)
        Of `Run`.
    """
    kelvin = {"outside_air_temperature_sensor": 273.15}
    return {point: station[point] + kelvin.get(point, 0.0) for point in station}
