"""Fading sums against the recursion that they sum, and parts of modes against the whole."""

from __future__ import annotations

import numpy as np

from thermal.model._modal_fading import Stack, fading_sums, rows_of


def test_they_are_the_recursion_that_forgets() -> None:
    rng = np.random.default_rng(0)
    stay, drive = np.array([0.0, 0.3, 0.999, 1.0]), rng.normal(size=(50, 3, 2))
    ends = np.array([0, 1, 7, 8, 50])
    state, wanted = np.zeros((4, 3, 2)), {0: np.zeros((4, 3, 2))}
    for k, pushed in enumerate(drive, 1):
        state = stay[:, None, None] * state + pushed
        wanted[k] = state
    for end, sums in zip(ends, fading_sums(stay, drive, ends), strict=True):
        np.testing.assert_allclose(sums, wanted[int(end)], rtol=1e-12, atol=1e-13)


def test_parts_of_the_modes_make_up_the_whole() -> None:
    rng = np.random.default_rng(1)
    matrices = [rng.normal(size=(5, 3)), None, rng.normal(size=(5, 3))]
    sums, out = rng.normal(size=(5, 3, 4)), np.zeros((5, 3, 4))
    parts = list(rows_of(5, 2_000_000))
    assert len(parts) == 3
    for rows in parts:
        Stack(matrices).add(out[rows], rows, sums[rows])
    for j, matrix in enumerate(matrices):
        wanted = np.zeros((5, 4)) if matrix is None else np.einsum("il,ilk->ik", matrix, sums)
        np.testing.assert_allclose(out[:, j], wanted, atol=1e-13)
