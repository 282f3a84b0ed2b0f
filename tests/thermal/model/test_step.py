"""Steps: energy balance by faces, directed airflows against a dense solve, held zones, refusals."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from numpy.typing import NDArray

from thermal import (
    Building,
    FloorPlan,
    FloorPlans,
    SymbolicModel,
    ThermalNetwork,
    ZoneTable,
    build_network,
    load_bundled_case,
    load_case,
)
from thermal.case.building import Airflow, Layer, Location, Surface, ZoneEntry
from thermal.errors import ModelError
from thermal.model.factor import factorise
from thermal.model.matrices import Matrices
from thermal.model.step import IMPLICIT_EULER, SCHEMES, TR_BDF2, Scheme, Stepper

FloatArray = NDArray[np.float64]

SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Etc/GMT-1")
SHARED_CASES = Path(__file__).parents[3].parent / "shared" / "cases"
GAMMA = 2.0 - np.sqrt(2.0)


def plan_building() -> Building:
    rows = ("#######", "#AA+BB#", "#AA+BB#", "#######")
    floor = FloorPlan("F1", 3.0, np.array([list(row) for row in rows]))
    flows = (Airflow(source="B", target="A", device="fan", fraction=1.0),)
    return Building("plan", SITE, 0.0, FloorPlans(1.0, (floor,), {"A": {"south": 2.0}}), airflows=flows)


def table_building() -> Building:
    """Three rooms between outdoor, attic and cellar; air goes round, and one room feeds two."""
    layers = (Layer(thickness=0.2, conductivity=0.5, density=1200.0, heat_capacity=1000.0),
              Layer(thickness=0.1, conductivity=0.04, density=30.0, heat_capacity=1000.0))  # fmt: skip
    common = {"construction": "wall"}
    surfaces = (
        Surface(name="W", kind="wall", zone="a", other="outdoor", area=12.0, azimuth=180.0, **common),
        Surface(name="I", kind="wall", zone="a", other="b", area=8.0, **common),
        Surface(name="J", kind="wall", zone="b", other="c", area=8.0, **common),
        Surface(name="C", kind="ceiling", zone="a", other="attic", area=20.0, **common),
        Surface(name="D", kind="floor", zone="c", other="cellar", area=15.0, **common),
        Surface(name="F", kind="floor", zone="b", other="ground", area=10.0, **common),
        Surface(name="G", kind="window", zone="b", other="outdoor", area=2.0, azimuth=0.0, u_value=1.3,
                solar_transmittance=0.5),
        Surface(name="B", kind="bridge", zone="c", other="outdoor", area=2.0, u_value=0.9),
        Surface(name="O", kind="opening", zone="a", other="b", area=1.9),
    )  # fmt: skip
    zones = tuple(ZoneEntry(name=n, volume=30.0 + 9 * i, floor_area=12.0 + 4 * i) for i, n in enumerate("abc"))
    pairs = (("a", "b"), ("b", "c"), ("c", "a"), ("a", "c"))
    flows = tuple(Airflow(source=s, target=t, device="fan", fraction=0.2) for s, t in pairs)
    return Building("table", SITE, 0.0, ZoneTable(zones, surfaces, {"wall": layers}), airflows=flows)


@cache
def model_of(name: str) -> SymbolicModel:
    if name == "twin house":
        folder = SHARED_CASES / "twinhouse_N2_exp1"
        if not folder.is_dir():
            pytest.skip(f"the shared case is not here: {folder}")
        return SymbolicModel(build_network(load_case(folder).building))
    if name.startswith("bundled"):
        return SymbolicModel(build_network(load_bundled_case().building, dx=float(name.split()[1])))
    if name.startswith("plan"):
        return SymbolicModel(build_network(plan_building(), dx=float(name.split()[1])))
    return SymbolicModel(build_network(table_building()))


def inputs_of(network: ThermalNetwork, steps: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Boundaries (steps, n_boundary), heat (steps, n_zone), airflows (steps, n_airflow) that all move."""
    rng = np.random.default_rng(8)
    boundary = 275.0 + 20.0 * rng.random((steps, network.n_boundary))
    heat = 3000.0 * rng.random((steps, len(network.zones))) - 1000.0
    airflow = 0.15 * rng.random((steps, len(network.airflows)))
    return boundary, heat, airflow


