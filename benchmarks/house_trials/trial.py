"""Makes a trial: draws the weather, runs the house, reads the sensors."""

from __future__ import annotations

import time

import numpy as np
import pandas as pd
from _sealed import Made
from energyplus_trials import climate
from energyplus_trials.trial import VERSION
from scipy.signal import lfilter

from house_trials import folder, model, people, plant, readings
from house_trials.changes import apply_changes
from house_trials.drawing import without
from house_trials.faults import apply_faults
from house_trials.people import Series
from house_trials.specification import HouseSpec


def run_trial(spec: HouseSpec) -> Made:
    """Run a trial.

    Parameters
    ----------
    spec : HouseSpec
        The trial.

    Raises
    ------
    TrialError
        The run failed, or what came out is not what was asked for.
    """
    began = time.perf_counter()
    house = build(spec)
    results = plant.simulate(house)
    deviation = readings.check_run(house, results)
    reported = readings.Readings(house, results)
    apply_faults(reported)
    run = {"energyplus": VERSION, "seconds": round(time.perf_counter() - began, 2), "heat_deviation": deviation,
           "warnings": results.warnings}  # fmt: skip
    label = folder.label(spec, twin_names(spec), run)
    return Made(label, lambda case: folder.write_case(case, spec, reported.telemetry()))


def twin_names(spec: HouseSpec) -> list[str]:
    """Return the names of the trials of the same seed without each of a trial's effects.

    Parameters
    ----------
    spec : HouseSpec
        Of any kind.
    """
    if len(spec.effects) > 1:
        return [twin.name for twin in without(spec)]
    return [spec.twin().name for _ in spec.effects]


def build(spec: HouseSpec) -> plant.Plant:
    """Return the house that EnergyPlus is to run, effects on.

    Parameters
    ----------
    spec : HouseSpec
        The trial.
    """
    station = climate.station_weather(spec.climate, plant.RUN_IN_DAYS, spec.days)
    starts = pd.DatetimeIndex(station.index - climate.STEP)
    objects = model.null_model(spec, starts[0].normalize(), starts[-1].normalize())
    who = people.household(spec, starts)
    made = plant.Plant(spec, station, who, people.set_points(spec, starts, who), objects, heaters=plant.heaters(spec))
    for place, temperature in surroundings(spec, station).items():
        if place in (spec.house.top, spec.house.bottom):
            made.follow(place, temperature)
    apply_changes(made)
    return made


def surroundings(spec: HouseSpec, station: pd.DataFrame) -> dict[str, Series]:
    """Return the temperatures of attic and cellar, shape (n_time,) [degC].

    An attic follows the air outdoors within three hours, warmed by the house below and by the sun on its tiles; a
    cellar hardly follows it and drifts.

    Parameters
    ----------
    spec : HouseSpec
        Of a trial.
    station : DataFrame, shape (n_time, 6)
        Weather.
    """
    rng, n = np.random.default_rng([spec.people, 2]), len(station)
    outdoor = station["outside_air_temperature_sensor"].to_numpy()
    sun = station["diffuse_horizontal_irradiance_sensor"].to_numpy()
    sun = sun + 0.5 * station["direct_normal_irradiance_sensor"].to_numpy()

    def slow(values: Series, hours: float) -> Series:
        keep = np.exp(-1.0 / (hours * people.STEPS_PER_HOUR))
        return np.asarray(lfilter([1.0 - keep], [1.0, -keep], values, zi=[keep * values[0]])[0])

    def drift(hours: float) -> Series:
        """Noise of unit variance."""
        values = slow(rng.standard_normal(n), hours)
        return values / values.std()

    attic = slow(outdoor + rng.uniform(0.0, 0.012) * sun, 3.0) + rng.uniform(1.0, 5.0) + 0.4 * drift(2.0)
    cellar = rng.uniform(9.0, 15.0) + 0.1 * slow(outdoor - outdoor.mean(), 72.0) + 0.6 * drift(48.0)
    return {"attic": attic, "cellar": cellar}
