"""What is served: clock, periods, prices, signals, and cases of users."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from calibration import ModelSettings
from mpc.adapters.boptest.case import BoptestCase, Trajectory
from mpc.adapters.boptest.make import _plain_name, case_to_serve, with_plant
from mpc.adapters.boptest.scenario import MarketRate, YearClock, find_periods, scenario_prices
from mpc.adapters.boptest.signals import _signal_names
from mpc.errors import BoptestError, BoptestRequestError, PlantError
from mpc.scenario.grid import StepGrid
from mpc.scenario.rates import HourlyRate
from thermal import load_bundled_case, load_case
from thermal.case.building import Device

DAY = 86_400.0
SHARED = Path(__file__).parents[4].parent / "shared" / "cases"


def test_the_clock_is_never_put_forward() -> None:
    clock = YearClock(2024, "Europe/Berlin")
    assert clock.stamp(0.0).isoformat() == "2024-01-01T00:00:00+01:00"
    assert clock.stamp(180 * DAY).isoformat() == "2024-06-29T01:00:00+02:00"
    assert clock.time(clock.stamp(180 * DAY).timestamp()) == 180 * DAY


def test_periods_of_a_year_are_two_weeks_around_the_days_that_they_name() -> None:
    """A year whose temperature is a cosine: coldest on day 20, warmest half a year later."""
    day = np.arange(365)
    daily = 283.15 - 14.0 * np.cos(2 * np.pi * (day - 20) / 365.0)
    found = find_periods(0.0, daily)
    assert set(found) == {"peak_heat_day", "typical_heat_day", "peak_cool_day", "typical_cool_day", "mix_day"}
    peak = found["peak_heat_day"]
    assert (peak.start, peak.end, peak.warm_up) == (13 * DAY, 27 * DAY, 7 * DAY)
    assert found["peak_cool_day"].start == pytest.approx((20 + 182 - 7) * DAY, abs=DAY)
    middle = int((found["typical_heat_day"].start + found["typical_heat_day"].end) / 2 / DAY)
    assert daily[middle] == pytest.approx(np.median(daily[daily < 288.15]), abs=0.2)
    assert all(p.end - p.start == 14 * DAY for p in found.values())


def test_periods_of_short_or_warm_weather() -> None:
    warm = find_periods(3 * DAY, np.array([300.0, 305.0, 301.0, np.nan, 302.0]))
    assert set(warm) == {"peak_cool_day", "typical_cool_day", "mix_day"}
    for period in warm.values():  # a day of warm-up before, a day of forecast after
        assert period.start >= 4 * DAY and period.end <= 7 * DAY and period.warm_up >= DAY


def test_the_market_price_repeats_changes_every_hour_and_keeps_its_mean() -> None:
    year = StepGrid(pd.Timestamp("2023-01-01", tz="Europe/Berlin"), 3600.0, 8760)
    rate = MarketRate(0.2)
    values = rate.on(year)
    np.testing.assert_array_equal(values, rate.on(year))
    assert values.mean() == pytest.approx(0.2, rel=0.05) and values.min() > 0.0
    assert (np.diff(values.reshape(365, 24)) != 0.0).mean() > 0.9
    part = StepGrid(pd.Timestamp("2023-06-01 12:00", tz="Europe/Berlin"), 300.0, 24)
    noon = int((part.start - year.start).total_seconds() // 3600)
    np.testing.assert_allclose(part.n_steps * [1.0], 1.0)
    np.testing.assert_allclose(rate.on(part), np.repeat(values[noon : noon + 2], 12))


def test_the_constant_price_is_the_mean_of_the_dynamic_one() -> None:
    year = StepGrid(pd.Timestamp("2023-01-02", tz="UTC"), 3600.0, 24 * 28)
    prices = scenario_prices(HourlyRate([0.1] * 12 + [0.3] * 12), year)
    assert prices["constant"].on(year)[0] == pytest.approx(0.2)


def test_names_of_signals_are_plain_and_differ() -> None:
    found = _signal_names(["AHU 1/p", "AHU-1/p", "Raum ä/p"])
    assert list(found.values()) == ["AHU_1_p", "AHU_1_p_2", "Raum_ä_p"]
    assert _plain_name(" Town hall/2 ") == "Town_hall_2" and _plain_name("///") == "building"


def test_a_trajectory_gives_what_lies_between_two_times() -> None:
    rows = Trajectory(("a", "b"))
    for k in range(2000):
        rows.append(300.0 * k, [k, -k])
    assert len(rows) == 2000 and rows.last() == {"time": 599_700.0, "a": 1999.0, "b": -1999.0}
    assert rows.between(["b"], 299.0, 900.0) == {"time": [300.0, 600.0, 900.0], "b": [-1.0, -2.0, -3.0]}
    assert rows.between(["a"], 1e9, 2e9) == {"time": [], "a": []}
    other = rows.copy()
    other.append(1e6, [0.0, 0.0])
    assert len(rows) == 2000


def test_a_building_without_a_plant_gets_one() -> None:
    building = load_bundled_case().building
    made = with_plant(building)
    assert [d.type for d in made.devices] == ["vav"] * 5 + ["ahu", "boiler"]
    twice = with_plant(made)
    assert twice.devices == made.devices
    more = dataclasses.replace(made, devices=(*made.devices, Device(name="x", type="vav", zone=made.zone_names[0])))
    assert with_plant(more).devices == made.devices


def test_what_cannot_be_served_is_refused(served: BoptestCase, tmp_path: Path) -> None:
    with pytest.raises(PlantError, match="whole number of minutes"):
        dataclasses.replace(served, step=90.0)
    short = dataclasses.replace(served.weather, frame=served.weather.frame.iloc[:60])
    with pytest.raises(PlantError, match="three whole days"):
        dataclasses.replace(served, weather=short)
    with pytest.raises(PlantError, match="longest_days"):
        dataclasses.replace(served, longest_days=0.0)
    with pytest.raises(BoptestRequestError, match="where there is weather"):
        served.begin(100 * DAY, 0.0)
    case = load_bundled_case()
    with pytest.raises(BoptestError, match=r"an ending \.epw or \.csv"):
        case_to_serve(case, weather=tmp_path / "town.txt", dx=1.0)
    with pytest.raises(BoptestError, match="No such file"):
        case_to_serve(case, weather=tmp_path / "town.csv", dx=1.0)


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared practice cases beside the repository")
def test_a_users_case_is_served() -> None:
    folder = next(path for path in sorted(SHARED.iterdir()) if (path / "building.yaml").is_file())
    made = case_to_serve(load_case(folder), dx=1.0)
    begun = made.begin(made.periods["mix_day"].start, 0.0)
    begun.plant.reset()
    begun.plant.step(begun.plant.default_actions)
    assert (250.0 < begun.plant.zone_temperature).all() and len(made.signals.inputs) >= 2


def test_a_case_is_served_as_calibrated_with_what_was_found(tmp_path: Path) -> None:
    case = load_bundled_case()
    settings = ModelSettings(dx=1.0, effects={"infiltration": []})
    network = settings.network(case.building)
    values = {p.name: {"value": float(v)} for p, v in zip(network.parameters, network.start(), strict=True)}
    file = tmp_path / "calibration.json"
    warmth = []
    for rate in (0.0, 1.0):
        changed = values | {"infiltration_rate": {"value": rate}}
        file.write_text(json.dumps({"parameters": changed, "settings": settings.to_dict()}))
        made = case_to_serve(case, file, name="leaky")
        begun = made.begin(made.covered[0], 0.0)
        begun.plant.reset()
        for _ in range(72):  # a night in March without heating
            begun.plant.step(begun.plant.default_actions)
        warmth.append(float(begun.plant.zone_temperature.mean()))
    assert warmth[1] < warmth[0] - 0.05