def inflow(network: ThermalNetwork, theta: FloatArray, states: FloatArray, u: FloatArray) -> tuple[float, float]:
    """Heat that enters over the faces to boundaries, and the sum of its absolute values, face by face [W]."""
    conductances = np.asarray(SymbolicModel(network).classes(theta)[0]).ravel()
    temperatures = np.concatenate([states, u])
    parts = [
        kappa * c.weight[edge] * (temperatures[c.second[edge]] - temperatures[c.first[edge]])
        for kappa, c in zip(conductances, network.conductances, strict=True)
        for edge in [(c.first < network.n_node) & (c.second >= network.n_node)]
    ]
    assert not any((c.first >= network.n_node).any() for c in network.conductances)
    joined = np.concatenate(parts)
    return float(joined.sum()), float(np.abs(joined).sum())


def directed(network: ThermalNetwork, states: FloatArray, airflow: FloatArray) -> tuple[float, float]:
    """Heat that directed airflows bring to their targets, and the sum of its absolute values [W]."""
    zone = network.observation @ states
    parts = [1006.0 * f * (zone[s] - zone[t]) for f, (s, t) in zip(airflow, network.airflows, strict=True)]
    return float(np.sum(parts)), float(np.abs(parts).sum())


def directed_matrix(network: ThermalNetwork, airflow: FloatArray) -> FloatArray:
    """A(θ) of the directed airflows, dense: heat into each volume per kelvin of each volume."""
    n_zone = len(network.zones)
    mixing = np.zeros((n_zone, n_zone))
    for f, (s, t) in zip(airflow, network.airflows, strict=True):
        mixing[t, s] += 1006.0 * f
        mixing[t, t] -= 1006.0 * f
    return np.asarray(network.heating.toarray() @ mixing @ network.observation.toarray())


def middle(matrices: Matrices, network: ThermalNetwork, states: FloatArray, step: float, u: FloatArray, q: FloatArray,
           airflow: FloatArray) -> FloatArray:  # fmt: skip
    """State of TR-BDF2 at the inner point, by a solve of the test's own."""
    n = matrices.n
    operator = matrices.flow[:, :n] - sp.csr_matrix(directed_matrix(network, airflow))
    source = matrices.heating @ q - matrices.flow[:, n:] @ u
    a = 0.5 * GAMMA * step
    rhs = matrices.capacity @ states + a * (source - operator @ states) + a * source
    return np.asarray(spl.spsolve(sp.csc_matrix(matrices.capacity + a * operator), rhs))


BALANCED = ("plan 1.0", "plan 0.5", "bundled 0.5", "bundled 1.0", "bundled 1.5", "table", "twin house")


@pytest.mark.parametrize("scheme", ["implicit_euler", "tr_bdf2"])
@pytest.mark.parametrize("name", BALANCED)
def test_energy_is_balanced_to_1e_9_of_the_heat_through_the_building(name: str, scheme: str) -> None:
    """Stored heat = heat of the zones + exchange over each face to a boundary + directed air, in every step."""
    model = model_of(name)
    network, theta, step = model.network, model.network.start(), 300.0
    matrices = model.matrices(theta)
    stepper = Stepper(matrices, step, SCHEMES[scheme])
    capacity = matrices.capacity.diagonal()
    states = 291.0 + 4.0 * np.random.default_rng(1).random(network.n_node)
    if scheme == "tr_bdf2":  # massless nodes enter its explicit part: begin where they are in balance
        states = Stepper(matrices, 1e-3).advance(states[:, None], np.full((network.n_boundary, 1), 280.0),
                                                 np.zeros((len(network.zones), 1)))[0][:, 0]  # fmt: skip
    for u, q, f in zip(*inputs_of(network, 6), strict=True):
        new = stepper.advance(states[:, None], u[:, None], q[:, None], f[:, None])[0][:, 0]
        if scheme == "implicit_euler":
            moments = [(1.0, new)]
        else:  # both stages' fluxes, as the second stage sums them
            inner = middle(matrices, network, states, step, u, q, f)
            weight = 1.0 / (GAMMA * (2.0 - GAMMA))
            moments = [(0.5 * GAMMA, new), (0.5 * GAMMA * weight, inner), (0.5 * GAMMA * weight, states)]
        assert sum(w for w, _ in moments) == pytest.approx(1.0, rel=1e-14)
        exchanged, through = 0.0, step * float(np.abs(q).sum())
        for weight, at in moments:
            for found, size in (inflow(network, theta, at, u), directed(network, at, f)):
                exchanged += weight * step * found
                through += weight * step * size
        stored = float(capacity @ (new - states))
        assert abs(stored - step * float(q.sum()) - exchanged) < 1e-9 * through
        states = new


