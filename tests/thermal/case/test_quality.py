"""Quality of telemetry: what is flagged, and above all what is not."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from thermal.case.case import Case
from thermal.case.load import load_case
from thermal.case.points import POINT_TYPES
from thermal.case.quality import assess, usable
from thermal.case.signal_faults import flat_lines, impossible_values, runs, spikes
from thermal.case.telemetry import Telemetry

DAY = 288  # samples at 5 minutes
Series = np.ndarray
ROOM = "VAV_F1_C/zone_air_temperature_sensor"


def outdoors(days: float = 7.0, step: float = 300.0) -> Series:
    hours = np.arange(int(days * 86400 / step)) * step / 3600.0
    return 280.0 + 5.0 * np.sin(2 * np.pi * hours / 24.0)


def room(days: float = 7.0, step: float = 300.0, resolution: float = 0.02, seed: int = 0) -> Series:
    """A room that follows the day a little, read by a sensor with noise and steps."""
    hours = np.arange(int(days * 86400 / step)) * step / 3600.0
    noise = 0.03 * np.random.default_rng(seed).standard_normal(hours.size)
    exact = 294.0 + 1.0 * np.sin(2 * np.pi * (hours - 3.0) / 24.0) + noise
    return np.round(exact / resolution) * resolution


@pytest.fixture
def practice(shared_cases: Path) -> Case:
    return load_case(shared_cases / "practice_none_prbs")


def spoilt(case: Case, change: Callable[[pd.DataFrame], None]) -> Case:
    frame = case.telemetry.frame.copy()
    change(frame)
    return Case(case.building, Telemetry.from_frame(frame))


def found(case: Case) -> list[tuple[str, str, int]]:
    return [(column, finding.kind, finding.steps) for column, finding in case.quality]


# What is not flagged


def test_nothing_is_flagged_in_the_shared_cases(shared_cases: Path) -> None:
    for folder in sorted(path.parent for path in shared_cases.glob("*/building.yaml")):
        quality = load_case(folder).quality
        assert {kind: quality.count(kind) for kind in ("impossible", "flat", "spike", "constant")} == dict.fromkeys(
            ("impossible", "flat", "spike", "constant"), 0
        ), folder.name
        gaps = [finding.steps for _, finding in quality if finding.kind == "gap"]
        # O5: the monitoring was out twice on 3 September, for 22 and for 2 steps, in 20 columns
        assert gaps == ([22, 2] * 20 if folder.name == "twinhouse_O5_exp1" else []), folder.name


@pytest.mark.parametrize("resolution", [0.1, 0.5, 1.0])
def test_nothing_is_flagged_where_sensors_are_coarse(practice: Case, resolution: float) -> None:
    def coarsen(frame: pd.DataFrame) -> None:
        for column in frame:
            if "temperature" in str(column):
                frame[column] = np.round((frame[column] - 273.15) / resolution) * resolution + 273.15

    assert found(spoilt(practice, coarsen)) == []


@pytest.mark.parametrize("step", ["15min", "30min", "60min"])
def test_nothing_is_flagged_in_coarser_means(practice: Case, step: str) -> None:
    frame = practice.telemetry.frame.resample(step, label="right", closed="right").mean().iloc[1:-1]
    frame.index.name = "timestamp"
    assert list(assess(Telemetry.from_frame(frame), practice.building)) == []


def test_signals_that_may_stand_still_or_jump_do(practice: Case) -> None:
    def change(frame: pd.DataFrame) -> None:
        frame["VAV_F1_C/supply_air_flowrate_sensor"] = 0.0
        frame["VAV_F1_C/discharge_air_temperature_sensor"] = frame["VAV_F1_C/discharge_air_temperature_sensor"].clip(
            288.15, 300.0
        )
        frame["weather_station/direct_normal_irradiance_sensor"] = 0.0
        frame["weather_station/wind_speed_sensor"] = 0.0
        frame.iloc[700, frame.columns.get_loc("VAV_F1_N1/supply_air_flowrate_sensor")] = 3.0
        frame.iloc[700, frame.columns.get_loc("VAV_F1_N1/discharge_air_temperature_sensor")] = 350.0

    assert found(spoilt(practice, change)) == []


def test_a_steady_state_is_not_flagged(table_draft: Any) -> None:
    """All constant, the outdoors too: a made-up case rather than dead sensors."""
    for column in table_draft.frame:
        table_draft.frame[column] = 10.0
    table_draft.frame = pd.concat([table_draft.frame] * 12)
    index = pd.date_range("2023-03-01", periods=576, freq="5min", tz="Etc/GMT-1", name="timestamp")
    case = load_case(_with(table_draft, table_draft.frame.set_index(index)).write())
    assert {kind for _, kind, _ in found(case)} == {"constant"}
    assert case.usable.notna().all().all()


def test_a_constant_boundary_may_be_an_assumption(table_draft: Any) -> None:
    index = pd.date_range("2023-03-01", periods=2016, freq="5min", tz="Etc/GMT-1", name="timestamp")
    columns = list(table_draft.frame.columns)
    frame = pd.DataFrame(np.full((2016, len(columns)), 10.0), index=index, columns=columns)
    frame["station/outside_air_temperature_sensor"] = outdoors() - 273.15
    frame["room/zone_air_temperature_sensor"] = room() - 273.15
    frame["hall/zone_air_temperature_sensor"] = room(seed=1) - 273.15
    case = load_case(_with(table_draft, frame).write())
    assert found(case) == [("attic/zone_air_temperature_sensor", "constant", 2016)]
    assert case.boundary_temperatures()["attic"].notna().all()


def _with(draft: Any, frame: pd.DataFrame) -> Any:
    draft.frame = frame
    return draft


# Flat lines


@pytest.mark.parametrize("hours", [6, 8, 12, 24, 72])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_stuck_room_sensor_is_flagged(practice: Case, hours: int, seed: int) -> None:
    first = int(np.random.default_rng(seed).integers(100, 5000))
    last = first + hours * 12 - 1

    def stick(frame: pd.DataFrame) -> None:
        frame.iloc[first : last + 1, frame.columns.get_loc(ROOM)] = frame[ROOM].iloc[first]

    case = spoilt(practice, stick)
    (finding,) = [finding for column, finding in case.quality if column == ROOM]
    assert finding.kind == "flat" and f"the same value for {hours}." in finding.detail
    # by chance a sample beside it may have the same value
    assert abs(case.stamps.get_loc(finding.start) - first) <= 2
    assert abs(case.stamps.get_loc(finding.end) - last) <= 2
    assert case.zone_temperatures()["F1_C"].iloc[first : last + 1].isna().all()
    assert case.zone_temperatures()["F1_C"].notna().sum() >= 6048 - hours * 12 - 4
    assert [column for column, *_ in found(case)] == [ROOM]


def test_heat_of_air_is_unknown_while_the_room_sensor_is_stuck(practice: Case) -> None:
    def stick(frame: pd.DataFrame) -> None:
        frame.iloc[1000:1200, frame.columns.get_loc(ROOM)] = 294.0

    case = spoilt(practice, stick)
    flow = case.telemetry.frame["VAV_F1_C/supply_air_flowrate_sensor"].iloc[1000:1200]
    heat = case.zone_heat()["F1_C"].iloc[1000:1200]
    assert heat[flow != 0.0].isna().all() and (heat[flow == 0.0] == 0.0).all()


def test_a_dead_sensor_is_flagged_from_end_to_end(practice: Case) -> None:
    def die(frame: pd.DataFrame) -> None:
        frame[ROOM] = 294.15

    case = spoilt(practice, die)
    assert found(case) == [(ROOM, "flat", 6048)]
    assert case.zone_temperatures()["F1_C"].isna().all()


def test_a_stuck_outdoor_sensor_is_flagged(practice: Case) -> None:
    column = "weather_station/outside_air_temperature_sensor"

    def stick(frame: pd.DataFrame) -> None:
        frame.iloc[1000:1400, frame.columns.get_loc(column)] = frame[column].iloc[1000]

    case = spoilt(practice, stick)
    assert [(name, kind) for name, kind, _ in found(case)] == [(column, "flat")]
    assert case.boundary_temperatures()["outdoor"].isna().sum() >= 400


def test_a_logger_that_holds_everything_is_flagged_everywhere(practice: Case) -> None:
    def hold(frame: pd.DataFrame) -> None:
        frame.iloc[1000:1400] = frame.iloc[1000].to_numpy()

    flagged = {column for column, kind, _ in found(spoilt(practice, hold)) if kind == "flat"}
    assert len(flagged) == 13


def test_five_hours_are_not_enough() -> None:
    values = room()
    values[500:560] = values[500]
    assert flat_lines(values, outdoors(), 300.0) == []


def test_a_gap_does_not_hide_a_flat_line() -> None:
    values = room()
    values[500:620] = values[500]
    values[550:560] = np.nan
    assert [(first, last) for first, last, _ in flat_lines(values, outdoors(), 300.0)] == [(500, 549), (560, 619)]


def test_hourly_telemetry_needs_three_days() -> None:
    for hours, flagged in ((24, False), (48, False), (80, True)):
        values = room(days=30.0, step=3600.0)
        values[100 : 100 + hours] = values[100] + 1.0
        assert bool(flat_lines(values, outdoors(30.0, 3600.0), 3600.0)) == flagged


def test_a_coarse_sensor_must_jump() -> None:
    """A room held for days inside one step of its sensor is sound; one that then jumps by steps is not."""
    quiet = np.full(14 * DAY, 294.0)
    quiet[10 * DAY :] += np.repeat(np.arange(4 * DAY) // 144 % 2, 1) * 0.5
    assert flat_lines(quiet[8 * DAY :], outdoors(14.0)[8 * DAY :], 300.0) == []
    stuck = np.concatenate((np.full(5 * DAY, 294.0), 296.0 + 0.5 * (np.arange(4 * DAY) // 30 % 2)))
    assert [(first, last) for first, last, _ in flat_lines(stuck, outdoors(9.0), 300.0)] == [(0, 5 * DAY - 1)]


def test_a_standstill_says_nothing_while_the_outdoors_stands_still_too() -> None:
    values, still = room(), outdoors()
    values[500:620] = values[500]
    still[490:630] = still[490]
    assert flat_lines(values, still, 300.0) == []
    assert flat_lines(values, outdoors(), 300.0) != []


@pytest.mark.parametrize("values", [[], [np.nan], [294.0], [np.nan] * 500, [294.0] * 10])
def test_short_and_empty_signals_have_no_flat_lines_and_no_spikes(values: list[float]) -> None:
    series = np.array(values, dtype=float)
    assert flat_lines(series, None, 300.0) == []
    assert flat_lines(series, np.full(series.size, 280.0), 300.0) == []
    assert spikes(series, 300.0) == []


# Spikes


@pytest.mark.parametrize("size", [2.5, -2.5, 20.0])
@pytest.mark.parametrize("width", [1, 2, 3])
def test_a_jump_there_and_back_is_a_spike(size: float, width: int) -> None:
    values = room()
    values[700 : 700 + width] += size
    ((first, last, detail),) = spikes(values, 300.0)
    assert (first, last) == (700, 699 + width)
    assert detail.endswith("K and back") and detail.startswith("+" if size > 0 else "-")


@pytest.mark.parametrize(
    "change",
    [
        lambda values: values[700:701].__iadd__(1.0),  # too small
        lambda values: values[700:704].__iadd__(5.0),  # too long
        lambda values: values[700:].__iadd__(5.0),  # does not come back
        lambda values: values[:1].__iadd__(5.0),  # nothing before
        lambda values: values[-1:].__iadd__(5.0),  # nothing after
    ],
)
def test_what_is_no_spike(change: Callable[[Series], Series]) -> None:
    values = room()
    change(values)
    assert spikes(values, 300.0) == []


def test_a_spike_beside_a_gap_is_not_judged() -> None:
    values = room()
    values[700] += 10.0
    values[701] = np.nan
    assert spikes(values, 300.0) == []


def test_more_is_possible_in_an_hour_than_in_five_minutes() -> None:
    values = room(step=3600.0)
    values[60] += 4.0
    assert spikes(values, 3600.0) == []
    values[60] += 4.0
    assert [(first, last) for first, last, _ in spikes(values, 3600.0)] == [(60, 60)]


def test_a_restless_signal_needs_larger_spikes() -> None:
    calm = room()
    restless = calm + 0.5 * np.random.default_rng(1).standard_normal(calm.size)
    for values, flagged in ((calm, True), (restless, False)):
        values[700] += 3.0
        assert bool(spikes(values, 300.0)) == flagged


def test_spikes_are_left_out_of_the_signals(practice: Case) -> None:
    def poke(frame: pd.DataFrame) -> None:
        frame.iloc[[700, 2000], frame.columns.get_loc(ROOM)] += 6.0

    case = spoilt(practice, poke)
    assert found(case) == [(ROOM, "spike", 1), (ROOM, "spike", 1)]
    assert np.flatnonzero(case.zone_temperatures()["F1_C"].isna()).tolist() == [700, 2000]


# Impossible values


@pytest.mark.parametrize(
    ("point", "values", "bad"),
    [
        ("zone_air_temperature_sensor", [293.0, 0.0, 999.0, 233.15, np.inf, np.nan], [1, 2, 3, 4]),
        ("supply_air_flowrate_sensor", [0.0, -0.005, -1.0, 500.0], [2, 3]),
        ("supply_air_damper_percentage_command", [0.0, 1.0, 2.55], [2]),
        ("direct_normal_irradiance_sensor", [0.0, -5.0, 1100.0, 4000.0, -999.0], [3, 4]),
        ("wind_direction_sensor", [0.0, 360.0, 999.0], [2]),
        ("zone_air_co2_concentration_sensor", [420e-6, 0.0, 1.0], [1, 2]),
        ("occupancy_count_sensor", [0.0, 30.0, -1.0], [2]),
    ],
)
def test_impossible_values(point: str, values: list[float], bad: list[int]) -> None:
    stretches = impossible_values(np.array(values), POINT_TYPES[point])
    assert [i for first, last, _ in stretches for i in range(first, last + 1)] == bad


def test_every_point_allows_what_the_format_is_about() -> None:
    for point in POINT_TYPES.values():
        assert point.lowest < point.highest
        assert point.meaning


def test_impossible_values_are_left_out(plan_draft: Any) -> None:
    column = "B/zone_air_temperature_sensor"
    plan_draft.frame.iloc[5:8, plan_draft.frame.columns.get_loc(column)] = [-40.0, 850.0, np.inf]
    plan_draft.frame.iloc[20, plan_draft.frame.columns.get_loc(column)] = np.nan
    case = load_case(plan_draft.write())
    quality = {entry.column: entry for entry in case.quality.columns}[column]
    assert [(finding.kind, finding.steps) for finding in quality.findings] == [("impossible", 3), ("gap", 1)]
    assert quality.missing_share == pytest.approx(1 / 48)
    assert quality.unusable_share == pytest.approx(4 / 48)
    assert np.flatnonzero(case.zone_temperatures()["B"].isna()).tolist() == [5, 6, 7, 20]
    assert case.telemetry.frame[column].isna().sum() == 1


# The report


def test_gaps_have_start_end_and_length(plan_draft: Any) -> None:
    plan_draft.frame.iloc[4:9, 0] = np.nan
    plan_draft.frame.iloc[-1, 0] = np.nan
    entry = load_case(plan_draft.write()).quality.columns[0]
    assert [(finding.kind, finding.start.minute, finding.end.minute, finding.steps) for finding in entry.findings] == [
        ("gap", 25, 45, 5),
        ("gap", 0, 0, 1),
    ]


def test_report_is_plain_json(plan_draft: Any) -> None:
    plan_draft.frame.iloc[4:9, 0] = np.nan
    plan_draft.frame = plan_draft.frame.drop(plan_draft.frame.index[20])
    report = load_case(plan_draft.write()).quality.to_dict()
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert report["stamps"] == 48 and report["step_seconds"] == 300.0
    assert report["missing_rows"][0]["start"] == "2023-03-01T01:45:00-06:00"


def test_what_was_flagged_stays_flagged_in_a_slice(practice: Case) -> None:
    def change(frame: pd.DataFrame) -> None:
        frame.iloc[1000:1200, frame.columns.get_loc(ROOM)] = frame[ROOM].iloc[1000]
        frame.iloc[1050, frame.columns.get_loc("VAV_F1_N1/zone_air_temperature_sensor")] = 999.0
        frame.iloc[1060:1063, frame.columns.get_loc("VAV_F1_N2/zone_air_temperature_sensor")] = np.nan

    case = spoilt(practice, change)
    part = case.slice(case.stamps[1040], case.stamps[1063])  # two hours: too short to judge by itself
    assert part.zone_temperatures()["F1_C"].isna().all()
    pd.testing.assert_frame_equal(part.zone_heat(), case.zone_heat().loc[part.stamps], check_freq=False)
    assert found(part) == [
        ("VAV_F1_C/zone_air_temperature_sensor", "flat", 24),
        ("VAV_F1_N1/zone_air_temperature_sensor", "impossible", 1),
        ("VAV_F1_N2/zone_air_temperature_sensor", "gap", 3),
    ]
    shares = {entry.column: entry.unusable_share for entry in part.quality.columns}
    assert shares[ROOM] == 1.0
    for entry in part.quality.columns:
        assert entry.unusable_share == pytest.approx(float(part.usable[entry.column].isna().mean()))
        assert entry.missing_share == pytest.approx(float(part.telemetry.frame[entry.column].isna().mean()))


def test_usable_masks_only_what_is_flagged(practice: Case) -> None:
    def stick(frame: pd.DataFrame) -> None:
        frame.iloc[1000:1100, frame.columns.get_loc(ROOM)] = 294.0

    case = spoilt(practice, stick)
    masked = usable(case.telemetry.frame, case.quality)
    assert int(masked.isna().sum().sum()) == 100
    pd.testing.assert_frame_equal(masked.drop(columns=ROOM), case.telemetry.frame.drop(columns=ROOM))


def test_runs() -> None:
    assert runs(np.array([], dtype=bool)) == []
    assert runs(np.array([False, True, True, False, True])) == [(1, 2), (4, 4)]
    assert runs(np.array([True, True])) == [(0, 1)]
