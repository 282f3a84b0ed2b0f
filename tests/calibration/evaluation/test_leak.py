"""Nothing of a held-out day reaches a prediction that started before it: by no constant, schedule or signal."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration.evaluation.intervals import Interval, default_intervals
from calibration.evaluation.settings import ModelSettings, read_settings
from calibration.fit.calibrate import calibrate
from thermal import Case, SymbolicModel, Telemetry, free_runs, load_bundled_case, reduced_model, replay_inputs, spin_up
from thermal._types import FloatArray
from thermal.case.points import DISCHARGE_TEMPERATURE, ZONE_TEMPERATURE
from thermal.effects.catalogue import CATALOGUE
from thermal.inputs.normalisation import fit_normalisation
from thermal.inputs.provider import telemetry_inputs
from thermal.network.build import build_network

STEPS = 72


@cache
def counted() -> Case:
    """The bundled case with people who are counted; temperatures in 64ths of a kelvin, so that differences are exact."""
    case = load_bundled_case()
    frame = case.telemetry.frame.copy()
    temperatures = [c for c in frame if c.endswith((ZONE_TEMPERATURE, DISCHARGE_TEMPERATURE))]
    frame[temperatures] = (frame[temperatures] * 64.0).round() / 64.0
    hour = np.asarray(frame.index.hour)
    for k, zone in enumerate(case.building.zone_names):
        frame[f"{zone}/occupancy_count_sensor"] = np.where((hour >= 8) & (hour < 17), 2.0 + k % 3, 0.0)
    return told(case, frame)


def told(case: Case, frame: pd.DataFrame) -> Case:
    return replace(case, telemetry=Telemetry.from_frame(frame), judged=None)


def intervals() -> tuple[list[Interval], list[Interval]]:
    return default_intervals(counted())


@cache
def altered(people: bool) -> Case:
    """Zones 2 K warmer on the held-out days, their supply air too, so that metered heat stays; and twice the people."""
    frame = counted().telemetry.frame.copy()
    late = frame.index >= intervals()[1][0].start
    frame.loc[late, [c for c in frame if c.endswith((ZONE_TEMPERATURE, DISCHARGE_TEMPERATURE))]] += 2.0
    if people:
        later = frame.index[late][1:]  # coming and going at a stamp is the change between the stamps beside it
        frame.loc[later, [c for c in frame if c.endswith("occupancy_count_sensor")]] *= 2.0
    return told(counted(), frame)


def tuned() -> list[tuple[pd.Timestamp, pd.Timestamp]]:
    return [(i.start, i.end) for i in intervals()[0]]


def buildable() -> list[str]:
    case = load_bundled_case()
    inputs, anatomy = telemetry_inputs(case), build_network(case.building).anatomy
    return [name for name, e in CATALOGUE.items() if e.untestable(inputs, anatomy) is None]


def predictor(ids: tuple[str, ...]) -> Callable[[Case], FloatArray]:
    """Predictions of six hours that start before the held-out days, of a model at half of each effect's range."""
    first = int(counted().stamps.get_indexer([intervals()[1][0].start])[0])
    starts = first - np.array([300, 200, STEPS, 60, 12, 2, 1])

    def predict(case: Case) -> FloatArray:
        settings = ModelSettings(dx=1.5, effects=dict.fromkeys(ids, ()), normalisation=fit_normalisation(case, tuned()))
        network = settings.network(case.building)
        theta = np.array([0.5 * (p.lower + p.upper) if p.effect else p.start for p in network.parameters])
        model = reduced_model(SymbolicModel(network), [theta])
        inputs, matrices = replay_inputs(case, network), model.matrices(theta)
        states, _ = spin_up(matrices, inputs, int(starts[0]) - 400, starts)
        return free_runs(matrices, inputs, starts, STEPS, states)[0]

    return predict


def test_metered_heat_stays() -> None:
    heat = [case.zone_heat().to_numpy() for case in (counted(), altered(False))]
    assert np.array_equal(*heat) and np.abs(heat[0]).max() > 100.0
    zones = [case.zone_temperatures().to_numpy() for case in (counted(), altered(False))]
    assert np.abs(zones[1] - zones[0]).max() == 2.0


@pytest.mark.parametrize("name", ["baseline", *buildable()])
def test_predictions_know_nothing_of_the_days_after_their_start(name: str) -> None:
    predict = predictor(() if name == "baseline" else (*CATALOGUE[name].requires, name))
    before = predict(counted())
    assert np.isfinite(before).all()
    assert np.array_equal(before, predict(altered(people=False)))
    # people are an input: what they do in a prediction's own hours is known, and no more
    assert np.array_equal(before[:3], predict(altered(people=True))[:3])


@pytest.mark.long
def test_a_calibration_knows_nothing_of_held_out_days(tmp_path: Path) -> None:
    """Parameters stay bit for bit, and the constants are written with them, and read back."""
    tuning, held_out = intervals()
    settings = {"dx": 1.5, "horizon": "1h", "effects": ["internal_gains", "infiltration"], "starts": 1}
    found = [calibrate(case, tuning, held_out, settings=settings) for case in (counted(), altered(people=True))]
    assert np.array_equal(found[0].theta, found[1].theta)
    constants = fit_normalisation(counted(), tuned())
    assert constants.people == 2.0 * 2 + 3.0 * 2 + 4.0 and len(constants.usual) == 5
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(found[1].to_dict()), encoding="utf-8")
    assert ModelSettings(**read_settings(path)).normalisation == constants
