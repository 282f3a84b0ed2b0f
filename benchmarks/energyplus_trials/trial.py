"""Makes a trial: draws the weather, runs the plant, reads the sensors."""

from __future__ import annotations

import time

import pandas as pd
from _sealed import Made

from energyplus_trials import climate, folder, model, operation, plant, readings
from energyplus_trials.changes import apply_changes
from energyplus_trials.faults import apply_faults
from energyplus_trials.specification import TrialSpec

VERSION = "25.2"  # of EnergyPlus, as pyenergyplus-lbnl 26.1.0 brings it


def run_trial(spec: TrialSpec) -> Made:
    """Run a trial.

    Parameters
    ----------
    spec : TrialSpec
        The trial.

    Raises
    ------
    TrialError
        The plant failed, or what came out is not what was asked for.
    """
    began = time.perf_counter()
    building = build(spec)
    results = plant.simulate(building)
    weather = climate.building_weather(building.station, sun=building.sun, sky=building.sky)
    deviations = readings.check_run(spec, results, weather)
    reported = readings.Readings(spec, results, building.station)
    apply_faults(reported)
    run = {"energyplus": VERSION, "seconds": round(time.perf_counter() - began, 2),
           "heat_deviation": max(deviations.values()), "warnings": results.attrs["warnings"]}  # fmt: skip
    return Made(folder.label(spec, run), lambda case: folder.write_case(case, spec, reported.telemetry()))


def build(spec: TrialSpec) -> plant.Plant:
    """Return the building that EnergyPlus is to run, effects on.

    Parameters
    ----------
    spec : TrialSpec
        The trial.
    """
    station = climate.station_weather(spec.climate, plant.RUN_IN_DAYS, spec.days)
    starts = pd.DatetimeIndex(station.index - climate.STEP)
    objects = model.null_model(spec, starts[0].normalize(), starts[-1].normalize())
    building = plant.Plant(spec, station, objects)
    heating, cooling = operation.setpoints(spec.use, starts, len(spec.zone_names))
    for number, zone in enumerate(spec.zone_names):
        building.drive[f"{zone} heating"] = heating[:, number]
        building.drive[f"{zone} cooling"] = cooling[:, number]
    apply_changes(building)
    return building
