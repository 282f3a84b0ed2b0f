"""The guard's decisions, one rule at a time: what it writes, what it gives back, and why."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest

from mpc.live.guard.decide import Guard
from mpc.live.guard.rules import GuardRules, Limits, PointRule

SET, VALVE, PLAIN = "ahu/supply_air_temperature_setpoint", "boiler/valve_command", "hall/zone_setpoint"
ZONE = "hall/zone_air_temperature_sensor"
LIMITS = Limits(
    step=900.0, tick=60.0, heartbeat=180.0, plan_age=1350.0, input_age=900.0, clock_jump=5.0, override_hold=900.0,
    approval=3600.0, stuck=7200.0,
)  # fmt: skip
RULES = GuardRules(
    "c" * 64, LIMITS,
    {SET: PointRule("act", 285.0, 295.0, 6.0, "relinquish", 13),
     VALVE: PointRule("act", 0.0, 1.0, 0.0, "relinquish", 13, "modulating", 0.25),
     PLAIN: PointRule("act", 290.0, 300.0, 0.0, 294.0, None)},
    {ZONE: (263.15, 323.15)},
)  # fmt: skip


class Bench:
    """A building of three points that does what it is told, and a sound controller; a test spoils one thing."""

    def __init__(self, rules: GuardRules = RULES, **guard: Any) -> None:
        self.guard = Guard(rules, **guard)
        self.now = self.wall = 1000.0
        self.wall += 1.7e9
        self.slots: dict[str, dict[str, float]] = {SET: {}, VALVE: {}}
        self.plain, self.own = 294.0, {SET: 290.0, VALVE: 0.5}
        self.errors: dict[str, str] = {}
        self.results: dict[str, str] = {}
        self.refuse: dict[str, str] = {}
        self.ordered, self.late = 1000.0, 0.0
        self.values: dict[str, Any] | None = {SET: 290.05, VALVE: 0.6, PLAIN: 295.0}
        self.change: dict[str, Any] = {}
        self.zone, self.silent, self.ticks = 293.0, False, []

    def plan(self) -> dict[str, Any]:
        self.zone += 0.01
        return {
            "number": int(10 * self.wall), "made": self.wall - 1.0, "configuration": "c" * 64, "status": "planned",
            "values": dict(self.values or {}), "inputs": {ZONE: [self.wall - 30.0, self.zone]},
        } | self.change  # fmt: skip

    def readings(self) -> dict[str, Any]:
        seen = {
            name: {"value": min(slots.items(), key=lambda s: int(s[0]))[1] if slots else self.own[name],
                   "slots": dict(slots), "error": ""}
            for name, slots in self.slots.items()
        }  # fmt: skip
        seen[PLAIN] = {"value": self.plain, "slots": None, "error": ""}
        for name, error in self.errors.items():
            seen[name] = {"value": None, "slots": None, "error": error}
        return seen

    def tick(self, plan: bool = False, passed: float = 60.0, messages: Any = (), **change: Any) -> dict[str, Any]:
        self.now, self.wall = self.now + passed, self.wall + passed
        sent = ([{"kind": "plan", "plan": self.plan()}] if plan and self.values is not None else []) + list(messages)
        tick = {
            "mono": self.now, "wall": self.wall, "beat": None if self.silent else self.now - 10.0, "messages": sent,
            "readings": self.readings(), "results": dict(self.results), "ordered": self.ordered, "stopping": False,
        } | change  # fmt: skip
        tick = json.loads(json.dumps(tick))
        decision = json.loads(json.dumps(self.guard.decide(tick)))
        self.ticks.append((copy.deepcopy(tick), decision))
        self.results, self.ordered = {}, self.now + self.late
        for name, value in {**dict.fromkeys(decision["releases"]), **decision["writes"]}.items():
            self.results[name] = self.refuse.get(name, "")
            if self.results[name]:
                continue
            if name == PLAIN:
                self.plain = 294.0 if value is None else value
            elif value is None:
                self.slots[name].pop("13", None)
            else:
                self.slots[name]["13"] = value
        return decision

    def acting(self) -> Bench:
        """Bring it to where all three points are held."""
        self.tick()
        self.tick(plan=True)
        held = self.tick()["held"]
        assert held == {SET: 290.05, VALVE: 0.6, PLAIN: 295.0}
        return self

    def ours(self) -> set[str]:
        return {n for n, s in self.slots.items() if "13" in s} | ({PLAIN} if self.plain == 295.0 else set())


def test_it_begins_with_releases_and_then_follows_the_plan() -> None:
    bench = Bench()
    bench.slots[SET]["13"] = 288.0  # of a guard that was killed
    first = bench.tick(plan=True)
    assert first["releases"] == [SET] and first["writes"] == {VALVE: 0.6, PLAIN: 295.0} and SET in first["why"]
    second = bench.tick()
    assert second["releases"] == [] and second["writes"] == {SET: 290.05} and not second["doubts"]
    assert bench.tick()["held"] == {SET: 290.05, VALVE: 0.6, PLAIN: 295.0}


def test_a_value_is_written_once_and_moves_at_its_rate() -> None:
    bench = Bench().acting()
    assert bench.tick(plan=True)["writes"] == {}
    bench.values = {SET: 294.0, VALVE: 0.6, PLAIN: 295.0}
    seen = [bench.tick(plan=True)["writes"][SET] for _ in range(5)]
    np.testing.assert_allclose(np.diff(seen), 6.0 / 60.0)  # 6 K/h, a minute a tick
    bench.late = 50.0  # a machine that stood still had its write out 50 s after the decision, 10 s before the next
    seen.append(bench.tick(plan=True)["writes"][SET])
    bench.late = 0.0
    seen += [bench.tick(plan=True)["writes"][SET] for _ in range(2)]
    np.testing.assert_allclose(np.diff(seen)[-3:], np.array([60.0, 10.0, 60.0]) * 6.0 / 3600.0)


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda b: setattr(b, "silent", True), "has not been heard of"),
        (lambda b: b.change.update(configuration="d" * 64), "of the configuration dddddddddddd"),
        (lambda b: b.change.update(status="no plan: the solver found no plan"), "the solver found no plan"),
        (lambda b: b.change.update(made=b.wall - 2000.0), "s old"),
        (lambda b: b.change.update(made=b.wall + 2000.0), "s old"),
        (lambda b: b.change.update(values="x"), "expected values"),
        (lambda b: b.values.update({SET: 400.0}), "outside of what it takes"),
        (lambda b: b.values.update({SET: None}), "outside of what it takes"),
        (lambda b: b.values.update({SET: True}), "outside of what it takes"),
        (lambda b: b.values.update({VALVE: 0.1}), "outside of what it takes"),
        (lambda b: b.values.update({"safety/valve": 1.0}), "not on the white list"),
        (lambda b: b.change.update(inputs={}), "does not say what it knew"),
        (lambda b: b.change.update(inputs={ZONE: [b.wall, None]}), "is no number"),
        (lambda b: b.change.update(inputs={ZONE: [b.wall, 999.0]}), "not possible"),
        (lambda b: b.change.update(inputs={ZONE: [b.wall - 1000.0, 293.0]}), "s old"),
        (lambda b: b.errors.update({SET: "no answer"}), "cannot be read: no answer"),
        (lambda b: b.refuse.update({SET: "write-access-denied"}) or b.values.update({SET: 290.1}), "write-access-denied"),
    ],
)  # fmt: skip
def test_a_doubt_gives_everything_back_at_once(spoil: Any, told: str) -> None:
    bench = Bench().acting()
    spoil(bench)
    decision = bench.tick(plan=True)
    if not decision["doubts"]:  # a refused write is known a tick later
        bench.refuse.clear()
        decision = bench.tick()
    assert any(told in doubt for doubt in decision["doubts"]) and decision["writes"] == {}
    assert set(decision["releases"]) == {SET, VALVE, PLAIN}
    if not bench.errors:
        assert bench.ours() == set() and bench.plain == 294.0


def test_a_plan_that_nobody_renews_ends() -> None:
    bench = Bench().acting()
    held = [len(bench.tick()["held"]) for _ in range(30)]
    # taken two ticks before the first of these, 1 s old then: 60 (k + 2) + 1 s is above 1,350 s from k = 21 on
    assert held.index(0) == 21 and set(held[21:]) == {0} and bench.ours() == set()


def test_a_stuck_sensor_is_seen_and_a_slow_one_is_not() -> None:
    bench = Bench().acting()
    bench.change = {"inputs": {ZONE: [bench.wall, 293.0]}}
    decisions = []
    for _ in range(130):
        bench.change["inputs"][ZONE][0] = bench.wall
        decisions.append(bench.tick(plan=True))
    first = next(k for k, d in enumerate(decisions) if d["doubts"])
    assert first == 121 and "has not moved for 7260 s" in decisions[first]["doubts"][0]
    bench.change = {}
    assert not bench.tick(plan=True)["doubts"]


def test_clocks_that_disagree_are_a_doubt_until_the_next_plan() -> None:
    for shift in (-3600.0, 30.0, 1e6):
        bench = Bench().acting()
        bench.wall += shift
        decision = bench.tick(plan=True)
        assert "the wall clock jumped" in decision["doubts"][0] and not bench.ours()
        assert not bench.tick()["writes"]
        assert bench.tick(plan=True)["writes"]
    bench = Bench().acting()
    decision = bench.tick(passed=1000.0)  # the machine slept
    assert "did not look for 1000.0 s" in decision["doubts"][0] and not bench.ours()


def test_an_operator_is_never_fought() -> None:
    bench = Bench().acting()
    bench.slots[SET]["8"] = 287.0
    decision = bench.tick(plan=True)
    assert decision["why"][SET] == "overridden at priority 8" and not decision["doubts"]
    assert decision["releases"] == [SET] and bench.slots[SET] == {"8": 287.0}
    assert decision["held"].keys() == {VALVE, PLAIN}
    bench.values = {SET: 290.05, VALVE: 0.6, PLAIN: 295.0}
    for _ in range(20):
        assert SET not in bench.tick(plan=True)["writes"] and bench.slots[SET] == {"8": 287.0}
    del bench.slots[SET]["8"]
    writes = [SET in bench.tick(plan=True)["writes"] for _ in range(20)]
    assert writes.index(True) == 15  # of 60 s: a control step after it was given back


def test_an_operator_without_priorities_is_not_fought_either() -> None:
    bench = Bench().acting()
    for _ in range(3):
        bench.tick()
    bench.plain = 291.0
    decision = bench.tick(plan=True)
    assert PLAIN not in decision["held"] and PLAIN not in decision["releases"] and bench.plain == 291.0
    bench.silent = True
    bench.tick()
    assert bench.plain == 291.0  # not even the release value
    restarted = Bench(held_before={PLAIN: 295.0})
    restarted.plain = 291.0
    restarted.tick()
    assert restarted.plain == 291.0
    restarted = Bench(held_before={PLAIN: 295.0})
    restarted.plain = 295.0
    assert restarted.tick()["releases"] == [PLAIN] or restarted.plain == 294.0


def test_another_program_in_our_slot_keeps_it() -> None:
    bench = Bench().acting()
    bench.slots[SET]["13"] = 286.0
    decision = bench.tick(plan=True)
    assert "another program" in decision["why"][SET] and bench.slots[SET] == {"13": 286.0}
    request = {"kind": "mode", "points": [SET], "mode": "act", "nonce": "1", "expires": bench.wall + 100, "by": "x",
               "invalid": ""}  # fmt: skip
    del bench.slots[SET]["13"]
    assert SET in bench.tick(plan=True, messages=[request])["writes"]


def test_modes_and_approvals() -> None:
    bench = Bench(modes={SET: "advise", VALVE: "shadow"})
    bench.tick()
    number = bench.tick(plan=True) and bench.guard.state.last_plan
    assert bench.tick()["why"] == {SET: "not approved", VALVE: "shadow"} and bench.ours() == {PLAIN}
    ask = {"kind": "approve", "points": [SET], "plan": number, "nonce": "a", "expires": bench.wall + 1e6, "by": "x",
           "invalid": ""}  # fmt: skip
    for change, told in (
        ({"invalid": "its signature is not an operator's"}, "signature"), ({"expires": bench.wall - 1.0}, "expired"),
        ({"plan": number - 1}, "not the one in force"), ({"points": [VALVE], "nonce": "b"}, "not advised"),
        ({"points": ["x"], "nonce": "c"}, "not advised"),
    ):  # fmt: skip
        decision = bench.tick(messages=[ask | {"nonce": str(change)} | change])
        assert told in decision["refused"][0] and bench.ours() == {PLAIN}
    decision = bench.tick(messages=[ask, ask])
    assert decision["writes"] == {SET: 290.05} and decision["answers"] == {"a": ""}  # the first is the answer
    assert "used before" in bench.tick(messages=[ask])["answers"]["a"]
    for _ in range(70):
        bench.tick(plan=True)
    assert bench.ours() == {PLAIN}  # an hour is over
    off = {"kind": "mode", "points": [PLAIN], "mode": "shadow", "nonce": "d", "expires": bench.wall + 1e6, "by": "x",
           "invalid": ""}  # fmt: skip
    assert bench.tick(messages=[off])["releases"] == [PLAIN] and bench.ours() == set()
    assert "no mode" in bench.tick(messages=[off | {"nonce": "e", "mode": "on"}])["refused"][0]


def test_a_plan_that_is_sent_again_is_refused_and_hurts_nothing() -> None:
    bench = Bench().acting()
    plan = {"kind": "plan", "plan": bench.plan()}
    bench.tick(messages=[plan])
    decision = bench.tick(messages=[plan, plan])
    assert len(decision["refused"]) == 2 and not decision["doubts"] and len(bench.ours()) == 3


def test_the_end_gives_everything_back() -> None:
    bench = Bench().acting()
    assert set(bench.tick(stopping=True)["releases"]) == {SET, VALVE, PLAIN} and not bench.ours()
    assert bench.tick(stopping=True)["giving_back"] == []


def test_decisions_repeat_from_rules_and_ticks_alone() -> None:
    rng = np.random.default_rng(0)
    bench = Bench()
    for _ in range(400):  # whatever comes, nothing outside of list, range and rate is written, and all repeats
        bench.silent = rng.random() < 0.05
        bench.change = {"status": "x"} if rng.random() < 0.05 else {}
        bench.values = {SET: float(rng.uniform(284.5, 295.5)), VALVE: float(rng.choice([0.0, 0.3, 1.0])), PLAIN: 295.0}
        bench.wall += float(rng.choice([0.0, 900.0], p=[0.95, 0.05]))
        for name in (SET, VALVE):
            if rng.random() < 0.05:
                bench.slots[name]["8"] = 1.0
            elif rng.random() < 0.3:
                bench.slots[name].pop("8", None)
        bench.errors = {VALVE: "no answer"} if rng.random() < 0.05 else {}
        bench.refuse = {SET: "denied"} if rng.random() < 0.05 else {}
        decision = bench.tick(plan=rng.random() < 0.7)
        assert all(RULES.points[name].takes(value) for name, value in decision["writes"].items())
        assert not (decision["doubts"] and decision["writes"]) and not set(decision["writes"]) & set(decision["releases"])
    again = Guard(GuardRules.from_dict(json.loads(json.dumps(RULES.to_dict()))))
    for tick, decision in bench.ticks:
        assert json.loads(json.dumps(again.decide(tick))) == decision
    written = [d["writes"][SET] for _, d in bench.ticks if SET in d["writes"]]
    assert len(written) > 50
