"""Runs of plain arithmetic of a program, compiled by numba (extra ``[fast]``)."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal.batch.carried import copied, where
from thermal.errors import MissingExtraError

_EXPRESSIONS: dict[Any, str] = {
    np.add: "{0} + {1}", np.subtract: "{0} - {1}", np.multiply: "{0} * {1}", np.divide: "{0} / {1}",
    np.negative: "-{0}", np.absolute: "abs({0})", np.sqrt: "np.sqrt({0})", np.rint: "np.rint({0})",
    np.maximum: "{0} if {0} >= {1} else {1}", np.minimum: "{0} if {0} <= {1} else {1}",
    np.greater: "one if {0} > {1} else zero", np.greater_equal: "one if {0} >= {1} else zero",
    np.less: "one if {0} < {1} else zero", np.less_equal: "one if {0} <= {1} else zero",
    np.equal: "one if {0} == {1} else zero", np.not_equal: "one if {0} != {1} else zero",
    np.bitwise_and: "{0} * {1}", np.logical_and: "{0} * {1}", np.invert: "one - {0}", np.logical_not: "one - {0}",
    np.bitwise_or: "{0} if {0} >= {1} else {1}", np.logical_or: "{0} if {0} >= {1} else {1}",
    copied: "{0}", where: "{1} if {0} != zero else {2}",
}  # fmt: skip

#: Instructions in a function, and in a loop: compilers take more than twice as long for twice as many.
_TOGETHER, _IN_LOOP = 240, 60

#: Function, inputs and output.
Instruction = tuple[Any, tuple[Any, ...], NDArray[Any]]
#: Where an array begins, and its strides, in elements.
Place = tuple[int, tuple[int, ...]]


def compiles(function: Any) -> bool:
    """Tell whether an instruction is plain arithmetic.

    Parameters
    ----------
    function : callable
        Of the instruction.
    """
    return function in _EXPRESSIONS


def compile_run(work: NDArray[Any], run: Sequence[Instruction]) -> list[Callable[[], Any]]:
    """Compile instructions that follow each other.

    Parameters
    ----------
    work : ndarray, shape (n,)
        Memory that all arrays lie in.
    run : sequence of tuple
        Of each instruction its function, its inputs and its output.

    Raises
    ------
    MissingExtraError
        When numba is not installed.
    """
    try:
        import numba
    except ImportError as error:
        advice = 'compiled batches need numba, which the extra brings: pip install "buildingmpc[fast]"'
        raise MissingExtraError(advice) from error
    made = []
    for begin in range(0, len(run), _TOGETHER):
        part = run[begin : begin + _TOGETHER]
        numbers = sorted({float(v) for _, inputs, _ in part for v in inputs if not isinstance(v, np.ndarray)})
        names = {number: f"c{k}" for k, number in enumerate(numbers)}
        lines = [f"    c{k} = numbers[{k}]" for k in range(len(numbers))]
        for together in _loops(work, part):
            lines += _loop(work, together, names)
        text = "def run(w, numbers, zero, one):\n" + "\n".join(lines) + "\n"
        scope: dict[str, Any] = {"np": np}
        exec(compile(text, "<thermal.batch.compiled>", "exec"), scope)  # text of numbers and templates alone
        kind = numba.from_dtype(work.dtype)
        signature = numba.void(kind[::1], kind[::1], kind, kind)
        compiled = numba.njit(signature, error_model="numpy")(scope["run"])
        arguments = work, np.array([*numbers, 0.0], dtype=work.dtype), work.dtype.type(0.0), work.dtype.type(1.0)
        made.append(_bound(compiled, arguments))
    return made


def _bound(function: Any, arguments: tuple[Any, ...]) -> Callable[[], Any]:
    return lambda: function(*arguments)


def _loops(work: NDArray[Any], run: Sequence[Instruction]) -> list[list[Instruction]]:
    """Put instructions over the same axes into one loop, as long as none reads or writes what another element has."""
    found: list[list[Instruction]] = []
    touched, written = list[Place](), list[Place]()
    axes: tuple[int, ...] = ()
    for function, inputs, output in run:
        shape = output.shape
        reads = [work_place(work, np.broadcast_to(v, shape)) for v in inputs if isinstance(v, np.ndarray)]
        target = work_place(work, output)
        fits = bool(found) and axes == shape and len(found[-1]) < _IN_LOOP
        fits = fits and all(not _overlap(shape, place, target) or place == target for place in touched)
        fits = fits and all(not _overlap(shape, w, read) or w == read for w in written for read in reads)
        if not fits:
            found.append([])
            touched, written, axes = [], [], shape
        found[-1].append((function, inputs, output))
        touched += [*reads, target]
        written.append(target)
    return found


def _overlap(shape: tuple[int, ...], one: Place, other: Place) -> bool:
    """Tell whether two places may share an element."""
    ends = [begin + sum((n - 1) * s for n, s in zip(shape, strides, strict=True)) for begin, strides in (one, other)]
    return one[0] <= ends[1] and other[0] <= ends[0]


def _loop(work: NDArray[Any], together: Sequence[Instruction], names: dict[float, str]) -> list[str]:
    """Write one loop over all elements of the outputs of some instructions."""
    shape = together[0][2].shape
    axes = [k for k, length in enumerate(shape) if length > 1] or [len(shape) - 1]
    lines = [f"{'    ' * (depth + 1)}for i{k} in range({shape[k]}):" for depth, k in enumerate(axes)]
    inner, known = "    " * (len(axes) + 1), dict[Place, str]()
    for function, inputs, output in together:
        terms = []
        for value in inputs:
            if not isinstance(value, np.ndarray):
                terms.append(names[float(value)])
                continue
            place = work_place(work, np.broadcast_to(value, shape))
            if place not in known:
                known[place] = f"a{len(known)}"
                lines.append(f"{inner}{known[place]} = w[{_index(place, axes)}]")
            terms.append(known[place])
        target = work_place(work, output)
        name = known.setdefault(target, f"a{len(known)}")
        lines.append(f"{inner}{name} = {_EXPRESSIONS[function].format(*terms)}")
        lines.append(f"{inner}w[{_index(target, axes)}] = {name}")
    return lines


def work_place(work: NDArray[Any], array: NDArray[Any]) -> Place:
    """Give where an array begins in the memory, and its strides, in elements.

    Parameters
    ----------
    work : ndarray
        The memory.
    array : ndarray
        A part of it.
    """
    begin = (array.__array_interface__["data"][0] - work.__array_interface__["data"][0]) // work.itemsize
    return begin, tuple(s // work.itemsize for s in array.strides)


def _index(place: Place, axes: Sequence[int]) -> str:
    begin, strides = place
    terms = [f"i{k}" if strides[k] == 1 else f"{strides[k]} * i{k}" for k in axes if strides[k]]
    return " + ".join([str(begin), *terms])
