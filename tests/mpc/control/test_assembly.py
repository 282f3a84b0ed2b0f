"""Forecasts on a horizon, schedules, and the windows of demand charges."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mpc.control.problem.assembly import ComfortOperation, DemandCount, expect
from mpc.control.problem.horizon import Horizon
from mpc.errors import ScenarioError
from mpc.scenario.forecast import Forecast
from mpc.scenario.grid import StepGrid
from mpc.scenario.tariff import DemandCharge

AHEAD = Horizon.growing([(0.5, 300.0), (1.5, 900.0)], [1.0, 1.0])
START = pd.Timestamp("2023-01-16 06:00", tz="Etc/GMT+8")


def test_means_and_bands(make_forecast, points) -> None:
    table = make_forecast().table.copy()
    table["outside_air_temperature_sensor"] = 270.0 + np.arange(len(table))
    found = expect(Forecast(table), AHEAD, START, points.zones)
    assert found.outdoor_temperature[:3].tolist() == [270.0, 271.0, 272.0]
    np.testing.assert_allclose(found.outdoor_temperature[6:8], [277.0, 280.0])  # means of three steps
    # occupied from 7:00 on: the step before already ends in the narrow band
    seven = int(np.flatnonzero(AHEAD.edges == 3600.0)[0])
    assert found.band[0][seven - 1, 0] == 288.15 and found.lower[seven - 1, 0] == 294.15
    assert found.gains[seven, 0] == 300.0 and found.gains[seven - 1, 0] == 30.0


def test_a_missing_column_is_named_with_its_first_time(make_forecast, points) -> None:
    table = make_forecast().table.copy()
    name = f"{points.zones[1]}/internal_gain"
    table.loc[table.index[4] :, name] = np.nan
    with pytest.raises(ScenarioError, match=rf"lacks '{name}' for 44 of 48 steps \(first 2023-01-16 06:25\)"):
        expect(Forecast(table), AHEAD, START, points.zones)
    held = expect(Forecast(table), AHEAD, START, points.zones, fill="hold")
    assert (held.gains[:, 1] == 30.0).all()
    with pytest.raises(ScenarioError, match="steps from"):
        expect(make_forecast(count=6), AHEAD, START, points.zones)


def test_emissions_count_at_their_price(make_forecast, points) -> None:
    table = make_forecast().table.assign(electricity_carbon_intensity=0.4, gas_carbon_intensity=0.2)
    found = expect(Forecast(table), AHEAD, START, points.zones, carbon_price=0.1)
    assert found.electricity_price[0] == pytest.approx(0.14) and found.gas_price[0] == pytest.approx(0.07)


def test_setpoints_come_before_the_occupied_hours() -> None:
    edges = np.arange(13) * 900.0
    occupied = (np.arange(12) >= 8)[:, None]
    band = np.where(occupied, 294.0, 288.0), np.where(occupied, 297.0, 303.0)
    found = ComfortOperation(margin=0.5, lead_hours=1.0).schedule(band, edges)
    assert found.heating[:, 0].tolist() == [288.5] * 4 + [294.5] * 8
    assert found.running.tolist() == [0.0] * 4 + [1.0] * 8 and found.ventilation.tolist() == [0.0] * 8 + [1.0] * 4


def test_windows_are_those_of_the_tariff() -> None:
    """Peaks of a horizon that begins within a window, against the tariff's own sum over the run."""
    charge = DemandCharge([10.0, 4.0], np.where(np.arange(24) < 7, 1, 0) * np.ones((12, 1), dtype=int))
    ahead, now = Horizon.regular(2.0, 300.0, 2), START + pd.Timedelta(minutes=5)
    power = np.random.default_rng(0).uniform(1e3, 9e3, 25)  # the first step is over when the horizon begins
    count = DemandCount([charge])
    count.add(power[0], now, 300.0)
    data = count.ahead(ahead, now)
    grid = StepGrid(START, 300.0, 25)
    whole = charge.on(grid)
    peaks = data.peaks(power[1:])
    assert peaks == pytest.approx(whole.peaks(power))
    assert data.rate @ peaks / 1000.0 == pytest.approx(whole.cost(power))
    assert DemandCount([]).ahead(ahead, now).rate.size == 0
