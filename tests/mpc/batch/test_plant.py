"""Plants stepped together do what each does alone: over a week, with noise, people and parameters of their own."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from calibration.estimation.disturbance import DisturbanceModel
from mpc.batch.alike import driven_by
from mpc.batch.inputs import plant_rows
from mpc.batch.plant import BatchedPlant
from mpc.errors import PlantActionError, PlantError
from mpc.kpi.kpis import measure_kpis
from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.occupancy import RandomOccupancy
from thermal import Building
from thermal.effects.catalogue import chosen
from thermal.pilot.building import pilot_building

EXACT, SINGLE = 1e-9, 1e-4  # K


@cache
def office() -> Building:
    return pilot_building(1, floor_area=200.0, zones=4, name="office")


def plant_of(start: str = "2023-01-09", days: int = 7, **options: Any) -> SimulatedPlant:
    weather = pilot_weather(1, start, days + 1.0)
    end = f"{start[:8]}{int(start[8:]) + days:02d}"
    given = {"dx": 1.0, "order": 30, "noise": SensorNoise(), **options}
    return simulated_plant(office(), weather, start, end, PlantSettings(**given))


def setpoints(plant: SimulatedPlant, steps: int, members: int) -> np.ndarray:
    """Random setpoints that are held for half an hour, shape (steps, n_action, member) [K]."""
    required = [a for a in plant.actuators if a.required]
    shares = np.random.default_rng(3).uniform(0.0, 1.0, (-(-steps // 6), len(required), members)).astype(np.float32)
    low, span = (np.array([[f(a)] for a in required]) for f in (lambda a: a.lowest, lambda a: a.highest - a.lowest))
    return np.repeat(low + span * shares, 6, axis=0)[:steps]


def follow(batch: BatchedPlant, which: list[int], seeds: list[int], steps: int, noisy: bool = True) -> float:
    """Largest difference of zone temperatures [K]; measurements are compared on the way."""
    plants = batch.plants
    asked = setpoints(plants[0], steps, batch.members)
    seen = [batch.reset(seeds, which).copy()]
    zones = []
    for row in asked:
        seen.append(batch.step(row).copy())
        zones.append(batch.zone_temperature)
    worst, tight = 0.0, batch.dtype == np.float64
    for member, (number, seed) in enumerate(zip(which, seeds, strict=True)):
        plant = plants[number]
        exact = [plant.reset(seed).values_array]
        exact += [plant.step(dict(zip(batch.actions, row[:, member].tolist(), strict=True))).values_array for row in asked]
        alone = plant.record().zone_temperature[1:]
        together = np.array(zones)[:, :, member]
        worst = max(worst, float(np.abs(alone - together).max()))
        if tight and noisy:  # in single precision a resolution of 0.02 K may count the other way
            np.testing.assert_allclose(np.array(seen)[:, :, member], np.array(exact), rtol=1e-8, atol=1e-7)
        kept = batch.record(member)
        np.testing.assert_allclose(kept.zone_temperature[1:], together, atol=1e-12)
        np.testing.assert_allclose(kept.electricity, plant.record().electricity, rtol=1e-3, atol=5.0)
    assert np.isfinite(worst)
    return worst


@pytest.mark.parametrize(("dtype", "bound"), [(np.float64, EXACT), pytest.param(np.float32, SINGLE, marks=pytest.mark.long)])
def test_a_week_is_that_of_the_single_plant(dtype: Any, bound: float) -> None:
    plant = plant_of()
    batch = BatchedPlant(plant, 3, dtype=dtype)
    assert follow(batch, [0, 0, 0], [0, 1, 5], 2016) <= bound
    member = batch.record(1)
    found = measure_kpis(member, plant.scenario).values
    plant.reset(1)
    for row in setpoints(plant, 2016, 3):
        plant.step(dict(zip(batch.actions, row[:, 1].tolist(), strict=True)))
    alone = measure_kpis(plant.record(), plant.scenario).values
    for name in ("tdis_tot", "cost_tot", "ener_tot", "pele_tot"):
        assert found[name] == pytest.approx(alone[name], rel=1e-3 if dtype is np.float32 else 1e-9, abs=1e-3)


def test_members_differ_in_weather_people_and_building() -> None:
    settings = {"occupancy": RandomOccupancy(3.0), "effects": chosen(["solar_gain"])}
    plants = [
        plant_of("2023-01-09", 2, parameters={"window_u_value": 1.5}, **settings),
        plant_of("2023-07-10", 2, parameters={"window_u_value": 3.0}, **settings | {"order": 26}),
    ]
    batch = BatchedPlant(plants, 4, dtype=np.float64)
    assert follow(batch, [0, 1, 1, 0], [3, 3, 4, 5], 300) <= EXACT
    batch.reset([3, 3, 3, 4], [0, 0, 1, 0])
    for row in setpoints(plants[0], 100, 1):
        batch.step(np.repeat(row, 4, axis=1))
    zone = batch.zone_temperature
    np.testing.assert_array_equal(zone[:, 0], zone[:, 1])
    assert np.abs(zone[:, 0] - zone[:, 2]).max() > 0.1 and np.abs(zone[:, 0] - zone[:, 3]).max() > 1e-3


def test_members_differ_in_what_was_found() -> None:
    """Each has the effects of its own building, in an order of its own; the others' have no part in it."""
    found = [], ["solar_gain"], ["ground_exchange", "solar_gain"]
    given = {"solar_heat_gain_coefficient": 0.5}, {"ground_u_value": 0.6}
    values = [{}, given[0], given[0] | given[1]]
    plants = [plant_of("2023-04-10", 2, effects=chosen(names), parameters=v) for names, v in zip(found, values, strict=True)]
    batch = BatchedPlant(plants, 3, dtype=np.float64)
    assert follow(batch, [0, 1, 2], [3, 4, 5], 300) <= EXACT
    batch.reset([3, 3, 3], [0, 1, 2])
    for row in setpoints(plants[0], 200, 1):
        batch.step(np.repeat(row, 3, axis=1))
    zone = batch.zone_temperature
    assert min(np.abs(zone[:, a] - zone[:, b]).max() for a, b in ((0, 1), (1, 2), (0, 2))) > 1e-3