@pytest.mark.parametrize("scheme", ["implicit_euler", "tr_bdf2"])
@pytest.mark.parametrize("name", ["plan 0.5", "bundled 1.0", "table"])
def test_a_building_at_one_temperature_stays_there(name: str, scheme: str) -> None:
    """Boundaries at it, no heat; directed air is at it too."""
    network = model_of(name).network
    stepper = Stepper(model_of(name).matrices(network.start()), 600.0, SCHEMES[scheme])
    states = np.full((network.n_node, 1), 291.7)
    airflow = np.full((len(network.airflows), 1), 0.2)
    for _ in range(20):
        states, mean, _, _ = stepper.advance(
            states, np.full((network.n_boundary, 1), 291.7), np.zeros((len(network.zones), 1)), airflow
        )
    np.testing.assert_allclose(states, 291.7, atol=1e-9)
    np.testing.assert_allclose(mean, 291.7, atol=1e-9)


@pytest.mark.parametrize("scheme", ["implicit_euler", "tr_bdf2"])
@pytest.mark.parametrize("name", ["plan 1.0", "table"])
def test_directed_airflows_are_those_of_a_dense_solve(name: str, scheme: str) -> None:
    """The correction of the rank of the zones against A(θ) assembled and factorised as a whole; several runs at once."""
    model = model_of(name)
    network, step, runs = model.network, 600.0, 3
    matrices = model.matrices(network.start())
    n, a = matrices.n, SCHEMES[scheme].implicit
    stiffness, exchange = matrices.flow[:, :n].toarray(), matrices.flow[:, n:].toarray()
    capacity, heating = matrices.capacity.toarray(), network.heating.toarray()
    rng = np.random.default_rng(4)
    states = 20.0 + 3.0 * rng.standard_normal((n, runs))
    u, q, f = (x[:runs].T for x in inputs_of(network, runs))
    u = u - 273.15
    new, mean, _, _ = Stepper(matrices, step, SCHEMES[scheme]).advance(states, u, q, f)
    for k in range(runs):
        operator = stiffness - directed_matrix(network, f[:, k])
        system, source = capacity + a * step * operator, heating @ q[:, k] - exchange @ u[:, k]
        x = states[:, k]
        if scheme == "implicit_euler":
            end = np.linalg.solve(system, capacity @ x + step * source)
            average = 0.5 * (x + end)
        else:
            inner = np.linalg.solve(system, capacity @ x + a * step * (2 * source - operator @ x))
            w = 1.0 / (GAMMA * (2.0 - GAMMA))
            end = np.linalg.solve(system, capacity @ ((1 - w) * x + w * inner) + a * step * source)
            average = 0.5 * GAMMA * x + 0.5 * inner + 0.5 * (1 - GAMMA) * end
        np.testing.assert_allclose(new[:, k], end, rtol=0, atol=1e-10)
        np.testing.assert_allclose(mean[:, k], network.observation @ average, rtol=0, atol=1e-10)


