"""Runs of plain arithmetic of a program of one member, on CasADi's virtual machine.

A call of NumPy takes a microsecond however short its arrays are, so that one member alone costs as much as hundreds.
Here the same instructions are unrolled to operations on numbers, of which the virtual machine does a hundred in that
time. It is made in a fraction of a second, without a compiler.
"""

import operator
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from thermal._types import IntArray
from thermal.batch.carried import Reduce, Take, copied, where
from thermal.batch.compiled import Placed, work_place
from thermal.batch.trace import Instruction

_OPERATIONS: dict[Any, Callable[..., Any]] = {
    np.add: operator.add, np.subtract: operator.sub, np.multiply: operator.mul, np.divide: operator.truediv,
    np.negative: operator.neg, np.absolute: ca.fabs, np.sqrt: ca.sqrt, np.exp: ca.exp, np.log: ca.log,
    np.expm1: ca.expm1, np.log1p: ca.log1p, np.arctan: ca.atan, np.tanh: ca.tanh,
    np.floor: ca.floor, np.power: ca.power, np.maximum: ca.fmax, np.minimum: ca.fmin,
    np.rint: lambda x: x - ca.remainder(x, 1.0),  # exact, halves to the even one as NumPy has it
    np.greater: operator.gt, np.greater_equal: operator.ge, np.less: operator.lt, np.less_equal: operator.le,
    np.equal: operator.eq, np.not_equal: operator.ne, np.bitwise_and: ca.logic_and, np.logical_and: ca.logic_and,
    np.bitwise_or: ca.logic_or, np.logical_or: ca.logic_or, np.invert: ca.logic_not, np.logical_not: ca.logic_not,
    copied: lambda x: x, where: ca.if_else,
}  # fmt: skip

#: Entries of a matrix whose product is unrolled; a larger one is faster by NumPy.
_LARGEST_PRODUCT = 1000


def interprets(note: Instruction) -> bool:
    """Tell whether an instruction is arithmetic that can be unrolled.

    Parameters
    ----------
    note : Instruction
        Any.
    """
    function = note.function
    if function is np.matmul:
        return bool(note.inputs[0].size <= _LARGEST_PRODUCT)
    known = function in _OPERATIONS or isinstance(function, Take)
    return known or (isinstance(function, Reduce) and function.function in _OPERATIONS)


def machine_runs(
    work: NDArray[Any], constant: NDArray[np.bool_], wanted: NDArray[np.bool_], runs: Sequence[Sequence[Placed]]
) -> list[Callable[[], Any]]:
    """Make runs of instructions that read and write the memory of a program.

    Parameters
    ----------
    work : ndarray, shape (n,)
        Memory that all arrays lie in, in double precision.
    constant, wanted : ndarray of bool, shape (n,)
        Which of its numbers never change, and which are looked at by others than these runs.
    runs : sequence of sequence of tuple
        Instructions that follow each other.
    """
    made = [_Unrolled(work, constant, run) for run in runs]
    looked_at = wanted.copy()
    for one in made:
        looked_at[list(one.read)] = True
    return [one.function(looked_at) for one in made]


class _Unrolled:
    """Instructions as operations on numbers, by place in memory."""

    def __init__(self, work: NDArray[Any], constant: NDArray[np.bool_], run: Sequence[Placed]) -> None:
        self._work, self._constant, self._memory = work, constant, ca.SX.sym("w", work.size)
        self.read: dict[int, Any] = {}
        self._written: dict[int, Any] = {}
        for step in run:
            self._carry_out(step.function, step.inputs, step.output)

    def function(self, looked_at: NDArray[np.bool_]) -> Callable[[], Any]:
        """Make the function that writes what is looked at.

        Parameters
        ----------
        looked_at : ndarray of bool, shape (n,)
            Places in memory.
        """
        places = np.array([k for k in sorted(self._written) if looked_at[k]], dtype=np.intp)
        results, work = np.zeros(len(places)), self._work
        whole = ca.Function("run", [self._memory], [ca.vertcat(*(self._written[k] for k in places.tolist()))])
        made: Any = whole.buffer()
        buffer, trigger = made
        buffer.set_arg(0, memoryview(work))  # type: ignore[arg-type]
        buffer.set_res(0, memoryview(results))  # type: ignore[arg-type]

        def run(_: Any = (whole, buffer)) -> None:
            trigger()
            work[places] = results  # not before all has been read

        return run

    def _carry_out(self, function: Any, inputs: tuple[Any, ...], output: NDArray[Any]) -> None:
        at = places_of(self._work, output)
        if function is np.matmul:
            vector = self._values(inputs[1])[..., 0].tolist()
            found = [_product(row, vector) for row in np.atleast_2d(inputs[0]).tolist()]
        elif isinstance(function, Take):
            found = list(self._values(inputs[0])[list(function.rows)].ravel())
        elif isinstance(function, Reduce):
            values = np.moveaxis(self._values(inputs[0]), function.axis, 0)
            found = list(values[0].ravel())
            for part in values[1:]:
                found = [_OPERATIONS[function.function](a, b) for a, b in zip(found, part.ravel(), strict=True)]
        else:
            operands = [np.broadcast_to(self._values(v), output.shape).ravel() for v in inputs]
            found = [_OPERATIONS[function](*each) for each in zip(*operands, strict=True)]
        self._written.update(zip(at.ravel().tolist(), found, strict=True))

    def _values(self, operand: Any) -> NDArray[Any]:
        """Give the numbers of an operand: constants, what was written, or what the memory held before."""
        if not isinstance(operand, np.ndarray):
            return _objects([ca.SX(float(operand))], (1,))
        places = places_of(self._work, operand)
        return _objects([self._value(k) for k in places.ravel().tolist()], places.shape)

    def _value(self, place: int) -> Any:
        if place in self._written:
            return self._written[place]
        if self._constant[place]:
            return ca.SX(float(self._work[place]))
        if place not in self.read:
            self.read[place] = self._memory[place]
        return self.read[place]


def _product(row: Sequence[float], vector: Sequence[Any]) -> Any:
    """Sum of products, without those with nought."""
    return sum((factor * value for factor, value in zip(row, vector, strict=True) if factor != 0.0), ca.SX(0.0))


def _objects(values: Sequence[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    found = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        found[k] = value
    return found.reshape(shape)


def places_of(work: NDArray[Any], array: NDArray[Any]) -> IntArray:
    """Give where the elements of an array lie in memory.

    Parameters
    ----------
    work, array : ndarray
        The memory, and a part of it.
    """
    begin, strides = work_place(work, array)
    found = np.full(array.shape, begin, dtype=np.intp)
    for axis, (length, stride) in enumerate(zip(array.shape, strides, strict=True)):
        found += (np.arange(length) * stride).reshape([-1 if k == axis else 1 for k in range(array.ndim)])
    return found
