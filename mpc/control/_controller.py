"""The receding-horizon controller: measures, estimates, solves, and falls back where it must."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mpc.control._assembly import ComfortOperation, Expected, expect, peak_data
from mpc.control._data import HorizonData
from mpc.control._explain import explain_comfort
from mpc.control._observer import Observer
from mpc.control._problem import ControlProblem
from mpc.control._reading import Readings, SitePoints
from mpc.control._rules import ResetRule
from mpc.control._solution import Solution, Solver
from mpc.errors import MpcError
from mpc.scenario import DemandCharge, Forecast, StepGrid

FloatArray = NDArray[np.float64]

_USUAL_HUMIDITY = 0.006  # kg/kg, as `thermal.hvac` has it where none is measured


class Source(StrEnum):
    """Where an action comes from."""

    OPTIMAL = "optimal plan"
    PREVIOUS = "previous plan"
    RULES = "rules"


@dataclass(frozen=True, eq=False)
class Action(Mapping[str, float]):
    """Setpoints for the next control step, by ``ENTITY/POINT``, and why.

    Parameters
    ----------
    setpoints : dict of str to float
        Finite, within the ranges of their channels [K or Pa].
    source : Source
        Optimal plan, previous plan or rules.
    reasons : tuple of str
        In words: what failed, what was missing, where comfort is not met and what stands in its way.
    solution : Solution or None
        Of the solver; None where it did not run or broke.
    stamp : pandas.Timestamp
        When the action begins.
    """

    setpoints: dict[str, float]
    source: Source
    reasons: tuple[str, ...]
    solution: Solution | None
    stamp: pd.Timestamp

    def __getitem__(self, name: str) -> float:
        return self.setpoints[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.setpoints)

    def __len__(self) -> int:
        return len(self.setpoints)


@dataclass(frozen=True)
class ControllerSettings:
    """What a controller pays for, and how long it may think.

    Parameters
    ----------
    comfort_price : float
        Of a zone's kelvin outside of its band for an hour [currency/K/h].
    carbon_price : float
        Of emissions [currency/kg].
    heat_value : float
        Of heat that the building holds at the end [currency/kWh].
    time_limit : float
        Wall time of a solve [s].
    operation : ComfortOperation
        Schedules of the building's automation.
    rule : ResetRule
        First guess, and what is done when there is no plan.
    demand : tuple of DemandCharge
        Of the tariff.
    """

    comfort_price: float = 0.2
    carbon_price: float = 0.0
    heat_value: float = 0.0
    time_limit: float = 60.0
    operation: ComfortOperation = field(default_factory=ComfortOperation)
    rule: ResetRule = field(default_factory=ResetRule)
    demand: tuple[DemandCharge, ...] = ()


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
        self._forecast: Forecast | None = None
        self._gains: FloatArray | None = None
        self._peaks: dict[str, float] = {}
        # of each charge: start of the window that runs [s since 1970], and energy used in it [J]
        self._windows = [(0.0, 0.0)] * len(self.settings.demand)
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
            peaks=peak_data(settings.demand, horizon, now, self._peaks, self._used(now)),
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
        before = boundary[0].copy()
        if np.isfinite(read.outdoor):
            before[0] = read.outdoor
        if not self._started:
            middle = 0.5 * (expected.band[0][0] + expected.band[1][0])
            self.observer.start(np.where(np.isfinite(read.zone), read.zone, middle), before)
            self._started = True
        else:
            gains = np.zeros_like(read.heat) if self._gains is None else self._gains
            planned = np.zeros_like(read.heat) if self._heat is None else self._heat
            self.observer.update(read.zone, np.where(np.isfinite(read.heat), read.heat, planned) + gains, before)
        self._gains = expected.gains[0]
        self._count_demand(read.electricity, now)
        self._water = read.water if np.isfinite(read.water) else self._water
        return self._water

    def _count_demand(self, electricity: float, now: pd.Timestamp) -> None:
        """Add the power of the step that has ended to the window that it began in; a window that is over is a peak."""
        step = self.problem.predictor.horizon.control_step
        for k, charge in enumerate(self.settings.demand):
            begin = float(np.floor((now.timestamp() - step) / charge.window) * charge.window)
            start, used = self._windows[k] if self._windows[k][0] == begin else (begin, 0.0)
            used += electricity * step if np.isfinite(electricity) else 0.0
            if now.timestamp() >= begin + charge.window:
                one = pd.Timestamp(begin, unit="s", tz="UTC").tz_convert(now.tz)
                for name in charge.on(StepGrid(one, charge.window, 1)).names:
                    self._peaks[name] = max(self._peaks.get(name, 0.0), used / max(charge.window, step))
                start, used = begin + charge.window, 0.0
            self._windows[k] = (start, used)

    def _used(self, now: pd.Timestamp) -> list[float]:
        """Mean power since the window of now began, of each charge [W]."""
        means = []
        for (start, energy), charge in zip(self._windows, self.settings.demand, strict=True):
            lasted = now.timestamp() - start
            means.append(energy / lasted if 0.0 < lasted < charge.window else 0.0)
        return means

    def _solve(self, data: HorizonData, now: pd.Timestamp, reasons: list[str]) -> Solution | None:
        reasons.extend(self.problem.explain_limits(data))
        first = self._shifted(now)
        if first is None:
            first = self.settings.rule.plan(self.problem.predictor, data.outdoor_temperature)
        try:
            solution = self.solver.solve(data, first, self.settings.time_limit)
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
            "gains": None if self._gains is None else self._gains.copy(), "peaks": dict(self._peaks),
            "windows": list(self._windows), "memory": self.solver.memory, "heat": self._heat,
            "water": self._water,
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
        self._gains, self._peaks, self._windows = saved["gains"], dict(saved["peaks"]), list(saved["windows"])
        self._heat, self._water = saved["heat"], saved["water"]
        self.solver.memory = saved["memory"]
