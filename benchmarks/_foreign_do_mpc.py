"""do-mpc as the solver of an identified plant: the same model, observer, forecasts and choice of the first step."""

from __future__ import annotations

import contextlib
import io
import time
import warnings
from collections.abc import Iterator
from typing import Any, get_args

import numpy as np

from mpc.control.identified.action import PlannedAction
from mpc.control.identified.controller import IdentifiedController
from mpc.control.identified.problem import SCALE
from mpc.control.solvers.solution import Status
from mpc.control.solvers.stages import StageData, StageMethod, StageProblem, StageSolution
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast

#: Ipopt's settings that suit a good beginning; of `_do_mpc_peer` the ones that solved soonest.
OPTIONS = {
    "ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.mu_init": 3e-4, "ipopt.bound_push": 1e-2,
    "ipopt.bound_frac": 1e-2, "ipopt.tol": 1e-4,
}  # fmt: skip


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep what do-mpc prints and warns of to itself."""
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        yield


class DoMpcStages:
    """do-mpc on a problem in stages, in the place of `mpc.control.solvers.stages.StageSolver`.

    Parameters
    ----------
    problem : StageProblem
        Where the equations are read from.
    n_steps : int
        Of the horizon.
    price : float
        Of a kelvin outside of the band at an edge [currency/K].
    """

    def __init__(self, problem: StageProblem, n_steps: int, price: float) -> None:
        with _quiet():  # on packages of its that are not installed
            import do_mpc

        self.problem, self.n_steps, self._data = problem, n_steps, None
        n, m, n_p, bands = (s.numel() for s in (problem.state, problem.decision, problem.parameter, problem.banded))
        model = do_mpc.model.Model("discrete", "SX")
        x, u = model.set_variable("_x", "x", (n, 1)), model.set_variable("_u", "u", (m, 1))
        p = model.set_variable("_tvp", "p", (n_p, 1))
        for edge in ("low", "high"):
            model.set_variable("_tvp", edge, (bands, 1))
        model.set_rhs("x", problem.step(x, u, p)[0])
        with _quiet():  # of numpy functions that it calls on CasADi's values
            model.setup()  # after which its symbols are others
            cost = problem.step(model.x["x"], model.u["u"], model.tvp["p"])[1]
            end_cost, banded = problem.end(model.x["x"])
            edges = (("cold", model.tvp["low"] - banded), ("warm", banded - model.tvp["high"]))
            self._mpc: Any = do_mpc.controller.MPC(model)
            mpc = self._mpc
            mpc.settings.n_horizon, mpc.settings.t_step = n_steps, 1.0
            mpc.settings.nlpsol_opts, mpc.settings.store_full_solution = OPTIONS, False
            mpc.set_objective(mterm=end_cost, lterm=cost)
            mpc.set_rterm(u=0.0)
            mpc.bounds["lower", "_u", "u"], mpc.bounds["upper", "_u", "u"] = problem.lower, problem.upper
            for name, excess in edges:
                mpc.set_nl_cons(name, excess, 0.0, soft_constraint=True, penalty_term_cons=price)
            if problem.within.numel():
                mpc.set_nl_cons("within", problem.kept(model.x["x"], model.u["u"], model.tvp["p"]), 0.0)
            template = mpc.get_tvp_template()
            mpc.set_tvp_fun(lambda _: self._known(template))
            mpc.setup()

    def _known(self, template: Any) -> Any:
        if self._data is not None:
            for k in range(self.n_steps + 1):
                template["_tvp", k, "p"] = self._data.parameters[min(k, self.n_steps - 1)]
                template["_tvp", k, "low"], template["_tvp", k, "high"] = self._data.lower[k], self._data.upper[k]
        return template

    def solve(self, data: StageData, states: np.ndarray, decisions: np.ndarray) -> StageSolution:
        """Solve for one horizon from a guess, as a `StageSolver`."""
        self._data, begin, mpc = data, time.perf_counter(), self._mpc
        with _quiet():
            mpc.reset_history()
            mpc.x0, mpc.u0 = data.start, decisions[0]
            mpc.set_initial_guess()
            for k in range(self.n_steps):
                mpc.opt_x_num["_x", k, 0, -1], mpc.opt_x_num["_u", k, 0] = states[k], decisions[k]
            mpc.opt_x_num["_x", self.n_steps, 0, -1] = states[-1]
            mpc.make_step(data.start)
        plan = np.array([np.array(mpc.opt_x_num["_u", k, 0]).ravel() for k in range(self.n_steps)])
        ahead, stats = self.problem.follow(data, plan), mpc.solver_stats
        return StageSolution(
            ahead, plan, self.problem.cost_along(data, ahead, plan),
            Status.CONVERGED if stats["success"] else Status.FAILED, str(stats["return_status"]),
            int(stats["iter_count"]), time.perf_counter() - begin, "do-mpc",
        )  # fmt: skip


class DoMpcController:
    """The library's controller of an identified plant with do-mpc as its solver.

    Parameters
    ----------
    ours : IdentifiedController
        Whose solver is replaced.
    n_steps : int
        Of the forecasts.
    """

    def __init__(self, ours: IdentifiedController, n_steps: int) -> None:
        hours = ours.model.step / 3600.0
        price = SCALE * ours.settings.comfort_price * hours
        solver = DoMpcStages(ours._problem.stage, n_steps, price)
        ours._solvers = {(n_steps, method): solver for method in get_args(StageMethod)}  # type: ignore[misc]
        self.ours = ours

    def step(self, measurements: Measurements, forecast: Forecast | None) -> PlannedAction:
        """Choose values of the actuators."""
        return self.ours.step(measurements, forecast)
