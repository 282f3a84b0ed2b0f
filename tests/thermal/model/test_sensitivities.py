"""Fading sums against the recursion that they sum, one by one and all at once, and parts of modes."""

from __future__ import annotations

import numpy as np

from thermal.model.sensitivities import all_convolution_sums, convolution_sums, rows_of


def test_they_are_the_recursion_that_forgets() -> None:
    rng = np.random.default_rng(0)
    stay, drive = np.array([0.0, 0.3, 0.999, 1.0]), rng.normal(size=(50, 3, 2))
    ends = np.array([0, 1, 7, 8, 50])
    state, wanted = np.zeros((4, 3, 2)), {0: np.zeros((4, 3, 2))}
    for k, pushed in enumerate(drive, 1):
        state = stay[:, None, None] * state + pushed
        wanted[k] = state
    for end, sums in zip(ends, convolution_sums(stay, drive, ends), strict=True):
        np.testing.assert_allclose(sums, wanted[int(end)], rtol=1e-12, atol=1e-13)
    together = all_convolution_sums(stay, drive[:, :, 1], ends)
    np.testing.assert_allclose(together, np.stack([wanted[int(e)][:, :, 1] for e in ends], axis=2), atol=1e-13)


def test_parts_of_the_modes_make_up_the_whole() -> None:
    parts = list(rows_of(5, 100_000))
    assert [i for rows in parts for i in range(5)[rows]] == list(range(5))
    assert len(parts) == 3
    assert len(list(rows_of(3, 10**9))) == 3  # never less than a mode
    assert len(list(rows_of(9, 10**9, least=4))) == 3
