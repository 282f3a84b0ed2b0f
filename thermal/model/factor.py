"""Matrices of a model at one θ, and factors of that of a step: lean for many solves, ordered once for few."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.errors import ModelError

#: A csr_matrix on the grid, an ndarray when reduced; the stubs of scipy cannot type products with such a union.
Matrix = Any

#: Entries of the factors below this share of their column are left out [-]. What one volume passes on decays with every
#: volume between, so up to two fifths of the complete factors lie below it; double precision ends at 1e-16.
NEGLIGIBLE = 1e-20

#: Largest componentwise backward error [-] with which such factors are kept; complete ones have 1e-16 to 2e-14.
BACKWARD_ERROR = 1e-12

#: Right-hand sides that are solved for together; more of them no longer fit the cache (twice as slow at 100).
_COLUMNS = 8

#: First guess of the factors' size over that of the matrix [-]; SuperLU enlarges it when it has to.
_FILL = 10


@dataclass(frozen=True)
class Pencil:
    """The model at one θ: ``C dT/dt = -K T + B u + H q`` and its derivatives with respect to θ.

    The boundary nodes are the last columns of ``flow = [K, -B]``, so that ``flow @ [T; u]`` is the heat that leaves
    each volume.

    Parameters
    ----------
    capacity : sparse matrix or ndarray, shape (n, n)
        C [J/K]; diagonal on the grid.
    flow : sparse matrix or ndarray, shape (n, n + n_boundary)
        ``[K, -B]`` [W/K].
    heating : matrix, shape (n, n_zone)
        H, distribution of a zone's heat; columns sum to 1 on the grid.
    observation : matrix, shape (n_zone, n)
        Zone means.
    uniform : ndarray, shape (n,)
        The state in which every volume is at 1 K [K].
    capacity_sensitivities, flow_sensitivities : list of matrices
        dC/dθ_j and d[K, -B]/dθ_j, one a parameter.
    reading : matrix, shape (n_zone, n), optional
        What the zones' sensors read where these lag behind; see `output`.
    n_signal : int
        How many of the boundary columns, the last ones, are signals of effects.
    airflows : tuple of (int, int)
        Source and target zone of each directed airflow, which is no part of K.
    emitted : ndarray, shape (n_signal, n_zone), optional
        Signals by the heat of the zones that devices give, where that alone is known [W/W].
    """

    capacity: Matrix
    flow: Matrix
    heating: Matrix
    observation: Matrix
    uniform: FloatArray
    capacity_sensitivities: list[Matrix]
    flow_sensitivities: list[Matrix]
    reading: Matrix = None
    n_signal: int = 0
    airflows: tuple[tuple[int, int], ...] = ()
    emitted: FloatArray | None = None

    @property
    def n(self) -> int:
        """Number of states."""
        return int(self.flow.shape[0])

    @property
    def n_boundary(self) -> int:
        """Number of boundary temperatures and signals."""
        return int(self.flow.shape[1] - self.flow.shape[0])

    @property
    def output(self) -> Matrix:
        """What is compared with telemetry, shape (n_zone, n): the sensors' readings, or the zone means."""
        return self.observation if self.reading is None else self.reading

    @property
    def reduced(self) -> bool:
        """Whether the matrices are dense, those of a reduced model."""
        return isinstance(self.capacity, np.ndarray)


class SparseSolver:
    """Solves with a sparse symmetric positive definite matrix, which SuperLU factorises once.

    Minimum degree on A + A^T without pivoting keeps the structure symmetric, which is four times faster than SuperLU's
    default. Factors that lack what is negligible solve as exactly as complete ones; one solve confirms it by its
    componentwise backward error (Oettli and Prager 1964, doi:10.1007/BF01386090), and complete factors replace them if
    it does not.

    Parameters
    ----------
    system : csr_matrix, shape (n, n)
        Matrix of the step [J/K].

    Raises
    ------
    RuntimeError
        When the matrix is singular.

    Examples
    --------
    >>> SparseSolver(sp.csr_matrix([[2.0, -1.0], [-1.0, 2.0]]))(np.array([1.0, 1.0])).tolist()
    [1.0, 1.0]
    """

    def __init__(self, system: sp.csr_matrix) -> None:
        matrix = sp.csc_matrix(system)
        self._factors = _without_negligible(matrix) or _complete(matrix)

    def __call__(self, rhs: FloatArray) -> FloatArray:
        """Solve for right-hand sides of shape (n,) or (n, m)."""
        return _solution(self._factors, rhs)

    @property
    def nonzeros(self) -> int:
        """Entries of L and U that are kept."""
        return int(self._factors.nnz)


