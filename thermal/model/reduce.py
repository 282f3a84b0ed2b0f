"""Galerkin reduction by rational block-Krylov subspaces: few states, still affine in the classes, and certified."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.errors import ModelError
from thermal.model.certificate import Certificate, Replay, closed_loop, differences
from thermal.model.factor import Elimination, Matrix, factorise
from thermal.model.matrices import Matrices, SymbolicModel, congruent
from thermal.model.modal import modal_model

#: Expansion points of the transfer function [1/s]: a month, a day, eight hours, an hour, ten minutes and two minutes.
SHIFTS = (1.0 / 2.6e6, 1.0 / 86400.0, 1.0 / 28800.0, 1.0 / 3600.0, 1.0 / 600.0, 1.0 / 120.0)

#: Those of a large building, where every shift costs as many states as it has zones: a day, four hours, forty and seven
#: minutes (123 zones at 0.5 m, certified: 0.7 mK in the mean and 7 mK at most; the six above 0.03 and 0.3 mK).
FEW_SHIFTS = (1.0 / 86400.0, 1.0 / 14400.0, 1.0 / 2400.0, 1.0 / 400.0)

#: Inputs from which a building counts as large.
_MANY_INPUTS = 50

#: Heat capacity below which a direction of a basis counts as massless [J/K].
_LEAST_CAPACITY = 1e-3

#: Where a basis is probed at another θ [1/s], between its expansion points: six hours and twenty minutes.
_PROBES = (1.0 / 21600.0, 1.0 / 1200.0)


class ReducedModel(SymbolicModel):
    """A grid model projected on few states; κ(θ) and c(θ) stay exact.

    Parameters
    ----------
    grid : SymbolicModel
        What was reduced.
    projection : ndarray, shape (n_node, r)
        Orthonormal basis [-].
    theta : ndarray, shape (n_parameter,)
        Where the basis was made [parameter units].
    """

    def __init__(self, grid: SymbolicModel, projection: FloatArray, theta: FloatArray) -> None:
        super().__init__(grid.network, projection)
        self.grid, self.theta = grid, theta

    @cached_property
    def certificate(self) -> Certificate:
        """Error of its replay on the grid at its θ; made when it is asked for, as it costs a third of a reduction."""
        replay = closed_loop(self.grid.matrices(self.theta))
        errors = differences(self.matrices(self.theta), replay)
        return Certificate(self.network.n_node, self.order, replay.hours, replay.step, *errors)

    @property
    def order(self) -> int:
        """Number of states."""
        return self.n_state

    def to_control(self, theta: FloatArray | None = None, step: float | None = None) -> Any:
        """Make a `control.StateSpace` of the model: poles, responses and whatever else python-control does with it.

        Inputs are the boundary temperatures (``temperature of outdoor``, [K]), the signals of effects by name, and the
        heat of every zone (``heat of north``, [W]); outputs what the zones' sensors read (``temperature of north``,
        [K]). Temperatures are counted from `thermal.units.REFERENCE_TEMPERATURE`, or any other where there are no
        signals.

        Parameters
        ----------
        theta : ndarray, shape (n_parameter,), optional
            Parameter values [parameter units]; where the basis was made by default.
        step : float, optional
            Time step of an exact zero-order hold [s]; continuous time by default.

        Returns
        -------
        control.StateSpace
            Of the model's order.

        Raises
        ------
        ModelError
            When air passes from zone to zone: such a model is not linear in its inputs.

        Examples
        --------
        >>> from thermal.data import load_bundled_case
        >>> from thermal.network.build import build_network
        >>> grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
        >>> system = reduced_model(grid, [grid.network.start()], order=20).to_control()
        >>> system.nstates, system.input_labels[:2]
        (20, ['temperature of outdoor', 'heat of F1_N'])
        """
        network = self.network
        ModelError.unless(not network.airflows, "to_control", "a building without airflows from zone to zone", "some")
        modes = modal_model(self.matrices(self.theta if theta is None else theta))
        temperatures, heats = ([f"{kind} of {zone}" for zone in network.zones] for kind in ("temperature", "heat"))
        outside = [f"temperature of {name}" for name in network.boundaries]
        names = [name.replace(".", "_") for name in (*outside, *(s.name for s in network.signals), *heats)]
        return modes.to_control(names, [name.replace(".", "_") for name in temperatures], step)

    def drift(self, theta: FloatArray) -> float:
        """Error of the basis at another θ: the largest one of the responses between its shifts [K].

        Zones are heated together by what moves each by some 5 K in the long run, with random signs, and the outdoor
        temperature by 5 K.

        Parameters
        ----------
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        return max(self._errors(theta))

    def is_accurate(self, theta: FloatArray, tolerance: float) -> bool:
        """Whether the drift at another θ is within a tolerance; the rest is not looked at once it is not.

        Parameters
        ----------
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        tolerance : float
            Of `drift` [K].
        """
        return all(error <= tolerance for error in self._errors(theta))

    def _errors(self, theta: FloatArray) -> Iterator[float]:
        """Largest error of the responses at each probe, the slow one first [K]."""
        whole, small = self.grid.matrices(theta), self.matrices(theta)
        gain = np.diag(small.observation @ np.linalg.solve(_shifted(small, SHIFTS[0]), small.heating))
        signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(gain.size, 4))
        heat = 5.0 * signs / gain[:, None]
        for shift in _PROBES:
            seen = []
            for m in (whole, small):
                outside = -5.0 * (m.flow[:, m.n :] @ (np.arange(m.n_boundary) < m.n_boundary - m.n_signal)[:, None])
                response = factorise(_shifted(m, shift), self.grid.elimination)(np.hstack([m.heating @ heat, outside]))
                seen.append(m.output @ response)
            yield float(np.abs(seen[0] - seen[1]).max())


