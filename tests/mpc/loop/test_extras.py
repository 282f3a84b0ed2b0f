"""Every effect of the catalogue in a plant, and gains that radiate."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from mpc.errors import PlantError
from mpc.loop.make import PlantKind, PlantSettings, pilot_weather, simulated_plant
from mpc.loop.reduced import reduced_building
from mpc.loop.signals import RadiantGains
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.gains import RADIANT_SHARES, InternalGains
from mpc.scenario.occupancy import RandomOccupancy
from mpc.scenario.weather import Weather
from thermal import Building, build_network
from thermal.effects.catalogue import CATALOGUE, chosen, effect_of
from thermal.effects.unknown import UNKNOWN
from thermal.errors import EffectError
from thermal.inputs.provider import telemetry_inputs
from thermal.inputs.signals import signal_values
from thermal.pilot.building import pilot_building
from thermal.system.sizing import size_system
from thermal.system.system import HvacSystem

#: Effects that a plant cannot have, and what is said.
REFUSED = {"clock_shift": "leave that effect out", "neighbour": "every side has windows"}
#: Heat that the day of these runs, a Monday, has none of.
ON_OTHER_DAYS = {"heat_at_weekends"}
#: Effects that only show where a terminal is driven hard.
AT_FULL_LOAD = {"capacity_limit"}
STEPS = 192


@cache
def house() -> Building:
    """Four zones on two floors."""
    return pilot_building(3, floor_area=240.0, zones=4, floors=2)


@cache
def sized() -> HvacSystem:
    return size_system(house())


@cache
def spring() -> Weather:
    return pilot_weather(1, "2023-04-10", 1.0)


def strengths(ids: tuple[str, ...]) -> dict[str, float]:
    """Each effect's strengths at the ends of their ranges, its shapes in the middle."""
    network = build_network(house(), dx=1.0, effects=chosen(list(ids)))
    lead = {e.parameters[0].name for e in (CATALOGUE | UNKNOWN).values()}
    return {p.name: p.upper if p.name.split("@")[0] in lead else p.start for p in network.parameters if p.effect in ids}


def run(
    ids: tuple[str, ...] = (), model: PlantKind = "reduced", hard: bool = False, **options: object
) -> SimulatedPlant:
    """Most of a spring day, energy closing at every step; driven hard, with all zones called to 26 degC."""
    values = strengths(ids) if ids else None
    settings = PlantSettings(
        kind=model, dx=1.0, system=sized(), parameters=values, effects=chosen(list(ids)), warm_up_days=0,
        **options,  # type: ignore[arg-type]
    )  # fmt: skip
    plant = simulated_plant(house(), spring(), "2023-04-10", "2023-04-11", settings)
    plant.reset()
    kind = "heating_temperature_setpoint"
    extra = {a.name: 299.0 for a in plant.actuators if a.name.endswith(kind)} if hard else {}
    for _ in range(STEPS):
        plant.step(plant.default_actions | extra)
        balance = plant.balance()
        assert abs(balance.residual) < 1e-9 * balance.turnover
    return plant


@cache
def plain(model: PlantKind = "reduced") -> np.ndarray:
    return run(model=model).record().zone_temperature


@pytest.mark.parametrize("name", [i for i in CATALOGUE | UNKNOWN if i not in REFUSED.keys() | ON_OTHER_DAYS])
def test_an_effect_that_is_on_moves_the_zones_and_energy_closes(name: str) -> None:
    hard, others = name in AT_FULL_LOAD, effect_of(name).requires
    plant = run((*others, name), hard=hard)
    before = run(others, hard=hard).record().zone_temperature if others or hard else plain()
    assert np.abs(plant.record().zone_temperature - before).max() > 0.01


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_an_effect_that_means_nothing_here_is_refused_by_name(name: str) -> None:
    with pytest.raises(PlantError, match=REFUSED[name]):
        run((name,))


def test_the_grid_has_them_too() -> None:
    ids = ("solar_gain", "infiltration", "window_opening", "zone_mixing", "valve_leak", "duct_loss", "sensor_bias")
    apart = run(ids).record().zone_temperature - run(ids, "grid").record().zone_temperature
    assert np.abs(apart).max() < 0.02


