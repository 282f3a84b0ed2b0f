"""A fault in one sub-system is found there, and nowhere else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from mpc.errors import MpcError
from mpc.loop.noise import SensorNoise
from mpc.loop.reduced import ReducedBuilding, reduced_building
from mpc.loop.simulated import SimulatedPlant
from mpc.loop.subsystem_replay import SubsystemReplay, replay_subsystems
from mpc.scenario.gains import InternalGains
from mpc.scenario.scenario import Scenario
from thermal import Building, Case, SymbolicModel, Telemetry, build_network, reduced_model
from thermal.components.terminals import Terminals
from thermal.components.water_coil import WaterCoil
from thermal.effects.catalogue import chosen
from thermal.system.system import HvacSystem, vav_system

AIR, WATER = "supply_air_temperature_setpoint", "supply_water_temperature_setpoint"
NO_GAINS = InternalGains(sensible=0.0, latent=0.0, equipment=0.0, lights=0.0)
SICK = 3  # number of the zone with the fault
Change = Callable[[pd.DataFrame], None]


class Leaky(Terminals):
    """Terminals of which one's valve never closes; on its command the building still sees it close."""

    def throttled(self, ops, call, rate, conductance, allowance):  # type: ignore[no-untyped-def]
        """Let 15 % of the heat through at least."""
        wanted = super().throttled(ops, call, rate, conductance, allowance)
        return np.where(np.arange(len(wanted)) == SICK, np.maximum(wanted, 0.15 * conductance), wanted)


class Lab:
    """The office, its plant as it is thought to be, and runs of it with a fault."""

    def __init__(
        self, building: Building, system: HvacSystem, reduced: ReducedBuilding, scenario: Callable[..., Scenario]
    ) -> None:
        self.building, self.system, self._reduced = building, system, reduced
        self._idle, self._busy = scenario(4, gains=NO_GAINS), scenario(4)
        self.sick = building.zone_names[SICK]
        grid = SymbolicModel(build_network(building, dx=1.0))
        self.model = reduced_model(grid, [grid.network.start()])

    def run(
        self,
        system: HvacSystem | None = None,
        building: ReducedBuilding | None = None,
        setpoints: dict[str, float] | None = None,
        change: Change | None = None,
        gains: bool = False,
        pressures: bool = False,
    ) -> tuple[Case, SimulatedPlant]:
        """Four winter days of telemetry, with noise; nobody gives off heat unless there are to be gains."""
        plant = SimulatedPlant(
            self._busy if gains else self._idle, system or self.system, building or self._reduced, noise=SensorNoise(),
            pressures=pressures,
        )  # fmt: skip
        plant.reset()
        kinds = setpoints or {}
        actions = plant.default_actions | {
            a.name: kinds[kind] for a in plant.actuators if (kind := a.name.rpartition("/")[2]) in kinds
        }
        while not plant.finished:
            plant.step(actions)
        frame = plant.telemetry()
        if change is not None:
            change(frame)
        return Case(self.building, Telemetry.from_frame(frame)), plant

    def find(
        self,
        system: HvacSystem | None = None,
        building: ReducedBuilding | None = None,
        setpoints: dict[str, float] | None = None,
        change: Change | None = None,
    ) -> SubsystemReplay:
        """Replay such a run against what the plant is thought to be."""
        case, plant = self.run(system, building, setpoints, change)
        return replay_subsystems(case, self.system, self.model, ventilation=plant.operation.ventilation)


@pytest.fixture(scope="module")
def lab(
    building: Building, system: HvacSystem, reduced_office: ReducedBuilding, scenario: Callable[..., Scenario]
) -> Lab:
    return Lab(building, system, reduced_office, scenario)


def test_without_a_fault_nothing_is_found(lab: Lab) -> None:
    found = lab.find()
    assert not found.located
    assert "no sub-system is off" in found.sentence
    assert set(found.table()["subsystem"]) == {"terminal", "air handler", "hot water", "zone"}
    assert found.hours == 96


def test_a_leaking_valve_is_in_its_terminal(lab: Lab) -> None:
    name = f"VAV_{lab.sick}"
    leaky = lab.system.having(VAV=Leaky(**vars_of(lab.system.terminals)))

    def closed(frame: pd.DataFrame) -> None:
        idle = frame[f"{name}/zone_air_temperature_sensor"] > frame[f"{name}/zone_air_heating_temperature_setpoint"]
        frame.loc[idle, f"{name}/heating_water_valve_percentage_command"] = 0.0

    case, plant = lab.run(leaky, change=closed, gains=True)
    found = replay_subsystems(case, lab.system, ventilation=plant.operation.ventilation)
    assert [gap.device for gap in found.located] == [name]
    assert found.located[0].signal == "discharge temperature" and found.located[0].bias < 0.0
    assert name in found.sentence


