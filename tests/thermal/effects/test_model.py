"""Every effect as a term of the model: nothing at strength 0, exact slopes, one answer from every executor."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from thermal import (
    Case,
    Simulator,
    SymbolicModel,
    ThermalNetwork,
    build_network,
    free_runs,
    reduced_model,
    replay_inputs,
    spin_up,
)
from thermal.effects.catalogue import CATALOGUE, chosen, effect_of
from thermal.effects.unknown import UNKNOWN
from thermal.errors import ModelError
from thermal.inputs.provider import telemetry_inputs
from thermal.inputs.signals import signal_values
from thermal.model.case_replay import Inputs
from thermal.model.rollouts import RolloutData, rollout
from thermal.model.step import IMPLICIT_EULER, TR_BDF2, Scheme
from thermal.units import REFERENCE_TEMPERATURE

FloatArray = NDArray[np.float64]
CaseOf = Callable[[str], Case]

KINDS = ("plan", "table")
EFFECTS = (*CATALOGUE, *UNKNOWN)
STARTS, STEPS = np.array([100, 220]), 24


def with_effects(case: Case, *ids: str) -> ThermalNetwork:
    wanted = [*ids, *(r for name in ids for r in effect_of(name).requires)]
    return build_network(case.building, effects=chosen(wanted))


def typical(network: ThermalNetwork, size: float = 0.4) -> FloatArray:
    """θ with the effects' strengths at a share of their range that is no knot, and the rest at its start."""
    values = {p.name: size * p.upper for p in network.parameters if p.effect and p.start == 0.0}
    return network.values(values)


def trajectories(model: SymbolicModel, inputs: Inputs, theta: FloatArray, slopes: bool = False):
    """Spun up and run freely: zone means, and their derivatives."""
    matrices = model.matrices(theta, slopes)
    states, moved = spin_up(matrices, inputs, 0, STARTS)
    return free_runs(matrices, inputs, STARTS, STEPS, states, moved)


@cache
def _baseline(case: Case) -> FloatArray:
    network = build_network(case.building)
    return trajectories(SymbolicModel(network), replay_inputs(case, network), network.start())[0]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", EFFECTS)
def test_at_no_strength_nothing_changes(lively_case: CaseOf, kind: str, name: str) -> None:
    case = lively_case(kind)
    network = with_effects(case, name)
    means, _ = trajectories(SymbolicModel(network), replay_inputs(case, network), network.start())
    # a sensor at rest still joins the air volumes of a plan's zone, by a ten thousandth of their heat a minute
    most = 2e-4 if (kind, name) == ("plan", "sensor_lag") else 1e-9
    assert np.abs(means - _baseline(case)).max() < most


@pytest.mark.parametrize("kind", KINDS)
def test_a_network_with_effects_keeps_the_baseline_in_front(lively_case: CaseOf, kind: str) -> None:
    case = lively_case(kind)
    plain, network = build_network(case.building), with_effects(case, *EFFECTS)
    assert [p.name for p in network.parameters if p.effect is None] == [p.name for p in plain.parameters]
    assert network.boundaries == plain.boundaries
    assert network.n_boundary == plain.n_boundary + len(network.signals)
    assert (network.kind[: plain.n_node] == plain.kind).all()
    assert len({s.name for s in network.signals}) == len(network.signals)


def difference_quotient(
    value: Callable[[FloatArray], FloatArray], theta: FloatArray, way: FloatArray, step: float
) -> FloatArray:
    """Derivative along a way to the fourth order, central or forward where a strength cannot be negative."""
    if (theta[way != 0.0] == 0.0).any():
        f = [value(theta + k * step * way) for k in range(5)]
        return (-25.0 * f[0] + 48.0 * f[1] - 36.0 * f[2] + 16.0 * f[3] - 3.0 * f[4]) / (12.0 * step)
    f = [value(theta + k * step * way) for k in (-2, -1, 1, 2)]
    return (f[0] - 8.0 * f[1] + 8.0 * f[2] - f[3]) / (12.0 * step)


@pytest.mark.parametrize("size", [0.0, 0.4])
@pytest.mark.parametrize("name", EFFECTS)
def test_slopes_of_the_grid_and_of_the_modes(lively_case: CaseOf, name: str, size: float) -> None:
    """Along a way in which every parameter of the effect moves by its own random share of its range, and films too."""
    case = lively_case("table")
    network = with_effects(case, name)
    grid, inputs, theta = SymbolicModel(network), replay_inputs(case, network), typical(network, size)
    models = (grid, reduced_model(grid, [typical(network)], shifts=(1e-6, 1e-4, 1e-2)))
    moved = [p.effect is not None or p.name == "exterior_convection_coefficient" for p in network.parameters]
    spans = [max(abs(at), 0.1 * (p.upper - p.lower)) for p, at in zip(network.parameters, theta, strict=True)]
    way = np.where(moved, spans, 0.0) * np.random.default_rng(5).uniform(0.5, 1.0, theta.size)
    step = 2e-5 if name == "blinds" else 2e-4  # curtains begin to move at an irradiance
    for model in models:
        _, slopes = trajectories(model, inputs, theta, slopes=True)
        numbers = difference_quotient(lambda t, m=model: trajectories(m, inputs, t)[0], theta, way, step)
        most = 1e-6 * np.abs(numbers).max() + 5e-12 / step  # the second for round-off
        assert np.abs(slopes @ way - numbers).max() < most, model


