"""Tariffs of the Utility Rate Database: prices and charges by hand, and what is not modelled refused by name."""

from __future__ import annotations

import json
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from mpc.errors import ScenarioError
from mpc.scenario.grid import StepGrid
from mpc.scenario.rates import ConstantRate
from mpc.scenario.urdb import read_urdb

ZONE = "America/Los_Angeles"
GAS = ConstantRate(0.04)


def tariff() -> dict[str, Any]:
    """A commercial tariff as the service answers: summer and winter, two periods on weekdays, both demand charges."""
    winter, summer = [0] * 24, [1] * 12 + [2] * 6 + [1] * 6
    weekday = [summer if 5 <= month <= 8 else winter for month in range(12)]
    weekend = [[1] * 24 if 5 <= month <= 8 else winter for month in range(12)]
    demand = [[0] * 12 + [1] * 6 + [0] * 6 for _ in range(12)]
    return {
        "label": "539fbe5cec4f024bc1dc0000",
        "utility": "Town Light",
        "name": "B-19",
        "approved": True,
        "startdate": 1688169600,
        "energyratestructure": [
            [{"rate": 0.10, "unit": "kWh"}],
            [{"rate": 0.12, "adj": 0.01, "unit": "kWh"}],
            [{"rate": 0.25, "adj": -0.01, "unit": "kWh"}],
        ],
        "energyweekdayschedule": weekday,
        "energyweekendschedule": weekend,
        "flatdemandunit": "kW",
        "flatdemandstructure": [[{"rate": 8.0}], [{"rate": 12.0, "adj": 0.5}]],
        "flatdemandmonths": [0, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0],
        "demandrateunit": "kW",
        "demandratestructure": [[{"rate": 0.0}], [{"rate": 20.0}]],
        "demandweekdayschedule": demand,
        "demandweekendschedule": [[0] * 24] * 12,
        "demandwindow": 30,
        "fixedchargefirstmeter": 140.0,
        "fixedchargeunits": "$/month",
    }


def day(start: str, n_steps: int = 24) -> StepGrid:
    return StepGrid(pd.Timestamp(start, tz=ZONE), 3600.0, n_steps)


def test_prices_of_seasons_days_and_hours() -> None:
    read = read_urdb(tariff(), GAS)
    assert read.name == "Town Light B-19" and read.currency == "USD" and read.gas is GAS
    monday = read.electricity.on(day("2023-07-03"))
    assert monday[[11, 12, 17, 18]] == pytest.approx([0.13, 0.24, 0.24, 0.13])
    assert read.electricity.on(day("2023-07-08"))[14] == pytest.approx(0.13)
    assert read.electricity.on(day("2023-01-09")).tolist() == [0.10] * 24
    short = read.electricity.on(day("2023-03-12", 23))
    assert len(short) == 23 and short.sum() == pytest.approx(2.3)


def test_charges_of_seasons_and_periods() -> None:
    read = read_urdb(tariff(), GAS)
    flat, tou = (charge.on(day("2023-06-30", 48)) for charge in read.demand)  # a Friday and a Saturday
    power = np.zeros(48)
    power[9], power[14], power[24 + 14] = 6000.0, 4000.0, 5000.0
    assert [c.window for c in read.demand] == [1800.0, 1800.0]
    assert flat.cost(power) == pytest.approx(12.5 * (6.0 + 5.0))  # June's peak and July's
    assert tou.cost(power) == pytest.approx(20.0 * 4.0)


def test_fuel_adjustments_of_months() -> None:
    item = tariff() | {"fueladjustmentsmonthly": [0.01 * m for m in range(12)]}
    assert read_urdb(item, GAS).electricity.on(day("2023-07-03"))[14] == pytest.approx(0.24 + 0.06)


def test_files_and_answers_of_the_service(tmp_path: Path) -> None:
    path = tmp_path / "rate.json"
    path.write_text(json.dumps({"items": [tariff()]}))
    assert read_urdb(path, GAS).name == "Town Light B-19"
    path.write_text(json.dumps({"items": [tariff(), tariff()]}))
    with pytest.raises(ScenarioError, match=r"rate\.json: expected one tariff, found 2 items"):
        read_urdb(path, GAS)
    path.write_text("{")
    with pytest.raises(ScenarioError, match="a JSON file"):
        read_urdb(path, GAS)


def test_tiers_are_refused_unless_one_is_chosen() -> None:
    item = tariff()
    item["energyratestructure"][1] = [{"rate": 0.12, "max": 500, "unit": "kWh"}, {"rate": 0.18, "unit": "kWh"}]
    with pytest.raises(
        ScenarioError, match=r"energyratestructure\[1\]: expected one tier, found 2, the first up to 500 kWh"
    ):
        read_urdb(item, GAS)
    assert read_urdb(item, GAS, tier=0).electricity.on(day("2023-07-03"))[11] == pytest.approx(0.12)
    above = read_urdb(item, GAS, tier=1).electricity.on(day("2023-07-03"))
    assert above[[11, 14]] == pytest.approx([0.18, 0.24])  # the period of one tier keeps its own


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"demandratchetpercentage": [0] * 11 + [80]}, "demandratchetpercentage: expected a tariff without a ratchet"),
        ({"coincidentratestructure": [[{"rate": 3.0}]]}, "coincidentratestructure"),
        ({"lookbackpercent": 0.5}, "lookbackpercent"),
        ({"demandreactivepowercharge": 0.2}, "demandreactivepowercharge"),
        ({"flatdemandunit": "kVA"}, r"flatdemandstructure\[0\]: unit: expected 'kW', found 'kVA'"),
        ({"demandrateunit": "kW daily"}, "'kW daily'"),
        ({"energyratestructure": [[{"rate": 0.1, "unit": "kWh/kW"}]]}, "'kWh/kW'"),
        ({"energyratestructure": []}, "periods of tiers"),
        ({"energyweekdayschedule": [[0] * 23] * 12}, "energyweekdayschedule: expected 12 x 24"),
        ({"energyweekendschedule": [[3] * 24] * 12}, "from 0 to 2"),
        ({"energyweekendschedule": None}, "found nothing"),
        ({"flatdemandmonths": [0] * 11}, "flatdemandmonths: expected 12 whole"),
        ({"fueladjustmentsmonthly": [0.1]}, "fueladjustmentsmonthly"),
    ],
)
def test_what_is_not_modelled_is_named(change: dict[str, Any], message: str) -> None:
    item = deepcopy(tariff()) | change
    with pytest.raises(ScenarioError, match=message):
        read_urdb(item, GAS)


def test_zeros_of_parts_that_are_not_modelled_are_fine() -> None:
    item = tariff() | {"demandratchetpercentage": [0] * 12, "lookbackpercent": 0, "coincidentratestructure": []}
    assert len(read_urdb(item, GAS).demand) == 2
