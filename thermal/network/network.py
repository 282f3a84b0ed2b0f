"""Control volumes and faces of a building as data: what plans and zone tables both become."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from thermal._types import FloatArray, IntArray
from thermal.errors import ModelError
from thermal.inputs.normalisation import Normalisation
from thermal.inputs.signals import Signal
from thermal.network.topology import Anatomy
from thermal.parameters import Parameter

#: Heat of a zone that is usual while it is heated or cooled, over that which it exceeds in 1 % of the time [-].
_USUAL = 0.5


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
    source : bool
        Whether the second end is a signal s(t) that brings the first end ``κ weight s``, whatever its temperature.
    """

    name: str
    value: ca.SX
    first: IntArray
    second: IntArray
    weight: FloatArray
    source: bool = False


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
    signals : tuple of Signal
        What drives the effects beside the boundary temperatures; they are columns of B behind these.
    readings : mapping of int to int
        Sensor nodes by zone number, where a sensor does not read the mean of the air.
    anatomy : Anatomy
        What its volumes and faces are part of.
    normalisation : Normalisation, optional
        Constants that the signals are counted by, of the calibration that the model belongs to; None where there is
        none: a source of inputs then has its own.
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
    signals: tuple[Signal, ...] = ()
    readings: Mapping[int, int] = field(default_factory=dict)
    anatomy: Anatomy = field(default_factory=Anatomy)
    normalisation: Normalisation | None = None

    @property
    def n_node(self) -> int:
        """Number of control volumes, boundaries not counted."""
        return len(self.kind)

    @property
    def n_boundary(self) -> int:
        """Number of boundary temperatures and signals."""
        return len(self.boundaries) + len(self.signals)

    @cached_property
    def reading(self) -> sp.csr_matrix:
        """What the zones' sensors read, shape (n_zone, n_node): the mean of the air, or a sensor's node."""
        if not self.readings:
            return self.observation
        rows = self.observation.tolil(copy=True)
        for zone, node in self.readings.items():
            rows[zone] = 0.0
            rows[zone, node] = 1.0
        return rows.tocsr()

    @cached_property
    def emitted(self) -> FloatArray:
        """Signals by the heat of the zones, where that alone is known or planned, shape (n_signal, n_zone) [W/W].

        Those of emitters, and of `convective` heat.
        """
        found = self.convective.copy()
        numbers = {signal.name: number for number, signal in enumerate(self.signals)}
        for room in self.anatomy.rooms.values():
            for emission in room.emitted:
                found[numbers[emission.signal.name], room.number] = emission.share_of_zone
        return found

    @cached_property
    def convective(self) -> FloatArray:
        """Signals of natural convection by planned heat, shape (n_signal, n_zone) [W/W].

        By the secant at a usual heat of the zone, no less than a quarter of that for which its film is; none where no
        normalisation tells what is usual.
        """
        found = np.zeros((len(self.signals), len(self.zones)))
        numbers = {signal.name: number for number, signal in enumerate(self.signals)}
        known = {} if self.normalisation is None else self.normalisation.heat
        for room in self.anatomy.rooms.values():
            if room.convection is not None and room.name in known:
                usual = max(_USUAL * known[room.name], 0.25 * room.convection.own)
                share = float(room.convection.passed_on(np.array(usual))) / usual
                found[numbers[room.convection.signal.name], room.number] = share
        return found

    @property
    def groups(self) -> dict[str, tuple[int, ...]]:
        """Positions in θ of the parameters that are one quantity of several facades or zones, by its name.

        What a calibration draws towards a common value; a parameter that stands alone is in no group.
        """
        found: dict[str, tuple[int, ...]] = {}
        for number, parameter in enumerate(self.parameters):
            found[parameter.base] = (*found.get(parameter.base, ()), number)
        return {base: numbers for base, numbers in found.items() if len(numbers) > 1}

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
            advice = "only their product with the heat capacity counts, so give that instead"
            raise ModelError(f"{fixed} are nominal: {advice}")
        unknown = sorted(set(given) - set(names))
        if unknown:
            raise ModelError(f"parameters {unknown} are not of this building; it has {names}")
        signed = {p.name for p in self.parameters if p.scale == "linear"}
        for name, value in given.items():
            number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
            what, found = "a finite number" if name in signed else "a positive finite number", repr(value)
            ModelError.unless(number and np.isfinite(value) and (value > 0 or name in signed), name, what, found)
        return np.array([float(given.get(p.name, p.start)) for p in self.parameters])
