import doctest
import json
from itertools import pairwise
from math import comb

import numpy as np
import pytest

from thermal.errors import ModelError
from thermal.shuffle import random as _random
from thermal.shuffle.random import RandomShuffle, execute_swaps

N_RUN = 2500


def l_shape():
    """Cell centres of an L-shaped zone of 72 cells of 0.5 m."""
    return np.array([(c, r) for c in range(11) for r in range(11) if c < 4 or r < 4], dtype=float)[:72] * 0.5


def copies(points, n_run):
    """Zones and positions of as many copies of one zone: independent runs in one shuffle."""
    zones = np.arange(n_run * len(points)).reshape(n_run, len(points))
    return list(zones), np.tile(points, (n_run, 1))


def sequential_shuffle(temperatures, points, probability, reach, rng):
    """The shuffle as one would write it down: loops over cells, lists of candidates, swaps in random order."""
    swaps = []
    for cell in range(len(points)):
        if rng.random() < probability:
            near = np.hypot(*(points - points[cell]).T) <= (np.inf if reach is None else reach + 1e-9)
            swaps.append((cell, rng.choice(np.flatnonzero(near))))
    shuffled = np.array(temperatures)
    for k in rng.permutation(len(swaps)):
        i, j = swaps[k]
        shuffled[i], shuffled[j] = shuffled[j], shuffled[i]
    return shuffled


def exact_stay_probability(n, p):
    """Probability that a parcel is back in its cell after one shuffle of a whole zone of n cells.

    The deciding cells come one after the other, each a random one of those that have not yet decided. A parcel's state
    is whether it is in its cell, whether the cell it is in has decided, and whether its own cell has; by symmetry
    nothing else matters. Hence a Markov chain over the number of decisions, averaged over its binomial law.
    """
    state = {(True, False, False): 1.0}
    at_home = [1.0]
    for decided in range(n):
        left = n - decided
        following = {}

        def add(key, probability, following=following):
            following[key] = following.get(key, 0.0) + probability

        for (home, current, own), weight in state.items():
            rest = weight
            if not current:  # the parcel's cell decides
                rest -= weight / left
                add((home, True, own or home), weight / left / n)
                others = n - 1 if home else n - 2
                if not home:
                    add((True, own, own), weight / left / n)
                if others:
                    used = (decided - (0 if home else own)) / others
                    moved = weight / left * others / n
                    add((False, True, own or home), moved * used)
                    add((False, False, own or home), moved * (1.0 - used))
            if not home and not own:  # its former cell decides, and may fetch it
                rest -= weight / left
                add((True, True, True), weight / left / n)
                add((False, current, True), weight / left * (1.0 - 1.0 / n))
            add((False, True, own), rest / n)  # any other cell decides, and may fetch it
            add((home, current, own), rest * (1.0 - 1.0 / n))
        state = following
        at_home.append(sum(weight for (home, _, _), weight in state.items() if home))
    return sum(comb(n, m) * p**m * (1.0 - p) ** (n - m) * at_home[m] for m in range(n + 1))


def assert_same_mean(one, other, deviations=4.0):
    """Two samples of independent runs (n_run, ...) have means that agree within their standard errors."""
    error = np.sqrt(one.var(axis=0) / len(one) + other.var(axis=0) / len(other))
    assert np.all(np.abs(one.mean(axis=0) - other.mean(axis=0)) <= deviations * error + 1e-12)


