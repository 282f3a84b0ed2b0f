"""Sparse factors without what is negligible, against complete ones and against known solutions."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from thermal import SymbolicModel, build_network
from thermal.data import load_bundled_case
from thermal.errors import ModelError
from thermal.model import factor as _factor
from thermal.model.factor import Elimination, SparseSolver, factorise


@pytest.fixture(scope="module")
def model() -> SymbolicModel:
    """The bundled office at its own cell size."""
    return SymbolicModel(build_network(load_bundled_case().building))


def system_of(model: SymbolicModel, step: float, bound: str = "start") -> sp.csr_matrix:
    """``C + Δt K`` at the starts or at a bound of all parameters."""
    matrices = model.matrices(np.array([getattr(p, bound) for p in model.network.parameters]))
    return sp.csr_matrix(matrices.capacity + step * matrices.flow[:, : matrices.n])


def complete(system: sp.csr_matrix) -> spl.SuperLU:
    return spl.splu(
        sp.csc_matrix(system), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )


@pytest.mark.parametrize("bound", ["lower", "start", "upper"])
@pytest.mark.parametrize("step", [60.0, 300.0, 3600.0, 1e9])
def test_solves_as_exactly_as_complete_factors(model: SymbolicModel, step: float, bound: str) -> None:
    """Steps from a minute to the steady state, all parameters at their starts and at their bounds."""
    system = system_of(model, step, bound)
    rhs = np.random.default_rng(1).standard_normal(system.shape[0])
    solution = SparseSolver(system)(rhs)
    expected = complete(system).solve(rhs)
    assert np.abs(solution - expected).max() < 1e-12 * np.abs(expected).max()
    ones = SparseSolver(system)(system @ np.ones(system.shape[0]))
    np.testing.assert_allclose(ones, 1.0, rtol=0, atol=1e-10)


def test_keeps_less_than_complete_factors(model: SymbolicModel) -> None:
    system = system_of(model, 300.0)
    assert 0 < SparseSolver(system).nonzeros < complete(system).nnz


def test_many_right_hand_sides_equal_one_at_a_time(model: SymbolicModel) -> None:
    """Single columns, one block and several blocks take different ways through the factors."""
    system = system_of(model, 300.0)
    solver = SparseSolver(system)
    for columns in (1, 2, 8, 9, 20):
        rhs = np.random.default_rng(columns).standard_normal((system.shape[0], columns))
        expected = np.column_stack([solver(column) for column in rhs.T])
        assert solver(rhs).shape == rhs.shape
        np.testing.assert_allclose(solver(rhs), expected, rtol=1e-12, atol=1e-20)
        np.testing.assert_allclose(solver(np.asfortranarray(rhs)), solver(rhs), rtol=0, atol=0)


def test_right_hand_side_is_left_alone(model: SymbolicModel) -> None:
    solver = SparseSolver(system_of(model, 300.0))
    n = model.network.n_node
    for rhs in (np.ones(n), np.ones((n, 1)), np.ones((n, 3), order="F"), np.ones((n, 11), order="F")):
        solver(rhs)
        assert (rhs == 1.0).all()


def test_complete_factors_replace_inexact_ones(model: SymbolicModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """When too much was left out, the check notices and nothing is left out."""
    system = system_of(model, 300.0)
    monkeypatch.setattr(_factor, "NEGLIGIBLE", 1e-4)
    solver = SparseSolver(system)
    assert solver.nonzeros == complete(system).nnz
    np.testing.assert_allclose(solver(system @ np.ones(system.shape[0])), 1.0, rtol=0, atol=1e-10)


def test_singular_matrix_is_refused(model: SymbolicModel) -> None:
    system = system_of(model, 300.0).tolil()
    system[5, :] = 0.0
    system[:, 5] = 0.0
    with pytest.raises(ModelError, match="cannot be factorised"):
        factorise(sp.csr_matrix(system))


def test_an_order_serves_all_of_its_structure(model: SymbolicModel) -> None:
    """Matrices of the same structure, then of another, against each one's own factors."""
    other = sp.csr_matrix(sp.diags([-1.0, 2.5, -1.0], [-1, 0, 1], shape=(40, 40)))
    elimination = Elimination()
    for system in (
        *(system_of(model, step) for step in (60.0, 1e6)),
        other,
        other.multiply(2.0),
        system_of(model, 1e9),
    ):
        for shape in ((system.shape[0],), (system.shape[0], 20)):
            rhs = np.random.default_rng(2).standard_normal(shape)
            found, expected = elimination(sp.csr_matrix(system))(rhs), complete(system).solve(rhs)
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
