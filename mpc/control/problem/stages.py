"""Problems in stages: cost and dynamics of a step, and what changes from solve to solve."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from mpc.errors import ControlError
from thermal._types import FloatArray
from thermal.errors import describe


@dataclass(frozen=True, eq=False)
class StageProblem:
    """Cost and dynamics of a step, the same for every step of a horizon but for its parameters.

    Parameters
    ----------
    state, decision, parameter : casadi.SX, shape (n,), (m,), (l,)
        Symbols of a step; decisions are best counted in units that make them of order 1 [the caller's].
    next_state : casadi.SX, shape (n,)
        State at the end of the step [as the state].
    cost : casadi.SX
        Of the step [currency].
    end_cost : casadi.SX
        Of the state at the end of the horizon, by ``state`` alone [currency].
    banded : casadi.SX, shape (b,)
        What should stay within a band at the edges of the steps, by ``state`` alone [K].
    lower, upper : ndarray, shape (m,)
        Ranges of the decisions [as the decisions].

    Raises
    ------
    ControlError
        When shapes do not fit, or a range is empty.
    """

    state: ca.SX
    decision: ca.SX
    parameter: ca.SX
    next_state: ca.SX
    cost: ca.SX
    end_cost: ca.SX
    banded: ca.SX
    lower: FloatArray
    upper: FloatArray

    def __post_init__(self) -> None:
        n, m = self.state.numel(), self.decision.numel()
        found = (self.next_state.numel(), self.lower.shape, self.upper.shape)
        if found != (n, (m,), (m,)):
            expected = f"{n} next states, and ranges of {m} decisions"
            raise ControlError(describe("stage problem", expected, f"{found[0]}, {found[1]} and {found[2]}"))
        if not (self.lower < self.upper).all():
            empty = np.flatnonzero(~(self.lower < self.upper)).tolist()
            raise ControlError(describe("stage problem", "lower ends below upper ones", f"others in decisions {empty}"))

    @cached_property
    def step(self) -> ca.Function:
        """Function of state, decision and parameter: next state, cost."""
        given = [self.state, self.decision, self.parameter]
        return ca.Function("step", given, [ca.densify(self.next_state), ca.densify(self.cost)])

    @cached_property
    def end(self) -> ca.Function:
        """Function of a state: cost at the end, what is banded."""
        return ca.Function("end", [self.state], [ca.densify(self.end_cost), ca.densify(self.banded)])

    def cost_along(self, data: StageData, states: FloatArray, decisions: FloatArray) -> float:
        """Cost of decisions along states, bands at their price [currency].

        Parameters
        ----------
        data : StageData
            Of the horizon.
        states : ndarray, shape (N + 1, n)
            That the decisions lead to, see `follow` [as the state].
        decisions : ndarray, shape (N, m)
            Of the steps [as the decisions].
        """
        costs = np.array(self._mapped(len(decisions))[0](states[:-1].T, decisions.T, data.parameters.T)[1])
        outside = data.price * self.outside(data, states)
        return float(costs.sum() + outside.sum()) + float(self.end(states[-1])[0])

    def outside(self, data: StageData, states: FloatArray) -> FloatArray:
        """How far what is banded lies outside, shape (N + 1, b) [K].

        Parameters
        ----------
        data : StageData
            Of the horizon.
        states : ndarray, shape (N + 1, n)
            At the edges of the steps [as the state].
        """
        seen = np.array(self._mapped(len(states) - 1)[1](states.T)[1]).T
        return np.maximum(0.0, np.maximum(data.lower - seen, seen - data.upper))

    def follow(self, data: StageData, decisions: FloatArray) -> FloatArray:
        """States that decisions lead to, shape (N + 1, n) [as the state].

        Parameters
        ----------
        data : StageData
            Of the horizon.
        decisions : ndarray, shape (N, m)
            Of the steps [as the decisions].
        """
        count = len(decisions)
        if count not in self._courses:
            self._courses[count] = self.step.mapaccum("course", count)
        followed = self._courses[count](data.start, decisions.T, data.parameters.T)[0]
        return np.vstack([data.start, np.array(followed).T])

    @cached_property
    def _courses(self) -> dict[int, ca.Function]:
        return {}

    @cached_property
    def _costs(self) -> dict[int, tuple[ca.Function, ca.Function]]:
        return {}

    def _mapped(self, count: int) -> tuple[ca.Function, ca.Function]:
        """Step and end over all steps of a horizon, made once."""
        if count not in self._costs:
            self._costs[count] = self.step.map(count), self.end.map(count + 1)
        return self._costs[count]


@dataclass(frozen=True, eq=False)
class StageData:
    """Everything about a horizon in stages that changes from solve to solve.

    Parameters
    ----------
    start : ndarray, shape (n,)
        State now [as the state].
    parameters : ndarray, shape (N, l)
        Of the steps [the caller's].
    lower, upper : ndarray, shape (N + 1, b)
        Bands at the edges of the steps [K]; infinite where there is none.
    price : ndarray, shape (N + 1, b)
        Of a kelvin outside of the band, over the time that the edge stands for [currency/K].

    Raises
    ------
    ControlError
        When shapes do not fit.
    """

    start: FloatArray
    parameters: FloatArray
    lower: FloatArray
    upper: FloatArray
    price: FloatArray

    def __post_init__(self) -> None:
        wanted = (len(self.parameters) + 1, self.lower.shape[-1])
        found = self.lower.shape, self.upper.shape, self.price.shape
        if any(shape != wanted for shape in found):
            raise ControlError(describe("stage data", f"bands and prices of shape {wanted}", f"{found}"))