def test_source_of_a_directed_airflow_loses_nothing_by_it() -> None:
    """Its metered heat already counts the air as leaving; the target alone is warmed, by c_p flow (T_source - T_target)."""
    network = model_of("table").network
    model = model_of("table")
    stepper = Stepper(model.matrices(network.start()), 1e-3, IMPLICIT_EULER)
    states = np.full(network.n_node, 290.0)
    room = np.isin(network.kind, ("air", "radiant", "furniture")) & (network.zone == 0)
    states[room] = 300.0  # zone a
    flow = np.zeros((4, 1))
    still = stepper.advance(states[:, None], np.full((3, 1), 290.0), np.zeros((3, 1)), flow)[0]
    flow[0] = 0.1  # a to b
    moved = stepper.advance(states[:, None], np.full((3, 1), 290.0), np.zeros((3, 1)), flow)[0]
    gained = model.matrices(network.start()).capacity.diagonal() * (moved - still)[:, 0] / 1e-3
    target = np.flatnonzero((network.kind == "air") & (network.zone == 1))[0]
    assert gained[target] == pytest.approx(1006.0 * 0.1 * 10.0, rel=1e-4)
    assert np.abs(np.delete(gained, target)).max() < 1e-2


@pytest.mark.parametrize("scheme", ["implicit_euler", "tr_bdf2"])
def test_runs_side_by_side_are_the_runs_alone(scheme: str) -> None:
    model = model_of("table")
    network = model.network
    stepper = Stepper(model.matrices(network.start(), sensitivities=True), 300.0, SCHEMES[scheme])
    p = len(network.parameters)
    rng = np.random.default_rng(6)
    states, slopes = 290.0 + rng.random((network.n_node, 2)), rng.random((network.n_node, p * 2))
    u, q, f = (x[:2].T for x in inputs_of(network, 2))
    both = stepper.advance(states, u, q, f, slopes)
    for k in (0, 1):
        alone = stepper.advance(states[:, [k]], u[:, [k]], q[:, [k]], f[:, [k]], slopes[:, k::2])
        np.testing.assert_allclose(both[0][:, [k]], alone[0], rtol=1e-13)
        np.testing.assert_allclose(both[1][:, [k]], alone[1], rtol=1e-13)
        np.testing.assert_allclose(both[2][:, k::2], alone[2], rtol=1e-9, atol=1e-10)
        np.testing.assert_allclose(both[3][:, k::2], alone[3], rtol=1e-9, atol=1e-10)


# Held zones


@pytest.mark.parametrize("name", ["plan 1.0", "bundled 1.5", "table"])
def test_held_zones_are_where_they_are_held_and_the_heat_is_what_it_takes(name: str) -> None:
    model = model_of(name)
    network = model.network
    stepper = Stepper(model.matrices(network.start()), 300.0)
    rng = np.random.default_rng(3)
    states = (290.0 + 3.0 * rng.random(network.n_node))[:, None]
    boundary = np.full((network.n_boundary, 1), 278.0)
    for _ in range(5):
        wanted = 291.0 + 2.0 * rng.random((len(network.zones), 1))
        new, _, watts = stepper.hold(states, boundary, wanted)
        assert np.abs(network.observation @ new - wanted).max() < 1e-9
        applied = stepper.advance(states, boundary, watts[:, None])[0]
        assert np.abs(applied - new).max() < 1e-9
        states = new


def test_zone_that_nothing_measures_is_free_while_the_others_are_held() -> None:
    network = model_of("table").network
    stepper = Stepper(model_of("table").matrices(network.start()), 300.0)
    states = np.full((network.n_node, 1), 290.0)
    wanted = np.array([[295.0], [np.nan], [293.0]])
    new, _, watts = stepper.hold(states, np.full((3, 1), 280.0), wanted)
    zone = network.observation @ new
    assert np.abs(zone[[0, 2], 0] - [295.0, 293.0]).max() < 1e-9
    assert watts[1] == 0.0
    assert np.isfinite(new).all()
    assert np.abs(stepper.advance(states, np.full((3, 1), 280.0), watts[:, None])[0] - new).max() < 1e-9