@pytest.mark.parametrize(("probability", "reach"), [(0.3, 1.2), (0.9, 1.2), (0.6, None), (0.7, 0.5)])
def test_law_is_that_of_the_sequential_shuffle(probability, reach):
    points = l_shape()
    n = len(points)
    zones, positions = copies(points, N_RUN)
    shuffle = RandomShuffle(zones, positions, probability, reach, seed=11)
    vectorised = shuffle.apply(np.tile(np.arange(n, dtype=float), N_RUN)).reshape(N_RUN, n).astype(int)
    rng = np.random.default_rng(12)
    loops = np.array([sequential_shuffle(np.arange(n), points, probability, reach, rng) for _ in range(N_RUN // 5)])
    warm = np.where(points[:, 0] < 1.0, 10.0, 0.0) + points[:, 1]
    edges = np.array([-0.1, 0.1, 0.6, 1.1, 2.1, 4.1, 30.0])

    def statistics(parcels):
        squared = np.square(points[parcels] - points).sum(axis=-1)
        bins = [((squared > a) & (squared <= b)).mean(axis=1) for a, b in pairwise(edges)]
        outcome = warm[parcels][:, [0, 5, n // 2, n - 1]]
        return np.column_stack([squared.mean(axis=1), *bins, outcome])

    assert_same_mean(statistics(vectorised), statistics(loops))


@pytest.mark.parametrize(("n", "p"), [(2, 0.5), (4, 0.3), (9, 0.8), (25, 0.5), (25, 1.0)])
def test_stay_probability_is_exact_in_a_zone_of_few_cells(n, p):
    n_run = 60_000 // n
    zones, positions = copies(np.column_stack([np.arange(n), np.zeros(n)]), n_run)
    parcels = RandomShuffle(zones, positions, p, None, seed=n).apply(np.tile(np.arange(float(n)), n_run))
    stayed = (parcels.reshape(n_run, n) == np.arange(n)).mean(axis=1)
    assert abs(stayed.mean() - exact_stay_probability(n, p)) < 4.0 * stayed.std() / np.sqrt(n_run)


def test_mixing_factor_is_the_limit_of_many_cells():
    for n in (2, 5, 20, 100):
        for p in (0.1, 0.4, 0.8, 1.0):
            factor = (n * exact_stay_probability(n, p) - 1.0) / (n - 1.0)  # the mean is factor I + (1 − factor) J
            assert abs(factor - (1.0 - p) * np.exp(-p)) < 0.13 / n


@pytest.mark.parametrize("reach", [None, 1.2])
def test_outcome_is_that_of_the_drawn_swaps(reach):
    points = l_shape()
    arguments = ([np.arange(72)], points, 0.8, reach)
    temperatures = np.random.default_rng(0).normal(295.0, 1.0, 72)
    first, second = RandomShuffle(*arguments, seed=4).draw_swaps()
    expected = execute_swaps(temperatures.copy(), first, second)
    np.testing.assert_array_equal(RandomShuffle(*arguments, seed=4).apply(temperatures), expected)
    assert len(np.unique(first)) == len(first)  # a cell decides once
    if reach is not None:
        assert np.hypot(*(points[first] - points[second]).T).max() <= reach


def test_each_zone_keeps_its_temperatures_and_other_cells_are_left_alone():
    points = np.array([(c, r) for c in range(20) for r in range(20)], dtype=float)
    zones = [np.arange(0, 150), np.arange(399, 249, -1)]
    positions = points.copy()
    positions[150:250] = np.nan  # walls and massless nodes have no place here
    temperatures = np.random.default_rng(1).normal(295.0, 2.0, 400)
    shuffle = RandomShuffle(zones, positions, 1.0, 3.0, seed=2)
    shuffled = temperatures
    for _ in range(5):
        shuffled = shuffle.apply(shuffled)
    for zone in zones:
        assert not np.array_equal(shuffled[zone], temperatures[zone])
        np.testing.assert_array_equal(np.sort(shuffled[zone]), np.sort(temperatures[zone]))
    np.testing.assert_array_equal(shuffled[150:250], temperatures[150:250])


@pytest.mark.parametrize(("probability", "reach"), [(0.0, None), (1.0, 0.3)])
def test_nothing_moves_without_probability_or_reach(probability, reach):
    shuffle = RandomShuffle([np.arange(72)], l_shape(), probability, reach, seed=0)
    np.testing.assert_array_equal(shuffle.apply(np.arange(72.0)), np.arange(72.0))


def test_zones_of_one_cell_and_of_none_are_allowed():
    shuffle = RandomShuffle([[0], [], [2]], np.zeros((3, 2)), 1.0, None, seed=0)
    np.testing.assert_array_equal(shuffle.apply([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0])


def test_unequal_capacities_conserve_energy_and_equal_ones_permute():
    rng = np.random.default_rng(8)
    temperatures = rng.normal(295.0, 4.0, 72)
    capacities = rng.uniform(200.0, 900.0, 72)
    mixing = RandomShuffle([np.arange(72)], l_shape(), 0.9, 1.2, 3, capacities=capacities)
    mixed = temperatures
    for _ in range(20):
        mixed = mixing.apply(mixed)
    assert capacities @ mixed == pytest.approx(capacities @ temperatures, rel=1e-12)
    plain = RandomShuffle([np.arange(72)], l_shape(), 0.9, 1.2, 3).apply(temperatures)
    equal = RandomShuffle([np.arange(72)], l_shape(), 0.9, 1.2, 3, capacities=np.full(72, 300.0)).apply(temperatures)
    np.testing.assert_array_equal(equal, plain)


def test_equal_seeds_give_equal_runs_and_a_saved_state_continues():
    arguments = ([np.arange(72)], l_shape(), 0.5, 1.2)
    one, other = RandomShuffle(*arguments, seed=7), RandomShuffle(*arguments, seed=np.random.default_rng(7))
    temperatures = np.arange(72.0)
    np.testing.assert_array_equal(one.apply(temperatures), other.apply(temperatures))
    saved = json.loads(json.dumps(one.state))
    following = [one.apply(temperatures) for _ in range(3)]
    assert not np.array_equal(following[0], following[1])
    fresh = RandomShuffle(*arguments, seed=0)
    fresh.restore(saved)
    for expected in following:
        np.testing.assert_array_equal(fresh.apply(temperatures), expected)


@pytest.mark.parametrize("state", [{}, {"bit_generator": "MT19937", "state": {}}])
def test_a_wrong_state_is_refused(state):
    with pytest.raises(ModelError, match="PCG64"):
        RandomShuffle([[0, 1]], np.zeros((2, 2)), 0.5, None, seed=0).restore(state)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"probability": 1.1}, ModelError, "probability in"),
        ({"probability": np.nan}, ModelError, "probability in"),
        ({"reach": 0.0}, ModelError, "reach"),
        ({"reach": np.inf}, ModelError, "reach"),
        ({"capacities": [1.0, 1.0, 0.0]}, ModelError, "capacities"),
        ({"capacities": [1.0]}, ModelError, "capacities of shape"),
        ({"positions": np.zeros(3)}, ModelError, "positions of shape"),
        ({"positions": np.full((3, 2), np.nan)}, ModelError, "finite positions"),
        ({"zone_cells": [[0, 3]]}, ModelError, "0, 3"),
        ({"zone_cells": [[0, 1], [1, 2]]}, ModelError, "cell 1 of zone 1"),
        ({"zone_cells": [[0, 0]]}, ModelError, "once in zone 0"),
        ({"zone_cells": [[0.0, 1.0]]}, ModelError, "integers"),
    ],
)
def test_bad_input_is_refused(changes, error, message):
    arguments = {"zone_cells": [[0, 1, 2]], "positions": np.eye(3)[:, :2], "probability": 0.5, "reach": None, "seed": 0}
    with pytest.raises(error, match=message):
        RandomShuffle(**(arguments | changes))


def test_temperatures_of_a_wrong_shape_are_refused():
    with pytest.raises(ModelError, match=r"\(2,\)"):
        RandomShuffle([[0, 1]], np.zeros((2, 2)), 0.5, None, seed=0).apply([1.0, 2.0, 3.0])


def test_examples():
    assert doctest.testmod(_random).failed == 0
