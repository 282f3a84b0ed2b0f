"""Forecast tables: units of any kind in, and what is lacking named with its first time."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mpc.errors import ScenarioError
from mpc.scenario.forecast import Forecast, column_unit

AIR, BEAM = "outside_air_temperature_sensor", "direct_normal_irradiance_sensor"


def table(n_steps: int = 72) -> pd.DataFrame:
    stamps = pd.date_range("2023-07-06 07:05", periods=n_steps, freq="5min", tz="America/Los_Angeles")
    columns = {AIR: np.linspace(285.0, 290.0, n_steps), "electricity_price": 0.2, "east/internal_gain": 300.0}
    return pd.DataFrame(columns, index=stamps)


def test_columns_come_out_in_the_order_asked_for() -> None:
    forecast = Forecast(table())
    values = forecast.values(["electricity_price", AIR])
    assert values.shape == (72, 2) and values[0].tolist() == [0.2, 285.0]
    assert forecast.units == {AIR: "kelvin", "electricity_price": "1/kWh", "east/internal_gain": "W"}


def test_a_missing_column_is_named_with_its_first_time() -> None:
    broken = table()
    broken[BEAM] = 500.0
    broken.iloc[[1, 5, 6], broken.columns.get_loc(BEAM)] = np.nan
    message = (
        r"forecast lacks 'direct_normal_irradiance_sensor' for 3 of 72 steps \(first 2023-07-06 07:10\); "
        r'pass fill="hold" or supply it'
    )
    with pytest.raises(ScenarioError, match=message):
        Forecast(broken).values([AIR, BEAM])
    assert Forecast(broken).values([BEAM], fill="hold").tolist() == [[500.0]] * 72
    with pytest.raises(ScenarioError, match="nearest valid one is 'east/internal_gain'.*72 of 72"):
        Forecast(table()).values(["est/internal_gain"])
    with pytest.raises(ScenarioError, match="for 72 of 72 .*; supply it"):
        Forecast(table()).values([BEAM], fill="hold")


def test_missing_steps_are_named_or_held() -> None:
    stamps = table(80).index
    with pytest.raises(ScenarioError, match=r"for 8 of 80 steps \(first 2023-07-06 13:05\)"):
        Forecast(table()).values([AIR], stamps)
    held = Forecast(table()).values([AIR], stamps, fill="hold")
    assert held[72:].tolist() == [[290.0]] * 8


def test_units_of_ones_own() -> None:
    own = table(2)[[AIR, "east/internal_gain", "electricity_price"]]
    own[AIR], own["east/internal_gain"] = [10.0, 20.0], [0.3, 0.4]
    units = {AIR: "degC", "east/internal_gain": "kW", "electricity_price": "1/kWh"}
    values = Forecast.from_frame(own, units).values(list(own))
    assert values == pytest.approx(np.array([[283.15, 300.0, 0.2], [293.15, 400.0, 0.2]]))
    for change, message in (
        ({"electricity_price": "1/MWh"}, "the unit '1/kWh'"),
        ({AIR: "W"}, "a unit of a temperature"),
    ):
        with pytest.raises(ScenarioError, match=message):
            Forecast.from_frame(own, units | change)
    with pytest.raises(ScenarioError, match="a unit, found none; add it"):
        Forecast.from_frame(own, {AIR: "degC"})


def test_what_is_no_forecast_is_refused() -> None:
    with pytest.raises(ScenarioError, match="time zone"):
        Forecast(table().tz_localize(None))
    with pytest.raises(ScenarioError, match="out of order"):
        Forecast(table().iloc[::-1])
    with pytest.raises(ScenarioError, match="nearest valid one is 'electricity_price'"):
        column_unit("electricty_price")
    with pytest.raises(ScenarioError, match="'hold' or None"):
        Forecast(table()).values([AIR], fill="zero")  # type: ignore[arg-type]


def test_a_forecast_goes_to_pandas_and_back() -> None:
    forecast = Forecast(table())
    again = Forecast.from_frame(forecast.to_frame(), forecast.units)
    pd.testing.assert_frame_equal(again.table, forecast.table)
    assert repr(forecast) == "Forecast(72 steps, 2023-07-06 07:05:00-07:00 to 2023-07-06 13:00:00-07:00, 3 columns)"
