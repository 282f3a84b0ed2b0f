"""The case folder while it is labelled: the draft always, the case whenever the draft is one, telemetry never touched."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from thermal.case.check import check_case
from thermal.case.load import load_case
from thermal.errors import CaseError, LabelError
from thermal.plan.page.draft import Draft, DraftDevice
from thermal.plan.page.store import CaseStore

Make = Callable[..., Draft]


def test_a_new_case_is_written_as_soon_as_it_is_one(tmp_path: Path, draft_with: Make) -> None:
    store = CaseStore(tmp_path / "new" / "case")
    assert store.draft.name == "case"
    half = draft_with(devices=(DraftDevice(name="V", type="vav", zone="C"),))
    assert not store.save(half)
    assert not (store.folder / "building.yaml").exists()
    assert store.save(draft_with(seconds=150.0))
    assert check_case(store.folder).floor_area == pytest.approx(6.0)
    assert "2 minutes of work" in (store.folder / "building.yaml").read_text(encoding="utf-8")
    assert not store.save(half)  # the case stays as it was valid last
    assert [d.name for d in load_case(store.folder).building.devices] == ["VAV_A", "VAV_B"]
    assert {p.name for p in store.folder.iterdir()} == {
        "building.yaml",
        "plan_F1.csv",
        "telemetry.parquet",
        "labelling",
    }
    assert {p.name for p in store.own.iterdir()} == {"labelling.json", "drawings", "pictures", "reports", "telemetry"}


def test_what_was_on_the_page_is_there_again(tmp_path: Path, draft_with: Make) -> None:
    store = CaseStore(tmp_path / "case")
    store.save(draft_with(name="", seconds=3.5))
    assert CaseStore(tmp_path / "case").draft == store.draft


def test_telemetry_and_its_units_stay_as_they_are(plan_draft: Any) -> None:
    folder = plan_draft.write()
    before = (folder / "telemetry.parquet").read_bytes()
    store = CaseStore(folder)
    assert store.findings == () and store.telemetry == "telemetry.parquet"
    assert store.save(store.draft.model_copy(update={"orientation": 15.0}))
    case = load_case(folder)
    assert case.building.orientation == 15.0
    assert case.building.airflows[0].fraction == 0.4
    assert case.building.geometry.glazing == {"A": {"south": 2.0, "west": 1.5}}  # type: ignore[union-attr]
    assert (folder / "telemetry.parquet").read_bytes() == before
    assert (
        yaml.safe_load((folder / "building.yaml").read_text(encoding="utf-8"))["units"] == plan_draft.content["units"]
    )


def test_a_file_that_says_the_same_keeps_the_comments_of_its_author(plan_draft: Any) -> None:
    plan_draft.content["floors"][0]["plan"] = "ground.csv"
    plan_draft.plans["ground.csv"] = plan_draft.plans.pop("plan_F1.csv")
    file = plan_draft.write() / "building.yaml"
    file.write_text("# by hand\n" + file.read_text(encoding="utf-8"), encoding="utf-8")
    store = CaseStore(file.parent)
    assert store.save(store.draft.model_copy(update={"seconds": 5.0}))
    assert file.read_text(encoding="utf-8").startswith("# by hand")
    wider = store.draft.floors[0].model_copy(update={"height": 2.5})
    assert store.save(store.draft.model_copy(update={"floors": (wider,)}))
    assert load_case(store.folder).building.geometry.floors[0].height == 2.5  # type: ignore[union-attr]
    assert [p.name for p in store.folder.glob("*.csv")] == ["ground.csv"]


def test_telemetry_that_comes_while_the_page_is_open_stays(tmp_path: Path, draft_with: Make) -> None:
    store = CaseStore(tmp_path / "case")
    store.save(draft_with())
    frame = pd.read_parquet(store.folder / "telemetry.parquet")
    frame["VAV_A/zone_air_temperature_sensor"] = [20.0, 21.0]
    frame.to_parquet(store.folder / "telemetry.parquet")
    before = (store.folder / "telemetry.parquet").read_bytes()
    assert not store.save(draft_with(name="renamed"))  # its unit is to be written by hand
    assert store.findings[0].kind == "case" and "zone_air_temperature_sensor" in store.findings[0].message
    assert (store.folder / "telemetry.parquet").read_bytes() == before
    file = store.folder / "building.yaml"
    file.write_text(file.read_text("utf-8") + "  zone_air_temperature_sensor: degC\n", encoding="utf-8")
    assert store.save(draft_with(name="renamed"))
    assert check_case(store.folder).name == "renamed"


def test_a_device_that_telemetry_needs_cannot_go_unnoticed(plan_draft: Any) -> None:
    store = CaseStore(plan_draft.write())
    assert not store.save(store.draft.model_copy(update={"devices": store.draft.devices[1:], "airflows": ()}))
    assert any("VAV_A" in f.message for f in store.findings)
    load_case(store.folder)


def test_a_renamed_floor_takes_its_file_along(plan_draft: Any) -> None:
    store = CaseStore(plan_draft.write())
    floor = store.draft.floors[0].model_copy(update={"name": "ground floor"})
    assert store.save(store.draft.model_copy(update={"floors": (floor,)}))
    assert sorted(p.name for p in store.folder.glob("plan_*")) == ["plan_ground_floor.csv"]


def test_a_case_that_was_edited_by_hand_counts_more(tmp_path: Path, draft_with: Make) -> None:
    store = CaseStore(tmp_path / "case")
    placed = DraftDevice(name="VAV_A", type="vav", zone="A", floor="F1", x=2.5, y=2.5)
    store.save(draft_with(devices=(placed,), seconds=60.0))
    file = store.folder / "building.yaml"
    file.write_text(file.read_text(encoding="utf-8").replace("orientation: 0.0", "orientation: 33.0"), encoding="utf-8")
    os.utime(file, (time.time() + 60.0, time.time() + 60.0))
    draft = CaseStore(tmp_path / "case").draft
    assert (draft.orientation, draft.seconds, draft.devices[0].x) == (33.0, 60.0, 2.5)


@pytest.mark.parametrize("spoil", ["{", "[]", '{"name": "x", "spam": 1}', "[" * 100_000])
def test_a_damaged_draft_is_refused_by_name(tmp_path: Path, draft_with: Make, spoil: str) -> None:
    CaseStore(tmp_path / "case").save(draft_with())
    (tmp_path / "case" / "labelling" / "labelling.json").write_text(spoil, encoding="utf-8")
    with pytest.raises(LabelError, match=r"labelling\.json"):
        CaseStore(tmp_path / "case")


def test_a_folder_of_other_things_is_refused(tmp_path: Path, table_draft: Any) -> None:
    (tmp_path / "letters").mkdir()
    (tmp_path / "letters" / "a.txt").write_text("dear", encoding="utf-8")
    with pytest.raises(LabelError, match="other files"):
        CaseStore(tmp_path / "letters")
    with pytest.raises(LabelError, match="a file"):
        CaseStore(tmp_path / "letters" / "a.txt")
    with pytest.raises(LabelError, match="zone table"):
        CaseStore(table_draft.write())


def test_a_folder_of_its_own_that_leads_elsewhere_is_refused(tmp_path: Path, plan_draft: Any) -> None:
    folder = plan_draft.write()
    (tmp_path / "elsewhere").mkdir()
    (folder / "labelling").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(LabelError, match="page's own"):
        CaseStore(folder)
    assert not any((tmp_path / "elsewhere").iterdir())


def test_an_empty_case_can_be_simulated_once_telemetry_is_there(tmp_path: Path, draft_with: Make) -> None:
    store = CaseStore(tmp_path / "case")
    store.save(draft_with())
    stamps = pd.date_range("2023-03-01", periods=288, freq="5min", tz="Europe/Berlin", name="timestamp")
    frame = pd.DataFrame({"weather_station/outside_air_temperature_sensor": 5.0 + np.zeros(288)}, index=stamps)
    frame["VAV_A/zone_air_temperature_sensor"] = frame["B/zone_air_temperature_sensor"] = 20.0
    frame.to_parquet(store.folder / "telemetry.parquet")
    file = store.folder / "building.yaml"
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    content["units"]["zone_air_temperature_sensor"] = "degC"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    again = CaseStore(store.folder)
    assert len(again.columns) == 3
    assert again.save(again.draft.model_copy(update={"orientation": 5.0}))
    assert load_case(store.folder).telemetry.frame.shape == (288, 3)
    with pytest.raises(CaseError):
        (store.folder / "building.yaml").write_text(yaml.safe_dump({**content, "devices": []}), encoding="utf-8")
        load_case(store.folder)


def test_the_draft_is_plain_json(tmp_path: Path, draft_with: Make) -> None:
    store = CaseStore(tmp_path / "case")
    store.save(draft_with())
    content = json.loads((store.own / "labelling.json").read_text(encoding="utf-8"))
    assert content["format"] == 1 and content["floors"][0]["legend"] == [".", "#", "+", "A", "B"]
