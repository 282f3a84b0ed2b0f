"""A reduced model as a discrete state space: decoupled modes where they decouple, dense where air moves one way."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from calibration.errors import FilterError
from thermal._types import FloatArray
from thermal.model.modal import ModalModel
from thermal.model.step import IMPLICIT_EULER, Scheme
from thermal.units import AIR_HEAT_CAPACITY

#: Temperatures are stepped as differences from this one [K], as in a replay: nothing changes but round-off.
REFERENCE = 293.15


@dataclass(frozen=True)
class StateSpace:
    """One step of a building, ``x' = A x + B u`` with the zone means over it, ``y = C x + D u``.

    u are the boundary temperatures, then the heat of the zones, both constant during the step; x is the state at its
    start. Temperatures are differences from `REFERENCE`.

    Parameters
    ----------
    step : float
        Length of a step [s].
    transition : ndarray, shape (r,) or (r, r)
        A: the diagonal where the modes decouple, else a matrix [-].
    drive : ndarray, shape (r, n_boundary + n_zone)
        B [(W K)^0.5 per K or W].
    observation : ndarray, shape (n_zone, r)
        C [(K/W)^0.5].
    feedthrough : ndarray, shape (n_zone, n_boundary + n_zone)
        D [K per K or W].
    zone_means : ndarray, shape (n_zone, r)
        Zone means of a state, not of a step [(K/W)^0.5].
    uniform : ndarray, shape (r,)
        The state in which every volume is at 1 K [(W K)^0.5].
    coordinates : ndarray, shape (r, n)
        From the states of the reduced model to x [(W/K)^0.5].
    airflows : tuple of (int, int)
        Source and target zone of each directed airflow.
    flow : ndarray, shape (n_airflow,)
        Directed airflows that A holds [kg/s].
    """

    step: float
    transition: FloatArray
    drive: FloatArray
    observation: FloatArray
    feedthrough: FloatArray
    zone_means: FloatArray
    uniform: FloatArray
    coordinates: FloatArray
    airflows: tuple[tuple[int, int], ...] = ()
    flow: FloatArray | None = None

    @property
    def order(self) -> int:
        """Number of states r."""
        return int(self.observation.shape[1])

    @property
    def n_zone(self) -> int:
        """Number of zones."""
        return int(self.observation.shape[0])

    @property
    def n_boundary(self) -> int:
        """Number of boundary temperatures."""
        return int(self.drive.shape[1]) - self.n_zone

    @property
    def heat_drive(self) -> FloatArray:
        """Columns of B that belong to the zones' heat, shape (r, n_zone)."""
        return self.drive[:, self.n_boundary :]

    @property
    def heat_feedthrough(self) -> FloatArray:
        """Columns of D that belong to the zones' heat, shape (n_zone, n_zone)."""
        return self.feedthrough[:, self.n_boundary :]

    def start(self, states: FloatArray) -> FloatArray:
        """State x of states of the reduced model, as `thermal.spin_up` returns them.

        Parameters
        ----------
        states : ndarray, shape (n, m)
            States of the reduced model [K].
        """
        return np.asarray(self.coordinates @ states - REFERENCE * self.uniform[:, None])

    def drives(self, boundary: FloatArray, heat: FloatArray) -> FloatArray:
        """Put boundary temperatures and heat together, u of shape (..., n_boundary + n_zone).

        Parameters
        ----------
        boundary : ndarray, shape (..., n_boundary)
            Boundary temperatures [K].
        heat : ndarray, shape (..., n_zone)
            Heat given to the zones [W].
        """
        return np.concatenate([boundary - REFERENCE, heat], axis=-1)

    def advance(self, states: FloatArray) -> FloatArray:
        """Multiply states in columns, ``A x``.

        Parameters
        ----------
        states : ndarray, shape (r,) or (r, m)
            States [(W K)^0.5].
        """
        return _times(self.transition, states)

    def retreat(self, costates: FloatArray) -> FloatArray:
        """Multiply vectors in columns by the transpose, ``A' x``.

        Parameters
        ----------
        costates : ndarray, shape (r,) or (r, m)
            Vectors of the dual space [(W K)^-0.5].
        """
        return _times(self.transition.T, costates)

    def directed_heat(self, airflow: FloatArray, states: FloatArray) -> FloatArray:
        """Heat by which the directed airflows of a step differ from those in A, (n_zone, m) [W].

        Parameters
        ----------
        airflow : ndarray, shape (n_airflow, m)
            Directed airflows of the step [kg/s].
        states : ndarray, shape (r, m)
            States at its start [(W K)^0.5].
        """
        zone = self.zone_means @ states
        heat = np.zeros_like(zone)
        if self.flow is not None:
            for (source, target), change in zip(self.airflows, airflow - self.flow[:, None], strict=True):
                heat[target] += AIR_HEAT_CAPACITY * change * (zone[source] - zone[target])
        return heat


