"""What was traced, carried out on all members at once in memory that is laid out before."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal.batch.trace import Instruction, Slot, Tape, Traced, View
from thermal.errors import ModelError


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

    Notes
    -----
    A value that nobody needs any more gives its place to a later one of the same shape, so that a run stays in the
    processor's cache; an instruction on elements may write where one of its inputs lies.
    """

    def __init__(self, tape: Tape, members: int, dtype: Any = np.float64) -> None:
        ModelError.unless(members >= 1, "batch", "1 member or more", repr(members))
        self.members, self.dtype = members, np.dtype(dtype)
        notes = _needed(tape)
        self._arrays: dict[int, NDArray[Any]] = {k: self._array(tape.slots[k]) for k in tape.kept}
        last = {v.slot.number: n for n, note in enumerate(notes) for v in _views(note)}
        free: dict[Any, list[NDArray[Any]]] = defaultdict(list)
        self._code: list[tuple[Any, tuple[Any, ...]]] = []
        for n, note in enumerate(notes):
            ending = {v.slot.number: v.slot for v in _views(note) if last[v.slot.number] == n}
            elementwise = isinstance(note.function, np.ufunc) and note.function is not np.matmul
            inputs = {v.slot.number for v in note.inputs if isinstance(v, View)}
            released = [s for k, s in ending.items() if k in inputs and k not in tape.kept and k != note.output.slot.number]
            for view in (v for v in note.inputs if isinstance(v, View) and v.slot.number not in self._arrays):
                self._arrays[view.slot.number] = self._array(view.slot)  # further outputs of a call
            arrays = [self._operand(v) for v in note.inputs]
            if elementwise:
                for slot in released:
                    free[_form(slot)].append(self._arrays[slot.number])
            slot = note.output.slot
            if slot.number not in self._arrays:
                spare = free[_form(slot)]
                self._arrays[slot.number] = spare.pop() if spare else self._array(slot)
            self._code.append((note.function, (*arrays, self._operand(note.output))))
            if not elementwise:
                for slot in released:
                    free[_form(slot)].append(self._arrays[slot.number])
            own = note.output.slot
            if last[own.number] == n and own.number not in tape.kept:
                free[_form(own)].append(self._arrays[own.number])

    def __len__(self) -> int:
        return len(self._code)

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
        for function, operands in self._code:
            function(*operands)

    def _array(self, slot: Slot) -> NDArray[Any]:
        shape = (*slot.shape, self.members if slot.each else 1)
        return np.zeros(shape, dtype=bool if slot.truth else self.dtype)

    def _operand(self, operand: Any) -> Any:
        if isinstance(operand, View):
            array = self._arrays[operand.slot.number]
            for index in operand.path:
                array = array[index]
            return array
        if isinstance(operand, np.ndarray) and operand.dtype != bool:
            return operand.astype(self.dtype)
        return operand


def _form(slot: Slot) -> tuple[Any, ...]:
    return slot.shape, slot.each, slot.truth


def _views(note: Instruction) -> list[View]:
    return [*(v for v in note.inputs if isinstance(v, View)), note.output]


def _needed(tape: Tape) -> list[Instruction]:
    """Instructions that something kept follows from."""
    wanted, found = set(tape.kept), list[Instruction]()
    for note in reversed(tape.notes):
        if note.output.slot.number in wanted:
            wanted |= {v.slot.number for v in note.inputs if isinstance(v, View)}
            found.append(note)
    return found[::-1]
