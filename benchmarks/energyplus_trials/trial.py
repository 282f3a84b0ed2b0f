"""Makes a trial: draws the weather, runs the plant, reads the sensors, writes the case and seals the label."""

from __future__ import annotations

import time
from pathlib import Path

import pandas as pd
from _sealed import places, seal

from energyplus_trials import climate, folder, model, operation, plant, readings
from energyplus_trials.changes import apply_changes
from energyplus_trials.faults import apply_faults
from energyplus_trials.specification import TrialSpec

VERSION = "25.2"  # of EnergyPlus, as pyenergyplus-lbnl 26.1.0 brings it


def make_trial(spec: TrialSpec, case_folder: Path, sealed_folder: Path) -> bool:
    """Make a trial unless it is there, and return whether it was made.

    Parameters
    ----------
    spec : TrialSpec
        The trial.
    case_folder : Path
        Where its case goes, as `case_folder/NAME`: what the diagnosis gets.
    sealed_folder : Path
        Where its label goes, as `sealed_folder/NAME.json`; outside of the case folder.

    Raises
    ------
    ValueError
        The labels would lie within reach of the diagnosis.
    TrialError
        The plant failed, or what came out is not what was asked for.
    """
    case, label = places(spec.name, case_folder, sealed_folder)
    if case.exists() and label.exists():
        return False
    began = time.perf_counter()
    building = build(spec)
    results = plant.simulate(building)
    weather = climate.building_weather(building.station, sun=building.sun, sky=building.sky)
    deviations = readings.check_run(spec, results, weather)
    reported = readings.Readings(spec, results, building.station)
    apply_faults(reported)
    seconds = round(time.perf_counter() - began, 2)
    run = {
        "energyplus": VERSION,
        "seconds": seconds,
        "heat_deviation": max(deviations.values()),
        "warnings": results.attrs["warnings"],
    }
    seal(label, folder.label(spec, run))
    if not case.exists():
        folder.write_case(case, spec, reported.telemetry())
    return True


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
