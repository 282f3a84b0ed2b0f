"""Problems in stages: states and decisions of every step are variables, as interior points like it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any, Literal, NamedTuple, get_args

import casadi as ca
import numpy as np

from mpc.control.solvers.solution import Status
from mpc.errors import ControlError
from thermal._types import FloatArray


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
    within : casadi.SX, shape (c,)
        What must not be positive in any step; nothing by default [the caller's].

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
    within: ca.SX = field(default_factory=lambda: ca.SX(0, 1))

    def __post_init__(self) -> None:
        n, m = self.state.numel(), self.decision.numel()
        found = (self.next_state.numel(), self.lower.shape, self.upper.shape)
        expected = f"{n} next states, and ranges of {m} decisions"
        ControlError.unless(found == (n, (m,), (m,)), "stage problem", expected, found)
        empty = np.flatnonzero(~(self.lower < self.upper)).tolist()
        ControlError.unless(not empty, "stage problem", "lower ends below upper ones", f"others in decisions {empty}")

    @cached_property
    def step(self) -> ca.Function:
        """Function of state, decision and parameter: next state, cost."""
        given = [self.state, self.decision, self.parameter]
        return ca.Function("step", given, [ca.densify(self.next_state), ca.densify(self.cost)])

    @cached_property
    def kept(self) -> ca.Function:
        """Function of state, decision and parameter: what must not be positive."""
        return ca.Function("kept", [self.state, self.decision, self.parameter], [ca.densify(self.within)])

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
        costs = np.array(self._along(len(decisions)).steps(states[:-1].T, decisions.T, data.parameters.T)[1])
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
        seen = np.array(self._along(len(states) - 1).ends(states.T)[1]).T
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
        followed = self._along(len(decisions)).course(data.start, decisions.T, data.parameters.T)[0]
        return np.vstack([data.start, np.array(followed).T])

    @cached_property
    def _along(self) -> Callable[[int], _Along]:
        """Functions of whole courses, by their number of steps."""
        return cache(lambda n: _Along(self.step.mapaccum("course", n), self.step.map(n), self.end.map(n + 1)))


class _Along(NamedTuple):
    """Step and end over all steps of a horizon: states one after the other, costs, and what is banded."""

    course: ca.Function
    steps: ca.Function
    ends: ca.Function


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
        ControlError.unless(found == (wanted,) * 3, "stage data", f"bands and prices of shape {wanted}", found)


#: Interior points that solve problems in stages.
StageMethod = Literal["fatrop", "ipopt"]

# a small barrier, as the first guess is a plan that was optimal a step ago; nearer to the bounds takes more iterations
_NEAR = {"mu_init": 3e-4, "bound_push": 1e-2, "bound_frac": 1e-2}
_QUIET: dict[str, dict[str, object]] = {
    "fatrop": {"fatrop.print_level": 0},
    "ipopt": {"ipopt.print_level": 0, "ipopt.sb": "yes"},
}


@dataclass(frozen=True, eq=False)
class StageSolution:
    """Outcome of a solve in stages.

    Parameters
    ----------
    states : ndarray, shape (N + 1, n)
        At the edges of the steps [as the state].
    decisions : ndarray, shape (N, m)
        Of the steps [as the decisions].
    cost : float
        Bands at their price included [currency].
    status : Status
        How the solve ended.
    message : str
        The solver's own word.
    iterations : int
        Of the solver.
    seconds : float
        Wall time [s].
    solver : str
        Which one.
    """

    states: FloatArray
    decisions: FloatArray
    cost: float
    status: Status
    message: str
    iterations: int
    seconds: float
    solver: str

    def shifted(self) -> tuple[FloatArray, FloatArray]:
        """States and decisions a step later, the last ones held: where the next solve begins."""
        return np.vstack([self.states[1:], self.states[-1:]]), np.vstack([self.decisions[1:], self.decisions[-1:]])


@dataclass(eq=False)
class StageSolver:
    """An interior point on a problem in stages, built once for a horizon.

    Parameters
    ----------
    problem : StageProblem
        What is solved.
    n_steps : int
        N.
    method : str
        ``fatrop`` factorises stage by stage (Vanroye, Sathya, De Schutter and Decré 2023,
        doi:10.1109/IROS55552.2023.10342336), ``ipopt`` the whole with a general sparse solver.
    tolerance : float
        Of the optimality conditions [-].
    iterations : int
        Most of them.

    Raises
    ------
    ControlError
        When the method is not known.

    Notes
    -----
    Bands are soft: one slack a band and edge, at the price of `StageData`. Hessians are exact. All functions are
    expanded to scalar operations, which halves the time of their evaluation. Holding decisions over several steps does
    not pay here: it makes fewer stages, but their Hessians dense.
    """

    problem: StageProblem
    n_steps: int
    method: StageMethod = "fatrop"
    tolerance: float = 1e-4
    iterations: int = 300

    def __post_init__(self) -> None:
        ControlError.unless_known(self.method, get_args(StageMethod), "stage solver: method", "an interior point")
        self._sizes = self.problem.state.numel(), self.problem.decision.numel(), self.problem.banded.numel()
        self._solver = self._build()

    def _build(self) -> Any:
        (n, m, b), count, problem = self._sizes, self.n_steps, self.problem
        c = problem.within.numel()
        x = [ca.MX.sym(f"x_{k}", n) for k in range(count + 1)]
        u = [ca.MX.sym(f"u_{k}", m) for k in range(count)]
        slack = [ca.MX.sym(f"s_{k}", b) for k in range(count + 1)]
        start, p = ca.MX.sym("start", n), ca.MX.sym("p", problem.parameter.numel(), count)
        price = ca.MX.sym("price", b, count + 1)
        cost, variables = ca.MX(0), []
        rows: list[ca.MX] = []
        equal: list[bool] = []
        for k in range(count + 1):
            end_cost, banded = problem.end(x[k])
            variables += [x[k], u[k], slack[k]] if k < count else [x[k], slack[k]]
            cost += ca.dot(price[:, k], slack[k])
            if k < count:
                following, added = problem.step(x[k], u[k], p[:, k])
                cost, rows, equal = cost + added, [*rows, x[k + 1] - following], equal + [True] * n
            else:
                cost += end_cost
            if k == 0:  # dynamics come first in a stage, then what holds within it
                rows, equal = [*rows, x[0] - start], equal + [True] * n
            rows, equal = [*rows, banded + slack[k], banded - slack[k]], equal + [False] * (2 * b)
            if k < count and c:
                rows, equal = [*rows, problem.kept(x[k], u[k], p[:, k])], equal + [False] * c
        nlp = {"x": ca.vertcat(*variables), "p": ca.vertcat(start, ca.vec(p), ca.vec(price)), "f": cost,
               "g": ca.vertcat(*rows)}  # fmt: skip
        options: dict[str, Any] = {"print_time": False, "expand": True, **_QUIET[self.method]}
        options |= {f"{self.method}.{name}": value for name, value in _NEAR.items()}
        options |= {f"{self.method}.tol": self.tolerance, f"{self.method}.max_iter": self.iterations}
        if self.method == "fatrop":
            options |= {"structure_detection": "auto", "equality": equal}
        return ca.nlpsol("stages", self.method, nlp, options)

    def _limits(self, data: StageData) -> Mapping[str, FloatArray]:
        (n, m, b), count = self._sizes, self.n_steps
        free = np.full((count + 1, n), np.inf)
        lower, upper = (np.broadcast_to(ends, (count + 1, m)) for ends in (self.problem.lower, self.problem.upper))
        slack, open_band = np.zeros((count + 1, b)), np.full((count + 1, b), np.inf)
        # rows of a stage: next state, bands from below and above, what is kept within; first of all the start, last
        # bands alone
        zeros, kept = np.zeros((count + 1, n)), np.zeros((count + 1, self.problem.within.numel()))
        least = np.hstack([zeros, data.lower, -open_band, kept - np.inf])
        most = np.hstack([zeros, open_band, data.upper, kept])
        return {
            "lbx": _packed(np.hstack([-free, lower, slack]), n, m),
            "ubx": _packed(np.hstack([free, upper, open_band]), n, m),
            "lbg": np.concatenate([least[0, :n], least[:-1].ravel(), least[-1, n : n + 2 * b]]),
            "ubg": np.concatenate([most[0, :n], most[:-1].ravel(), most[-1, n : n + 2 * b]]),
        }

    def solve(self, data: StageData, states: FloatArray, decisions: FloatArray) -> StageSolution:
        """Solve for one horizon.

        Parameters
        ----------
        data : StageData
            Its parameters.
        states : ndarray, shape (N + 1, n)
            Where to start [as the state]; of `StageProblem.follow` or `StageSolution.shifted`.
        decisions : ndarray, shape (N, m)
            Where to start [as the decisions].

        Raises
        ------
        ControlError
            When the data are of another number of steps.
        """
        steps = len(data.parameters)
        ControlError.unless(steps == self.n_steps, "stage data", f"{self.n_steps} steps", steps)
        (n, m, b), count, begin = self._sizes, self.n_steps, time.perf_counter()
        guess = np.zeros((count + 1, n + m + b))
        guess[:, :n], guess[:-1, n : n + m] = states, np.clip(decisions, self.problem.lower, self.problem.upper)
        guess[:, n + m :] = self.problem.outside(data, states)
        given = np.concatenate([data.start, data.parameters.ravel(), data.price.ravel()])
        try:
            values = np.array(self._solver(x0=_packed(guess, n, m), p=given, **self._limits(data))["x"]).ravel()
        except RuntimeError as error:
            values, word, status, steps = _packed(guess, n, m), str(error), Status.FAILED, 0
        else:
            stats = self._solver.stats()
            word, steps = str(stats["return_status"]), int(stats.get("iter_count", 0))
            status = Status.of(word, bool(stats["success"]))
        whole = np.insert(values, values.size - b, np.zeros(m)).reshape(count + 1, -1)
        plan = whole[:-1, n : n + m]
        followed = self.problem.follow(data, plan)
        cost = self.problem.cost_along(data, followed, plan) if np.isfinite(followed).all() else np.inf
        status = status if np.isfinite(cost) else Status.FAILED
        return StageSolution(followed, plan, cost, status, word, steps, time.perf_counter() - begin, self.method)


def _packed(whole: FloatArray, n: int, m: int) -> FloatArray:
    """Flatten by stages; the last stage has no decisions."""
    return np.concatenate([whole[:-1].ravel(), whole[-1, :n], whole[-1, n + m :]])
