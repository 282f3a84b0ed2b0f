"""Exterior walls of a plan with several nodes: steady states and masses stay, dynamics tend to the exact slab."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import Building, FloorPlan, FloorPlans, Structure, SymbolicModel, ThermalNetwork, build_network
from thermal.case.building import Location
from thermal.errors import ModelError

SITE = Location(latitude=42.0, longitude=-88.0, elevation=120.0, timezone="Etc/GMT+6")
TWO_ROOMS = ("#######", "#AA+BB#", "#AA+BB#", "#######")
# exterior wall between two rooms, at a stub of partition to the outside, and two cells thick
JUNCTION = (".......", "######.", "#AAAA#.", "#B+CC#.", "#BB#C+.", "######.", ".......")
THICK = ("########", "########", "##AAAA##", "##AAAA##", "########", "########")


def building(
    *rows: str, cell: float = 1.0, glazing: Mapping[str, Mapping[str, float]] | None = None, height: float = 3.0
) -> Building:
    floor = FloorPlan("F1", height, np.array([list(row) for row in rows]))
    return Building("test", SITE, 0.0, FloorPlans(cell, (floor,), glazing or {}))


HOUSES = {
    "two rooms": (building(*TWO_ROOMS, glazing={"A": {"south": 2.0, "west": 1.5}}), None),
    "junctions": (building(*JUNCTION, cell=0.7, height=2.6, glazing={"A": {"north": 4.0}, "C": {"east": 1.0}}), None),
    "thick walls": (building(*THICK, cell=0.5), None),
    "merged": (building(*JUNCTION, cell=0.7, height=2.6, glazing={"A": {"north": 4.0}}), 1.05),
    "all glass": (building(*TWO_ROOMS, glazing={"A": {"south": 6.0, "west": 6.0, "north": 6.0}}), None),
}


def transfer(network: ThermalNetwork, s: complex) -> NDArray[np.complex128]:
    """Zone means per watt in each zone and per kelvin outdoors, at the Laplace variable s."""
    m = SymbolicModel(network).matrices(network.start())
    system = m.flow[:, : m.n].toarray() + s * m.capacity.toarray()
    inputs = np.hstack([m.heating.toarray(), -m.flow[:, m.n :].toarray()])
    return np.asarray(m.observation @ np.linalg.solve(system, inputs))


@pytest.mark.parametrize("nodes", [2, 3, 4, 7])
@pytest.mark.parametrize("name", HOUSES)
def test_no_steady_state_depends_on_the_number_of_nodes(name: str, nodes: int) -> None:
    """Of any plan: walls between rooms, corners, stubs, glass, thick and merged walls."""
    house, dx = HOUSES[name]
    one = build_network(house, dx)
    many = build_network(house, dx, structure=Structure(wall_nodes=nodes))
    assert many.n_node > one.n_node
    assert [p.name for p in many.parameters] == [p.name for p in one.parameters]
    np.testing.assert_allclose(transfer(many, 0.0), transfer(one, 0.0), rtol=1e-10)
    assert not np.allclose(transfer(many, 1e-3), transfer(one, 1e-3), rtol=1e-4)


@pytest.mark.parametrize("nodes", [2, 3, 4, 7])
@pytest.mark.parametrize("name", HOUSES)
def test_mass_of_the_walls_does_not_depend_on_the_number_of_nodes(name: str, nodes: int) -> None:
    house, dx = HOUSES[name]
    masses = []
    for structure in (Structure(), Structure(wall_nodes=nodes)):
        network = build_network(house, dx, structure=structure)
        heat = SymbolicModel(network).matrices(network.start()).capacity.diagonal()
        assert (heat >= 0).all()
        masses.append(float(heat[network.kind == "exterior_wall"].sum()))
    assert masses[1] == pytest.approx(masses[0], rel=1e-12)


def test_nodes_of_a_straight_wall_are_equal_slices() -> None:
    """Three through a cell of wall, 1 m long and 3 m high: 150 kJ/K each, 60 W/K from one to the next.

    All 14 straight cells have a slice outside, 12 one inside (two stand at the partition), four corners two outside.
    """
    network = build_network(building(*TWO_ROOMS), structure=Structure(wall_nodes=3))
    assert (network.kind == "exterior_wall").sum() == 18 + 14 + 12 + 2 * 4
    m = SymbolicModel(network).matrices(network.start())
    middle = int(np.flatnonzero((network.place[:, 1] == 0) & (network.place[:, 2] == 1))[0])
    row = m.flow[middle, : m.n].toarray()[0]
    slices = np.flatnonzero((np.abs(row) > 0) & (network.place[:, 0] < 0))
    np.testing.assert_allclose(m.capacity.diagonal()[[middle, *slices]], 150e3, rtol=1e-12)
    np.testing.assert_allclose(row[slices], -3.0 / (0.15 / 3.0), rtol=1e-12)


def admittance(nodes: int, s: complex) -> complex:
    """Heat into one square metre of wall per kelvin of the air: what 12 m more of a long building take, air held."""
    taken = []
    for columns in (38, 50):
        inner = "#" + "A" * (columns - 2) + "#"
        house = building("#" * columns, inner, inner, "#" * columns)
        structure = Structure(furniture=False, slab_nodes=0, wall_nodes=nodes, radiant=False)
        network = build_network(house, structure=structure)
        m = SymbolicModel(network).matrices(network.start())
        flow = m.flow[:, : m.n].toarray()
        air = network.kind == "air"
        rest = ~air & (network.kind != "mixing")
        system = flow + s * m.capacity.toarray()
        into = flow[np.ix_(rest, air)].sum(axis=1)
        states = np.linalg.solve(system[np.ix_(rest, rest)], -into)
        taken.append(-into.sum() + into @ states)
    return complex(taken[1] - taken[0]) / (2 * 12.0 * 3.0)


def exact(s: complex) -> complex:
    """The same of a homogeneous layer of 0.15 m2K/W and 150 kJ/m2/K between film and insulation (ISO 13786)."""
    r, heat, outer = 0.15, 150e3, 1.0 / 0.55 + 1.0 / 20.0
    a = np.sqrt(s * heat * r)
    face = np.cosh(a) * outer + r / a * np.sinh(a)  # temperature and heat flow at the room's face, per heat outdoors
    into = np.cosh(a) + a / r * np.sinh(a) * outer
    return complex(into / (face + into / 7.7))


@pytest.mark.parametrize("period", [86400.0, 21600.0, 3600.0])
def test_admittance_converges_to_that_of_the_exact_slab(period: float) -> None:
    s = 2j * np.pi / period
    errors = np.array([abs(admittance(n, s) - exact(s)) / abs(exact(s)) for n in (1, 2, 4, 8, 16)])
    assert (np.diff(errors) < 0).all()
    np.testing.assert_allclose(np.log2(errors[2:-1] / errors[3:]), 2.0, atol=0.2)
    assert errors[-1] < 0.004


def test_a_finer_plan_has_nodes_of_its_own() -> None:
    """Cells split in three are three nodes: fewer are granted, more refused by name."""
    house = building(*TWO_ROOMS)
    fine = build_network(house, dx=1.0 / 3.0)
    assert build_network(house, dx=1.0 / 3.0, structure=Structure(wall_nodes=3)).n_node == fine.n_node
    with pytest.raises(ModelError, match=r"wall_nodes: expected at most 3 .* got 4"):
        build_network(house, dx=1.0 / 3.0, structure=Structure(wall_nodes=4))
