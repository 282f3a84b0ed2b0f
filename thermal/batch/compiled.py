"""Loops of plain arithmetic of a program, compiled by numba (extra ``[fast]``)."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from thermal.batch.carried import copied, where
from thermal.batch.elementary import elementary, split_exponent
from thermal.batch.trace import Instruction
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

#: In single precision these are arithmetic too; see `thermal.batch.elementary`.
_IN_SINGLE: dict[Any, str] = {
    np.exp: "exp({0})", np.expm1: "expm1({0})", np.log: "log({0})", np.arctan: "arctan({0})",
    np.power: "power({0}, {1}, {2}, {3}, {4})",
}  # fmt: skip

#: Instructions in a function: compilers take more than twice as long for twice as many.
_TOGETHER = 240

#: Where an array begins, and its strides, in elements.
Place = tuple[int, tuple[int, ...]]


class Placed(NamedTuple):
    """An instruction whose values have their places in memory.

    Parameters
    ----------
    function : callable
        What is done.
    inputs : tuple
        Arrays, or plain numbers.
    output : ndarray
        What is written.
    stored : bool
        Whether others than its loop look at the output.
    """

    function: Any
    inputs: tuple[Any, ...]
    output: NDArray[Any]
    stored: bool = True


def compiles(note: Instruction, dtype: Any) -> bool:
    """Tell whether an instruction is plain arithmetic.

    Parameters
    ----------
    note : Instruction
        Any.
    dtype : numpy.dtype
        Precision.
    """
    function = note.function
    if function is np.power and dtype == np.float32:
        exponent = note.inputs[1]  # a whole one may be of a negative number
        return isinstance(exponent, float) and exponent % 1.0 != 0.0 and abs(exponent) < 4.0
    return function in _EXPRESSIONS or (dtype == np.float32 and function in _IN_SINGLE)


def compile_loops(work: NDArray[Any], loops: Sequence[Sequence[Placed]]) -> list[Callable[[], Any]]:
    """Compile loops that follow each other.

    Parameters
    ----------
    work : ndarray, shape (n,)
        Memory that all arrays lie in.
    loops : sequence of sequence of Placed
        Instructions over the same axes.

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
    number, kind = work.dtype.type, numba.from_dtype(work.dtype)
    scope: dict[str, Any] = {"np": np, "zero": number(0.0), "one": number(1.0)}
    scope |= elementary() if work.dtype == np.float32 else {}
    made, lines, count = list[Callable[[], Any]](), list[str](), 0
    for place, loop in enumerate(loops):
        lines += _Written(work, loop, scope).lines
        count += len(loop)
        if count < _TOGETHER and place + 1 < len(loops):
            continue
        text = "def run(w):\n" + "\n".join(lines) + "\n"
        exec(compile(text, "<thermal.batch.compiled>", "exec"), scope)  # text of places and templates alone
        compiled = numba.njit(numba.void(kind[::1]), error_model="numpy")(scope["run"])
        made.append(_bound(compiled, work))
        lines, count = [], 0
    return made


def _bound(function: Any, work: NDArray[Any]) -> Callable[[], Any]:
    return lambda: function(work)


class _Written:
    """A loop as text: what an inner axis does not change is read outside of it, what nobody looks at is not stored."""

    def __init__(self, work: NDArray[Any], loop: Sequence[Placed], scope: dict[str, Any]) -> None:
        self._work, self._scope = work, scope
        self._lengths = [n for n in loop[0].output.shape if n > 1]
        self._known = dict[Place, str]()
        self._reads: list[list[str]] = [[] for _ in range(len(self._lengths) + 1)]
        self._body = list[str]()
        last = {self._place(step.output, step): k for k, step in enumerate(loop)}
        for k, step in enumerate(loop):
            place, name = self._place(step.output, step), f"b{k}"
            self._body.append(f"{name} = {self._expression(step)}")
            self._known[place] = name
            if step.stored and last[place] == k:
                self._body.append(f"w[{_index(place)}] = {name}")

    @property
    def lines(self) -> list[str]:
        """Text, to stand in a function."""
        found = [f"    {read}" for read in self._reads[0]]
        for axis, length in enumerate(self._lengths):
            indent = "    " * (axis + 1)
            found.append(f"{indent}for i{axis} in range({length}):")
            found += [f"{indent}    {read}" for read in self._reads[axis + 1]]
        return [*found, *("    " * (len(self._lengths) + 1) + line for line in self._body)]

    def _expression(self, step: Placed) -> str:
        template = _EXPRESSIONS.get(step.function) or _IN_SINGLE[step.function]
        inputs = list(step.inputs)
        if step.function is np.power:
            rises = inputs[1] > 0.0
            inputs[1:] = [*split_exponent(inputs[1]), 0.0 if rises else np.inf, np.inf if rises else 0.0]
        return template.format(*(self._term(value, step) for value in inputs))

    def _term(self, value: Any, step: Placed) -> str:
        if not isinstance(value, np.ndarray):
            name = f"c{float(value).hex()}".replace(".", "_").replace("-", "m").replace("+", "p")
            self._scope[name] = self._work.dtype.type(value)
            return name
        place = self._place(value, step)
        if place not in self._known:
            name = self._known[place] = f"a{len(self._known)}"
            depth = max((axis + 1 for axis, stride in enumerate(place[1]) if stride), default=0)
            self._reads[depth].append(f"{name} = w[{_index(place)}]")
        return self._known[place]

    def _place(self, array: NDArray[Any], step: Placed) -> Place:
        shape = step.output.shape
        begin, strides = work_place(self._work, np.broadcast_to(array, shape))
        return begin, tuple(s for s, n in zip(strides, shape, strict=True) if n > 1)


def _index(place: Place) -> str:
    begin, strides = place
    return " + ".join([str(begin), *(f"{s} * i{k}" for k, s in enumerate(strides) if s)])


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
