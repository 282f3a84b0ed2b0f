from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import thermal.case.save as saving
from thermal.case.building import Building, Device, FloorPlan, FloorPlans, Location, ZoneEntry, ZoneTable
from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.save import save_case
from thermal.case.telemetry import Telemetry
from thermal.errors import CaseError


def same(first: Case, second: Case) -> None:
    a, b = first.building, second.building
    assert (a.name, a.location, a.orientation, a.weather_station) == (
        b.name,
        b.location,
        b.orientation,
        b.weather_station,
    )
    assert (a.devices, a.airflows, a.zone_names) == (b.devices, b.airflows, b.zone_names)
    if isinstance(a.geometry, FloorPlans):
        assert isinstance(b.geometry, FloorPlans)
        assert (a.geometry.cell_size, a.geometry.glazing) == (b.geometry.cell_size, b.geometry.glazing)
        for one, other in zip(a.geometry.floors, b.geometry.floors, strict=True):
            assert (one.name, one.height, one.tokens.tolist()) == (other.name, other.height, other.tokens.tolist())
    else:
        assert isinstance(b.geometry, ZoneTable)
        assert (a.geometry.zones, a.geometry.surfaces) == (b.geometry.zones, b.geometry.surfaces)
        assert a.geometry.constructions == b.geometry.constructions
    pd.testing.assert_frame_equal(first.telemetry.frame, second.telemetry.frame, rtol=1e-12)
    assert first.step == second.step
    assert first.telemetry.missing_rows == second.telemetry.missing_rows
    assert first.quality == second.quality


@pytest.mark.parametrize("draft", ["plan_draft", "table_draft"])
def test_round_trip(request: pytest.FixtureRequest, tmp_path: Path, draft: str) -> None:
    written = request.getfixturevalue(draft)
    written.frame.iloc[4, 1] = np.nan
    written.frame.iloc[9, 2] = 999.0
    written.frame = written.frame.drop(written.frame.index[20:23])
    case = load_case(written.write())
    folder = save_case(case, tmp_path / "new" / "case")
    assert sorted(p.name for p in folder.iterdir()) == sorted(p.name for p in written.folder.iterdir())
    same(case, load_case(folder))


@pytest.mark.parametrize("name", ["practice_everything", "twinhouse_O5_exp1"])
def test_round_trip_of_shared_cases(shared_cases: Path, tmp_path: Path, name: str) -> None:
    case = load_case(shared_cases / name)
    same(case, load_case(save_case(case, tmp_path / name)))


def test_case_made_in_memory_with_numbers_of_numpy(tmp_path: Path) -> None:
    site = Location(latitude=np.float64(42.0), longitude=-88.0, elevation=0.0, timezone="America/Chicago")
    tokens = np.array([list(row) for row in ("####", "#ab#", "####")], dtype=object)
    floors = (FloorPlan("Erdgeschoß / 1", np.float32(3.0), tokens), )  # fmt: skip
    plans = FloorPlans(np.float64(0.5), floors, {np.str_("a"): {"south": np.float64(1.0)}})
    index = pd.date_range("2023-03-12", periods=400, freq="5min", tz="America/Chicago", name="timestamp")
    frame = pd.DataFrame({"X/zone_air_temperature_sensor": np.linspace(290.0, 295.0, 400)}, index=index)
    building = Building("möbel: 'x' #1", site, np.float64(10.0), plans, (Device(name="X", type="vav", zone="a"),))
    case = Case(building, Telemetry.from_frame(frame))
    again = load_case(save_case(case, tmp_path / "case"))
    same(case, again)
    assert (tmp_path / "case" / "plan_Erdgescho_1.csv").is_file()
    assert case.path is None and again.path == tmp_path / "case"


def test_floors_whose_file_names_would_be_the_same(tmp_path: Path, plan_draft: Any, spell_plan: Any) -> None:
    case = load_case(plan_draft.write())
    assert isinstance(case.building.geometry, FloorPlans)
    names = ["1/2", "1:2", "1 2"]
    tokens = [np.array([list("###"), ["#", zone, "#"], list("###")]) for zone in "ABC"]
    floors = tuple(FloorPlan(name, 3.0, drawn) for name, drawn in zip(names, tokens, strict=True))
    building = replace(case.building, geometry=FloorPlans(1.0, floors))
    again = load_case(save_case(replace(case, building=building), tmp_path / "case"))
    assert again.building.zone_names == ("A", "B", "C")