def _shifted(m: Matrices, shift: float) -> Matrix:
    """``K + s C``."""
    stiffness = m.flow[:, : m.n]
    return sp.csr_matrix(stiffness + shift * m.capacity) if sp.issparse(stiffness) else stiffness + shift * m.capacity


def krylov_basis(
    matrices: Sequence[Matrices],
    shifts: Sequence[float] = SHIFTS,
    tolerance: float = 1e-10,
    sources: Sequence[Matrix] = (),
    elimination: Elimination | None = None,
) -> FloatArray:
    """Orthonormal basis of the responses to every input at several shifts, over one or more θ.

    The responses ``(K + s C)^-1 [H, B, C 1]`` interpolate the transfer function at ``s`` (Grimme 1997; Antoulas 2005,
    ch. 11); K and C are symmetric, so the Galerkin projection matches twice as many moments for the zone means and
    stays stable.

    Parameters
    ----------
    matrices : sequence of Matrices
        The grid model at the θ to be accurate for.
    shifts : sequence of float
        Expansion points [1/s], positive.
    tolerance : float
        Relative eigenvalue of the Gram matrix below which a direction is dropped [-].
    sources : sequence of matrix, shape (n, n_source), optional
        Further heat at every θ, such as that of sources whose strength is zero there.
    elimination : Elimination, optional
        Of the grid model, where it is at hand.

    Returns
    -------
    ndarray, shape (n, r)
        Orthonormal columns; the uniform temperature is among their span.
    """
    blocks, elimination = [np.ones((matrices[0].n, 1))], elimination or Elimination()
    for m, further in zip(matrices, sources or [None] * len(matrices), strict=True):
        inputs = _inputs(m, further)
        for shift in shifts:
            block = factorise(_shifted(m, shift), elimination)(inputs)
            blocks.append(block / np.linalg.norm(block, axis=0))
    stacked = np.hstack(blocks)
    sensors = _sensors(matrices[0])
    stacked[sensors] = 0.0
    capacity = np.abs(matrices[0].capacity.diagonal())
    weight = capacity + 1e-6 * capacity.max()
    gram = congruent(stacked, weight)
    norms = np.sqrt(np.diag(gram))
    values, vectors = np.linalg.eigh(gram / np.outer(norms, norms))
    keep = values > tolerance * values[-1]
    basis = (stacked / norms) @ (vectors[:, keep] / np.sqrt(values[keep]))
    own = np.zeros((basis.shape[0], sensors.size))
    own[sensors, np.arange(sensors.size)] = 1.0
    return np.asarray(np.linalg.qr(np.hstack([1.0 - own.sum(axis=1, keepdims=True), basis, own]))[0])


def _inputs(m: Matrices, further: Matrix | None) -> FloatArray:
    """Patterns of heat that drive a model: zones, boundaries and sources, each once, shape (n, n_input)."""
    columns = sp.csc_matrix(sp.hstack([m.heating, -m.flow[:, m.n :], *([] if further is None else [further])]))
    size = np.sqrt(np.asarray(columns.multiply(columns).sum(axis=0)).ravel())
    there = np.flatnonzero(size)  # a boundary that no face touches moves nothing
    unit = sp.csc_matrix(columns[:, there] @ sp.diags(1.0 / size[there]))
    unit.sort_indices()
    seen: dict[tuple[bytes, bytes], int] = {}
    for k in range(there.size):
        part = slice(unit.indptr[k], unit.indptr[k + 1])
        values = np.round(unit.data[part] * np.sign(unit.data[part][0]), 9)
        seen.setdefault((unit.indices[part].tobytes(), values.tobytes()), k)
    return np.asarray(columns[:, there[list(seen.values())]].toarray())


def _sensors(m: Matrices) -> NDArray[np.int64]:
    """Nodes of sensors that lag behind: each is a state of its own.

    They hold hardly any heat, so that a Galerkin projection, which weighs errors by heat, would not care for them.
    """
    if m.reading is None:
        return np.zeros(0, dtype=np.int64)
    return np.setdiff1d(m.reading.indices, m.observation.indices).astype(np.int64)


