"""Folders of results: refused, forced, and never half-written."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration import CalibrationError
from calibration.errors import ResultsExistError
from calibration.results import check_results_folder, to_json, write_results


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
