import doctest
from dataclasses import dataclass

import casadi
import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from thermal.errors import ModelError
from thermal.shuffle import equivalent as _equivalent
from thermal.shuffle.equivalent import (
    choose_equivalent,
    effective_diffusivity,
    exchange_rate,
    mean_square_reach,
    mixing_factor,
    mixing_rate,
)
from thermal.shuffle.random import RandomShuffle

STEP, N_STEP = 300.0, 48  # [s], four hours
AIR = 1.2 * 1006.0  # [J/m3/K]
FILM, HEIGHT, CELL = 2.5, 3.0, 0.5  # [W/m2/K], [m], [m]


# The equations


def test_mean_square_reach_of_a_few_cells_and_of_many():
    assert mean_square_reach(1.0, 1.0) == pytest.approx(4.0 / 5.0)
    assert mean_square_reach(0.75, 0.5) == pytest.approx((4 * 0.25 + 4 * 0.5) / 9.0)
    assert mean_square_reach(0.4, 0.5) == 0.0
    assert mean_square_reach(10.0, 0.1) == pytest.approx(50.0, rel=1e-3)  # r²/2


def test_effective_diffusivity_by_hand():
    assert effective_diffusivity(0.6, 2.0, 300.0) == pytest.approx(0.6 * 2.0 / 600.0)


def test_mixing_factor_by_hand():
    assert mixing_factor(0.0) == 1.0
    assert mixing_factor(1.0) == 0.0
    assert mixing_factor(0.5) == pytest.approx(0.30326532985631671)
    np.testing.assert_allclose(mixing_factor(np.array([0.0, 0.5])), [1.0, 0.30326532985631671])


def test_rates_by_hand():
    assert mixing_rate(0.0, STEP, STEP) == 0.0
    assert mixing_rate(0.5, STEP, STEP) == pytest.approx((1.0 / 0.30326532985631671 - 1.0) / STEP)
    assert mixing_rate(1.0, STEP, STEP) == mixing_rate(0.98, STEP, STEP)  # capped
    assert exchange_rate(0.5, STEP) == pytest.approx((1.0 - 0.30326532985631671) / STEP)
    assert exchange_rate(1.0, STEP) == pytest.approx(1.0 / STEP)


def test_mixing_rate_of_short_steps_tends_to_the_exponential_one():
    assert mixing_rate(0.5, STEP, 1e-3) == pytest.approx(-np.log(mixing_factor(0.5)) / STEP, rel=1e-5)


@pytest.mark.parametrize("step", [60.0, 300.0, 900.0])
@pytest.mark.parametrize("p", [0.1, 0.5, 0.98])
def test_star_node_mixes_exactly(p, step):
    capacities = np.array([100.0, 250.0, 400.0, 50.0])
    n = len(capacities)
    temperatures = np.array([290.0, 300.0, 295.0, 310.0])
    ties = mixing_rate(p, STEP, step) * capacities
    matrix = np.diag(np.append(capacities / step + ties, ties.sum()))  # C/Δt + K, the star node last and massless
    matrix[:n, n] = matrix[n, :n] = -ties
    stepped = np.linalg.solve(matrix, np.append(capacities / step * temperatures, 0.0))[:n]
    mean = capacities @ temperatures / capacities.sum()
    factor = mixing_factor(p) ** (step / STEP)
    expected = mean + factor * (temperatures - mean)
    np.testing.assert_allclose(stepped, expected, rtol=max(1e-12, 1e-15 / factor))  # stiff: conductances of C/Δt/λ


def test_equations_take_casadi_expressions_and_their_derivatives_are_right():
    p = casadi.SX.sym("p")
    expressions = [
        effective_diffusivity(p, 2.0, STEP),
        mixing_factor(p),
        mixing_rate(p, STEP, 2.0 * STEP),
        exchange_rate(p, STEP),
    ]
    stacked = casadi.vertcat(*expressions)
    function = casadi.Function("f", [p], [stacked, casadi.jacobian(stacked, p)])

    def numbers(x):
        return np.array(
            [
                effective_diffusivity(x, 2.0, STEP),
                mixing_factor(x),
                mixing_rate(x, STEP, 2 * STEP),
                exchange_rate(x, STEP),
            ]
        )

    for x in (0.05, 0.5, 0.9):
        value, slope = function(x)
        np.testing.assert_allclose(np.array(value).ravel(), numbers(x), rtol=1e-13)
        difference = (numbers(x + 1e-6) - numbers(x - 1e-6)) / 2e-6
        np.testing.assert_allclose(np.array(slope).ravel(), difference, rtol=1e-7)
    assert isinstance(mixing_factor(casadi.MX.sym("p")), casadi.MX)


