import numpy as np
import pytest

from thermal.shuffle.random import PartnerSampler, disc_offsets


def grid(n_column, n_row, cell_size=1.0, keep=lambda column, row: True):
    """Cell centres of the cells of a rectangle that are kept."""
    places = [(c, r) for c in range(n_column) for r in range(n_row) if keep(c, r)]
    return np.array(places, dtype=float) * cell_size


def l_shape(cell_size=0.1):
    return grid(12, 12, cell_size, keep=lambda column, row: column < 4 or row < 3)


def assert_uniform(points, others, reach, n_draw=400, seed=1):
    """Partners of every cell of the first zone are uniform over its cells within the reach (chi squared)."""
    sampler = PartnerSampler([points, *others], reach)
    slots = np.tile(np.arange(len(points)), n_draw)
    partners = sampler.draw(np.random.default_rng(seed), slots)
    counts = np.zeros((len(points), len(points)))
    assert partners.min() >= 0
    np.add.at(counts, (slots, partners), 1)
    distance = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    allowed = np.ones_like(distance, bool) if reach is None else distance <= reach * (1 + 1e-9)
    assert not counts[~allowed].any()
    expected = np.broadcast_to(n_draw / allowed.sum(axis=1, keepdims=True), counts.shape)[allowed]
    chi_squared = (np.square(counts[allowed] - expected) / expected).sum()
    freedom = allowed.sum() - len(points)
    assert abs(chi_squared - freedom) < 5.0 * np.sqrt(2.0 * freedom)


@pytest.mark.parametrize(("reach", "count"), [(0.5, 1), (1.0, 5), (1.5, 9), (np.sqrt(5.0), 21), (3.0, 29)])
def test_disc_has_the_cells_within_the_reach(reach, count):
    assert len(disc_offsets(reach, (1.0, 1.0))) == count
    assert len(disc_offsets(reach * 0.1, (0.1, 0.1))) == count  # round-off does not lose the cells on the rim


def test_partners_within_a_disc_that_the_zone_cuts_are_uniform():
    assert_uniform(l_shape(), [grid(9, 9, 0.1)], reach=0.3)  # fewer places in the disc than cells: offsets are drawn


def test_partners_in_a_zone_smaller_than_the_disc_are_uniform():
    assert_uniform(grid(9, 2, 0.25), [], reach=1.0)  # 49 places, 18 cells: cells are drawn


def test_partners_off_the_grid_are_uniform():
    points = np.random.default_rng(3).uniform(0.0, 3.0, (70, 2))
    assert_uniform(points, [grid(15, 15, 0.25)], reach=0.8)


def test_partners_in_the_whole_zone_are_uniform():
    assert_uniform(l_shape(), [l_shape()], reach=None)
    assert_uniform(grid(5, 5), [grid(3, 3)], reach=100.0)


def test_cells_may_be_oblong():
    assert_uniform(grid(10, 10) * [0.5, 0.2], [], reach=0.61)


def test_floors_above_each_other_do_not_mix():
    points = grid(8, 8)
    sampler = PartnerSampler([points, points], reach=2.0)
    slots = np.repeat(np.arange(128), 50)
    partners = sampler.draw(np.random.default_rng(0), slots)
    np.testing.assert_array_equal(partners // 64, slots // 64)


def test_a_wide_and_almost_empty_zone_needs_no_wide_table():
    two = grid(3, 3, 0.001)
    points = np.concatenate([two, np.add(two, [500.0, 400.0])])
    sampler = PartnerSampler([points], reach=0.001)
    slots = np.repeat(np.arange(18), 40)
    np.testing.assert_array_equal(sampler.draw(np.random.default_rng(0), slots) // 9, slots // 9)
    assert sampler._slot_at.size < 1000
