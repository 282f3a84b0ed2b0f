"""The parameter recovery from lines to verdict, with estimators whose coverage is known, and one real twin."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from thermal import PARAMETERS
from thermal.pilot.twin import _draw_values

Lines = Callable[..., list[dict[str, Any]]]


@pytest.fixture(scope="module")
def recovery(script: Callable[[str], ModuleType]) -> ModuleType:
    for name in ("_table", "_code", "_coverage", "_recovery_tables"):
        script(name)
    return script("parameter_recovery")


@pytest.fixture(scope="module")
def tables(recovery: ModuleType, script: Callable[[str], ModuleType]) -> ModuleType:
    return script("_recovery_tables")


@pytest.fixture
def study(recovery: ModuleType) -> Any:
    """What the command measures by default."""
    return recovery.Study(21.0, 6, 300.0, 1.0, "alternate", "sensors", None)


@pytest.fixture
def lines(study: Any) -> Lines:
    """Lines of an estimator with normal errors of deviation 1 that says `width` times that, 60 twins of 12 parameters.

    A fourth of the variance of its errors is the twin's.
    """

    def make(width: float = 1.0, own: bool = False) -> list[dict[str, Any]]:
        rng = np.random.default_rng(3)
        return [line(seed, rng, width, own) for seed in range(60)]

    def line(seed: int, rng: np.random.Generator, width: float, own: bool) -> dict[str, Any]:
        z = np.sqrt(0.75) * rng.standard_normal(12) + np.sqrt(0.25) * rng.standard_normal()
        conditions = {"disturbance_deviation": 1.0 + seed, "disturbance_time": 3600.0, "noise": 0.05, "resolution": 0.0}
        return {
            "seed": seed,
            "study": asdict(study),
            "code": "0",
            "conditions": {**conditions, "excitation": "prbs" if seed % 2 else "schedule"},
            "parameters": [entry(f"p{k}", 0.3 * value, width, own, k % 2 == 0) for k, value in enumerate(z)],
            "mae": {"before": 0.5, "after": 0.2, "truth": 0.19},
            "solver": {"status": "Solve_Succeeded", "success": True},
            "seconds": {"twin": 1.0, "calibrate": 5.0},
        }

    def entry(name: str, miss: float, width: float, own: bool, identifiable: bool) -> dict[str, Any]:
        return {
            "name": name,
            "identifiable": identifiable,
            "at_bound": False,
            "truth": 2.0 + miss,
            "estimate": 2.0,
            "error": 0.3 * width,
            "prior_deviation": 0.6,
            "lower": 0.8,
            "upper": 3.2,
            "own_interval90": [2.0 - 0.3 * 1.6449, 2.0 + 0.3 * 1.6449] if own else None,
        }

    return make


def test_an_estimator_of_known_coverage_passes(tables: ModuleType, lines: Lines) -> None:
    short, _, page, data = tables.report(lines())
    by_level = {c["level"]: c for c in data["pooled"]["all"]}
    assert by_level[0.9]["coverage"] == pytest.approx(0.9, abs=0.03)
    assert by_level[0.9]["design_effect"] > 1.2
    assert all(c["inside"] for found in data["pooled"].values() for c in found)
    assert ", inside the 99% band" in short
    assert page.startswith(short)
    frame = tables.intervals(lines())
    assert frame["width"].to_numpy() == pytest.approx(0.5)
    assert np.sqrt(np.mean(frame["z"] ** 2)) == pytest.approx(1.0, abs=0.1)


def test_where_data_say_nothing_the_prior_covers_once_it_is_cut_to_the_range(
    recovery: ModuleType, tables: ModuleType, lines: Lines
) -> None:
    """True values never leave their range: the whole normal prior holds them too often, the cut one as it says."""
    found = lines()
    for line in found:
        drawn = _draw_values(line["seed"], tuple(PARAMETERS.values()))
        line["parameters"] = []
        for name, p in PARAMETERS.items():
            prior = SimpleNamespace(
                name=name, unit=p.unit, value=p.start, identifiable=False, at_bound=False,
                standard_error=p.prior_deviation * p.slope(p.start),
            )  # fmt: skip
            line["parameters"].append(recovery.on_estimation_scale(prior, p, drawn[name]))
    *_, data = tables.report(found)
    for c in data["pooled"]["all, cut to range"]:
        assert c["inside"]
    whole = data["pooled"]["all"][1]
    assert (whole["level"], whole["inside"]) == (0.9, False)
    assert whole["coverage"] == pytest.approx(0.945, abs=0.02)


def test_half_the_width_fails(tables: ModuleType, lines: Lines) -> None:
    short, _, page, data = tables.report(lines(width=0.5))
    found = {c["level"]: c for c in data["pooled"]["all"]}[0.9]
    assert found["coverage"] == pytest.approx(0.59, abs=0.05)  # of 0.82 deviations to either side
    assert not found["inside"]
    assert "OUTSIDE the 99% band" in short
    assert "| p0 | 60 | 100% | 0% |" in page


def test_intervals_of_the_result_itself_take_their_place(tables: ModuleType, lines: Lines) -> None:
    *_, data = tables.report(lines(width=0.5, own=True))
    inside = {c["level"]: c["inside"] for c in data["pooled"]["all"]}
    assert inside == {0.5: False, 0.9: True, 0.95: False}


def test_failures_and_stale_lines_are_named(tables: ModuleType, lines: Lines) -> None:
    found = lines()
    found[7] = {"seed": 7, "study": found[7]["study"], "code": "0", "failure": "CalibrationError: every start failed"}
    found[8] |= {"solver": {"status": "Maximum_Iterations_Exceeded", "success": False}, "code": "1"}
    short, _, page, data = tables.report(found)
    assert "**1 twins failed:** 7: CalibrationError: every start failed" in short
    assert data["failed"] == {7: "CalibrationError: every start failed"}
    assert "**Did not converge:** seeds [8]" in page
    assert "2 versions of the code" in page
    with pytest.raises(SystemExit, match="at least one calibrated twin"):
        tables.report([found[7]])


def test_a_study_goes_on_where_it_was(
    recovery: ModuleType, lines: Lines, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three lines, one of them of a failure and one cut off by a kill: the latter is measured again, and a fourth."""
    known, measured = lines(), []

    def measure(study: Any, seed: int) -> dict[str, Any]:
        measured.append(seed)
        return known[seed]

    texts = [json.dumps(line) for line in known[:3]]
    texts[1] = json.dumps({"seed": 1, "study": known[1]["study"], "code": "0", "failure": "ModelError: gone"})
    path = tmp_path / "parameter_recovery.jsonl"
    path.write_text("\n".join(texts)[:-40], encoding="utf-8")
    monkeypatch.setattr(recovery, "measure", measure)
    monkeypatch.setattr(recovery, "ProcessPoolExecutor", lambda workers, context: ThreadPoolExecutor(workers))
    monkeypatch.setattr("sys.argv", ["parameter_recovery.py", "--out", str(tmp_path), "--seeds", "4"])
    recovery.main()
    assert sorted(measured) == [2, 3]
    assert "1: ModelError: gone" in (tmp_path / "parameter_recovery.md").read_text(encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["parameter_recovery.py", "--out", str(tmp_path), "--seeds", "4", "--retry"])
    recovery.main()
    assert sorted(measured) == [1, 2, 3]
    data = json.loads((tmp_path / "parameter_recovery.json").read_text(encoding="utf-8"))
    assert data["failed"] == {}
    assert [twin["seed"] for twin in data["twins"]] == [0, 1, 2, 3]
    monkeypatch.setattr("sys.argv", ["parameter_recovery.py", "--out", str(tmp_path), "--days", "7"])
    with pytest.raises(SystemExit, match="choose another --out"):
        recovery.main()