def test_open_doors_bring_zones_together() -> None:
    """Two rooms of a floor whose setpoints are 4 K apart end less far apart with the doors open."""
    first, second = house().zone_names[:2]
    apart = []
    for ids in ((), ("zone_mixing",)):
        values = strengths(ids) if ids else None
        settings = PlantSettings(dx=1.0, system=sized(), effects=chosen(list(ids)), parameters=values, warm_up_days=0)
        plant = simulated_plant(house(), spring(), "2023-04-10", "2023-04-11", settings)
        plant.reset()
        kind = "zone_air_heating_temperature_setpoint"
        for _ in range(150):
            plant.step(plant.default_actions | {f"{first}/{kind}": 297.0, f"{second}/{kind}": 291.0})
        apart.append(float(np.diff(plant.record().zone_temperature[-1, :2])[0]))
    assert abs(apart[1]) < 0.8 * abs(apart[0])


def test_other_people_open_other_windows() -> None:
    """After a reset with a seed, effects that follow people follow those of that seed; the first again is the first."""
    settings = PlantSettings(
        dx=1.0, system=sized(), warm_up_days=1, effects=chosen(["internal_gains"]), parameters={"internal_gain": 20.0},
        occupancy=RandomOccupancy(3),
    )  # fmt: skip
    plant = simulated_plant(house(), spring(), "2023-04-10", "2023-04-11", settings)
    ends = []
    for seed in (1, 2, 1):
        plant.reset(seed)
        flows = []
        for _ in range(150):
            plant.step(plant.default_actions)
            flows.append(plant.balance().flows.effects)
        ends.append((np.array(flows), plant.record().zone_temperature))
    assert not np.allclose(ends[0][0], ends[1][0])
    assert np.array_equal(ends[0][0], ends[2][0]) and np.array_equal(ends[0][1], ends[2][1])


@pytest.mark.parametrize("model", ["reduced", "grid"])
def test_gains_that_radiate_move_heat_from_air_to_surfaces(model: PlantKind) -> None:
    plant = run(model=model, gains=InternalGains(**RADIANT_SHARES))
    assert abs(plant.balance().flows.effects) < 1e-9  # what goes to the surfaces does not go to the air
    if model == "grid":
        other = run(gains=InternalGains(**RADIANT_SHARES)).record().zone_temperature
        assert np.abs(plant.record().zone_temperature - other).max() < 0.01


def test_the_radiant_node_gets_what_radiates() -> None:
    """In the step that gains begin, air rises by what convects, and by no more than a little of what radiates."""
    rises = []
    for share in (0.0, 0.5, 1.0):
        model = reduced_building(house(), dx=1.0, effects=(RadiantGains(),))
        zones, outside = np.full(4, 293.15), np.array([285.15])
        start = model.reset(zones, outside, np.zeros(4))
        heat = np.full(4, 1000.0)
        free = model.begin(np.zeros(4), outside, np.zeros(4))
        moved = model.begin(heat, outside, share * heat)
        rises.append(moved - free)
        assert start == pytest.approx(zones)
    assert np.allclose(rises[1], 0.5 * (rises[0] + rises[2]))  # linear
    assert (rises[2] < 0.5 * rises[0]).all() and (rises[2] > 0.0).all()


def test_a_building_without_them_is_refused() -> None:
    plant = run(gains=InternalGains(**RADIANT_SHARES))
    with pytest.raises(PlantError, match=r"takes gains that radiate, found gains to air only; .*RadiantGains"):
        SimulatedPlant(plant.scenario, sized(), reduced_building(house(), dx=1.0))


def test_telemetry_does_not_know_what_radiates() -> None:
    network = build_network(house(), dx=1.0, effects=(RadiantGains(),))
    with pytest.raises(EffectError, match="those of a plant's scenario, found telemetry.*internal_gains"):
        signal_values(network.signals, telemetry_inputs(run().case()))
