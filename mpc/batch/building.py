"""Reduced buildings of many members, stepped in their modes: one shared by all, or one for each."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mpc.batch.alike import driven_by
from mpc.loop.reduced import ReducedBuilding
from thermal._types import FloatArray, IntArray
from thermal.batch.trace import Tape, Traced

Array = NDArray[Any]


class StepMatrices(NamedTuple):
    """What a step of `ReducedBuilding` takes: arrays of one building, or traced values of each member's.

    Parameters
    ----------
    left : Any, shape (n_zone, r)
        Readings of the zones' sensors at the end of a step to modes at its start [-].
    led : Any, shape (n_zone, n_outside)
        To boundaries, counted from the reference temperature, and signals.
    response : Any, shape (n_zone, n_zone)
        To heat over the step [K/W].
    end : Any, shape (r,)
        Share of each mode that is left after a step [-].
    moving : Any, shape (r, n_zone + n_outside)
        Modes to heat over it, and to boundaries and signals.
    """

    left: Any
    led: Any
    response: Any
    end: Any
    moving: Any

    @classmethod
    def of(cls, model: ReducedBuilding, order: int, outside: Sequence[str]) -> "StepMatrices":
        """Take those of a building; one of fewer modes gets some that stay at zero.

        Parameters
        ----------
        model : ReducedBuilding
            The building.
        order : int
            Number of modes.
        outside : sequence of str
            Of `driven_by`: what drives this building or another one; what is another's has no effect here.
        """
        end, own, heating, output, _ = model.step_matrices()
        # natural convection, of which nothing is known in advance but by how much heat there is
        heating = heating + own[:, own.shape[1] - len(model.network.signals) :] @ model.network.convective
        more, driving = order - end.size, np.zeros((end.size, len(outside)))
        driving[:, [outside.index(name) for name in driven_by(model)]] = own
        moving = np.pad(np.hstack([heating, driving]), ((0, more), (0, 0)))
        left = np.pad(output * end, ((0, 0), (0, more)))
        return cls(left, output @ driving, output @ heating, np.pad(end, (0, more)), moving)


class BatchedBuilding:
    """Buildings of many members as `ReducedBuilding` steps them, noted on a tape as the rest of a step is.

    Parameters
    ----------
    models : sequence of ReducedBuilding
        Different ones, of the same zones; members may have the same. Their effects may differ.

    Notes
    -----
    Of one building all members are columns of its products. Where there are several, each member has its matrices for
    itself, which a step reads from memory (measured by ``benchmarks/environment_speed.py``).
    """

    def __init__(self, models: Sequence[ReducedBuilding]) -> None:
        #: Number of modes.
        self.order = max(model.order for model in models)
        #: What drives them from outside, as `driven_by` names it.
        self.outside = driven_by(*models)
        self._all = [StepMatrices.of(model, self.order, self.outside) for model in models]

    @property
    def shared(self) -> bool:
        """Whether all members have the same."""
        return len(self._all) == 1

    def matrices(self, tape: Tape) -> tuple[Traced, ...]:
        """Make the values that hold each member's own matrices; none where they share them.

        Parameters
        ----------
        tape : Tape
            Where a step is noted.
        """
        return () if self.shared else tuple(tape.value(*part.shape) for part in self._all[0])

    def start(self, members: IntArray, model: int, state: FloatArray, modes: Array, matrices: Sequence[Array]) -> None:
        """Set members to a state of a building.

        Parameters
        ----------
        members : ndarray of int, shape (n,)
            Which.
        model : int
            Which building they have.
        state : ndarray, shape (order of the building,)
            Its modes [-].
        modes : ndarray, shape (order, member)
            Of all members; filled [-].
        matrices : sequence of ndarray
            Those that `matrices` has made; filled.
        """
        modes[:, members] = np.pad(state, (0, self.order - state.size))[:, None]
        for mine, part in zip(matrices, self._all[model] if matrices else (), strict=True):
            mine[..., members] = part[..., None]

    def traced(
        self, matrices: Sequence[Traced], modes: Traced, gains: Traced, outside: Traced
    ) -> tuple[Traced, Callable[[Any], Traced]]:
        """Note a step: readings at its end without the plant's heat, and what takes the step with that heat.

        Parameters
        ----------
        matrices : sequence of Traced
            As `matrices` has made them.
        modes : Traced, shape (order,)
            At the start [-]; written to.
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
        one = StepMatrices(*matrices) if matrices else self._all[0]
        free: Traced = one.left @ modes + (one.led @ outside + one.response @ gains)

        def finish(heat: Any) -> Traced:
            modes[...] = modes * one.end + one.moving @ np.concatenate([heat + gains, outside])
            reached: Traced = one.response @ heat + free
            return reached

        return free, finish
