"""The builder of a network: volumes, faces and the parameters in them, collected one by one."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from typing import Any, get_args

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.case.building import GeometryQuality
from thermal.errors import ModelError
from thermal.inputs.signals import Signal
from thermal.network.network import CapacityClass, ConductanceClass, ThermalNetwork
from thermal.network.structure import BASELINE, Structure
from thermal.network.topology import Anatomy
from thermal.parameters import ENVELOPE_PARAMETERS, FACADE_PREFIX, PARAMETERS, Parameter, Scope


class GraphBuilder:
    """Collects volumes and faces, then makes the network; used by the plan and the zone-table builders.

    Parameters
    ----------
    zones, boundaries : tuple of str
        Names, in order; ``outdoor`` is the first boundary.
    scopes : mapping of str to {"global", "facade", "zone"}
        Parameters that get one value a facade or a zone; the others are global.
    structure : Structure
        What the model is made of.

    Raises
    ------
    ModelError
        When a scope is unknown, or a facade's value asked for what is no part of the envelope.
    """

    def __init__(
        self,
        zones: tuple[str, ...],
        boundaries: tuple[str, ...],
        scopes: Mapping[str, Scope],
        structure: Structure = BASELINE,
    ) -> None:
        _check_scopes(scopes, zones)
        self.zones, self.boundaries, self.scopes, self.structure = zones, boundaries, dict(scopes), structure
        self.anatomy = Anatomy()
        self.quality: GeometryQuality = "approximate"
        self.nominal: dict[str, tuple[float, str]] = {}
        self._signals: dict[str, Signal] = {}
        self._numbers: dict[str, int] = {}
        self._joined: tuple[Any, ...] = (0,)
        self._readings: dict[int, int] = {}
        self._sources: set[str] = set()
        self._parameters: dict[str, tuple[Parameter, ca.SX]] = {}
        self._kind: list[NDArray[np.str_]] = []
        self._zone: list[IntArray] = []
        self._place: list[IntArray] = []
        self._count = 0
        self._faces: dict[str, tuple[ca.SX, list[tuple[Any, Any, Any]]]] = {}
        self._masses: dict[str, tuple[ca.SX, list[tuple[IntArray, FloatArray]]]] = {}

    def copy(self) -> GraphBuilder:
        """Another with the same volumes and faces, to which more can be added."""
        other = copy(self)
        for name, value in vars(self).items():
            if isinstance(value, dict | list | set):
                setattr(other, name, copy(value))
        other._faces = {key: (value, list(faces)) for key, (value, faces) in self._faces.items()}
        other._masses = {key: (value, list(masses)) for key, (value, masses) in self._masses.items()}
        other.anatomy = self.anatomy.copy()
        return other

    def parameter(self, name: str, zone: str | None = None, factor: float = 1.0, *, facade: str | None = None) -> ca.SX:
        """Symbol of a parameter; that of a zone or a facade when its scope says so.

        Parameters
        ----------
        name : str
            Name in `thermal.parameters.PARAMETERS`.
        zone : str, optional
            Zone it acts in; None for what belongs to no single zone.
        factor : float
            Scale of start and range [-], for wall thickness.
        facade : str, optional
            Facade it acts on; None for what belongs to none.
        """
        own = PARAMETERS[name].rescaled(factor) if factor != 1.0 else PARAMETERS[name]
        if zone is not None and self.scopes.get(name) == "zone":
            own = own.of("zone", zone)
        elif facade is not None and self.scopes.get(name) == "facade":
            own = own.of("facade", facade)
        return self.own(own)

    def own(self, parameter: Parameter) -> ca.SX:
        """Symbol of a parameter that an effect brings.

        Parameters
        ----------
        parameter : Parameter
            Of the effect; one of a zone or a facade is that of `Parameter.of`.
        """
        if parameter.name not in self._parameters:
            self._parameters[parameter.name] = (parameter, ca.SX.sym(parameter.name))
        return self._parameters[parameter.name][1]

    @property
    def parameters(self) -> list[tuple[Parameter, ca.SX]]:
        """Parameters so far, with their symbols."""
        return list(self._parameters.values())

    def classes(self) -> list[tuple[str, ca.SX, IntArray, IntArray, FloatArray]]:
        """Classes of faces so far, sources left out: name, κ, both ends, and weights."""

        def join(faces: list[tuple[Any, Any, Any]], column: int) -> Any:
            return np.concatenate([face[column] for face in faces])

        return [
            (key, value, join(faces, 0), join(faces, 1), join(faces, 2).astype(float))
            for key, (value, faces) in self._faces.items()
            if key not in self._sources
        ]

    @property
    def size(self) -> int:
        """Number of control volumes so far."""
        return self._count

    @property
    def has_facades(self) -> bool:
        """Whether a parameter has one value a facade."""
        return "facade" in self.scopes.values()

    def key(self, name: str, zone: str | None, *parameters: str, facade: str | None = None) -> str:
        """Class name: zone and facade are part of it when one of the parameters is a zone's or a facade's own.

        Parameters
        ----------
        name : str
            What the faces join.
        zone : str, optional
            Zone they belong to.
        *parameters : str
            Parameters in their conductance.
        facade : str, optional
            Facade they belong to.
        """
        scopes = {self.scopes.get(p) for p in parameters}
        members = [zone] if zone is not None and "zone" in scopes else []
        members += [FACADE_PREFIX + facade] if facade is not None and "facade" in scopes else []
        return "@".join([name, *members])

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
        ends = np.atleast_1d(first), np.atleast_1d(second)
        first, second, weight = np.broadcast_arrays(*ends, np.asarray(weight, float))
        self._faces.setdefault(key, (ca.SX(value), []))[1].append((first, second, weight))

    def source(self, key: str, value: Any, node: Any, signal: Signal, weight: Any) -> None:
        """Give volumes heat that a signal brings, ``value weight s(t)`` [W].

        Parameters
        ----------
        key : str
            Class name; sources of one name share their value and their signal.
        value : casadi.SX or float
            Heat per unit of signal and weight, as an expression of the parameter symbols [W per both].
        node : int or ndarray of int, shape (n,)
            Nodes.
        signal : Signal
            What drives it.
        weight : float or ndarray, shape (n,)
            Geometry, such as areas [m2].
        """
        name = f"{key} <- {signal.name}"
        self._sources.add(name)
        self.face(name, value, node, self.signal(signal), weight)

    def signal(self, signal: Signal) -> int:
        """Code of a signal in a face; there it is a temperature, counted from the reference of 20 degC.

        Parameters
        ----------
        signal : Signal
            Signals of one name are one.
        """
        self._signals.setdefault(signal.name, signal)
        return -1 - len(self.boundaries) - self._numbers.setdefault(signal.name, len(self._numbers))

    def touching(self, node: Any) -> list[tuple[ca.SX, IntArray, IntArray, FloatArray]]:
        """Faces so far with one end among given nodes and the other not: κ, inner nodes, far ends and weights.

        Parameters
        ----------
        node : ndarray of int, shape (n,)
            Nodes.
        """
        classes = [c for key, c in self._faces.items() if key not in self._sources]
        parts = [(number, f) for number, (_, faces) in enumerate(classes) for f in faces]
        if len(parts) != self._joined[0]:  # sources that are added change nothing
            kind = np.repeat([number for number, _ in parts], [f[0].size for _, f in parts])
            self._joined = (len(parts), kind, *(np.concatenate([f[k] for _, f in parts]) for k in range(3)))
        _, kind, first, second, weight = self._joined
        inside = (np.isin(first, node), np.isin(second, node))
        found = []
        for here, there, near, far in ((inside[0], inside[1], first, second), (inside[1], inside[0], second, first)):
            across = np.flatnonzero(here & ~there)
            for group in np.split(across, np.flatnonzero(np.diff(kind[across])) + 1):
                if group.size:
                    found.append((classes[kind[group[0]]][0], near[group], far[group], weight[group].astype(float)))
        return found

    def reading(self, zone: int, node: int) -> None:
        """Let a zone's sensor read a node instead of the mean of its air.

        Parameters
        ----------
        zone : int
            Number of the zone.
        node : int
            The sensor's node.
        """
        self._readings[zone] = node

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

    def air_capacity(self, zone: str, node: Any, volume: Any) -> None:
        """Give the air of a zone its heat capacity, and that of what follows it where the structure has it.

        Parameters
        ----------
        zone : str
            Name of the zone.
        node : int or ndarray of int, shape (n,)
            Its air.
        volume : float or ndarray, shape (n,)
            How much each has [m3].
        """
        name = "air_capacity_multiplier"
        more = self.parameter(name, zone) if self.structure.light_contents else 1.0
        self.capacity(self.key("air", zone, name), self.anatomy.air_heat_capacity * more, node, volume)

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
        self._refuse_unused_scopes()

        def join(parts: list[Any], column: int) -> Any:
            joined = np.concatenate([p[column] for p in parts])
            return np.where(joined < 0, self._count - 1 - joined, joined) if column < 2 else joined

        conductances = tuple(
            ConductanceClass(k, v, join(f, 0), join(f, 1), join(f, 2).astype(float), k in self._sources)
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
            signals=tuple(self._signals.values()),
            readings=dict(self._readings),
            anatomy=self.anatomy,
        )

    def _refuse_unused_scopes(self) -> None:
        """Refuse scopes that gave nobody a value of its own, rather than leave the parameter global in silence."""
        made = [p for p, _ in self._parameters.values()]
        for name, scope in self.scopes.items():
            if scope == "global" or any(p.base == name and p.scope == scope for p in made):
                continue
            if not any(p.base == name for p in made):
                place = f"this building with {self.structure}; it has {sorted({p.base for p in made})}"
                raise ModelError(f"scopes: {name} is no parameter of {place}")
            outer = name in ENVELOPE_PARAMETERS
            fitting = "the scopes global and facade fit" if outer else "only the global scope fits"
            raise ModelError(f"scopes: {name} belongs to no single {scope} of this building; {fitting} it")


def _check_scopes(scopes: Mapping[str, Scope], zones: tuple[str, ...]) -> None:
    """Refuse unknown parameters and scopes, facades of what is no envelope, and zones named as facades are."""
    unknown = sorted(set(scopes) - set(PARAMETERS))
    if unknown:
        raise ModelError(f"scopes name unknown parameters {unknown}; known are {sorted(PARAMETERS)}")
    odd = {name: scope for name, scope in scopes.items() if scope not in get_args(Scope)}
    if odd:
        raise ModelError(f"scopes: expected one of {get_args(Scope)} for each parameter, got {odd}")
    inner = sorted(name for name, scope in scopes.items() if scope == "facade" and name not in ENVELOPE_PARAMETERS)
    if inner:
        fitting = list(ENVELOPE_PARAMETERS)
        raise ModelError(f"scopes: {inner} belong to no facade; these may have one value a facade: {fitting}")
    confused = sorted(zone for zone in zones if zone.startswith(FACADE_PREFIX))
    if confused and any(scope != "global" for scope in scopes.values()):
        raise ModelError(f"scopes: zones {confused} are named as the facades of parameters are; rename them")