@pytest.mark.parametrize("probability", [-0.1, 1.1, np.nan, np.array([0.5, 2.0])])
def test_probabilities_out_of_range_are_refused(probability):
    for call in (
        lambda: effective_diffusivity(probability, 1.0, STEP),
        lambda: mixing_factor(probability),
        lambda: mixing_rate(probability, STEP, STEP),
        lambda: exchange_rate(probability, STEP),
    ):
        with pytest.raises(ModelError, match="probability in"):
            call()


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: mean_square_reach(0.0, 1.0), "reach"),
        (lambda: mean_square_reach(1.0, -1.0), "cell_size"),
        (lambda: mixing_rate(0.5, 0.0, STEP), "shuffle_step"),
        (lambda: mixing_rate(0.5, STEP, np.inf), "step"),
        (lambda: exchange_rate(0.5, np.nan), "shuffle_step"),
        (lambda: choose_equivalent((0.0, 3.0), 1.0), "zone_extent"),
        (lambda: choose_equivalent((3.0, 3.0), 0.0), "reach"),
    ],
)
def test_lengths_and_steps_out_of_range_are_refused(call, name):
    with pytest.raises(ModelError, match=name):
        call()


def test_choice_follows_the_longer_side():
    assert choose_equivalent((100.0, 100.0), None) == "mixing"
    assert choose_equivalent((3.0, 4.0), 5.0) == "mixing"
    assert choose_equivalent((3.0, 12.0), 4.0) == "mixing"
    assert choose_equivalent((12.1, 3.0), 4.0) == "diffusivity"


def test_examples():
    assert doctest.testmod(_equivalent).failed == 0


# Their agreement with the mean of the random shuffle


def test_displacement_in_a_large_zone_is_that_of_the_diffusivity():
    n, n_run = 60, 10
    columns, rows = np.divmod(np.arange(n * n), n)
    positions = np.tile(np.column_stack([columns, rows]) * CELL, (n_run, 1))
    zones = list(np.arange(n_run * n * n).reshape(n_run, n * n))
    inner = np.tile((np.minimum(columns, rows) >= 20) & (np.maximum(columns, rows) < 40), n_run)
    for p, reach in ((0.2, 1.2), (0.5, 2.5), (1.0, 1.2)):
        parcels = RandomShuffle(zones, positions, p, reach, seed=1).apply(np.arange(float(len(positions)))).astype(int)
        squared = np.square(positions[parcels] - positions).sum(axis=1)[inner]
        expected = 4.0 * effective_diffusivity(p, mean_square_reach(reach, CELL), STEP) * STEP
        assert squared.mean() == pytest.approx(expected, rel=0.05), f"p = {p}, reach {reach} m"