class Elimination:
    """Factorises matrices of one structure: the order in which the first is eliminated serves the others too.

    To find it takes longer than to eliminate in it. The factors are complete: to leave out what is negligible pays for
    many solves only.

    Examples
    --------
    >>> elimination = Elimination()
    >>> for stiffness in (2.0, 3.0):
    ...     solve = elimination(sp.csr_matrix([[stiffness, -1.0], [-1.0, stiffness]]))
    >>> solve(np.array([2.0, 2.0])).tolist()
    [1.0, 1.0]
    """

    def __init__(self) -> None:
        self._first: sp.csc_matrix | None = None

    def __call__(self, system: sp.csr_matrix) -> Callable[[FloatArray], FloatArray]:
        """Factorise a symmetric positive definite matrix and return what solves with it.

        Parameters
        ----------
        system : csr_matrix, shape (n, n)
            Matrix [W/K].

        Raises
        ------
        RuntimeError
            When it is singular.
        """
        matrix = sp.csc_matrix(system)
        matrix.sort_indices()
        if self._first is None or not _alike(self._first, matrix):
            factors = _complete(matrix)
            self._first, self._order = matrix, np.argsort(factors.perm_c)
            number = sp.csc_matrix((np.arange(matrix.nnz), matrix.indices, matrix.indptr), matrix.shape)
            self._ordered = sp.csc_matrix(number[self._order][:, self._order])
            self._ordered.sort_indices()
            return partial(_solution, factors)
        ordered = self._ordered
        parts = (matrix.data[ordered.data], ordered.indices, ordered.indptr)
        return partial(_turned, _complete(sp.csc_matrix(parts, matrix.shape), "NATURAL"), self._order)


def _alike(first: sp.csc_matrix, second: sp.csc_matrix) -> bool:
    """Whether entries lie at the same places."""
    return np.array_equal(first.indptr, second.indptr) and np.array_equal(first.indices, second.indices)


def _solution(factors: spl.SuperLU, rhs: FloatArray) -> FloatArray:
    """Solve for right-hand sides of shape (n,) or (n, m)."""
    if rhs.size == rhs.shape[0]:
        # the matrix is its own transpose, and sums over rows of the factors are faster than updates by columns
        return np.asarray(factors.solve(np.ravel(rhs), "T")).reshape(rhs.shape)
    if rhs.shape[1] <= _COLUMNS:
        return np.asarray(factors.solve(np.asfortranarray(rhs)))
    solution = np.empty(rhs.shape, order="F")
    for first in range(0, rhs.shape[1], _COLUMNS):
        block = slice(first, first + _COLUMNS)
        solution[:, block] = factors.solve(np.asfortranarray(rhs[:, block]))
    return solution


def _turned(factors: spl.SuperLU, order: NDArray[np.intp], rhs: FloatArray) -> FloatArray:
    """Solve with factors of a matrix whose rows and columns are in another order."""
    solution = np.empty(rhs.shape)
    solution[order] = _solution(factors, rhs[order])
    return solution


def _complete(matrix: sp.csc_matrix, order: str = "MMD_AT_PLUS_A") -> spl.SuperLU:
    """Complete factors."""
    return spl.splu(matrix, permc_spec=order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def _without_negligible(matrix: sp.csc_matrix) -> spl.SuperLU | None:
    """Factors without what is negligible; None where they would not be as exact as complete ones."""
    try:
        factors = spl.spilu(
            matrix,
            drop_tol=NEGLIGIBLE,
            fill_factor=_FILL,
            drop_rule="basic",
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            panel_size=1,  # the fastest for columns as short as these
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # a pivot of zero: complete factors tell whether the matrix is singular
        return None
    rhs = np.random.default_rng(0).standard_normal(matrix.shape[0])
    solution = factors.solve(rhs)
    with np.errstate(all="ignore"):  # a solution that is not finite fails the comparison
        scale = abs(matrix) @ np.abs(solution) + np.abs(rhs)
        exact = np.abs(matrix @ solution - rhs) <= BACKWARD_ERROR * scale
    return factors if exact.all() else None


def factorise(system: Matrix, elimination: Elimination | None = None) -> Callable[[FloatArray], FloatArray]:
    """Factorise a symmetric positive definite matrix, sparse (SuperLU) or dense (inverse by Cholesky).

    Parameters
    ----------
    system : sparse matrix or ndarray, shape (n, n)
        Matrix of the step [J/K].
    elimination : Elimination, optional
        What factorises sparse matrices of its structure, for a few solves each; a step is solved many times.

    Returns
    -------
    callable
        Solves for right-hand sides of shape (n,) or (n, m).

    Raises
    ------
    ModelError
        When it is not positive definite.
    """
    try:
        if sp.issparse(system):
            return SparseSolver(system) if elimination is None else elimination(system)
        factor = sl.cho_factor(np.asarray(system))
        inverse = sl.cho_solve(factor, np.eye(system.shape[0]))
        return lambda rhs: np.asarray(inverse @ rhs)
    except (RuntimeError, np.linalg.LinAlgError) as error:
        raise ModelError(
            f"the matrix of the step (n = {system.shape[0]}) cannot be factorised: {error}; "
            "a volume without heat capacity and without any face, or a parameter out of range, does this"
        ) from error
