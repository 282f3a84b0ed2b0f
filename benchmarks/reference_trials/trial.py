"""Makes a trial: runs the building, reads the sensors."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pandas as pd
from _sealed import Made, TrialError

from mpc.adapters.energyplus.input import entity, weather_path
from mpc.scenario.weather_files import read_epw
from reference_trials import effects, plant
from reference_trials.buildings import airflows, inlets, source
from reference_trials.specification import NOISE, Effect, Spec, generator
from reference_trials.variant import variant
from thermal.case.building import Building, Device
from thermal.case.case import Case
from thermal.case.save import save_case
from thermal.case.telemetry import Telemetry

FREEZING = 273.15  # K
#: Most that metered heat may be off from EnergyPlus' own account, of a zone's mean absolute heat [-]: moist air carries
#: up to 2 % more than the 1006 J/kg/K of the case format say.
HEAT_TOLERANCE = 0.04
LEAST_HEAT = 1.0  # W/m2, mean absolute heat that the tolerance is taken of at least
#: Most that the account of a zone's air may leave, and that a term which is off may have, of the heat delivered [-].
BALANCE_TOLERANCE, NOTHING = 0.01, 1e-9
#: Effects by whose absence a term of EnergyPlus' account is nothing.
_TERMS = {"gains": "internal_gains", "outdoor_air": "infiltration", "zones": "zone_mixing"}


def run_trial(spec: Spec) -> Made:
    """Run a trial.

    Parameters
    ----------
    spec : Spec
        The trial.

    Raises
    ------
    TrialError
        EnergyPlus failed, or what came out is not what was asked for.
    """
    began = time.perf_counter()
    building, table = source(spec.building), plant.geometry(spec.building, spec.spaces)
    held = effects.resolve(spec, building, table)
    run = plant.simulate(spec, variant(building, held))
    account = check(spec, run, held)
    rooms, areas = effects.zones_of(building), effects.areas_of(building, table)
    readings = effects.Readings(run, rooms, areas, 3600.0 / spec.steps_per_hour)
    effects.apply_faults(readings, held)
    frame = telemetry(spec, readings, run)
    devices = tuple(Device(name=i.device, type=i.kind, zone=entity(i.zone)) for i in inlets(building))
    place = read_epw(weather_path(spec.weather)).location
    passes = airflows(building) if spec.spaces == "zones" else ()
    drawn = Building(spec.name, place, 0.0, table, devices, passes, geometry_quality="surveyed")
    stamped = frame.tz_localize(place.timezone).rename_axis("timestamp")
    told = {"seconds": round(time.perf_counter() - began, 1), **account}
    return Made(spec.label(held, told), lambda case: save_case(Case(drawn, Telemetry.from_frame(stamped)), case))


def check(spec: Spec, run: plant.Run, held: tuple[Effect, ...]) -> dict[str, Any]:
    """Hold metered heat, and what is switched off, against EnergyPlus' own account of the zones' air.

    Parameters
    ----------
    spec : Spec
        Of the trial.
    run : Run
        Its outputs.
    held : tuple of Effect
        Its effects.

    Returns
    -------
    dict
        ``terms``, mean absolute heat of each kind a zone [W]; ``left``, what the account leaves, and
        ``heat_deviation``, the most that a zone's metered heat is off, as shares of the heat delivered [-].

    Raises
    ------
    TrialError
        Metered heat is off, the account does not close, or what is switched off is there.
    """
    building = source(spec.building)
    areas = effects.areas_of(building, plant.geometry(spec.building, spec.spaces))
    rooms = {i.device: i.zone for i in inlets(building)}
    inside = run.temperature[list(rooms.values())].to_numpy()
    by_device = run.flow * plant.AIR_HEAT_CAPACITY * (run.discharge - inside)
    metered = by_device.T.groupby(rooms).sum().T
    delivered = run.balance["delivered"]
    deviation = {}
    for zone in metered:
        scale = max(float(delivered[zone].abs().mean()), LEAST_HEAT * areas[entity(zone)])
        deviation[zone] = float((metered[zone] - delivered[zone]).abs().mean()) / scale
    worst = max(deviation, key=lambda z: deviation[z])
    if not deviation[worst] <= HEAT_TOLERANCE:
        raise TrialError(f"{spec.name}: metered heat of {worst} is off by {deviation[worst]:.1%}; at most "
                         f"{HEAT_TOLERANCE:.0%} is expected")  # fmt: skip
    terms = {name: float(values.abs().mean().mean()) for name, values in run.balance.items()}
    sources = sum(values for name, values in run.balance.items() if name != "storage")
    left = float((sources - run.balance["storage"]).abs().mean().mean()) / terms["delivered"]
    names = {effect.name for effect in held}
    wrong = [t for t, e in _TERMS.items() if e not in names and terms[t] > NOTHING * terms["delivered"]]
    if wrong or not left <= BALANCE_TOLERANCE:
        raise TrialError(f"{spec.name}: expected an account that closes without {', '.join(wrong) or 'a rest'}, found "
                         f"{terms}, of which {left:.1%} is left")  # fmt: skip
    return {"terms": terms, "left": left, "heat_deviation": deviation[worst]}


def telemetry(spec: Spec, readings: effects.Readings, run: plant.Run) -> pd.DataFrame:
    """Add noise and resolution; columns ``ENTITY/POINT`` in the library's units.

    Parameters
    ----------
    spec : Spec
        Of the trial.
    readings : Readings
        What sensors would report.
    run : Run
        For the set points.
    """
    rng, sensors, n = generator(spec, NOISE), spec.sensors, len(readings.station)
    columns = {
        f"weather_station/{p}": values.to_numpy() for p, values in effects.station_values(readings.station).items()
    }
    outdoor = "weather_station/outside_air_temperature_sensor"
    columns[outdoor] = columns[outdoor] + rng.normal(0.0, sensors.outdoor_noise, n)
    for zone in readings.temperature:
        measured = readings.temperature[zone].to_numpy() + rng.normal(0.0, sensors.temperature_noise, n)
        rounded = np.round(measured / sensors.temperature_resolution) * sensors.temperature_resolution
        columns[f"{zone}/zone_air_temperature_sensor"] = rounded + FREEZING
    for device in readings.flow:
        flow = readings.flow[device].to_numpy() * (1.0 + rng.normal(0.0, sensors.flow_noise, n))
        warm = readings.discharge[device].to_numpy() + rng.normal(0.0, sensors.discharge_noise, n)
        columns[f"{device}/supply_air_flowrate_sensor"] = flow
        columns[f"{device}/discharge_air_temperature_sensor"] = warm + FREEZING
    first = {zone: device for device, zone in reversed(readings.rooms.items())}
    for zone in run.heating:
        device = first[entity(zone)]
        for point, values in (("heating", run.heating), ("cooling", run.cooling)):
            columns[f"{device}/zone_air_{point}_temperature_setpoint"] = values[zone].to_numpy() + FREEZING
    return pd.DataFrame(columns, readings.station.index)