@pytest.mark.parametrize("name", ["plan 1.0", "table"])
@pytest.mark.parametrize("free", [False, True])
def test_holding_many_steps_dense_is_holding_them_sparse(name: str, free: bool) -> None:
    """The same model on the identity basis takes the dense path: states and slopes agree to 1e-9."""
    sparse = model_of(name)
    network = sparse.network
    dense = SymbolicModel(network, np.eye(network.n_node))
    theta, keep = network.start(), np.array([0, 3, 9, 24])
    rng = np.random.default_rng(9)
    zone = 2.0 * rng.random((25, len(network.zones)))
    if free:
        zone[:, 1] = np.nan
    boundary = -10.0 * rng.random((25, network.n_boundary))
    start = rng.random((network.n_node, 1))
    slopes = 1e-2 * rng.random((network.n_node, theta.size)) / theta
    found = []
    for model in (sparse, dense):
        stepper = Stepper(model.matrices(theta, sensitivities=True), 300.0)
        found.append(stepper.hold_many(start, boundary, zone, keep, slopes))
        without = Stepper(model.matrices(theta), 300.0).hold_many(start, boundary, zone, keep)
        np.testing.assert_allclose(without[0], found[-1][0], rtol=0, atol=1e-12)
        assert without[1] is None
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=0, atol=1e-9)
    assert found[0][1] is not None
    assert found[1][1] is not None
    scale = np.repeat(theta, keep.size)
    np.testing.assert_allclose(found[0][1] * scale, found[1][1] * scale, rtol=0, atol=1e-9)


def test_holding_many_steps_is_holding_one_after_the_other() -> None:
    model = model_of("plan 1.0")
    network = model.network
    stepper = Stepper(model.matrices(network.start(), sensitivities=True), 300.0)
    rng = np.random.default_rng(2)
    zone, boundary = rng.random((6, 2)), rng.random((6, 1))
    states, slopes = np.zeros((network.n_node, 1)), np.zeros((network.n_node, len(network.parameters)))
    kept, kept_slopes = stepper.hold_many(states, boundary, zone, np.array([1, 5]), slopes)
    for k in range(6):
        states, slopes, _ = stepper.hold(states, boundary[k][:, None], zone[k][:, None], slopes)  # type: ignore[assignment]
        if k in (1, 5):
            column = [1, 5].index(k)
            np.testing.assert_array_equal(kept[:, [column]], states)
            np.testing.assert_array_equal(kept_slopes[:, column::2], slopes)  # type: ignore[index]


def test_only_implicit_euler_holds() -> None:
    model = model_of("plan 1.0")
    stepper = Stepper(model.matrices(model.network.start()), 300.0, TR_BDF2)
    with pytest.raises(ModelError, match=r"implicit_euler.*tr_bdf2"):
        stepper.hold(np.zeros((model.network.n_node, 1)), np.zeros((1, 1)), np.zeros((2, 1)))


# Factors


@pytest.mark.parametrize("sparse", [True, False])
def test_factor_solves_one_and_many_right_hand_sides(sparse: bool) -> None:
    rng = np.random.default_rng(0)
    root = rng.standard_normal((8, 8))
    matrix = root @ root.T + np.eye(8)
    solve = factorise(sp.csr_matrix(matrix) if sparse else matrix)
    rhs = rng.standard_normal((8, 3))
    np.testing.assert_allclose(matrix @ solve(rhs), rhs, atol=1e-11)
    np.testing.assert_allclose(matrix @ solve(rhs[:, 0]), rhs[:, 0], atol=1e-11)


@pytest.mark.parametrize("sparse", [True, False])
def test_singular_matrix_is_a_named_error(sparse: bool) -> None:
    matrix = np.diag([1.0, 0.0, 2.0])
    with pytest.raises(ModelError, match="n = 3"):
        factorise(sp.csr_matrix(matrix) if sparse else matrix)


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=list(SCHEMES))
def test_schemes_are_consistent(scheme: Scheme) -> None:
    """Weights sum to 1; all stages share one matrix; the stages cover the step."""
    assert sum(scheme.mean) == pytest.approx(1.0, rel=1e-15)
    times = [0.0]
    for stage in scheme.stages:
        assert sum(stage.weights) == pytest.approx(1.0, rel=1e-14)
        assert stage.implicit == scheme.implicit
        start = sum(w * t for w, t in zip(stage.weights, times, strict=False))
        times.append(start + stage.implicit + stage.explicit)
    assert times[-1] == pytest.approx(1.0, rel=1e-14)
    # the mean's quadrature is exact for what is linear in time
    assert sum(w * t for w, t in zip(scheme.mean, times, strict=True)) == pytest.approx(0.5, rel=1e-14)
