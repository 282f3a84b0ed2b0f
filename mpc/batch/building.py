"""Reduced buildings of many members, stepped in their modes: shared by all, or each with its own."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mpc.loop.reduced import ReducedBuilding
from thermal._types import FloatArray, IntArray
from thermal.batch.trace import Tape, Traced

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
    Of one building all members are columns of the products, noted on a tape as the rest of a step is. Where members
    have different ones each has modes of its own: a stack of matrices, each times a vector, so that a step reads them
    all from memory (measured by ``benchmarks/environment_speed.py``).
    """

    def __init__(self, models: Sequence[ReducedBuilding], members: int, dtype: Any) -> None:
        self._all, self.shared = Modes.of(models), len(models) == 1
        #: Number of modes.
        self.order = self._all.end.shape[1]
        if not self.shared:
            own = (np.repeat(values[:1], members, axis=0) for values in self._all)
            self._own = Modes(*(np.ascontiguousarray(values, dtype=dtype) for values in own))
            self._state, self._free = (np.zeros((members, self.order), dtype) for _ in range(2))

    def start(self, members: IntArray, model: int, state: FloatArray, modes: Array) -> None:
        """Set members to a state of a building.

        Parameters
        ----------
        members : ndarray of int, shape (n,)
            Which.
        model : int
            Which building they have.
        state : ndarray, shape (r,)
            Its modes [-].
        modes : ndarray, shape (order, member) or (0, member)
            The modes of all that were traced; filled where members share one building [-].
        """
        row = np.pad(state, (0, self.order - state.size))
        if self.shared:
            modes[:, members] = row[:, None]
            return
        self._state[members] = row
        for own, every in zip(self._own, self._all, strict=True):
            own[members] = every[model]

    def traced(self, tape: Tape, modes: Traced, gains: Traced, outside: Traced) -> tuple[Traced, Callable[..., Traced]]:
        """Note a step: readings at its end without the plant's heat, and what takes the step with that heat.

        Parameters
        ----------
        tape : Tape
            Where it is noted.
        modes : Traced, shape (order,) or (0,)
            At the start, where members share one building [-]; written to.
        gains : Traced, shape (n_zone,)
            Heat of people, light and equipment [W].
        outside : Traced, shape (n_outside,)
            Boundaries counted from the reference temperature [K], then signals.

        Returns
        -------
        free : Traced, shape (n_zone,)
            Counted from the reference temperature [K].
        finish : callable
            Takes the plant's heat into the zones [W]; gives the readings, counted from the reference temperature [K].
        """
        if not self.shared:
            free = tape.call(self._begin, [gains, outside], len(gains))
            return free, lambda heat: tape.call(self._finish, [heat, gains, free], len(gains))
        one = Modes(*(values[0] for values in self._all))
        left, led = one.output * one.end, one.output @ one.driving
        free = left @ modes + (led @ outside + one.response @ gains)

        def finish(heat: Traced) -> Traced:
            given = np.concatenate([heat + gains, outside])  # one product for all that moves the modes
            modes[...] = modes * one.end + np.hstack([one.heating, one.driving]) @ given
            reached: Traced = one.response @ heat + free
            return reached

        return free, finish

    def _begin(self, gains: Array, outside: Array, out: Array) -> None:
        """Begin a step of members with buildings of their own; see `traced`."""
        own, kept = self._own, self._free
        np.multiply(self._state, own.end, out=kept)
        kept += _each(own.driving, outside, len(kept))
        np.add(_each(own.output, kept.T, len(kept)).T, _each(own.response, gains, len(kept)).T, out=out)

    def _finish(self, heat: Array, gains: Array, free: Array, out: Array) -> None:
        """Take the step that was begun."""
        own, state = self._own, self._state
        np.add(self._free, _each(own.heating, heat + gains, len(state)), out=state)
        np.add(_each(own.response, heat, len(state)).T, free, out=out)


def _each(matrices: Array, columns: Array, members: int) -> Array:
    """Multiply each member's column by its own matrix, shape (member, n)."""
    rows = np.ascontiguousarray(np.broadcast_to(columns, (columns.shape[0], members)).T)
    product: Array = np.matmul(matrices, rows[:, :, None])[:, :, 0]
    return product
