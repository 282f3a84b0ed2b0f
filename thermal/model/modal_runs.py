"""Runs of a reduced model in its modes: free, or with the zones held, with forward sensitivities.

Modes are decoupled, so that a run costs vector operations and each sensitivity one matrix product over all its steps.
With ``S = (K + s C)^-1 C`` a step is ``x' = f(S) x + g(S) (K + s C)^-1 b``, and ``d f(S)`` in modal coordinates is
``(dC - d(K + s C) c) ∘ f[c_i, c_j]`` (`divided_differences`).
"""

from dataclasses import replace
from functools import cached_property

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray

from thermal._types import FloatArray
from thermal.model.factor import Pencil
from thermal.model.modal import SHIFT, ModalModel, divided_differences, modal_model, propagator_functions
from thermal.model.sensitivities import ModalSensitivities, all_convolution_sums, convolution_sums, rows_of
from thermal.model.step import IMPLICIT_EULER, Scheme


class PrescribedBasis:
    """States with given means of the held zones, ``ξ = lift y + basis ζ``, where C is diagonal in ζ."""

    def __init__(self, modes: ModalModel, held: NDArray[np.bool_]) -> None:
        observe = modes.observation[held]
        count = observe.shape[0]
        q, upper = sl.qr(observe.T)
        self.lift = sl.solve_triangular(upper[:count], q[:, :count].T).T if count else observe.T
        null = q[:, count:]
        self.capacity, turn = np.linalg.eigh(null.T @ (modes.capacity[:, None] * null))
        self.basis = null @ turn
        self.coupling = self.basis.T @ (modes.capacity[:, None] * self.lift)


def scan(capacity: FloatArray, step: float, start: FloatArray, push: FloatArray) -> FloatArray:
    """``c (ζ' - ζ) + Δt k ζ' = push`` over all steps, (r, n_time + 1)."""
    system = capacity + step * (1.0 - SHIFT * capacity)
    stay, gain = capacity / system, push.T / system
    path = np.empty((push.shape[1] + 1, start.size))
    path[0] = start
    for k in range(push.shape[1]):
        path[k + 1] = stay * path[k] + gain[k]
    return path.T