def test_slice_saves_with_what_it_holds(plan_draft: Any, tmp_path: Path) -> None:
    case = load_case(plan_draft.write()).slice("2023-03-01T01:00", "2023-03-01T02:00")
    assert len(load_case(save_case(case, tmp_path / "part")).stamps) == 13


def test_folder_that_holds_something_is_refused(plan_draft: Any, tmp_path: Path) -> None:
    case = load_case(plan_draft.write())
    before = {path.name: path.read_bytes() for path in plan_draft.folder.iterdir()}
    with pytest.raises(CaseError, match=r"expected no folder or an empty one.*--force"):
        save_case(case, plan_draft.folder)
    assert {path.name: path.read_bytes() for path in plan_draft.folder.iterdir()} == before
    (tmp_path / "empty").mkdir()
    save_case(case, tmp_path / "empty")


def test_file_in_the_way_is_refused(plan_draft: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(CaseError, match="found a file"):
        save_case(load_case(plan_draft.write()), tmp_path / "file", overwrite=True)


def test_overwrite_replaces_all_of_a_case(plan_draft: Any, table_draft: Any) -> None:
    case = load_case(plan_draft.write())
    folder = table_draft.write()
    save_case(case, folder, overwrite=True)
    same(case, load_case(folder))
    save_case(load_case(folder), folder, overwrite=True)
    same(case, load_case(folder))


def test_overwrite_spares_what_is_no_case(plan_draft: Any, tmp_path: Path) -> None:
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "thesis.txt").write_text("years of work")
    with pytest.raises(CaseError, match=r"a folder without building\.yaml"):
        save_case(load_case(plan_draft.write()), tmp_path / "home", overwrite=True)
    assert (tmp_path / "home" / "thesis.txt").is_file()


def broken(case: Case) -> Case:
    return replace(case, building=replace(case.building, devices=(Device(name="VAV_A", type="vav", zone="nowhere"),)))


@pytest.mark.parametrize("exists", [False, True])
def test_nothing_is_written_of_a_case_that_does_not_fit(plan_draft: Any, tmp_path: Path, exists: bool) -> None:
    case = load_case(plan_draft.write())
    target = tmp_path / "target"
    if exists:
        save_case(case, target)
    with pytest.raises(CaseError):
        save_case(broken(case), target, overwrite=True)
    assert target.exists() == exists
    if exists:
        same(case, load_case(target))
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_nothing_is_written_when_the_disk_fails(
    plan_draft: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = load_case(plan_draft.write())
    target = save_case(case, tmp_path / "target")

    def full(*_: object, **__: object) -> None:
        raise OSError("No space left on device")

    monkeypatch.setattr(pd.DataFrame, "to_parquet", full)
    with pytest.raises(OSError, match="No space"):
        save_case(case, target, overwrite=True)
    same(case, load_case(target))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plan_case", "target"]


def test_the_old_case_comes_back_when_the_new_one_cannot_move_in(
    plan_draft: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = load_case(plan_draft.write())
    target = save_case(case, tmp_path / "target")
    move = saving.os.replace

    def fails(source: Path, destination: Path) -> None:
        if source.name == "new":
            raise OSError("no")
        move(source, destination)

    monkeypatch.setattr(saving.os, "replace", fails)
    with pytest.raises(OSError, match="no"):
        save_case(case, target, overwrite=True)
    same(case, load_case(target))


def test_telemetry_without_a_time_zone_is_not_saved(tmp_path: Path) -> None:
    site = Location(latitude=42.0, longitude=-88.0, elevation=0.0, timezone="Etc/GMT+6")
    building = Building("x", site, 0.0, ZoneTable((ZoneEntry(name="a", volume=50.0, floor_area=20.0),)))
    index = pd.date_range("2023-03-12", periods=4, freq="5min", name="timestamp")
    frame = pd.DataFrame({"a/zone_air_temperature_sensor": [290.0, 291.0, 292.0, 293.0]}, index=index)
    with pytest.raises(CaseError):
        save_case(Case(building, Telemetry(frame, 300.0)), tmp_path / "case")
    assert not (tmp_path / "case").exists()
    with pytest.raises(CaseError):
        Telemetry.from_frame(frame)


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a file system that is not for files")
def test_a_place_that_cannot_be_written_to_is_named(plan_draft: Any) -> None:
    case = load_case(plan_draft.write())
    for target in ("/proc/case", "/proc/deep/case"):
        with pytest.raises(CaseError, match="expected a place that can be written to, found /proc: "):
            save_case(case, target)
