"""Makes a trial: runs the building, reads the sensors, writes the case and seals the label."""

from __future__ import annotations

import time
from pathlib import Path

from _sealed import places, seal

from ideal_air_trials import folder, model, operation, plant
from ideal_air_trials.changes import apply_changes
from ideal_air_trials.faults import apply_faults
from ideal_air_trials.readings import Readings
from ideal_air_trials.specification import Spec
from ideal_air_trials.weather import read_weather


def make_trial(spec: Spec, cases: Path, sealed: Path) -> bool:
    """Make a trial unless it is there, and return whether it was made.

    Parameters
    ----------
    spec : Spec
        The trial.
    cases, sealed : Path
        Folders of what the diagnosis gets, and of the labels; the second outside of the first.

    Raises
    ------
    ValueError
        The labels would lie within reach of the diagnosis.
    TrialError
        EnergyPlus failed, or what came out is not what was asked for.
    """
    case, label = places(spec.name, cases, sealed)
    if case.exists() and label.exists():
        return False
    began = time.perf_counter()
    building = build(spec)
    run = plant.simulate(building)
    readings = Readings(building, run)
    apply_faults(readings)
    told = {"seconds": round(time.perf_counter() - began, 1), "heat_deviation": round(run.heat_deviation, 4),
            "heat_made_W_m2": round(run.heat_made, 4)}  # fmt: skip
    seal(label, spec.label(told))
    if not case.exists():
        folder.write_case(case, spec, building.weather, readings.telemetry())
    return True


def build(spec: Spec) -> plant.Plant:
    """Return the building that EnergyPlus is to run, effect on.

    Parameters
    ----------
    spec : Spec
        The trial.
    """
    building = plant.Plant(spec, read_weather(spec.climate), operation.setpoints(spec), model.null_model(spec))
    apply_changes(building)
    return building
