"""Galerkin reduction by rational block-Krylov subspaces: few states, still affine in the classes."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal.model._stepper import factorise
from thermal.model._symbolic import Matrices, SymbolicModel

FloatArray = NDArray[np.float64]

#: Expansion points of the transfer function [1/s]: a month, a day, eight hours, an hour, ten minutes and two minutes.
SHIFTS = (1.0 / 2.6e6, 1.0 / 86400.0, 1.0 / 28800.0, 1.0 / 3600.0, 1.0 / 600.0, 1.0 / 120.0)


def krylov_basis(matrices: list[Matrices], shifts: tuple[float, ...] = SHIFTS, tolerance: float = 1e-10) -> FloatArray:
    """Orthonormal basis of the responses to every input at several shifts, over one or more θ.

    The responses ``(K + s C)^-1 [H, B, C 1]`` interpolate the transfer function at ``s`` (Grimme 1997; Antoulas 2005,
    ch. 11); K and
    C are symmetric, so the Galerkin projection matches twice as many moments for the zone means and stays stable.

    Parameters
    ----------
    matrices : list of Matrices
        The grid model at the θ to be accurate for.
    shifts : tuple of float
        Expansion points [1/s], positive.
    tolerance : float
        Relative eigenvalue of the Gram matrix below which a direction is dropped [-].

    Returns
    -------
    ndarray, shape (n, r)
        Orthonormal columns; the uniform temperature is among their span.
    """
    blocks = [np.ones((matrices[0].n, 1))]
    for m in matrices:
        n = m.n
        stiffness, exchange = m.flow[:, :n], -m.flow[:, n:].toarray()
        inputs = np.hstack([m.heating.toarray(), exchange])
        for shift in shifts:
            solve = factorise(sp.csr_matrix(stiffness + shift * m.capacity))
            block = solve(inputs)
            size = np.linalg.norm(block, axis=0)
            blocks.append(block[:, size > 0] / size[size > 0])  # a boundary that no face touches moves nothing
    stacked = np.hstack(blocks)
    scale = np.sqrt(np.abs(matrices[0].capacity.diagonal()) + 1e-6 * matrices[0].capacity.diagonal().max())
    gram = (scale[:, None] * stacked).T @ (scale[:, None] * stacked)
    norms = np.sqrt(np.diag(gram))
    values, vectors = np.linalg.eigh(gram / np.outer(norms, norms))
    keep = values > tolerance * values[-1]
    basis = (stacked / norms) @ (vectors[:, keep] / np.sqrt(values[keep]))
    return np.asarray(np.linalg.qr(np.hstack([np.ones((basis.shape[0], 1)), basis]))[0])


def reduced_model(
    model: SymbolicModel,
    thetas: list[FloatArray],
    shifts: tuple[float, ...] = SHIFTS,
    tolerance: float = 1e-10,
) -> SymbolicModel:
    """Reduce a grid model around one or more θ; the result keeps κ(θ) and c(θ) exact.

    Parameters
    ----------
    model : SymbolicModel
        On the grid.
    thetas : list of ndarray, shape (n_parameter,)
        Where the basis is made [parameter units].
    shifts : tuple of float
        Expansion points [1/s], positive.
    tolerance : float
        As in `krylov_basis` [-].

    Returns
    -------
    SymbolicModel
        With dense matrices of the order of the basis.
    """
    basis = krylov_basis([model.matrices(t) for t in thetas], shifts, tolerance)
    return SymbolicModel(model.network, basis)
