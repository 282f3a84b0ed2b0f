import doctest

import numpy as np
import pytest

from thermal.shuffle import random as _random
from thermal.shuffle.random import execute_swaps


def apply_swaps(temperatures, first, second, capacities=None):
    """Swaps of lists of cells, on a copy."""
    cells = (np.array(given, dtype=np.intp) for given in (first, second))
    return execute_swaps(
        np.array(temperatures, dtype=float), *cells, None if capacities is None else np.array(capacities)
    )


def sequential(temperatures, first, second, capacities=None):
    """The straightforward loop that `apply_swaps` has to equal bit for bit."""
    result = list(temperatures)
    for i, j in zip(first, second, strict=True):
        T_i, T_j = result[i], result[j]
        if capacities is None or capacities[i] == capacities[j]:
            result[i], result[j] = T_j, T_i
            continue
        m = min(capacities[i], capacities[j])
        result[i] = T_j if m == capacities[i] else T_i + m / capacities[i] * (T_j - T_i)
        result[j] = T_i if m == capacities[j] else T_j + m / capacities[j] * (T_i - T_j)
    return np.array(result)


@pytest.mark.parametrize(("n_cell", "n_swap"), [(2, 30), (7, 40), (300, 1000), (20_000, 20_000)])
@pytest.mark.parametrize("unequal", [False, True])
def test_rounds_equal_the_sequential_loop_bit_for_bit(n_cell, n_swap, unequal):
    rng = np.random.default_rng(n_cell)
    temperatures = rng.normal(295.0, 3.0, n_cell)
    first, second = rng.integers(0, n_cell, (2, n_swap))
    capacities = rng.choice([500.0, 1000.0, 1700.0], n_cell) if unequal else None
    expected = sequential(temperatures, first, second, capacities)
    np.testing.assert_array_equal(apply_swaps(temperatures, first, second, capacities), expected)


def test_order_of_swaps_matters_and_is_kept():
    np.testing.assert_array_equal(apply_swaps([20.0, 21.0, 22.0], [0, 1], [1, 2]), [21.0, 22.0, 20.0])
    np.testing.assert_array_equal(apply_swaps([20.0, 21.0, 22.0], [1, 0], [2, 1]), [22.0, 20.0, 21.0])


def test_a_swap_with_itself_and_a_repeated_swap_change_nothing():
    temperatures = np.array([290.0, 295.0, 300.0])
    np.testing.assert_array_equal(apply_swaps(temperatures, [1, 0, 2], [1, 2, 0]), temperatures)
    np.testing.assert_array_equal(apply_swaps(temperatures, [], []), temperatures)


def test_the_input_is_left_alone():
    temperatures = np.array([290.0, 300.0])
    apply_swaps(temperatures, [0], [1])
    np.testing.assert_array_equal(temperatures, [290.0, 300.0])


def test_unequal_capacities_exchange_equal_air_masses():
    # 1000 J/K at 290 K and 4000 J/K at 300 K: the small cell's air goes over, a quarter of the large one's comes back
    np.testing.assert_allclose(apply_swaps([290.0, 300.0], [0], [1], [1000.0, 4000.0]), [300.0, 297.5], rtol=1e-15)


def test_energy_is_conserved_between_unequal_cells():
    rng = np.random.default_rng(5)
    capacities = rng.uniform(100.0, 5000.0, 400)
    temperatures = rng.normal(295.0, 5.0, 400)
    first, second = rng.integers(0, 400, (2, 10_000))
    mixed = apply_swaps(temperatures, first, second, capacities)
    assert capacities @ mixed == pytest.approx(capacities @ temperatures, rel=1e-12)
    assert temperatures.min() <= mixed.min() <= mixed.max() <= temperatures.max()


def test_examples():
    assert doctest.testmod(_random).failed == 0
