"""What was traced, as a function of JAX (extra ``[jax]``): compiled by XLA, on a GPU where there is one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from thermal.batch.carried import Reduce, Take, copied, product, where
from thermal.batch.program import needed
from thermal.batch.trace import Tape, Traced, View
from thermal.errors import MissingExtraError, ModelError

try:
    import jax
    import jax.numpy as jnp

    HAS_JAX = True
except ImportError:
    HAS_JAX = False


class FunctionalProgram:
    """The notes of a tape as a pure function of arrays ``(..., member)``.

    `thermal.batch.program.Program` carries the same notes out in memory of its own. Here nothing is written to, so that
    `jax.jit` compiles them and `jax.lax.scan` repeats them within whatever a user computes.

    Parameters
    ----------
    tape : Tape
        What is to be done: operations on elements, sums, products and choices of rows.
    inputs, outputs : sequence of Traced
        Kept values, whole: what the function takes and what it gives, in order. A value may be both.
    dtype : type
        ``numpy.float32``, or ``numpy.float64`` where JAX keeps it (``jax_enable_x64``).

    Raises
    ------
    MissingExtraError
        Without JAX.
    ModelError
        When the tape has a call that is no operation of NumPy.
    """

    def __init__(
        self, tape: Tape, inputs: Sequence[Traced], outputs: Sequence[Traced], dtype: Any = np.float32
    ) -> None:
        if not HAS_JAX:
            raise MissingExtraError('functions need jax, which the extra brings: pip install "buildingmpc[jax]"')
        self._slots, self._dtype = tape.slots, np.dtype(dtype)
        self._inputs, self._outputs = ([v.view.slot.number for v in values] for values in (inputs, outputs))
        self._steps = [(_function(note.function), note) for note in needed(tape)]

    def __call__(self, *given: Any) -> list[Any]:
        """Carry out everything once.

        Parameters
        ----------
        *given : array, shape (..., member)
            Values of the inputs; members share what has a last axis of length one.

        Returns
        -------
        list of array
            Values of the outputs.
        """
        values = {k: jnp.asarray(v, self._dtype) for k, v in zip(self._inputs, given, strict=True)}
        for function, note in self._steps:
            found = function(*(self._operand(v, values) for v in note.inputs))
            slot, path = note.output.slot, note.output.path
            if note.partial:
                found = _put(self._whole(slot.number, values, found), path, found)
            values[slot.number] = found if slot.truth else found.astype(self._dtype)
        return [values[k] for k in self._outputs]

    def _operand(self, operand: Any, values: dict[int, Any]) -> Any:
        if isinstance(operand, View):
            found = values[operand.slot.number]
            for index in operand.path:
                found = found[index]
            return found
        return jnp.asarray(operand, self._dtype) if isinstance(operand, np.ndarray) else operand

    def _whole(self, number: int, values: dict[int, Any], part: Any) -> Any:
        """Give what is written part by part, with room for as many members as the part has."""
        shape, members = self._slots[number].shape, jnp.shape(part)[-1] if jnp.ndim(part) else 1
        if number not in values:
            return jnp.zeros((*shape, members), self._dtype)
        known = values[number]
        return jnp.broadcast_to(known, (*shape, max(known.shape[-1], members)))


def _put(whole: Any, path: tuple[Any, ...], part: Any) -> Any:
    """Give a copy of the whole with one part, which lies behind indices one after the other, in its place."""
    if not path:
        return jnp.broadcast_to(part, whole.shape)
    index, *deeper = path
    return whole.at[index].set(_put(whole[index], tuple(deeper), part))


def _function(noted: Any) -> Callable[..., Any]:
    """Give JAX's function of the same meaning."""
    if noted is copied:
        return jnp.asarray
    if noted is where:
        return lambda mask, first, second: jnp.where(mask != 0, first, second)
    if isinstance(noted, Take):
        rows = np.array(noted.rows, dtype=np.int32)
        return lambda values: values[rows]
    if noted is np.matmul:  # a GPU's products are of few digits unless it is told otherwise
        return lambda first, second: jnp.matmul(first, second, precision=jax.lax.Precision.HIGHEST)
    if noted is product:
        return lambda matrix, vector: (matrix * vector).sum(axis=1)
    if isinstance(noted, Reduce) and noted.function in (np.add, np.maximum):
        return lambda values: (jnp.sum if noted.function is np.add else jnp.max)(values, axis=noted.axis)
    places = (jnp, jax.scipy.special) if isinstance(noted, np.ufunc) else ()
    found = next((getattr(place, noted.__name__) for place in places if hasattr(place, noted.__name__)), None)
    if found is None:
        name = getattr(noted, "__qualname__", repr(noted))
        raise ModelError("batch", "operations of NumPy on elements, sums and products", name)
    return found  # type: ignore[no-any-return]
