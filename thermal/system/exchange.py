"""Runs the functions of components that wait for each other, until each has given its result."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import GeneratorType
from typing import Any

from thermal.components.air_handler import AirHandler
from thermal.components.component import Calls, Conditions, Given
from thermal.components.operations import Operations, Value
from thermal.errors import ModelError
from thermal.system.connections import find_partners
from thermal.system.step import HvacStep
from thermal.system.system import HvacSystem


class PortMessages:
    """Carries messages through ports: what is drawn is added up at suppliers, what is supplied goes to all who draw.

    Parameters
    ----------
    system : HvacSystem
        Components and connections.
    """

    def __init__(self, system: HvacSystem) -> None:
        self._to = find_partners(system.components, system.connections)
        self._each = {(name, p.name) for name, c in system.components.items() for p in c.ports if p.shape == "each"}
        #: Messages on their way, by receiver and port, and by sender.
        self.waiting = {port: {name: deque[Any]() for name, _ in others} for port, others in self._to.items()}

    def put(self, sender: str, port: str, message: Any) -> None:
        """Send a message; that of a group with several suppliers has a value for each of them in its fields.

        Parameters
        ----------
        sender, port : str
            Component, and its port.
        message : named tuple
            The message.
        """
        each = (sender, port) in self._each
        for k, receiver in enumerate(self._to.get((sender, port), ())):
            part = type(message)(*(values[k] for values in message)) if each else message
            self.waiting[receiver][sender].append(part)

    def take(self, receiver: str, port: str) -> Any:
        """Take a message out, or None as long as one of its parts is missing.

        Parameters
        ----------
        receiver, port : str
            Component, and its port.
        """
        boxes = self.waiting.get((receiver, port))
        if boxes is None:
            raise ModelError(f"{receiver}: port {port!r}", "one that it declares", "none", "see `ports`")
        if not all(boxes.values()):
            return None
        parts = [box.popleft() for box in boxes.values()]
        if (receiver, port) in self._each:
            return type(parts[0])(*zip(*parts, strict=True))
        return parts[0] if len(parts) == 1 else type(parts[0])(*(sum(values) for values in zip(*parts, strict=True)))


class Runner:
    """Runs functions of components as far as they come.

    Parameters
    ----------
    messages : PortMessages
        Brings the messages.
    runs : mapping of str to generator
        Functions, by component; the result itself of one that waits for nobody.
    on_take : callable, optional
        Gives what is handed over, of component and message; the message itself by default.
    """

    def __init__(
        self,
        messages: PortMessages,
        runs: Mapping[str, Any],
        on_take: Callable[[str, Any], Any] = lambda name, message: message,
    ) -> None:
        self._messages, self._on_take = messages, on_take
        self._runs = {name: run for name, run in runs.items() if isinstance(run, GeneratorType)}
        self._wants: dict[str, str | None] = dict.fromkeys(self._runs)
        self.results = {name: run for name, run in runs.items() if name not in self._runs}

    @property
    def waiting(self) -> dict[str, str]:
        """Components that wait, each with its port."""
        return {name: str(port) for name, port in self._wants.items()}

    def advance(self, names: Iterable[str]) -> bool:
        """Run some components until all of them wait or are done.

        Parameters
        ----------
        names : iterable of str
            The components.

        Returns
        -------
        bool
            Whether any went on.
        """
        moved, again = False, True
        names = list(names)
        while again:
            again = False
            for name in (n for n in names if n in self._wants):
                while (port := self._wants[name]) is None or (message := self._messages.take(name, port)) is not None:
                    moved = again = True
                    told = None if port is None else self._on_take(name, message)
                    try:
                        self._wants[name] = self._runs[name].send(told)
                    except StopIteration as done:
                        self.results[name] = done.value
                        del self._wants[name]
                        break
        return moved


def givens(
    system: HvacSystem, calls: Calls, conditions: Conditions, actions: Mapping[str, Value], state: Sequence[Value],
    seconds: Value, put: Callable[[str], Callable[[str, Any], None]],
) -> dict[str, Given]:  # fmt: skip
    """Lay out what each component is given.

    Parameters
    ----------
    system : HvacSystem
        The system.
    calls : Calls
        Of the thermostats.
    conditions : Conditions
        Of the step.
    actions : mapping of str to Value
        By ``ENTITY/point``; defaults for what is missing [unit of the actuator].
    state : sequence of Value
        In the order of `HvacSystem.states` [unit of the state].
    seconds : Value
        Length of the step [s].
    put : callable
        Gives the `Given.put` of a component.
    """
    chosen, humid, found = {**system.defaults, **actions}, conditions.return_humidity, {}
    handlers, states = list(system.of_kind(AirHandler)), list(zip(system.states.values(), state, strict=True))
    for name, component in system.components.items():
        own = conditions
        if name in handlers and isinstance(humid, tuple | list):
            own = conditions._replace(return_humidity=humid[handlers.index(name)])
        mine = {} if name in system.groups else {a.point: chosen[f"{name}/{a.point}"] for a in component.actuators}
        before = {s.name: value for (owner, s), value in states if owner == name}
        found[name] = Given(own, calls, mine, before, seconds, put(name))
    return found


def advance(
    ops: Operations, system: HvacSystem, state: Sequence[Value], calls: Calls, conditions: Conditions,
    actions: Mapping[str, Value], seconds: Value,
) -> HvacStep:  # fmt: skip
    """Take a system through a step: the equations of its components as they stand.

    Parameters
    ----------
    ops : Operations
        Arithmetic.
    system : HvacSystem
        The system.
    state : sequence of Value
        In the order of `HvacSystem.states` [unit of the state].
    calls : Calls
        Of the thermostats.
    conditions : Conditions
        Of the step.
    actions : mapping of str to Value
        By ``ENTITY/point`` [unit of the actuator].
    seconds : Value
        Length of the step [s].

    Raises
    ------
    ModelError
        When components wait for each other for ever.

    Notes
    -----
    Valves are set for the warmest water that the step can bring, so that no discharge temperature passes its limit.
    With these the loop's balance is linear in the water's temperature at the end of the step and is solved exactly.
    While the water is colder than that - a boiler at its capacity, a setpoint that falls - coils give a little less
    than their valves could let them.
    """
    messages = PortMessages(system)
    given = givens(
        system, calls, conditions, actions, state, seconds, lambda name: lambda port, m: messages.put(name, port, m)
    )
    runs = {n: c.run(ops.of(n) if n in system.groups else ops.scalar, given[n]) for n, c in system.components.items()}
    runner = Runner(messages, runs)
    runner.advance(system.components)
    if runner.waiting:
        raise ModelError("HvacSystem", "components that do not wait for each other", f"{runner.waiting}")
    results = {name: runner.results[name] for name in system.components}
    end = tuple([getattr(results[name], s.name) for name, s in system.states.values()])
    return HvacStep(results, end, *system.powers(ops, results))