class ModalRuns:
    """Steps a reduced model in its modes.

    Parameters
    ----------
    matrices : Pencil
        Of the reduced model at one θ; with sensitivities when sensitivities are wanted.
    """

    def __init__(self, matrices: Pencil) -> None:
        # a copy, as matrices keep their runs: what refers to each other stays in memory until it is looked for
        self.matrices = replace(matrices)
        self.modes = modal_model(matrices)
        self._frames: dict[bytes, PrescribedBasis] = {}

    @cached_property
    def sensitivities(self) -> ModalSensitivities:
        """Derivatives of the matrices in the modes."""
        return ModalSensitivities(self.matrices, self.modes)

    def _frame(self, held: NDArray[np.bool_]) -> PrescribedBasis:
        """Frame of held zones; a spin-up needs it for its steady state, its steps and its derivatives."""
        key = held.tobytes()
        if key not in self._frames:
            self._frames[key] = PrescribedBasis(self.modes, held)
        return self._frames[key]

    @property
    def heated_as_observed(self) -> bool:
        """Whether a zone's heat is spread over its air as its mean is taken; `hold` needs that."""
        m = self.matrices
        scale = float(np.abs(m.observation).max())
        return bool(np.allclose(m.heating.T, m.observation, rtol=1e-9, atol=1e-12 * scale))

    def run(
        self,
        states: FloatArray,
        boundary: FloatArray,
        heat: FloatArray,
        keep: NDArray[np.int64],
        step: float,
        scheme: Scheme,
        sensitivities: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray | None]:
        """Zone means of m free runs over N steps.

        Parameters
        ----------
        states : ndarray, shape (n, m)
            States of the reduced model at the starts [K].
        boundary : ndarray, shape (N, n_boundary, m)
            Boundary temperatures [K].
        heat : ndarray, shape (N, n_zone, m)
            Heat given to the zones [W].
        keep : ndarray of int
            Steps whose means are returned, 1 to N, increasing.
        step : float
            Time step [s].
        scheme : Scheme
            Time stepping; ``EXACT`` too.
        sensitivities : ndarray, shape (n, n_parameter m), optional
            Derivatives of ``states``, parameter by parameter [K per unit of θ].

        Returns
        -------
        tuple
            Zone means (m, n_keep, n_zone) [K] and derivatives (m, n_keep, n_zone, n_parameter), or None.
        """
        modes, propagator = self.modes, self.modes.propagator(step, scheme)
        count, m = int(keep[-1]), states.shape[1]
        inputs = np.concatenate([boundary[:count], heat[:count]], axis=1).transpose(1, 0, 2).reshape(-1, count * m)
        drive = np.hstack([modes.boundary, modes.heating])
        pushed = (drive @ inputs).reshape(-1, count, m)
        path = np.empty((drive.shape[0], count + 1, m))
        path[:, 0] = modes.coordinates @ states
        forced = propagator.end_gain[:, None, None] * pushed
        for k in range(count):
            path[:, k + 1] = propagator.end[:, None] * path[:, k] + forced[:, k]
        last = keep - 1
        mean = propagator.mean[:, None, None] * path[:, last] + propagator.mean_gain[:, None, None] * pushed[:, last]
        means = np.tensordot(modes.output, mean, axes=1).transpose(2, 1, 0)
        if sensitivities is None:
            return means, None
        moved = self._run_sensitivities(path[:, :count], inputs, keep, step, scheme, sensitivities)
        return means, moved

    def _run_sensitivities(
        self,
        path: FloatArray,
        inputs: FloatArray,
        keep: NDArray[np.int64],
        step: float,
        scheme: Scheme,
        sensitivities: FloatArray,
    ) -> FloatArray:
        """Differentiate the means of `run`, (m, n_keep, n_zone, n_parameter)."""
        modes, moving, propagator = self.modes, self.sensitivities, self.modes.propagator(step, scheme)
        r, count, m = path.shape
        functions = propagator_functions(step, scheme)
        end, end_gain, mean, mean_gain = (divided_differences(f, modes.capacity) for f in functions)
        observe, drive, last = modes.output, np.hstack([modes.boundary, modes.heating]), keep - 1
        n_zone, p = observe.shape[0], len(moving)
        driven = np.concatenate([path, inputs.reshape(-1, count, m)]).transpose(1, 0, 2).copy()
        starts = (modes.coordinates @ sensitivities).reshape(r, p, m)
        seen = observe * propagator.mean
        out = np.zeros((keep.size, n_zone, p, m))
        by_path, by_input = (np.zeros((n_zone, moving.turning.size, r)) for _ in range(2))
        for rows in rows_of(r, (driven.shape[1] + p) * m, least=n_zone * p // driven.shape[1]):
            stay = propagator.end[rows]
            push = propagator.end_gain[rows, None] * moving.boundary.values[rows]
            size = stay.size * driven.shape[1]
            pushed = moving.boundary.spread(push, np.arange(r, size, driven.shape[1]), size)
            if scheme == IMPLICIT_EULER:
                turned, ahead = moving.summed_by_parts(rows, step)
                starts[rows, moving.turning] -= ahead @ path[:, 0]
                by_path += np.tensordot(seen[:, rows], ahead, axes=1)
            else:
                by_drive = moving.turned(rows, end_gain, propagator.end_gain) @ drive
                turned = np.concatenate([moving.turned(rows, end), by_drive], axis=2)
            by_path += np.tensordot(observe[:, rows], moving.turned(rows, mean), axes=1)
            by_input += np.tensordot(observe[:, rows], moving.turned(rows, mean_gain, propagator.mean_gain), axes=1)
            for position, sums in enumerate(convolution_sums(stay, driven, last)):
                moved = stay[:, None, None] ** last[position] * starts[rows]
                moved[:, moving.turning] += turned @ sums[:, : turned.shape[2]]
                moved += (pushed @ sums.reshape(-1, m)).reshape(moved.shape)
                out[position] += (seen[:, rows] @ moved.reshape(stay.size, -1)).reshape(n_zone, p, m)
        now = driven[last].transpose(1, 0, 2).reshape(-1, keep.size * m)
        push = (observe * propagator.mean_gain) @ moving.boundary.values
        direct = (moving.boundary.spread(push, np.full(n_zone, r), len(now)) @ now).reshape(n_zone, p, -1)
        direct[:, moving.turning] += by_path @ now[:r] + (by_input @ drive) @ now[r:]
        out += direct.reshape(n_zone, p, keep.size, m).transpose(2, 0, 1, 3)
        return out.transpose(3, 0, 1, 2)

    def backward(self, weights: FloatArray, step: float, scheme: Scheme) -> tuple[FloatArray, FloatArray]:
        """Differentiate weighted sums of the zone means of free runs with respect to heat and start: the adjoint.

        Parameters
        ----------
        weights : ndarray, shape (p, N, n_zone, m)
            Weights of p sums over steps, zones and m runs [-].
        step : float
            Time step [s].
        scheme : Scheme
            Time stepping; ``EXACT`` too.

        Returns
        -------
        tuple
            Derivatives with respect to the heat of every step (p, N, n_zone, m) [1/W], and to the states of the
            reduced model at the start (p, n, m) [1/K].
        """
        modes, propagator = self.modes, self.modes.propagator(step, scheme)
        p, count, n_zone, m = weights.shape
        costate = np.zeros((propagator.end.size, p * m))
        heat = np.empty((count, n_zone, p * m))
        for k in range(count - 1, -1, -1):
            seen = modes.output.T @ weights[:, k].transpose(1, 0, 2).reshape(n_zone, -1)
            heat[k] = modes.heating.T @ (propagator.end_gain[:, None] * costate + propagator.mean_gain[:, None] * seen)
            costate = propagator.end[:, None] * costate + propagator.mean[:, None] * seen
        start = modes.coordinates.T @ costate
        heats = heat.reshape(count, n_zone, p, m).transpose(2, 0, 1, 3)
        return heats, start.reshape(-1, p, m).transpose(1, 0, 2)

    def hold(
        self,
        states: FloatArray,
        boundary: FloatArray,
        zone: FloatArray,
        heat: FloatArray,
        keep: NDArray[np.int64],
        step: float,
        sensitivities: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray | None]:
        """Hold the zones over many implicit Euler steps and keep the states at some of them.

        Held zones are a constraint ``O ξ = y``; the modes of its null space decouple in turn.

        Parameters
        ----------
        states : ndarray, shape (n, 1)
            State of the reduced model at the start [K].
        boundary : ndarray, shape (n_time, n_boundary)
            Boundary temperatures of each step [K].
        zone : ndarray, shape (n_time, n_zone)
            Zone means at the end of each step [K]; a zone that is NaN throughout stays free.
        heat : ndarray, shape (n_time, n_zone)
            Metered heat of each step, for the zones that are left free [W].
        keep : ndarray of int, shape (m,)
            Steps (counted from 0) after which states are kept, increasing.
        step : float
            Time step [s].
        sensitivities : ndarray, shape (n, n_parameter), optional
            Derivatives of ``states`` [K per unit of θ].

        Returns
        -------
        tuple
            Kept states (n, m) and derivatives (n, n_parameter m) parameter by parameter, or None.
        """
        modes, count = self.modes, int(keep[-1]) + 1
        held = np.isfinite(zone[0])
        frame = self._frame(held)
        inputs = np.hstack([boundary[:count], heat[:count] * ~held]).T
        start = modes.coordinates @ states[:, 0]
        wanted = np.vstack([modes.observation[held] @ start, zone[:count, held]]).T
        push = step * ((frame.basis.T @ np.hstack([modes.boundary, modes.heating])) @ inputs)
        push -= frame.coupling @ (np.diff(wanted) - step * SHIFT * wanted[:, 1:])
        inner = scan(frame.capacity, step, frame.basis.T @ (start - frame.lift @ wanted[:, 0]), push)
        path = frame.lift @ wanted + frame.basis @ inner
        kept = modes.states @ path[:, keep + 1]
        if sensitivities is None:
            return kept, None
        begin = modes.coordinates @ sensitivities
        lifted = modes.observation[held] @ begin  # of the held means at the start, nothing from there on
        first = frame.basis.T @ (begin - frame.lift @ lifted)
        moved = self._held_sensitivities(frame, path, boundary[:count], keep + 1, step, first, frame.coupling @ lifted)
        return kept, np.tensordot(modes.states @ frame.basis, moved, axes=1).reshape(states.shape[0], -1)

    def _held_sensitivities(
        self,
        frame: PrescribedBasis,
        path: FloatArray,
        boundary: FloatArray,
        ends: NDArray[np.int64],
        step: float,
        first: FloatArray,
        kick: FloatArray,
    ) -> FloatArray:
        """Slopes of the held frame's states after some steps, (r, n_parameter, n_end), from ``first`` and one kick."""
        system = frame.capacity + step * (1.0 - SHIFT * frame.capacity)
        stay, gain = frame.capacity / system, frame.basis.T / system[:, None]
        sensitivities, change = self.sensitivities, np.diff(path) - step * SHIFT * path[:, 1:]
        left, since = (stay[:, None, None] ** n for n in (ends, ends - 1))
        out = first[:, :, None] * left + (kick / system[:, None])[:, :, None] * since
        parts = ((change.T, -1.0, sensitivities.capacity), (path[:, 1:].T, -step, sensitivities.stiffness))
        for drive, factor, stack in parts:
            if len(boundary) == 1:  # one step: what drives is turned, not every matrix
                out[:, stack.parameters] += factor * (gain @ (stack.values @ drive[0]))[:, :, None]
                continue
            turned = np.tensordot(factor * gain, stack.values, axes=1)
            for rows in rows_of(stay.size, len(path) * ends.size):
                out[rows, stack.parameters] += turned[rows] @ all_convolution_sums(stay[rows], drive, ends)
        sums = all_convolution_sums(stay, boundary, ends).reshape(-1, ends.size)
        columns = sensitivities.boundary
        places = np.arange(0, len(sums), boundary.shape[1])
        out += (columns.spread(step * (gain @ columns.values), places, len(sums)) @ sums).reshape(out.shape)
        return np.asarray(out)

    def held_response(self, held: NDArray[np.bool_], step: float) -> FloatArray:
        """States at the end of a held step per kelvin of each held zone mean, shape (n, n_held) [K/K].

        Parameters
        ----------
        held : ndarray of bool, shape (n_zone,)
            Zones that are held.
        step : float
            Time step [s].
        """
        frame = self._frame(held)
        system = frame.capacity + step * (1.0 - SHIFT * frame.capacity)
        inner = -(frame.coupling * (1.0 - step * SHIFT)) / system[:, None]
        return np.asarray(self.modes.states @ (frame.lift + frame.basis @ inner))

    def history_response(self, held: NDArray[np.bool_], step: float, elapsed: NDArray[np.int64]) -> FloatArray:
        """States after a spin-up per kelvin by which boundaries and zones were warmer before it began.

        A spin-up starts from a steady state, while walls and slabs remember days of which there is no telemetry.

        Parameters
        ----------
        held : ndarray of bool, shape (n_zone,)
            Zones that are held.
        step : float
            Time step [s].
        elapsed : ndarray of int, shape (m,)
            Steps since the spin-up began.

        Returns
        -------
        ndarray, shape (n, m, 1 + n_held)
            All boundaries together, then every held zone [K/K].
        """
        frame = self._frame(held)
        conductance = 1.0 - SHIFT * frame.capacity
        temperatures = self.modes.boundary.shape[1] - self.modes.n_signal
        outside = frame.basis.T @ self.modes.boundary[:, :temperatures].sum(axis=1)
        begin = np.column_stack([outside / conductance, frame.coupling / frame.capacity[:, None]])
        left = (frame.capacity / (frame.capacity + step * conductance))[:, None] ** elapsed
        turn = self.modes.states @ frame.basis
        return np.asarray((turn @ (left[:, :, None] * begin[:, None, :]).reshape(begin.shape[0], -1)).reshape(
            turn.shape[0], elapsed.size, -1))  # fmt: skip
