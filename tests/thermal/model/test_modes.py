"""Conduction against exact solutions: decay of modes in space and time, composite walls, films."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.optimize import brentq

from thermal.model.matrices import Matrices, SymbolicModel
from thermal.model.step import IMPLICIT_EULER, SCHEMES, TR_BDF2, Scheme, Stepper
from thermal.network.graph import GraphBuilder
from thermal.network.network import ThermalNetwork

FloatArray = NDArray[np.float64]

LENGTH, CONDUCTIVITY, HEAT = 2.0, 1.7, 1.2e6  # m, W/m/K, J/m3/K
DIFFUSIVITY = CONDUCTIVITY / HEAT


def finished(graph: GraphBuilder, heated: FloatArray | None = None) -> ThermalNetwork:
    """Close a graph of one zone that is everything; heat goes to all volumes alike."""
    share = np.full(graph.size, 1.0 / graph.size) if heated is None else heated
    mean = sp.csr_matrix(np.full((1, graph.size), 1.0 / graph.size))
    return graph.finish(mean, sp.csr_matrix(share[:, None]), ())


def wall(
    conductivity: FloatArray, heat: FloatArray, dx: float, left: str, right: str, film: float = np.inf
) -> ThermalNetwork:
    """A row of cells of 1 m2; each end is ``adiabatic``, ``fixed`` (temperature at the face) or ``film`` (in series)."""
    graph = GraphBuilder(("all",), ("outdoor",), {})
    n = conductivity.size
    nodes = graph.volumes("solid", np.zeros(n))
    for i in range(n):
        graph.capacity(f"c{heat[i]}", heat[i], nodes[i], dx)
    for i in range(n - 1):
        half = 0.5 * dx
        value = 1.0 / (half / conductivity[i] + half / conductivity[i + 1])
        graph.face(f"k{conductivity[i]}-{conductivity[i + 1]}", ca.SX(value), nodes[i], nodes[i + 1], 1.0)
    for side, node in ((left, 0), (right, n - 1)):
        if side != "adiabatic":
            resistance = 0.5 * dx / conductivity[node] + (0.0 if side == "fixed" else 1.0 / film)
            graph.face(f"end {node}", ca.SX(1.0 / resistance), nodes[node], graph.boundary("outdoor"), 1.0)
    return finished(graph)


def uniform(n: int, left: str, right: str) -> ThermalNetwork:
    return wall(np.full(n, CONDUCTIVITY), np.full(n, HEAT), LENGTH / n, left, right)


def dense(network: ThermalNetwork) -> tuple[Matrices, FloatArray, FloatArray]:
    """Matrices, and C (diagonal) and K as arrays."""
    matrices = SymbolicModel(network).matrices(network.start())
    n = matrices.n
    return matrices, matrices.capacity.toarray(), matrices.flow[:, :n].toarray()


def marched(
    network: ThermalNetwork, start: FloatArray, time: float, steps: int, scheme: Scheme, **inputs: float
) -> FloatArray:
    """States after a number of steps with constant inputs."""
    matrices, _, _ = dense(network)
    stepper = Stepper(matrices, time / steps, scheme)
    boundary = np.full((1, 1), inputs.get("outdoor", 0.0))
    heat = np.full((1, 1), inputs.get("heat", 0.0))
    states = start[:, None]
    for _ in range(steps):
        states = stepper.advance(states, boundary, heat)[0]
    return states[:, 0]


def orders(errors: list[float]) -> FloatArray:
    """Observed order between halvings."""
    e = np.array(errors)
    return np.log2(e[:-1] / e[1:])


MODES: dict[str, tuple[str, str, Callable[[FloatArray], FloatArray], float]] = {
    "cosine": ("adiabatic", "adiabatic", lambda x: np.cos(2 * np.pi * x / LENGTH), 2 * np.pi / LENGTH),
    "sine": ("fixed", "fixed", lambda x: np.sin(np.pi * x / LENGTH), np.pi / LENGTH),
    "quarter": ("adiabatic", "fixed", lambda x: np.cos(0.5 * np.pi * x / LENGTH), 0.5 * np.pi / LENGTH),
}


@pytest.mark.parametrize("mode", MODES)
def test_decay_of_a_mode_is_second_order_in_space(mode: str) -> None:
    """The semi-discrete decay (scipy.linalg.expm) tends to the exact one at second order."""
    left, right, shape, k = MODES[mode]
    time = 0.7 / (DIFFUSIVITY * k**2)
    errors = []
    for n in (10, 20, 40, 80):
        _, c, stiffness = dense(uniform(n, left, right))
        x = (np.arange(n) + 0.5) * LENGTH / n
        state = sl.expm(-time * stiffness / np.diag(c)[:, None]) @ shape(x)
        errors.append(np.abs(state - np.exp(-DIFFUSIVITY * k**2 * time) * shape(x)).max())
    assert ((orders(errors) > 1.9) & (orders(errors) < 2.1)).all(), orders(errors)


@pytest.mark.parametrize(("scheme", "low", "high"), [("implicit_euler", 0.9, 1.1), ("tr_bdf2", 1.9, 2.1)])
def test_steps_are_of_their_order_in_time(scheme: str, low: float, high: float) -> None:
    """Against scipy.linalg.expm on the same grid, with heat and a boundary that are not zero."""
    network = uniform(16, "adiabatic", "fixed")
    matrices, c, stiffness = dense(network)
    rng = np.random.default_rng(3)
    start = 20.0 + 5.0 * rng.random(16)
    boundary, heat = 11.0, 40.0
    source = (-matrices.flow[:, 16:].toarray()[:, 0] * boundary + heat / 16.0) / np.diag(c)
    generator = np.block([[-stiffness / np.diag(c)[:, None], source[:, None]], [np.zeros((1, 17))]])
    time = 0.2 * LENGTH**2 / DIFFUSIVITY
    exact = (sl.expm(time * generator) @ np.append(start, 1.0))[:16]
    counts = (512, 1024, 2048, 4096) if scheme == "tr_bdf2" else (256, 512, 1024, 2048)
    errors = [
        np.abs(marched(network, start, time, m, SCHEMES[scheme], outdoor=boundary, heat=heat) - exact).max()
        for m in counts
    ]
    assert ((orders(errors) > low) & (orders(errors) < high)).all(), orders(errors)


@pytest.mark.parametrize(("scheme", "low", "high"), [("implicit_euler", 0.9, 1.1), ("tr_bdf2", 1.9, 2.1)])
def test_steps_tend_to_the_exact_mode_when_space_and_time_are_refined(scheme: str, low: float, high: float) -> None:
    """One mode, both errors at once: dt ~ dx for TR-BDF2, dt ~ dx for Euler too, whose first order then shows."""
    left, right, shape, k = MODES["quarter"]
    time = 1.0 / (DIFFUSIVITY * k**2)
    errors = []
    for n in (20, 40, 80, 160):
        x = (np.arange(n) + 0.5) * LENGTH / n
        state = marched(uniform(n, left, right), shape(x), time, n, SCHEMES[scheme])
        errors.append(np.abs(state - np.exp(-1.0) * shape(x)).max())
    assert ((orders(errors) > low) & (orders(errors) < high)).all(), orders(errors)


def test_mode_of_a_plate_is_second_order_in_space() -> None:
    """Product of a cosine and a sine on a rectangle with square cells."""
    errors = []
    for n in (6, 12, 24, 48):
        dx = 1.0 / n
        graph = GraphBuilder(("all",), ("outdoor",), {})
        nodes = graph.volumes("solid", np.zeros(2 * n * n)).reshape(n, 2 * n)
        graph.capacity("solid", HEAT, nodes.ravel(), dx * dx)
        for a, b in ((nodes[:-1], nodes[1:]), (nodes[:, :-1], nodes[:, 1:])):
            graph.face("solid-solid", ca.SX(CONDUCTIVITY), a.ravel(), b.ravel(), 1.0)
        for edge in (nodes[0], nodes[-1]):
            graph.face("edge", ca.SX(CONDUCTIVITY), edge, graph.boundary("outdoor"), 2.0)
        network = finished(graph)
        matrices = SymbolicModel(network).matrices(network.start())
        y, x = np.meshgrid((np.arange(n) + 0.5) * dx, (np.arange(2 * n) + 0.5) * dx, indexing="ij")
        shape = (np.sin(np.pi * y) * np.cos(np.pi * x)).ravel()
        rate = DIFFUSIVITY * 2 * np.pi**2
        # the mode is an eigenvector of the grid: its decay rate is a Rayleigh quotient
        found = shape @ (matrices.flow[:, : matrices.n] @ shape) / (shape @ (matrices.capacity @ shape))
        states, stepper = shape[:, None], Stepper(matrices, 0.01 / rate, TR_BDF2)
        for _ in range(5):
            states = stepper.advance(states, np.zeros((1, 1)), np.zeros((1, 1)))[0]
        np.testing.assert_allclose(states[:, 0], states[0, 0] / shape[0] * shape, atol=1e-12)
        errors.append(abs(found / rate - 1.0))
    assert ((orders(errors) > 1.9) & (orders(errors) < 2.1)).all(), orders(errors)


def test_slowest_mode_of_a_composite_wall_with_a_film_is_second_order() -> None:
    """Two layers, the inner end adiabatic, a film outside; the exact rate solves a transcendental equation."""
    k1, k2, c1, c2, a, total, film = 0.04, 1.8, 3.0e4, 2.0e6, 0.4, 1.0, 25.0

    def mismatch(rate: float) -> float:
        b1, b2 = np.sqrt(rate * c1 / k1), np.sqrt(rate * c2 / k2)
        # cos(b1 x) inside; P cos(b2 (x - a)) + Q sin(b2 (x - a)) outside, continuous in temperature and flow
        p, q = np.cos(b1 * a), -k1 * b1 * np.sin(b1 * a) / (k2 * b2)
        s, c = np.sin(b2 * (total - a)), np.cos(b2 * (total - a))
        return float(k2 * b2 * (-p * s + q * c) + film * (p * c + q * s))

    rates = np.linspace(1e-8, 5e-6, 4000)
    values = np.array([mismatch(r) for r in rates])
    first = int(np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:]))[0])
    exact = brentq(mismatch, rates[first], rates[first + 1], xtol=1e-16)
    errors = []
    for n in (10, 20, 40, 80):
        inside = (np.arange(n) + 0.5) / n < a
        network = wall(np.where(inside, k1, k2), np.where(inside, c1, c2), total / n, "adiabatic", "film", film)
        _, c, stiffness = dense(network)
        errors.append(abs(sl.eigh(stiffness, c, eigvals_only=True)[0] / exact - 1.0))
    assert ((orders(errors) > 1.9) & (orders(errors) < 2.1)).all(), orders(errors)


@pytest.mark.parametrize("n", [2, 10, 50])
def test_steady_flow_through_a_composite_wall_with_a_film_is_exact(n: int) -> None:
    """Series resistances: the flow is the exact one on any grid that resolves the layers."""
    k1, k2, film, outdoor, heat = 0.04, 1.8, 12.0, 268.0, 30.0
    inside = np.arange(n) < n // 2
    graph = wall(np.where(inside, k1, k2), np.full(n, 1e6), 1.0 / n, "adiabatic", "film", film)
    matrices, _, stiffness = dense(graph)
    source = np.zeros(n)
    source[0] = heat
    states = np.linalg.solve(stiffness, source - matrices.flow[:, n:].toarray()[:, 0] * outdoor)
    centre = 0.5 / n
    assert states[0] - outdoor == pytest.approx(heat * ((0.5 - centre) / k1 + 0.5 / k2 + 1.0 / film), rel=1e-11)


def test_both_schemes_keep_a_steady_state_and_damp_what_is_stiff() -> None:
    """L-stability: a step a thousand times the slowest time constant leaves the steady state only, without ringing."""
    network = uniform(12, "fixed", "fixed")
    _, c, stiffness = dense(network)
    slowest = 1.0 / sl.eigh(stiffness, c, eigvals_only=True)[0]
    rough = np.where(np.arange(12) % 2, 30.0, 10.0)
    for scheme in (IMPLICIT_EULER, TR_BDF2):
        ended = marched(network, rough, 1e3 * slowest, 1, scheme, outdoor=20.0)
        assert np.abs(ended - 20.0).max() < 0.02 * np.abs(rough - 20.0).max()
        np.testing.assert_allclose(
            marched(network, np.full(12, 20.0), 1e3 * slowest, 1, scheme, outdoor=20.0), 20.0, rtol=1e-13
        )


@pytest.mark.parametrize(("scheme", "order"), [("implicit_euler", 1.0), ("tr_bdf2", 2.0)])
def test_mean_over_a_step_is_of_the_order_of_the_scheme(scheme: str, order: float) -> None:
    """Telemetry holds means over a step: the mean over the last of n steps against the integral of the exact solution."""
    network = uniform(8, "adiabatic", "fixed")
    matrices, c, stiffness = dense(network)
    decay = stiffness / np.diag(c)[:, None]
    start, time = np.linspace(25.0, 15.0, 8), 4e5
    errors = []
    for count in (64, 128, 256, 512):
        step = time / count
        states, stepper = start[:, None], Stepper(matrices, step, SCHEMES[scheme])
        for _ in range(count):
            states, mean, _, _ = stepper.advance(states, np.zeros((1, 1)), np.zeros((1, 1)))
        before = sl.expm(-(time - step) * decay) @ start
        exact = np.linalg.solve(decay, (np.eye(8) - sl.expm(-step * decay)) @ before) / step
        errors.append(abs(mean[0, 0] - exact.mean()))
    assert np.abs(orders(errors) - order).max() < 0.1, orders(errors)
