"""Chains of nodes through layers, against the exact slab: matrices of ISO 13786 with complex hyperbolic functions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import Building, Structure, SymbolicModel, ThermalNetwork, ZoneTable, build_network
from thermal.case.building import Layer, Location, Surface, ZoneEntry
from thermal.network.table import Chain

SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Etc/GMT-1")
PERIODS = {"a day": 86400.0, "six hours": 21600.0, "an hour": 3600.0}


def layer(thickness: float, conductivity: float, density: float, heat_capacity: float) -> Layer:
    return Layer(thickness=thickness, conductivity=conductivity, density=density, heat_capacity=heat_capacity)


CONSTRUCTIONS = {
    "brick": (layer(0.3, 0.5, 1500.0, 1000.0),),
    "insulated": (layer(0.02, 0.7, 1400.0, 900.0), layer(0.2, 1.4, 2300.0, 1000.0), layer(0.15, 0.035, 20.0, 1450.0)),
    "light": (layer(0.0125, 0.25, 900.0, 1000.0), layer(0.1, 0.04, 30.0, 1000.0), layer(0.02, 0.13, 500.0, 1600.0)),
}


def resistance_of(layers: tuple[Layer, ...]) -> float:
    return sum(p.thickness / p.conductivity for p in layers)


def capacity_of(layers: tuple[Layer, ...]) -> float:
    return sum(p.thickness * p.density * p.heat_capacity for p in layers)


def heat_matrix(layers: tuple[Layer, ...], s: complex) -> NDArray[np.complex128]:
    """From temperature and heat flow at the last face to those at the first, at the Laplace variable s."""
    total = np.eye(2, dtype=complex)
    for p in layers:
        heat, r = p.thickness * p.density * p.heat_capacity, p.thickness / p.conductivity
        a = np.sqrt(s * heat * r)
        total = total @ np.array([[np.cosh(a), r / a * np.sinh(a)], [a / r * np.sinh(a), np.cosh(a)]])
    return total


def exact(layers: tuple[Layer, ...], s: complex, inside: float, outside: float) -> complex:
    """Heat into a wall per kelvin of the room's air, films on both sides, outdoor at rest [W/m2/K]."""
    film = np.array([[1.0, 1.0 / inside], [0.0, 1.0]]), np.array([[1.0, 1.0 / outside], [0.0, 1.0]])
    total = film[0] @ heat_matrix(layers, s) @ film[1]
    return complex(total[1, 1] / total[0, 1])


def room(layers: tuple[Layer, ...], structure: Structure) -> ThermalNetwork:
    """One room with one square metre of wall."""
    surface = Surface(name="W", kind="wall", zone="R", other="outdoor", area=1.0, azimuth=0.0, construction="wall")
    table = ZoneTable((ZoneEntry(name="R", volume=30.0, floor_area=10.0),), (surface,), {"wall": layers})
    return build_network(Building("room", SITE, 0.0, table), structure=structure)


def admittance(network: ThermalNetwork, s: complex) -> complex:
    """Heat that leaves the air of one room per kelvin of it, everything else free."""
    m = SymbolicModel(network).matrices(network.start())
    system = m.flow[:, : m.n].toarray() + s * m.capacity.toarray()
    air, rest = network.kind == "air", network.kind != "air"
    states = np.linalg.solve(system[np.ix_(rest, rest)], -system[np.ix_(rest, air)])
    flow = m.flow[:, : m.n].toarray()
    return complex((flow[np.ix_(air, air)] + flow[np.ix_(air, rest)] @ states)[0, 0])


def error(layers: tuple[Layer, ...], nodes: int | None, period: float) -> float:
    """Relative error of the admittance of a wall of so many nodes."""
    s = 2j * np.pi / period
    network = room(layers, Structure(furniture=False, wall_nodes=nodes, radiant=False))
    films = {p.name: p.start for p in network.parameters}
    wanted = exact(layers, s, films["combined_film_coefficient"], films["exterior_convection_coefficient"])
    return abs(admittance(network, s) - wanted) / abs(wanted)


@pytest.mark.parametrize("nodes", [None, 1, 2, 3, 7, 100])
@pytest.mark.parametrize("name", CONSTRUCTIONS)
def test_chain_keeps_resistance_capacity_and_the_heat_of_every_steady_state(name: str, nodes: int | None) -> None:
    layers = CONSTRUCTIONS[name]
    found = Chain.of(layers, nodes)
    places = np.cumsum([found.near, *found.between])
    total = resistance_of(layers)
    assert places[-1] + found.far == pytest.approx(total, rel=1e-12)
    assert found.capacity.sum() == pytest.approx(capacity_of(layers), rel=1e-12)
    assert (found.capacity > 0).all()
    assert (np.diff([0.0, *places, total]) > 0).all()
    before, held = 0.0, 0.0  # first face at 0, last at 1: each layer at the temperature of its middle
    for p in layers:
        r = p.thickness / p.conductivity
        held += p.thickness * p.density * p.heat_capacity * (before + 0.5 * r) / total
        before += r
    assert found.capacity @ places / total == pytest.approx(held, rel=1e-12)


