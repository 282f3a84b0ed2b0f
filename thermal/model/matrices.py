"""The symbolic model: class conductances κ(θ) and capacities c(θ), their derivatives, and the matrices they make."""

from dataclasses import dataclass
from functools import cached_property, partial

import casadi as ca
import numpy as np
import scipy.sparse as sp

from thermal._types import FloatArray
from thermal.errors import ModelError
from thermal.model.factor import Elimination, Matrix, Pencil
from thermal.model.modal_runs import ModalRuns
from thermal.network.network import CapacityClass, ConductanceClass, ThermalNetwork


@dataclass(frozen=True)
class Matrices(Pencil):
    """The model at one θ, as `Pencil` describes it, with what steps it in its modes."""

    @cached_property
    def modal(self) -> ModalRuns:
        """What steps a reduced model in its modes."""
        return ModalRuns(self)


#: Conductance below zero that counts as zero [its unit]: Ipopt relaxes the bounds of a strength by 1e-8.
_RELAXED = 1e-6


class SymbolicModel:
    """A network's conductances and capacities as CasADi functions of θ, differentiated by CasADi.

    Parameters
    ----------
    network : ThermalNetwork
        Control volumes and faces.
    projection : ndarray, shape (n_node, r), optional
        Orthonormal basis [-] of a Galerkin reduction: every class is projected, so the model stays affine in κ(θ)
        and c(θ).

    Attributes
    ----------
    classes : casadi.Function
        θ to κ and c.
    class_flows, class_masses : list of matrices
        ``[K, -B]`` and C of each class at unit value, sources left out.
    sources : object
        Columns of -B that the sources' classes bring; their values follow those of the faces in κ.
    elimination : Elimination
        What factorises its matrices where they are solved with a few times only.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.model.matrices import SymbolicModel
    >>> from thermal.network.build import build_network
    >>> model = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
    >>> model.matrices(model.network.start()).n > 100
    True
    """

    def __init__(self, network: ThermalNetwork, projection: FloatArray | None = None) -> None:
        self.network, self.projection = network, projection
        faces = [c for c in network.conductances if not c.source]
        sources = [c for c in network.conductances if c.source]
        kappa = ca.vertcat(*[c.value for c in (*faces, *sources)])
        heat = ca.vertcat(*[c.value for c in network.capacities])
        theta = network.symbols
        jacobians = [ca.densify(ca.jacobian(e, theta)) for e in (kappa, heat)]
        self.classes = ca.Function("classes", [theta], [kappa, heat], ["theta"], ["conductance", "capacity"])
        self._jacobians = ca.Function("jacobians", [theta], jacobians)
        self._faces, self.sources, self.elimination = faces, _Sources(network, sources, projection), Elimination()
        heating, observation, uniform = network.heating, network.observation, np.ones(network.n_node)
        reading: Matrix = network.reading if network.readings else None
        self.class_flows: list[Matrix]
        self.class_masses: list[Matrix]
        if projection is None:
            self.class_flows = [_class_laplacian(network, c) for c in faces]
            self.class_masses = [_class_mass(network.n_node, c) for c in network.capacities]
        else:
            v, padded = projection, np.vstack([projection, np.zeros((network.n_boundary, projection.shape[1]))])
            self.class_flows = [_projected_class(c, padded, network.n_boundary) for c in faces]
            self.class_masses = [congruent(v[c.node], c.weight) for c in network.capacities]
            heating, observation, uniform = v.T @ heating.toarray(), observation @ v, v.T @ uniform
            reading = None if reading is None else reading @ v
        self.n_state = uniform.size
        outside = partial(Matrices, n_signal=len(network.signals), airflows=network.airflows)
        outside = partial(outside, emitted=network.emitted)
        self._at_any = partial(outside, heating=heating, observation=observation, uniform=uniform, reading=reading)

    def __repr__(self) -> str:
        n, network = self.n_state, self.network
        return f"{type(self).__name__}({n} states, {len(network.zones)} zones, {len(network.parameters)} parameters)"

    def matrices(self, theta: FloatArray, sensitivities: bool = False) -> Matrices:
        """Assemble the model at θ.

        Parameters
        ----------
        theta : ndarray, shape (n_parameter,)
            Parameter values, as in `ThermalNetwork.parameters` [parameter units].
        sensitivities : bool
            Also the derivatives with respect to θ.

        Raises
        ------
        ModelError
            When θ has the wrong length or a value that is not positive and finite.
        """
        theta = np.asarray(theta, dtype=float)
        names = [p.name for p in self.network.parameters]
        if theta.shape != (len(names),):
            raise ModelError(f"theta: expected shape ({len(names)},) for {names}, got {theta.shape}")
        for p, t in zip(self.network.parameters, theta, strict=True):
            if not np.isfinite(t) or (t <= 0 and p.scale != "linear"):
                raise ModelError(f"theta: expected positive finite values, got {t} for {p.name}")
            if p.scale == "logit" and t > 1:
                raise ModelError(f"theta: expected a probability of at most 1, got {t} for {p.name}")
        kappa, heat = (np.array(v).ravel() for v in self.classes(theta))
        kappa[(kappa < 0.0) & (kappa > -_RELAXED)] = 0.0
        negative = [c.name for c, k in zip(self._faces, kappa, strict=False) if not (np.isfinite(k) and k >= 0)]
        if negative:
            raise ModelError(
                f"theta: makes the conductance of {negative} negative; a parameter lies outside of its physical range"
            )
        flow_sensitivities: list[Matrix] = []
        capacity_sensitivities: list[Matrix] = []
        if sensitivities:
            d_kappa, d_heat = (np.asarray(v) for v in self._jacobians(theta))
            flow_sensitivities = [self._flow(d_kappa[:, j]) for j in range(theta.size)]
            capacity_sensitivities = [_weighted(self.class_masses, d_heat[:, j]) for j in range(theta.size)]
        return self._at_any(
            capacity=_weighted(self.class_masses, heat),
            flow=self._flow(kappa),
            capacity_sensitivities=capacity_sensitivities,
            flow_sensitivities=flow_sensitivities,
        )

    def source_sensitivities(self, theta: FloatArray) -> Matrix:
        """Heat that the signals bring per unit of every parameter, a column for each that the parameter moves.

        Parameters
        ----------
        theta : ndarray, shape (n_parameter,)
            Parameter values [parameter units].
        """
        sensitivities = np.asarray(self._jacobians(np.asarray(theta, dtype=float))[0])
        return self.sources.columns(sensitivities[len(self.class_flows) :])

    def _flow(self, weights: FloatArray) -> Matrix:
        """Sum of the classes of faces, then of sources, with weights."""
        count = len(self.class_flows)
        return self.sources.added(_weighted(self.class_flows, weights[:count]), weights[count:])


