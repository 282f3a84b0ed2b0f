"""The calibration benchmark on a small twin, its intervals, its tables, and that it goes on where it was."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType
from typing import Any

import pandas as pd
import pytest

from calibration import Interval, evaluate_model
from calibration.evaluation.n_step import EvaluationSettings
from thermal import Case
from thermal.model.case_replay import SPIN_UP
from thermal.network.structure import BASELINE
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinSettings, generate_twin

SCRIPTS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture(scope="module")
def study(script: Callable[[str], ModuleType]) -> ModuleType:
    for name in ("_table", "_code", "_coverage", "_recovery_tables", "parameter_recovery", "_paper_search"):
        script(name)
    return script("_calibration_study")


@pytest.fixture(scope="module")
def tables(study: ModuleType, script: Callable[[str], ModuleType]) -> ModuleType:
    return script("_calibration_tables")


@pytest.fixture(scope="module")
def case() -> Case:
    """Nine days of a twin with two zones, from a Friday on."""
    building = pilot_building(1, floor_area=60.0, zones=2, floors=1, name="office")
    return generate_twin(building, 1, TwinSettings(days=9.0, start="2023-01-13"))[0]


@pytest.fixture(scope="module")
def bench(study: ModuleType, case: Case) -> Any:
    return study.Bench(case, study.Study(evaluations=4))


def test_intervals_are_those_of_the_paper(study: ModuleType, case: Case, bench: Any) -> None:
    """A Friday's telemetry has three days of spin-up before Monday's 1:40, and Tuesday follows."""
    stamps = {name: str(bench.inputs.stamps[at])[:16] for name, at in bench.intervals.starts.items()}
    assert stamps == {"a": "2023-01-16 01:40", "b": "2023-01-17 01:40", "c": "2023-01-17 11:40"}
    tune = bench.intervals.tune
    assert (tune.end - tune.start) == pd.Timedelta(hours=6)
    assert study.whole_hours(tune) == "5h"
    assert bench.intervals.starts["a"] >= SPIN_UP / bench.inputs.step
    assert bench.intervals.tuning[0].end < bench.intervals.held_out[0].start
    later = study.choose_intervals(case, bench.inputs, study.Study(("03:00", "13:00"), "2023-01-18"))
    assert str(bench.inputs.stamps[later.starts["c"]])[:16] == "2023-01-19 13:00"
    assert study.whole_hours(later.tune) == "6h"
    for day in ("2023-01-14", "2023-01-23"):  # no spin-up; in the last third
        with pytest.raises(ValueError, match=f"expected {day} with 3 days"):
            study.choose_intervals(case, bench.inputs, study.Study(day=day))


def test_errors_are_those_of_an_evaluation(study: ModuleType, bench: Any) -> None:
    """On the hour, where `evaluate_model` has runs too."""
    grid, at = bench.grids[BASELINE], bench.intervals.starts["a"] + 4
    theta, stamps = grid.network.start(), bench.inputs.stamps
    target = Interval(stamps[at + 71], stamps[at + 72])
    spin_up_seconds = SPIN_UP + 71 * bench.inputs.step  # counted from the interval
    found = evaluate_model(grid, theta, bench.inputs, [target], EvaluationSettings(spin_up_seconds=spin_up_seconds))
    predictions = found.predictions[0]
    assert list(predictions.start) == [stamps[at]]
    error = study.run_error(grid, grid.matrices(theta), bench.inputs, at)
    assert error == pytest.approx(predictions.error, abs=1e-9)


@pytest.mark.long
def test_every_method_on_a_twin(study: ModuleType, tables: ModuleType, bench: Any) -> None:
    rows = [bench.uncalibrated(), bench.searched("paper", "our structure")]
    rows.append(bench.ours("ours, on (a)", [bench.intervals.tune]))
    start, paper, ours = rows
    assert (paper["evaluations"], paper["of"], len(paper["values"])) == (4, 8, 8)
    assert paper["errors"]["a"]["mae"] == min(paper["errors_of_search"])
    assert [row["tuned_on"] for row in rows] == [[], ["a"], ["a"]]
    assert ours["solver"]["success"]
    assert ours["evaluations"] > ours["solver"]["iterations"] > 0
    assert ours["errors"]["a"]["mae"] < start["errors"]["a"]["mae"]
    held_out = [row["errors"]["held out"]["mae"] for row in rows]
    rows.append({**ours, "method": "ours", "tuned_on": bench.intervals.inside(bench.inputs, bench.intervals.tuning)})
    lines = [{"case": name, "study": bench.study.to_dict(), "code": "0", "rows": rows} for name in ("one", "two")]
    first = {"commit": "0123456789", "cases": {"one": {"calibrated": 0.25}}}
    short, by_case, page = tables.report(lines, {"three": "ValueError: no day"}, first)
    medians = next(line for line in short.splitlines() if line.startswith("| ours |"))
    assert medians.count("(") == 3
    assert f"| one | {held_out[0]:.3f} | {held_out[1]:.3f} | {held_out[2]:.3f} | 0.250 | {held_out[2]:.3f} |" in by_case
    assert "| median of 1 |" in by_case
    assert "**1 cases failed:** three: ValueError: no day" in short
    assert page.startswith(by_case)
    json.dumps(lines)


def test_counting_ends(study: ModuleType, bench: Any) -> None:
    grid = bench.grids[BASELINE]
    start = grid.network.start()
    with study.counted() as seen:
        for theta in (start, 1.01 * start, start):
            grid.matrices(theta)
    grid.matrices(1.02 * start)
    assert len(seen) == 2


def test_the_first_version_is_read_from_a_readme(tables: ModuleType) -> None:
    page = (
        "text\n<!-- begin baseline_accuracy -->\n| case | zones | uncalibrated [K] | calibrated [K] | s |\n"
        "|---|---|---|---|---|\n| office | 5 | 0.769 | 0.456 | 3 |\n<!-- end baseline_accuracy -->\n| other | 1 |\n"
    )
    assert tables.accuracy_table(page) == {"office": {"uncalibrated": 0.769, "calibrated": 0.456}}
    kept = tables.first_version()
    assert len(kept["commit"]) == 40
    assert all(0.0 < errors["calibrated"] < 2.0 for errors in kept["cases"].values())


def test_a_study_goes_on_where_it_was(
    script: Callable[[str], ModuleType], tables: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command, measured = script("calibration_accuracy"), []
    row = {
        "method": "ours", "errors": {k: {"mae": 0.1} for k in tables.INTERVALS}, "tuned_on": [], "evaluations": 1,
        "cpu_seconds": 1.0, "on_bound": [], "of": 13,
    }  # fmt: skip

    def measure(path: Path, study: Any) -> dict[str, Any]:
        measured.append(path.name)
        if path.name == "two":
            raise ValueError("no day")
        return {"case": path.name, "study": study.to_dict(), "code": "0", "rows": [row], "wall_seconds": 1.0}

    monkeypatch.setattr(command, "measure", measure)
    monkeypatch.setattr(command, "cases_with_plans", lambda places: {p.name: p for p in places})
    monkeypatch.setattr(command, "ProcessPoolExecutor", lambda workers, context: ThreadPoolExecutor(workers))
    run = ["calibration_accuracy.py", "--out", str(tmp_path), "--cases", "one", "two"]
    for expected in (["one", "two"], ["one", "two", "two"]):  # what failed is tried again
        monkeypatch.setattr("sys.argv", run)
        command.main()
        assert measured == expected
    data = json.loads((tmp_path / "calibration.json").read_text(encoding="utf-8"))
    assert [line["case"] for line in data["cases"]] == ["one"]
    assert data["failed"] == {"two": "ValueError: no day"}
    monkeypatch.setattr("sys.argv", [*run, "--seed", "1"])
    with pytest.raises(SystemExit, match="choose another --out"):
        command.main()