def test_nodes_of_one_layer_stand_in_the_middle_of_equal_parts() -> None:
    """0.3 m of brick in three: 0.2 m2K/W and 150 kJ/m2/K each."""
    found = Chain.of(CONSTRUCTIONS["brick"], 3)
    assert (found.near, found.far) == (pytest.approx(0.1), pytest.approx(0.1))
    np.testing.assert_allclose(found.between, [0.2, 0.2], rtol=1e-12)
    np.testing.assert_allclose(found.capacity, [1.5e5] * 3, rtol=1e-12)


def test_parts_of_a_layered_wall_take_heat_equally_long() -> None:
    """Layers of 1 and 2 in the root of seconds times metres: the cut in the middle of two lies in the second."""
    layers = (layer(1.0, 1.0, 1.0, 1.0), layer(1.0, 1.0, 1.0, 4.0))
    found = Chain.of(layers, 2)
    # the first part is 1 m of the first layer and 0.25 m of the second, 1 + 1 J/m2/K about 0.5 and 1.125 m2K/W
    np.testing.assert_allclose(found.capacity, [2.0, 3.0], rtol=1e-12)
    assert found.near == pytest.approx((0.5 + 1.125) / 2.0)
    assert found.far == pytest.approx(0.375)


@pytest.mark.parametrize("name", CONSTRUCTIONS)
@pytest.mark.parametrize("nodes", [None, 1, 2, 3])
def test_steady_conductance_is_that_of_the_layers(name: str, nodes: int | None) -> None:
    layers = CONSTRUCTIONS[name]
    network = room(layers, Structure(furniture=False, wall_nodes=nodes, radiant=False))
    values = {p.name: p.start for p in network.parameters}
    films = 1.0 / values["combined_film_coefficient"] + 1.0 / values["exterior_convection_coefficient"]
    assert admittance(network, 0.0) == pytest.approx(1.0 / (films + resistance_of(layers)), rel=1e-12)


@pytest.mark.parametrize("period", PERIODS.values(), ids=list(PERIODS))
def test_admittance_of_one_layer_converges_in_second_order(period: float) -> None:
    errors = [error(CONSTRUCTIONS["brick"], n, period) for n in (16, 32, 64)]
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2.0, atol=0.06)
    assert errors[-1] < 0.003


@pytest.mark.parametrize("name", ["insulated", "light"])
@pytest.mark.parametrize("period", PERIODS.values(), ids=list(PERIODS))
def test_admittance_of_layers_converges(name: str, period: float) -> None:
    errors = [error(CONSTRUCTIONS[name], n, period) for n in (1, 4, 16, 64)]
    assert (np.diff(errors) < 0).all()
    assert errors[-1] < 0.002


@pytest.mark.parametrize("name", CONSTRUCTIONS)
def test_sublayers_of_half_an_hour_follow_the_hours(name: str) -> None:
    """What the automatic number of nodes is for: 2.5 % of the admittance at six hours, 1 % at a day."""
    assert error(CONSTRUCTIONS[name], None, 21600.0) < 0.025
    assert error(CONSTRUCTIONS[name], None, 86400.0) < 0.01


def test_step_response_is_that_of_the_exact_slab() -> None:
    """Heat into a wall after its room's air rose by 1 K, from its poles and from numerical inversion of the exact one."""
    layers = CONSTRUCTIONS["brick"]
    network = room(layers, Structure(furniture=False, wall_nodes=40, radiant=False))
    m = SymbolicModel(network).matrices(network.start())
    rest = network.kind != "air"
    capacity = m.capacity.diagonal()[rest]
    flow = m.flow[:, : m.n].toarray()
    scaled = flow[np.ix_(rest, rest)] / np.sqrt(np.outer(capacity, capacity))
    rates, modes = np.linalg.eigh(scaled)
    drive = modes.T @ (flow[np.ix_(rest, ~rest)][:, 0] / np.sqrt(capacity))
    conductance = flow[~rest][:, ~rest][0, 0]
    for time in (1800.0, 7200.0, 43200.0):
        found = conductance - float(drive**2 @ ((1.0 - np.exp(-rates * time)) / rates))
        # Talbot's contour (Abate and Whitt 2006, doi:10.1287/ijoc.1050.0137)
        count = 24
        angle = np.pi * np.arange(1, count) / count
        cot = 1.0 / np.tan(angle)
        at = np.concatenate([[0.4 * count + 0j], 0.4 * np.pi * np.arange(1, count) * (cot + 1j)])
        weight = np.concatenate(
            [[0.2 * np.exp(at[0])], 0.4 * (1 + 1j * angle * (1 + cot**2) - 1j * cot) * np.exp(at[1:])]
        )
        wanted = sum(
            (w * exact(layers, s / time, 7.7, 20.0) / (s / time)).real for w, s in zip(weight, at, strict=True)
        )
        assert found == pytest.approx(wanted / time, rel=2e-3)
