"""Runs of plain arithmetic of a program, compiled by numba (extra ``[fast]``): no call of NumPy between two instructions."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from thermal.batch.trace import _copy, _where
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
    _copy: "{0}", _where: "{1} if {0} != zero else {2}",
}  # fmt: skip

#: Instructions in a function: compilers take more than twice as long for twice as many.
_TOGETHER = 80


def compiles(function: Any) -> bool:
    """Tell whether an instruction is plain arithmetic.

    Parameters
    ----------
    function : callable
        Of the instruction.
    """
    return function in _EXPRESSIONS


def compile_run(
    work: NDArray[Any], run: Sequence[tuple[Any, tuple[Any, ...], NDArray[Any]]]
) -> list[Callable[[], Any]]:
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
        for function, inputs, output in part:
            lines += _loop(work, function, inputs, output, names)
        text = "def run(w, numbers, zero, one):\n" + "\n".join(lines) + "\n"
        scope: dict[str, Any] = {"np": np}
        exec(compile(text, "<thermal.batch.compiled>", "exec"), scope)  # noqa: S102 - text of numbers and templates alone
        kind = numba.from_dtype(work.dtype)
        signature = numba.void(kind[::1], kind[::1], kind, kind)
        compiled = numba.njit(signature, error_model="numpy")(scope["run"])
        arguments = work, np.array([*numbers, 0.0], dtype=work.dtype), work.dtype.type(0.0), work.dtype.type(1.0)
        made.append(_bound(compiled, arguments))
    return made


def _bound(function: Any, arguments: tuple[Any, ...]) -> Callable[[], Any]:
    return lambda: function(*arguments)


def _loop(
    work: NDArray[Any], function: Any, inputs: Sequence[Any], output: NDArray[Any], names: dict[float, str]
) -> list[str]:
    """Write the loop of an instruction over all elements of its output."""
    shape, terms = output.shape, []
    arrays = [np.broadcast_to(v, shape) if isinstance(v, np.ndarray) else None for v in inputs]
    places = [*((work_place(work, a) if a is not None else None) for a in arrays), work_place(work, output)]
    axes = _merged(shape, [p for p in places if p is not None])
    for value, place in zip(inputs, places[:-1], strict=True):
        terms.append(names[float(value)] if place is None else f"w[{_index(place, axes)}]")
    lines = [f"{'    ' * (k + 1)}for i{k} in range({length}):" for k, (length, _) in enumerate(axes)]
    expression = _EXPRESSIONS[function].format(*(f"a{k}" for k in range(len(terms))))
    inner = "    " * (len(axes) + 1)
    lines += [f"{inner}a{k} = {term}" for k, term in enumerate(terms)]
    place = places[-1]
    assert place is not None
    return [*lines, f"{inner}w[{_index(place, axes)}] = {expression}"]


Place = tuple[int, tuple[int, ...]]


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


def _merged(shape: tuple[int, ...], places: Sequence[Place]) -> list[tuple[int, tuple[int, ...]]]:
    """Axes to loop over, each with its length and the axes that it stands for; neighbours that lie in line are one."""
    axes: list[tuple[int, tuple[int, ...]]] = []
    for k, length in enumerate(shape):
        if length == 1 and len(shape) > 1:
            continue
        if axes and all(strides[axes[-1][1][-1]] == strides[k] * length for _, strides in places):
            axes[-1] = (axes[-1][0] * length, (*axes[-1][1], k))
        else:
            axes.append((length, (k,)))
    return axes or [(1, (len(shape) - 1,))]


def _index(place: Place, axes: Sequence[tuple[int, tuple[int, ...]]]) -> str:
    begin, strides = place
    terms = [f"i{k}" if strides[of[-1]] == 1 else f"{strides[of[-1]]} * i{k}" for k, (_, of) in enumerate(axes)
             if strides[of[-1]]]  # fmt: skip
    return " + ".join([str(begin), *terms])
