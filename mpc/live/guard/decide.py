"""Decisions of the guard: a machine whose only inputs are its rules and the recorded ticks, so that each repeats.

A tick is what the guard saw at one time, in plain types:

``mono``, ``wall``
    Its two clocks [s].
``beat``
    Monotonic time at which the controller was last heard of, or None.
``messages``
    Plans of the controller and requests of operators since the tick before, in order.
``readings``
    By point: ``value`` (None is no number), ``slots`` (values by priority that are not empty; None where the connection
    knows none) and ``error`` (empty where it could be read).
``results``
    By point: what became of the orders of the tick before; empty is well.
``ordered``
    Monotonic time at which these orders were done, or None [s]: a rate counts from there, not from the decision.
``stopping``
    Whether the guard is being ended.

A decision has ``writes`` (values by point), ``releases`` (points), ``doubts`` (why everything is given back),
``refused`` (what was asked for in vain), ``answers`` (by the nonce of a request, what is wrong with it; empty is well),
``why`` (by point that is not written to, the reason), ``held`` (what is in force) and ``modes``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mpc.live.guard.messages import check_approval, check_mode, check_plan
from mpc.live.guard.rules import GuardRules, PointRule

#: Largest relative difference between what was written and what a device says of it: single precision, twice converted.
SAME = 1e-5

#: Letters of a nonce: those of `mpc.live.operators.sign`; a stranger's may be as long as a message.
_NONCE = 32

Tick = Mapping[str, Any]


def same(a: float | None, b: float | None) -> bool:
    """Tell whether a device's value is the one that was written.

    Parameters
    ----------
    a, b : float or None
        [library's unit].
    """
    return a is not None and b is not None and abs(a - b) <= SAME * max(1.0, abs(a), abs(b))


@dataclass
class GuardState:
    """What the guard knows from the ticks before.

    Parameters
    ----------
    modes : dict of str to str
        Of each point.
    giving_back : dict of str to float or None
        Points to be released until a reading confirms it, with what was last written to each where that is known
        [library's unit].
    mono, wall : float or None
        Clocks of the tick before [s].
    plan : dict or None
        In force.
    last_plan : int
        Number of the last one that was taken [-].
    plan_since : float
        Monotonic time at which it was made, by its age when it was received [s].
    held : dict of str to float
        Values in force [library's unit].
    written : dict of str to float
        Monotonic time of the last order [s].
    orders : dict of str to float or None
        Of the tick before; None is a release [library's unit].
    overridden : dict of str to float
        Monotonic time at which an operator's command was last seen [s].
    taken : dict of str to str
        Points that another program writes to, until an operator sets their mode.
    approved : dict of str to tuple of float
        Value [library's unit] and monotonic time of its end [s].
    still : dict of str to tuple of float
        Value of an input [library's unit] and since when it has had that [s].
    nonces : set of str
        Requests that were used.
    """

    modes: dict[str, str]
    giving_back: dict[str, float | None]
    mono: float | None = None
    wall: float = 0.0
    plan: dict[str, Any] | None = None
    last_plan: int = -1
    plan_since: float = 0.0
    held: dict[str, float] = field(default_factory=dict)
    written: dict[str, float] = field(default_factory=dict)
    orders: dict[str, float | None] = field(default_factory=dict)
    overridden: dict[str, float] = field(default_factory=dict)
    taken: dict[str, str] = field(default_factory=dict)
    approved: dict[str, tuple[float, float]] = field(default_factory=dict)
    still: dict[str, tuple[float, float]] = field(default_factory=dict)
    nonces: set[str] = field(default_factory=set)

    def to_dict(self) -> dict[str, Any]:
        """Give plain types, for the log."""
        return vars(self) | {"nonces": sorted(self.nonces)}

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> GuardState:
        """Make of what `to_dict` gave.

        Parameters
        ----------
        content : mapping
            Plain types.
        """
        return cls(**{**content, "nonces": set(content["nonces"])})


class Guard:
    """Decides tick by tick.

    Parameters
    ----------
    rules : GuardRules
        What plans are held against.
    modes : mapping of str to str, optional
        Of points, in the place of the rules' own.
    held_before : mapping of str to float, optional
        What an earlier guard may have left in force, for connections without priorities [library's unit].
    """

    def __init__(
        self,
        rules: GuardRules,
        modes: Mapping[str, str] | None = None,
        held_before: Mapping[str, float] | None = None,
    ) -> None:
        self.rules = rules
        before = held_before or {}
        given = {name: rule.mode for name, rule in rules.points.items()}
        back = {name: before.get(name) for name, rule in rules.points.items() if rule.priority or name in before}
        self.state = GuardState({**given, **(modes or {})}, back)

    def decide(self, tick: Tick) -> dict[str, Any]:
        """Decide what is written and released after what was seen.

        Parameters
        ----------
        tick : mapping
            As above.

        Returns
        -------
        dict
            Plain types, as above.
        """
        state, why, refused, answers = self.state, dict[str, str](), list[str](), dict[str, str]()
        doubts = [*self._clocks(tick), *self._results(tick), *self._readings(tick, why)]
        doubts += self._messages(tick, refused, answers)
        doubts += self._freshness(tick)
        if tick["stopping"]:
            doubts.append("the guard is being ended")
        if doubts:
            state.plan, state.approved = None, {}
            state.giving_back |= state.held
            state.held = {}
        writes = {} if doubts else self._chosen(tick, why)
        releases = self._releases(tick)
        state.orders = {**writes, **dict.fromkeys(releases)}
        state.mono, state.wall = tick["mono"], tick["wall"]
        return {
            "writes": writes, "releases": releases, "doubts": doubts, "refused": refused,
            "answers": answers, "why": why,
            "held": dict(state.held), "giving_back": sorted(state.giving_back), "modes": dict(state.modes),
        }  # fmt: skip

    def _clocks(self, tick: Tick) -> list[str]:
        """Doubt both clocks where they disagree, or the guard itself where it slept."""
        state, limits = self.state, self.rules.limits
        if state.mono is None:
            return []
        passed, shown = tick["mono"] - state.mono, tick["wall"] - state.wall
        doubts = []
        if abs(shown - passed) > limits.clock_jump:
            state.last_plan = -1  # numbers of plans follow the wall clock
            doubts.append(f"the wall clock jumped by {shown - passed:+.1f} s")
        if not 0.0 <= passed <= limits.step:
            doubts.append(f"the guard did not look for {passed:.1f} s")
        return doubts

    def _results(self, tick: Tick) -> list[str]:
        """Take what became of the last orders; a write that failed may have been done."""
        state, doubts = self.state, []
        for name, value in sorted(state.orders.items()):
            error = tick["results"].get(name, "no answer")
            if value is None:
                continue  # a release is believed when a reading shows it
            if error:
                doubts.append(f"{name} refused {value:g}: {error}")
                state.held.pop(name, None)
                state.giving_back[name] = value
            elif name not in state.giving_back:
                state.held[name] = value
                state.written[name] = tick["ordered"]
        return doubts

    def _readings(self, tick: Tick, why: dict[str, str]) -> list[str]:
        """Compare what points show with what was written to them."""
        state, doubts = self.state, []
        for name, rule in self.rules.points.items():
            reading = tick["readings"].get(name) or {"value": None, "slots": None, "error": "not read"}
            concerned = name in state.held or name in state.giving_back or state.modes[name] != "shadow"
            if reading["error"]:
                if concerned:
                    doubts.append(f"{name} cannot be read: {reading['error']}")
            elif rule.priority is None:
                self._plain(name, reading["value"], rule, tick["mono"])
            else:
                self._slots(name, reading["slots"] or {}, rule.priority, tick["mono"], why)
        return doubts

    def _slots(self, name: str, slots: Mapping[str, float], priority: int, now: float, why: dict[str, str]) -> None:
        """Look for commands above ours, and for others in our own slot."""
        state, own = self.state, slots.get(str(priority))
        higher = sorted(int(slot) for slot in slots if int(slot) < priority)
        if higher:
            state.overridden[name] = now
            why[name] = f"overridden at priority {higher[0]}"
        if name in state.giving_back:
            if own is None:
                del state.giving_back[name]
        elif name in state.held:
            if own is None:  # the device started anew, or somebody cleared it
                del state.held[name]
                state.overridden[name] = now
            elif not same(own, state.held[name]):
                del state.held[name]
                state.taken[name] = f"another program writes at priority {priority}"
        elif own is not None:
            state.taken[name] = f"another program writes at priority {priority}"

    def _plain(self, name: str, value: float | None, rule: PointRule, now: float) -> None:
        """See whether a point without priorities still shows what was written."""
        state = self.state
        settling = now - state.written.get(name, -1e18) <= 2.0 * self.rules.limits.tick
        if name in state.giving_back:
            left = state.giving_back[name]
            if same(value, rule.release if isinstance(rule.release, float) else None):
                del state.giving_back[name]
            elif not same(value, left) and not settling:  # an operator's by now
                del state.giving_back[name]
                state.overridden[name] = now
        elif name in state.held and not same(value, state.held[name]) and not settling:
            del state.held[name]
            state.overridden[name] = now

    def _messages(self, tick: Tick, refused: list[str], answers: dict[str, str]) -> list[str]:
        """Take plans and requests; a plan that no sound controller makes is a doubt."""
        state, doubts = self.state, list[str]()
        for message in tick["messages"]:
            if message["kind"] == "plan":
                plan = message["plan"]
                problem, grave = check_plan(plan, self.rules, state.last_plan, tick, state.still)
                if problem:
                    refused.append(f"plan: {problem}")
                    doubts += [f"plan refused: {problem}"] if grave else []
                    continue
                state.plan, state.last_plan = plan, plan["number"]
                state.plan_since = tick["mono"] - max(tick["wall"] - plan["made"], 0.0)
            elif message["kind"] == "mode":
                problem = check_mode(message, self.rules, state.nonces, tick["wall"])
                answers.setdefault(message["nonce"][:_NONCE], problem)
                if problem:
                    refused.append(f"mode: {problem}")
                    continue
                for name in message["points"]:
                    state.modes[name] = message["mode"]
                    state.taken.pop(name, None)
                    state.approved.pop(name, None)
            else:
                problem = check_approval(message, state.plan, state.modes, state.nonces, tick["wall"])
                answers.setdefault(message["nonce"][:_NONCE], problem)
                if problem:
                    refused.append(f"approval: {problem}")
                    continue
                until = tick["mono"] + self.rules.limits.approval
                values = (state.plan or {})["values"]
                state.approved |= {name: (float(values[name]), until) for name in message["points"]}
        return doubts

    def _freshness(self, tick: Tick) -> list[str]:
        """Doubt a silent controller and an old plan."""
        state, limits, doubts = self.state, self.rules.limits, []
        silent = None if tick["beat"] is None else tick["mono"] - tick["beat"]
        if silent is None or silent > limits.heartbeat:
            told = "has not been heard of" if silent is None else f"is silent for {silent:.1f} s"
            doubts.append(f"the controller {told}")
        if state.plan is not None and tick["mono"] - state.plan_since > limits.plan_age:
            doubts.append(f"the plan is {tick['mono'] - state.plan_since:.1f} s old")
        return doubts

    def _chosen(self, tick: Tick, why: dict[str, str]) -> dict[str, float]:
        """Choose what is written, point by point, and what is given back because nothing may be."""
        state, now, writes = self.state, tick["mono"], dict[str, float]()
        for name, rule in self.rules.points.items():
            target, reason = self._target(name, now)
            reason = why.get(name, reason)
            since = now - state.overridden.get(name, -1e18)
            if not reason and since <= self.rules.limits.override_hold:
                reason = "an operator has just given it back, or cleared it"
            if name in state.giving_back:
                reason = "it is being given back"
            elif name in state.taken:
                reason = state.taken[name]
            if reason or target is None:
                why[name] = reason
                if name in state.held:
                    state.giving_back[name] = state.held.pop(name)
                continue
            value = self._slowed(name, target, rule, tick)
            if value is None:
                why[name] = "what it shows is no number, so that its rate cannot be kept"
            elif not (name in state.held and state.held[name] == value):
                writes[name] = value
                state.written[name] = now
        return writes

    def _target(self, name: str, now: float) -> tuple[float | None, str]:
        """Value that may be written to a point, or why there is none."""
        state, mode = self.state, self.state.modes[name]
        if mode == "shadow":
            return None, "shadow"
        if mode == "advise":
            value, until = state.approved.get(name, (0.0, -1e18))
            return (value, "") if now <= until else (None, "not approved")
        planned = None if state.plan is None else state.plan["values"].get(name)
        return (None, "no plan for it") if planned is None else (float(planned), "")

    def _slowed(self, name: str, target: float, rule: PointRule, tick: Tick) -> float | None:
        """Value on the way to a target that the rate allows now; None where the way has no known beginning."""
        if rule.rate == 0.0:
            return target
        state, now = self.state, tick["mono"]
        begin = state.held.get(name, tick["readings"][name]["value"])
        if begin is None:
            return None
        begin = min(max(begin, rule.lowest), rule.highest)
        passed = now - state.written[name] if name in state.held and name in state.written else self.rules.limits.tick
        most = rule.rate * max(passed, 0.0) / 3600.0
        return float(min(max(target, begin - most), begin + most))

    def _releases(self, tick: Tick) -> list[str]:
        """Points to give back now: all that are not confirmed, and that nobody else has set."""
        state, now = self.state, tick["mono"]
        for name in state.giving_back:
            state.written[name] = now
        return sorted(state.giving_back)
