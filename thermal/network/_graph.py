"""Control volumes and faces: the graph that plans and zone tables both become."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal.errors import ModelError
from thermal.parameters import PARAMETERS, Parameter, Scope

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class ConductanceClass:
    """Faces that share one conductance κ(θ): the flow over face f is ``κ weight_f (T_first - T_second)``.

    Parameters
    ----------
    name : str
        For example ``air-interior_wall``.
    value : casadi.SX
        κ as an expression of the parameter symbols.
    first, second : ndarray, shape (n_face,)
        Node numbers; numbers from ``n_node`` on are boundaries.
    weight : ndarray, shape (n_face,)
        Geometry of the face, so that ``κ weight`` is in [W/K].
    """

    name: str
    value: ca.SX
    first: IntArray
    second: IntArray
    weight: FloatArray


@dataclass(frozen=True)
class CapacityClass:
    """Control volumes that share one volumetric (or areal) heat capacity: ``C_i = value weight_i`` [J/K].

    Parameters
    ----------
    name : str
        For example ``air``.
    value : casadi.SX
        Heat capacity as an expression of the parameter symbols.
    node : ndarray of int, shape (n,)
        Node numbers.
    weight : ndarray, shape (n,)
        Volumes [m3] or areas [m2], so that ``value weight`` is in [J/K].
    """

    name: str
    value: ca.SX
    node: IntArray
    weight: FloatArray


@dataclass(frozen=True)
class ThermalNetwork:
    """A building as control volumes and faces, ``C(θ) dT/dt = -K(θ) T + B(θ) u + H q``.

    Parameters
    ----------
    zones : tuple of str
        Zone names, the order of every zone axis.
    boundaries : tuple of str
        Names of the boundary temperatures, ``outdoor`` first.
    kind : ndarray of str, shape (n_node,)
        What each control volume is (``air``, ``radiant``, ``exterior_wall``, ``slab``, ...).
    zone : ndarray, shape (n_node,)
        Zone number, -1 where a volume belongs to none.
    place : ndarray, shape (n_node, 3)
        Floor, row and column of a plan's volume on its grid, -1 elsewhere.
    conductances, capacities : tuple
        The classes; K and C are their sums.
    observation : csr_matrix, shape (n_zone, n_node)
        Zone mean over the air volumes (the paper's T_sim).
    heating : csr_matrix, shape (n_node, n_zone)
        Distribution of a zone's heat over its volumes; columns sum to 1.
    airflows : tuple of (int, int)
        Directed airflows (source zone, target zone).
    parameters : tuple of Parameter
        The θ of this building, in order.
    symbols : casadi.SX, shape (n_parameter,)
        Their symbols in the class expressions.
    nominal : mapping of str to (float, str)
        Values that enter only as a product with a parameter, with their unit (densities [kg/m3]): never estimated.
    spacing : float or None
        Distance between the volumes of a plan [m]; None for a zone table.
    floor_shapes : tuple of (int, int)
        Rows and columns of each floor's grid, outside included; empty for a zone table.
    """

    zones: tuple[str, ...]
    boundaries: tuple[str, ...]
    kind: NDArray[np.str_]
    zone: IntArray
    place: IntArray
    conductances: tuple[ConductanceClass, ...]
    capacities: tuple[CapacityClass, ...]
    observation: sp.csr_matrix
    heating: sp.csr_matrix
    airflows: tuple[tuple[int, int], ...]
    parameters: tuple[Parameter, ...]
    symbols: ca.SX
    nominal: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    spacing: float | None = None
    floor_shapes: tuple[tuple[int, int], ...] = ()

    @property
    def n_node(self) -> int:
        """Number of control volumes, boundaries not counted."""
        return len(self.kind)

    @property
    def n_boundary(self) -> int:
        """Number of boundary temperatures."""
        return len(self.boundaries)

    def start(self) -> FloatArray:
        """Parameter vector θ before calibration, shape (n_parameter,)."""
        return np.array([p.start for p in self.parameters])

    def values(self, given: Mapping[str, float]) -> FloatArray:
        """Parameter vector θ with ``given`` values by name and the starts for the rest.

        Parameters
        ----------
        given : mapping of str to float
            Values by name [parameter units].

        Raises
        ------
        ModelError
            When a name is not a parameter of this building.
        """
        names = [p.name for p in self.parameters]
        fixed = sorted(set(given) & set(self.nominal))
        if fixed:
            raise ModelError(
                f"{fixed} are nominal: only their product with the heat capacity counts, so give that instead"
            )
        unknown = sorted(set(given) - set(names))
        if unknown:
            raise ModelError(f"parameters {unknown} are not of this building; it has {names}")
        for name, value in given.items():
            if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not 0 < value < np.inf:
                raise ModelError(f"{name}: expected a positive finite number, came {value!r}")
        return np.array([float(given.get(p.name, p.start)) for p in self.parameters])


class GraphBuilder:
    """Collects volumes and faces, then makes the network; used by the plan and the zone-table builders.

    Parameters
    ----------
    zones, boundaries : tuple of str
        Names, in order; ``outdoor`` is the first boundary.
    scopes : mapping of str to {"global", "zone"}
        Parameters that get one value a zone; the others are global.
    """

    def __init__(self, zones: tuple[str, ...], boundaries: tuple[str, ...], scopes: Mapping[str, Scope]) -> None:
        unknown = sorted(set(scopes) - set(PARAMETERS))
        if unknown:
            raise ModelError(f"scopes name unknown parameters {unknown}; known are {sorted(PARAMETERS)}")
        odd = {name: scope for name, scope in scopes.items() if scope not in get_args(Scope)}
        if odd:
            raise ModelError(f"scopes: expected one of {get_args(Scope)} for each parameter, came {odd}")
        self.zones, self.boundaries, self.scopes = zones, boundaries, dict(scopes)
        self.nominal: dict[str, tuple[float, str]] = {}
        self._parameters: dict[str, tuple[Parameter, ca.SX]] = {}
        self._kind: list[NDArray[np.str_]] = []
        self._zone: list[IntArray] = []
        self._place: list[IntArray] = []
        self._count = 0
        self._faces: dict[str, tuple[ca.SX, list[tuple[Any, Any, Any]]]] = {}
        self._masses: dict[str, tuple[ca.SX, list[tuple[IntArray, FloatArray]]]] = {}

    def parameter(self, name: str, zone: str | None = None, factor: float = 1.0) -> ca.SX:
        """Symbol of a parameter; a zone's own when its scope is ``zone``.

        Parameters
        ----------
        name : str
            Name in `thermal.parameters.PARAMETERS`.
        zone : str, optional
            Zone it acts in; None for what belongs to no single zone.
        factor : float
            Scale of start and range [-], for wall thickness.
        """
        full = f"{name}@{zone}" if zone is not None and self.scopes.get(name) == "zone" else name
        if full not in self._parameters:
            base = PARAMETERS[name].rescaled(factor) if factor != 1.0 else PARAMETERS[name]
            own = Parameter(full, base.unit, base.start, base.lower, base.upper, base.source, base.logit)
            self._parameters[full] = (own, ca.SX.sym(full))
        return self._parameters[full][1]

    @property
    def size(self) -> int:
        """Number of control volumes so far."""
        return self._count

    def key(self, name: str, zone: str | None, *parameters: str) -> str:
        """Class name: the zone is part of it when one of the parameters is per zone.

        Parameters
        ----------
        name : str
            What the faces join.
        zone : str, optional
            Zone they belong to.
        *parameters : str
            Parameters in their conductance.
        """
        own = zone is not None and any(self.scopes.get(p) == "zone" for p in parameters)
        return f"{name}@{zone}" if own else name

    def volumes(self, kind: str, zone: Any, place: IntArray | None = None) -> IntArray:
        """Add control volumes of one kind; returns their node numbers, shape (n,).

        Parameters
        ----------
        kind : str
            What they are.
        zone : int or ndarray of int, shape (n,)
            Zone numbers, -1 for none; their count is the number of volumes.
        place : ndarray of int, shape (n, 3), optional
            Floor, row and column on a plan's grid.
        """
        zone = np.atleast_1d(np.asarray(zone, dtype=np.int64))
        n = zone.size
        self._kind.append(np.full(n, kind))
        self._zone.append(zone)
        self._place.append(np.full((n, 3), -1, dtype=np.int64) if place is None else place)
        self._count += n
        return np.arange(self._count - n, self._count)

    def boundary(self, name: str) -> int:
        """Code of a boundary in a face: negative until the graph is finished.

        Parameters
        ----------
        name : str
            One of the boundaries.
        """
        return -1 - self.boundaries.index(name)

    def face(self, key: str, value: Any, first: Any, second: Any, weight: Any) -> None:
        """Add faces of one class.

        Parameters
        ----------
        key : str
            Class name; the first faces of a class give it its conductance.
        value : casadi.SX or float
            Conductance κ as an expression of the parameter symbols [W/K per weight].
        first, second : int or ndarray of int, shape (n,)
            Nodes or boundary codes, broadcast.
        weight : float or ndarray, shape (n,)
            Geometry, so that κ times weight is in [W/K].
        """
        first, second, weight = np.broadcast_arrays(
            np.atleast_1d(first), np.atleast_1d(second), np.asarray(weight, float)
        )
        self._faces.setdefault(key, (ca.SX(value), []))[1].append((first, second, weight))

    def capacity(self, key: str, value: ca.SX | float, node: Any, weight: Any) -> None:
        """Give volumes of one class their heat capacity.

        Parameters
        ----------
        key : str
            Class name.
        value : casadi.SX or float
            Heat capacity as an expression of the parameter symbols [J/m3/K or J/m2/K].
        node : int or ndarray of int, shape (n,)
            Nodes.
        weight : float or ndarray, shape (n,)
            Volumes [m3] or areas [m2].
        """
        node, weight = np.broadcast_arrays(np.atleast_1d(node), np.asarray(weight, float))
        self._masses.setdefault(key, (ca.SX(value), []))[1].append((node, weight))

    def finish(
        self,
        observation: sp.csr_matrix,
        heating: sp.csr_matrix,
        airflows: tuple[tuple[int, int], ...],
        spacing: float | None = None,
        floor_shapes: tuple[tuple[int, int], ...] = (),
    ) -> ThermalNetwork:
        """Make the network from what was added.

        Parameters
        ----------
        observation : csr_matrix, shape (n_zone, n_node)
            Zone means [-].
        heating : csr_matrix, shape (n_node, n_zone)
            Distribution of a zone's heat [-].
        airflows : tuple of (int, int)
            Source and target zone of each directed airflow.
        spacing : float, optional
            Distance between the volumes of a plan [m].
        floor_shapes : tuple of (int, int)
            Rows and columns of each floor's grid.
        """
        shared = [
            n
            for n, s in self.scopes.items()
            if s == "zone" and not any(p.startswith(f"{n}@") for p in self._parameters)
        ]
        if shared:
            raise ModelError(
                f"scopes: {shared} belong to no single zone of this building; only the global scope fits them"
            )

        def join(parts: list[Any], column: int) -> Any:
            joined = np.concatenate([p[column] for p in parts])
            return np.where(joined < 0, self._count - 1 - joined, joined) if column < 2 else joined

        conductances = tuple(
            ConductanceClass(k, v, join(f, 0), join(f, 1), join(f, 2).astype(float))
            for k, (v, f) in self._faces.items()
        )
        capacities = tuple(
            CapacityClass(k, v, np.concatenate([m[0] for m in ms]), np.concatenate([m[1] for m in ms]).astype(float))
            for k, (v, ms) in self._masses.items()
        )
        return ThermalNetwork(
            zones=self.zones,
            boundaries=self.boundaries,
            kind=np.concatenate(self._kind),
            zone=np.concatenate(self._zone),
            place=np.concatenate(self._place),
            conductances=conductances,
            capacities=capacities,
            observation=observation,
            heating=heating,
            airflows=airflows,
            parameters=tuple(p for p, _ in self._parameters.values()),
            symbols=ca.vertcat(*[s for _, s in self._parameters.values()]) if self._parameters else ca.SX(0, 1),
            nominal=dict(self.nominal),
            spacing=spacing,
            floor_shapes=floor_shapes,
        )
