"""The closed loop: energy, repeatability, refusals, saved states, second law and monotone answers."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mpc.errors import PlantActionError, PlantError
from mpc.kpi.kpis import measure_kpis
from mpc.kpi.rewards import StageCost
from mpc.loop.building import GridBuilding
from mpc.loop.noise import SensorNoise
from mpc.loop.operation import scheduled_operation
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.forecast import Forecaster
from mpc.scenario.gains import InternalGains
from mpc.scenario.scenario import Scenario
from thermal import Building, Simulator, load_case, save_case
from thermal.model.simulator import Shuffle
from thermal.system.system import HvacSystem

Make = Callable[..., SimulatedPlant]


def test_energy_closes_at_every_step_of_a_day(make_plant: Make) -> None:
    """Fuel, electricity and gains are losses, exhaust and what is kept, over building and plant."""
    plant = make_plant()
    plant.reset()
    for _ in range(288):
        plant.step(plant.default_actions)
        balance = plant.balance()
        assert abs(balance.residual) < 1e-6 * balance.turnover
    assert balance.turnover > 1000.0


def test_energy_closes_on_the_grid_with_the_random_shuffle(building: Building, make_plant: Make) -> None:
    plant = make_plant(
        model=GridBuilding(Simulator(building, dx=1.0, shuffle=Shuffle("random", seed=1))), warm_up_days=0
    )
    plant.reset()
    for _ in range(90):
        plant.step(plant.default_actions)
        balance = plant.balance()
        assert abs(balance.residual) < 1e-6 * balance.turnover


def test_grid_and_reduced_model_agree(building: Building, make_plant: Make, drive: Make) -> None:
    on_grid = drive(make_plant(model=GridBuilding(Simulator(building, dx=1.0))))
    reduced = drive(make_plant())
    gap = np.abs(on_grid.record().zone_temperature - reduced.record().zone_temperature)
    assert gap.mean() < 0.005 and gap.max() < 0.05


@pytest.mark.parametrize("kind", ["reduced", "random"])
def test_a_seed_repeats_bit_for_bit(building: Building, make_plant: Make, kind: str) -> None:
    def run(seed: int) -> tuple[np.ndarray, np.ndarray]:
        model = None if kind == "reduced" else GridBuilding(Simulator(building, dx=1.0, shuffle="random"))
        plant = make_plant(model=model, noise=SensorNoise(), warm_up_days=0)
        plant.reset(seed)
        for _ in range(70):
            plant.step(plant.default_actions)
        return plant.telemetry().to_numpy(), plant.record().zone_temperature

    first, again, other = run(3), run(3), run(4)
    np.testing.assert_array_equal(first[0], again[0])
    np.testing.assert_array_equal(first[1], again[1])
    assert (first[0] != other[0]).any()
    assert (first[1] != other[1]).any() == (kind == "random")  # the office's people come by schedule


@pytest.mark.parametrize("kind", ["reduced", "random"])
def test_a_saved_state_returns_bit_for_bit(building: Building, make_plant: Make, kind: str) -> None:
    model = None if kind == "reduced" else GridBuilding(Simulator(building, dx=1.0, shuffle=Shuffle("random", seed=2)))
    plant = make_plant(model=model, noise=SensorNoise(), warm_up_days=0)
    plant.reset(5)
    warm = {name: value + 3.0 for name, value in plant.default_actions.items()}
    for _ in range(60):
        plant.step(plant.default_actions)
    saved = pickle.loads(pickle.dumps(plant.save_state()))
    for _ in range(20):
        plant.step(plant.default_actions)
    first = plant.telemetry()
    for _ in range(7):
        plant.step(warm)
    plant.restore_state(saved)
    assert plant.now == 60 and len(plant.telemetry()) == 60
    for _ in range(20):
        plant.step(plant.default_actions)
    np.testing.assert_array_equal(plant.telemetry().to_numpy(), first.to_numpy())


def test_what_was_measured_does_not_change_afterwards(make_plant: Make) -> None:
    """Measurements are read when they are asked for: another reset must not reach them."""
    plant = make_plant(noise=SensorNoise())
    plant.reset(1)
    seen = plant.step(plant.default_actions)
    row = plant.telemetry().to_numpy()[0]
    plant.reset(2)
    plant.step(plant.default_actions)
    np.testing.assert_array_equal(seen.values_array, row)


def test_a_control_step_has_the_mean_of_its_steps(make_plant: Make) -> None:
    plant = make_plant(control_steps=3)
    plant.reset()
    assert plant.control_step == 900.0
    seen = plant.step(plant.default_actions)
    np.testing.assert_allclose(seen.values_array, plant.telemetry().to_numpy().mean(axis=0))
    assert seen.stamp == plant.telemetry().index[-1]


def test_actions_are_refused_and_nothing_moves(make_plant: Make) -> None:
    plant = make_plant()
    with pytest.raises(PlantError, match=r"call reset\(\)"):
        plant.step(plant.default_actions)
    plant.reset()
    for value in (float("nan"), float("inf"), 400.0):
        with pytest.raises(PlantActionError, match="BOILER/supply_water_temperature_setpoint"):
            plant.step(plant.default_actions | {"BOILER/supply_water_temperature_setpoint": value})
    assert plant.now == 0


def test_the_end_of_the_scenario_is_the_end(make_plant: Make) -> None:
    plant = make_plant(control_steps=100)
    plant.reset()
    plant.step(plant.default_actions)
    plant.step(plant.default_actions)
    assert plant.finished
    with pytest.raises(PlantError, match="scenario: expected 100 more steps, found 88 of its 288"):
        plant.step(plant.default_actions)


def test_optional_setpoints_do_what_they_say(make_plant: Make, drive: Make, building: Building) -> None:
    """At noon: a higher zone setpoint warms the zone; less duct pressure needs less fan power."""
    zone = building.zone_names[0]
    plain = drive(make_plant(), 144)
    warm = drive(make_plant(), 144, {f"{zone}/zone_air_heating_temperature_setpoint": 296.15})
    assert warm.record().zone_temperature[-1, 0] > plain.record().zone_temperature[-1, 0] + 0.3
    handlers = ("AHU_F1", "AHU_F2")
    low = drive(make_plant(), 144, {f"{name}/supply_air_static_pressure_setpoint": 100.0 for name in handlers})
    fans = [p.telemetry().filter(like="supply_fan_power").to_numpy().sum() for p in (plain, low)]
    assert fans[1] < 0.8 * fans[0]
    slow = drive(make_plant(), 144, {"BOILER/differential_pressure_setpoint": 20_000.0})
    pumps = [p.telemetry()["BOILER/pump_power_sensor"].sum() for p in (plain, slow)]
    assert pumps[1] < 0.8 * pumps[0]


def test_hotter_water_never_makes_a_zone_colder_and_no_air_is_hotter_than_its_water(
    make_plant: Make, drive: Make
) -> None:
    """Before the sun is up, when zones are heated; a thermostat that has caught up sooner lets go sooner."""
    coldest = []
    for water in (312.0, 325.0, 340.0, 354.0):
        plant = drive(make_plant(), 72, {"BOILER/supply_water_temperature_setpoint": water})
        coldest.append(plant.record().zone_temperature[-1])
        for step in plant._steps:
            air = step.done.terminals
            assert (
                air.discharge <= np.maximum(step.done.results["BOILER"].supply_water_temperature, air.entering) + 1e-9
            ).all()
    assert np.diff(coldest, axis=0).min() > -0.1
    assert (coldest[-1] > coldest[0]).all()


def test_a_cold_building_is_heated_at_night(make_plant: Make, drive: Make, scenario: Callable[..., Scenario]) -> None:
    """Without a night cycle it cools through; with one the air handlers run for a while."""
    sc = replace(scenario(), heat=InternalGains(sensible=0.0, equipment=0.0, lights=0.0))
    warm = np.where(sc.lower < 290.0, 292.15, sc.lower)
    sc = replace(sc, lower=warm)
    nights = {}
    for cycle in (None, 0.5):
        plan = scheduled_operation(sc, 2, night_cycle=cycle)
        plant = drive(make_plant(sc, operation=plan), 50)
        nights[cycle] = (
            plant.record().zone_temperature[1:50].min(),
            max(s.actions["BOILER/boiler_running"] for s in plant._steps),
        )
    assert nights[None][1] == 0.0 and nights[0.5][1] == 1.0
    assert nights[0.5][0] > nights[None][0] + 0.2


def test_the_record_is_measured_by_the_indicators(make_plant: Make, drive: Make) -> None:
    """The sum of the economic reward's stage costs is the cost of energy and discomfort."""
    plant = drive(make_plant())
    record, kpis = plant.record(), measure_kpis(plant.record(), plant.scenario)
    cost = StageCost(2.0)
    t = record.zone_temperature
    assert record.gas is not None
    total = sum(
        float(cost.of_step(plant.scenario, k, t[k], t[k + 1], record.electricity[k], record.gas[k])) for k in range(288)
    )
    area = plant.scenario.floor_area
    assert total == pytest.approx(area * kpis.cost_tot + 2.0 * 12 * kpis.tdis_tot, rel=1e-9)
    assert 0.05 < kpis.ener_tot < 2.0


