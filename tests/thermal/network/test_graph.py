"""The graph as such: faces and volumes become matrices, boundaries are left out, names are checked."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
import scipy.sparse as sp

from thermal import SymbolicModel
from thermal.errors import ModelError
from thermal.inputs.signals import Signal
from thermal.network.graph import GraphBuilder
from thermal.network.network import ThermalNetwork
from thermal.parameters import PARAMETERS, Parameter


def three_nodes(scope: bool = False) -> ThermalNetwork:
    """Two rooms and a mass between outdoor and cellar; room 1 - mass 2 W/K x h_c, mass - outdoor 7, room 2 - cellar 3."""
    scopes = {"interior_film_coefficient": "zone"} if scope else {}
    graph = GraphBuilder(("one", "two"), ("outdoor", "cellar"), scopes)  # type: ignore[arg-type]
    rooms = graph.volumes("air", [0, 1])
    mass = graph.volumes("mass", -1)
    for number, zone in enumerate(graph.zones):
        film = graph.parameter("interior_film_coefficient", zone)
        graph.face(graph.key("air-mass", zone, "interior_film_coefficient"), film, rooms[number], mass, 2.0)
    graph.face("fixed", ca.SX(7.0), mass, graph.boundary("outdoor"), 1.0)
    graph.face("fixed", ca.SX(7.0), graph.boundary("cellar"), rooms[1], 3.0 / 7.0)
    graph.capacity("air", 1200.0, rooms, [10.0, 20.0])
    graph.capacity("mass", 1e6, mass, 1.0)
    graph.capacity("mass", 1e6, mass, 0.5)
    heating = sp.csr_matrix(([1.0, 1.0], ([0, 1], [0, 1])), shape=(3, 2))
    return graph.finish(heating.T.tocsr(), heating, ((0, 1),))


def test_matrices_of_a_hand_worked_graph() -> None:
    network = three_nodes()
    matrices = SymbolicModel(network).matrices(np.array([3.0]))
    # nodes: one, two, mass; boundaries: outdoor, cellar
    wanted = [[6.0, 0.0, -6.0, 0.0, 0.0], [0.0, 9.0, -6.0, 0.0, -3.0], [-6.0, -6.0, 19.0, -7.0, 0.0]]
    np.testing.assert_allclose(matrices.flow.toarray(), wanted, rtol=1e-14)
    np.testing.assert_allclose(matrices.capacity.toarray(), np.diag([12000.0, 24000.0, 1.5e6]), rtol=1e-14)
    assert (matrices.n, matrices.n_boundary, network.n_boundary) == (3, 2, 2)
    np.testing.assert_array_equal(network.kind, ["air", "air", "mass"])
    np.testing.assert_array_equal(network.zone, [0, 1, -1])
    assert (network.place == -1).all()


def test_zone_scope_gives_each_zone_its_own_parameter() -> None:
    network = three_nodes(scope=True)
    assert [p.name for p in network.parameters] == ["interior_film_coefficient@one", "interior_film_coefficient@two"]
    flow = SymbolicModel(network).matrices(np.array([3.0, 1.5])).flow.toarray()
    np.testing.assert_allclose(flow[:2, 2], [-6.0, -3.0], rtol=1e-14)
    base = PARAMETERS["interior_film_coefficient"]
    assert all(
        (p.start, p.lower, p.upper, p.unit) == (base.start, base.lower, base.upper, base.unit)
        for p in network.parameters
    )


def test_values_by_name_and_starts_for_the_rest() -> None:
    network = three_nodes(scope=True)
    np.testing.assert_array_equal(network.values({"interior_film_coefficient@two": 4.0}), [2.5, 4.0])
    np.testing.assert_array_equal(network.start(), [2.5, 2.5])


def test_unknown_names_are_refused() -> None:
    with pytest.raises(ModelError, match=r"interior_film_coeficient.*interior_film_coefficient"):
        three_nodes().values({"interior_film_coeficient": 4.0})
    with pytest.raises(ModelError, match="radiant_coeff"):
        GraphBuilder(("one",), ("outdoor",), {"radiant_coeff": "zone"})


def graph_with_sources() -> GraphBuilder:
    """A room on a mass, lit through two classes by one signal, and warmed by another."""
    graph = GraphBuilder(("one",), ("outdoor",), {})
    room, mass = graph.volumes("air", 0), graph.volumes("mass", -1)
    graph.capacity("air", 1200.0, room, 10.0)
    graph.capacity("mass", 1e6, mass, 1.0)
    graph.face("a", ca.SX(2.0), room, mass, 3.0)
    graph.face("b", ca.SX(7.0), mass, graph.boundary("outdoor"), 1.0)
    sun, fire = (Signal(name, "W/m^2", lambda d: d.outdoor) for name in ("sun", "fire"))
    strength = graph.own(Parameter("strength", "1", 0.0, -1.0, 1.0, "made up", "linear", "made_up"))
    graph.source("light", strength, room, sun, 5.0)
    graph.source("light", strength, mass, sun, 2.0)
    graph.source("light", strength, mass, fire, 11.0)
    graph.source("glow", -2.0 * strength, mass, sun, 1.0)
    return graph


def test_sources_are_columns_that_no_temperature_moves() -> None:
    graph = graph_with_sources()
    heating = sp.csr_matrix(([1.0], ([0], [0])), shape=(2, 1))
    network = graph.finish(heating.T.tocsr(), heating, ())
    assert [s.name for s in network.signals] == ["sun", "fire"]
    matrices = SymbolicModel(network).matrices(np.array([0.5]), sensitivities=True)
    # nodes room, mass; outdoor, sun, fire
    wanted = [[6.0, -6.0, 0.0, -2.5, 0.0], [-6.0, 13.0, -7.0, 0.0, -5.5]]
    np.testing.assert_allclose(matrices.flow.toarray(), wanted, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(matrices.flow_sensitivities[0].toarray()[:, 3:], [[-5.0, 0.0], [0.0, -11.0]], atol=1e-14)
    assert matrices.n_boundary == 3 and matrices.n_signal == 2


def test_faces_that_touch_some_nodes() -> None:
    graph = graph_with_sources()
    found = graph.touching(np.array([0]))
    assert [(float(v), n.tolist(), f.tolist(), w.tolist()) for v, n, f, w in found] == [(2.0, [0], [1], [3.0])]
    graph.face("c", ca.SX(1.0), graph.boundary("outdoor"), 0, 4.0)
    assert [(float(v), f.tolist()) for v, _, f, _ in graph.touching(np.array([0]))] == [(2.0, [1]), (1.0, [-1])]
    assert len(graph.touching(np.array([0, 1]))) == 2  # what joins the two is inside
    assert len(graph.touching(np.array([graph.boundary("outdoor")]))) == 2
