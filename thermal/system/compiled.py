"""The components of a system that there are few of, compiled: exact, and many times faster than floats of Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from operator import itemgetter
from struct import Struct
from types import GeneratorType
from typing import Any, NamedTuple

import casadi
import numpy as np

from thermal._types import FloatArray
from thermal.components.component import Calls, Conditions, Given
from thermal.components.operations import CasadiOperations, StepOperations
from thermal.errors import ModelError, describe
from thermal.system.exchange import Mail, Runner, givens
from thermal.system.step import HvacStep
from thermal.system.system import HvacSystem

_Read = Callable[[Sequence[float]], Any]


class Results(Mapping[str, Any]):
    """What components did, by name; that of single components is read when it is asked for.

    Parameters
    ----------
    readers : mapping of str to tuple
        Phase of each component, and how its result is read; None for those that are known.
    rows : list of list of float
        What the phases gave [any].
    known : dict
        Results that are known.
    """

    __slots__ = ("_known", "_readers", "_rows")

    def __init__(
        self, readers: Mapping[str, tuple[int, _Read] | None], rows: list[list[float]], known: dict[str, Any]
    ) -> None:
        self._readers, self._rows, self._known = readers, rows, known

    def __getitem__(self, name: str) -> Any:
        if name not in self._known:
            phase, read = self._readers[name] or (0, tuple)
            self._known[name] = read(self._rows[phase])
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._readers)

    def __len__(self) -> int:
        return len(self._readers)

    def __reduce__(self) -> tuple[Any, ...]:
        return dict, (dict(self),)  # as a plain one: readers cannot be pickled


class _Phase(NamedTuple):
    """Equations of single components between two looks at the groups.

    Parameters
    ----------
    run : callable
        Evaluates them, from array to array.
    out : ndarray
        What they give.
    messages : list of tuple
        What groups are told next, and how it is read.
    receive : callable
        Takes what groups have sent since the phase before.
    owner : object
        What must live as long.
    """

    run: Callable[[], None]
    out: FloatArray
    messages: list[tuple[str, _Read]]
    receive: Callable[..., None]
    owner: Any


class CompiledSystem:
    """Steps a system: groups as arrays of NumPy, and between them all else as functions of CasADi.

    Parameters
    ----------
    system : HvacSystem
        The system.

    Notes
    -----
    The first step is taken with symbols for all single components. Each time all of them wait for what groups draw, the
    expressions that have come up since make a function, a phase; what groups send is a new symbol. A system of two air
    handlers has some 900 operations on single numbers a step, 50 ns each in Python, 4 ns here.
    """

    def __init__(self, system: HvacSystem) -> None:
        self._system, self._ops = system, StepOperations()
        self._phases: list[_Phase] | None = None
        self._actions: Any = None
        self._pending: list[float] = []
        count = len(system.states) + 4 + len(system.air_handlers)
        self._now, self._set = np.zeros(count), np.zeros(len(system.actuators))
        self._write = _writer(self._now, 0, count)

    def _trace(self, calls: Calls, conditions: Conditions, seconds: float) -> list[_Phase]:
        """Take a step with symbols for single components, numbers for groups; make functions of what comes up."""
        system, n_state, mail = self._system, len(self._system.states), Mail(self._system)
        now, fixed = _symbols("now", self._now.size), _symbols("set", self._set.size)
        load, carried, sent, kept = list[Any](), list[Any](), list[float](), list[float]()
        symbols = now, fixed, load, carried
        told: list[tuple[str, Any]] = []

        def evaluated(expressions: list[Any]) -> list[float]:
            """Values of expressions in this step."""
            function: Any = casadi.Function("now", [casadi.vertcat(*part) for part in symbols],
                                            [casadi.vertcat(*expressions)])  # fmt: skip
            return function(self._now, self._set, sent, kept).full().ravel().tolist()  # type: ignore[no-any-return]

        def sender(name: str) -> Callable[[str, Any], None]:
            def put(port: str, message: Any) -> None:
                if name in system.groups:
                    sent.extend(_leaves(message))
                    message = _replaced(message, load)
                mail.put(name, port, message)

            return put

        def deliver(name: str, message: Any) -> Any:
            if name not in system.groups:
                return message
            told.append((name, message))
            return _reader(message, 0)(evaluated(_leaves(message)))

        outdoor, damp, room, length, *humid = now[n_state:]
        weather = conditions._replace(
            outdoor_temperature=outdoor, outdoor_humidity=damp, return_humidity=tuple(humid), room_temperature=room
        )
        actions = dict(zip(system.actuators, fixed, strict=True))
        single = givens(system, calls, weather, actions, now[:n_state], length, sender)
        group, runs = Given(conditions, calls, {}, {}, seconds, sender("")), {}
        for name, component in system.components.items():
            alone = name not in system.groups
            ops, given = (CasadiOperations(), single[name]) if alone else (self._ops, group._replace(put=sender(name)))
            runs[name] = component.run(ops, given)
        runner, traces = Runner(mail, runs, deliver), list[_Trace]()
        runner.advance(system.groups)  # up to where they wait first
        while runner.waiting:
            known, begin, drawn = {n for trace in traces for n in trace.results}, len(carried), len(load)
            moved = runner.advance(system.singles)
            held: list[Any] = []
            for (receiver, _), boxes in mail.waiting.items():
                if receiver in system.singles:  # what waits for groups goes on as numbers, not as expressions
                    for box in boxes.values():
                        held += [value for message in box for value in message]
                        box.extend([_replaced(box.popleft(), carried) for _ in range(len(box))])
            new = carried[begin:]
            del carried[begin:]
            kept += evaluated(held)
            carried += new
            told.clear()
            moved |= runner.advance(system.groups)
            results = {n: r for n, r in runner.results.items() if n in system.singles and n not in known}
            traces.append(_Trace(held, results, list(told), slice(begin, len(carried)), drawn))
            if not moved:
                expected = "components that do not wait for each other"
                raise ModelError(describe("HvacSystem", expected, f"{runner.waiting}"))
        return self._functions(symbols, traces)

    def _functions(self, symbols: tuple[list[Any], ...], traces: list[_Trace]) -> list[_Phase]:
        """Make a function of each phase, bound to the arrays that it reads and writes."""
        system, received = self._system, 0
        loads, kept = np.zeros(len(symbols[2])), np.zeros(len(symbols[3]))
        inputs, phases = [casadi.vertcat(*part) for part in symbols], []
        self._readers: dict[str, tuple[int, _Read] | None] = dict.fromkeys(system.components)
        self._places: dict[tuple[str, str], tuple[int, int]] = {}
        for k, trace in enumerate(traces):
            values = [*trace.held, *system.powers(CasadiOperations(), trace.results)]
            for name, result in trace.results.items():
                self._readers[name] = k, _reader(result, len(values))
                values += _leaves(result)
                for state in system.components[name].states:
                    self._places[name, state.name] = k, len(values)
                    values.append(getattr(result, state.name))
            messages = []
            for name, message in trace.messages:
                messages.append((name, _reader(message, len(values))))
                values += _leaves(message)
            function: Any = casadi.Function("phase", inputs, [casadi.densify(casadi.cse(casadi.vertcat(*values)))])
            out = np.zeros(len(values))
            buffer, run = function.buffer()
            for place, array in enumerate((self._now, self._set, loads, kept)):
                buffer.set_arg(place, memoryview(array.data))
            buffer.set_res(0, memoryview(out.data))
            whole = _keeping(run, out[: len(trace.held)], kept[trace.carried]) if trace.held else run
            phases.append(_Phase(whole, out, messages, _writer(loads, received, trace.drawn), (function, buffer)))
            received = trace.drawn
        self._power = [len(trace.held) for trace in traces]
        self._state = [self._places[name, state.name] for name, state in system.states.values()]
        return phases

    def step(
        self, state: Sequence[float], calls: Calls, conditions: Conditions, actions: Sequence[float], seconds: float
    ) -> HvacStep:
        """Take a step.

        Parameters
        ----------
        state : sequence of float
            In the order of `HvacSystem.states` [unit of the state].
        calls : Calls
            Of the thermostats.
        conditions : Conditions
            Of the step.
        actions : sequence of float
            In the order of `HvacSystem.actuators`, the same object as long as they are the same [unit of the actuator].
        seconds : float
            Length of the step [s].
        """
        system, pending, rows = self._system, self._pending, list[list[float]]()
        if actions is not self._actions:
            self._actions = actions
            self._set[:] = actions
        _, _, _, outdoor, damp, humid, room = conditions
        humid = humid if type(humid) is tuple else (humid,) * len(system.air_handlers)
        self._write(*state, outdoor, damp, room, seconds, *humid)
        if self._phases is None:
            self._phases = self._trace(calls, conditions, seconds)
        given, ops = Given(conditions, calls, {}, {}, seconds, self._put), self._ops
        runs, results = dict[str, Any](), dict[str, Any]()
        pending.clear()
        for name, group in system.groups.items():
            run: Any = group.run(ops, given)
            if isinstance(run, GeneratorType):
                runs[name] = run
                run.send(None)
            else:
                results[name] = run
        for phase in self._phases:
            phase.receive(*pending)
            pending.clear()
            phase.run()
            row = phase.out.tolist()
            rows.append(row)
            for name, read in phase.messages:
                try:
                    runs[name].send(read(row))
                except StopIteration as done:
                    results[name] = done.value
        electric, fuel = system.powers(ops, results)
        for row, place in zip(rows, self._power, strict=True):
            electric += row[place]
            fuel += row[place + 1]
        after = tuple([rows[phase][place] for phase, place in self._state])
        return HvacStep(Results(self._readers, rows, results), after, electric, fuel)

    def _put(self, port: str, message: Any) -> None:
        """Take down what a group draws, in the order in which its symbols were made."""
        for value in message:
            if type(value) is list:
                self._pending.extend(value)
            else:
                self._pending.append(value)


class _Trace(NamedTuple):
    """What came up in a phase, as expressions.

    Parameters
    ----------
    held : list
        What goes on to later phases.
    results : dict
        What components did that are done.
    messages : list of tuple
        What groups are told next.
    carried : slice
        Where `held` stands among all that goes on.
    drawn : int
        How many values groups have sent before.
    """

    held: list[Any]
    results: dict[str, Any]
    messages: list[tuple[str, Any]]
    carried: slice
    drawn: int


def _writer(array: FloatArray, begin: int, end: int) -> Callable[..., None]:
    """Make what writes floats into an array; twice as fast as an assignment from a list."""
    return partial(Struct(f"{end - begin}d").pack_into, memoryview(array.data), 8 * begin)


def _symbols(name: str, count: int) -> list[Any]:
    return [casadi.SX.sym(f"{name}{k}") for k in range(count)]


def _replaced(message: Any, made: list[Any]) -> Any:
    """Put new symbols in the place of a message's values."""

    def fresh(value: Any) -> Any:
        if isinstance(value, tuple | list):
            return [fresh(v) for v in value]
        made.append(casadi.SX.sym(f"message{len(made)}"))
        return made[-1]

    return type(message)(*(fresh(value) for value in message))


def _leaves(template: Any) -> list[Any]:
    """Values of a message or result, those of tuples in it too, in a row."""
    return [v for value in template for v in (_leaves(value) if isinstance(value, tuple | list) else [value])]


def _reader(template: Any, begin: int) -> _Read:
    """Make what reads a message or result, with its names, from a row of values."""
    make: Callable[[Any], Any] | None = getattr(type(template), "_make", None)
    if not any(isinstance(value, tuple | list) for value in template):
        row = slice(begin, begin + len(template))
        return itemgetter(row) if make is None else lambda values: make(values[row])
    parts: list[_Read] = []
    for value in template:
        parts.append(_reader(value, begin) if isinstance(value, tuple | list) else itemgetter(begin))
        begin += len(_leaves([value]))
    return lambda values: make([part(values) for part in parts])  # type: ignore[misc]


def _keeping(run: Callable[[], None], new: FloatArray, kept: FloatArray) -> Callable[[], None]:
    """Let a function keep a part of what it gives for those after it."""

    def both() -> None:
        run()
        kept[:] = new

    return both
