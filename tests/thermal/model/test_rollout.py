"""Roll-outs: two executors against each other, and their Jacobians against finite differences."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import Building, FloorPlan, FloorPlans, SymbolicModel, ZoneTable, build_network
from thermal.case.building import Airflow, Layer, Location, Surface, ZoneEntry
from thermal.errors import ModelError
from thermal.model.rollouts import RolloutData, rollout, symbolic_step
from thermal.model.step import IMPLICIT_EULER, SCHEMES, Stepper

FloatArray = NDArray[np.float64]

SITE = Location(latitude=48.0, longitude=12.0, elevation=690.0, timezone="Etc/GMT-1")
STEPS = 8


def plan_building() -> Building:
    rows = ("#######", "#AA+BB#", "#AA+BB#", "#######")
    floor = FloorPlan("F1", 3.0, np.array([list(row) for row in rows]))
    return Building("plan", SITE, 0.0, FloorPlans(1.0, (floor,), {"A": {"south": 2.0}}))


def table_building() -> Building:
    layers = (Layer(thickness=0.2, conductivity=0.5, density=1200.0, heat_capacity=1000.0),)
    surfaces = (
        Surface(name="W", kind="wall", zone="room", other="outdoor", area=12.0, azimuth=180.0, construction="wall"),
        Surface(name="I", kind="wall", zone="room", other="hall", area=8.0, construction="wall"),
        Surface(name="C", kind="ceiling", zone="hall", other="attic", area=10.0, construction="wall"),
        Surface(name="G", kind="window", zone="hall", other="outdoor", area=2.0, azimuth=0.0, u_value=1.3,
                solar_transmittance=0.5),
        Surface(name="O", kind="opening", zone="room", other="hall", area=1.9),
    )  # fmt: skip
    zones = (ZoneEntry(name="room", volume=50.0, floor_area=20.0), ZoneEntry(name="hall", volume=26.0, floor_area=10.0))
    flows = tuple(
        Airflow(source=s, target=t, device="fan", fraction=0.5) for s, t in (("room", "hall"), ("hall", "room"))
    )
    return Building("table", SITE, 0.0, ZoneTable(zones, surfaces, {"wall": layers}), airflows=flows)


@cache
def model_of(name: str) -> SymbolicModel:
    return SymbolicModel(build_network(plan_building() if name == "plan" else table_building()))


def data_of(name: str, steps: int = STEPS) -> RolloutData:
    """Inputs that move, around 0 so that differences are not lost in round-off."""
    network = model_of(name).network
    rng = np.random.default_rng(7)
    return RolloutData(
        initial=2.0 * rng.standard_normal(network.n_node),
        boundary=-10.0 + 5.0 * rng.random((steps, network.n_boundary)),
        heat=2000.0 * rng.random((steps, len(network.zones))),
        airflow=0.1 * rng.random((steps, len(network.airflows))),
    )


def theta_of(name: str) -> FloatArray:
    rng = np.random.default_rng(21)
    parameters = model_of(name).network.parameters
    return np.array(
        [p.inverse(p.transform(p.start) + 0.5 * p.prior_deviation * rng.standard_normal()) for p in parameters]
    )


CASES = [(n, s) for n in ("plan", "table") for s in SCHEMES]


@pytest.mark.parametrize(("name", "scheme"), CASES)
def test_executors_agree(name: str, scheme: str) -> None:
    """Symbolic (CasADi's LDL) and sparse (SuperLU): values to 1e-10, Jacobians to 1e-9."""
    theta, found = theta_of(name), {}
    slopes = {}
    for executor in ("symbolic", "sparse"):
        function = rollout(model_of(name), data_of(name), 300.0, SCHEMES[scheme], executor)  # type: ignore[arg-type]
        found[executor] = function(theta).full()
        x = ca.MX.sym("theta", theta.size)
        slopes[executor] = ca.Function("slopes", [x], [ca.jacobian(function(x), x)])(theta).full() * theta
    assert found["sparse"].shape == (2, STEPS)
    assert np.abs(found["symbolic"] - found["sparse"]).max() < 1e-10
    assert np.abs(slopes["symbolic"] - slopes["sparse"]).max() < 1e-9 * np.abs(slopes["sparse"]).max()


@pytest.mark.parametrize("executor", ["symbolic", "sparse"])
@pytest.mark.parametrize(("name", "scheme"), CASES)
def test_jacobian_is_that_of_finite_differences(name: str, scheme: str, executor: str) -> None:
    """Five-point differences, 1e-6 of the largest effect of each parameter."""
    theta = theta_of(name)
    function = rollout(model_of(name), data_of(name), 300.0, SCHEMES[scheme], executor)  # type: ignore[arg-type]
    x = ca.MX.sym("theta", theta.size)
    jacobian = ca.Function("slopes", [x], [ca.jacobian(function(x), x)])(theta).full()
    for j in range(theta.size):
        h = 2e-3 * theta[j]
        step = h * np.eye(theta.size)[j]
        near, far = ([function(theta + k * sign * step).full() for sign in (1, -1)] for k in (1, 2))
        wanted = (8.0 * (near[0] - near[1]) - (far[0] - far[1])) / (12.0 * h)
        effect = np.abs(wanted).max()
        assert effect > 0.0
        assert np.abs(jacobian[:, j] - wanted.ravel(order="F")).max() < 1e-6 * effect


def test_roll_out_is_step_after_step() -> None:
    model, data = model_of("table"), data_of("table")
    theta = theta_of("table")
    stepper = Stepper(model.matrices(theta), 300.0, IMPLICIT_EULER)
    states, means = data.initial[:, None], []
    for k in range(STEPS):
        states, mean, _, _ = stepper.advance(states, data.boundary[[k]].T, data.heat[[k]].T, data.airflow[[k]].T)
        means.append(mean[:, 0])
    np.testing.assert_allclose(rollout(model, data, 300.0)(theta).full(), np.array(means).T, rtol=0, atol=1e-12)


def test_symbolic_step_is_the_step() -> None:
    model, data, theta = model_of("table"), data_of("table"), theta_of("table")
    for scheme in SCHEMES.values():
        end, mean = symbolic_step(model, 300.0, scheme)(
            data.initial, data.boundary[0], data.heat[0], data.airflow[0], theta
        )
        wanted = Stepper(model.matrices(theta), 300.0, scheme).advance(
            data.initial[:, None], data.boundary[[0]].T, data.heat[[0]].T, data.airflow[[0]].T
        )
        np.testing.assert_allclose(end.full(), wanted[0], rtol=0, atol=1e-10)
        np.testing.assert_allclose(mean.full(), wanted[1], rtol=0, atol=1e-10)


def test_reduced_model_rolls_out_sparse() -> None:
    model, data, theta = model_of("plan"), data_of("plan"), theta_of("plan")
    whole = SymbolicModel(model.network, np.eye(model.network.n_node))
    np.testing.assert_allclose(
        rollout(whole, data, 300.0)(theta).full(), rollout(model, data, 300.0)(theta).full(), rtol=0, atol=1e-9
    )


def test_callback_survives_its_jacobian_in_an_optimisation() -> None:
    """CasADi keeps no reference to what `get_jacobian` returns: ask twice, and use it after garbage collection."""
    import gc

    theta = theta_of("plan")
    function = rollout(model_of("plan"), data_of("plan"), 300.0)
    x = ca.MX.sym("theta", theta.size)
    first = ca.Function("a", [x], [ca.jacobian(function(x), x)])
    second = ca.Function("b", [x], [ca.gradient(ca.sumsqr(function(x)), x)])
    gc.collect()
    jacobian = first(theta).full()
    means = function(theta).full().ravel(order="F")
    np.testing.assert_allclose(second(theta).full()[:, 0], 2.0 * jacobian.T @ means, rtol=1e-10)


@pytest.mark.parametrize("field", ["initial", "boundary", "heat", "airflow"])
def test_data_that_do_not_fit_are_refused_by_name(field: str) -> None:
    data = data_of("table")
    values = {k: getattr(data, k) for k in ("initial", "boundary", "heat", "airflow")}
    short = values | {field: values[field][..., :-1]}
    with pytest.raises(ModelError, match=rf"{field}: expected shape"):
        rollout(model_of("table"), RolloutData(**short), 300.0)
    spoilt = values[field].copy()
    spoilt.flat[1] = np.nan
    with pytest.raises(ModelError, match=rf"{field}: expected finite"):
        rollout(model_of("table"), RolloutData(**(values | {field: spoilt})), 300.0)


def test_symbolic_executor_refuses_what_it_cannot_do() -> None:
    model, data = model_of("plan"), data_of("plan")
    with pytest.raises(ModelError, match="grid"):
        rollout(SymbolicModel(model.network, np.eye(model.network.n_node)), data, 300.0, executor="symbolic")
    with pytest.raises(ModelError, match=r"'symbolic' or 'sparse'.*'dense'"):
        rollout(model, data, 300.0, executor="dense")  # type: ignore[arg-type]
