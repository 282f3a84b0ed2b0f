"""What was traced, carried out on all members at once in memory that is laid out before."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import partial
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal.batch.compiled import Placed, compile_loops, compiles
from thermal.batch.loops import Loop, in_loops, kept_within, taken_apart
from thermal.batch.machine import interprets, machine_runs, places_of
from thermal.batch.trace import Instruction, Slot, Tape, Traced, View
from thermal.errors import ModelError

_LINE = 64  # bytes of a cache line, which arrays begin at


class Program:
    """Runs the notes of a tape on arrays ``(..., member)``, each instruction for all members.

    Parameters
    ----------
    tape : Tape
        What is to be done.
    members : int
        How many there are.
    dtype : type
        ``numpy.float64``, or ``numpy.float32``, which is twice as fast.
    compiled : bool
        Whether numba compiles runs of plain arithmetic (extra ``[fast]``), which takes some seconds; otherwise each
        instruction is a call of NumPy, or, of one member in double precision, done by CasADi's virtual machine.

    Notes
    -----
    A value that nobody needs any more gives its place to a later one of the same shape, so that a run stays in the
    processor's cache; an instruction on elements may write where one of its inputs lies.
    """

    def __init__(self, tape: Tape, members: int, dtype: Any = np.float64, compiled: bool = False) -> None:
        ModelError.unless(members >= 1, "batch", "1 member or more", repr(members))
        self.members, self.dtype = members, np.dtype(dtype)
        alone = members == 1 and self.dtype == np.float64 and not compiled
        self._numbers, within = compiled or alone, set[int]()
        notes = needed(tape)
        if compiled:
            fits = partial(compiles, dtype=self.dtype)
            notes = taken_apart(notes, members, fits)
            loops = in_loops(notes, members, fits)
            within = kept_within(loops, tape.kept)
        else:
            loops = _runs(notes, interprets if alone else lambda note: False)
        self._work, self._end = self._memory(tape, notes), 0
        self._kept = sorted(tape.kept)
        self._arrays: dict[int, NDArray[Any]] = {k: self._array(tape.slots[k]) for k in self._kept}
        self._constants: dict[Any, NDArray[Any]] = {}
        placed = self._laid_out(tape, loops, within)
        self._count, self._code = len(notes), list[Callable[[], Any]]()
        parts = [(loop.axes is not None, steps) for loop, steps in zip(loops, placed, strict=True)]
        unrolled = iter(self._unrolled(parts) if alone else ())
        for plain, group in groupby(parts, key=lambda part: part[0]):
            steps = [steps for _, steps in group]
            if plain:
                self._code += [next(unrolled) for _ in steps] if alone else compile_loops(self._work, steps)
            else:
                self._code += [partial(s.function, *s.inputs, out=s.output) for call in steps for s in call]

    def __len__(self) -> int:
        return self._count

    def of(self, value: Traced) -> NDArray[Any]:
        """Give the array of a kept value, to read or to set.

        Parameters
        ----------
        value : Traced
            Of the tape, kept.
        """
        return self._arrays[value.view.slot.number]

    def run(self) -> None:
        """Carry out everything once."""
        for instruction in self._code:
            instruction()

    def _unrolled(self, parts: Sequence[tuple[bool, Sequence[Placed]]]) -> list[Callable[[], Any]]:
        """Hand runs of arithmetic to the virtual machine, with what others look at: what is kept, and other calls."""
        masks = np.zeros((2, self._end), dtype=bool)
        calls = [v for plain, steps in parts if not plain for step in steps for v in step.inputs]
        looked_at = [*(self._arrays[k] for k in self._kept), *(v for v in calls if isinstance(v, np.ndarray))]
        for mask, arrays in zip(masks, (self._constants.values(), looked_at), strict=True):
            for array in arrays:
                mask[places_of(self._work, array)] = True
        constant, wanted = masks
        return machine_runs(self._work[: self._end], constant, wanted, [steps for plain, steps in parts if plain])

    def _laid_out(self, tape: Tape, loops: Sequence[Loop], within: set[int]) -> list[list[Placed]]:
        """Give each value a place for as long as it is needed; one that is needed within a loop alone has its own."""
        last = {v.slot.number: n for n, loop in enumerate(loops) for note in loop.notes for v in _views(note)}
        free: dict[Any, list[NDArray[Any]]] = defaultdict(list)
        placed = []
        for n, loop in enumerate(loops):
            slots = {v.slot.number: v.slot for note in loop.notes for v in _views(note)}
            ended = [s for k, s in slots.items() if last[k] == n and k not in tape.kept and k not in within]
            steps = []
            for note in loop.notes:
                own, function = note.output.slot, note.function
                operands = tuple(self._operand(v) for v in note.inputs)
                if len(loop.notes) == 1 and isinstance(function, np.ufunc) and function is not np.matmul:
                    for slot in [s for s in ended if s.number != own.number]:  # may be written in place
                        free[_form(slot)].append(self._arrays[slot.number])
                        ended.remove(slot)
                if own.number not in self._arrays:
                    self._arrays[own.number] = self._array(own) if own.number in within else self._place(own, free)
                steps.append(Placed(function, operands, self._operand(note.output), own.number not in within))
            for slot in ended:
                free[_form(slot)].append(self._arrays[slot.number])
            placed.append(steps)
        return placed

    def _place(self, slot: Slot, free: dict[Any, list[NDArray[Any]]]) -> NDArray[Any]:
        spare = free[_form(slot)]
        return spare.pop() if spare else self._array(slot)

    def _memory(self, tape: Tape, notes: Sequence[Instruction]) -> NDArray[Any]:
        """Memory for all values, were none to take another's place; what is not used costs nothing."""
        numbers = {v.slot.number for note in notes for v in _views(note)} | tape.kept
        values = sum(self._room(self._shape(tape.slots[k])) for k in numbers)
        arrays = (v for note in notes for v in note.inputs if isinstance(v, np.ndarray))
        return np.zeros(values + sum(self._room(v.shape) for v in arrays) + _LINE, dtype=self.dtype)

    def _shape(self, slot: Slot) -> tuple[int, ...]:
        return (*slot.shape, self.members if slot.each else 1)

    def _room(self, shape: tuple[int, ...]) -> int:
        line = _LINE // self.dtype.itemsize
        return int(-(-int(np.prod(shape)) // line) * line)

    def _array(self, slot: Slot) -> NDArray[Any]:
        if slot.truth and not self._numbers:
            return np.zeros(self._shape(slot), dtype=bool)
        return self._take(self._shape(slot))

    def _take(self, shape: tuple[int, ...]) -> NDArray[Any]:
        begin, self._end = self._end, self._end + self._room(shape)
        return self._work[begin : begin + int(np.prod(shape))].reshape(shape)

    def _operand(self, operand: Any) -> Any:
        if isinstance(operand, View):
            array = self._arrays[operand.slot.number]
            for index in operand.path:
                array = array[index]
            return array
        if not isinstance(operand, np.ndarray):
            return operand
        key = id(operand)
        if key not in self._constants:
            self._constants[key] = self._take(operand.shape)
            self._constants[key][...] = operand
        return self._constants[key]


def _form(slot: Slot) -> tuple[Any, ...]:
    return slot.shape, slot.each, slot.truth


def _views(note: Instruction) -> list[View]:
    return [*(v for v in note.inputs if isinstance(v, View)), note.output]


def needed(tape: Tape) -> list[Instruction]:
    """Instructions that something kept follows from."""
    wanted, found = set(tape.kept), list[Instruction]()
    for note in reversed(tape.notes):
        if note.output.slot.number in wanted:
            wanted |= {v.slot.number for v in note.inputs if isinstance(v, View)}
            found.append(note)
    return found[::-1]


def _runs(notes: Sequence[Instruction], fits: Callable[[Instruction], bool]) -> list[Loop]:
    """Order instructions so that those that fit come in few long runs; none passes what it depends on."""
    left, runs, plain = list(notes), list[Loop](), True
    while left:
        waiting, taken, read, written = list[Instruction](), list[Instruction](), set[int](), set[int]()
        for note in left:
            takes = {v.slot.number for v in note.inputs if isinstance(v, View)}
            gives = note.output.slot.number
            free = not (takes & written) and gives not in written and gives not in read
            if free and fits(note) == plain:
                taken.append(note)
            else:
                waiting.append(note)
                read |= takes
                written.add(gives)
        if plain and taken:
            runs.append(Loop(((), 1), taken))
        runs += [] if plain else [Loop(None, [note]) for note in taken]
        left, plain = waiting, not plain
    return runs
