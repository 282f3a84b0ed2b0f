"""Indicators: integrals worked by hand, finer steps that change nothing, BOPTEST's trapezoids as the limit."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mpc.errors import MpcError
from mpc.kpi.bought import costs_of, fuel_of
from mpc.kpi.kpis import KPIS, Kpis, MeasuredRun, measure_kpis, register_kpi
from mpc.kpi.record import PlantRecord
from mpc.scenario.scenario import Scenario
from mpc.scenario.tariff import DemandCharge

Make = Callable[..., Scenario]


def record(scenario: Scenario, seed: int = 0, **changes: Any) -> PlantRecord:
    """Make a run of the whole scenario, at its own steps."""
    rng, n = np.random.default_rng(seed), scenario.grid.n_steps
    values = {
        "step": scenario.grid.step,
        "zone_temperature": 294.0 + np.cumsum(rng.normal(0.0, 0.5, (n + 1, 2)), axis=0),
        "electricity": rng.uniform(0, 5000, n),
        "gas": rng.uniform(0, 8000, n),
    }
    return PlantRecord(**(values | changes))


def finer(run: PlantRecord, parts: int) -> PlantRecord:
    """Cut each step of a run into equal parts."""
    at = np.arange((run.n_steps * parts) + 1) / parts
    whole = np.arange(run.n_steps + 1)

    def lines(values: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(at, whole, column) for column in values.T])

    def steps(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else np.repeat(values, parts)

    return replace(
        run,
        step=run.step / parts,
        zone_temperature=lines(run.zone_temperature),
        electricity=np.repeat(run.electricity, parts),
        gas=steps(run.gas),
        district_heating=steps(run.district_heating),
        co2=None if run.co2 is None else lines(run.co2),
    )


def test_indicators_worked_by_hand(plain_scenario: Make) -> None:
    scenario = plain_scenario("2023-07-03 08:00", 900.0, 8)  # two occupied hours, 50 m2, band 294.15 to 297.15 K
    temperature = np.full((9, 2), 295.15)
    temperature[:, 1] = 294.15 - np.r_[np.zeros(4), 1.0, 1.0, 0.0, 0.0, 0.0]  # a trapezium of 1 K
    temperature[8, 0] = 299.15  # in the last quarter from 2 K below the edge to 2 K above it
    electricity = np.r_[np.full(4, 4000.0), np.full(4, 1000.0)]
    run = PlantRecord(900.0, temperature, electricity, np.full(8, 2000.0), controller_seconds=np.full(8, 1.8))
    kpis = measure_kpis(run, scenario)
    east, west = kpis.zones
    assert west.below == pytest.approx(2 * 0.25)  # 0.5 and 1 and 0.5 quarter-hour kelvins
    assert east.above == pytest.approx(0.25 * 0.5) and east.below == west.above == 0.0
    assert (east.largest_above, west.largest_below) == pytest.approx((2.0, 1.0))
    assert west.occupied_hours_outside == pytest.approx(0.75) and east.occupied_hours_outside == pytest.approx(0.125)
    assert east.occupied_hours == pytest.approx(2.0) and east.occupied_above == east.above
    assert kpis.tdis_tot == pytest.approx((0.5 + 0.125) / 2)
    # 4 kW and 1 kW for an hour each; gas 2 kW for two hours
    assert kpis.ener_tot == pytest.approx((5.0 + 4.0) / 50)
    assert kpis.cost_tot == pytest.approx((5.0 * 0.2 + 4.0 * 0.05) / 50)
    assert kpis.emis_tot == pytest.approx((5.0 * 0.4 + 4.0 * 0.18) / 50)
    assert (kpis.pele_tot, kpis.pgas_tot) == pytest.approx((4.0 / 50, 2.0 / 50))
    assert kpis.pdih_tot is None and kpis.idis_tot is None
    assert kpis.time_rat == pytest.approx(0.002) and kpis.hours == pytest.approx(2.0)


@given(parts=st.sampled_from([2, 3, 5, 15]), seed=st.integers(0, 50))
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_finer_steps_change_nothing(plain_scenario: Make, parts: int, seed: int) -> None:
    scenario = plain_scenario(n_steps=48)
    co2 = 1e-3 + 1e-4 * np.random.default_rng(seed).normal(0, 1, (49, 2))
    run = record(scenario, seed, co2=co2, district_heating=np.full(48, 700.0))
    with pytest.raises(MpcError, match="district heating: expected its price, and its emissions where they count"):
        measure_kpis(run, scenario, co2_limit=1e-3)
    scenario = replace(scenario, district_price=np.full(48, 0.08), district_carbon=np.full(48, 0.2))
    whole, cut = (measure_kpis(r, scenario, co2_limit=1e-3).to_dict() for r in (run, finer(run, parts)))
    for name in ("tdis_tot", "idis_tot", "ener_tot", "cost_tot", "emis_tot", "pele_tot", "pgas_tot", "pdih_tot"):
        assert cut[name] == pytest.approx(whole[name], rel=1e-9, abs=1e-12), name
    for zone in scenario.zones:
        assert cut["zones"][zone] == pytest.approx(whole["zones"][zone], rel=1e-9, abs=1e-9)


def test_trapezoids_of_small_steps_tend_to_the_same(plain_scenario: Make) -> None:
    scenario = plain_scenario(n_steps=48)
    run = record(scenario, 4)
    found = measure_kpis(run, scenario).tdis_tot
    fine = finer(run, 450)  # every 2 s
    lower, upper = (np.repeat(edge, 450, axis=0) for edge in (scenario.lower, scenario.upper))
    clipped = np.maximum(lower - fine.zone_temperature[1:], 0) + np.maximum(fine.zone_temperature[1:] - upper, 0)
    assert found == pytest.approx(clipped.sum(0).mean() * 2.0 / 3600.0, rel=2e-3)


def test_a_peak_is_a_mean_over_a_quarter_of_an_hour(plain_scenario: Make) -> None:
    scenario = plain_scenario("2023-07-03 08:00", 300.0, 12)
    power = np.full(12, 1000.0)
    power[1:4] = 7000.0  # 8:05 to 8:20: two thirds of a quarter, and a third of the next
    run = PlantRecord(300.0, np.full((13, 2), 295.0), power)
    kpis = measure_kpis(run, scenario)
    assert kpis.pele_tot == pytest.approx(5.0 / 50) and kpis.pgas_tot is None
    coarse = plain_scenario("2023-07-03 08:00", 3600.0, 2)
    hourly = measure_kpis(PlantRecord(3600.0, np.full((3, 2), 295.0), np.array([3000.0, 500.0])), coarse)
    assert hourly.pele_tot == pytest.approx(3.0 / 50)


def test_a_run_in_the_midst_of_a_scenario(plain_scenario: Make) -> None:
    scenario = plain_scenario(n_steps=96)
    run = record(scenario)
    parts = []
    for first in (0, 48):
        part = PlantRecord(900.0, run.zone_temperature[first : first + 49], run.electricity[first : first + 48])
        parts.append(measure_kpis(part, scenario, first_step=first))
    whole = measure_kpis(replace(run, gas=None), scenario)
    assert parts[0].tdis_tot + parts[1].tdis_tot == pytest.approx(whole.tdis_tot)
    assert parts[0].cost_tot + parts[1].cost_tot == pytest.approx(whole.cost_tot)
    assert max(p.pele_tot or 0.0 for p in parts) == pytest.approx(whole.pele_tot)


def test_demand_charges_stand_apart(plain_scenario: Make) -> None:
    scenario = plain_scenario("2023-07-31 12:00", 900.0, 96)
    charged = replace(scenario, demand=(DemandCharge([10.0]).on(scenario.grid),))
    run = record(scenario)
    kpis = measure_kpis(finer(run, 3), charged)
    peaks = run.electricity[:48].max() + run.electricity[48:].max()  # July's and August's
    assert kpis.demand_cost == pytest.approx(10.0 * peaks / 1000.0 / 50)
    assert kpis.cost_tot == pytest.approx(measure_kpis(run, scenario).cost_tot)


def test_air_discomfort_by_hand(plain_scenario: Make) -> None:
    scenario = plain_scenario("2023-07-03 08:00", 900.0, 4)
    co2 = np.column_stack([np.full(5, 1.2e-3), np.full(5, 0.8e-3)])
    run = PlantRecord(900.0, np.full((5, 2), 295.0), np.zeros(4), co2=co2)
    assert measure_kpis(run, scenario, co2_limit=1e-3).idis_tot == pytest.approx(100.0)  # 200 ppm h in one of two


def test_json_has_zones_by_name(plain_scenario: Make) -> None:
    scenario = plain_scenario(n_steps=4)
    kpis = measure_kpis(record(scenario), scenario)
    plain = json.loads(json.dumps(kpis.to_dict()))
    assert set(plain["zones"]) == {"east", "west"} and plain["zones"]["east"]["below"] == kpis.zones[0].below
    assert isinstance(kpis, Kpis) and plain["carbon_kind"] == "average"


def test_what_does_not_fit_is_refused(plain_scenario: Make) -> None:
    scenario = plain_scenario(n_steps=4)
    run = record(scenario)
    for build, message in (
        (lambda: record(scenario, electricity=np.zeros(5)), r"electricity: expected shape \(4,\)"),
        (
            lambda: record(scenario, gas=np.array([0.0, np.nan, 0.0, 0.0])),
            "gas: expected finite numbers, found nan in row 1",
        ),
        (lambda: record(scenario, zone_temperature=np.zeros(5)), r"\(n \+ 1, n_zone\)"),
        (lambda: measure_kpis(replace(run, step=420.0), scenario), "whole steps of 900 s"),
        (lambda: measure_kpis(run, scenario, first_step=1), "within the scenario's 4"),
        (lambda: measure_kpis(replace(run, zone_temperature=np.zeros((5, 3))), scenario), "2 zones"),
        (lambda: measure_kpis(replace(run, co2=np.zeros((5, 2))), scenario), "co2_limit"),
        (lambda: measure_kpis(replace(run, district_heating=np.zeros(4)), scenario), "its price"),
    ):
        with pytest.raises(MpcError, match=message):
            build()


def test_a_kpi_of_ones_own_is_measured_and_shown(plain_scenario: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    """A function of a run and its tariff, registered outside of the library."""
    monkeypatch.setattr("mpc.kpi.kpis.KPIS", dict(KPIS))

    def dearest_hour(run: MeasuredRun) -> float:
        price = run.scenario.electricity_price[run.rows]
        return float((price * run.record.electricity / 1000.0).max())

    register_kpi("dearest_hour", dearest_hour, "currency/h", "highest cost of electricity in an hour")
    register_kpi("dearest_hour", dearest_hour, "currency/h", "highest cost of electricity in an hour")  # read again
    register_kpi("never", lambda run: None, "-", "what no plant has")
    scenario = plain_scenario(n_steps=4)
    run = record(scenario, electricity=np.array([1000.0, 4000.0, 2000.0, 0.0]))
    kpis = measure_kpis(run, scenario)
    assert kpis.own == {"dearest_hour": pytest.approx(0.8), "never": None}
    assert kpis.to_dict()["dearest_hour"] == pytest.approx(0.8) and "own" not in kpis.to_dict()
    table = kpis.to_frame()
    assert table.loc["dearest_hour", "unit"] == "USD/h" and table.loc["cost_tot", "value"] == kpis.cost_tot
    assert [*table.index] == [*kpis.values] and "dearest_hour=0.8" in repr(kpis) and len(repr(kpis)) < 300
    for name in ("cost_tot", "zones", "dearest_hour", "two words"):
        with pytest.raises(MpcError, match="a name beside tdis_tot"):
            register_kpi(name, lambda run: 0.0, "-", "another")


def test_a_record_goes_to_pandas_and_back(plain_scenario: Make) -> None:
    scenario = plain_scenario(n_steps=4)
    run = record(scenario, co2=np.full((5, 2), 4e-4))
    table = run.to_frame(scenario.grid.start, scenario.zones)
    assert table.index[-1] == scenario.grid.stamps[-1] and table["electricity"].isna().tolist() == [True] + [False] * 4
    for back in (PlantRecord.from_frame(table), PlantRecord.from_frame(run.to_frame())):
        assert back.step == run.step and back.district_heating is None
        for name in ("zone_temperature", "electricity", "gas", "co2"):
            np.testing.assert_array_equal(getattr(back, name), getattr(run, name))
    assert repr(run) == "PlantRecord(4 steps of 900 s, 2 zones)"
    with pytest.raises(MpcError, match="regular edges"):
        PlantRecord.from_frame(table.drop(columns="electricity"))


def test_gas_and_district_heating_cost_what_each_costs(plain_scenario: Make) -> None:
    scenario = replace(plain_scenario(n_steps=48), district_price=np.full(48, 0.08), gas_price=np.full(48, 0.05),
                       district_carbon=np.zeros(48))  # fmt: skip
    run = record(scenario, 3, district_heating=np.full(48, 700.0))
    run = replace(run, gas=np.where(np.arange(48) < 24, 300.0, 0.0))
    fuel, costs = fuel_of(run, scenario), costs_of(run, scenario)
    assert fuel.name == "gas and district heating" and fuel.power[[0, 47]].tolist() == [1000.0, 700.0]
    assert fuel.price[[0, 47]] == pytest.approx([(0.3 * 0.05 + 0.7 * 0.08) / 1.0, 0.08])
    assert (costs[0].sum() + costs[1].sum()) == pytest.approx(measure_kpis(run, scenario).cost_tot * scenario.floor_area)
