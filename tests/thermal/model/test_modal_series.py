"""Many runs along one series against each run for itself, and matrices that nothing keeps in memory."""

from __future__ import annotations

import gc
import weakref
from functools import cache

import numpy as np
import pytest

from thermal import SymbolicModel, build_network, load_bundled_case, reduced_model
from thermal.model.modal import run_along
from thermal.model.reduce import ReducedModel
from thermal.model.step import EXACT, IMPLICIT_EULER, TR_BDF2, Scheme

STEPS, STARTS = 120, np.array([3, 0, 4, 80, 90, 3])  # in any order, twice, and with a gap that no run passes
KEEP = np.array([1, 5, 24])


@cache
def model() -> ReducedModel:
    grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.5))
    return reduced_model(grid, [grid.network.start()])


@pytest.mark.parametrize("scheme", [EXACT, IMPLICIT_EULER, TR_BDF2], ids=["exact", "implicit_euler", "tr_bdf2"])
def test_they_are_the_runs_one_by_one(scheme: Scheme) -> None:
    m, rng = model().matrices(model().theta), np.random.default_rng(0)
    boundary, heat = -5.0 + 10.0 * rng.random((STEPS, 1)), 3000.0 * rng.random((STEPS, 5))
    boundary[40:60] = np.nan  # between the runs: nobody is driven by it
    states = 20.0 * m.uniform[:, None] * (1.0 + 0.1 * rng.random(STARTS.size))
    found = run_along(m.modal.modes, states, boundary, heat, STARTS, KEEP, 300.0, scheme)
    for i, start in enumerate(STARTS):
        rows = slice(start + 1, start + KEEP[-1] + 1)
        driven = (v[rows, :, None] for v in (boundary, heat))
        wanted, _ = m.modal.run(states[:, [i]], *driven, KEEP, 300.0, scheme)
        np.testing.assert_allclose(found[i], wanted[0], rtol=0, atol=1e-10)


def test_matrices_and_their_runs_go_with_the_last_who_uses_them() -> None:
    """An evaluation's matrices are large; in a cycle they would wait for the collector."""
    m = model().matrices(model().theta, sensitivities=True)
    assert len(m.modal.sensitivities) == len(m.flow_sensitivities)
    left = weakref.ref(m.modal)
    gc.disable()
    try:
        del m
        assert left() is None
    finally:
        gc.enable()