@dataclass(frozen=True)
class Room:
    """A room that loses heat through one wall, with a diffuser of 1 W in its middle."""

    n_column: int
    n_row: int
    conductivity: float  # [W/m/K] of the air

    @property
    def n(self):
        return self.n_column * self.n_row

    @property
    def capacity(self):
        return AIR * HEIGHT * CELL**2

    @property
    def heat(self):
        heat = np.zeros(self.n)
        heat[self.n_column // 2 * self.n_row + self.n_row // 2] = 1.0
        return heat

    def conduction(self, conductivity):
        """Conductance matrix of the air-air faces [W/K]."""

        def chain(n):
            links = sp.diags_array([np.ones(n - 1), np.ones(n - 1)], offsets=[-1, 1], shape=(n, n))
            return sp.diags_array(links.sum(axis=1)) - links

        columns, rows = sp.eye_array(self.n_column), sp.eye_array(self.n_row)
        return conductivity * HEIGHT * (sp.kron(chain(self.n_column), rows) + sp.kron(columns, chain(self.n_row)))

    def step_matrix(self):
        """C/Δt + K [W/K]."""
        wall = np.zeros(self.n)
        wall[: self.n_row] = FILM * HEIGHT * CELL
        return sp.csc_array(self.conduction(self.conductivity) + sp.diags_array(wall + self.capacity / STEP))

    def random_means(self, probability, reach, n_run=200, seed=3):
        """Zone-mean temperature rise of random runs (n_step, n_run) [K]: conduct, then shuffle."""
        solve = splu(self.step_matrix()).solve
        columns, rows = np.divmod(np.arange(self.n), self.n_row)
        positions = np.tile(np.column_stack([columns, rows]) * CELL, (n_run, 1))
        zones = list(np.arange(n_run * self.n).reshape(n_run, self.n))
        shuffle = RandomShuffle(zones, positions, probability, reach, seed)
        temperatures, means = np.zeros((n_run, self.n)), []
        for _ in range(N_STEP):
            conducted = solve((self.capacity / STEP * temperatures + self.heat).T).T
            temperatures = shuffle.apply(conducted.ravel()).reshape(temperatures.shape)
            means.append(temperatures.mean(axis=1))
        return np.array(means)

    def implicit_means(self, matrix, factor=1.0):
        """Zone-mean temperature rise (n_step,) [K] of implicit steps, deviations from the mean scaled after each."""
        solve = splu(sp.csc_array(matrix)).solve
        temperatures, means = np.zeros(self.n), []
        for _ in range(N_STEP):
            sources = np.zeros(matrix.shape[0])
            sources[: self.n] = self.capacity / STEP * temperatures + self.heat
            temperatures = solve(sources)[: self.n]
            temperatures = temperatures.mean() + factor * (temperatures - temperatures.mean())
            means.append(temperatures.mean())
        return np.array(means)

    def with_diffusivity(self, diffusivity):
        return self.implicit_means(self.step_matrix() + self.conduction(AIR * diffusivity))

    def with_star(self, rate):
        ties = np.full((self.n, 1), rate * self.capacity)
        cells = self.step_matrix() + sp.diags_array(ties.ravel())
        rows = [[cells, sp.csr_array(-ties)], [sp.csr_array(-ties.T), sp.csr_array([[ties.sum()]])]]
        return self.implicit_means(sp.block_array(rows))


def error(result, runs):
    """Largest error of a zone mean, as a share of the largest rise [-]."""
    mean = runs.mean(axis=1)
    return np.abs(result - mean).max() / mean.max()


def test_mean_of_the_shuffle_of_a_whole_zone_is_the_mixing_factor():
    room = Room(12, 12, conductivity=1.0)
    for p in (0.1, 0.5, 0.95):
        runs = room.random_means(p, None)
        standard_error = runs.std(axis=1).max() / np.sqrt(runs.shape[1]) / runs.mean(axis=1).max()
        assert error(room.implicit_means(room.step_matrix(), mixing_factor(p)), runs) < max(4.0 * standard_error, 2e-3)


@pytest.mark.parametrize("conductivity", [1.0, 30.0])
@pytest.mark.parametrize("p", [0.1, 0.5, 0.95])
def test_exchange_rate_in_the_implicit_solve_agrees_with_a_whole_zone(p, conductivity):
    room = Room(12, 12, conductivity)
    assert error(room.with_star(exchange_rate(p, STEP)), room.random_means(p, None)) < 0.01


def test_mixing_rate_in_the_implicit_solve_agrees_where_the_wall_takes_little_a_step():
    room = Room(12, 12, conductivity=30.0)
    assert error(room.with_star(mixing_rate(0.1, STEP, STEP)), room.random_means(0.1, None)) < 0.01
    # where it takes much the star node feeds the wall's cells faster than the shuffle does (docs/shuffle.md)
    still = Room(12, 12, conductivity=1.0)
    assert 0.1 < error(still.with_star(mixing_rate(0.5, STEP, STEP)), still.random_means(0.5, None)) < 0.4


@pytest.mark.parametrize(("conductivity", "bound"), [(1.0, 0.02), (30.0, 0.002)])
def test_diffusivity_in_the_implicit_solve_agrees_while_the_reach_is_small(conductivity, bound):
    room, reach = Room(18, 18, conductivity), 1.2
    assert choose_equivalent((9.0, 9.0), reach) == "diffusivity"
    diffusivity = effective_diffusivity(0.5, mean_square_reach(reach, CELL), STEP)
    assert error(room.with_diffusivity(diffusivity), room.random_means(0.5, reach)) < bound


@pytest.mark.parametrize(("reach", "choice"), [(1.5, "diffusivity"), (4.0, "mixing")])
def test_the_choice_is_the_closer_of_the_two(reach, choice):
    room = Room(16, 16, conductivity=1.0)
    runs = room.random_means(0.5, reach)
    diffusing = error(room.with_diffusivity(effective_diffusivity(0.5, mean_square_reach(reach, CELL), STEP)), runs)
    mixing = error(room.with_star(exchange_rate(0.5, STEP)), runs)
    assert choose_equivalent((8.0, 8.0), reach) == choice == ("mixing" if mixing < diffusing else "diffusivity")
    assert min(mixing, diffusing) < 0.12
