"""The paper's parameters on our networks by hand, and both searches where the least is known."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from scipy import integrate, stats

from thermal import SymbolicModel, ThermalNetwork, build_network, load_bundled_case

Network = ThermalNetwork


@pytest.fixture(scope="module")
def paper(script: Callable[[str], ModuleType]) -> ModuleType:
    return script("_paper_search")


@pytest.fixture(scope="module")
def network() -> Network:
    return build_network(load_bundled_case().building, dx=1.0)


def test_corners_and_middle_of_the_ranges(paper: ModuleType) -> None:
    assert list(paper.values(np.zeros(8)).values()) == [5.0, 0.01, 1.0, 100.0, 5.0, 0.5, 500.0, 0.0]
    upper = [800.0, 1.0, 3000.0, 2500.0, 800.0, 1500.0, 1500.0, 1.0]
    assert list(paper.values(np.ones(8)).values()) == pytest.approx(upper)
    middle = paper.values(np.full(8, 0.5))
    assert middle["exterior wall conductivity"] == pytest.approx(0.1)
    assert middle["interior wall heat capacity"] == pytest.approx(1000.0)
    assert middle["shuffle probability"] == pytest.approx(0.5)


def test_what_the_paper_found_lies_on_bounds(paper: ModuleType) -> None:
    """Six of eight exactly; 780 of 5 to 800 W/m/K within a hundredth of its range on a logarithmic scale."""
    scale = [np.log if r.logarithmic else float for r in paper.RANGES]
    point = [(f(r.best) - f(r.lower)) / (f(r.upper) - f(r.lower)) for f, r in zip(scale, paper.RANGES, strict=True)]
    on_bound = paper.Search(np.array([point]), np.zeros(1)).on_bound
    assert set(paper.values(np.ones(8))) - set(on_bound) == {"exterior wall density"}
    assert list(paper.values(np.array(point)).values()) == pytest.approx([r.best for r in paper.RANGES])


def test_walls_are_those_of_the_paper(paper: ModuleType, network: Network) -> None:
    """Classes of the network by hand: ρ c of its walls, k / half a cell of a partition, h in series with the wall."""
    tried = paper.values(np.random.default_rng(1).random(8))
    theta = paper.theta(network, tried)
    kappa, heat = (np.asarray(v).ravel() for v in SymbolicModel(network).classes(theta))
    capacity = dict(zip([c.name for c in network.capacities], heat, strict=True))
    conductance = dict(zip([c.name for c in network.conductances], kappa, strict=True))
    for wall in ("exterior", "interior"):
        product = tried[f"{wall} wall density"] * tried[f"{wall} wall heat capacity"]
        assert capacity[f"{wall}_wall"] == pytest.approx(product)
    assert network.spacing is not None
    inner = tried["interior wall conductivity"] / network.spacing
    assert conductance["interior_wall-interior_wall"] == pytest.approx(inner)
    thickness = load_bundled_case().building.geometry.cell_size
    insulation = thickness / tried["exterior wall conductivity"]
    outside = 1.0 / tried["exterior convection coefficient"] + insulation
    share = 1.0 / conductance["exterior_wall-outdoor"] - outside  # what is left is structure, of 0.15 m2K/W at most
    assert 0.0 < share < 0.15
    unknown = {"window_u_value", "slab_coupling", "furniture_coupling"}
    for p, value in zip(network.parameters, theta, strict=True):
        assert p.name not in unknown or value == p.start


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_corners_beyond_our_own_ranges_are_evaluated(paper: ModuleType, network: Network, share: float) -> None:
    theta = paper.theta(network, paper.values(np.full(8, share)))
    matrices = SymbolicModel(network).matrices(theta)
    assert np.isfinite(matrices.flow.data).all()
    assert (matrices.capacity.diagonal() >= 0.0).all()


class Bowl:
    """A function with its least, 0.3, at a point of which five coordinates lie on bounds."""

    def __init__(self) -> None:
        self.least = np.array([1.0, 0.0, 0.9, 1.0, 0.5, 0.0, 0.3, 1.0])
        self.weight = np.array([3.0, 5.0, 0.5, 1.0, 0.2, 0.3, 0.1, 2.0])
        self.calls = 0

    def __call__(self, point: np.ndarray) -> float:
        self.calls += 1
        assert ((point >= 0.0) & (point <= 1.0)).all()
        return 0.3 + float(np.sqrt(self.weight @ (point - self.least) ** 2))


def test_the_plain_search_is_a_hundred_points_of_one_sequence(paper: ModuleType) -> None:
    bowl = Bowl()
    found = paper.sobol_search(bowl, seed=3)
    assert bowl.calls == len(found.errors) == 100
    assert bowl(found.best) == found.errors.min()
    again, other = paper.sobol_search(bowl, 50, seed=3), paper.sobol_search(bowl, seed=4)
    assert np.array_equal(again.points, found.points[:50])
    assert not np.array_equal(other.points, found.points)
    # spread evenly: each half of each range is tried as often, but for the 28 points of the sequence left out
    assert np.abs((found.points < 0.5).sum(axis=0) - 50).max() <= 14


def test_the_bayesian_search_beats_it_and_reaches_bounds(paper: ModuleType) -> None:
    bowl = Bowl()
    plain = paper.sobol_search(bowl, seed=0)
    bowl.calls = 0
    found = paper.bayesian_search(bowl, 45, seed=0)
    assert bowl.calls == len(found.errors) == 45
    assert np.array_equal(found.points[: paper.FIRST_POINTS], plain.points[: paper.FIRST_POINTS])
    assert found.errors.min() - 0.3 < 0.3 * (plain.errors.min() - 0.3)
    sharp = [r.name for r, w in zip(paper.RANGES, bowl.weight, strict=True) if w >= 1.0]
    assert set(found.on_bound) >= set(sharp)
    assert np.array_equal(paper.bayesian_search(bowl, 18, seed=0).points, found.points[:18])


def test_the_process_is_a_gaussian_process(paper: ModuleType) -> None:
    """Likelihood of its data, prediction and expected improvement against the textbook's formulas, done densely."""
    rng = np.random.default_rng(0)
    points, at = rng.random((12, 3)), rng.random((4, 3))
    data = np.sin(4.0 * points[:, 0]) + points[:, 1]
    process = paper.fit_process(points, data)
    lengths, noise = np.exp(process.scales[:-1]), np.exp(process.scales[-1])

    def kernel(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        r = np.sqrt((((a[:, None] - b) / lengths) ** 2).sum(axis=2))
        return (1.0 + np.sqrt(5.0) * r + 5.0 / 3.0 * r**2) * np.exp(-np.sqrt(5.0) * r)

    inverse = np.linalg.inv(kernel(points, points) + noise * np.eye(12))
    mean = (inverse @ data).sum() / inverse.sum()
    variance = (data - mean) @ inverse @ (data - mean) / 12
    cross = kernel(at, points)
    expected = mean + cross @ inverse @ (data - mean)
    deviation = np.sqrt(variance * (1.0 - np.einsum("ij,jk,ik->i", cross, inverse, cross)))
    found = process.predict(at)
    assert found[0] == pytest.approx(expected, rel=1e-6, abs=1e-8)
    assert found[1] == pytest.approx(deviation, rel=1e-4, abs=1e-7)
    best = float(data.min())
    gain = [
        integrate.quad(lambda y, m=m, s=s: (best - y) * stats.norm.pdf(y, m, s), m - 12.0 * s, best)[0]
        if best > m - 12.0 * s
        else 0.0
        for m, s in zip(*found, strict=True)
    ]
    assert np.exp(paper.log_improvement(process, at, best)) == pytest.approx(gain, rel=1e-4, abs=1e-10)
