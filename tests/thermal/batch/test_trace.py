"""Equations of one member, traced and run for many, give what they give one by one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from thermal.batch.operations import TracedOperations
from thermal.batch.program import Program
from thermal.batch.trace import Tape
from thermal.components.operations import NumpyOperations, Operations
from thermal.errors import ModelError

GROUPS = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])


def equations(ops: Operations, x: Any, y: Any) -> Any:
    """Something of everything, of an array of three and a number."""
    sums = ops.sums(x * y, GROUPS)
    spread = ops.spread([s + 1.0 for s in sums], np.array([0, 1, 0]))
    part = ops.step(x - 0.5) * ops.clip(x, 0.2, 0.8) + ops.lesser(spread, 3.0)
    chosen = np.where(part > y, part**2, ops.exp(-part))
    chosen = np.maximum(chosen, np.array([0.1, 0.2, 0.3])) / (1.0 + ops.dot(x, np.array([1.0, 2.0, 3.0])))
    lines = np.stack([chosen, x, np.ones(3)])
    return (lines[1:] - lines[:-1]).sum(axis=0) + lines.max(axis=0) + chosen[np.array([2, 0, 1])]


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("each", [True, False])
def test_many_at_once_are_as_one_by_one(dtype: Any, each: bool) -> None:
    tape = Tape()
    x, y = tape.value(3), tape.value(each=each)
    result = tape.keep(equations(TracedOperations(tape), x, y), 3)
    program, rng = Program(tape, 5, dtype), np.random.default_rng(0)
    for _ in range(2):  # a second run finds the memory as the first left it
        xs, ys = rng.uniform(0.0, 1.0, (3, 5)), rng.uniform(0.0, 1.0, 5 if each else 1)
        program.of(x)[...], program.of(y)[...] = xs, ys
        program.run()
        ones = [equations(NumpyOperations(), xs[:, k], ys[k % len(ys)]) for k in range(5)]
        np.testing.assert_allclose(program.of(result).T, ones, rtol=1e-14 if dtype is np.float64 else 2e-6)


@pytest.mark.parametrize("each", [True, False])
def test_one_alone_is_as_one_of_many(each: bool) -> None:
    """The virtual machine of one member does what NumPy does for several, between calls that are no arithmetic."""
    found = []
    for members in (1, 2):
        tape = Tape()
        x, y, memory = tape.value(3), tape.value(each=each), tape.value(3)
        turned = tape.call(lambda values, out: np.copyto(out, values[::-1]), [memory * 2.0 + np.arctan(x)], 3)
        divided = np.where(x > 0.5, 1.0 / (x - 0.5), np.rint(turned * 10.0))  # what is not taken may be infinite
        result = tape.keep(equations(TracedOperations(tape), x, y) + divided, 3)
        memory[...] = memory + result * 0.1
        program, rng = Program(tape, members), np.random.default_rng(1)
        program.of(memory)[...] = 0.25
        rows = []
        for _ in range(4):
            program.of(x)[...] = rng.choice([0.0, 0.5, 0.75, 0.3], 3)[:, None]
            program.of(y)[...] = rng.uniform()
            with np.errstate(divide="ignore"):
                program.run()
            rows.append([program.of(result)[:, 0].copy(), program.of(memory)[:, -1].copy()])
        found.append(np.array(rows))
    assert np.isfinite(found[0]).all() and np.ptp(found[0]) > 1.0
    np.testing.assert_allclose(found[0], found[1], rtol=1e-13)


def test_one_alone_rounds_halves_as_numpy_does() -> None:
    tape, values = Tape(), np.array([0.5, 1.5, 2.5, -0.5, -1.5, 7.49999, 1e9 + 0.5, -3.2])
    x = tape.value(8)
    rounded = tape.keep(np.rint(x), 8)
    program = Program(tape, 1)
    program.of(x)[:, 0] = values
    program.run()
    np.testing.assert_array_equal(program.of(rounded)[:, 0], np.rint(values))


def test_what_is_asked_twice_is_done_once() -> None:
    tape = Tape()
    x = tape.value(3)
    tape.keep(np.exp(x + 1.0) + np.exp(x + 1.0), 3)
    with_all = len(Program(tape, 2))
    unused = np.sin(x)
    assert unused.shape == (3,) and len(Program(tape, 2)) == with_all  # nobody wants it
    # x is set from outside, so that it may change: what is read from it is read anew
    assert with_all == 6


def test_memory_is_used_again_without_harm() -> None:
    tape = Tape()
    x = tape.value(4)
    value = x * 1.0
    for k in range(50):
        value = value + x * float(k)
    result = tape.keep(value, 4)
    program = Program(tape, 3)
    program.of(x)[...] = 1.0
    program.run()
    assert (program.of(result) == 1.0 + sum(range(50))).all()


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda x: 1.0 if x > 0.0 else 2.0, "without branches on values"),
        (lambda x: np.sort(x), "numpy.sort"),
        (lambda x: np.add.accumulate(x), "accumulate"),
    ],
)
def test_what_cannot_be_traced_says_so(wrong: Callable[[Any], Any], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        wrong(Tape().value(3)[0] if "branches" in words else Tape().value(3))


def test_a_result_is_not_written_to() -> None:
    x = Tape().value(3)
    with pytest.raises(ModelError, match="may be written to"):
        (x + 1.0)[0] = 2.0


@pytest.mark.parametrize(("dtype", "near"), [(np.float64, 1e-15), (np.float32, 1e-6)])
def test_compiled_runs_are_the_same(dtype: Any, near: float) -> None:
    """Parts of values are written, read and written again, in loops that are ordered anew."""
    pytest.importorskip("numba", reason="needs the extra [fast]")
    tape = Tape()
    x, y, memory = tape.value(3), tape.value(), tape.value(3)
    parts = tape.value(4, 3, kept=False)
    parts[0], parts[1], parts[2], parts[3] = x, x * y, np.arctan(x), np.log(x + 1.0)
    parts[1:3] = parts[1:3] * 2.0 - parts[0:2]
    lines = np.stack([memory, parts[1], parts[2]])
    turned = tape.call(lambda values, out: np.copyto(out, values[::-1]), [parts[3] + y**1.3], 3)
    sloped = (lines[1:] - lines[:-1]) / (1.0 + np.expm1(lines[1:] * 0.1)) + np.power(parts[3], -0.3)
    result = tape.keep(equations(TracedOperations(tape), x, y) + sloped.sum(axis=0) + turned, 3)
    memory[1:] = memory[:-1] + result[1:] * 0.1
    plain, compiled, rng = Program(tape, 4, dtype), Program(tape, 4, dtype, compiled=True), np.random.default_rng(1)
    for _ in range(3):
        xs, ys = rng.uniform(0.1, 1.0, (3, 4)), rng.uniform(0.1, 1.0, 4)
        for program in (plain, compiled):
            program.of(x)[...], program.of(y)[...] = xs, ys
            program.run()
        for value in (result, memory):
            assert np.isfinite(plain.of(value)).all()
            np.testing.assert_allclose(compiled.of(value), plain.of(value), rtol=near)