def state_space(
    modes: ModalModel,
    step: float,
    scheme: Scheme = IMPLICIT_EULER,
    *,
    airflows: tuple[tuple[int, int], ...] = (),
    flow: FloatArray | None = None,
) -> StateSpace:
    """State space of a reduced model over one step.

    Without directed airflows the modes decouple and A stays a vector. With them their mean belongs to A, which is then
    dense; what a step's airflows differ from it by acts as a known heat at the temperatures of the step's start
    (`StateSpace.directed_heat`), so that A does not change with time.

    Parameters
    ----------
    modes : ModalModel
        Of `thermal.reduced_model`, at one θ.
    step : float
        Step of the telemetry [s], positive.
    scheme : Scheme
        Implicit Euler by default, as the model alone is stepped; ``EXACT`` too.
    airflows : tuple of (int, int)
        Source and target zone of each directed airflow, as in `ThermalNetwork`.
    flow : ndarray, shape (n_airflow,)
        Their mean [kg/s]; zero by default.

    Raises
    ------
    FilterError
        When the number of flows is not that of the airflows.
    ModelError
        When the step is not positive.

    Examples
    --------
    >>> from thermal.data import load_bundled_case
    >>> from thermal.model.reduce import reduced_model
    >>> from thermal.model.matrices import SymbolicModel
    >>> from thermal.network.build import build_network
    >>> grid = SymbolicModel(build_network(load_bundled_case().building, dx=1.0))
    >>> small = reduced_model(grid, [grid.network.start()])
    >>> space = state_space(small.matrices(grid.network.start()).modal.modes, 300.0)
    >>> space.transition.ndim, space.drive.shape[1]
    (1, 6)
    """
    flow = np.zeros(len(airflows)) if flow is None else np.asarray(flow, dtype=float)
    if flow.shape != (len(airflows),):
        raise FilterError(f"flow: expected one mean for each of {len(airflows)} airflows, got shape {flow.shape}")
    push, observe = np.hstack([modes.boundary, modes.heating]), modes.output
    p = modes.propagator(step, scheme)
    if not np.any(flow):
        transition, mean = p.end, p.mean
        drive, mean_drive = p.end_gain[:, None] * push, p.mean_gain[:, None] * push
        seen = observe * mean
    else:
        transition, mean, drive, mean_drive = _mixed(modes, push, _mixing(airflows, flow, len(observe)), step, scheme)
        seen = observe @ mean
    return StateSpace(
        step=float(step),
        transition=transition,
        drive=drive,
        observation=seen,
        feedthrough=observe @ mean_drive,
        zone_means=observe,
        uniform=modes.uniform,
        coordinates=modes.coordinates,
        airflows=tuple(airflows),
        flow=flow if airflows else None,
    )


def _times(transition: FloatArray, x: FloatArray) -> FloatArray:
    """Product of a diagonal or a matrix with columns."""
    if transition.ndim == 2:
        return np.asarray(transition @ x)
    return np.asarray(transition * x if x.ndim == 1 else transition[:, None] * x)


def _mixing(airflows: tuple[tuple[int, int], ...], flow: FloatArray, n_zone: int) -> FloatArray:
    """M [W/K], (n_zone, n_zone): air that enters a zone at another zone's temperature."""
    mixing = np.zeros((n_zone, n_zone))
    for (source, target), rate in zip(airflows, flow, strict=True):
        mixing[target, source] += AIR_HEAT_CAPACITY * rate
        mixing[target, target] -= AIR_HEAT_CAPACITY * rate
    return mixing


def _mixed(
    modes: ModalModel, push: FloatArray, mixing: FloatArray, step: float, scheme: Scheme
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """End and mean of a step with M in it: matrices of the start (r, r), and of the inputs (r, n_input)."""
    r = modes.capacity.size
    stiffness = np.diag(modes.conductance) - modes.heating @ mixing @ modes.observation
    if scheme.stages:
        end, mean = _staged(modes.capacity, stiffness, push, step, scheme)
        return end[:, :r], mean[:, :r], end[:, r:], mean[:, r:]
    # blocks of exp([[F, I, 0], [0, 0, I], [0, 0, 0]]) are e^F and its first two φ functions (Van Loan 1978,
    # doi:10.1109/TAC.1978.1101743)
    big = np.zeros((3 * r, 3 * r))
    big[:r, :r] = -step * stiffness / modes.capacity[:, None]
    big[: 2 * r, r:] = np.eye(2 * r)
    end, first, second = np.hsplit(sl.expm(big)[:r], 3)
    pushed = step * push / modes.capacity[:, None]
    return end, first, first @ pushed, second @ pushed


def _staged(
    capacity: FloatArray, stiffness: FloatArray, push: FloatArray, step: float, scheme: Scheme
) -> tuple[FloatArray, FloatArray]:
    """End and mean of a step of a scheme, from unit starts and then from unit inputs as columns."""
    r, n = push.shape
    start = np.hstack([np.eye(r), np.zeros((r, n))])
    source = np.hstack([np.zeros((r, r)), push])
    trail = [start]
    for stage in scheme.stages:
        base = sum(w * x for w, x in zip(stage.weights, trail, strict=False))
        rhs = capacity[:, None] * base + step * (stage.implicit + stage.explicit) * source
        rhs -= step * stage.explicit * (stiffness @ start)
        trail.append(np.asarray(np.linalg.solve(np.diag(capacity) + step * stage.implicit * stiffness, rhs)))
    mean = sum(w * x for w, x in zip(scheme.mean, trail, strict=True))
    return trail[-1], np.asarray(mean)
