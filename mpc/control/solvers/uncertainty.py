"""What is uncertain: bands narrowed by it, and a handful of scenarios that share their first blocks."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import ndtri

from calibration.estimation.kalman import KalmanFilter
from mpc.control.predictor.predictor import Predictor, Rollout, Sensitivity
from mpc.control.problem.horizon import Horizon, HorizonData
from mpc.control.problem.problem import ControlProblem, CostTerms
from mpc.control.solvers.sequential import SequentialSolver
from mpc.control.solvers.solution import Solution, Solver
from mpc.errors import ControlError
from mpc.scenario.forecast import ErrorGrowth
from thermal._types import BoolArray, FloatArray
from thermal.model.modal import ModalModel
from thermal.model.step import IMPLICIT_EULER, Scheme


@dataclass(frozen=True, eq=False)
class BackOff:
    """Narrows comfort bands so that each edge is missed with a given probability.

    Parameters
    ----------
    kalman : KalmanFilter
        Of the observer.
    modes : ModalModel
        That its state space was made of.
    horizon : Horizon
        Steps.
    violation : float
        Probability of missing an edge of a zone's band at a step [-], above 0 and up to 0.5; not that of any of them.
    recourse : float
        Lead from which on later actions are taken to correct what is measured by then: beyond it deviations stay as
        they are there [s]. Infinite by default: open loop, as if no action followed.
    outdoor : ErrorGrowth, optional
        Error of the outdoor temperature's forecast; none by default.
    scheme : Scheme
        Of time, as the predictor's.

    Raises
    ------
    ControlError
        When a number is out of its range.

    Notes
    -----
    With A_k and Q_k those of (25) at the horizon's own steps, the outdoor error a further state,

    ``P_k+1 = A_k P_k A_k' + Q_k,  σ_k² = diag(C P_k C'),  lower + q σ_k <= T_k <= upper - q σ_k``,  q the normal
    quantile of the violation (van Hessem and Bosgra 2002, doi:10.1109/CDC.2002.1185062). P_0 is the steady covariance
    of the prediction. Sensors' noise does not count: the zone's own temperature is what is felt. A band that is too
    narrow for both edges shrinks to its middle.
    """

    kalman: KalmanFilter
    modes: ModalModel
    horizon: Horizon
    violation: float = 0.05
    recourse: float = np.inf
    outdoor: ErrorGrowth | None = None
    scheme: Scheme = IMPLICIT_EULER

    def __post_init__(self) -> None:
        possible = 0.0 < self.violation <= 0.5 and self.recourse > 0.0
        expected, found = "a probability up to 0.5 and a positive time", f"{self.violation!r}, {self.recourse!r} s"
        ControlError.unless(possible, "back-off", expected, found)

    @property
    def quantile(self) -> float:
        """Of the normal law, q [-]."""
        return float(-ndtri(self.violation))

    @cached_property
    def deviation(self) -> FloatArray:
        """Standard deviation of each zone at the end of each step, shape (N, n_zone) [K]."""
        return self.deviations(np.ones(self.kalman.space.n_zone, dtype=bool))

    def deviations(self, measured: BoolArray) -> FloatArray:
        """Give the deviations where only some sensors report, shape (N, n_zone) [K].

        Parameters
        ----------
        measured : ndarray of bool, shape (n_zone,)
            Zones with a sensor.
        """
        r, zones = self.kalman.space.order, self.kalman.space.n_zone
        modes, output, growth = self.modes, self.modes.output, self.outdoor or ErrorGrowth(0.0, 3600.0)
        p = np.zeros((r + zones + 1,) * 2)
        p[:-1, :-1] = self.kalman.steady(measured)[0]
        found: list[FloatArray] = []
        for dt, end in zip(self.horizon.steps, self.horizon.edges[1:], strict=True):
            if found and end > self.recourse + 1e-6:
                found.append(found[-1])
                continue
            keep, added = self.kalman.disturbance.discrete(float(dt))
            fading = np.exp(-dt / growth.time_constant)
            # the forecast's error acts in the step that it belongs to, as scenarios draw it
            p[-1] *= fading
            p[:, -1] *= fading
            p[-1, -1] += growth.deviation**2 * (1.0 - fading**2)
            part, step = modes.propagator(float(dt), self.scheme), np.zeros_like(p)
            step[:r, :r] = np.diag(part.end)
            step[:r, r:-1] = part.end_gain[:, None] * modes.heating
            step[:r, -1] = part.end_gain * modes.boundary[:, 0]
            step[r:-1, r:-1], step[-1, -1] = keep * np.eye(zones), 1.0
            p = step @ p @ step.T
            p[range(r, r + zones), range(r, r + zones)] += added**2
            found.append(np.sqrt(np.einsum("zi,ij,zj->z", output, p[:r, :r], output).clip(0.0)))
        return np.array(found)

    def narrow(self, data: HorizonData) -> HorizonData:
        """Narrow the bands of a horizon.

        Parameters
        ----------
        data : HorizonData
            With the bands that are to be kept.
        """
        return _narrowed(data, self.quantile * self.deviation)


@dataclass(frozen=True)
class Margin:
    """Narrows comfort bands by the same everywhere.

    Parameters
    ----------
    width : float
        At each edge [K], none negative.

    Raises
    ------
    ControlError
        When it is negative or not a number.

    Notes
    -----
    A zone that is expected at the edge of its band will be outside of it half of the time. With a normal error of
    deviation σ the expected excess of an expected x beyond the edge is ``σ φ(x/σ) + x Φ(x/σ)``; a margin m with a
    softness of 2 m (see `ControlProblem`), a parabola from x = -m to m and x from there on, is that within 0.05 σ at
    m = 1.5 σ.
    """

    width: float

    def __post_init__(self) -> None:
        ControlError.unless(self.width >= 0.0, "margin", "0 K or more", f"{self.width!r} K")

    def narrow(self, data: HorizonData) -> HorizonData:
        """Narrow the bands of a horizon; one that is too narrow for both edges shrinks to its middle.

        Parameters
        ----------
        data : HorizonData
            With the bands that are to be kept.
        """
        return _narrowed(data, self.width)


def _narrowed(data: HorizonData, room: float | FloatArray) -> HorizonData:
    middle = 0.5 * (data.lower + data.upper)
    lower, upper = np.minimum(data.lower + room, middle), np.maximum(data.upper - room, middle)
    return replace(data, lower=lower, upper=upper)


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
    ControlError.unless(count >= 2, "scenarios", "2 or more", f"{count}")
    keep = np.exp(-horizon.steps / growth.time_constant)
    drive = growth.deviation * np.sqrt(1.0 - keep**2) * rng.standard_normal((count // 2, len(horizon)))
    paths, error = np.zeros_like(drive), np.zeros(count // 2)
    for k, share in enumerate(keep):
        error = share * error + drive[:, k]
        paths[:, k] = error
    found = [data] if count % 2 else []
    for signed in (sign * path for path in paths for sign in (1.0, -1.0)):
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
        given = vars(parts[0]) | {name: np.concatenate([getattr(p, name) for p in parts], axis=-1) for name in _ZONES}
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
        given = vars(runs[0]) | {"plan": plan}
        given |= {name: np.hstack([getattr(run, name) for run in runs]) for name in ("zone", "seen", "heat")}
        given |= {n: np.mean([getattr(run, n) for run in runs], axis=0) for n in ("electric", "fuel", "end_state")}
        return _TreeRollout(**given, parts=tuple(runs))

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
            by_plan = self.base.sensitivity(one, run)
            columns = (self.blocks[s][:, None] * m + np.arange(m)).ravel()
            zone[:, s * n : (s + 1) * n, columns] = by_plan.zone
            for total, part in ((electric, by_plan.electric), (fuel, by_plan.fuel), (end, by_plan.end_state)):
                total[:, columns] += share * part
        return Sensitivity(zone, electric, fuel, end)


@dataclass(eq=False)
class ScenarioSolver(Solver):
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

    problem: ControlProblem
    draw: Callable[[HorizonData], Sequence[HorizonData]]
    count: int = 5
    common: int = 1
    solver: Callable[[ControlProblem], Solver] = SequentialSolver

    def __post_init__(self) -> None:
        most, possible = self.problem.shape[0], self.count >= 2 and 1 <= self.common <= self.problem.shape[0]
        expected, found = f"2 scenarios or more, and 1 to {most} common blocks", f"{self.count} and {self.common}"
        ControlError.unless(possible, "scenario solver", expected, found)
        self._tree = _TreePredictor(self.problem.predictor, self.count, self.common)
        self._solver = self.solver(replace(self.problem, predictor=self._tree, paths=self._tree.blocks))

    @property
    def memory(self) -> FloatArray | None:
        """What the solver of the larger problem keeps from solve to solve [its own]."""
        return self._solver.memory

    @memory.setter
    def memory(self, kept: FloatArray | None) -> None:
        self._solver.memory = kept

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
        ControlError.unless(len(parts) == len(blocks), "scenarios", f"{len(blocks)}", f"{len(parts)}")
        first = np.empty((self._tree.n_block, plan.shape[1]))
        for each in blocks:
            first[each] = plan
        found = self._solver.solve(_Tree.of(parts), first, time_limit)
        mean = np.mean([found.plan[each] for each in blocks], axis=0)
        rollout = self.problem.predictor.rollout(data, mean)
        return Solution(
            mean, rollout, self._mean(parts, found.plan), self._mean(parts, first).total, found.status, found.message,
            found.iterations, time.perf_counter() - begin, f"scenarios, {found.solver}",
        )  # fmt: skip

    def _mean(self, parts: Sequence[HorizonData], plan: FloatArray) -> CostTerms:
        base = self.problem
        terms = [
            base.terms(one, base.predictor.rollout(one, plan[each]))
            for one, each in zip(parts, self._tree.blocks, strict=True)
        ]
        return CostTerms(*np.mean(terms, axis=0).tolist())
