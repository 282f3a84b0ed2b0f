"""What devices give their heat by: what the file may say, and the power of each device."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from thermal.case.building import Building, Device, Location, ZoneEntry, ZoneTable
from thermal.case.case import Case
from thermal.case.emitters import emitters_of, unknown_heaters
from thermal.case.load import load_case
from thermal.case.points import HEATING_POWER
from thermal.case.save import save_case
from thermal.case.telemetry import Telemetry
from thermal.errors import CaseError
from thermal.inputs.provider import telemetry_inputs

SITE = Location(latitude=48, longitude=12, elevation=690, timezone="Etc/GMT-1")


def heated() -> Case:
    """Two heaters in one room, one in another, and a terminal; some readings are missing."""
    zones = tuple(ZoneEntry(name=zone, volume=60.0, floor_area=20.0) for zone in ("A", "B", "C"))
    kinds = (("H1", "electric_heater", "A", "floor"), ("H2", "radiator", "A", None), ("H3", "radiator", "B", None))
    devices = [Device(name=n, type=t, zone=z, emitter=cast(Any, e)) for n, t, z, e in kinds]
    devices.append(Device(name="V", type="vav", zone="C"))
    stamps = pd.date_range("2024-01-01 01:00", periods=96, freq="h", tz="Etc/GMT-1", name="timestamp")
    hour = np.arange(96.0) % 24
    frame = pd.DataFrame({f"H{n}/{HEATING_POWER}": n * (100.0 + hour) for n in (1, 2, 3)}, index=stamps)
    frame.loc[stamps[60:80], f"H1/{HEATING_POWER}"] = np.nan
    return Case(Building("house", SITE, 0.0, ZoneTable(zones), tuple(devices)), Telemetry.from_frame(frame))


def test_what_is_said_and_what_is_not() -> None:
    building = heated().building
    assert [(e.zone, e.kind, e.devices) for e in emitters_of(building)] == [("A", "floor", (0,))]
    found = [(e.zone, e.kind, e.sides) for e in emitters_of(building, "floor")]
    assert found == [("A", "floor", ("floor",)), ("A", "unknown_floor", ("floor",)), ("B", "unknown_floor", ("floor",))]
    assert [e.sides for e in emitters_of(building, "radiator")] == [("floor",), (), ()]
    assert unknown_heaters(building, {f"H2/{HEATING_POWER}", f"V/{HEATING_POWER}"}) == ("H2",)


def test_powers_of_the_devices_are_those_of_their_zone() -> None:
    case = heated()
    power, heat = case.heating_power_estimated(), case.zone_heat_estimated()
    assert power[3].eq(0.0).all()
    whole = power[[0, 1]].sum(axis=1)
    known = heat["A"].notna()
    assert known.mean() > 0.9 and np.abs(whole - heat["A"])[known].max() < 1e-9
    pd.testing.assert_series_equal(power[1], case.usable[f"H2/{HEATING_POWER}"], check_names=False, check_freq=False)
    inputs = telemetry_inputs(case)
    assert inputs.values("emitted", "W").shape == (96, 4) and np.isfinite(inputs.emitted).all()
    assert inputs.emitted_rate[10] == pytest.approx([1.0, 2.0, 3.0, 0.0])


def test_a_device_that_is_not_read_gives_what_it_was_seen_to_give() -> None:
    """A small heater beside a large one, in a building whose other zone is warmed little, then much."""
    case = heated()
    frame, lost = case.telemetry.frame.copy(), slice(40, 70)
    names = [f"H{n}/{HEATING_POWER}" for n in (1, 2, 3)]
    hour = np.arange(96.0)
    for other in (50.0, 9000.0):
        frame[names[0]], frame[names[1]], frame[names[2]] = 100.0 + hour % 3, 1600.0 + hour % 5, other + hour % 7
        frame.loc[frame.index[lost], names[0]] = np.nan
        found = replace(case, telemetry=Telemetry.from_frame(frame))
        power, heat = found.heating_power_estimated(), found.zone_heat_estimated()["A"]
        gap = power[0].iloc[lost]
        assert gap.notna().all() and gap.between(100.0, 102.0).all()
        assert np.abs(power[[0, 1]].sum(axis=1) - heat)[heat.notna()].max() < 1e-9 and heat.notna().all()
        assert (heat >= frame[names[1]]).all()


def test_the_file_says_it_and_keeps_it(plan_draft: Any, tmp_path: Path) -> None:
    plan_draft.content["format"] = 3
    plan_draft.content["devices"][1]["emitter"] = "baseboard"
    case = load_case(save_case(load_case(plan_draft.write()), tmp_path / "new"))
    assert [d.emitter for d in case.building.devices] == [None, "baseboard", None]


@pytest.mark.parametrize(
    ("number", "device", "emitter", "message"),
    [
        (3, 1, "heated floor", r"emitter: expected .*'floor'"),
        (3, 0, "floor", r"devices\[0\] \(VAV_A\): emitter: expected 'air', or a heater .*found 'floor' of a device of type"),
        (3, 2, "floor", r"devices\[2\] \(AHU\): emitter: .*without a zone"),
        (2, 1, "floor", r"devices\[1\]\.emitter: .*write 'format: 3'"),
    ],
)
def test_what_cannot_be_is_refused(plan_draft: Any, number: int, device: int, emitter: str, message: str) -> None:
    plan_draft.content["format"] = number
    plan_draft.content["devices"][device]["emitter"] = emitter
    with pytest.raises(CaseError, match=message):
        load_case(plan_draft.write())
