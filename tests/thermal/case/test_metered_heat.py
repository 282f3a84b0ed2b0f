"""Heat of zones whose flow, discharge or power meter fails: estimated from the other zones', and said."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration.evaluation.intervals import default_intervals, select_runs
from thermal.case.building import Building, Device, Location, ZoneEntry, ZoneTable
from thermal.case.case import Case
from thermal.case.metered_heat import heat_parts, total_heat
from thermal.case.plan import zone_sizes
from thermal.case.points import DISCHARGE_TEMPERATURE, HEATING_POWER, SUPPLY_FLOW
from thermal.case.telemetry import Telemetry
from thermal.data import load_bundled_case
from thermal.model.case_replay import replay_inputs
from thermal.network.build import build_network

SITE = Location(latitude=48, longitude=12, elevation=690, timezone="Etc/GMT-1")


def heated(powers: dict[str, float], areas: dict[str, float], steps: int = 96) -> Case:
    """Zones with a heater each, at the powers of a day that grow by the hour [W]."""
    zones = tuple(ZoneEntry(name=zone, volume=3.0 * area, floor_area=area) for zone, area in areas.items())
    devices = tuple(Device(name=f"H_{zone}", type="electric_heater", zone=zone) for zone in powers)
    building = Building("house", SITE, 0.0, ZoneTable(zones), devices)
    stamps = pd.date_range("2024-01-01 01:00", periods=steps, freq="h", tz="Etc/GMT-1", name="timestamp")
    hour = np.arange(steps) % 24
    frame = {f"H_{zone}/{HEATING_POWER}": watts * (1.0 + hour) for zone, watts in powers.items()}
    return Case(building, Telemetry.from_frame(pd.DataFrame(frame, index=stamps)))


def without(case: Case, column: str, start: int = 0, end: int | None = None, value: float = np.nan) -> Case:
    """The case with a column at one value for some time."""
    frame = case.telemetry.frame.copy()
    frame.iloc[start:end, frame.columns.get_loc(column)] = value
    return Case(case.building, replace(case.telemetry, frame=frame))


def test_heat_is_that_of_the_others_by_floor_area() -> None:
    case = heated({"A": 10.0, "B": 20.0, "C": 40.0}, {"A": 10.0, "B": 20.0, "C": 40.0})
    dead = without(case, f"H_C/{HEATING_POWER}", 48, 60)
    pd.testing.assert_frame_equal(dead.zone_heat_estimated(), case.zone_heat())
    assert dead.zone_heat()["C"].isna().sum() == 12
    assert dead.heat_is_estimated().sum().to_dict() == {"A": 0, "B": 0, "C": 12}
    assert [(e.zone, e.lacking, e.start) for e in dead.estimated] == [("C", f"H_C/{HEATING_POWER}", case.stamps[48])]


def test_without_any_other_zone_nothing_is_estimated() -> None:
    single = without(heated({"A": 10.0}, {"A": 10.0}), f"H_A/{HEATING_POWER}", 48, 60)
    assert single.estimated == ()
    assert single.zone_heat_estimated()["A"].isna().sum() == 12


def test_an_outage_of_all_meters_is_not_estimated() -> None:
    case = heated({"A": 10.0, "B": 20.0}, {"A": 10.0, "B": 20.0})
    dead = without(without(case, f"H_A/{HEATING_POWER}", 48, 60), f"H_B/{HEATING_POWER}", 48, 60)
    assert dead.zone_heat_estimated().isna().sum().tolist() == [12, 12]


@pytest.mark.parametrize(
    ("point", "value"),
    [(p, v) for p, stuck in ((SUPPLY_FLOW, 0.0321), (DISCHARGE_TEMPERATURE, 300.123)) for v in (np.nan, stuck)],
)
def test_a_dead_or_stuck_meter_costs_its_zone_only(point: str, value: float) -> None:
    whole = load_bundled_case()
    zone = whole.building.zone_names[0]
    column = f"{whole.building.devices_of(zone)[0].name}/{point}"
    case = without(whole, column, end=None if np.isnan(value) else 1500, value=value)
    inputs = replay_inputs(case, build_network(case.building))
    assert select_runs(inputs, default_intervals(case)[1][0], 12).starts.size > 0
    assert [(e.zone, e.lacking) for e in case.estimated] == [(zone, column)]
    assert any(column in remark and "estimate" in remark for remark in case.remarks)
    known = inputs.estimated[:, 0]
    assert known.any()
    assert np.isnan(inputs.zone[known, 0]).all()
    assert np.isfinite(inputs.held[:, 0]).all()
    others = [z for z in case.building.zone_names if z != zone]
    assert case.zone_heat_estimated()[others].equals(whole.zone_heat()[others])


def test_hours_without_flow_do_not_stand_for_what_a_dead_discharge_sensor_hides() -> None:
    whole = load_bundled_case()
    zone = whole.building.zone_names[0]
    column = f"{whole.building.devices_of(zone)[0].name}/{DISCHARGE_TEMPERATURE}"
    off = without(whole, column.replace(DISCHARGE_TEMPERATURE, SUPPLY_FLOW), end=300, value=0.0)
    case = without(off, column)
    heat = case.zone_heat_estimated()
    rows = case.heat_is_estimated()[zone]
    assert (heat[zone].iloc[:300] == 0.0).all()
    assert rows.sum() > 1000
    density = heat / pd.Series({z: area for z, (area, _) in zone_sizes(case.building).items()})
    np.testing.assert_allclose(density.loc[rows, zone], density[rows].drop(columns=zone).mean(axis=1))


def test_parts_add_up() -> None:
    case = load_bundled_case()
    parts = heat_parts(case.building, case.usable, case.zone_temperatures())
    pd.testing.assert_frame_equal(total_heat(case.building, parts), case.zone_heat())
