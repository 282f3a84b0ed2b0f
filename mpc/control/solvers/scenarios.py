"""A handful of scenarios: blocks in common until the forecast's error shows, each its own from there on."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mpc.control.predictor.predictor import Predictor, Rollout, Sensitivity
from mpc.control.problem.data import HorizonData
from mpc.control.problem.horizon import Horizon
from mpc.control.problem.problem import ControlProblem, CostTerms
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.solution import Solution, Solver
from mpc.errors import ControlError
from mpc.scenario.forecaster import ErrorGrowth
from thermal._types import FloatArray
from thermal.errors import describe

_ZONES = ("disturbance", "gains", "lower", "upper", "heating_setpoint", "cooling_setpoint", "comfort_price")


def outdoor_scenarios(
    data: HorizonData, horizon: Horizon, growth: ErrorGrowth, count: int, rng: np.random.Generator
) -> tuple[HorizonData, ...]:
    """Draw errors of the outdoor temperature's forecast: the forecast itself first where the number is odd, then pairs.

    Errors come in pairs of opposite sign, so that a handful has the forecast as its mean.

    Parameters
    ----------
    data : HorizonData
        With the forecast.
    horizon : Horizon
        Its steps.
    growth : ErrorGrowth
        Of the error with the lead.
    count : int
        Number of scenarios, 2 or more.
    rng : numpy.random.Generator
        Where randomness comes from.

    Raises
    ------
    ControlError
        When there are fewer than two.
    """
    if count < 2:
        raise ControlError(describe("scenarios", "2 or more", f"{count}"))
    keep = np.exp(-horizon.steps / growth.time_constant)
    drive = growth.deviation * np.sqrt(1.0 - keep**2) * rng.standard_normal((count // 2, len(horizon)))
    paths, error = np.zeros_like(drive), np.zeros(count // 2)
    for k, share in enumerate(keep):
        error = share * error + drive[:, k]
        paths[:, k] = error
    found = [data] if count % 2 else []
    for path in paths:
        for signed in (path, -path):
            boundary = data.boundary.copy()
            boundary[:, 0] += signed
            found.append(replace(data, outdoor_temperature=data.outdoor_temperature + signed, boundary=boundary))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _Tree(HorizonData):
    """Scenarios side by side: zones of all of them as zones of one building."""

    parts: tuple[HorizonData, ...] = ()

    @classmethod
    def of(cls, parts: Sequence[HorizonData]) -> _Tree:
        """Put scenarios together; each counts with its share."""
        first = parts[0]
        given = {name: getattr(first, name) for name in first.__dataclass_fields__}
        given |= {name: np.concatenate([getattr(p, name) for p in parts], axis=-1) for name in _ZONES}
        given["comfort_price"] = given["comfort_price"] / len(parts)
        return cls(**given, parts=tuple(parts))


@dataclass(frozen=True, eq=False)
class _TreeRollout(Rollout):
    """Scenarios side by side; powers and the end are their means."""

    parts: tuple[Rollout, ...] = ()


class _TreePredictor(Predictor):
    """One predictor over all scenarios; its plan has the common blocks, then those of each scenario."""

    def __init__(self, base: Predictor, count: int, common: int) -> None:
        self.base, self.modes, self.horizon, self.channels = base, base.modes, base.horizon, base.channels
        own = base.horizon.n_block - common
        first = common + own * np.arange(count)[:, None]
        #: Blocks of the tree that each scenario follows, shape (count, n_block).
        self.blocks = np.hstack([np.tile(np.arange(common), (count, 1)), first + np.arange(own)])
        self.n_zone, self.n_block = base.n_zone * count, common + own * count
        self.n_decision = self.n_block * len(base.channels)

    def rollout(self, data: HorizonData, plan: FloatArray, near: Rollout | None = None) -> _TreeRollout:
        nears = near.parts if isinstance(near, _TreeRollout) else [None] * len(self.blocks)
        runs = [
            self.base.rollout(one, plan[blocks], at)
            for one, blocks, at in zip(data.parts, self.blocks, nears, strict=True)  # type: ignore[attr-defined]
        ]
        zone, seen, heat = (np.hstack([getattr(run, name) for run in runs]) for name in ("zone", "seen", "heat"))
        electric, fuel, end = (
            np.mean([getattr(run, n) for run in runs], axis=0) for n in ("electric", "fuel", "end_state")
        )
        first = runs[0]
        return _TreeRollout(
            plan, zone, seen, electric, fuel, end, first.inputs, first.sums, heat, first.air, first.water, tuple(runs)
        )

    def reached(self, data: HorizonData, rollout: Rollout) -> FloatArray:
        plan = rollout.plan.copy()
        pairs = zip(data.parts, rollout.parts, self.blocks, strict=True)  # type: ignore[attr-defined]
        for one, run, blocks in reversed([*pairs]):  # common blocks are the first scenario's
            plan[blocks] = self.base.reached(one, run)
        return plan

    def sensitivity(self, data: HorizonData, rollout: Rollout) -> Sensitivity:
        n, m, share = self.base.n_zone, len(self.channels), 1.0 / len(self.blocks)
        count = len(self.horizon)
        zone = np.zeros((count + 1, self.n_zone, self.n_decision))
        electric, fuel = np.zeros((count, self.n_decision)), np.zeros((count, self.n_decision))
        end = np.zeros((rollout.end_state.size, self.n_decision))
        for s, (one, run) in enumerate(zip(data.parts, rollout.parts, strict=True)):  # type: ignore[attr-defined]
            slopes = self.base.sensitivity(one, run)
            columns = (self.blocks[s][:, None] * m + np.arange(m)).ravel()
            zone[:, s * n : (s + 1) * n, columns] = slopes.zone
            for total, part in ((electric, slopes.electric), (fuel, slopes.fuel), (end, slopes.end_state)):
                total[:, columns] += share * part
        return Sensitivity(zone, electric, fuel, end)


class _TreeProblem(ControlProblem):
    """The problem of all scenarios: the mean of their costs."""

    predictor: _TreePredictor

    @property
    def shape(self) -> tuple[int, int]:
        return self.predictor.n_block, len(self.predictor.channels)

    @property
    def predecessors(self) -> NDArray[np.int64]:
        before = np.full(self.shape[0], -1, dtype=np.int64)
        for blocks in self.predictor.blocks:
            before[blocks[1:]] = blocks[:-1]
        return before

    @cached_property
    def most_change(self) -> FloatArray:
        base = ControlProblem(self.predictor.base).most_change.reshape(-1, self.shape[1])
        most = np.empty(self.shape)
        for blocks in self.predictor.blocks:
            most[blocks] = base
        return most.ravel()


class ScenarioSolver:
    """Least mean cost over a handful of scenarios that share their first blocks.

    Parameters
    ----------
    problem : ControlProblem
        Of one scenario.
    draw : callable
        Called as ``draw(data)``; gives `count` scenarios of a horizon, such as `outdoor_scenarios`.
    count : int
        Number of scenarios, 2 or more.
    common : int
        Blocks that all of them share, from now on (non-anticipative): 1 to all.
    solver : callable
        Makes the solver of the larger problem, such as `SequentialSolver`.

    Raises
    ------
    ControlError
        When a number is out of its range.

    Notes
    -----
    Comfort stays soft: where scenarios make a band dear to keep, its price decides. The plan that is handed back has
    the common blocks, then the mean of the others; the roll-out is that of the forecast, cost terms are means over the
    scenarios. Peaks are those of the mean power, which is less than the mean of peaks.
    """

    def __init__(
        self,
        problem: ControlProblem,
        draw: Callable[[HorizonData], Sequence[HorizonData]],
        count: int = 5,
        common: int = 1,
        solver: Callable[[ControlProblem], Solver] = SequentialSolver,
    ) -> None:
        if count < 2 or not 1 <= common <= problem.shape[0]:
            expected = f"2 scenarios or more, and 1 to {problem.shape[0]} common blocks"
            raise ControlError(describe("scenario solver", expected, f"{count} and {common}"))
        self.problem, self.draw, self._tree = problem, draw, _TreePredictor(problem.predictor, count, common)
        whole = _TreeProblem(self._tree, problem.softness, problem.terminal_time, problem.move_weight)
        self._solver = solver(whole)

    @property
    def memory(self) -> FloatArray | None:
        """What the solver of the larger problem keeps from solve to solve [its own]."""
        return self._solver.memory

    @memory.setter
    def memory(self, kept: FloatArray | None) -> None:
        self._solver.memory = kept

    def forget(self) -> None:
        """Drop what was learned in earlier solves."""
        self._solver.forget()

    def solve(self, data: HorizonData, plan: FloatArray, time_limit: float | None = None) -> Solution:
        """Solve for one horizon; see `Solver`.

        Parameters
        ----------
        data : HorizonData
            Its parameters.
        plan : ndarray, shape (n_block, n_channel)
            Where every scenario starts [unit of the channel].
        time_limit : float, optional
            Wall time after which the best plan so far is returned [s].

        Raises
        ------
        ControlError
            When another number of scenarios is drawn than was said.
        """
        begin, blocks, parts = time.perf_counter(), self._tree.blocks, tuple(self.draw(data))
        if len(parts) != len(blocks):
            raise ControlError(describe("scenarios", f"{len(blocks)}", f"{len(parts)}"))
        first = np.empty((self._tree.n_block, plan.shape[1]))
        for each in blocks:
            first[each] = plan
        found = self._solver.solve(_Tree.of(parts), first, time_limit)
        mean = np.mean([found.plan[each] for each in blocks], axis=0)
        rollout = self.problem.predictor.rollout(data, mean)
        terms = self._mean(parts, found.plan)
        start = self._mean(parts, first)
        return Solution(
            mean, rollout, terms, start.total, found.status, found.message, found.iterations,
            time.perf_counter() - begin, f"scenarios, {found.solver}",
        )  # fmt: skip

    def _mean(self, parts: Sequence[HorizonData], plan: FloatArray) -> CostTerms:
        base = self.problem
        terms = [
            base.terms(one, base.predictor.rollout(one, plan[each]))
            for one, each in zip(parts, self._tree.blocks, strict=True)
        ]
        return CostTerms(*np.mean(terms, axis=0).tolist())
