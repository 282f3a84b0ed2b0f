"""do-mpc as the solver of the receding horizon: the model in its modes, as do-mpc's documentation has one write it.

States are the modes of the reduced model and the supply water, inputs the two setpoints. What the thermostats go by
and the heat of the zones are algebraic states, since terminals go by the end of a step as in
`mpc.control.predictor.predictor.Predictor`;
heat and powers are the library's own equations (`hvac_function`), at the same smoothing. Comfort is a
soft constraint with do-mpc's linear price, changes of setpoints have its quadratic one. do-mpc knows steps of one
length and an input for each, so the horizon is regular and its blocks are its steps.

Around it everything is as for optimal control of ours: measurements, observer, forecasts, bands, prices, schedules, and
what is done when a solve fails. A solve begins at the roll-out of the plan before, shifted, at the settings of Ipopt
that suit a good beginning.
"""

from __future__ import annotations

import contextlib
import io
import time
import warnings
from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np

from mpc.control.controller.controller import MpcController
from mpc.control.predictor.predictor import Rollout
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.solution import Solution, Status
from thermal.model.step import IMPLICIT_EULER
from thermal.system.symbolic import hvac_function
from thermal.units import REFERENCE_TEMPERATURE

#: Ipopt's settings: quiet, a good first guess, tolerance, and when to give up. Of the barriers that were tried (1e-3 to
#: 1e-5) this one solves most often and soonest.
OPTIONS: dict[str, Any] = {
    "ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.mu_init": 1e-5, "ipopt.bound_push": 1e-5,
    "ipopt.bound_frac": 1e-5, "ipopt.tol": 1e-4, "ipopt.acceptable_tol": 1e-2, "ipopt.acceptable_iter": 2,
    "ipopt.acceptable_constr_viol_tol": 1e-3, "ipopt.acceptable_dual_inf_tol": 10.0, "ipopt.max_iter": 40,
}  # fmt: skip
HUMIDITY, ROOM = 0.006, 293.15  # of return air [kg/kg] and of the plant room [K], as the predictor has them
KILOWATT, HOUR = 1000.0, 3600.0


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep what do-mpc prints and warns of to itself."""
    with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
        warnings.simplefilter("ignore")
        yield


class DoMpcSolver:
    """do-mpc in the place of a solver of ours; see `mpc.control.solvers.solution.Solver`.

    Parameters
    ----------
    problem : ControlProblem
        Whose predictor, prices of changes and horizon it takes over; the horizon's steps are equal, a block each.
    comfort_price : float
        The unit of do-mpc's price of the slacks [currency/K/h].
    lasting : float
        Time constant with which the unmeasured heat fades [s].
    """

    def __init__(self, problem: ControlProblem, comfort_price: float, lasting: float) -> None:
        with _quiet():  # on packages of its that are not installed
            import do_mpc

        self.problem, self.lasting, self.memory = problem, lasting, None
        predictor = problem.predictor
        self.modes, self.hvac, self.count = predictor.modes, predictor.hvac, len(predictor.horizon)
        self.step = float(predictor.horizon.steps[0])
        self.slack_price = comfort_price * self.step / HOUR
        self._part = self.modes.propagator(self.step, IMPLICIT_EULER)
        self._output = self.modes.output
        self._response = (self._output * self._part.end_gain) @ self.modes.heating
        # counted so that each mode moves the zone that sees it most by one kelvin
        self._unit = 1.0 / np.maximum(np.abs(self._output).max(axis=0), 1e-3 * np.abs(self._output).max())
        self._data: HorizonData | None = None
        model = do_mpc.model.Model("discrete", "SX")
        with _quiet():  # of numpy functions that it calls on CasADi's values
            self._write_model(model)
            self._mpc = do_mpc.controller.MPC(model)
            self._set_up(model)

    def _write_model(self, model: Any) -> None:
        """States, inputs, what is known of the future, and the equations."""
        n, n_air, system = self.hvac.n_zone, self.hvac.n_air_handler, self.hvac.system
        x = model.set_variable("_x", "modes", (self.modes.capacity.size, 1))
        water = model.set_variable("_x", "water")
        air, hot = model.set_variable("_u", "air"), model.set_variable("_u", "hot")
        seen, heat = model.set_variable("_z", "seen", (n, 1)), model.set_variable("_z", "heat", (n, 1))  # K above, kW
        sizes = {
            "boundary": self.modes.boundary.shape[1], "gains": n, "outdoor": 1, "humidity": 1, "heating": n,
            "cooling": n, "running": n_air, "boiler": 1, "ventilation": n_air, "electricity": 1, "gas": 1,
            "lower": n, "upper": n, "weight": n,
        }  # fmt: skip
        known = {name: model.set_variable("_tvp", name, (size, 1)) for name, size in sizes.items()}
        plant = hvac_function(system, self.hvac.width)(
            BOILER_supply_water_temperature=REFERENCE_TEMPERATURE + water,
            zone_temperature=REFERENCE_TEMPERATURE + seen,
            zone_air_heating_temperature_setpoint=known["heating"],
            zone_air_cooling_temperature_setpoint=known["cooling"], outdoor_temperature=known["outdoor"],
            outdoor_humidity=known["humidity"], return_humidity=np.full(n_air, HUMIDITY), room_temperature=ROOM,
            supply_air_temperature_setpoint=REFERENCE_TEMPERATURE + np.ones(n_air) * air,
            supply_water_temperature_setpoint=REFERENCE_TEMPERATURE + hot,
            supply_air_static_pressure_setpoint=system.static_pressures,
            differential_pressure_setpoint=system.loop.pump.differential_pressure, fan_running=known["running"],
            boiler_running=known["boiler"], ventilation=known["ventilation"], seconds=self.step,
        )  # fmt: skip
        drive = self._part.end_gain * (self.modes.boundary @ known["boundary"] + self.modes.heating @ known["gains"])
        left = self._part.end * self._unit * x + drive
        own = np.diag(self._response)
        model.set_rhs("modes", (left + self._part.end_gain * (self.modes.heating @ (KILOWATT * heat))) / self._unit)
        model.set_rhs("water", plant["BOILER_supply_water_temperature_end"] - REFERENCE_TEMPERATURE)
        model.set_alg("plant", heat - plant["heat"] / KILOWATT)
        model.set_alg("thermostats", seen - self._output @ left - own * KILOWATT * heat)
        # the zones at the end of the step, by the two equations above
        model.set_expression("zone", seen + (self._response - np.diag(own)) @ (KILOWATT * heat))
        cost = known["electricity"] * plant["electric_power"] + known["gas"] * plant["fuel_power"]
        model.set_expression("energy", cost * self.step / HOUR / KILOWATT)
        model.setup()

    def _set_up(self, model: Any) -> None:
        mpc, channels = self._mpc, self.problem.predictor.channels
        mpc.settings.n_horizon, mpc.settings.t_step = self.count, self.step
        mpc.settings.nlpsol_opts = OPTIONS
        mpc.settings.store_full_solution = False
        mpc.set_objective(mterm=0.0 * model.x["water"], lterm=model.aux["energy"])
        mpc.set_rterm(air=self.problem.move_weight, hot=self.problem.move_weight)
        for name, channel in zip(("air", "hot"), channels, strict=True):
            mpc.scaling["_u", name] = channel.upper - channel.lower
            mpc.bounds["lower", "_u", name] = channel.lower - REFERENCE_TEMPERATURE
            mpc.bounds["upper", "_u", name] = channel.upper - REFERENCE_TEMPERATURE
        mpc.scaling["_x", "water"] = 10.0
        weight, zone = model.tvp["weight"], model.aux["zone"] + REFERENCE_TEMPERATURE
        for name, excess in (("cold", model.tvp["lower"] - zone), ("warm", zone - model.tvp["upper"])):
            mpc.set_nl_cons(name, weight * excess, 0.0, soft_constraint=True, penalty_term_cons=self.slack_price)
        template = mpc.get_tvp_template()

        def given(_: float) -> object:
            if self._data is not None:
                rows = self._future(self._data)
                template.master = ca.DM(np.vstack([rows, rows[-1:]]).ravel())
            return template

        mpc.set_tvp_fun(given)
        mpc.setup()

    def _future(self, d: HorizonData) -> np.ndarray:
        """Lay out what is known of the future, a row a step, in the order of the model's parameters."""
        horizon, outside = self.problem.predictor.horizon, d.boundary.copy()
        outside[:, : outside.shape[1] - self.modes.n_signal] -= REFERENCE_TEMPERATURE
        free = d.gains + np.exp(-horizon.edges[:-1] / self.lasting)[:, None] * d.disturbance
        hours = np.full((self.count, 1), self.step / HOUR)
        hours[-1] += self.problem.terminal_time / HOUR
        columns = (
            outside, free, d.outdoor_temperature, d.outdoor_humidity, d.heating_setpoint, d.cooling_setpoint,
                   d.running, d.boiler, d.ventilation, d.electricity_price, d.gas_price, d.lower, d.upper,
                   d.comfort_price * hours / self.slack_price)  # fmt: skip
        return np.hstack([np.asarray(c).reshape(self.count, -1) for c in columns])

    def forget(self) -> None:
        """Nothing is kept between solves."""

    def solve(self, data: HorizonData, plan: np.ndarray, time_limit: float | None = None) -> Solution:
        """Solve for one horizon, as a `Solver`. There is no limit of time: iterations are limited."""
        del time_limit
        begin, predictor = time.perf_counter(), self.problem.predictor
        first = predictor.rollout(data, plan)
        start = self.problem.terms(data, first).total
        with _quiet():
            found = self._step(data, first)
        stats = self._mpc.solver_stats
        ahead = predictor.rollout(data, found, first) if np.isfinite(found).all() else first
        terms = self.problem.terms(data, ahead)
        status = Status.CONVERGED if stats["success"] else Status.FAILED
        if str(stats["return_status"]) == "Maximum_Iterations_Exceeded" and terms.total <= start:
            status = Status.ITERATION_LIMIT  # its last point, which do-mpc itself would act upon
        return Solution(
            found, ahead, terms, max(start, terms.total), status, str(stats["return_status"]),
            int(stats["iter_count"]), time.perf_counter() - begin, "do-mpc",
        )  # fmt: skip

    def _step(self, data: HorizonData, first: Rollout) -> np.ndarray:
        """Let do-mpc make its step from a roll-out; returns its plan."""
        self._data, mpc, channels = data, self._mpc, self.problem.predictor.channels
        states = self._begin(data, first)
        mpc.reset_history()
        mpc.u0 = data.previous - REFERENCE_TEMPERATURE
        mpc.make_step(states[0])
        lower, upper = np.array([c.lower for c in channels]), np.array([c.upper for c in channels])
        shares = np.array([np.array(mpc.opt_x_num["_u", k, 0]).ravel() for k in range(self.count)])
        return np.clip(REFERENCE_TEMPERATURE + shares * (upper - lower), lower, upper)

    def zones(self) -> np.ndarray:
        """Zone temperatures that do-mpc's last plan leads to in its own equations, at the ends of the steps [K]."""
        values = [np.array(self._mpc.opt_aux_num["_aux", k, 0, "zone"]).ravel() for k in range(self.count)]
        return np.array(values) + REFERENCE_TEMPERATURE

    def _begin(self, data: HorizonData, first: Rollout) -> np.ndarray:
        """Put a roll-out into do-mpc's first guess; returns its states."""
        mpc, known = self._mpc, self._future(data)
        n_boundary, n = data.boundary.shape[1], data.n_zone
        free = known[:, :n_boundary] @ self.modes.boundary.T
        free += (known[:, n_boundary : n_boundary + n] + first.heat) @ self.modes.heating.T
        modes = [data.state]
        for push in free:
            modes.append(self._part.end * modes[-1] + self._part.end_gain * push)
        water = first.inputs[:, 0]
        water = np.append(water, water[-1]) - REFERENCE_TEMPERATURE
        states = np.column_stack([np.array(modes) / self._unit, water])
        inputs = first.plan - REFERENCE_TEMPERATURE
        seen = np.hstack([first.seen - REFERENCE_TEMPERATURE, first.heat / KILOWATT])
        excess = np.hstack([data.lower - first.zone[1:], first.zone[1:] - data.upper])
        slack = np.maximum(excess * np.tile(known[:, -n:], 2), 0.0)
        scale = mpc.opt_x_scaling
        for k in range(self.count):
            mpc.opt_x_num["_x", k, 0, -1] = states[k] / scale["_x", k, 0, -1]
            mpc.opt_x_num["_u", k, 0] = inputs[k] / scale["_u", k, 0]
            mpc.opt_x_num["_z", k, 0, -1], mpc.opt_x_num["_eps", k, 0] = seen[k], slack[k]
        mpc.opt_x_num["_x", self.count, 0, -1] = states[-1] / scale["_x", self.count, 0, -1]
        mpc.flags["set_initial_guess"] = True
        return states


def do_mpc_controller(ours: MpcController) -> MpcController:
    """Put do-mpc in the place of a controller's solver; observer, forecasts, prices and faults stay as they are."""
    lasting = ours.observer.kalman.disturbance.time_constant
    solver = DoMpcSolver(ours.problem, ours.settings.comfort_price, lasting)
    return MpcController(solver, ours.observer, ours.points, ours.settings, ours.signals)
