"""The common problem in do-mpc, as its documentation has one write it."""

from __future__ import annotations

import contextlib
import io
import time
import warnings
from typing import Any

import numpy as np
from _common_control import COMFORT_PRICE, STEP, STEPS, ZONES

from mpc.control.solvers.stages import StageData, StageProblem

QUIET = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0}


def near(barrier: float, push: float) -> dict[str, float]:
    """Ipopt's settings for a good first guess, at the tolerance of the other solvers."""
    return {"ipopt.mu_init": barrier, "ipopt.bound_push": push, "ipopt.bound_frac": push, "ipopt.tol": 1e-4}


#: As it comes, with the usual settings for a warm start, and with the best that were found for this problem.
SETTINGS: dict[str, dict[str, float]] = {
    "do-mpc, defaults": {}, "do-mpc, tuned: barrier 1e-3, push 1e-6": near(1e-3, 1e-6),
    "do-mpc, tuned: barrier 3e-4, push 1e-2": near(3e-4, 1e-2),
}  # fmt: skip


class DoMpc:
    """do-mpc on the common problem; tuned ones begin with the plan before, shifted by a step.

    Parameters
    ----------
    problem : StageProblem
        Where the equations are read from.
    name : str
        Which of `SETTINGS`.
    states, decisions : ndarray
        Where the first solve begins.
    """

    def __init__(self, problem: StageProblem, name: str, states: np.ndarray, decisions: np.ndarray) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on packages of its that are not installed
            import do_mpc

        self._options, self._data = SETTINGS[name], None
        n, m, n_p = problem.state.numel(), problem.decision.numel(), problem.parameter.numel()
        model = do_mpc.model.Model("discrete", "SX")
        x, u = model.set_variable("_x", "x", (n, 1)), model.set_variable("_u", "u", (m, 1))
        p = model.set_variable("_tvp", "p", (n_p, 1))
        for edge in ("low", "high"):
            model.set_variable("_tvp", edge, (ZONES, 1))
        model.set_rhs("x", problem.step(x, u, p)[0])
        model.setup()
        self._mpc = do_mpc.controller.MPC(model)
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")  # of numpy functions that it calls on CasADi's values
            self._set_up(problem, model)
        self._begin(states, decisions)

    def _set_up(self, problem: StageProblem, model: Any) -> None:
        mpc = self._mpc
        mpc.settings.n_horizon, mpc.settings.t_step = STEPS, STEP
        mpc.settings.nlpsol_opts = QUIET | self._options
        _, cost = problem.step(model.x["x"], model.u["u"], model.tvp["p"])
        end_cost, banded = problem.end(model.x["x"])
        mpc.set_objective(mterm=end_cost, lterm=cost)
        mpc.set_rterm(u=0.0)
        mpc.bounds["lower", "_u", "u"], mpc.bounds["upper", "_u", "u"] = problem.lower, problem.upper
        price = COMFORT_PRICE * STEP / 3600.0
        mpc.set_nl_cons("cold", model.tvp["low"] - banded, 0.0, soft_constraint=True, penalty_term_cons=price)
        mpc.set_nl_cons("warm", banded - model.tvp["high"], 0.0, soft_constraint=True, penalty_term_cons=price)
        template = mpc.get_tvp_template()

        def given(_: float) -> object:
            if self._data is not None:
                for k in range(STEPS + 1):
                    template["_tvp", k, "p"] = self._data.parameters[min(k, STEPS - 1)]
                    template["_tvp", k, "low"], template["_tvp", k, "high"] = self._data.lower[k], self._data.upper[k]
            return template

        mpc.set_tvp_fun(given)
        mpc.setup()

    def _begin(self, states: np.ndarray, decisions: np.ndarray) -> None:
        self._mpc.x0, self._mpc.u0 = states[0], decisions[0]
        self._mpc.set_initial_guess()
        for k in range(STEPS + 1):
            self._mpc.opt_x_num["_x", k, 0, -1] = states[k]
        for k in range(STEPS):
            self._mpc.opt_x_num["_u", k, 0] = decisions[k]

    def solve(self, data: StageData) -> tuple[np.ndarray, float, bool, int]:
        """Solve for one horizon: decisions, CPU time [s], success, iterations."""
        if self._options and self._data is not None:
            plan = self._plan()
            states = np.array([np.array(self._mpc.opt_x_num["_x", k, 0, -1]).ravel() for k in range(STEPS + 1)])
            self._begin(np.vstack([states[1:], states[-1:]]), np.vstack([plan[1:], plan[-1:]]))
        self._data, begin = data, time.process_time()
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            self._mpc.make_step(data.start)
        stats = self._mpc.solver_stats
        return self._plan(), time.process_time() - begin, bool(stats["success"]), int(stats["iter_count"])

    def _plan(self) -> np.ndarray:
        return np.array([np.array(self._mpc.opt_x_num["_u", k, 0]).ravel() for k in range(STEPS)])
