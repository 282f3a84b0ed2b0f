"""Reduced buildings of many members, stepped in their modes: shared by all, or each with its own."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mpc.loop.reduced import ReducedBuilding
from thermal._types import FloatArray, IntArray

Array = NDArray[Any]


class Modes(NamedTuple):
    """What a step of modes takes, those of `ReducedBuilding`; with a first axis of buildings.

    Parameters
    ----------
    end : ndarray, shape (n, r)
        Share of each mode that is left after a step [-].
    driving : ndarray, shape (n, r, n_outside)
        Of boundaries, counted from the reference temperature, and signals.
    heating : ndarray, shape (n, r, n_zone)
        Of heat.
    output : ndarray, shape (n, n_zone, r)
        Readings of the zones' sensors.
    response : ndarray, shape (n, n_zone, n_zone)
        Readings at the end of a step to heat over it [K/W].
    """

    end: Array
    driving: Array
    heating: Array
    output: Array
    response: Array

    @classmethod
    def of(cls, models: Sequence[ReducedBuilding]) -> "Modes":
        """Stack the modes of buildings; one of fewer modes gets some that stay at zero.

        Parameters
        ----------
        models : sequence of ReducedBuilding
            Of the same zones, boundaries and signals.
        """
        most = max(m.order for m in models)

        def padded(values: FloatArray, axis: int) -> FloatArray:
            widths = [(0, most - values.shape[k] if k == axis else 0) for k in range(values.ndim)]
            return np.pad(values, widths)

        parts = [m.step_matrices() for m in models]
        end, driving, heating, output = (
            np.stack([padded(p[k], axis) for p in parts]) for k, axis in enumerate((0, 0, 0, 1))
        )
        return cls(end, driving, heating, output, np.stack([p[4] for p in parts]))


class BatchedBuilding:
    """Buildings of many members as `ReducedBuilding` steps them, two matrix products a step.

    Parameters
    ----------
    models : sequence of ReducedBuilding
        Different ones; members may have the same.
    members : int
        How many.
    dtype : numpy.dtype
        Precision.

    Notes
    -----
    Of one building all members are columns of the products. Where members have different ones each has modes of its
    own: a stack of matrices, each times a vector, so that a step reads them all from memory (measured by
    ``benchmarks/environment_speed.py``).
    """

    def __init__(self, models: Sequence[ReducedBuilding], members: int, dtype: Any) -> None:
        self._all, self.shared, self._dtype = Modes.of(models), len(models) == 1, np.dtype(dtype)
        order = self._all.end.shape[1]
        #: States, shape (r, member), or (member, r) where each has modes of its own.
        self.state = np.zeros((order, members) if self.shared else (members, order), self._dtype)
        own = Modes(*(values[0] if self.shared else np.repeat(values[:1], members, axis=0) for values in self._all))
        self._own = Modes(*(np.ascontiguousarray(values, dtype=self._dtype) for values in own))
        self._moved = np.zeros_like(self.state)
        if self.shared:  # readings at a step's end, and changes of modes over it, in one product each
            one = Modes(*(values[0] for values in self._all))
            parts = one.output * one.end, one.output @ one.driving, np.hstack([one.heating, one.driving])
            self._left, self._led, self._moving = (np.ascontiguousarray(part, self._dtype) for part in parts)
            self._given = np.zeros((self._moving.shape[1], members), self._dtype)
        else:
            self._free = np.zeros_like(self.state)

    def start(self, members: IntArray, models: IntArray, states: Sequence[FloatArray]) -> None:
        """Set members to the states of their buildings.

        Parameters
        ----------
        members, models : ndarray of int, shape (n,)
            Which members, and which building each has.
        states : sequence of ndarray, shape (r,)
            One a building [-].
        """
        for member, model in zip(members.tolist(), models.tolist(), strict=True):
            row = np.zeros(self._all.end.shape[1])
            row[: states[model].size] = states[model]
            if self.shared:
                self.state[:, member] = row
                continue
            self.state[member] = row
            for own, every in zip(self._own, self._all, strict=True):
                own[member] = every[model]

    def begin(self, gains: Array, outside: Array, out: Array) -> None:
        """Begin a step: readings at its end without the plant's heat, counted from the reference temperature.

        Parameters
        ----------
        gains : ndarray, shape (n_zone, member or 1)
            Heat of people, light and equipment [W].
        outside : ndarray, shape (n_outside, member or 1)
            Boundaries counted from the reference temperature [K], then signals.
        out : ndarray, shape (n_zone, member)
            Filled [K].
        """
        own = self._own
        if self.shared:
            np.matmul(self._left, self.state, out=out)
            np.add(out, self._led @ outside + own.response @ gains, out=out)
            return
        kept = self._free
        np.multiply(self.state, own.end, out=kept)
        kept += _each(own.driving, outside, len(kept))
        np.add(_each(own.output, kept.T, len(kept)).T, _each(own.response, gains, len(kept)).T, out=out)

    def finish(self, heat: Array, gains: Array, outside: Array, free: Array, out: Array) -> None:
        """Take the step that was begun.

        Parameters
        ----------
        heat : ndarray, shape (n_zone, member)
            Of the plant [W].
        gains, outside, free : ndarray
            As `begin` had and gave them [W], [K].
        out : ndarray, shape (n_zone, member)
            Readings at the end of the step, counted from the reference temperature; filled [K].
        """
        own = self._own
        if self.shared:
            given, count = self._given, len(heat)
            np.add(heat, gains, out=given[:count])
            np.copyto(given[count:], outside)
            np.matmul(self._moving, given, out=self._moved)
            np.multiply(self.state, own.end[:, None], out=self.state)
            np.add(self.state, self._moved, out=self.state)
            np.matmul(own.response, heat, out=out)
        else:
            np.add(self._free, _each(own.heating, heat + gains, len(self.state)), out=self.state)
            out[...] = _each(own.response, heat, len(self.state)).T
        np.add(out, free, out=out)


def _each(matrices: Array, columns: Array, members: int) -> Array:
    """Multiply each member's column by its own matrix, shape (member, n)."""
    rows = np.ascontiguousarray(np.broadcast_to(columns, (columns.shape[0], members)).T)
    product: Array = np.matmul(matrices, rows[:, :, None])[:, :, 0]
    return product
