"""Effects in a plant get their signals: of the weather in advance, of air and heat as the loop runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mpc.batch.building import StepMatrices, driven_by
from mpc.errors import PlantError
from mpc.loop.building import zone_response
from mpc.loop.reduced import ReducedBuilding, reduced_building
from mpc.loop.signals import EffectSignals, scenario_inputs
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.scenario import Scenario
from thermal import Building, SymbolicModel, build_network
from thermal.case.building import Commanded
from thermal.effects.catalogue import chosen
from thermal.inputs.normalisation import Normalisation
from thermal.inputs.signals import signal_values
from thermal.model.reduce import reduced_model
from thermal.network.structure import Structure
from thermal.system.system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY


def test_what_the_weather_drives_is_known_in_advance(
    building: Building, system: HvacSystem, scenario: Callable[..., Scenario]
) -> None:
    effects, sc = chosen(["solar_gain", "infiltration"]), scenario()
    network = build_network(building, dx=1.0, effects=effects)
    signals = EffectSignals(network, sc, system)
    expected = signal_values(network.signals, scenario_inputs(sc))
    found = [signals.at(k, np.ones(12), np.ones(12), np.zeros(12)) for k in (0, 100, 150)]
    np.testing.assert_array_equal(found, expected[[0, 100, 150]])


def test_what_the_air_drives_is_of_the_step(
    building: Building, system: HvacSystem, scenario: Callable[..., Scenario]
) -> None:
    """A meter's gain has the step's heat, a biased sensor the step's air, a leak whether there is air."""
    zone = building.zone_names[2]
    effects = chosen({"flow_gain": (zone,), "sensor_bias": (zone,), "valve_leak": (zone,)})
    network = build_network(building, dx=1.0, effects=effects)
    signals = EffectSignals(network, scenario(), system)
    by_name = dict(
        zip([s.name for s in network.signals], signals.at(9, np.full(12, 0.2), np.full(12, 700.0), np.zeros(12)), strict=True)
    )
    assert by_name[f"heat of {zone}"] == 700.0
    assert by_name[f"supply air of {zone}"] == pytest.approx(0.2 * AIR_HEAT_CAPACITY)
    assert sorted(by_name.values())[0] == 1.0
    still = signals.at(9, np.zeros(12), np.zeros(12), np.zeros(12))
    assert np.count_nonzero(still) <= 1  # what is constant stays


def test_plants_of_many_members_pass_heat_on_by_the_secant_of_natural_convection(
    building: Building, system: HvacSystem, scenario: Callable[..., Scenario]
) -> None:
    network = build_network(building, dx=1.0, structure=Structure(natural_films=True))
    network = replace(network, normalisation=Normalisation(heat=dict.fromkeys(building.zone_names, 2500.0)))
    assert not EffectSignals(network, scenario(), system).in_advance().any()
    model = ReducedBuilding(reduced_model(SymbolicModel(network), [network.start()]))
    heat = np.full(12, 1200.0)
    matrices = StepMatrices.of(model, model.order, driven_by(model))
    assert matrices.response @ heat == pytest.approx(zone_response(model, heat) * heat, rel=1e-6)
    plain = reduced_building(building, dx=1.0)
    warmer = matrices.response @ heat > zone_response(plain, heat) * heat
    share = network.convective.sum(axis=0)  # of small rooms 1.2 kW is more than their films are for
    assert warmer.tolist() == (share < 0.0).tolist() and warmer.any() and not warmer.all()


def test_a_wrong_clock_is_refused(building: Building, system: HvacSystem, scenario: Callable[..., Scenario]) -> None:
    network = build_network(building, dx=1.0, effects=chosen(["clock_shift"]))
    with pytest.raises(PlantError, match="change of heat in .* leave that effect out"):
        EffectSignals(network, scenario(), system)


def test_a_meter_that_reads_too_little_warms_the_zone(
    building: Building, make_plant: Callable[..., SimulatedPlant], drive: Callable[..., SimulatedPlant]
) -> None:
    """True heat is 1.3 times the metered: the thermostats call for less, and the balance still closes."""
    names = {f"flow_gain@{zone}": 0.3 for zone in building.zone_names}
    model = reduced_building(building, names, dx=1.0, effects=chosen(["flow_gain"]))
    plain, leaky = drive(make_plant(), 90), drive(make_plant(model=model), 90)
    assert plain.case().zone_heat().iloc[60:].sum().sum() > leaky.case().zone_heat().iloc[60:].sum().sum()
    balance = leaky.balance()
    assert balance.flows.effects == pytest.approx(0.3 * balance.plant.zones)
    assert abs(balance.residual) < 1e-6 * balance.turnover


def test_a_biased_sensor_is_not_in_the_record(
    building: Building, make_plant: Callable[..., SimulatedPlant], drive: Callable[..., SimulatedPlant]
) -> None:
    """It says 1 K too much: the zone is kept 1 K too cold, and the record says so."""
    zone = building.zone_names[0]
    model = reduced_building(building, {f"sensor_bias@{zone}": 1.0}, dx=1.0, effects=chosen({"sensor_bias": (zone,)}))
    plant = drive(make_plant(model=model), 120)
    said = plant.telemetry()[f"VAV_{zone}/zone_air_temperature_sensor"].iloc[-1]
    assert said - plant.record().zone_temperature[-1, 0] == pytest.approx(1.0, abs=0.05)


def test_a_plant_gives_its_heat_itself_where_a_case_has_only_valves(
    building: Building, system: HvacSystem, scenario: Callable[..., Scenario]
) -> None:
    valve = Commanded("RAD", building.zone_names[0], "valve", ("RAD/valve",))
    told = replace(building, commanded=(valve,))
    network = build_network(told, dx=1.0)
    signals = EffectSignals(network, replace(scenario(), building=told), system)
    assert [s.name for s in network.signals] == ["valve of RAD"]
    assert signals.at(9, np.full(12, 0.2), np.full(12, 700.0), np.zeros(12)).tolist() == [0.0]
