"""Prices and comfort as they are typed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mpc.errors import ScenarioError
from mpc.scenario.from_text import read_comfort, read_gas_price, read_tariff
from mpc.scenario.grid import StepGrid
from mpc.scenario.tariff import paper_tariff

DAY = StepGrid(pd.Timestamp("2023-07-03", tz="America/Los_Angeles"), 3600.0, 24)


def test_gas_by_the_unit_it_is_sold_in() -> None:
    assert read_gas_price("0.08").value == 0.08
    assert read_gas_price(" 80 / MWh").value == pytest.approx(0.08)
    assert read_gas_price("1.2/therm").value == pytest.approx(1.2 / 29.30711)


@pytest.mark.parametrize("text", ["-1", "cheap", "3/bushel", "", "1.2/therm/h"])
def test_a_gas_price_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ScenarioError, match="--gas-price: expected a price per kWh"):
        read_gas_price(text)


def test_defaults_are_the_papers() -> None:
    found, paper = read_tariff(), paper_tariff()
    np.testing.assert_array_equal(found.electricity.on(DAY), paper.electricity.on(DAY))
    np.testing.assert_array_equal(found.gas.on(DAY), paper.gas.on(DAY))
    assert found.currency == "USD" and found.name == paper.name


def test_a_constant_price_in_another_currency() -> None:
    found = read_tariff("0.25", "0.09", "EUR")
    assert found.electricity.on(DAY).tolist() == [0.25] * 24 and found.gas.on(DAY).tolist() == [0.09] * 24
    assert found.currency == "EUR" and "0.25 EUR/kWh" in found.name
    assert "gas at 0.09" in read_tariff(gas="0.09").name


@pytest.mark.parametrize("given", [(None, None), ("0.25", None), (None, "0.09"), ("tariff.json", "0.09")])
def test_prices_of_the_default_are_never_called_another_currency(given: tuple[str | None, str | None]) -> None:
    with pytest.raises(ScenarioError, match=r"--currency EUR: expected prices in EUR .* nothing is converted"):
        read_tariff(*given, "EUR")


def test_a_file_of_the_utility_rate_database(tmp_path: Path) -> None:
    table = [[0] * 24] * 12
    item = {"energyratestructure": [[{"rate": 0.3}]], "energyweekdayschedule": table, "energyweekendschedule": table}
    path = tmp_path / "tariff.json"
    path.write_text(json.dumps(item), encoding="utf-8")
    found = read_tariff(str(path), "2/therm")
    assert found.electricity.on(DAY)[0] == 0.3 and found.gas.on(DAY)[0] == pytest.approx(2 / 29.30711)
    with pytest.raises(ScenarioError, match="--tariff: expected a price of 0 or more"):
        read_tariff("-0.1")


def test_comfort_in_both_scales() -> None:
    band = read_comfort("20,25,12,32")
    assert band.occupied == (293.15, 298.15) and band.unoccupied == (285.15, 305.15)
    assert read_comfort("68F, 77°F").occupied == pytest.approx((293.15, 298.15))
    assert read_comfort("20C,77F").unoccupied == (288.15, 303.15)  # the default's


@pytest.mark.parametrize("text", ["21", "24,21", "21,24,30,15", "21,24,15", "warm,cold", "70K,75K", "500F,600F"])
def test_a_band_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ScenarioError, match="comfort"):
        read_comfort(text)
