"""Runs of whole machines over a horizon as a mixed-integer programme, solved by HiGHS about a relaxed plan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array, eye_array, hstack

from mpc.control.solvers.stages import StageData, StageProblem
from thermal._types import FloatArray

#: Relative gap at which a plan is good enough [-], and the most time of a solve [s].
_GAP, _SECONDS = 1e-3, 20.0

#: Time over which duties are whole [s]; later ones are relaxed, as days of whole quarter-hours take HiGHS seconds.
WHOLE = 6.0 * 3600.0


@dataclass(frozen=True)
class RunLimits:
    """What a machine that is run whole may do from now on.

    Parameters
    ----------
    decision : int
        Which decision of the stage problem is its duty.
    on : bool
        Whether it runs now.
    bound : int
        Steps that it must still stay as it is.
    hold : int
        Shortest run and shortest rest, in steps.
    left, back : float
        Starts that it has left, and those that come back with each step [-].
    price : float
        Of a start [as the problem's cost].
    """

    decision: int
    on: bool
    bound: int
    hold: int
    left: float
    back: float
    price: float


@dataclass(frozen=True, eq=False)
class RunPlanner:
    """Chooses the steps in which machines run, for a stage problem made linear about a relaxed plan.

    ``min c'u + p's + w'e`` over duties ``u`` of 0 or 1, starts ``s_k >= u_k - u_{k-1}`` and what lies outside of the
    bands, ``e``. Runs and rests of at least h steps: ``s_{k-h+1} + .. + s_k <= u_k`` and, with the stops
    ``t = s - u_k + u_{k-1} >= 0``, ``t_{k-h+1} + .. + t_k <= 1 - u_k`` (Rajan and Takriti 2005, Minimum up/down
    polytopes of the unit commitment problem with start-up costs, IBM Research Report RC23628); starts up to each step
    within those that are left and have come back. Other decisions stay as the relaxed plan has them.

    Parameters
    ----------
    problem : StageProblem
        Whose decisions lie between 0 and 1.
    whole : int
        Steps from now on whose duties are 0 or 1; later ones lie between.
    """

    problem: StageProblem
    whole: int

    @cached_property
    def _linear(self) -> tuple[ca.Function, ca.Function]:
        """Jacobians of a step, by state and decision, and of the end, by state."""
        stage = self.problem
        x, u = stage.state, stage.decision
        found = [ca.densify(ca.jacobian(of, by)) for of in (stage.next_state, stage.cost) for by in (x, u)]
        ends = [ca.densify(ca.jacobian(of, x)) for of in (stage.end_cost, stage.banded)]
        return ca.Function("linear", [x, u, stage.parameter], found), ca.Function("ends", [x], ends)

    def _responses(
        self, data: StageData, states: FloatArray, decisions: FloatArray, chosen: Sequence[int]
    ) -> tuple[FloatArray, FloatArray]:
        """Give cost and bands by a change of each chosen duty, shape (m, N) and (N + 1, b, m, N)."""
        (n, b), count, m = (self.problem.state.numel(), self.problem.banded.numel()), len(decisions), len(chosen)
        linear, ends = self._linear
        moved, cost = np.zeros((n, m, count)), np.zeros((m, count))
        bands = np.zeros((count + 1, b, m, count))
        for k in range(count):
            a, by_u, cost_x, cost_u = (np.array(j) for j in linear(states[k], decisions[k], data.parameters[k]))
            bands[k] = np.tensordot(np.array(ends(states[k])[1]), moved, 1)
            cost += np.tensordot(cost_x[0], moved, 1)
            cost[:, k] += cost_u[0, chosen]
            moved = np.tensordot(a, moved, 1)
            moved[:, :, k] += by_u[:, chosen]
        end_cost, banded = (np.array(j) for j in ends(states[-1]))
        bands[-1] = np.tensordot(banded, moved, 1)
        return cost + np.tensordot(end_cost[0], moved, 1), bands

    def plan(
        self, data: StageData, states: FloatArray, decisions: FloatArray, machines: Sequence[RunLimits]
    ) -> FloatArray | None:
        """Choose runs.

        Parameters
        ----------
        data : StageData
            Of the horizon.
        states : ndarray, shape (N + 1, n)
            Of the relaxed plan [as the state].
        decisions : ndarray, shape (N, m)
            Of the relaxed plan [-].
        machines : sequence of RunLimits
            Those that are run whole.

        Returns
        -------
        ndarray, shape (whole, n_machine), or None
            Duties, 0 or 1; None where HiGHS found none in its time.
        """
        count, duties = len(decisions), decisions[:, [m.decision for m in machines]].T
        cost, bands = self._responses(data, states, decisions, [m.decision for m in machines])
        width, slacks = len(machines) * count, data.lower.size
        seen = np.array([np.array(self.problem.end(x)[1]).ravel() for x in states])
        response = csr_array(bands.reshape(slacks, width))
        given = seen.ravel() - response @ duties.ravel()
        nothing, one = csr_array((slacks, width)), eye_array(slacks, format="csr")
        rows = [
            LinearConstraint(hstack([response, nothing, one]), data.lower.ravel() - given, np.inf),
            LinearConstraint(hstack([response, nothing, -one]), -np.inf, data.upper.ravel() - given),
        ]
        rows += [
            LinearConstraint(_spread(block, k, len(machines), slacks), least, most)
            for k, machine in enumerate(machines)
            for block, least, most in _of_machine(machine, count)
        ]
        least, most = np.zeros((len(machines), count)), np.ones((len(machines), count))
        for k, machine in enumerate(machines):
            least[k, : machine.bound] = most[k, : machine.bound] = float(machine.on)
        free = np.full(width + slacks, np.inf)
        found = milp(
            np.concatenate([cost.ravel(), np.repeat([m.price for m in machines], count), data.price.ravel()]),
            integrality=np.concatenate([np.tile(np.arange(count) < self.whole, len(machines)), np.zeros(free.size)]),
            bounds=Bounds(np.concatenate([least.ravel(), np.zeros_like(free)]), np.concatenate([most.ravel(), free])),
            constraints=rows, options={"mip_rel_gap": _GAP, "time_limit": _SECONDS},
        )  # fmt: skip
        return None if found.x is None else np.round(found.x[:width].reshape(len(machines), count)[:, : self.whole]).T


def _of_machine(machine: RunLimits, count: int) -> list[tuple[csr_array, FloatArray, FloatArray]]:
    """Rows over a machine's duties and starts, side by side, with their ends."""
    one, before = eye_array(count, format="csr"), eye_array(count, k=-1, format="csr")
    first = np.zeros(count)
    first[0] = float(machine.on)
    rise, free = one - before, np.full(count, np.inf)  # what is on now is taken off at the first step
    since = np.tril(np.ones((count, count)))
    past, window = csr_array(since), csr_array(since - np.tril(since, -machine.hold))
    stopped = window @ first  # stops that the state of now adds to those of the first steps
    return [
        (hstack([-rise, one]), -first, free),
        (hstack([-one, window]), -free, np.zeros(count)),
        (hstack([one - window @ rise, window]), -free, 1.0 - stopped),
        (hstack([csr_array((count, count)), past]), -free, machine.left + machine.back * np.arange(count)),
    ]


def _spread(block: csr_array, k: int, machines: int, slacks: int) -> csr_array:
    """Widen rows over duties and starts of a machine to all variables."""
    rows, count = block.shape[0], block.shape[1] // 2
    parts = [csr_array((rows, count))] * (2 * machines)
    parts[k], parts[machines + k] = block[:, :count], block[:, count:]
    return csr_array(hstack([*parts, csr_array((rows, slacks))]))
