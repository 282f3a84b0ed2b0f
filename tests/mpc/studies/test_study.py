"""Studies: what is assumed and said, runs by rule and with perfect knowledge, what they leave behind."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration.errors import ResultsExistError
from mpc.errors import ControlError, PlantError
from mpc.loop.make import equip, pilot_weather
from mpc.loop.noise import SensorNoise
from mpc.reports.control import (
    comparison_summary,
    comparison_verdict,
    control_verdict,
    reason_rows,
    write_comparison,
    write_control,
)
from mpc.scenario.weather_files import weather_of_case
from mpc.studies.optimal_control import make_controller
from mpc.studies.registry import REGISTERED, KnownState, find_controller, register_controller
from mpc.studies.run import Comparison, compare_controllers, prediction_errors, run_controller
from mpc.studies.study import Study, StudySettings, make_study
from thermal import Building, load_bundled_case

START, END = "2023-01-09T06:00", "2023-01-09T08:00"


@pytest.fixture(scope="session")
def make(building: Building) -> Callable[..., Study]:
    def study(**options) -> Study:
        weather = pilot_weather(1, "2023-01-09", 1.0)
        return make_study(building, weather, START, END, StudySettings(dx=1.0, order=40, **options))

    return study


@pytest.fixture(scope="session")
def both(make: Callable[..., Study]) -> Comparison:
    """A rule and optimal control for two hours of a winter morning."""
    return compare_controllers(make(noise=SensorNoise()), ["reset", "mpc"])


def test_a_case_without_a_plant_gets_one_and_says_so() -> None:
    bare = load_bundled_case().building
    ready, said = equip(bare)
    assert [d.type for d in ready.devices].count("ahu") == [d.type for d in ready.devices].count("boiler") == 1
    assert said == ("the case names no air handler and no boiler: one of each is assumed",)
    none, said = equip(replace(bare, devices=()))
    assert sorted(d.zone for d in none.devices if d.type == "vav") == sorted(bare.zone_names)
    assert said[0].startswith("zones without a terminal get one")
    again, said = equip(none)
    assert again.devices == none.devices and said == ()


def test_the_last_day_of_the_weather_comes_again_for_the_forecast_but_not_for_the_run() -> None:
    case = load_bundled_case()
    weather = weather_of_case(case)
    study = make_study(case.building, weather, "2023-03-10T12:00", "2023-03-11T00:00", StudySettings(dx=1.0, order=20))
    last = weather.values("outside_air_temperature_sensor")[-288:]
    np.testing.assert_allclose(study.scenario.outdoor[study.steps :], last[:144])
    with pytest.raises(PlantError, match="weather: expected values until 2023-03-11 06:00"):
        make_study(case.building, weather, "2023-03-10", "2023-03-11T06:00", StudySettings(dx=1.0))


def test_names_are_checked(make: Callable[..., Study]) -> None:
    with pytest.raises(ControlError, match="guideline36"):
        find_controller("guideline")
    with pytest.raises(PlantError, match="one of reduced, grid, random, found 'full'$"):
        StudySettings(kind="full")  # type: ignore[arg-type]
    with pytest.raises(ControlError) as unknown:
        find_controller("xyz")
    assert str(unknown.value).count("guideline36") == 1
    with pytest.raises(ControlError, match="some, each once"):
        compare_controllers(make(), ["reset", "reset"])
    with pytest.raises(PlantError, match="a multiple of 300 s"):
        make().plant(400.0)


def test_plants_of_all_kinds_begin_alike(make: Callable[..., Study]) -> None:
    seen = [make(kind=kind).plant(900.0).reset().values_array for kind in ("reduced", "grid", "random")]
    for one in seen[1:]:
        assert np.nanmedian(np.abs(one - seen[0])) < 0.05


def test_the_bound_knows_the_state(make: Callable[..., Study]) -> None:
    """Its plan of the first hour comes true but for what is decided anew."""
    study = make()
    plant = study.plant(900.0, bound=True)
    known = KnownState(study.truth, plant)
    controller = make_controller(study.truth, plant, observer=known)
    action = controller.step(plant.reset(0), plant.forecast())
    np.testing.assert_array_equal(known.modal_state, plant.model.modal_state)
    assert not known.disturbance.any()
    plant.step(action)
    planned = action.solution.rollout.zone[3]
    np.testing.assert_allclose(plant.record().zone_temperature[-1], planned, atol=0.15)


@pytest.mark.long
def test_optimal_control_costs_less_and_the_pages_say_it(both: Comparison, tmp_path: Path) -> None:
    rule, mpc = both.runs
    assert mpc.cost < rule.cost and both.best_rule is rule and both.way_to_bound(mpc) is None
    assert both.saving(mpc) == pytest.approx(1.0 - mpc.objective / rule.objective)
    assert "Optimal control spent" in comparison_verdict(both) and "outdoor reset" in comparison_verdict(both)
    assert "All 8 actions followed a plan" in control_verdict(mpc)
    errors = prediction_errors(mpc)
    assert errors["count"] == 5 and errors["zone_mae"] < 0.5 and prediction_errors(rule) == {}
    page = write_comparison(both, tmp_path / "both", command="buildingmpc compare").read_text(encoding="utf-8")
    assert "Side by side" in page and "Expected and realised" in page and "http" not in page.split("<style>")[0]
    content = json.loads((tmp_path / "both" / "comparison.json").read_text(encoding="utf-8"))
    assert content["best_rule"] == "reset" and content == json.loads(json.dumps(comparison_summary(both)))
    course = pd.read_parquet(tmp_path / "both" / "trajectory_mpc.parquet")
    assert len(course) == 24 and course.index.tz is not None
    zone = course[[c for c in course if c.startswith("true/") and c[5:] in both.study.scenario.zones]]
    assert zone.to_numpy() == pytest.approx(mpc.loop.record.zone_temperature[1:] - 273.15)


@pytest.mark.long
def test_one_run_is_written_whole(both: Comparison, tmp_path: Path) -> None:
    page = write_control(both.runs[0], tmp_path / "one")
    assert sorted(p.name for p in page.parent.iterdir()) == ["control.json", "report.html", "trajectory.parquet"]
    with pytest.raises(ResultsExistError):
        write_control(both.runs[0], tmp_path / "one")
    content = json.loads((page.parent / "control.json").read_text(encoding="utf-8"))
    assert content["controller"] == "reset" and content["actions"]["count"] == 24 and content["kpis"]["zones"]


def test_the_log_has_each_reason_once(both: Comparison) -> None:
    mpc = both.runs[1]
    said = (
        "zone 'a' stays 0.4 K below 21.0 degC at 2023-01-09 06:15",
        "zone 'a' stays 0.5 K below 21.0 degC at 2023-01-09 06:30",
    )
    told = tuple(d._replace(reasons=said[k : k + 1]) for k, d in enumerate(mpc.decisions))
    rows = reason_rows(replace(mpc, decisions=told))
    assert [(row.times, row.reason) for row in rows] == [(2, said[0])]
    assert rows[0].first == told[0].stamp and rows[0].last == told[1].stamp


@pytest.mark.parametrize("made", [None, 3])
def test_a_function_that_makes_no_controller_is_refused(make: Callable[..., Study], made: object) -> None:
    register_controller("none_at_all")(lambda study, plant: made)  # type: ignore[arg-type, return-value]
    try:
        with pytest.raises(ControlError, match=f"'none_at_all': expected an object with step.*found {made}; return"):
            run_controller(make(), "none_at_all")
    finally:
        del REGISTERED["none_at_all"]


def test_verdicts_say_how_long_and_what_is_lowest(make: Callable[..., Study]) -> None:
    verdict = comparison_verdict(compare_controllers(make(), ["reset"]))
    assert verdict.startswith("Outdoor reset has the lowest cost with discomfort: Outdoor reset spent ")
    assert " on energy in 2 hours (" in verdict


def test_rules_run_by_name(make: Callable[..., Study]) -> None:
    study = make()
    for name in ("schedule", "guideline36"):
        run = run_controller(study, name)
        assert run.sources == {} and len(run.loop.actions) == 24 and run.cost > 0.0
