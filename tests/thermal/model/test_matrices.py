"""Matrices of the symbolic model: conservation, symmetry, and derivatives against finite differences."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal import Building, FloorPlan, FloorPlans, SymbolicModel, ZoneTable, build_network, load_bundled_case
from thermal.case.building import Airflow, Layer, Location, Surface, ZoneEntry
from thermal.errors import ModelError

FloatArray = NDArray[np.float64]

SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Etc/GMT-1")


def plan_building() -> Building:
    rows = ("#######", "#AA+BB#", "#AA+BB#", "#######")
    floor = FloorPlan("F1", 3.0, np.array([list(row) for row in rows]))
    return Building(
        "plan", SITE, 0.0, FloorPlans(1.0, (floor,), {"A": {"south": 2.0, "west": 1.5}, "B": {"east": 2.0}})
    )


def table_building() -> Building:
    layers = (Layer(thickness=0.2, conductivity=0.5, density=1200.0, heat_capacity=1000.0),
              Layer(thickness=0.1, conductivity=0.04, density=30.0, heat_capacity=1000.0))  # fmt: skip
    common = {"construction": "wall"}
    surfaces = (
        Surface(name="W", kind="wall", zone="room", other="outdoor", area=12.0, azimuth=180.0, **common),
        Surface(name="I", kind="wall", zone="room", other="hall", area=8.0, **common),
        Surface(name="C", kind="ceiling", zone="room", other="attic", area=20.0, **common),
        Surface(name="F", kind="floor", zone="hall", other="ground", area=10.0, **common),
        Surface(name="G", kind="window", zone="hall", other="outdoor", area=2.0, azimuth=0.0, u_value=1.3,
                solar_transmittance=0.5),
        Surface(name="O", kind="opening", zone="room", other="hall", area=1.9),
    )  # fmt: skip
    zones = (ZoneEntry(name="room", volume=50.0, floor_area=20.0), ZoneEntry(name="hall", volume=26.0, floor_area=10.0))
    flows = (Airflow(source="room", target="hall", device="fan", fraction=1.0),)
    return Building("table", SITE, 0.0, ZoneTable(zones, surfaces, {"wall": layers}), airflows=flows)


@cache
def model_of(name: str) -> SymbolicModel:
    if name == "plan":
        return SymbolicModel(build_network(plan_building()))
    if name == "plan, reach":
        return SymbolicModel(build_network(plan_building(), dx=0.5, reach=0.6))
    if name == "plan, zones apart":
        scopes = {"interior_film_coefficient": "zone", "shuffle_probability": "zone", "window_u_value": "zone"}
        return SymbolicModel(build_network(plan_building(), scopes=scopes))  # type: ignore[arg-type]
    if name == "bundled":
        return SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    return SymbolicModel(build_network(table_building()))


MODELS = ("plan", "plan, reach", "plan, zones apart", "bundled", "table")


def thetas(model: SymbolicModel) -> list[FloatArray]:
    """The starts, both ends of the ranges, and a draw of the prior."""
    parameters = model.network.parameters
    rng = np.random.default_rng(2)
    drawn = [p.inverse(p.transform(p.start) + 0.5 * p.prior_deviation * rng.standard_normal()) for p in parameters]
    return [
        model.network.start(),
        np.array([p.lower for p in parameters]),
        np.array([p.upper for p in parameters]),
        np.array(drawn),
    ]


@pytest.mark.parametrize("name", MODELS)
def test_stiffness_is_symmetric_and_semidefinite_and_rows_sum_to_zero(name: str) -> None:
    model = model_of(name)
    for theta in thetas(model):
        m = model.matrices(theta)
        stiffness = m.flow[:, : m.n].toarray()
        largest = np.abs(stiffness).max()
        np.testing.assert_array_equal(stiffness, stiffness.T)
        assert np.abs(m.flow.sum(axis=1)).max() < 1e-12 * largest
        assert np.linalg.eigvalsh(stiffness)[0] > -1e-12 * largest
        off = stiffness - np.diag(np.diag(stiffness))
        assert off.max() <= 0.0  # no conductance is negative
        assert m.flow[:, m.n :].max() <= 0.0


@pytest.mark.parametrize("name", MODELS)
def test_capacity_is_diagonal_and_zero_only_for_radiant_nodes_and_stars(name: str) -> None:
    model = model_of(name)
    capacity = model.matrices(model.network.start()).capacity
    assert (capacity - sp.diags(capacity.diagonal())).nnz == 0
    massless = capacity.diagonal() == 0.0
    np.testing.assert_array_equal(massless, np.isin(model.network.kind, ("radiant", "mixing")))
    assert (capacity.diagonal()[~massless] > 0).all()


@pytest.mark.parametrize("name", MODELS)
def test_heat_and_mean_of_a_zone_are_whole(name: str) -> None:
    network = model_of(name).network
    np.testing.assert_allclose(network.heating.sum(axis=0), 1.0, rtol=1e-13)
    np.testing.assert_allclose(network.observation.sum(axis=1), 1.0, rtol=1e-13)
    used = np.unique(network.observation.indices)
    np.testing.assert_array_equal(used, np.flatnonzero(network.kind == "air"))
    # the mean is by heat capacity, so heat given to a zone's air changes the mean by heat over capacity
    capacity = model_of(name).matrices(network.start()).capacity
    for z in range(len(network.zones)):
        air = np.flatnonzero((network.kind == "air") & (network.zone == z))
        share = capacity.diagonal()[air] / capacity.diagonal()[air].sum()
        np.testing.assert_allclose(network.observation.toarray()[z, air], share, rtol=1e-12)


def central(
    function: Callable[[FloatArray], FloatArray], theta: FloatArray, j: int, relative: float = 2e-3
) -> FloatArray:
    """Derivative by the five-point rule; its error is of fourth order."""
    h = relative * theta[j]
    step = h * np.eye(theta.size)[j]
    near = function(theta + step) - function(theta - step)
    far = function(theta + 2 * step) - function(theta - 2 * step)
    return (8.0 * near - far) / (12.0 * h)


@pytest.mark.parametrize("name", MODELS)
def test_derivatives_of_classes_are_those_of_finite_differences(name: str) -> None:
    """dκ/dθ and dc/dθ by CasADi, to 1e-6 of κ/θ and c/θ (and in fact to 1e-9)."""
    model = model_of(name)
    for theta in thetas(model)[::3]:
        m = model.matrices(theta, sensitivities=True)
        value = [np.asarray(v).ravel() for v in model.classes(theta)]
        for j in range(theta.size):
            for k, (slopes, terms) in enumerate(
                ((m.flow_sensitivities, model.class_flows), (m.capacity_sensitivities, model.class_masses))
            ):
                wanted = central(lambda t, k=k: np.asarray(model.classes(t)[k]).ravel(), theta, j)
                difference = slopes[j] - sum(w * term for w, term in zip(wanted, terms, strict=True))
                scale = sum(abs(v) / theta[j] * abs(term) for v, term in zip(value[k], terms, strict=True))
                assert abs(difference).max() < 1e-9 * scale.max()


@pytest.mark.parametrize("name", ["plan", "plan, reach", "plan, zones apart", "table"])
def test_slopes_of_the_matrices_are_those_of_finite_differences(name: str) -> None:
    """Entry by entry, to 1e-6 of the entry over θ."""
    model = model_of(name)
    theta = thetas(model)[3]
    m = model.matrices(theta, sensitivities=True)
    assert len(m.flow_sensitivities) == len(m.capacity_sensitivities) == theta.size
    for j in range(theta.size):
        flow = central(lambda t: model.matrices(t).flow.toarray(), theta, j)
        capacity = central(lambda t: model.matrices(t).capacity.toarray(), theta, j)
        for found, wanted, whole in (
            (m.flow_sensitivities[j], flow, m.flow),
            (m.capacity_sensitivities[j], capacity, m.capacity),
        ):
            assert np.abs(found.toarray() - wanted).max() < 1e-6 * np.abs(whole.toarray()).max() / theta[j]
            strong = np.abs(wanted) > 1e-3 * np.abs(whole.toarray()) / theta[j]
            np.testing.assert_allclose(found.toarray()[strong], wanted[strong], rtol=1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_every_parameter_matters(name: str) -> None:
    model = model_of(name)
    m = model.matrices(model.network.start(), sensitivities=True)
    for p, flow, capacity in zip(model.network.parameters, m.flow_sensitivities, m.capacity_sensitivities, strict=True):
        assert flow.nnz or capacity.nnz, p.name


def test_matrices_without_slopes_have_none() -> None:
    m = model_of("plan").matrices(model_of("plan").network.start())
    assert m.flow_sensitivities == m.capacity_sensitivities == []


def test_theta_of_another_length_is_refused_with_the_names() -> None:
    with pytest.raises(ModelError, match=r"expected shape .*interior_film_coefficient.*got \(3,\)"):
        model_of("plan").matrices(np.ones(3))


@pytest.mark.parametrize("bad", [np.nan, np.inf, 0.0, -1.0])
def test_values_that_are_not_positive_and_finite_are_refused_by_name(bad: float) -> None:
    model = model_of("plan")
    names = [p.name for p in model.network.parameters]
    theta = model.network.start()
    theta[names.index("slab_coupling")] = bad
    with pytest.raises(ModelError, match="slab_coupling"):
        model.matrices(theta)


def test_probability_above_one_is_refused_by_name() -> None:
    """A shuffle probability of 1.5 would be a rate that no shuffle has."""
    model = model_of("plan")
    with pytest.raises(ModelError, match="shuffle_probability"):
        model.matrices(model.network.values({"shuffle_probability": 1.5}))


def test_projection_keeps_the_model_affine_in_the_classes() -> None:
    """Galerkin with any basis: the projected matrices at any θ are the projections of the matrices at that θ."""
    model = model_of("plan")
    basis = np.linalg.qr(np.random.default_rng(1).standard_normal((model.network.n_node, 9)))[0]
    small = SymbolicModel(model.network, basis)
    for theta in thetas(model):
        whole, found = model.matrices(theta, sensitivities=True), small.matrices(theta, sensitivities=True)
        n = whole.n
        np.testing.assert_allclose(found.flow[:, :9], basis.T @ (whole.flow[:, :n] @ basis), atol=1e-9)
        np.testing.assert_allclose(found.flow[:, 9:], basis.T @ whole.flow[:, n:].toarray(), atol=1e-9)
        np.testing.assert_allclose(found.capacity, basis.T @ (whole.capacity @ basis), rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(found.heating, basis.T @ whole.heating.toarray(), atol=1e-12)
        np.testing.assert_allclose(found.observation, whole.observation @ basis, atol=1e-12)
        np.testing.assert_allclose(found.uniform, basis.T @ np.ones(n), atol=1e-12)
        for a, b in zip(found.flow_sensitivities, whole.flow_sensitivities, strict=True):
            np.testing.assert_allclose(a[:, :9], basis.T @ (b[:, :n] @ basis), atol=1e-9)
