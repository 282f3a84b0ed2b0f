"""Growth of held-out errors between two models, by hand; and which days are held out."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from calibration.diagnosis.diagnosis import baseline_gap, diagnose
from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.diagnosis.refit.refit import HeldOut, growth, held_out
from calibration.evaluation.intervals import alternating_intervals, default_intervals
from calibration.evaluation.settings import ModelSettings
from mpc.reports.diagnosis_words import alternating_sentence
from thermal import Case, Telemetry
from thermal.pilot.building import pilot_building
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin


def errors(days: list[int], daily: list[float], weight: list[float]) -> HeldOut:
    return HeldOut(np.array(days), np.array(daily), np.array(weight))


def test_growth_and_its_standard_error_from_days_that_both_have() -> None:
    before = errors([1, 2, 3, 9], [0.2, 0.4, 0.3, 5.0], [24.0, 24.0, 24.0, 24.0])
    after = errors([0, 1, 2, 3], [9.0, 0.3, 0.4, 0.5], [24.0, 24.0, 24.0, 24.0])
    grown, error = growth(before, after)
    assert grown == pytest.approx(0.1)
    assert error == pytest.approx(0.1 / np.sqrt(3.0))  # differences 0.1, 0.0, 0.2: deviation 0.1


def test_days_with_few_runs_count_less_and_one_day_has_no_error() -> None:
    before = errors([1, 2], [0.2, 0.2], [30.0, 10.0])
    grown, error = growth(before, errors([1, 2], [0.2, 0.6], [30.0, 10.0]))
    assert grown == pytest.approx(0.1)
    assert error == pytest.approx(np.sqrt(2.0 * ((0.75 * 0.1) ** 2 + (0.25 * 0.3) ** 2)))
    assert growth(before, errors([2], [0.5], [10.0])) == (pytest.approx(0.3), 0.0)


def late_heat() -> Case:
    """A twin of 15 days in which a meter of one zone misses half of the air in the last five."""
    building = pilot_building(3, floor_area=120.0, zones=4, floors=1, name="office")
    quiet = TwinRanges(disturbance_deviation=(0.05, 0.1), noise=(0.005, 0.01))
    case = generate_twin(building, 3, TwinSettings(days=15.0, step_seconds=900.0, dx=1.0, meter="exact", ranges=quiet))[
        0
    ]
    frame = case.telemetry.frame.copy()
    (device,) = building.devices_of(building.zone_names[1])
    flow = frame.columns.get_loc(f"{device.name}/supply_air_flowrate_sensor")
    frame.iloc[len(frame) * 2 // 3 :, flow] *= 0.5
    return Case(building, Telemetry.from_frame(frame))


@pytest.mark.long
def test_days_alternate_where_the_last_third_shows_what_the_others_do_not() -> None:
    case = late_heat()
    found = diagnose(case, dx=1.0)
    answer = found.to_dict()
    assert found.last_third is not None and found.last_third > found.gap
    assert (list(found.tuned), list(found.judged)) == alternating_intervals(case)
    assert (
        answer["intervals"]["mae_of_last_third"]
        == found.last_third
        == pytest.approx(baseline_gap(case, dx=1.0), rel=1e-12)
    )
    assert max(found.where.zones, key=lambda s: s.share).name == case.building.zone_names[1]
    assert "tuning and held-out days alternate" in alternating_sentence(found)


@pytest.mark.long
def test_given_intervals_are_kept_whatever_they_show() -> None:
    case = late_heat()
    tuning, judged = default_intervals(case)
    found = diagnose(case, tuning, judged, dx=1.0)
    assert found.last_third is None
    assert (list(found.tuned), list(found.judged)) == (tuning, judged)
    assert found.to_dict()["intervals"]["mae_of_last_third"] is None


def test_days_do_not_alternate_where_runs_have_no_room_and_lose_what_is_not_measured() -> None:
    case = late_heat()
    long = ModelComparison(case, ModelSettings(dx=1.0), horizon="60h")
    before = long.tuned, long.judged
    inputs = long.build({}).inputs
    assert not long.alternate(inputs)  # no run of 60 hours begins and ends in two days
    assert (long.tuned, long.judged) == before
    _, judged = alternating_intervals(case)
    gap = case.telemetry.frame.copy()
    missing = (gap.index > judged[1].start - pd.Timedelta("6h")) & (gap.index <= judged[1].end)
    gap.loc[missing, [c for c in gap.columns if c.endswith("zone_air_temperature_sensor")]] = np.nan
    models = ModelComparison(Case(case.building, Telemetry.from_frame(gap)), ModelSettings(dx=1.0))
    assert models.alternate(models.build({}).inputs)
    assert models.judged == [judged[0], *judged[2:]]
    assert held_out(models, models.fit({}, [{}])).days.size == len(models.judged)  # each is one day
