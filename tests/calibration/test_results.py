"""Results: plain values, tables and figures of them; folders of them are refused, forced, and never half-written."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot

from calibration import (
    CalibrationError,
    CalibrationResult,
    CalibrationSettings,
    CrossValidation,
    Information,
    Interval,
    ModelSettings,
    Power,
    Profile,
    Selection,
    calibrate,
    fisher_information,
)
from calibration.errors import ResultsExistError
from calibration.evaluation.settings import calibration_settings
from calibration.fit.cross_validation import Fold, ParameterSpread
from calibration.fit.selection import Candidate, compare_candidates
from calibration.identifiability.power import ParameterPower
from calibration.identifiability.profile import ProfileInterval
from calibration.results import Result, check_results_folder, plain, to_json, write_results
from thermal import PARAMETERS, Structure, load_bundled_case


def table() -> pd.DataFrame:
    index = pd.date_range("2023-10-29T00:00", periods=4, freq="h", tz="Europe/Berlin", name="timestamp")
    return pd.DataFrame({"simulated": [20.0, np.nan, 21.0, 22.0]}, index=index)


def test_files_of_each_kind_are_written(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "results"
    written = write_results(out, {"a.json": {"mae": 0.5}, "b.parquet": table(), "c.html": "<p>ö", "d.bin": b"\0"})
    assert sorted(p.name for p in written.iterdir()) == ["a.json", "b.parquet", "c.html", "d.bin"]
    assert json.loads((out / "a.json").read_text(encoding="utf-8")) == {"mae": 0.5}
    assert (out / "c.html").read_bytes() == "<p>ö".encode()
    pd.testing.assert_frame_equal(pd.read_parquet(out / "b.parquet"), table(), check_freq=False)
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["results"]


def test_json_is_plain() -> None:
    content = {
        "nan": float("nan"),
        "inf": np.inf,
        "number": np.float64(0.25),
        "count": np.int64(3),
        "flag": np.bool_(True),
        "array": np.array([[1.0, np.nan]]),
        "stamp": pd.Timestamp("2023-10-29T02:30", tz="Etc/GMT-1"),
        "path": Path("results"),
        "tuple": (1, None),
    }
    assert json.loads(to_json(content)) == {
        "nan": None,
        "inf": None,
        "number": 0.25,
        "count": 3,
        "flag": True,
        "array": [[1.0, None]],
        "stamp": "2023-10-29T02:30:00+01:00",
        "path": "results",
        "tuple": [1, None],
    }
    assert math.isclose(json.loads(to_json({"x": 0.1 + 0.2}))["x"], 0.1 + 0.2)


def test_an_empty_folder_is_taken(tmp_path: Path) -> None:
    write_results(tmp_path, {"a.json": {}})
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_a_folder_that_holds_something_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("keep", encoding="utf-8")
    with pytest.raises(ResultsExistError, match=r"expected an empty or new folder, found mine\.txt"):
        write_results(tmp_path, {"a.json": {}})
    assert [p.name for p in tmp_path.iterdir()] == ["mine.txt"]


def test_force_replaces_its_own_files_only(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("keep", encoding="utf-8")
    (tmp_path / "a.json").write_text("old", encoding="utf-8")
    write_results(tmp_path, {"a.json": {"new": 1}, "b.json": {}}, force=True)
    assert (tmp_path / "mine.txt").read_text(encoding="utf-8") == "keep"
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == {"new": 1}
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.json", "b.json", "mine.txt"]


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(ResultsExistError, match="found a file"):
        check_results_folder(tmp_path / "file", force=True)
    with pytest.raises(CalibrationError, match="can be written to"):
        check_results_folder(tmp_path / "file" / "below")


def test_checking_makes_nothing(tmp_path: Path) -> None:
    assert check_results_folder(tmp_path / "new") == tmp_path / "new"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("force", [False, True])
def test_nothing_is_left_of_results_that_cannot_be_written(tmp_path: Path, force: bool) -> None:
    out = tmp_path / "results"
    if force:
        out.mkdir()
        (out / "a.json").write_text("old", encoding="utf-8")
    naive = table().tz_localize(None)
    with pytest.raises(TypeError, match="time zone"):
        write_results(out, {"a.json": {"new": 1}, "b.parquet": naive}, force=force)
    with pytest.raises(TypeError, match="not JSON serializable"):
        write_results(out, {"a.json": {"new": 1}, "b.json": {"x": object()}}, force=force)
    left = {
        p.relative_to(tmp_path).as_posix(): p.read_text(encoding="utf-8") for p in tmp_path.rglob("*") if p.is_file()
    }
    assert left == ({"results/a.json": "old"} if force else {})


def test_a_failure_while_files_move_restores_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.json").write_text("old a", encoding="utf-8")
    (tmp_path / "b.json").write_text("old b", encoding="utf-8")
    replace, calls = os.replace, []

    def failing(source: Path, target: Path) -> None:
        calls.append(target)
        if Path(target) == tmp_path / "c.json":
            raise OSError("disk full")
        replace(source, target)

    monkeypatch.setattr(os, "replace", failing)
    with pytest.raises(OSError, match="disk full"):
        write_results(tmp_path, {"a.json": {}, "b.json": {}, "c.json": {}}, force=True)
    assert len(calls) > 3
    assert {p.name: p.read_text(encoding="utf-8") for p in tmp_path.iterdir()} == {"a.json": "old a", "b.json": "old b"}


@pytest.mark.parametrize("name", ["../a.json", "sub/a.json", "", ".."])
def test_names_that_lead_elsewhere_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(CalibrationError, match="plain file names"):
        write_results(tmp_path / "results", {name: {}})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("force", [False, True])
def test_a_case_folder_is_no_folder_for_results(tmp_path: Path, force: bool) -> None:
    case = tmp_path / "case"
    case.mkdir()
    (case / "building.yaml").write_text("format: 3", encoding="utf-8")
    with pytest.raises(ResultsExistError, match="expected a folder for results, found a case folder"):
        write_results(case, {"report.html": ""}, force=force)
    assert [p.name for p in case.iterdir()] == ["building.yaml"]
    write_results(case / "results", {"report.html": ""})  # inside of it they may be


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a file system that is not for files")
@pytest.mark.parametrize("out", ["/proc", "/proc/results", "/proc/self/deep/results"])
def test_a_place_that_cannot_be_written_to_is_named(out: str) -> None:
    for force in (False, True):
        with pytest.raises(CalibrationError, match="expected a place that can be written to, found"):
            check_results_folder(out, force)


# Shown


@pytest.fixture(autouse=True)
def figures_are_closed() -> Iterator[None]:
    yield
    pyplot.close("all")


@cache
def calibrated() -> CalibrationResult:
    return calibrate(load_bundled_case(), settings={"dx": 1.5, "starts": 1})


def information() -> Information:
    pair = [PARAMETERS[name] for name in ("slab_coupling", "window_u_value")]
    return fisher_information(pair, np.array([[9.0, 0.0], [0.0, 0.2]]), np.diag([p.prior_deviation**-2 for p in pair]))


def power() -> Power:
    parameters = (
        ParameterPower("slab_coupling", 0.3, 0.2, 0.4, "yes"),
        ParameterPower("window_u_value", 0.9, 0.8, 1.0, "no"),
    )
    return Power(parameters, information(), {"a": 0.3}, 2, 0)


def profile() -> Profile:
    values = np.array([1.0, 2.0, 3.0])
    interval = ProfileInterval(0.9, 1.2, 2.8, False, False)
    return Profile(
        PARAMETERS["slab_coupling"], True, 2.0, values, (values - 2.0) ** 2, np.ones((3, 1)), (interval,), 0.0, 0
    )


def selection() -> Selection:
    index = pd.date_range("2023-03-01T01:00", periods=240, freq="h", tz="Etc/GMT+5")
    errors = [pd.Series(np.full(240, e), index=index) for e in (0.3, 0.2)]
    return compare_candidates(
        [Candidate(name, ModelSettings(), 9, 0.3, np.zeros(9), 0.0, float(e.mean()), True, 60.0, 3000, e)
         for name, e in zip(("bare", "full"), errors, strict=True)]
    )  # fmt: skip


def cross_validation() -> CrossValidation:
    stamps = load_bundled_case().stamps
    days = [Interval(stamps[288 * k], stamps[288 * k + 287]) for k in range(3)]
    folds = tuple(Fold((day,), (), 0.2 + 0.1 * k, 0.0) for k, day in enumerate(days))
    return CrossValidation(folds, 0.3, 0.05, (ParameterSpread("slab_coupling", 0.1, 0.1, 0.1, False),))


SHOWN: dict[str, tuple[Callable[[], Result], str, tuple[str, ...]]] = {
    "calibration": (calibrated, "bundled_case, held-out MAE", ("value", "low90", "high90", "standard_error")),
    "evaluation": (lambda: calibrated().calibrated["held_out"], "MAE 0.", ("mae", "bias")),
    "information": (information, "1 of 2 parameters determined", ("ratio", "status")),
    "power": (power, "will tell 1 of 2 parameters", ("ratio", "told")),
    "profile": (profile, "slab_coupling 2 ", ("deviance",)),
    "selection": (selection, "full preferred of bare, full", ("held_out_mae", "log_evidence")),
    "cross-validation": (cross_validation, "MAE 0.300 ± 0.050 K over 3 folds", ("mae", "bias")),
}


@pytest.mark.parametrize("name", SHOWN)
def test_a_result_shows_itself(name: str) -> None:
    make, line, columns = SHOWN[name]
    found = make()
    assert repr(found).startswith(f"<{type(found).__name__}: ") and line in repr(found)
    assert len(repr(found)) < 200 and "\n" not in repr(found)
    table = found.to_frame()
    assert set(columns) <= set(table.columns) and len(table) >= 1
    assert "<table" in found._repr_html_() and line in found._repr_html_()
    axes = found.plot()
    assert axes.get_xlabel() and axes.has_data()
    assert found.plot(axes) is axes
    json.dumps(found.to_dict(), allow_nan=False)


def test_numbers_of_the_tables_are_those_of_the_result() -> None:
    found = calibrated()
    table = found.to_frame()
    assert list(table.index) == [p.name for p in found.parameters]
    assert table["value"].to_dict() == {p.name: p.value for p in found.parameters}
    for p in found.parameters:
        if p.interval90 is not None:
            assert tuple(table.loc[p.name, ["low90", "high90"]]) == p.interval90
    held_out = found.calibrated["held_out"]
    assert held_out.to_frame()["mae"].to_dict() == {z: e["mae"] for z, e in held_out.by_zone().items()}
    growth = held_out.growth()
    assert growth.iloc[-1] == pytest.approx(held_out.metrics.mae, rel=1e-9)
    assert growth.index[-1] == 6.0 and growth.iloc[0] < growth.iloc[-1]


def test_plain_values_are_those_of_the_fields() -> None:
    spread = ParameterSpread("slab_coupling", 0.1, float("nan"), 0.1, False)
    assert plain((spread,)) == {
        "slab_coupling": {"deviation": 0.1, "jackknife_error": None, "standard_error": 0.1, "moves": False}
    }
    assert plain(ProfileInterval(0.9, 1.0, 2.0, False, True)) == {
        "level": 0.9, "lower": 1.0, "upper": 2.0, "open_lower": False, "open_upper": True
    }  # fmt: skip
    start, end = load_bundled_case().stamps[[0, 9]]
    assert Interval(start, end).to_dict() == {"start": start.isoformat(), "end": end.isoformat()}


def test_settings_come_by_name_or_as_objects() -> None:
    wanted = CalibrationSettings(dx=1.0, effects={"solar_gain": ()}, starts=1)
    assert calibration_settings({"dx": 1.0, "effects": ["solar_gain"], "starts": 1}) == wanted
    assert calibration_settings(wanted) == wanted
    assert calibration_settings(wanted, {"seed": 3}).seed == 3
    assert wanted.model == ModelSettings(dx=1.0, effects={"solar_gain": ()})
    assert calibration_settings(wanted.model) == CalibrationSettings(dx=1.0, effects={"solar_gain": ()})
    assert calibration_settings({"structure": {"furniture": False}}).structure == Structure(furniture=False)
    with pytest.raises(CalibrationError, match="calibrate takes no 'dz'; the nearest valid one is 'dx'"):
        calibration_settings({"dz": 1.0})
    with pytest.raises(CalibrationError, match="'tune' is no setting; give it to calibrate beside the settings"):
        calibration_settings({"tune": []})
    with pytest.raises(CalibrationError, match="starts: expected at least 1"):
        CalibrationSettings(starts=0)
