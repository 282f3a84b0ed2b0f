"""Instructions in an order in which those over the same axes follow each other, to share loops."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from thermal.batch.trace import Instruction, View

#: Instructions in a loop at most: compilers take more than twice as long for twice as many.
LONGEST = 160

#: Lengths of the axes that a loop goes over: of one member's values, and of the members.
Axes = tuple[tuple[int, ...], int]


class Access(NamedTuple):
    """What an instruction reads or writes.

    Parameters
    ----------
    slot : int
        Number of the slot.
    first, last : int
        First and last element in it.
    strides : tuple of int or None
        By which an element of the loop finds its own; None when the whole is read for each.
    writes : bool
        Whether it is written.
    """

    slot: int
    first: int
    last: int
    strides: tuple[int, ...] | None
    writes: bool

    def meets(self, other: Access) -> bool:
        """Tell whether two accesses may not change their order.

        Parameters
        ----------
        other : Access
            The other.
        """
        apart = self.slot != other.slot or self.last < other.first or other.last < self.first
        return not apart and (self.writes or other.writes)

    def shares(self, other: Access) -> bool:
        """Tell whether two accesses that meet may be of one loop: each element has to do with itself alone.

        Parameters
        ----------
        other : Access
            The other.
        """
        return self.strides is not None and self.first == other.first and self.strides == other.strides


class Loop(NamedTuple):
    """Instructions that share a loop, or one alone that is a call.

    Parameters
    ----------
    axes : tuple or None
        What it goes over; None of a call.
    notes : list of Instruction
        In order.
    """

    axes: Axes | None
    notes: list[Instruction]


def in_loops(notes: Sequence[Instruction], members: int, fits: Callable[[Instruction], bool]) -> list[Loop]:
    """Order instructions so that arithmetic comes in few long loops; none passes what it depends on.

    Parameters
    ----------
    notes : sequence of Instruction
        In an order that works.
    members : int
        How many members there are.
    fits : callable
        Which instructions are arithmetic on elements; others are calls.
    """
    axes, accesses = list[Axes | None](), list[list[Access]]()
    shapes: dict[int, Any] = {}
    for note in notes:
        plain = fits(note)
        own, found = _accesses(note, members, plain, shapes)
        axes.append(own if plain else None)
        accesses.append(found)
    followers, waits = _dependencies(accesses)
    ready: dict[Axes | None, list[int]] = defaultdict(list)
    for k, count in enumerate(waits):
        if count == 0:
            ready[axes[k]].append(k)
    loops, left = list[Loop](), len(notes)
    while left:
        arithmetic = [key for key, rows in ready.items() if key is not None and rows]
        chosen = min(arithmetic, key=lambda key: (key[1], len(key[0]), key)) if arithmetic else None
        taken = _fill(chosen, ready, axes, accesses, followers, waits)
        loops.append(Loop(chosen, [notes[k] for k in taken]))
        left -= len(taken)
    return loops


def taken_apart(notes: Sequence[Instruction], members: int, fits: Callable[[Instruction], bool]) -> list[Instruction]:
    """Take arithmetic on several arrays at once apart, so that it shares loops with that on each of them.

    Parameters
    ----------
    notes, members, fits
        As in `in_loops`.
    """
    shapes: dict[int, Any] = {}
    found = list[Instruction]()
    for note in notes:
        shape = _array(note.output, members, shapes)[1].shape
        if not fits(note) or len(shape) < 3:
            found.append(note)
            continue
        for k in range(shape[0]):
            inputs = tuple(_part(value, k, len(shape), members, shapes) for value in note.inputs)
            output = note.output._replace(path=(*note.output.path, k))
            found.append(note._replace(inputs=inputs, output=output, partial=True))
    return found


def _part(value: Any, number: int, dimensions: int, members: int, shapes: dict[int, Any]) -> Any:
    """Give the part of an operand that an element of the first axis has to do with."""
    array = _array(value, members, shapes)[1] if isinstance(value, View) else value
    if not isinstance(array, np.ndarray) or array.ndim < dimensions:
        return value
    index = number if len(array) > 1 else 0
    return value._replace(path=(*value.path, index)) if isinstance(value, View) else array[index]


def kept_within(loops: Sequence[Loop], kept: set[int]) -> set[int]:
    """Find slots that no other loop has to do with than the one that makes them: they need no memory.

    Parameters
    ----------
    loops : sequence of Loop
        All of them.
    kept : set of int
        Slots that outlive a run.
    """
    places, calls = defaultdict[int, set[int]](set), set[int]()
    for number, loop in enumerate(loops):
        for note in loop.notes:
            views = [*(v for v in note.inputs if isinstance(v, View)), note.output]
            for view in views:
                places[view.slot.number].add(number)
            if loop.axes is None:
                calls |= {view.slot.number for view in views}
    return {slot for slot, where in places.items() if len(where) == 1} - kept - calls


def _fill(
    key: Axes | None, ready: dict[Axes | None, list[int]], axes: Sequence[Axes | None],
    accesses: Sequence[list[Access]], followers: Sequence[Sequence[int]], waits: list[int],
) -> list[int]:  # fmt: skip
    """Take instructions over the same axes as long as there are some; one call alone."""
    taken, later, rows = list[int](), list[int](), ready[key]
    touched: dict[int, list[Access]] = defaultdict(list)
    while rows and len(taken) < (1 if key is None else LONGEST):
        rows.sort()
        k = rows.pop(0)
        meeting = [(a, b) for a in accesses[k] for b in touched[a.slot] if a.meets(b)]
        if not all(a.shares(b) for a, b in meeting):
            later.append(k)
            continue
        taken.append(k)
        for access in accesses[k]:
            touched[access.slot].append(access)
        for follower in followers[k]:
            waits[follower] -= 1
            if waits[follower] == 0:
                ready[axes[follower]].append(follower)
    rows += later
    return taken


def _accesses(
    note: Instruction, members: int, plain: bool, shapes: dict[int, Any]
) -> tuple[Axes, list[Access]]:
    """Give the axes of an instruction, and what it reads and writes."""
    shape, found = _array(note.output, members, shapes)[1].shape, []
    for view, writes in [*((v, False) for v in note.inputs if isinstance(v, View)), (note.output, True)]:
        whole, part = _array(view, members, shapes)
        first = part.__array_interface__["data"][0] - whole.__array_interface__["data"][0]
        last = first + sum((n - 1) * s for n, s in zip(part.shape, part.strides, strict=True))
        strides = None
        if plain:
            spread = np.broadcast_to(part, shape).strides
            strides = tuple(s for s, n in zip(spread, shape, strict=True) if n > 1)
        found.append(Access(view.slot.number, first, last, strides, writes))
    return (tuple(n for n in shape[:-1] if n > 1), shape[-1]), found


def _array(view: View, members: int, shapes: dict[int, Any]) -> tuple[Any, Any]:
    """Give stand-ins of a slot and of a part of it, a byte an element."""
    slot = view.slot
    if slot.number not in shapes:
        shapes[slot.number] = np.empty((*slot.shape, members if slot.each else 1), dtype=np.int8)
    whole = part = shapes[slot.number]
    for index in view.path:
        part = part[index]
    return whole, part


def _dependencies(accesses: Sequence[Sequence[Access]]) -> tuple[list[list[int]], list[int]]:
    """Give which instructions wait for each one, and for how many each waits."""
    followers: list[list[int]] = [[] for _ in accesses]
    waits, seen = [0] * len(accesses), defaultdict[int, list[tuple[int, Access]]](list)
    for k, mine in enumerate(accesses):
        before = {j for access in mine for j, other in seen[access.slot] if other.meets(access)}
        waits[k] = len(before)
        for j in before:
            followers[j].append(k)
        for access in mine:
            seen[access.slot].append((k, access))
    return followers, waits
