"""The components of a system that there are few of, compiled: exact, and many times faster than floats of Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import count
from operator import itemgetter
from struct import Struct
from types import GeneratorType
from typing import Any, NamedTuple

import casadi
import numpy as np

from thermal._types import FloatArray
from thermal.components.component import Calls, Conditions, Given
from thermal.components.operations import CasadiOperations, StepOperations
from thermal.errors import ModelError
from thermal.system.exchange import PortMessages, Runner, givens
from thermal.system.step import HvacStep
from thermal.system.system import HvacSystem

_Read = Callable[[Sequence[float]], Any]


class Results(Mapping[str, Any]):
    """What components did, by name; that of single components is read when it is asked for.

    Parameters
    ----------
    readers : mapping of str to callable
        How the result of each component is read; of no use for those that are known.
    values : list of float
        What the phases gave [any].
    known : dict
        Results that are known.
    """

    __slots__ = ("_known", "_readers", "_values")

    def __init__(self, readers: Mapping[str, _Read], values: list[float], known: dict[str, Any]) -> None:
        self._readers, self._values, self._known = readers, values, known

    def __getitem__(self, name: str) -> Any:
        if name not in self._known:
            self._known[name] = self._readers[name](self._values)
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
    receive : callable
        Takes what groups have sent since the phase before.
    run : callable
        Evaluates them, from array to array.
    told : ndarray
        What groups are told next.
    messages : list of tuple
        The groups, each with how its message is read from it.
    owner : object
        What must live as long.
    """

    receive: Callable[..., None]
    run: Callable[[], None]
    told: FloatArray
    messages: list[tuple[str, _Read]]
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
    expressions that have come up since make a function, a phase; what groups send is a new symbol. What components give
    is evaluated in the first phase that knows all that it is made of. A system of two air handlers has
    some 900 operations on single numbers a step, 50 ns each in Python, 4 ns here.
    """

    def __init__(self, system: HvacSystem) -> None:
        self._system, self._ops = system, StepOperations()
        self._phases: list[_Phase] | None = None
        self._actions: Any = None
        self._pending: list[float] = []
        size = len(system.states) + 4 + len(system.air_handlers)
        self._now, self._set = np.zeros(size), np.zeros(len(system.actuators))
        self._write = _writer(self._now, 0, size)

    def _trace(self, calls: Calls, conditions: Conditions, seconds: float) -> list[_Phase]:
        """Take a step with symbols for single components, numbers for groups; make functions of what comes up."""
        system, n_state, messages = self._system, len(self._system.states), PortMessages(self._system)
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
                messages.put(name, port, message)

            return put

        def deliver(name: str, message: Any) -> Any:
            if name not in system.groups:
                return message
            told.append((name, message))
            return _reader(message, count())(evaluated(_leaves(message)))

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
        runner, traces = Runner(messages, runs, deliver), list[_Trace]()
        runner.advance(system.groups)  # up to where they wait first
        while runner.waiting:
            begin, drawn = len(carried), len(load)
            moved = runner.advance(system.singles)
            held: list[Any] = []
            for (receiver, _), boxes in messages.waiting.items():
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
            traces.append(_Trace(held, list(told), slice(begin, len(carried)), drawn))
            if not moved:
                raise ModelError("HvacSystem", "components that do not wait for each other", f"{runner.waiting}")
        traces = traces or [_Trace([], [], slice(0, 0), len(load))]  # where nobody waits for anybody
        return self._functions(symbols, traces, {name: runner.results[name] for name in system.singles})

    def _functions(self, symbols: tuple[list[Any], ...], traces: list[_Trace], results: dict[str, Any]) -> list[_Phase]:
        """Make a function of each phase, bound to the arrays that it reads and writes."""
        (now, fixed, load, carried), phases, system = symbols, list[_Phase](), self._system
        values = _leaves(tuple(results.values()))
        first, drawn, kept = np.zeros(len(values), dtype=int), 0, slice(0)
        for k, trace in enumerate(traces):
            if fresh := load[drawn : trace.drawn] + carried[kept]:
                first[casadi.which_depends(casadi.vertcat(*values), casadi.vertcat(*fresh), 1, True)] = k
            drawn, kept = trace.drawn, trace.carried
        rows = [[*t.held, *_leaves([m for _, m in t.messages]), *(values[i] for i in np.flatnonzero(first == k))]
                for k, t in enumerate(traces)]  # fmt: skip
        ends = np.cumsum([0, *(len(row) for row in rows)])
        # what goes on is read where it was written
        seen, place = [casadi.SX.sym("any") for _ in range(ends[-1])], np.zeros(len(values), dtype=int)
        for k, trace in enumerate(traces):
            seen[ends[k] : ends[k] + len(trace.held)] = carried[trace.carried]
            place[first == k] = np.arange(ends[k + 1] - (first == k).sum(), ends[k + 1])
        loads, self._values, drawn = np.zeros(len(load)), np.zeros(ends[-1]), 0
        for row, trace, begin, end in zip(rows, traces, ends[:-1], ends[1:], strict=True):
            function: Any = casadi.Function("phase", [casadi.vertcat(*part) for part in (now, fixed, load, seen)],
                                            [casadi.densify(casadi.cse(casadi.vertcat(*row)))])  # fmt: skip
            buffer, run = function.buffer()
            for k, array in enumerate((self._now, self._set, loads, self._values)):
                buffer.set_arg(k, memoryview(array.data))
            buffer.set_res(0, memoryview(self._values[begin:end].data))
            start, places = begin + len(trace.held), count()
            messages = [(name, _reader(message, places)) for name, message in trace.messages]
            told = self._values[start : start + next(places)]
            phases.append(_Phase(_writer(loads, drawn, trace.drawn), run, told, messages, (function, buffer)))
            drawn = trace.drawn
        where = iter(place.tolist())
        self._readers: dict[str, _Read] = dict.fromkeys(system.components, tuple)
        self._readers |= {name: _reader(result, where) for name, result in results.items()}
        numbered = Results(self._readers, list(range(ends[-1])), {})
        self._state = [getattr(numbered[name], state.name) for name, state in system.states.values()]
        self._electric, self._fuel = (
            [getattr(numbered[name], port) for name in results for kind, port in system.meters[name] if kind == which]
            for which in ("electricity", "fuel")
        )
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
        system, pending = self._system, self._pending
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
            if phase.messages:
                told = phase.told.tolist()
                for name, read in phase.messages:
                    try:
                        runs[name].send(read(told))
                    except StopIteration as done:
                        results[name] = done.value
        electric, fuel = system.powers(ops, results)
        values = self._values.tolist()
        for place in self._electric:
            electric += values[place]
        for place in self._fuel:
            fuel += values[place]
        after = tuple([values[place] for place in self._state])
        return HvacStep(Results(self._readers, values, results), after, electric, fuel)

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
    messages : list of tuple
        What groups are told next.
    carried : slice
        Where symbols of `held` stand among all that goes on.
    drawn : int
        How many values groups have sent before.
    """

    held: list[Any]
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


def _reader(template: Any, places: Iterator[int]) -> _Read:
    """Make what reads a message or result, with its names, from a row of values at the next of these places."""
    make: Callable[[Any], Any] | None = getattr(type(template), "_make", None)
    if any(isinstance(value, tuple | list) for value in template):
        parts = [_reader(v, places) if isinstance(v, tuple | list) else itemgetter(next(places)) for v in template]
        return lambda values: make([part(values) for part in parts])  # type: ignore[misc]
    at = [next(places) for _ in template]
    in_a_row = at == list(range(at[0], at[0] + len(at)))
    row: _Read = itemgetter(slice(at[0], at[0] + len(at))) if in_a_row else itemgetter(*at)
    return row if make is None else lambda values: make(row(values))