def test_members_have_unmeasured_heat_of_their_own() -> None:
    plant = plant_of("2023-01-09", 1)
    heat = DisturbanceModel(np.full(4, 200.0), 7200.0, 0.03)
    plants = [plant_of("2023-01-09", 1, unmeasured=heat), plant]
    batch = BatchedPlant(plants, 3, dtype=np.float64)
    assert follow(batch, [0, 0, 1], [3, 4, 3], 200) <= EXACT
    zone = batch.zone_temperature
    assert np.abs(zone[:, 0] - zone[:, 1]).max() > 0.1


def test_members_may_start_anew_alone() -> None:
    plants = [plant_of("2023-01-09", 1), plant_of("2023-07-10", 1)]
    batch, rows = BatchedPlant(plants, 2, dtype=np.float64), setpoints(plants[0], 40, 2)
    batch.reset([1, 2], [0, 1])
    for row in rows[:25]:
        batch.step(row)
    batch.reset([7], [0], [1])
    for row in rows[25:]:
        batch.step(row)
    alone = plants[0]
    alone.reset(7)
    for row in rows[25:]:
        alone.step(dict(zip(batch.actions, row[:, 1].tolist(), strict=True)))
    np.testing.assert_allclose(batch.zone_temperature[:, 1], alone.record().zone_temperature[-1], atol=EXACT)
    np.testing.assert_allclose(batch.record(1).zone_temperature, alone.record().zone_temperature, atol=EXACT)


def test_setpoints_of_zones_may_be_actions() -> None:
    plant = plant_of(days=1)
    required = [a.name for a in plant.actuators if a.required]
    zone = plant.zone_names[1]
    names = [*required, f"{zone}/zone_air_heating_temperature_setpoint", f"{zone}/zone_air_cooling_temperature_setpoint"]
    batch = BatchedPlant(plant, 2, dtype=np.float64, actions=names)
    batch.reset([0, 1])
    plant.reset(1)
    for row in setpoints(plant, 120, 2):
        asked = np.vstack([row, np.full((1, 2), 295.5), np.full((1, 2), 295.0)])  # crossed: the heating one gives way
        batch.step(asked)
        plant.step(dict(zip(names, asked[:, 1].tolist(), strict=True)))
    np.testing.assert_allclose(batch.zone_temperature[:, 1], plant.record().zone_temperature[-1], atol=EXACT)


def test_what_does_not_fit_is_refused() -> None:
    plant = plant_of(days=1)
    batch = BatchedPlant(plant, 2)
    with pytest.raises(PlantError, match="reset"):
        batch.step(np.zeros((2, 2)))
    batch.reset([0, 1])
    with pytest.raises(PlantActionError, match="numbers from"):
        batch.step(np.full((len(batch.actions), 2), 200.0))
    with pytest.raises(PlantActionError, match="shape"):
        batch.step(np.zeros((1, 2)))
    with pytest.raises(PlantError, match="all members of one plant at once"):
        batch.reset([0], members=[1])
    with pytest.raises(PlantError, match="seeds of 0 or more"):
        batch.reset([-1, 0])
    with pytest.raises(PlantError, match="on a reduced building"):
        BatchedPlant(plant_of(days=1, kind="grid"), 2)
    for row in setpoints(plant, 288, 2):
        batch.step(row)
    with pytest.raises(PlantError, match="one more step"):
        batch.step(row)


def test_members_start_from_a_state_with_inputs_of_their_own() -> None:
    plant = plant_of(days=1, noise=None)
    rows = setpoints(plant, 60, 1)
    plant.reset(0)
    for row in rows[:24]:
        plant.step(dict(zip([a.name for a in plant.actuators if a.required], row[:, 0].tolist(), strict=True)))
    state, water = plant.model.modal_state, plant.loop.save().hvac.values[0]  # type: ignore[attr-defined]
    inputs = {name: values[24:60] for name, values in plant_rows(plant, driven_by(plant.model)).items()}
    batch = BatchedPlant(plant, 2, dtype=np.float64)
    batch.start(state, inputs, {"supply_water_temperature": water})
    np.testing.assert_allclose(batch.zone_temperature[:, 0], plant.record().zone_temperature[-1], atol=EXACT)
    for row in rows[24:]:
        plant.step(dict(zip(batch.actions, row[:, 0].tolist(), strict=True)))
        batch.step(np.repeat(row, 2, axis=1))
    apart = batch.record(1).zone_temperature[:37] - plant.record().zone_temperature[24:]
    assert np.abs(apart).max() < 0.1  # what local control had missed before is not part of the state
    assert np.ptp(plant.record().zone_temperature[24:], axis=0).max() > 1.0
    with pytest.raises(PlantError, match="order"):
        batch.start(state[1:], inputs, {})