class _Sources:
    """Heat that signals bring: columns of -B, summed over classes.

    Parameters
    ----------
    network : ThermalNetwork
        For its sizes.
    classes : list of ConductanceClass
        Sources.
    projection : ndarray, shape (n_node, r), optional
        Basis of a reduction [-].
    """

    def __init__(self, network: ThermalNetwork, classes: list[ConductanceClass], projection: FloatArray | None) -> None:
        count, n = len(classes), network.n_node
        sizes = [c.first.size for c in classes]
        rows, column = np.concatenate([[], *[c.first for c in classes]]).astype(int), np.repeat(np.arange(count), sizes)
        weight = np.concatenate([[], *[c.weight for c in classes]])
        spread = sp.csc_matrix((weight, (rows, column)), shape=(n, count))
        self.signal = np.array([c.second[0] - n for c in classes], dtype=np.int64)
        self.spread: Matrix = spread if projection is None else np.asarray((spread.T @ projection).T)
        self.n_boundary = network.n_boundary

    def added(self, flow: Matrix, weights: FloatArray) -> Matrix:
        """Add the sources to ``[K, -B]``.

        Parameters
        ----------
        flow : matrix, shape (n, n + n_boundary)
            Of the faces.
        weights : ndarray, shape (n_source,)
            Values of the classes, or their sensitivities.
        """
        there = np.flatnonzero(weights)
        if not there.size:
            return flow
        n = flow.shape[0]
        if sp.issparse(flow):
            lift = sp.csr_matrix((-weights[there], (there, n + self.signal[there])), (weights.size, flow.shape[1]))
            return sp.csr_matrix(flow + self.spread @ lift)
        flow = flow.copy()
        np.add.at(flow.T, n + self.signal[there], -weights[there, None] * self.spread[:, there].T)
        return flow

    def columns(self, sensitivities: FloatArray) -> Matrix:
        """Columns of B per unit of every parameter, those of one parameter after those of another, zeros left out.

        Parameters
        ----------
        sensitivities : ndarray, shape (n_source, n_parameter)
            Of the values of the classes.
        """
        parameter, source = np.nonzero(sensitivities.T)
        place = parameter * (self.signal.max(initial=0) + 1) + self.signal[source]
        there, column = np.unique(place, return_inverse=True)
        return self.spread @ sp.csc_matrix(
            (sensitivities[source, parameter], (source, column)), shape=(len(sensitivities), there.size)
        )


