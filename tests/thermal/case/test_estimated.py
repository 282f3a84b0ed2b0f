"""What dead or stuck sensors leave unknown: temperatures estimated a day old, what others give, means of a day ago."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from calibration.evaluation.intervals import default_intervals, select_runs
from thermal.case.case import Case
from thermal.case.estimated import estimate_temperatures, like_others, long_gaps
from thermal.case.points import ZONE_TEMPERATURE
from thermal.data import load_bundled_case
from thermal.model.case_replay import replay_inputs
from thermal.network.build import build_network


def with_dead(case: Case, zone: str, value: float) -> Case:
    """The case with a zone's sensors at one value throughout, or NaN."""
    frame = case.telemetry.frame.copy()
    entities = [zone, *(d.name for d in case.building.devices_of(zone))]
    columns = [f"{e}/{ZONE_TEMPERATURE}" for e in entities if f"{e}/{ZONE_TEMPERATURE}" in frame]
    frame[columns] = value
    return Case(case.building, replace(case.telemetry, frame=frame))


@pytest.mark.parametrize("value", [np.nan, 294.0], ids=["dead", "stuck"])
def test_a_dead_or_stuck_sensor_costs_its_zone_only(value: float) -> None:
    whole = load_bundled_case()
    zone = whole.building.zone_names[0]
    case = with_dead(whole, zone, value)
    inputs = replay_inputs(case, build_network(case.building))
    runs = select_runs(inputs, default_intervals(case)[1][0], 12)
    assert runs.starts.size > 0
    assert np.isnan(inputs.zone[:, 0]).all()
    assert [e.zone for e in case.estimated] == [zone]
    assert any("estimate" in remark and zone in remark for remark in case.remarks)
    others = [z for z in case.building.zone_names if z != zone]
    assert case.zone_heat_estimated()[zone].notna().mean() > 0.9
    assert case.zone_heat_estimated()[others].equals(whole.zone_heat()[others])


def test_an_estimate_knows_nothing_of_the_last_day() -> None:
    measured = load_bundled_case().zone_temperatures()
    measured.iloc[:, 0] = np.nan
    step = (measured.index[1] - measured.index[0]).total_seconds()
    day, at = round(86400.0 / step), len(measured) - round(43200.0 / step)
    later = measured.copy()
    later.iloc[at:] += 5.0
    before, after = (estimate_temperatures(m, step)[0].iloc[:, 0] for m in (measured, later))
    end = at + day
    assert before.iloc[:end].equals(after.iloc[:end])
    assert before.notna().all()


def test_short_gaps_stay() -> None:
    measured = load_bundled_case().zone_temperatures().interpolate().bfill()
    measured.iloc[100, 0] = np.nan
    step = (measured.index[1] - measured.index[0]).total_seconds()
    filled, found = estimate_temperatures(measured, step)
    assert (found == ()) == (step <= 1800.0)
    assert filled.iloc[:, 1:].equals(measured.iloc[:, 1:])


def test_an_estimate_follows_the_others_at_the_difference_of_a_day_before() -> None:
    stamps = pd.date_range("2024-01-01", periods=72, freq="h", tz="UTC")
    wave = pd.Series(np.sin(np.arange(72.0)), stamps)
    values = pd.DataFrame({"A": wave + 3.0, "B": wave, "C": wave + 2.0})
    values.loc[stamps[48] :, "A"] = np.nan
    np.testing.assert_allclose(like_others(values, "A", 3600.0).iloc[48:], wave.iloc[48:] + 3.0)
    np.testing.assert_allclose(like_others(values[["A"]], "A", 3600.0).iloc[-1], values["A"].mean())
    values.loc[stamps[60], ["B", "C"]] = np.nan
    assert np.isnan(like_others(values, "A", 3600.0).iloc[60])
    assert long_gaps(values["A"], 3600.0) == [(48, 71)]
