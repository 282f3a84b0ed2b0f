"""Intervals and the runs inside them: where runs start, which are left out, what a horizon is."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from calibration import CalibrationSettings, Interval, calibrate
from calibration.errors import CalibrationError, HorizonError, NotEnoughDataError
from calibration.evaluation.intervals import (
    alternating_intervals,
    default_intervals,
    horizon_steps,
    merge,
    parse_interval,
    select_runs,
)
from calibration.fit.tuning_runs import tuning_runs
from thermal import Case, Inputs, Telemetry, build_network, load_bundled_case, replay_inputs
from thermal.model.case_replay import SPIN_UP


def inputs_of(days: float = 6.0, step: float = 300.0, start: str = "2023-03-01T00:05:00-05:00", **given: Any) -> Inputs:
    """Telemetry of two zones without gaps."""
    n = round(days * 86400.0 / step)
    zone = np.full((n, 2), 293.0)
    plain = Inputs(
        stamps=pd.date_range(start, periods=n, freq=pd.Timedelta(step, unit="s")),
        step=step,
        heat=np.zeros((n, 2)),
        boundary=np.full((n, 1), 280.0),
        airflow=np.zeros((n, 0)),
        zone=zone,
        bridged=zone,
        held=zone,
        complete=np.ones(n, dtype=bool),
    )
    return replace(plain, **given)


def interval(inputs: Inputs, first: int, last: int) -> Interval:
    return Interval(inputs.stamps[first], inputs.stamps[last])


# Horizons


@pytest.mark.parametrize(("minutes", "steps"), [(5, 72), (10, 36), (15, 24), (30, 12), (60, 6)])
def test_six_hours_are_the_paper_s_72_steps_of_five_minutes(minutes: int, steps: int) -> None:
    assert horizon_steps("6h", minutes * 60.0) == steps


@pytest.mark.parametrize(("horizon", "steps"), [("5min", 1), ("1h", 12), ("90min", 18), ("24h", 288), ("1d", 288)])
def test_horizons_of_five_minute_telemetry(horizon: str, steps: int) -> None:
    assert horizon_steps(horizon, 300.0) == steps


@pytest.mark.parametrize("horizon", ["7min", "0h", "-6h", "six hours", "", "nan", "1s"])
def test_horizons_that_are_no_positive_multiple_of_the_step_are_refused(horizon: str) -> None:
    with pytest.raises(HorizonError, match="horizon"):
        horizon_steps(horizon, 300.0)


def test_a_horizon_that_does_not_fit_is_told_in_steps() -> None:
    with pytest.raises(HorizonError, match=r"step of 300 s, got 420 s, 1\.4 steps"):
        horizon_steps("7min", 300.0)


# Runs


def test_runs_start_on_the_hour_and_their_targets_lie_in_the_interval() -> None:
    inputs = inputs_of()
    part = interval(inputs, 1000, 1400)
    runs = select_runs(inputs, part, 72)
    starts = inputs.stamps[runs.starts]
    assert (starts.minute == 0).all()
    assert (np.diff(runs.starts) == 12).all()
    targets = inputs.stamps[runs.starts + 72]
    assert (targets >= part.start).all()
    assert (targets <= part.end).all()
    # and none is missing: the neighbours on either side fall out
    assert inputs.stamps[runs.starts[0] - 12 + 72] < part.start
    assert inputs.stamps[runs.starts[-1] + 12 + 72] > part.end
    assert runs.skipped == 0
    assert runs.begin == 1000 - 864  # three days before the interval


@pytest.mark.parametrize(("step", "every"), [(300.0, 12), (600.0, 6), (1800.0, 2), (3600.0, 1)])
def test_runs_start_every_hour_at_any_step(step: float, every: int) -> None:
    inputs = inputs_of(step=step, start=f"2023-03-01T00:{int(step // 60) % 60:02d}:00-05:00")
    runs = select_runs(
        inputs, interval(inputs, inputs.stamps.size // 2, inputs.stamps.size - 1), horizon_steps("6h", step)
    )
    assert (np.diff(runs.starts) == every).all()
    assert (inputs.stamps[runs.starts].minute == 0).all()


def test_spin_up_is_never_shorter_than_twelve_hours() -> None:
    inputs = inputs_of()
    runs = select_runs(inputs, interval(inputs, 0, inputs.stamps.size - 1), 72)
    assert runs.begin == 0
    assert (runs.starts - runs.begin).min() >= 144
    assert inputs.stamps[runs.starts[0]] - inputs.stamps[0] >= pd.Timedelta("12h")
    assert runs.starts[0] < 144 + 12
    later = select_runs(inputs, interval(inputs, 1000, 1200), 12, spin_up=3600.0)  # less than 12 h was asked for
    assert (later.starts - later.begin).min() >= 144


def test_interval_without_room_for_a_run_is_refused_with_its_times() -> None:
    inputs = inputs_of()
    with pytest.raises(NotEnoughDataError, match="2023-03-01 00:05.*12 h of spin-up"):
        select_runs(inputs, interval(inputs, 0, 150), 72)


def gap(inputs: Inputs, first: int, last: int) -> Inputs:
    """Inputs missing from row first to row last."""
    complete = inputs.complete.copy()
    complete[first : last + 1] = False
    return replace(inputs, complete=complete)


def test_runs_over_missing_inputs_are_skipped_and_counted() -> None:
    """A run is driven by the rows after its start through its target: those and no others must be there."""
    inputs = inputs_of()
    part = interval(inputs, 900, 1700)
    whole = select_runs(inputs, part, 72).starts
    runs = select_runs(gap(inputs, 1200, 1202), part, 72)
    missed = (whole + 1 <= 1202) & (whole + 72 >= 1200)
    np.testing.assert_array_equal(runs.starts, whole[~missed])
    assert runs.skipped == missed.sum() > 0
    start = int(whole[len(whole) // 2])
    assert start in select_runs(gap(inputs, start, start), part, 72).starts  # its own row is not an input of the run
    assert start not in select_runs(gap(inputs, start + 1, start + 1), part, 72).starts
    assert start not in select_runs(gap(inputs, start + 72, start + 72), part, 72).starts
    assert start in select_runs(gap(inputs, start + 73, start + 73), part, 72).starts


def test_runs_need_one_zone_seen_at_start_and_target() -> None:
    inputs = inputs_of()
    part = interval(inputs, 900, 1700)
    whole = select_runs(inputs, part, 72).starts
    start = int(whole[10])
    for row, field in ((start + 72, "zone"), (start, "bridged")):
        missing = getattr(inputs, field).copy()
        missing[row] = np.nan
        runs = select_runs(replace(inputs, **{field: missing}), part, 72)
        assert start not in runs.starts
        assert runs.skipped == 1
        missing[row, 0] = 293.0
        assert start in select_runs(replace(inputs, **{field: missing}), part, 72).starts
    # zone 1 seen at the start only, zone 2 at the target only: no error could be told
    bridged, zone = inputs.bridged.copy(), inputs.zone.copy()
    bridged[start, 1], zone[start + 72, 0] = np.nan, np.nan
    assert start not in select_runs(replace(inputs, bridged=bridged, zone=zone), part, 72).starts


@cache
def bundled() -> Case:
    return load_bundled_case()


@pytest.mark.parametrize(("rows", "skipped"), [(4, False), (6, False), (7, True)])
def test_gap_of_20_minutes_is_bridged_and_one_over_30_skips_its_runs(rows: int, skipped: bool) -> None:
    """From telemetry with holes to runs: 4 rows of 5 minutes, 6, and 7."""
    frame = bundled().telemetry.frame.copy()
    frame.iloc[1500 : 1500 + rows, frame.columns.get_loc("weather_station/outside_air_temperature_sensor")] = np.nan
    case = Case(bundled().building, Telemetry.from_frame(frame))
    inputs = replay_inputs(case, build_network(case.building, dx=1.5))
    part = interval(inputs, 1200, 2000)
    whole = select_runs(inputs_of(10.0), interval(inputs, 1200, 2000), 72)
    runs = select_runs(inputs, part, 72)
    assert runs.starts.size + runs.skipped == whole.starts.size
    assert runs.skipped == (6 if skipped else 0)  # six hourly starts have a row of the gap among their 72


# Intervals of a case


def test_default_split_tunes_on_two_thirds_and_holds_out_one() -> None:
    (tuning,), (held_out,) = default_intervals(bundled())
    stamps = bundled().stamps
    assert (tuning.start, tuning.end) == (stamps[0], stamps[1919])
    assert (held_out.start, held_out.end) == (stamps[1920], stamps[2879])


def test_what_one_kind_of_interval_leaves_serves_the_other() -> None:
    stamps = bundled().stamps
    early, late = Interval(stamps[0], stamps[999]), Interval(stamps[2000], stamps[-1])
    assert default_intervals(bundled(), [early])[1] == [Interval(stamps[1000], stamps[-1])]
    assert default_intervals(bundled(), [late])[1] == [Interval(stamps[0], stamps[1999])]
    assert default_intervals(bundled(), (), [late])[0] == [Interval(stamps[0], stamps[1999])]
    with pytest.raises(CalibrationError, match="leaves no telemetry"):
        default_intervals(bundled(), [Interval(stamps[0], stamps[-1])])
    with pytest.raises(CalibrationError, match="overlap"):
        default_intervals(bundled(), [early, early])


@pytest.mark.parametrize(("first", "last"), [(0, 2880), (100, 2700), (0, 2650), (0, 2600)])
def test_intervals_take_turns_and_share_out_all_telemetry(first: int, last: int) -> None:
    case = bundled()
    case = Case(case.building, Telemetry.from_frame(case.telemetry.frame.iloc[first:last]))
    tuning, held_out = alternating_intervals(case)
    ordered = sorted([*tuning, *held_out], key=lambda i: i.start)
    assert merge(ordered) == ordered
    whose = np.zeros(len(case.stamps), dtype=int)
    for number, part in enumerate((tuning, held_out), 1):
        for i in part:
            whose[(case.stamps >= i.start) & (case.stamps <= i.end)] += number
    assert set(whose) == {1, 2}  # every stamp in one of them
    assert 0.59 < np.mean(whose == 1) < 0.72
    assert ordered[0] in tuning
    lengths = {round((i.end - i.start) / pd.Timedelta("1D"), 1) for i in held_out[:-1]}
    assert lengths == {1.0}
    assert all(i.end.time() == pd.Timestamp("00:00").time() for i in tuning[:-1])


def test_telemetry_too_short_for_turns_is_told() -> None:
    case = bundled()
    short = Case(case.building, Telemetry.from_frame(case.telemetry.frame.iloc[: 8 * 288]))
    with pytest.raises(NotEnoughDataError, match="expected 9 days of telemetry or more, found 8.0"):
        alternating_intervals(short)


def test_runs_that_take_turns_keep_to_their_days() -> None:
    case = bundled()
    inputs = replay_inputs(case, build_network(case.building, dx=1.5))
    tuning, held_out = alternating_intervals(case)
    apart = tuning_runs(inputs, tuning, 72, SPIN_UP)
    assert all(r.starts.size == 8 for r in apart[1:-1])  # two days of six hours, from midnight on
    judged = [select_runs(inputs, i, 72) for i in held_out]
    for part, runs in ((tuning, apart), (held_out, judged)):
        targets = [inputs.stamps[r.starts + 72] for r in runs]
        assert all(i.start <= t[0] and t[-1] <= i.end for i, t in zip(part, targets, strict=True))


def test_days_take_turns_from_midnight_to_midnight_where_clocks_change() -> None:
    stamps = pd.date_range("2023-03-09T00:05", periods=12 * 288, freq="5min", tz="America/New_York")
    case: Any = SimpleNamespace(stamps=stamps)  # all that intervals of a case need
    tuning, held_out = alternating_intervals(case)
    assert {i.end.strftime("%H:%M") for i in tuning[:-1]} == {"00:00"}
    assert {i.start.strftime("%H:%M") for i in held_out} == {"00:05"}
    assert {i.start.day for i in held_out} == {11, 14, 17, 20}
    assert tuning[1].end - tuning[1].start == pd.Timedelta("47h")  # clocks are put forward on the 12th


def test_interval_as_text() -> None:
    part = parse_interval("2023-03-02/2023-03-04T12:00", bundled())
    assert part.start.isoformat() == "2023-03-02T00:00:00-05:00"  # local to the building
    assert part.end.isoformat() == "2023-03-04T12:00:00-05:00"
    assert parse_interval(" 2023-03-02T05:00Z / 2023-03-04T17:00Z ", bundled()) == part
    assert part.to_dict() == {"start": "2023-03-02T00:00:00-05:00", "end": "2023-03-04T12:00:00-05:00"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("2023-03-02", "START/END"),
        ("2023-03-02/2023-03-03/2023-03-04", "START/END"),
        ("2023-03-04/2023-03-02", "before"),
        ("2023-03-04/2023-03-04", "before"),
        ("yesterday/today", "yesterday"),
        ("2023-03-02/", "ISO 8601"),
        ("2022-03-02/2022-03-04", "goes from 2023-03-01"),
        ("2024-03-02/2024-03-04", "outside of the telemetry"),
    ],
)
def test_texts_that_are_no_interval_are_refused(text: str, message: str) -> None:
    with pytest.raises(CalibrationError, match=message):
        parse_interval(text, bundled())


def test_overlapping_tuning_and_held_out_intervals_are_refused() -> None:
    case = bundled()
    tune = [parse_interval("2023-03-01/2023-03-06", case), parse_interval("2023-03-08/2023-03-09", case)]
    for text in (
        "2023-03-05/2023-03-07",
        "2023-03-06/2023-03-07",
        "2023-03-08T12:00/2023-03-08T18:00",
        "2023-03-01/2023-03-11",
    ):
        with pytest.raises(CalibrationError, match="overlap"):
            calibrate(case, tune, [parse_interval(text, case)], settings=CalibrationSettings(dx=1.5))
