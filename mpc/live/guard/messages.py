"""Checks of what is sent to the guard: plans of the controller, requests of operators."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mpc.live.guard.rules import GuardRules

#: Most times of use that are remembered, so that a request is not repeated: more than operators click in a year.
_MOST_NONCES = 100_000


def check_plan(
    plan: Mapping[str, Any],
    rules: GuardRules,
    last: int,
    tick: Mapping[str, Any],
    still: dict[str, tuple[float, float]],
) -> tuple[str, bool]:
    """Say what is wrong with a plan, and whether everything is given back for it.

    Parameters
    ----------
    plan : mapping
        ``number``, ``made`` (wall clock), ``configuration``, ``status``, ``values`` by point, and ``inputs`` by
        measurement: time and value.
    rules : GuardRules
        What it is held against.
    last : int
        Number of the last plan that was taken.
    tick : mapping
        Clocks.
    still : dict of str to tuple of float
        Of each input, its value [library's unit] and since when it has had that [s]; brought up to date.

    Returns
    -------
    tuple of str and bool
        Empty where nothing is wrong.
    """
    shape = {"number": int, "made": int | float, "configuration": str, "status": str, "values": dict, "inputs": dict}
    for key, kind in shape.items():
        if not isinstance(plan.get(key), kind):
            return f"expected {key}, found {plan.get(key)!r}"[:200], True
    if plan["number"] <= last:
        return f"number {plan['number']} is not above {last}", False
    if plan["configuration"] != rules.configuration:
        found = f"{plan['configuration'][:12]}, not {rules.configuration[:12]}"
        return f"it is of the configuration {found}: start guard and controller anew", True
    age = tick["wall"] - plan["made"]
    if not -rules.limits.clock_jump <= age <= rules.limits.plan_age:
        return f"it is {age:.1f} s old", True
    if plan["status"] != "planned":
        return plan["status"][:200], True
    problem = _inputs(plan["inputs"], rules, tick, still)
    return (problem, True) if problem else (_values(plan["values"], rules), True)


def _inputs(
    inputs: Mapping[str, Any], rules: GuardRules, tick: Mapping[str, Any], still: dict[str, tuple[float, float]]
) -> str:
    """Say which measurement a plan must not rest on."""
    limits = rules.limits
    for name, (low, high) in rules.inputs.items():
        found = inputs.get(name)
        if not isinstance(found, list) or len(found) != 2 or not isinstance(found[0], int | float):
            return f"it does not say what it knew of {name}"
        time, value = found
        if not isinstance(value, int | float):
            return f"{name} is no number"
        if not low <= value <= high:
            return f"{name} is {value:g}, which is not possible"
        age = tick["wall"] - time
        if not -limits.clock_jump <= age <= limits.input_age:
            return f"{name} is {age:.1f} s old"
        before, since = still.get(name, (None, tick["mono"]))
        still[name] = (float(value), since if value == before else tick["mono"])
        if limits.stuck is not None and tick["mono"] - still[name][1] > limits.stuck:
            return f"{name} has not moved for {tick['mono'] - still[name][1]:.0f} s"
    return ""


def _values(values: Mapping[str, Any], rules: GuardRules) -> str:
    """Say which value must not be written."""
    for name, value in values.items():
        if name not in rules.points:
            return f"{name[:80]!r} is not on the white list"
        if not rules.points[name].takes(value):
            rule = rules.points[name]
            return f"{name} at {value!r}, outside of what it takes from {rule.lowest:g} to {rule.highest:g}"[:200]
    return ""


def check_mode(message: Mapping[str, Any], rules: GuardRules, nonces: set[str], wall: float) -> str:
    """Say what is wrong with a request for another mode.

    Parameters
    ----------
    message : mapping
        ``points``, ``mode``, ``nonce``, ``expires`` and ``invalid``, why its signature is none.
    rules : GuardRules
        The white list.
    nonces : set of str
        Used ones; this one is added.
    wall : float
        Wall clock [s].
    """
    problem = _request(message, nonces, wall)
    if problem:
        return problem
    if message["mode"] not in ("shadow", "advise", "act"):
        return f"{message['mode']!r} is no mode"
    unknown = [name for name in message["points"] if name not in rules.points]
    return f"{unknown[0][:80]!r} is not on the white list" if unknown else ""


def check_approval(
    message: Mapping[str, Any],
    plan: Mapping[str, Any] | None,
    modes: Mapping[str, str],
    nonces: set[str],
    wall: float,
) -> str:
    """Say what is wrong with an approval.

    Parameters
    ----------
    message : mapping
        ``plan`` (its number), ``points``, ``nonce``, ``expires`` and ``invalid``.
    plan : mapping or None
        In force.
    modes : mapping of str to str
        Of points.
    nonces : set of str
        Used ones; this one is added.
    wall : float
        Wall clock [s].
    """
    problem = _request(message, nonces, wall)
    if problem:
        return problem
    if plan is None or message["plan"] != plan["number"]:
        return f"it is of plan {message['plan']}, which is not the one in force"
    for name in message["points"]:
        if modes.get(name) != "advise":
            return f"{name[:80]!r} is not advised"
        if name not in plan["values"]:
            return f"{name} has no value in the plan"
    return ""


def _request(message: Mapping[str, Any], nonces: set[str], wall: float) -> str:
    """Say why a request of an operator is not believed; one that is, is used up."""
    if message["invalid"]:
        return str(message["invalid"])
    if message["expires"] < wall:
        return f"it expired {wall - message['expires']:.0f} s ago"
    if message["nonce"] in nonces or len(nonces) >= _MOST_NONCES:
        return "it was used before"
    nonces.add(message["nonce"])
    return ""
