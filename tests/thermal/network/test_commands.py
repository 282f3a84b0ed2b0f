"""Heat that no meter tells as part of a model: what reaches the zones, at once or through a heating system."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from thermal.case.building import Building, Commanded
from thermal.data import load_bundled_case
from thermal.model.matrices import SymbolicModel
from thermal.network.build import build_network
from thermal.network.commands import nominal_heat
from thermal.network.network import ThermalNetwork
from thermal.network.structure import Structure

VALVES = (Commanded("R1", "F1_N", "valve", ("R1/valve",)), Commanded("D1", "F1_S", "damper", ("D1/damper", "AHU/t")))
COUNTERS = tuple(
    Commanded(f"R_{zone}", zone, "counter", ("BOILER/gas_power_sensor",)) for zone in ("F1_N", "F1_S", "F1_C")
)


@pytest.fixture(scope="module")
def building() -> Building:
    return load_bundled_case().building


def heat_into(network: ThermalNetwork, signals: dict[str, float], **values: float) -> np.ndarray:
    """Heat of signals at nodes [W], shape (n_node,), with some parameters set."""
    theta = network.start()
    for i, p in enumerate(network.parameters):
        theta[i] = values.get(p.base, theta[i])
    m = SymbolicModel(network).matrices(theta)
    driven = -sp.csr_matrix(m.flow).toarray()[:, m.n + len(network.boundaries) :]
    return np.asarray(driven @ np.array([signals.get(s.name, 0.0) for s in network.signals]))


@pytest.mark.parametrize("lumped", [False, True])
def test_valve_and_damper_heat_the_air_of_their_zone(building: Building, lumped: bool) -> None:
    commanded = replace(building, commanded=VALVES)
    network = build_network(commanded, dx=1.0, structure=Structure(lumped=lumped))
    rooms = network.anatomy.rooms
    heat = heat_into(network, {"valve of R1": 0.5, "damper of D1": 8000.0}, valve_heat=80.0, damper_airflow=0.003)
    expected = {"F1_N": 40.0 * rooms["F1_N"].floor_area, "F1_S": 24.0 * rooms["F1_S"].floor_area}
    for zone, room in rooms.items():
        assert heat[room.air].sum() == pytest.approx(expected.get(zone, 0.0), rel=1e-12)
    assert heat.sum() == pytest.approx(sum(expected.values()), rel=1e-12)


@pytest.mark.parametrize("lumped", [False, True])
def test_a_counter_heats_a_system_that_heats_its_zones(building: Building, lumped: bool) -> None:
    network = build_network(replace(building, commanded=COUNTERS), dx=1.0, structure=Structure(lumped=lumped))
    (node,) = np.flatnonzero(network.kind == "heating_system")
    heat = heat_into(network, {"counter of BOILER": 9000.0}, boiler_efficiency=0.9)
    assert heat[node] == pytest.approx(8100.0) and np.count_nonzero(heat) == 1
    # at rest all of it goes to the zones, by their couplings and areas; the lag is capacity over coupling
    m = SymbolicModel(network).matrices(network.start())
    flow = sp.csr_matrix(m.flow).toarray()
    coupled, areas = -flow[node, : m.n], {z: r.floor_area for z, r in network.anatomy.rooms.items()}
    served = sum(areas[own.zone] for own in COUNTERS)
    for own in COUNTERS:
        share = coupled[network.anatomy.rooms[own.zone].air].sum() / flow[node, node]
        assert share == pytest.approx(areas[own.zone] / served, rel=1e-9)
    capacity = sp.csr_matrix(m.capacity).diagonal()[node]
    assert capacity / flow[node, node] == pytest.approx(10000.0 / 2.0, rel=1e-9)


def test_a_building_without_is_what_it_was(building: Building) -> None:
    assert build_network(building, dx=1.0).signals == ()


def test_nominal_heat_is_that_at_the_starts_of_the_parameters() -> None:
    signals = np.array([[0.5, 8000.0], [1.0, 0.0]])
    heat = nominal_heat(VALVES, signals, {"F1_N": 20.0, "F1_S": 10.0})
    assert heat["F1_N"] == pytest.approx([600.0, 1200.0])
    assert heat["F1_S"] == pytest.approx([320.0, 0.0])
    areas = {"F1_N": 20.0, "F1_S": 10.0, "F1_C": 30.0}
    counted = nominal_heat(COUNTERS, np.full((1, 3), 6000.0), areas)
    assert {zone: float(q[0]) for zone, q in counted.items()} == {"F1_N": 2000.0, "F1_S": 1000.0, "F1_C": 3000.0}