def test_a_fouled_reheat_coil_is_in_its_terminal(lab: Lab) -> None:
    terminals = lab.system.terminals
    films = {f: np.where(np.arange(12) == SICK, 0.3, 1.0) * getattr(terminals, f) for f in ("air_film", "water_film")}
    found = lab.find(lab.system.having(VAV=replace(terminals, **films)))
    assert [gap.device for gap in found.located] == [f"VAV_{lab.sick}"]


def test_a_fouled_heating_coil_is_in_its_air_handler(lab: Lab) -> None:
    """Supply air at 24 degC on winter mornings: the coil of the first air handler has a tenth of its films."""
    handlers = list(lab.system.air_handlers)
    coil = handlers[0].heating
    assert isinstance(coil, WaterCoil)
    fouled = replace(coil, air_conductance=0.1 * coil.air_conductance, water_conductance=0.1 * coil.water_conductance)
    handlers[0] = replace(handlers[0], heating=fouled)
    found = lab.find(vav_system(handlers, lab.system.loop, lab.system.terminals), setpoints={AIR: 297.15})
    assert {(g.subsystem, g.device) for g in found.located} == {("air handler", "AHU_F1")}
    assert found.located[0].signal == "supply air temperature"


def test_a_stuck_economiser_is_in_its_air_handler(lab: Lab) -> None:
    handlers = list(lab.system.air_handlers)
    handlers[1] = replace(handlers[1], minimum_outdoor_share=0.9)
    found = lab.find(vav_system(handlers, lab.system.loop, lab.system.terminals))
    assert {(g.device, g.signal) for g in found.located} == {("AHU_F2", "mixed air temperature")}


def test_a_boiler_that_is_off_its_setpoint_is_in_the_hot_water(lab: Lab) -> None:
    def offset(frame: pd.DataFrame) -> None:
        frame[f"BOILER/{WATER}"] -= 4.0

    found = lab.find(change=offset)
    assert {(g.subsystem, g.device) for g in found.located} == {("hot water", "BOILER")}
    assert found.located[0].bias == pytest.approx(-4.0, abs=0.5)


def test_a_boiler_that_wastes_gas_is_in_the_hot_water(lab: Lab) -> None:
    worn = replace(lab.system.loop, efficiency=0.75 * lab.system.loop.efficiency)
    found = lab.find(lab.system.having(BOILER=worn))
    assert {(g.device, g.signal) for g in found.located} == {("BOILER", "gas power")}
    assert found.located[0].bias < 0.0  # a sound one would burn less


def test_pressures_off_their_design_are_no_fault_where_they_are_measured(lab: Lab) -> None:
    pressures = {"supply_air_static_pressure_setpoint": 100.0, "differential_pressure_setpoint": 30_000.0}
    for measured in (False, True):
        case, plant = lab.run(setpoints=pressures, pressures=measured)
        found = replay_subsystems(case, lab.system, ventilation=plant.operation.ventilation)
        assert (not found.located) == measured


def test_what_the_building_model_lacks_is_in_the_zones(lab: Lab) -> None:
    zone = lab.sick
    leaky = reduced_building(
        lab.building, {f"valve_leak@{zone}": 12.0}, dx=1.0, effects=chosen({"valve_leak": (zone,)})
    )
    found = lab.find(building=leaky)
    assert {(g.subsystem, g.device) for g in found.located} == {("zone", zone)}
    assert found.located[0].bias > 0.0  # the model needs heat that nobody metered


def test_without_a_model_zones_are_left_out(lab: Lab) -> None:
    case, plant = lab.run()
    found = replay_subsystems(case, lab.system, ventilation=plant.operation.ventilation)
    assert "zone" not in set(found.table()["subsystem"])


def test_what_is_missing_is_named(lab: Lab) -> None:
    case, _ = lab.run()
    lacking = case.telemetry.frame.drop(columns="BOILER/supply_water_temperature_sensor")
    with pytest.raises(MpcError, match="'BOILER/supply_water_temperature_sensor'"):
        replay_subsystems(Case(case.building, Telemetry.from_frame(lacking)), lab.system)
    with pytest.raises(MpcError, match="a day of telemetry"):
        replay_subsystems(case.slice(end="2023-01-09T12:00"), lab.system)
    with pytest.raises(MpcError, match="tolerance"):
        replay_subsystems(case, lab.system, tolerance=2.0)


def vars_of(terminals: Terminals) -> dict[str, object]:
    """Fields of terminals."""
    return {name: getattr(terminals, name) for name in Terminals.__dataclass_fields__}
