"""Plans by trial: the cross-entropy method, for predictions that have no derivatives."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import ControlProblem, CostTerms
from mpc.control.solvers.solution import Solution, Solver, Status
from mpc.errors import ControlError
from thermal._types import FloatArray

#: Costs of many plans: of data and decisions in shares, shape (n, D), the terms of `CostTerms`, shape (n, n_term).
Trials = Callable[[HorizonData, FloatArray], FloatArray]


@dataclass(frozen=True)
class CrossEntropy:
    """The cross-entropy method for decisions from 0 to 1 (Rubinstein 1999, doi:10.1023/A:1010091220143).

    Normal samples; the best of them give the next mean and deviation. The first sample of a round is its mean, and the
    best of all rounds is the result, so that it never costs more than what it started from.

    Parameters
    ----------
    samples : int
        Of a round.
    rounds : int
        At most.
    elite : float
        Share of the samples that the next mean and deviation are taken of [-].
    deviation : float
        Of the first round [-].
    smoothing : float
        Share of the new mean and deviation beside the old ones [-], against narrowing too soon.
    tolerance : float
        Rounds end when two in a row bring less than this share of the cost each [-].

    Raises
    ------
    ControlError
        When a number is out of its range.
    """

    samples: int = 128
    rounds: int = 5
    elite: float = 0.1
    deviation: float = 0.2
    smoothing: float = 0.8
    tolerance: float = 1e-3

    def __post_init__(self) -> None:
        whole = self.samples >= 4 and self.rounds >= 1 and 0.0 < self.elite <= 0.5
        shares = 0.0 < self.deviation <= 1.0 and 0.0 < self.smoothing <= 1.0 and self.tolerance >= 0.0
        expected = "4 samples and 1 round or more, shares of 0 to 1, an elite of up to a half"
        ControlError.unless(whole and shares, "cross entropy", expected, self)

    def minimise(
        self,
        costs: Callable[[FloatArray], FloatArray],
        start: FloatArray,
        rng: np.random.Generator,
        deadline: float = np.inf,
    ) -> "Minimum":
        """Search for the cheapest decisions.

        Parameters
        ----------
        costs : callable
            Of decisions, shape (samples, D), their costs, shape (samples,); what is not finite is never chosen.
        start : ndarray, shape (D,)
            First mean, 0 to 1 [-].
        rng : numpy.random.Generator
            Of the samples.
        deadline : float
            No round begins after it, on `time.perf_counter` [s].

        Returns
        -------
        Minimum
            The cheapest of all.
        """
        mean, spread = np.array(start, dtype=float), np.full(start.shape, self.deviation)
        best, lowest, first, done, slow, converged = mean, np.inf, np.inf, 0, 0, False
        kept = max(round(self.elite * self.samples), 2)
        for done in range(1, self.rounds + 1):
            tried = np.clip(mean + spread * rng.standard_normal((self.samples, mean.size)), 0.0, 1.0)
            tried[0] = mean
            tried[-1] = best
            cost = costs(tried)
            cost = np.where(np.isfinite(cost), cost, np.inf)
            first = float(cost[0]) if done == 1 else first
            order = np.argsort(cost, kind="stable")
            gained = lowest - cost[order[0]]
            if gained > 0.0:
                best, lowest = tried[order[0]], float(cost[order[0]])
            elite, share = tried[order[:kept]], self.smoothing
            mean = share * elite.mean(axis=0) + (1.0 - share) * mean
            spread = share * elite.std(axis=0) + (1.0 - share) * spread
            slow = slow + 1 if gained <= self.tolerance * abs(lowest) else 0
            converged = slow == 2
            if converged or time.perf_counter() > deadline:
                break
        return Minimum(best, lowest, first, done, converged)


class Minimum(NamedTuple):
    """What a search found.

    Parameters
    ----------
    decisions : ndarray, shape (D,)
        The cheapest [-].
    cost, start : float
        Theirs, and that of the decisions it began with.
    rounds : int
        That were made.
    converged : bool
        Whether the last rounds brought too little to go on.
    """

    decisions: FloatArray
    cost: float
    start: float
    rounds: int
    converged: bool


class SamplingSolver(Solver):
    """Tries many plans at once and learns from the best; needs costs, no derivatives.

    Parameters
    ----------
    problem : ControlProblem
        Ranges, blocks and limits on changes.
    trials : callable
        Costs of many plans, such as `mpc.batch.rollouts.HorizonRollouts`.
    method : CrossEntropy
        How plans are sampled.
    seed : int
        Same seed, same plans, where no time limit ends a search.
    """

    def __init__(
        self, problem: ControlProblem, trials: Trials, method: CrossEntropy | None = None, seed: int = 0
    ) -> None:
        self.problem, self.trials, self.method, self.seed = problem, trials, method or CrossEntropy(), seed
        self.memory = None

    def solve(self, data: HorizonData, plan: FloatArray, time_limit: float | None = None) -> Solution:
        """Solve for one horizon; see `Solver`.

        Parameters
        ----------
        data : HorizonData
            Its parameters.
        plan : ndarray, shape (n_block, n_channel)
            Where to start [unit of the channel].
        time_limit : float, optional
            Wall time after which no round begins [s].
        """
        begin, number = time.perf_counter(), 0 if self.memory is None else int(self.memory[0])
        self.memory = np.array([number + 1.0])
        problem = self.problem
        limited = bool(np.isfinite(problem.most_change).any())

        def admitted(shares: FloatArray) -> FloatArray:
            return np.stack([problem.admitted(data, row) for row in shares]) if limited else shares

        found = self.method.minimise(
            lambda shares: self.trials(data, admitted(shares)).sum(axis=1), problem.shares(plan),
            np.random.default_rng([self.seed, number]), np.inf if time_limit is None else begin + time_limit,
        )  # fmt: skip
        best = admitted(found.decisions[None])
        terms = CostTerms(*self.trials(data, np.repeat(best, self.method.samples, axis=0))[0].tolist())
        chosen = problem.plan(best[0])
        status = Status.CONVERGED if found.converged else Status.ITERATION_LIMIT
        if not np.isfinite(found.cost):
            status = Status.FAILED
        message = f"{found.rounds} rounds of {self.method.samples} plans"
        return Solution(
            chosen, problem.predictor.rollout(data, chosen), terms, found.start, status, message, found.rounds,
            time.perf_counter() - begin, "sampling",
        )  # fmt: skip
