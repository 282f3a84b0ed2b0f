"""What the rule would do from here, by the same model: the comparison that a plan's saving is told by."""

from __future__ import annotations

import numpy as np

from calibration.estimation.state_space import REFERENCE
from mpc.baselines.plants import DIFFERENCE, LEAD
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.beyond import bought
from mpc.control.identified.problem import IdentifiedProblem
from mpc.control.rule_estimate import RuleEstimate
from mpc.identify.air_handler import running
from mpc.scenario.rates import KILOWATT_HOUR
from thermal._types import FloatArray

#: Times that the loads of boxes on one air handler are sized: more of them is more cold air.
_SIZED = 4


def estimate_rule(
    problem: IdentifiedProblem, ahead: Ahead, parameters: FloatArray, planned: tuple[FloatArray, FloatArray],
    most: FloatArray, on: FloatArray, water: FloatArray | None = None,
) -> RuleEstimate:  # fmt: skip
    """Let the rule of `mpc.baselines.plants.FullSpeed` run on the model from where a plan begins, and compare.

    Parameters
    ----------
    problem : IdentifiedProblem
        Of the model.
    ahead : Ahead
        Of the horizon.
    parameters : ndarray, shape (N, l)
        Of `IdentifiedProblem.data`, with ends from 0 to 1 [as the problem has them].
    planned : tuple of ndarray, shape (N + 1, n) and (N, m)
        States [K less the reference] and levels [-] of the plan.
    most : ndarray, shape (N, m)
        Largest levels [-].
    on : ndarray of bool, shape (m,)
        Machines that run now [-].
    water : ndarray, shape (N,), optional
        Supply water of the plan where it is decided; the rule has that of the plant itself [K].

    Returns
    -------
    RuleEstimate
        By the model alone: its errors are those of both costs.
    """
    states, levels = planned
    by_rule = _rule(problem, ahead, parameters, (states[0], most, on))
    cost, heat = _bought(problem, ahead, *by_rule, running(ahead.running, by_rule[1], most))
    left = problem.model.sign * float(problem.model.box.capacity @ (states[-1] - by_rule[0][-1]))
    stored = left * cost / heat if heat > 0.0 else 0.0
    of_plan = _bought(problem, ahead, states, levels, problem.running(ahead.running, levels), water)
    return RuleEstimate(of_plan[0], cost, stored)


def _rule(
    problem: IdentifiedProblem, ahead: Ahead, parameters: FloatArray, start: tuple[FloatArray, FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """States and levels of the rule, by the matrices of the model: symbols would take most of a controller's time."""
    model, zones, count, served = problem.model, problem.model.box.zones, len(ahead.outdoor), problem.model.box.serves
    (transition, drive), m = problem.matrices, len(model.maps)
    first = 1 + len(model.box.suns)  # of the inputs: outdoor air, suns, heat of the machines, gains
    heated, others = drive[:, first : first + m], np.delete(drive, np.s_[first : first + m], axis=1)
    blown = others[:, 1 + len(model.box.suns) :]  # what an air handler gives or takes is a gain
    exogenous = np.column_stack([parameters[:, :1] - REFERENCE, parameters[:, 1 : first + len(zones)]]) @ others.T
    near, shares, sign = max(round(LEAD / model.step), 1), model.shares, model.sign
    kept = ahead.edges(sign)[0] - REFERENCE  # mirrored where machines cool, as are what they add and what is left
    state, most, runs = start[0], start[1], start[2].astype(bool).copy()
    states, levels = np.empty((count + 1, state.size)), np.zeros((count, len(served)))
    states[0] = state
    led = np.array([found.operation == "setpoint" for found in model.maps], dtype=bool)
    idle, full = np.array([found.above for found in model.maps]).reshape(m, 2).T
    # kelvins of a machine's own zones at the end of a step for a watt
    by_watt = np.array([heated[: len(zones)][mine, k].mean() for k, mine in enumerate(served)])
    for n in range(count):
        edges = kept[n : n + near].max(axis=0)
        edge = np.array([edges[mine].max() for mine in served])
        free, emitter = transition @ state + exogenous[n], model.box.emitter(state)
        for k in np.flatnonzero(~led):
            above = float(state[: len(zones)][served[k]].min()) - edge[k]
            runs[k] = above < 0.0 or (runs[k] and above <= DIFFERENCE)
            levels[n, k] = most[n, k] * runs[k]
        most_heat = np.array([problem.heat(k, 1.0, ahead.outdoor[n], emitter[k]) for k in range(m)])
        rise = sign * by_watt * most_heat + full - idle
        for _ in range(1 if model.air_handler is None else _SIZED):  # an air handler runs for what boxes ask for
            rest = free + blown @ model.lost(state, float(running(ahead.running[n], levels[n], most[n])))
            missing = edge - idle - sign * model.air(rest[: len(zones)])
            asked = np.clip(np.divide(missing, rise, out=np.zeros(m), where=rise > 0.0), 0.0, most[n])
            levels[n, led] = asked[led]
        shared = float(shares @ levels[n])
        if shared > ahead.together[n]:
            levels[n, shares > 0.0] *= ahead.together[n] / shared
        heat = [problem.heat(k, levels[n, k], ahead.outdoor[n], emitter[k]) for k in range(m)]
        lost = model.lost(state, float(running(ahead.running[n], levels[n], most[n])))
        state = free + blown @ lost + heated @ np.array(heat)
        states[n + 1] = state
    return states, levels


def _bought(
    problem: IdentifiedProblem, ahead: Ahead, states: FloatArray, levels: FloatArray, runs: FloatArray,
    water: FloatArray | None = None,
) -> tuple[float, float]:  # fmt: skip
    """Cost [currency] and heat [J] of levels along states, as an air handler runs; what is taken by cooling."""
    model = problem.model
    powers = bought(model, ahead.beyond, states[:-1], levels, ahead.outdoor, water).sum(axis=1)
    powers = powers + model.bought_anyway(runs)
    heat = model.box.delivered(model.heat(states[:-1], levels, ahead.outdoor), ahead.outdoor)
    cost = float((powers * ahead.prices).sum()) * model.step / KILOWATT_HOUR
    return cost, model.sign * float(heat.sum()) * model.step