def reduced_model(
    model: SymbolicModel,
    thetas: Sequence[FloatArray],
    *,
    order: int | None = None,
    tolerance: float | None = None,
    shifts: Sequence[float] | None = None,
) -> ReducedModel:
    """Reduce a grid model around one or more θ; the result keeps κ(θ) and c(θ) exact.

    A block-Krylov basis comes first. When an order or a tolerance is given, the directions that matter least for what
    the inputs reach and the zone means see are dropped (eigenvectors of the sum of both Gramians: K and C are
    symmetric, so one basis balances both; Liu, Sreeram and Teo 1998, doi:10.1016/S0167-6911(98)00024-3).

    Parameters
    ----------
    model : SymbolicModel
        On the grid.
    thetas : sequence of ndarray, shape (n_parameter,)
        Where the basis is made [parameter units]; its certificate is of the first.
    order : int, optional
        Largest number of states.
    tolerance : float, optional
        Largest error of any zone mean in the certificate's replay [K]; the least order that meets it is taken.
    shifts : sequence of float
        Expansion points [1/s], positive; six from a month to two minutes by default, four in a large building.

    Returns
    -------
    ReducedModel
        On the basis.

    Raises
    ------
    ModelError
        When the order is below 2, when a tolerance is out of reach of the basis, or both are given.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.network.build import build_network
    >>> grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
    >>> reduced_model(grid, [grid.network.start()], order=20).certificate.max_difference < 0.1
    True
    """
    ModelError.unless(order is None or tolerance is None, "reduced model", "an order or a tolerance", "both")
    ModelError.unless(order is None or order >= 2, "order", "at least 2 states", order)
    inputs = len(model.network.zones) + len(model.network.boundaries)
    chosen = shifts or (SHIFTS if inputs < _MANY_INPUTS else FEW_SHIFTS)
    whole = [model.matrices(t) for t in thetas]
    sources = [model.source_sensitivities(t) for t in thetas]
    basis = krylov_basis(whole, chosen, sources=sources, elimination=model.elimination)
    if tolerance is not None:
        basis = basis @ _least(_turned(whole[0], basis), tolerance, closed_loop(whole[0]))
    elif order is not None and order < basis.shape[1]:
        basis = basis @ _ranked([_turned(m, basis) for m in whole])[:, :order]
    return ReducedModel(model, basis, np.asarray(thetas[0], dtype=float))


def _ranked(models: Sequence[Matrices]) -> FloatArray:
    """Directions of a reduced model by what they carry, orthonormal, the uniform temperature first, (r, r).

    Parameters
    ----------
    models : sequence of Matrices
        The model at one or more θ; what any of them carries counts.
    """
    root = np.linalg.cholesky(models[0].capacity + _LEAST_CAPACITY * np.eye(models[0].n))
    vectors = np.linalg.eigh(np.sum([_gramians(m, root) for m in models], axis=0))[1][:, ::-1]
    directions = np.hstack([models[0].uniform[:, None], np.linalg.solve(root.T, vectors)])
    return np.asarray(np.linalg.qr(directions)[0])


def _gramians(m: Matrices, root: FloatArray) -> FloatArray:
    """Sum of both Gramians in coordinates in which C is one; inputs count by the warmth that they bring in the end."""
    modes = modal_model(m)
    drive = np.hstack([modes.boundary, modes.heating])
    gain = np.abs(modes.observation @ (drive / modes.conductance[:, None])).max(axis=0)
    there = gain > 0.0
    turn = root.T @ modes.states
    rates = modes.capacity[:, None] * modes.conductance + modes.conductance[:, None] * modes.capacity
    total = np.zeros_like(root)
    for factor in (drive[:, there] / gain[there], modes.output.T):
        whole = turn @ ((factor @ factor.T) / rates) @ turn.T
        total += whole / np.trace(whole)
    return total


def _turned(m: Matrices, turn: FloatArray) -> Matrices:
    """Project a model on orthonormal columns."""
    return replace(
        m,
        capacity=turn.T @ (m.capacity @ turn),
        flow=np.hstack([turn.T @ (m.flow[:, : m.n] @ turn), _dense(turn.T @ m.flow[:, m.n :])]),
        heating=_dense(turn.T @ m.heating),
        observation=_dense(m.observation @ turn),
        uniform=turn.T @ m.uniform,
        reading=None if m.reading is None else _dense(m.reading @ turn),
    )


def _dense(matrix: Matrix) -> FloatArray:
    return np.asarray(matrix.toarray() if sp.issparse(matrix) else matrix)


def _least(m: Matrices, tolerance: float, replay: Replay) -> FloatArray:
    """Fewest directions whose replay is within the tolerance, by bisection."""
    least = differences(m, replay)[1]
    expected = f"at least {least:.2g} K, the error of all {m.n} states of the basis"
    ModelError.unless(least <= tolerance, "tolerance", expected, f"{tolerance:g}", "add shifts")
    ranked = _ranked([m])
    low, high = 1, ranked.shape[1]
    while high - low > max(1, high // 50):
        middle = (low + high) // 2
        if differences(_turned(m, ranked[:, :middle]), replay)[1] <= tolerance:
            high = middle
        else:
            low = middle
    return ranked[:, :high]
