"""Optimal control on EnergyPlus' offices: excitation, table, resuming, and some hours of the loop itself."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from types import ModuleType, SimpleNamespace

import pandas as pd
import pytest

needs_energyplus = pytest.mark.skipif(
    importlib.util.find_spec("pyenergyplus") is None, reason="EnergyPlus is not installed: pip install -e .[energyplus]"
)
NAMES = ["AHU/supply_air_temperature_setpoint", "room/zone_air_heating_temperature_setpoint",
         "room/zone_air_cooling_temperature_setpoint"]  # fmt: skip


@pytest.fixture(scope="module")
def offices(script: Callable[[str], ModuleType]) -> ModuleType:
    return script("_energyplus_offices")


@pytest.fixture(scope="module")
def control(script: Callable[[str], ModuleType], offices: ModuleType) -> ModuleType:
    return script("_energyplus_control")


@pytest.fixture(scope="module")
def benchmark(script: Callable[[str], ModuleType], control: ModuleType) -> ModuleType:
    script("_code")
    script("_table")
    return script("mpc_energyplus")


def excited(offices: ModuleType, start: str, steps: int) -> list[dict[str, float]]:
    plant = SimpleNamespace(actuators=[SimpleNamespace(name=name) for name in NAMES])
    excitation = offices.Excitation(plant, seed=3)
    stamps = pd.date_range(start, periods=steps, freq="30min")
    return [dict(excitation.step(SimpleNamespace(stamp=stamp), None)) for stamp in stamps]


def test_excitation_is_mild_held_and_repeats(offices):
    day = excited(offices, "2023-01-10 00:00", 48)
    assert all(not action for action in [*day[:12], *day[44:]])  # night and evening are the building's
    for action in day[12:44]:
        assert set(action) == set(NAMES)
        low, high = (action[f"room/zone_air_{side}_temperature_setpoint"] for side in ("heating", "cooling"))
        assert abs(low - 294.15) <= 1.0 and high - low == pytest.approx(3.0)
        assert 285.95 <= action[NAMES[0]] <= 288.95
    assert len({action[NAMES[1]] for action in day[12:18]}) == 1
    assert len({action[NAMES[1]] for action in day[12:44]}) > 1
    assert day == excited(offices, "2023-01-10 00:00", 48)
    assert not any(excited(offices, "2023-01-15 00:00", 48))  # a Sunday


def test_the_week_that_is_controlled_follows_the_telemetry(offices):
    assert offices.OFFICES["medium_winter"].controlled == "2023-01-23"


def test_what_is_finished_is_not_run_again(benchmark, offices, tmp_path):
    done = {"cost": 1.0, "discomfort": 0.5}
    (tmp_path / "run_own.json").write_text(json.dumps(done))
    (tmp_path / "models.json").write_text(json.dumps({"effects": {}}))
    office = offices.OFFICES["large_winter"]
    assert benchmark.measured(office, "own", tmp_path, 7, {}) == done
    assert benchmark.prepared(office, tmp_path) == {"effects": {}}


def test_the_table_compares_with_the_buildings_own_control(benchmark):
    run = {"electricity_kwh": 100.0, "gas_kwh": 50.0, "discomfort": 0.25, "worst": [2.0, "room"]}
    runs = {"own": {**run, "cost": 20.0}, "after": {**run, "cost": 15.0}}
    table = benchmark.table_of({"medium_winter": {"runs": runs}})
    assert "| Medium Office | winter | own control | 100 | 50 | 20 | +0.0 | 0.25 | 2.0 |" in table
    assert "| MPC after | 100 | 50 | 15 | -25.0 |" in table


def test_measured_boundaries_keep_their_last_value(control):
    boundaries = control.MeasuredBoundaries(lambda forecast, stamps: [[0.0, 7.0]] * len(stamps), ["plenum"])
    boundaries.measure({"plenum/zone_air_temperature_sensor": 296.0})
    boundaries.measure({"plenum/zone_air_temperature_sensor": float("nan")})
    assert boundaries(None, [1, 2]).tolist() == [[296.0, 7.0]] * 2


@pytest.mark.long
@pytest.mark.energyplus
@needs_energyplus
def test_a_morning_of_optimal_control_costs_less_than_the_buildings_own(control, offices):
    office = offices.OFFICES["medium_winter"]
    costs = []
    for own in (True, False):
        plant = office.plant(office.controlled, 1, offices.HORIZON)
        seen = plant.reset(2)
        optimal = None if own else control.optimal(plant, {})  # the uncalibrated baseline
        for k in range(20):
            seen = plant.step({} if optimal is None or k < 11 else optimal.step(seen, plant.forecast()))
        plant.close()
        record = plant.record()
        costs.append(offices.ELECTRICITY * record.electricity.sum() + offices.GAS * record.gas.sum())
        if optimal is not None:
            assert set(optimal.sources) == {"optimal plan"}
    assert costs[1] < 0.98 * costs[0]