@pytest.mark.parametrize("kind", KINDS)
def test_the_modes_follow_the_grid(lively_case: CaseOf, kind: str) -> None:
    case = lively_case(kind)
    network = with_effects(case, *EFFECTS)
    grid, inputs = SymbolicModel(network), replay_inputs(case, network)
    small = reduced_model(grid, [typical(network)])
    for size in (0.0, 0.4, 0.8):
        theta = typical(network, size)
        difference = trajectories(grid, inputs, theta)[0] - trajectories(small, inputs, theta)[0]
        assert np.abs(difference).max() < 8e-3, size


@pytest.mark.parametrize("scheme", [IMPLICIT_EULER, TR_BDF2])
@pytest.mark.parametrize("kind", KINDS)
def test_symbolic_and_sparse_executor_agree(lively_case: CaseOf, kind: str, scheme: Scheme) -> None:
    case = lively_case(kind)
    network = with_effects(case, *EFFECTS)
    model, inputs, rows = SymbolicModel(network), replay_inputs(case, network), slice(60, 66)
    boundary = inputs.boundary[rows] - REFERENCE_TEMPERATURE
    start = np.random.default_rng(2).normal(0.0, 2.0, network.n_node)
    data = RolloutData(start, boundary, inputs.heat[rows], inputs.airflow[rows])
    theta = typical(network)
    found = [np.asarray(rollout(model, data, inputs.step, scheme, e)(theta)) for e in ("symbolic", "sparse")]
    assert np.abs(found[0] - found[1]).max() < 1e-10


@pytest.mark.parametrize("kind", KINDS)
def test_the_simulator_has_the_effects(lively_case: CaseOf, kind: str) -> None:
    case = lively_case(kind)
    network = with_effects(case, *EFFECTS)
    theta = typical(network)
    values = dict(zip([p.name for p in network.parameters], theta, strict=True))
    plant = Simulator(case.building, values, step_seconds=case.step, effects=chosen(EFFECTS))
    inputs, signals = replay_inputs(case, network), signal_values(network.signals, telemetry_inputs(case))
    plant.reset(inputs.zone[100], inputs.boundary[100, : len(network.boundaries)], signals[100])
    states = plant.states[:, None]
    zones = [
        plant.step(inputs.heat[k], inputs.boundary[k, : len(network.boundaries)], inputs.airflow[k], signals[k])
        for k in range(101, 101 + STEPS)
    ]
    means, _ = free_runs(SymbolicModel(network).matrices(theta), inputs, np.array([100]), STEPS, states)
    assert [s.name for s in plant.network.signals] == [s.name for s in network.signals]
    assert np.abs(np.array(zones) - means[0]).max() < 1e-9
    with pytest.raises(ModelError, match=rf"signals: expected shape \({len(network.signals)},\), got \(0,\)"):
        plant.step(inputs.heat[101], inputs.boundary[101, : len(network.boundaries)], inputs.airflow[101])


def test_the_simulator_rests_where_effects_and_heat_balance(lively_case: CaseOf) -> None:
    # ground at 10 degC under a building without any other heat: everything comes to that temperature
    case = lively_case("table")
    plant = Simulator(
        case.building, {"ground_u_value": 1.0, "ground_temperature": 283.15}, effects=chosen(["ground_exchange"])
    )
    signals = np.array(
        [0.0 if name == "constant temperature" else 1.0 for name in (s.name for s in plant.network.signals)]
    )
    cold = np.full(2, 283.15)
    assert plant.reset(cold, cold, signals) == pytest.approx(cold, abs=1e-9)
    assert plant.step(np.zeros(2), cold, np.zeros(1), signals) == pytest.approx(cold, abs=1e-9)


def test_a_strength_that_a_solver_leaves_a_hair_below_zero_is_absent(lively_case: CaseOf) -> None:
    """Ipopt relaxes bounds by 1e-8; a conductance that is negative in earnest is refused."""
    network = build_network(lively_case("plan").building, effects=chosen(["infiltration"]))
    model, at = SymbolicModel(network), [p.name for p in network.parameters].index("infiltration_by_wind")
    theta = network.start()
    theta[at] = -1e-8
    relaxed, absent = model.matrices(theta).flow, model.matrices(network.start()).flow
    n = network.n_node + len(network.boundaries)
    assert (relaxed[:, :n] != absent[:, :n]).nnz == 0
    theta[at] = -1e-2
    with pytest.raises(ModelError, match="negative"):
        model.matrices(theta)