def _weighted(terms: list[Matrix], weights: FloatArray) -> Matrix:
    """Sum of class matrices with weights; zero weights cost nothing."""
    chosen = [w * m for w, m in zip(weights, terms, strict=True) if w != 0.0]
    total = sum(chosen[1:], chosen[0]) if chosen else 0.0 * terms[0]
    if sp.issparse(total):
        total = sp.csr_matrix(total)
        total.eliminate_zeros()
    return total


#: Faces that are projected together, so that a class of all of a large grid fits the memory.
_FACES = 8192


def _projected_class(c: ConductanceClass, padded: FloatArray, n_boundary: int) -> FloatArray:
    """Rows of a class's graph Laplacian at κ = 1 on a basis, zero at boundaries, by faces: (r, r + n_boundary)."""
    n, r = len(padded) - n_boundary, padded.shape[1]
    total = np.zeros((r, r + n_boundary))
    for begin in range(0, c.weight.size, _FACES):
        part = slice(begin, begin + _FACES)
        ends, weight = (c.first[part], c.second[part]), c.weight[part]
        drop = padded[ends[0]] - padded[ends[1]]
        total[:, :r] += congruent(drop, weight)
        for sign, end in zip((1.0, -1.0), ends, strict=True):
            out = np.flatnonzero(end >= n)
            for boundary in np.unique(end[out]):
                faces = out[end[out] == boundary]
                total[:, r + boundary - n] += sign * (weight[faces] @ drop[faces])
    return total


def congruent(rows: FloatArray, weight: FloatArray) -> FloatArray:
    """``V' diag(w) V`` of positive weights, by a symmetric product, shape (r, r).

    Parameters
    ----------
    rows : ndarray, shape (n, r)
        V [-].
    weight : ndarray, shape (n,)
        w, not negative [any].
    """
    scaled = np.sqrt(weight)[:, None] * rows
    return np.asarray(scaled.T @ scaled)


def _class_laplacian(network: ThermalNetwork, c: ConductanceClass) -> sp.csr_matrix:
    """Rows of the graph Laplacian of a conductance class at κ = 1, shape (n_node, n_node + n_boundary)."""
    n, total = network.n_node, network.n_node + network.n_boundary
    rows = np.concatenate([c.first, c.second, c.first, c.second])
    columns = np.concatenate([c.first, c.second, c.second, c.first])
    values = np.concatenate([c.weight, c.weight, -c.weight, -c.weight])
    return sp.csr_matrix((values, (rows, columns)), shape=(total, total))[:n]


def _class_mass(n: int, c: CapacityClass) -> sp.csr_matrix:
    """Diagonal matrix of a capacity class at unit heat capacity, shape (n_node, n_node)."""
    return sp.csr_matrix(sp.diags(np.bincount(c.node, c.weight, minlength=n)))
