"""The receding-horizon controller: measures, estimates, solves, and falls back where it must."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from mpc.control.controller.action import Action, ControllerSettings, Source
from mpc.control.controller.observer import Observer
from mpc.control.controller.reading import Readings, SitePoints
from mpc.control.controller.start_up import past_forecast, past_steps
from mpc.control.controller.watch import FarFromModel, StuckSensors
from mpc.control.problem.assembly import Expected, expect, peak_data
from mpc.control.problem.data import HorizonData
from mpc.control.problem.demand_count import DemandCount
from mpc.control.problem.explain import explain_comfort
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.solution import Solution, Solver, Status
from mpc.control.solvers.starts import Starts
from mpc.errors import ControlError, MpcError
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.errors import describe

_USUAL_HUMIDITY = 0.006  # kg/kg, as `thermal.components` has it where none is measured


class MpcController:
    """Optimal setpoints over a receding horizon, with an honest fallback.

    Parameters
    ----------
    solver : Solver
        Of the problem, such as `SequentialSolver`.
    observer : Observer
        Of the same model; its step is the horizon's control step.
    points : SitePoints
        Names of zones and devices.
    settings : ControllerSettings
        Prices and limits.
    signals : callable, optional
        Called as ``signals(forecast, stamps)``; gives the boundaries beside the outdoor air and the signals of
        effects, one row a step. Needed where the model has any.

    Notes
    -----
    What goes wrong in a step does not raise: what is missing is filled in or falls back, and `Action.reasons` says so.
    The order is: optimal plan, the previous plan as far as it reaches, rules.
    """

    def __init__(
        self,
        solver: Solver,
        observer: Observer,
        points: SitePoints,
        settings: ControllerSettings | None = None,
        signals: Callable[[Forecast, pd.DatetimeIndex], FloatArray] | None = None,
    ) -> None:
        self.solver, self.observer, self.points = solver, observer, points
        self.settings, self.signals = settings or ControllerSettings(), signals
        self.problem: ControlProblem = solver.problem
        self._readings = Readings(points, self.problem.predictor.hvac.system)
        self._previous = self.settings.rule.setpoints(self.problem.predictor.channels, 283.15)
        self._plan: tuple[pd.Timestamp, FloatArray] | None = None
        self._starts = Starts(self.settings.second_start)
        self._forecast: Forecast | None = None
        self._gains: FloatArray | None = None
        self._demand = DemandCount(self.settings.demand)
        self._stuck = StuckSensors(
            points.zones, np.sqrt(observer.kalman.whole.noise_variance), self.settings.false_alarm,
            self.settings.resolution,
        )  # fmt: skip
        self._far = FarFromModel(points.zones, observer.innovation_deviation)
        self._heat: FloatArray | None = None
        self._water = 293.15
        self._started = False

    def step(
        self, measurements: Mapping[str, float], forecast: Forecast | None, now: pd.Timestamp | None = None
    ) -> Action:
        """Choose setpoints for the next control step.

        Parameters
        ----------
        measurements : mapping of str to float
            Means over the control step that has ended, by ``ENTITY/POINT`` [library's units]; NaN or absent is missing.
        forecast : Forecast or None
            From now on; None when it is late: the last one is used as far as it reaches.
        now : pandas.Timestamp, optional
            End of the control step, in the building's time zone; by default ``measurements.stamp``, else where the
            forecast begins.

        Raises
        ------
        MpcError
            Only in a first step that nothing tells the time of.
        """
        reasons: list[str] = []
        stamp = self._now(measurements, forecast, now)
        data, solution = None, None
        try:
            data = self._data(measurements, forecast, stamp, reasons)
        except MpcError as error:
            reasons.append(str(error))
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            reasons.append(f"state or forecast could not be used: {error}")
        if data is not None:
            solution = self._solve(data, stamp, reasons)
        values, source = self._choose(solution, stamp, measurements, reasons)
        values = self._safe(values, reasons)
        self._previous = values
        named = self.points.setpoints(self.problem.predictor.channels, values, self.problem.predictor.hvac)
        return Action(named, source, tuple(reasons), solution, stamp)

    def start_up(self, telemetry: pd.DataFrame) -> None:
        """Bring the state up from telemetry of the time before the first step; nothing is decided.

        Walls and slabs remember a day or two; without this they begin at rest with the zones as they are. Energy that
        was metered counts for the month's demand charges.

        Parameters
        ----------
        telemetry : DataFrame, shape (n_time, n_column)
            Means over steps that end at the stamps, which have a time zone; by ``ENTITY/POINT`` in the library's units,
            as `thermal.case.Telemetry` has them; ``ZONE/internal_gain`` [W] is expected heat of people, lights and
            equipment, none where absent. NaN is missing.

        Raises
        ------
        ControlError
            When there is less than a control step, no zone ever reports, or the model has effects whose weather lacks.

        Examples
        --------
        >>> controller.start_up(case.telemetry.frame.loc["2023-01-09":"2023-01-11"])  # doctest: +SKIP
        """
        control_step = self.problem.predictor.horizon.control_step
        steps = past_steps(telemetry, self.points, control_step)
        others = np.zeros((len(steps), 0))
        if self.signals is not None:
            stamps = pd.DatetimeIndex([step.stamp for step in steps])
            others = self.signals(past_forecast(telemetry, self.points), stamps)
        started = False
        for step, other in zip(steps, others, strict=True):
            read = self._readings.read(step.measured)
            boundary, seen = np.concatenate([[step.outdoor], other]), np.isfinite(read.zone)
            if started:
                self.observer.update(read.zone, np.nan_to_num(read.heat) + step.gains, boundary)
            elif seen.any():
                self.observer.start(np.where(seen, read.zone, read.zone[seen].mean()), boundary)
                started = True
            self._demand.add(read.electricity, step.stamp, control_step)
            self._water = read.water if np.isfinite(read.water) else self._water
        if not started:
            raise ControlError(describe("start-up: telemetry", "a zone that reports", "none that does"))
        self._started, self._gains = True, steps[-1].gains

    def _now(
        self, measurements: Mapping[str, float], forecast: Forecast | None, now: pd.Timestamp | None
    ) -> pd.Timestamp:
        given = now if now is not None else getattr(measurements, "stamp", None)
        if given is not None:
            return pd.Timestamp(given)
        step = pd.Timedelta(seconds=self.problem.predictor.horizon.control_step)
        if forecast is not None:
            index = forecast.table.index
            return pd.Timestamp(index[0]) - (index[1] - index[0] if len(index) > 1 else step)
        if self._plan is not None:
            return self._plan[0] + step
        raise MpcError("controller: expected the time of a first step, came none; pass now= or a forecast")

    def _data(
        self, measurements: Mapping[str, float], forecast: Forecast | None, now: pd.Timestamp, reasons: list[str]
    ) -> HorizonData:
        settings, horizon = self.settings, self.problem.predictor.horizon
        fill = None
        if forecast is None:
            reasons.append("forecast is late: the last one is used, its end held")
            forecast, fill = self._forecast, "hold"
        if forecast is None:
            raise MpcError("forecast is late and there is none from before")
        try:
            expected = expect(forecast, horizon, now, self.points.zones, settings.carbon_price, fill)  # type: ignore[arg-type]
        except MpcError as error:
            reasons.append(str(error))
            expected = expect(forecast, horizon, now, self.points.zones, settings.carbon_price, "hold")
        self._forecast = forecast
        boundary = self._boundary(expected, forecast, horizon.stamps(now))
        water = self._estimate(measurements, expected, boundary, now, reasons)
        schedule = settings.operation.schedule(expected.band, horizon.edges)
        n_steps, n_zone = expected.gains.shape
        n_air = self.problem.predictor.hvac.n_air_handler
        return HorizonData(
            state=self.observer.modal_state.copy(), water=water, disturbance=self.observer.disturbance.copy(),
            previous=self._previous, boundary=boundary, outdoor_temperature=expected.outdoor_temperature,
            outdoor_humidity=np.full(n_steps, _USUAL_HUMIDITY), gains=expected.gains, lower=expected.lower,
            upper=expected.upper, heating_setpoint=schedule.heating, cooling_setpoint=schedule.cooling,
            running=np.repeat(schedule.running[:, None], n_air, axis=1),
            ventilation=np.repeat(schedule.ventilation[:, None], n_air, axis=1), boiler=schedule.running,
            electricity_price=expected.electricity_price, gas_price=expected.gas_price,
            comfort_price=np.full((n_steps, n_zone), settings.comfort_price),
            peaks=peak_data(settings.demand, horizon, now, self._demand.peaks, self._demand.used(now)),
            heat_value=settings.heat_value,
        )  # fmt: skip

    def _boundary(self, expected: Expected, forecast: Forecast, stamps: pd.DatetimeIndex) -> FloatArray:
        outdoor = expected.outdoor_temperature[:, None]
        return outdoor if self.signals is None else np.hstack([outdoor, self.signals(forecast, stamps)])

    def _estimate(
        self,
        measurements: Mapping[str, float],
        expected: Expected,
        boundary: FloatArray,
        now: pd.Timestamp,
        reasons: list[str],
    ) -> float:
        """Bring the state up to now; returns the supply water's temperature [K]."""
        read = self._readings.read(measurements)
        reasons.extend(read.missing)
        stuck = self._stuck.update(read.zone)
        zone, heat = np.where(stuck, np.nan, read.zone), np.where(stuck, np.nan, read.heat)
        reasons.extend(
            f"zone temperature of {self.points.zones[k]!r} has been {read.zone[k] - 273.15:.2f} degC for "
            f"{self._stuck.needed[k]} steps or more: taken for stuck, its model goes on alone"
            for k in np.flatnonzero(stuck)
        )
        before = boundary[0].copy()
        if np.isfinite(read.outdoor):
            before[0] = read.outdoor
        middle = 0.5 * (expected.band[0][0] + expected.band[1][0])
        known = np.where(np.isfinite(zone), zone, middle)
        if not self._started:
            self.observer.start(known, before)
            self._started = True
        else:
            gains = np.zeros_like(heat) if self._gains is None else self._gains
            planned = np.zeros_like(heat) if self._heat is None else self._heat
            innovation = self.observer.update(zone, np.where(np.isfinite(heat), heat, planned) + gains, before)
            if self._far.update(innovation, reasons):
                self.observer.start(known, before)
        self._gains = expected.gains[0]
        self._demand.add(read.electricity, now, self.problem.predictor.horizon.control_step)
        self._water = read.water if np.isfinite(read.water) else self._water
        return self._water

    def _solve(self, data: HorizonData, now: pd.Timestamp, reasons: list[str]) -> Solution | None:
        reasons.extend(self.problem.explain_limits(data))
        carried, limit, back_off = self._shifted(now), self.settings.time_limit, self.settings.back_off
        narrowed = data if back_off is None else back_off.narrow(data)
        rules = self.settings.rule.plan(self.problem.predictor, data.outdoor_temperature)
        try:
            solution, changed = self._starts.solve(self.solver, narrowed, carried, rules, now, limit)
            if changed:
                reasons.append("a plan begun anew is cheaper than the one carried on: it is used")
        except Exception as error:  # whatever a solver dies of, the building goes on
            reasons.append(f"solver broke: {type(error).__name__}: {error}")
            self.solver.forget()
            return None
        if not solution.usable:
            reasons.append(f"{solution.solver} solver: {solution.status}, {solution.message}")
            self.solver.forget()
        else:
            held = self.problem.predictor.horizon.edges[1:] <= self.problem.predictor.horizon.control_step + 1e-6
            self._heat = solution.rollout.heat[held].mean(axis=0)
            if solution.status is not Status.CONVERGED:
                reasons.append(
                    f"{solution.solver} solver: {solution.status}, {solution.message}; its best plan is used"
                )
            reasons.extend(explain_comfort(self.problem, data, solution, self.points.zones, now))
        return solution

    def _shifted(self, now: pd.Timestamp) -> FloatArray | None:
        if self._plan is None:
            return None
        age = (now - self._plan[0]).total_seconds()
        horizon = self.problem.predictor.horizon
        return horizon.shifted(self._plan[1], age) if 0.0 <= age < horizon.edges[-1] else None

    def _choose(
        self, solution: Solution | None, now: pd.Timestamp, measurements: Mapping[str, float], reasons: list[str]
    ) -> tuple[FloatArray, Source]:
        if solution is not None and solution.usable:
            self._plan = (now, solution.plan)
            return solution.plan[0], Source.OPTIMAL
        shifted = self._shifted(now)
        if shifted is not None:
            reasons.append("the previous plan is followed")
            return shifted[0], Source.PREVIOUS
        reasons.append("no plan: the rules decide")
        outdoor = self._readings.read(measurements).outdoor
        return self.settings.rule.setpoints(self.problem.predictor.channels, outdoor), Source.RULES

    def _safe(self, values: FloatArray, reasons: list[str]) -> FloatArray:
        """Hold setpoints within ranges and rates; what is not finite becomes what stood before."""
        channels, hours = self.problem.predictor.channels, self.problem.predictor.horizon.control_step / 3600.0
        safe = np.empty(len(channels))
        for k, (channel, value) in enumerate(zip(channels, values, strict=True)):
            if not np.isfinite(value):
                reasons.append(f"{channel.name} was not finite: what stood before stays")
                value = self._previous[k]
            before = np.clip(self._previous[k], channel.lower, channel.upper)
            value = np.clip(value, before - channel.rate * hours, before + channel.rate * hours)
            safe[k] = np.clip(value, channel.lower, channel.upper)
        return safe

    def save_state(self) -> dict[str, Any]:
        """Everything that the next actions depend on, as plain values and arrays."""
        return {
            "estimate": self.observer.memory, "started": self._started, "previous": self._previous.copy(),
            "plan": None if self._plan is None else (self._plan[0], self._plan[1].copy()), "forecast": self._forecast,
            "gains": None if self._gains is None else self._gains.copy(), "peaks": dict(self._demand.peaks),
            "windows": list(self._demand.windows), "stuck": self._stuck.memory, "far": self._far.count,
            "memory": self.solver.memory, "heat": self._heat, "water": self._water, "begun": self._starts.begun,
        }  # fmt: skip

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Return to a saved state.

        Parameters
        ----------
        saved : mapping of str to object
            Of `save_state`.
        """
        self.observer.memory, self._started = saved["estimate"], saved["started"]
        self._previous, self._plan, self._forecast = saved["previous"].copy(), saved["plan"], saved["forecast"]
        self._gains, self._stuck.memory, self._far.count = saved["gains"], saved["stuck"], saved["far"]
        self._demand.peaks, self._demand.windows = dict(saved["peaks"]), list(saved["windows"])
        self._heat, self._water, self._starts.begun = saved["heat"], saved["water"], saved["begun"]
        self.solver.memory = saved["memory"]
