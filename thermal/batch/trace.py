"""Values that write down what is done with them: equations of one member become a program for many.

An equation that is written for one building - floats for what there is one of, arrays over zones or terminals - is
called once with traced values. They take part in NumPy's protocols for functions of arrays, so that each operation is
noted in a `Tape` instead of being carried out. `thermal.batch.program.Program` then carries the notes out on arrays
that have one axis more, the last: the members. This is what other libraries call a vectorising map; no equation is
written twice.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from thermal.batch.carried import Reduce, Take, copied, product, where
from thermal.components.operations import Value
from thermal.errors import ModelError

_LOGICAL = (np.greater, np.greater_equal, np.less, np.less_equal, np.equal, np.not_equal)
_OF_TRUTHS = (np.logical_and, np.logical_or, np.logical_not, np.bitwise_and, np.bitwise_or, np.invert)


class Slot(NamedTuple):
    """Where a traced value will lie.

    Parameters
    ----------
    number : int
        Of the slot.
    shape : tuple of int
        Of one member.
    each : bool
        Whether members differ; otherwise all have the same value.
    truth : bool
        Whether it holds truth values.
    """

    number: int
    shape: tuple[int, ...]
    each: bool
    truth: bool


class View(NamedTuple):
    """A part of a slot, by basic indices.

    Parameters
    ----------
    slot : Slot
        The whole.
    path : tuple
        Indices, one after the other.
    """

    slot: Slot
    path: tuple[Any, ...]


class Instruction(NamedTuple):
    """An operation that was noted.

    Parameters
    ----------
    function : callable
        Called with the inputs, and with the output as ``out``.
    inputs : tuple
        Views, arrays whose last axis is of members or one, or plain numbers.
    output : View
        What is written.
    partial : bool
        Whether the output keeps what is not written.
    """

    function: Callable[..., Any]
    inputs: tuple[Any, ...]
    output: View
    partial: bool


class Tape:
    """Notes of what is done with traced values.

    Attributes
    ----------
    slots : list of Slot
        All of them, by number.
    notes : list of Instruction
        In order.
    kept : set of int
        Numbers of slots that outlive a run: inputs, states and results.
    """

    def __init__(self) -> None:
        self.slots, self.notes, self.kept = list[Slot](), list[Instruction](), set[int]()
        self._known: dict[Any, Traced] = {}
        self._written: set[int] = set()
        self._alive: list[Any] = []

    def value(self, *shape: int, each: bool = True, kept: bool = True) -> Traced:
        """Make a value that is set from outside, or written part by part.

        Parameters
        ----------
        *shape : int
            Of one member.
        each : bool
            Whether members differ.
        kept : bool
            Whether it outlives a run.
        """
        made = self._slot(shape, each, False)
        self._written.add(made.view.slot.number)
        if kept:
            self.kept.add(made.view.slot.number)
        return made

    def keep(self, value: Value, *shape: int) -> Traced:
        """Keep a value beyond a run, as a result in a place of its own.

        Parameters
        ----------
        value : Value
            Traced, or the same always.
        *shape : int
            Of one member.
        """
        result = self.value(*shape)
        result[...] = value
        return result

    def call(self, function: Callable[..., Any], inputs: Sequence[Any], *shape: int) -> Traced:
        """Note a function that is no operation on elements.

        Parameters
        ----------
        function : callable
            Called with arrays of all inputs, and of its output as ``out``; a last axis is of members, or of length one.
        inputs : sequence
            Traced values.
        *shape : int
            Of the output, of one member.
        """
        output = self.value(*shape, kept=False)
        self.notes.append(Instruction(function, tuple(self.operand(v) for v in inputs), output.view, True))
        return output

    def _slot(self, shape: tuple[int, ...], each: bool, truth: bool) -> Traced:
        slot = Slot(len(self.slots), tuple(shape), each, truth)
        self.slots.append(slot)
        return Traced(self, View(slot, ()), slot.shape)

    def operand(self, value: Any) -> Any:
        """Lay out a value as instructions have it: constants with a last axis of length one.

        Parameters
        ----------
        value : Value
            Traced, array or number.
        """
        if isinstance(value, Traced):
            return value.view
        array = np.asarray(value)
        if array.ndim == 0:
            return array.item()
        return np.ascontiguousarray(array)[..., np.newaxis]

    def note(self, function: Any, inputs: Sequence[Any], shape: tuple[int, ...], truth: bool = False) -> Traced:
        """Note an operation and give its result; what has been noted before is not done again.

        Parameters
        ----------
        function : callable
            Called with the inputs, and with the output as ``out``.
        inputs : sequence
            Traced values, arrays with an axis of members, or numbers.
        shape : tuple of int
            Of the result, of one member.
        truth : bool
            Whether it holds truth values.
        """
        operands = tuple(v.view if isinstance(v, Traced) else v for v in inputs)
        fixed = not any(isinstance(v, Traced) and v.view.slot.number in self._written for v in inputs)
        key = (function, *(_key(v) for v in operands), shape)
        if fixed and key in self._known:
            return self._known[key]
        each = any(isinstance(v, Traced) and v.view.slot.each for v in inputs)
        made = self._slot(shape, each, truth)
        self.notes.append(Instruction(function, operands, made.view, False))
        if fixed:
            self._known[key] = made
            self._alive += operands  # numbers of arrays in keys stay theirs
        return made

    def write(self, target: View, value: Any) -> None:
        """Note that a value is written into a part of another.

        Parameters
        ----------
        target : View
            Where.
        value : Value
            What [as there].
        """
        self.notes.append(Instruction(copied, (self.operand(value),), target, True))


def _key(operand: Any) -> Any:
    if isinstance(operand, np.ndarray):
        return ("array", id(operand))
    return ("view", operand.slot.number, repr(operand.path)) if isinstance(operand, View) else ("number", operand)


class Traced(NDArrayOperatorsMixin):
    """A value of one member, a number or an array, that notes what is done with it.

    Parameters
    ----------
    tape : Tape
        Where it is noted.
    view : View
        Where the value will lie.
    shape : tuple of int
        Of one member.
    """

    def __init__(self, tape: Tape, view: View, shape: tuple[int, ...]) -> None:
        self.tape, self.view, self.shape = tape, view, shape

    def __len__(self) -> int:
        return self.shape[0]

    def __bool__(self) -> bool:
        advice = "write the equation with ops.step, ops.clip or np.where"
        raise ModelError("batch", "equations without branches on values", "an `if` on one", advice)

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if method == "reduce" and isinstance(inputs[0], Traced):
            return inputs[0]._reduced(ufunc, options.get("axis", 0))
        if method != "__call__" or options:
            raise ModelError("batch", "plain functions of arrays", f"numpy.{ufunc.__name__}: {method} {list(options)}")
        if ufunc is np.matmul:
            return self._product(*inputs)
        if ufunc is np.power and isinstance(inputs[1], int | float) and inputs[1] == 2:
            return inputs[0] * inputs[0]
        shape = np.broadcast_shapes(*(v.shape if isinstance(v, Traced) else np.shape(v) for v in inputs))
        operands = [v if isinstance(v, Traced) else self.tape.operand(v) for v in inputs]
        if ufunc not in _OF_TRUTHS:  # numbers of 0 and 1, in the precision of the rest
            operands = [v.number() if isinstance(v, Traced) else v for v in operands]
        of_truths = ufunc in _OF_TRUTHS and all(isinstance(v, Traced) and v.view.slot.truth for v in inputs)
        return self.tape.note(ufunc, operands, shape, ufunc in _LOGICAL or of_truths)

    def __array_function__(self, function: Any, types: Any, args: Any, options: Any) -> Any:
        if function is np.where:
            mask, first, second = args
            shape = np.broadcast_shapes(*(np.shape(v) if not isinstance(v, Traced) else v.shape for v in args))
            operands = [v if isinstance(v, Traced) else self.tape.operand(v) for v in (mask, first, second)]
            return self.tape.note(where, operands, shape)
        if function in (np.stack, np.concatenate) and not options:
            parts = [self.tape_value(v) for v in args[0]]
            return _joined(self.tape, parts, function is np.stack)
        if function is np.broadcast_arrays:
            return args
        advice = "see thermal.batch.trace"
        raise ModelError("batch", "functions that a trace knows", f"numpy.{function.__name__}", advice)

    def number(self) -> Traced:
        """Give 1 for true and 0 for false; what is a number stays as it is."""
        return self.tape.note(copied, [self], self.shape) if self.view.slot.truth else self

    def tape_value(self, value: Value) -> Value:
        """Give a value as it is, or an array of a plain one.

        Parameters
        ----------
        value : Value
            Any.
        """
        return value if isinstance(value, Traced) else np.asarray(value, dtype=float)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, np.ndarray | list):
            rows = [int(k) for k in (np.flatnonzero(index) if np.asarray(index).dtype == bool else index)]
            whole = range(rows[0], rows[0] + len(rows)) if rows else range(0)
            if rows and rows == list(whole):
                return self[whole.start : whole.stop]
            return self.tape.note(Take(tuple(rows)), [self], (len(rows), *self.shape[1:]))
        shape = np.empty(self.shape, dtype=np.int8)[index].shape
        return Traced(self.tape, View(self.view.slot, (*self.view.path, index)), shape)

    def __setitem__(self, index: Any, value: Value) -> None:
        slot = self.view.slot
        if slot.number not in self.tape._written:
            raise ModelError("batch", "a value that may be written to", "a result", "make one with Tape.value")
        if isinstance(index, np.ndarray | list):
            rows, one = np.asarray(index), not isinstance(value, Traced | np.ndarray)
            for run in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows) != 1) + 1) if len(rows) else ():
                place, part = slice(int(rows[run[0]]), int(rows[run[-1]]) + 1), slice(int(run[0]), int(run[-1]) + 1)
                self.tape.write(View(slot, (*self.view.path, place)), value if one else value[part])
            return
        self.tape.write(View(slot, (*self.view.path, index)), value)

    def sum(self, axis: int = 0) -> Traced:
        """Sum over an axis.

        Parameters
        ----------
        axis : int
            Of one member's values.
        """
        return self._reduced(np.add, axis)

    def max(self, axis: int = 0) -> Traced:
        """Largest along an axis.

        Parameters
        ----------
        axis : int
            Of one member's values.
        """
        return self._reduced(np.maximum, axis)

    def mean(self, axis: int = 0) -> Traced:
        """Mean over an axis.

        Parameters
        ----------
        axis : int
            Of one member's values.
        """
        mean: Traced = self.sum(axis) / float(self.shape[axis])
        return mean

    def _reduced(self, ufunc: Any, axis: int) -> Traced:
        axis = axis % len(self.shape)
        shape = (*self.shape[:axis], *self.shape[axis + 1 :])
        return self.tape.note(Reduce(ufunc, axis), [self], shape)

    def _product(self, first: Any, second: Any) -> Traced:
        """Product with a constant matrix or vector on either side, or of a traced matrix or vector with a vector."""
        if isinstance(first, Traced) and isinstance(second, Traced):
            if len(first.shape) == 2:
                return self.tape.note(product, [first, second], first.shape[:1])
            total: Traced = (first * second).sum()
            return total
        if isinstance(second, Traced):
            matrix, vector = np.asarray(first, dtype=float), second
        else:
            matrix, vector = np.asarray(second, dtype=float).T, first
        shape = matrix.shape[:-1]
        return self.tape.note(np.matmul, [np.ascontiguousarray(matrix), vector], shape)


def _joined(tape: Tape, parts: Sequence[Any], stacked: bool) -> Traced:
    """Values one behind the other, or one above the other."""
    shapes = [v.shape for v in parts]
    each = any(isinstance(v, Traced) and v.view.slot.each for v in parts)
    if stacked:
        target = tape.value(len(parts), *np.broadcast_shapes(*shapes), each=each, kept=False)
        for k, part in enumerate(parts):
            target[k] = part
        return target
    target, begin = tape.value(sum(s[0] for s in shapes), *shapes[0][1:], each=each, kept=False), 0
    for part, shape in zip(parts, shapes, strict=True):
        target[begin : begin + shape[0]] = part
        begin += shape[0]
    return target
