"""Results of a calibration: the contract of `calibration.json` and `evaluation.json`, and parameters read back."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from calibration import CalibrationResult, CalibrationSettings, calibrate, evaluate_model, load_parameters
from calibration.errors import CalibrationError
from calibration.evaluation.n_step import HORIZONS, EvaluationSettings
from calibration.fit.estimate import Estimate
from calibration.fit.result import describe
from thermal import SymbolicModel, ThermalNetwork, build_network, load_bundled_case, replay_inputs


@cache
def calibrated() -> CalibrationResult:
    return calibrate(load_bundled_case(), settings=CalibrationSettings(dx=1.0, starts=1))


@cache
def network() -> ThermalNetwork:
    return build_network(load_bundled_case().building, dx=1.0)


# The contract, as a checker


def number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))


def check_interval(entry: Mapping[str, Any]) -> None:
    start, end = (pd.Timestamp(entry[k]) for k in ("start", "end"))
    assert start.tzinfo is not None
    assert end.tzinfo is not None
    assert start < end


def check_evaluation(content: Mapping[str, Any]) -> None:
    """Keys and kinds of ``evaluation.json``."""
    assert isinstance(content["steps"], int)
    assert number(content["step_seconds"])
    assert content["intervals"]
    for entry in content["intervals"]:
        check_interval(entry)
        assert all(number(entry[k]) for k in ("mae", "median", "bias"))
    assert all(number(content[k]) for k in ("mae", "median", "bias"))
    assert content["by_zone"]
    for errors in content["by_zone"].values():
        assert {"mae", "bias"} <= set(errors)
        assert all(number(v) for v in errors.values())
        assert errors["mae"] >= abs(errors["bias"]) - 1e-12
    assert set(content["by_horizon"]) <= {"5min", "1h", "3h", "6h", "24h"}
    assert all(number(v) and v >= 0 for v in content["by_horizon"].values())


def check_calibration(content: Mapping[str, Any]) -> None:
    """Keys and kinds of ``calibration.json``."""
    assert content["parameters"]
    for name, entry in content["parameters"].items():
        assert {"value", "unit", "lower", "upper", "start", "at_bound", "standard_error", "identifiable"} <= set(
            entry
        ), name
        assert number(entry["value"])
        assert isinstance(entry["unit"], str)
        assert isinstance(entry["at_bound"], bool)
        assert isinstance(entry["identifiable"], bool)
        assert entry["standard_error"] is None or entry["standard_error"] > 0
        if entry["lower"] is not None and entry["standard_error"] is not None:
            assert entry["lower"] <= entry["value"] <= entry["upper"], name
    for stage in ("uncalibrated", "calibrated"):
        for part in ("tuning", "held_out"):
            assert {"mae", "median"} <= set(content[stage][part])
            assert all(number(content[stage][part][key]) for key in ("mae", "median", "bias"))
    for part in ("tuning", "held_out"):
        carried = content["calibrated"][part]["carried"]
        assert number(carried["mae"]) and all(number(v) for v in carried["by_horizon"].values())
    assert isinstance(content["effects"], list)
    for effect in content["effects"]:
        assert {"effect", "zones", "parameters"} <= set(effect)
    solver = content["solver"]
    assert {"name", "status", "iterations", "seconds", "starts"} <= set(solver)
    assert isinstance(solver["status"], str)
    assert isinstance(solver["iterations"], int)
    assert number(solver["seconds"])
    assert isinstance(content["case"], str)
    assert isinstance(content["version"], str)
    assert content["version"]
    assert isinstance(content["seed"], int)


def test_bundled_case_calibrates_to_the_contract() -> None:
    found = calibrated()
    assert found.solver.success
    assert found.solver.status == "Solve_Succeeded"
    content = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    check_calibration(content)
    assert content["effects"] == []
    assert content["case"] == "bundled_case"
    assert content["calibrated"]["held_out"]["mae"] < content["uncalibrated"]["held_out"]["mae"]
    assert {"exterior_wall_density", "interior_wall_density"} <= set(content["parameters"])
    for density in ("exterior_wall_density", "interior_wall_density"):
        entry = content["parameters"][density]
        assert entry["standard_error"] is None
        assert not entry["identifiable"]
        assert entry["unit"] == "kg/m^3"
        assert entry["value"] == network().nominal[density][0]


def test_calibrated_parameters_are_physical_and_theirs_is_the_model_s_order() -> None:
    found = calibrated()
    names = [p.name for p in network().parameters]
    values = {p.name: p for p in found.parameters}
    for i, parameter in enumerate(network().parameters):
        p = values[parameter.name]
        assert p.value == found.theta[i]
        assert (p.lower, p.upper, p.start, p.unit) == (
            parameter.lower,
            parameter.upper,
            parameter.start,
            parameter.unit,
        )
        assert p.lower is not None
        assert p.upper is not None
        assert p.lower <= p.value <= p.upper
    assert [p.name for p in found.parameters][: len(names)] == names


def test_bounds_and_identifiability_are_what_they_say() -> None:
    status = {p.name: p.status for p in calibrated().information.parameters}
    assert "through_priors" in status.values()
    for p in calibrated().parameters:
        if p.standard_error is None:
            continue
        (model,) = (q for q in network().parameters if q.name == p.name)
        z, low, high = (model.transform(v) for v in (p.value, model.lower, model.upper))
        assert p.at_bound == (min(z - low, high - z) < 0.01 * (high - low))
        # at least half of the prior's spread is gone, and wider priors of the others would not change that
        deviation = p.standard_error / model.slope(p.value)
        halved = deviation < 0.5 * model.prior_deviation and not p.at_bound
        assert p.identifiable == (halved and status[p.name] == "determined")
        assert deviation <= model.prior_deviation * (1 + 1e-9)


def test_a_parameter_that_the_data_determine_is_identifiable() -> None:
    found = calibrated()
    halved = {p.name for p in found.information.parameters if p.ratio < 0.5}
    assert halved
    told = replace(
        found.information,
        parameters=tuple(
            replace(p, status="determined" if p.name in halved else p.status) for p in found.information.parameters
        ),
    )
    deviations = np.diag([p.posterior_deviation**2 for p in told.parameters])
    names = [p.name for p in network().parameters]
    free = [names.index(p.name) for p in told.parameters]
    estimate = SimpleNamespace(
        problem=SimpleNamespace(free=free, grid=SimpleNamespace(network=network())),
        covariance=deviations,
        theta=found.theta,
    )
    assert {p.name for p in describe(cast(Estimate, estimate), told, {}) if p.identifiable} == halved
    assert not any(p.identifiable for p in describe(cast(Estimate, estimate), found.information, {}))


def test_reduced_model_is_certified_on_the_grid() -> None:
    check = calibrated().grid_check
    assert check.volumes == network().n_node
    assert 10 < check.order < 200
    assert check.runs >= 1
    assert 0.0 <= check.mean_difference <= check.max_difference < 0.01


def test_reported_errors_are_those_of_the_grid_at_theta() -> None:
    """The held-out error that is reported, recomputed on the grid with the parameters that are reported."""
    found, case = calibrated(), load_bundled_case()
    model = SymbolicModel(network())
    inputs = replay_inputs(case, network())
    for theta, reported in ((found.theta, found.calibrated), (network().start(), found.uncalibrated)):
        wanted = evaluate_model(model, theta, inputs, found.held_out).metrics
        assert reported["held_out"].metrics.mae == pytest.approx(wanted.mae, abs=2e-3)
        assert reported["held_out"].metrics.bias == pytest.approx(wanted.bias, abs=2e-3)


def test_evaluation_follows_the_contract() -> None:
    found, case = calibrated(), load_bundled_case()
    model = SymbolicModel(network())
    inputs = replay_inputs(case, network())
    evaluation = evaluate_model(model, found.theta, inputs, found.held_out, EvaluationSettings(horizons=HORIZONS))
    content = json.loads(json.dumps(evaluation.to_dict(), allow_nan=False))
    check_evaluation(content)
    assert content["steps"] == 72
    assert content["step_seconds"] == 300
    assert set(content["by_zone"]) == set(case.building.zone_names)
    assert set(content["by_horizon"]) == set(HORIZONS)
    assert content["by_horizon"]["6h"] == pytest.approx(content["mae"])


def test_evaluations_inside_a_result_follow_the_contract_too() -> None:
    for stage in (calibrated().uncalibrated, calibrated().calibrated):
        assert set(stage) == {"tuning", "held_out"}
        for evaluation in stage.values():
            check_evaluation(json.loads(json.dumps(evaluation.to_dict(), allow_nan=False)))


# Read back


def written(tmp_path: Path, content: Any) -> Path:
    path = tmp_path / "calibration.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return path


def test_parameters_come_back_as_they_were_found(tmp_path: Path) -> None:
    path = written(tmp_path, calibrated().to_dict())
    np.testing.assert_array_equal(load_parameters(path, network()), calibrated().theta)
    np.testing.assert_array_equal(load_parameters(str(path), network()), calibrated().theta)


def test_plain_numbers_do_as_well(tmp_path: Path) -> None:
    values = {p.name: p.start for p in network().parameters}
    np.testing.assert_array_equal(
        load_parameters(written(tmp_path, {"parameters": values}), network()), network().start()
    )


def entries() -> dict[str, Any]:
    return {p.name: {"value": p.start} for p in network().parameters}


def spoil(name: str, entry: Any) -> dict[str, Any]:
    return {"parameters": {**entries(), name: entry}}


BAD: dict[str, tuple[Any, str]] = {
    "no JSON": ("{", "expected JSON"),
    "a list": ([1, 2], "parameters"),
    "no parameters": ({"case": "x"}, "parameters"),
    "empty parameters": ({"parameters": {}}, "parameters"),
    "unknown name": (spoil("interior_film", {"value": 2.0}), "interior_film"),
    "missing name": ({"parameters": {k: v for k, v in entries().items() if k != "slab_coupling"}}, "slab_coupling"),
    "no value": (spoil("slab_coupling", {"start": 2.0}), "slab_coupling"),
    "text": (spoil("slab_coupling", {"value": "2"}), "slab_coupling"),
    "true": (spoil("slab_coupling", {"value": True}), "slab_coupling"),
    "negative": (spoil("slab_coupling", {"value": -2.0}), "slab_coupling"),
    "not finite": (spoil("slab_coupling", {"value": float("nan")}), "slab_coupling"),
    "probability above one": (spoil("shuffle_probability", {"value": 1.5}), "shuffle_probability"),
}


@pytest.mark.parametrize("name", BAD)
def test_files_that_hold_no_parameters_of_this_building_are_refused(tmp_path: Path, name: str) -> None:
    content, message = BAD[name]
    path = written(tmp_path, content)
    with pytest.raises(CalibrationError, match=message) as caught:
        load_parameters(path, network())
    assert str(path) in str(caught.value)
    assert isinstance(caught.value, CalibrationError)


def test_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="nothing.json"):
        load_parameters(tmp_path / "nothing.json", network())
    with pytest.raises(CalibrationError):
        load_parameters(tmp_path, network())


def test_files_say_what_was_estimated() -> None:
    whole = load_bundled_case()
    frame = whole.telemetry.frame.copy()
    column = next(c for c in frame if c.endswith("supply_air_flowrate_sensor"))
    frame.iloc[-300:-250, frame.columns.get_loc(column)] = np.nan
    case = replace(whole, telemetry=replace(whole.telemetry, frame=frame))
    result = calibrate(case, settings=CalibrationSettings(dx=1.0, starts=1))
    zone = next(d.zone for d in case.building.devices if column.startswith(d.name))
    start, end = case.stamps[-300].isoformat(), case.stamps[-251].isoformat()
    entry = {"zone": zone, "lacking": column, "start": start, "end": end, "hours": 4.1}
    for content in (result.to_dict(), result.calibrated["held_out"].to_dict()):
        assert content["estimated"] == [entry]
    for content in (calibrated().to_dict(), calibrated().calibrated["held_out"].to_dict()):
        assert "estimated" not in content
