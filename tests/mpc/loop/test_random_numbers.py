"""Numbers by a counter: known answers, the normal distribution, independence, and the same when compiled."""

import numpy as np
import pytest

from mpc.loop.random_numbers import compiled_filling, normal_numbers, normal_quantiles, philox, stream_key

#: Counter, key and what Philox-2x32-10 makes of them, from the authors' library Random123 (file kat_vectors).
KNOWN = (
    (0x00000000, 0x00000000, 0x00000000, 0xFF1DAE59, 0x6CD10DF2),
    (0xFFFFFFFF, 0xFFFFFFFF, 0xFFFFFFFF, 0x2C3F628B, 0xAB4FD7AD),
    (0x243F6A88, 0x85A308D3, 0x13198A2E, 0xDD7CE038, 0xF62A4C12),
)

STEPS, WIDTH = 20_000, 10


@pytest.fixture(scope="module")
def drawn():
    """Numbers of two seeds, shape (2, WIDTH, STEPS)."""
    return np.stack([normal_numbers(np.full(STEPS, stream_key(seed, 7)), np.arange(STEPS), WIDTH) for seed in (0, 1)])


@pytest.mark.parametrize(("first", "second", "key", "one", "other"), KNOWN)
def test_known_answers(first, second, key, one, other):
    assert philox(np.uint64(first), np.uint64(second), np.uint64(key)) == (one, other)


def test_they_are_normal(drawn):
    exact, values = normal_quantiles().astype(float), drawn.astype(float)
    assert np.var(exact) == pytest.approx(1.0, abs=1e-6) and np.mean(exact**4) == pytest.approx(3.0, abs=1e-3)
    error = 1.0 / np.sqrt(STEPS)
    assert np.abs(values.mean(axis=2)).max() < 4.0 * error
    assert np.abs(values.var(axis=2) - 1.0).max() < 4.0 * np.sqrt(2.0) * error
    assert np.mean(values**4) == pytest.approx(3.0, abs=4.0 * np.sqrt(96.0 / values.size))


def test_seeds_places_and_steps_are_independent(drawn):
    limit = 4.5 / np.sqrt(STEPS)
    columns = drawn.reshape(2 * WIDTH, STEPS).astype(float)
    beside = np.corrcoef(columns) - np.eye(len(columns))
    later = [np.corrcoef(columns[:, :-lag], columns[:, lag:])[: len(columns), len(columns) :] for lag in (1, 2, 64)]
    assert np.abs(beside).max() < limit and np.abs(later).max() < limit


def test_any_is_known_without_the_others(drawn):
    keys, steps = np.array([stream_key(1, 7), stream_key(0, 7)]), np.array([17_000, 5])
    np.testing.assert_array_equal(normal_numbers(keys, steps, WIDTH), np.stack([drawn[1, :, 17_000], drawn[0, :, 5]], 1))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_compiled_they_are_the_same(dtype):
    pytest.importorskip("numba", reason="extra [fast]")
    keys, steps = np.array([stream_key(seed, 7) for seed in range(33)]), np.arange(33) * 1000
    for width in (1, 4, 7):
        found = np.full((width, 33), np.nan, dtype=dtype)
        compiled_filling(np.dtype(dtype))(keys, steps, found)
        np.testing.assert_array_equal(found, normal_numbers(keys, steps, width))
