"""A plant seen through another building's points: alone, in an environment, and many at once."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="needs the extra [rl]")

from mpc.environment.environment import ControlEnvironment
from mpc.environment.office import Office, office_plants
from mpc.environment.vector import VectorEnvironment
from mpc.errors import PlantError
from mpc.loop.make import PlantSettings
from mpc.loop.noise import SensorNoise
from mpc.loop.simulated import SimulatedPlant
from mpc.loop.view import PointView, ViewedPlant


def small() -> SimulatedPlant:
    settings = PlantSettings(dx=1.0, order=30, noise=SensorNoise(), control_steps=2, horizon=144)
    return office_plants(Office(zones=4, floor_area=200.0), settings, ("2023-01-09",), 1)[0]


def seen_as(plant: SimulatedPlant) -> ViewedPlant:
    """Zones as they are, the air of all terminals as that of one, a room whose temperature nobody simulates."""
    zones = [c for c in plant.columns if c.endswith("zone_air_temperature_sensor")]
    flows = [k for k, c in enumerate(plant.columns) if c.endswith("supply_air_flowrate_sensor")]
    columns = (*zones, "air_handler/supply_air_flowrate_sensor", "plenum/zone_air_temperature_sensor")
    matrix = np.zeros((len(columns), len(plant.columns)))
    matrix[range(len(zones)), [plant.columns.index(c) for c in zones]] = 1.0
    matrix[len(zones), flows] = 1.0
    water = next(a.name for a in plant.actuators if a.name.endswith("supply_water_temperature_setpoint"))
    constant = np.zeros(len(columns))
    constant[-1] = 293.15
    air = [a for a in plant.actuators if a.name.endswith("supply_air_temperature_setpoint")]
    return ViewedPlant(plant, PointView(columns, matrix, constant, {water: 330.0}), air)


def test_what_is_seen_is_made_of_what_the_plant_measures() -> None:
    plant, view = small(), seen_as(small())
    air = {a.name: 288.0 for a in view.actuators}
    plant.reset(1)
    view.reset(1)
    for _ in range(60):
        own, seen = plant.step({**air, **view.view.held}), view.step(air)
    flows = [own[c] for c in own if c.endswith("supply_air_flowrate_sensor")]
    assert seen["air_handler/supply_air_flowrate_sensor"] == pytest.approx(sum(flows)) and sum(flows) > 0.1
    assert seen["plenum/zone_air_temperature_sensor"] == 293.15 and len(seen) == len(view.columns) == 6
    assert all(seen[c] == own[c] for c in seen if c in own)
    np.testing.assert_array_equal(view.record().electricity, plant.record().electricity)
    assert view.finished == plant.finished and view.forecast().table.equals(plant.forecast().table)


def test_many_are_seen_as_one_is() -> None:
    world = ControlEnvironment(seen_as(small()), actions=["supply_air_temperature_setpoint"])
    many = VectorEnvironment(world, 3, dtype=np.float64)
    alone, _ = world.reset(seed=4)
    together, _ = many.reset(seed=4)
    assert together.shape == (3, len(world.layout)) and world.action_space.shape == (1,)
    for actions in np.random.default_rng(0).uniform(-1.0, 1.0, (50, 3, 1)).astype(np.float32):
        np.testing.assert_allclose(together[0], alone, atol=2e-6)
        alone, reward, *_ = world.step(actions[0])
        together, rewards, *_ = many.step(actions)
        assert rewards[0] == pytest.approx(reward, rel=1e-9, abs=1e-12)


def test_a_view_of_another_plant_is_refused() -> None:
    plant = small()
    view = seen_as(plant).view
    with pytest.raises(PlantError, match="matrix and constant of shapes"):
        ViewedPlant(plant, PointView(view.columns, view.matrix[:, 1:], view.constant, {}), ())
    with pytest.raises(PlantError, match="an actuator of the plant"):
        ViewedPlant(plant, PointView(view.columns, view.matrix, view.constant, {"boiler/temperature": 300.0}), ())
    other = seen_as(plant)
    moved = ViewedPlant(plant, PointView(view.columns, view.matrix, view.constant + 1.0, view.held), other.actuators)
    world = ControlEnvironment((other, moved), actions=["supply_air_temperature_setpoint"])
    with pytest.raises(PlantError, match="the view of plant 0"):
        VectorEnvironment(world, 2)