def test_a_run_is_a_case(tmp_path: pytest.TempPathFactory, make_plant: Make, drive: Make) -> None:
    plant = drive(make_plant(noise=SensorNoise()))
    path = save_case(plant.case(), str(tmp_path) + "/case")
    case = load_case(path)
    assert len(case.building.devices) == plant.devices.count == 16
    np.testing.assert_allclose(case.telemetry.frame[list(plant.columns)], plant.telemetry(), atol=1e-9)


def test_forecasts_need_a_forecaster(make_plant: Make, scenario: Callable[..., Scenario]) -> None:
    sc = scenario()
    plant = make_plant(sc, forecaster=Forecaster(sc, 12))
    plant.reset()
    plant.step(plant.default_actions)
    assert plant.forecast().table.index[0] == sc.grid.stamps[1]
    with pytest.raises(PlantError, match="forecaster"):
        make_plant().forecast()


def test_parts_that_do_not_fit_are_refused(
    make_plant: Make, scenario: Callable[..., Scenario], system: HvacSystem
) -> None:
    with pytest.raises(PlantError, match="step of 900 s"):
        make_plant(scenario(step=900.0))
    with pytest.raises(PlantError, match="control_steps"):
        make_plant(control_steps=0)
    with pytest.raises(PlantError, match="boundaries"):
        make_plant(boundaries={"attic": 290.0})
    with pytest.raises(PlantError, match="seed"):
        make_plant().reset(-1)
    with pytest.raises(PlantError, match="state"):
        make_plant().restore_state("here")
    with pytest.raises(PlantError, match="run: expected a step"):
        plant = make_plant()
        plant.reset()
        plant.record()
    with pytest.raises(PlantError, match="operation"):
        make_plant(operation=scheduled_operation(scenario(), 3))
