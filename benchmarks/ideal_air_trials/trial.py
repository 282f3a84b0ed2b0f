"""Makes a trial: runs the building, reads the sensors."""

from __future__ import annotations

import time

from _sealed import Made

from ideal_air_trials import folder, model, operation, plant
from ideal_air_trials.changes import apply_changes
from ideal_air_trials.faults import apply_faults
from ideal_air_trials.readings import Readings
from ideal_air_trials.specification import Spec
from ideal_air_trials.weather import read_weather


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
    building = build(spec)
    run = plant.simulate(building)
    readings = Readings(building, run)
    apply_faults(readings)
    told = {"seconds": round(time.perf_counter() - began, 1), "heat_deviation": round(run.heat_deviation, 4),
            "heat_made_W_m2": round(run.heat_made, 4)}  # fmt: skip
    return Made(
        spec.label(told), lambda case: folder.write_case(case, spec, building.weather, readings.telemetry())
    )


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
