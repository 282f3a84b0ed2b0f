"""A twin whose heat meter begins to read wrong: found on its day and named; its page; bad input."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration.diagnosis.refit.comparison import ModelComparison
from calibration.errors import CalibrationError, HorizonError, NotEnoughDataError
from calibration.evaluation.intervals import Interval
from calibration.evaluation.settings import ModelSettings
from calibration.monitoring.days import days_of_case
from calibration.monitoring.monitor import Monitoring, MonitorSettings, _moved, _of_seasons, monitor
from mpc.reports.monitoring import monitoring_verdict, write_monitoring
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.data import load_bundled_case
from thermal.errors import EffectError
from thermal.inputs.normalisation import fit_normalisation
from thermal.inputs.windows import across, on_one_side, steady
from thermal.pilot.twin import TwinRanges, TwinSettings, generate_twin

DAYS, REFERENCE, CHANGED = 42, 21, 31
SETTINGS = MonitorSettings(reference_days=REFERENCE, dx=2.0, known=())


@pytest.fixture(scope="module")
def quiet() -> Case:
    ranges = TwinRanges((0.5, 0.5), (7200.0, 7200.0), (0.02, 0.02))
    settings = TwinSettings(days=float(DAYS), spin_up_days=3.0, step_seconds=3600.0, dx=2.0, ranges=ranges)
    return generate_twin(load_bundled_case().building, 1, settings)[0]


@pytest.fixture(scope="module")
def spoilt(quiet: Case) -> tuple[Case, str]:
    zone = quiet.building.zone_names[0]
    frame = quiet.telemetry.frame.copy()
    # from the change on 1.3 times the heat enters that the meter says
    rows = frame.index >= frame.index[0].normalize() + pd.DateOffset(days=CHANGED)
    frame.loc[rows, f"VAV_{zone}/supply_air_flowrate_sensor"] /= 1.3
    return Case(quiet.building, replace(quiet.telemetry, frame=frame)), zone


@pytest.fixture(scope="module")
def found(spoilt: tuple[Case, str]) -> Monitoring:
    return monitor(spoilt[0], settings=SETTINGS)


def test_the_change_is_found_on_its_day_and_named(found: Monitoring, spoilt: tuple[Case, str]) -> None:
    event = found.events[0]
    assert (event.effect, event.zones) == ("flow_gain", (spoilt[1],))
    assert abs(event.since - CHANGED) <= 1
    assert event.alarm - CHANGED <= 5
    assert event.size == pytest.approx(0.3, abs=0.06)


def test_a_quiet_twin_is_quiet(quiet: Case) -> None:
    result = monitor(quiet, settings=SETTINGS)
    assert result.events == ()
    assert monitoring_verdict(result) == f"Nothing has changed in {len(result.days) - REFERENCE} days that were watched."


def test_an_alarm_that_waits_is_told(found: Monitoring, tmp_path: Path) -> None:
    waiting = replace(found, events=(), course=replace(found.course, events=(), waiting=CHANGED + 1))
    date = f"{found.date(CHANGED + 1):%Y-%m-%d}"
    assert monitoring_verdict(waiting).endswith(f"An alarm of {date} waits for more days.")
    page = write_monitoring(waiting, tmp_path / "out")
    assert f"An alarm of {date} is not decided yet." in page.read_text(encoding="utf-8")
    assert json.loads((page.parent / "monitoring.json").read_text(encoding="utf-8"))["waiting"].startswith(date)


def test_files(found: Monitoring, tmp_path: Path) -> None:
    page = write_monitoring(found, tmp_path / "out")
    content = json.loads((page.parent / "monitoring.json").read_text(encoding="utf-8"))
    assert content["events"][0]["effect"] == "flow_gain"
    assert content["events"][0]["since"].startswith(f"{found.date(found.events[0].since):%Y-%m-%d}")
    weekly = pd.read_parquet(page.parent / "weekly.parquet")
    assert set(found.days.zones) <= set(weekly)
    assert weekly["mae_carried"].iloc[REFERENCE // 7 :].notna().all()
    assert "flow_gain" in page.read_text(encoding="utf-8") or "heat meter" in page.read_text(encoding="utf-8")


def silenced(case: Case, zones: Sequence[str], begin: int) -> Case:
    """Take the sensors of zones away from a day on."""
    frame = case.telemetry.frame.copy()
    rows = frame.index >= frame.index[0].normalize() + pd.DateOffset(days=begin)
    frame.loc[rows, [f"VAV_{zone}/zone_air_temperature_sensor" for zone in zones]] = np.nan
    return Case(case.building, replace(case.telemetry, frame=frame))


def test_a_dead_sensor_is_named(quiet: Case, tmp_path: Path) -> None:
    zone = quiet.building.zone_names[0]
    result = monitor(silenced(quiet, [zone], 0), settings=SETTINGS)
    assert list(result.silent_zones) == [zone]
    assert monitoring_verdict(result).endswith(f"Too little was measured in zone {zone} on the reference days.")
    page = write_monitoring(result, tmp_path / "out")
    assert f"{zone}: too few measured temperatures on the reference days" in page.read_text(encoding="utf-8")


def test_days_without_a_run_are_told(quiet: Case) -> None:
    result = monitor(silenced(quiet, quiet.building.zone_names, DAYS - 5), settings=SETTINGS)
    watched = result.to_dict()["watched"]
    assert watched["days"] + watched["days_without_a_run"] == len(result.days) - REFERENCE
    assert watched["days_without_a_run"] >= 5
    missed = watched["days_without_a_run"]
    expected = f"Nothing has changed in {watched['days']} days that were watched. {missed} days more had no usable run."
    assert monitoring_verdict(result) == expected


def test_open_windows_lose_air_of_the_season(quiet: Case) -> None:
    """A zone that is 5 K warmer later loses as much more through a window; a run says nothing of itself but its begin."""
    frame, names = quiet.telemetry.frame.copy(), list(quiet.building.zone_names)
    late = frame.index >= frame.index[0].normalize() + pd.DateOffset(days=CHANGED)
    columns = [f"VAV_{zone}/zone_air_temperature_sensor" for zone in names]
    frame.loc[late, columns] += 5.0
    warmer = Case(quiet.building, replace(quiet.telemetry, frame=frame))
    reference = fit_normalisation(quiet, [(quiet.stamps[0], quiet.stamps[0] + pd.Timedelta(days=REFERENCE))])
    cold = [_of_seasons(case, reference, "6h")[0].through_windows for case in (quiet, warmer)]
    day = np.asarray((quiet.stamps - quiet.stamps[0].normalize()).days)
    assert cold[1][day < CHANGED] == pytest.approx(cold[0][day < CHANGED])
    same = (day == CHANGED) & (np.asarray(quiet.stamps.hour) == 0)
    assert cold[1][same] == pytest.approx(cold[0][same])  # it ends the run before
    later = (day > CHANGED) | (day == CHANGED) & ~same
    assert (cold[1][later] < cold[0][later] - 5.0 * 0.05).all()  # 0.05 m/s in still air at 0 K


def test_terminals_show_what_they_can_give_as_seasons_come(quiet: Case) -> None:
    """Twice the flow from a day on counts as the largest heat from the next day on, and never before."""
    zone, frame = quiet.building.zone_names[0], quiet.telemetry.frame.copy()
    late = frame.index >= frame.index[0].normalize() + pd.DateOffset(days=CHANGED)
    frame.loc[late, f"VAV_{zone}/supply_air_flowrate_sensor"] *= 2.0
    stronger = Case(quiet.building, replace(quiet.telemetry, frame=frame))
    reference = fit_normalisation(quiet, [(quiet.stamps[0], quiet.stamps[0] + pd.Timedelta(days=REFERENCE))])
    before, after = (_of_seasons(case, reference, "6h")[0].largest_heat[:, 0] for case in (quiet, stronger))
    day = np.asarray((quiet.stamps - quiet.stamps[0].normalize()).days)
    assert (before >= reference.heat[zone]).all() and (np.diff(before) >= 0.0).all()
    assert after[day <= CHANGED] == pytest.approx(before[day <= CHANGED])
    assert (after[day > CHANGED + 4] > 1.5 * before[day > CHANGED + 4]).all()


def test_a_clock_counts_in_hours_whatever_it_was_moved_by() -> None:
    case = load_bundled_case()
    models = ModelComparison(case, ModelSettings(dx=2.0), [Interval(case.stamps[0], case.stamps[len(case.stamps) // 2])])
    (models.drivers,) = _of_seasons(case, fit_normalisation(case), "6h")
    by_hours = [_errors_and_clock(models, {}, {}, {h: _moved(models, h) for h in (-hours, hours)})[1]
                for hours in (0.5, 1.5)]  # fmt: skip
    known = np.isfinite(by_hours[0]) & np.isfinite(by_hours[1])
    first, second = by_hours[0][known], by_hours[1][known]
    assert first @ second / (second @ second) == pytest.approx(1.0, abs=0.05)


def test_a_wrong_clock_shows_as_its_column_says() -> None:
    """Weather that is said an hour late moves the sun too, which the tangent of the outdoor temperature lacks."""
    case = load_bundled_case()
    models = ModelComparison(case, ModelSettings(dx=2.0), [Interval(case.stamps[0], case.stamps[len(case.stamps) // 2])])
    (models.drivers,) = _of_seasons(case, fit_normalisation(case), "6h")
    effects, values = {"solar_gain": ()}, {"solar_heat_gain_coefficient": 0.5}
    moved = {hours: _moved(models, hours) for hours in (-1.0, 1.0)}
    late, moves = (_errors_and_clock(m, effects, values, moved) for m in (moved[1.0], models))
    seen = late[0] - moves[0]
    _, tangent = _errors_and_clock(models, effects, values, {})
    left = [np.sqrt(np.nanmean((seen - s) ** 2) / np.nanmean(seen**2)) for s in (moves[1], tangent)]
    assert left[0] < 0.3 < 0.8 < left[1]


def _errors_and_clock(
    models: ModelComparison, effects: dict[str, tuple[str, ...]], values: dict[str, float],
    moved: dict[float, ModelComparison],
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    days = days_of_case(models, effects, values, ["clock_shift"], moved)
    number = [c.name for c in days.columns].index("weather_clock_shift")
    return days.errors, days.slopes[..., number]


@pytest.mark.parametrize("horizon", ["6h", "12h"])
def test_a_run_knows_where_it_begins_and_no_more(quiet: Case, horizon: str) -> None:
    """Stamps end their step: the row at which a run begins is the first it may know of, and the last of the one before."""
    name = f"VAV_{quiet.building.zone_names[0]}/zone_air_temperature_sensor"
    reference, hours = fit_normalisation(quiet), int(horizon[:-1])
    changed = []
    for hour in (0, 2):
        frame = quiet.telemetry.frame.copy()
        frame.loc[frame.index[0].normalize() + pd.Timedelta(days=CHANGED, hours=12 + hour), name] += 5.0
        cases = quiet, Case(quiet.building, replace(quiet.telemetry, frame=frame))
        before, after = (_of_seasons(case, reference, horizon)[0].through_windows[:, 0] for case in cases)
        since = (quiet.stamps - quiet.stamps[0].normalize()) / pd.Timedelta(hours=1) - 24.0 * CHANGED
        changed.append(np.asarray(since)[(np.abs(after - before) > 1e-9) & (np.asarray(since) <= 24.0)])
    assert changed[0] == pytest.approx(np.arange(13.0, 13.0 + hours))
    assert changed[1].size == 0


def test_a_window_is_sought_by_each_law(quiet: Case) -> None:
    """Each derivative is that of a model whose windows let as much air through."""
    models = ModelComparison(quiet, ModelSettings(dx=2.0), [Interval(quiet.stamps[0], quiet.stamps[200])])
    normalisation = fit_normalisation(quiet)
    of_laws, own = _of_seasons(quiet, normalisation, "6h", (on_one_side, across, steady)), []
    for drivers, further in ((of_laws[0], of_laws[1:]), *((each, ()) for each in of_laws)):
        models.drivers = drivers
        days = days_of_case(models, {}, {}, ["window_opening"], None, further)
        name = f"opened_window_area@{quiet.building.zone_names[0]}"
        own.append(days.slopes[..., [c.name == name for c in days.columns]])
    assert [of.shape[-1] for of in own] == [3, 1, 1, 1]
    assert own[0] == pytest.approx(np.concatenate(own[1:], axis=-1))
    assert not np.allclose(own[2], own[1])


def test_heat_that_begins_everywhere_is_told_where_a_room_has_no_device(quiet: Case) -> None:
    """Its secant is that of a model whose room without a device gets as much as the others; the tangent has a tenth."""
    zone, building = quiet.building.zone_names[0], quiet.building
    bare = replace(building, devices=tuple(d for d in building.devices if d.zone != zone))
    frame = quiet.telemetry.frame.rename(columns=lambda c: c.replace(f"VAV_{zone}/zone_air_t", f"{zone}/zone_air_t"))
    frame = frame.drop(columns=frame.filter(regex=f"^VAV_{zone}/").columns)
    case = Case(bare, replace(quiet.telemetry, frame=frame))
    models = ModelComparison(case, ModelSettings(dx=2.0), [Interval(case.stamps[0], case.stamps[len(case.stamps) // 2])])
    (models.drivers,) = _of_seasons(case, fit_normalisation(case), "6h")
    effects, share = {"internal_gains": ()}, "internal_gain_unserved_share"
    built = models.build(effects)
    start = {p.name: p.start for p in built.network.parameters}
    usual, alike = (days_of_case(models, effects, {**start, share: s}, []) for s in (start[share], 0.99))
    columns = [k for k, c in enumerate(usual.columns) if c.name == "base_load"]
    own, everywhere = (usual.slopes[..., k] for k in columns)
    assert usual.columns[columns[0]].spread > 0.0 == usual.columns[columns[1]].spread
    seen = usual.zone == usual.zones.index(zone)
    expected = alike.slopes[..., [c.name for c in alike.columns].index("base_load")]
    np.testing.assert_allclose(everywhere[:, seen], expected[:, seen], rtol=0.03, atol=1e-3 * np.abs(expected).max())
    assert np.abs(everywhere[:, seen]).mean() > 3.0 * np.abs(own[:, seen]).mean()


def test_what_is_in_the_model_is_watched(quiet: Case) -> None:
    result = monitor(quiet, settings=replace(SETTINGS, known=("internal_gains",), ruled_out=("valve_leak",)))
    assert "internal_gains" not in result.untestable
    assert result.untestable["valve_leak"] == "ruled out beforehand"


def test_bad_input(quiet: Case) -> None:
    with pytest.raises(CalibrationError, match="a calibration or effects to fit"):
        monitor(quiet, "calibration.json", SETTINGS)
    for horizon in ("25h", "48h", "5h"):
        with pytest.raises(HorizonError, match="divides a day"):
            monitor(quiet, settings=replace(SETTINGS, horizon=horizon))
    with pytest.raises(NotEnoughDataError, match="60 reference days and a week"):
        monitor(quiet, settings=replace(SETTINGS, reference_days=60))
    with pytest.raises(CalibrationError, match="reference_days"):
        monitor(quiet, settings=replace(SETTINGS, reference_days=3))
    with pytest.raises((CalibrationError, EffectError), match="flow_gian"):
        monitor(quiet, settings=replace(SETTINGS, ruled_out=("flow_gian",)))