def test_a_twin_from_plan_to_line(recovery: ModuleType, tables: ModuleType) -> None:
    small = {"zones": 2, "floor_area": 80.0, "excitation": "alternate", "meter": "sensors", "case": None}
    line = recovery.measure(recovery.Study(days=2.0, dx=1.5, **small), 1)
    assert "failure" not in line, line.get("traceback")
    assert line["conditions"]["excitation"] == "prbs"
    assert len(line["parameters"]) == 13
    for p in line["parameters"]:
        assert p["lower"] <= p["truth"] <= p["upper"]
        assert p["error"] > 0.0
    assert json.loads(json.dumps(line)) == line
    assert 0.0 < line["mae"]["truth"] < line["mae"]["before"]
    assert tables.report([line])[-1]["twins"][0]["seed"] == 1
    broken = recovery.measure(recovery.Study(days=2.0, dx=0.3, **small), 1)
    assert broken["failure"].startswith("ModelError")


def test_standard_errors_go_to_the_estimation_scale(recovery: ModuleType) -> None:
    for name, value, error in (("slab_coupling", 20.0, 0.2), ("shuffle_probability", 0.7, 0.002)):
        p = PARAMETERS[name]
        estimate = SimpleNamespace(
            name=name, unit=p.unit, value=value, standard_error=error, identifiable=True, at_bound=False
        )
        found = recovery.on_estimation_scale(estimate, p, 1.1 * value)
        assert found["error"] == pytest.approx(p.transform(value + error) - p.transform(value), rel=1e-2)
        assert found["truth"] - found["estimate"] == pytest.approx(p.transform(1.1 * value) - p.transform(value))
