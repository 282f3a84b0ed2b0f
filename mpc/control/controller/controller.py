"""The receding-horizon controller: measures, estimates, solves, and falls back where it must."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import pandas as pd

from mpc.control.controller.observer import Observer
from mpc.control.controller.outlook import PlanOutlook
from mpc.control.controller.ranges import READINGS
from mpc.control.controller.site import Action, ControllerSettings, Reading, SitePoints, Source
from mpc.control.controller.watch import FarFromModel, PossibleReadings, StuckSensors, explain_comfort
from mpc.control.problem.assembly import DemandCount, Expected, expect
from mpc.control.problem.horizon import HorizonData
from mpc.control.problem.problem import ControlProblem
from mpc.control.solvers.solution import Solution, Solver, Starts, Status
from mpc.errors import ControlError, MpcError
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.points import possible_values
from thermal.case.years import EXPECTED, shown, within_years

Measured = Mapping[str, float]  # by ``ENTITY/POINT``
_USUAL_HUMIDITY = 0.006  # kg/kg, as `thermal.components` has it where none is measured


@dataclass
class _Known:
    """What the next action depends on, beside observer, solver and watches."""

    previous: FloatArray
    started: bool = False
    plan: tuple[pd.Timestamp, FloatArray] | None = None
    forecast: Forecast | None = None
    gains: FloatArray | None = None
    heat: FloatArray | None = None
    water: float = 293.15


@dataclass(eq=False, repr=False)
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

    Attributes
    ----------
    outlook : PlanOutlook or None
        What the plan of the last step is expected to lead to; None where something else is followed.

    Notes
    -----
    What goes wrong in a step does not raise: what is missing is filled in or falls back, and `Action.reasons` says so.
    The order is: optimal plan, the previous plan as far as it reaches, rules.
    """

    solver: Solver
    observer: Observer
    points: SitePoints
    settings: ControllerSettings = field(default_factory=ControllerSettings)
    signals: Callable[[Forecast, pd.DatetimeIndex], FloatArray] | None = None

    def __post_init__(self) -> None:
        self.problem: ControlProblem = self.solver.problem
        self._horizon, self._channels = self.problem.predictor.horizon, self.problem.predictor.channels
        self._system = self.problem.predictor.hvac.system
        self.points.fit(self._system)
        self._known = _Known(self.settings.rule.setpoints(self._channels, 283.15))
        self._starts = Starts(self.settings.second_start)
        self._demand = DemandCount(self.settings.demand)
        self._possible = PossibleReadings(self.points.columns)
        noise = np.sqrt(self.observer.kalman.whole.noise_variance)
        self._stuck = StuckSensors(self.points.zones, noise, self.settings.false_alarm, self.settings.resolution)
        self._far = FarFromModel(self.points.zones, self.observer.innovation_deviation)
        self.outlook: PlanOutlook | None = None

    def step(self, measurements: Measured, forecast: Forecast | None, now: pd.Timestamp | None = None) -> Action:
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
        stamp, solution, self.outlook = self._now(measurements, forecast, now, reasons), None, None
        seen = self._possible.update(measurements, stamp, reasons)
        try:
            data = self._data(seen, _possible(forecast, reasons), stamp, reasons)
        except MpcError as error:
            reasons.append(str(error))
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
            reasons.append(f"state or forecast could not be used: {error}")
        else:
            rules = self.settings.rule.plan(self.problem.predictor, data.outdoor_temperature)
            solution = self._solve(data, rules, stamp, reasons)
            if solution is not None and solution.usable:
                self.outlook = PlanOutlook(self.problem, data, solution, rules)
        values, source = self._choose(solution, stamp, seen, reasons)
        self._known.previous = self._safe(values, reasons)
        named = self.points.setpoints(self._channels, self._known.previous, self.problem.predictor.hvac)
        return Action(named, source, tuple(reasons), solution, stamp)

    def start_up(self, telemetry: pd.DataFrame) -> pd.DataFrame:
        """Bring the state up from telemetry of the time before the first step; nothing is decided.

        Walls and slabs remember a day or two; without this they begin at rest with the zones as they are. Energy that
        was metered counts for the month's demand charges.

        Parameters
        ----------
        telemetry : DataFrame, shape (n_time, n_column)
            Means over steps that end at the stamps, which have a time zone; by ``ENTITY/POINT`` in the library's units,
            as `thermal.case.telemetry.Telemetry` has them; ``ZONE/internal_gain`` [W] is expected heat of people,
            lights and
            equipment, none where absent. NaN is missing.

        Returns
        -------
        DataFrame, shape (n_step, n_zone)
            Heat in the zones that the model lacked, by the end of the control step as far as it was known then [W].

        Raises
        ------
        ControlError
            When there is less than a control step, no zone ever reports, or the model has effects whose weather lacks.

        Examples
        --------
        >>> controller.start_up(case.telemetry.frame.loc["2023-01-09":"2023-01-11"])  # doctest: +SKIP
        """
        steps = self.points.past_steps(telemetry, self._horizon.control_step)
        others = np.zeros((len(steps), 0))
        if self.signals is not None:
            stamps = pd.DatetimeIndex([stamp for stamp, *_ in steps])
            others = self.signals(self.points.past_forecast(telemetry), stamps)
        started, lacked, held = False, [], np.zeros(len(self.points.zones))
        reads = [self.points.read(measured, self._system) for _, measured, *_ in steps]
        never = np.isnan([read.heat for read in reads]).all(axis=0)  # such heat counts as unmeasured
        for (stamp, _, outdoor, gains), read, other in zip(steps, reads, others, strict=True):
            boundary, metered = np.concatenate([[outdoor], other]), np.isfinite(read.heat) | never
            held = np.where(np.isfinite(read.heat), read.heat, held)
            if started:
                # where heat was lost the model goes on alone, or it would be taken for heat that the model lacks
                zone, given = np.where(metered, read.zone, np.nan), self.observer.with_emitted(boundary, held)
                self.observer.update(zone, held + gains, given)
            elif (seen := np.isfinite(read.zone)).any():
                self.observer.start(np.where(seen, read.zone, read.zone[seen].mean()), boundary)
                started = True
            self._count(read, stamp)
            lacked.append(self.observer.disturbance.copy())
        ControlError.unless(started, "start-up: telemetry", "a zone that reports", "none that does")
        self._known.started, self._known.gains = True, steps[-1][3]
        return pd.DataFrame(lacked, index=[stamp for stamp, *_ in steps], columns=list(self.points.zones))

    def _now(
        self, measurements: Measured, forecast: Forecast | None, now: pd.Timestamp | None, reasons: list[str]
    ) -> pd.Timestamp:
        given = now if now is not None else getattr(measurements, "stamp", None)
        if given is not None:
            stamp = pd.DatetimeIndex([given])
            if stamp.tz is not None and within_years(stamp)[0]:
                return pd.Timestamp(given)
            reasons.append(f"the time of the step is {shown(stamp, 0)}, not one of {EXPECTED} in a time zone: not used")
        step = pd.Timedelta(seconds=self._horizon.control_step)
        if forecast is not None:
            index = forecast.table.index
            return pd.Timestamp(index[0]) - (index[1] - index[0] if len(index) > 1 else step)
        if self._known.plan is not None:
            return self._known.plan[0] + step
        raise MpcError("controller: expected the time of a first step, got none; pass now= or a forecast")

    def _data(
        self, measurements: Measured, forecast: Forecast | None, now: pd.Timestamp, reasons: list[str]
    ) -> HorizonData:
        settings, horizon = self.settings, self._horizon
        fill: Literal["hold"] | None = None
        if forecast is None:
            reasons.append("forecast is late: the last one is used, its end held")
            forecast, fill = self._known.forecast, "hold"
        if forecast is None:
            raise MpcError("forecast is late and there is none from before")
        try:
            expected = expect(forecast, horizon, now, self.points.zones, settings.carbon_price, fill)
        except MpcError as error:
            reasons.append(str(error))
            expected = expect(forecast, horizon, now, self.points.zones, settings.carbon_price, "hold")
        self._known.forecast = forecast
        boundary = expected.outdoor_temperature[:, None]
        if self.signals is not None:
            boundary = np.hstack([boundary, self.signals(forecast, horizon.stamps(now))])
        self._estimate(measurements, expected, boundary[0].copy(), now, reasons)
        schedule, given = settings.operation.schedule(expected.band, horizon.edges), expected._asdict()
        del given["band"]
        every = np.ones(self.problem.predictor.hvac.n_air_handler)
        return HorizonData(
            **given, state=self.observer.modal_state.copy(), water=self._known.water,
            disturbance=self.observer.disturbance.copy(), previous=self._known.previous, boundary=boundary,
            outdoor_humidity=np.full(len(horizon), _USUAL_HUMIDITY), heating_setpoint=schedule.heating,
            cooling_setpoint=schedule.cooling, running=np.outer(schedule.running, every),
            ventilation=np.outer(schedule.ventilation, every), boiler=schedule.running,
            comfort_price=np.full(expected.gains.shape, settings.comfort_price), heat_value=settings.heat_value,
            peaks=self._demand.ahead(horizon, now),
        )  # fmt: skip

    def _estimate(
        self, measurements: Mapping[str, float], expected: Expected, before: FloatArray, now: pd.Timestamp,
        reasons: list[str],
    ) -> None:  # fmt: skip
        """Bring the state up to now, over a step with the boundary conditions before it."""
        read, known = self.points.read(measurements, self._system), self._known
        stuck = self._stuck.update(read.zone)
        zone, heat = np.where(stuck, np.nan, read.zone), np.where(stuck, np.nan, read.heat)
        reasons.extend(read.missing)
        reasons.extend(
            f"zone temperature of {self.points.zones[k]!r} has been {read.zone[k] - 273.15:.2f} degC for "
            f"{self._stuck.needed[k]} steps or more: taken for stuck, its model goes on alone"
            for k in np.flatnonzero(stuck)
        )
        if np.isfinite(read.outdoor):
            before[0] = read.outdoor
        likely = np.where(np.isfinite(zone), zone, 0.5 * (expected.band[0][0] + expected.band[1][0]))
        restart = not known.started
        if known.started:
            gains, planned = (np.zeros_like(heat) if h is None else h for h in (known.gains, known.heat))
            given = np.where(np.isfinite(heat), heat, planned)
            innovation = self.observer.update(zone, given + gains, self.observer.with_emitted(before, given))
            restart = self._far.update(innovation, reasons)
        if restart:
            self.observer.start(likely, before)
        known.started, known.gains = True, expected.gains[0]
        self._count(read, now)

    def _count(self, read: Reading, now: pd.Timestamp) -> None:
        """Take in metered power, and the supply water's temperature where it is known."""
        self._demand.add(read.electricity, now, self._horizon.control_step)
        self._known.water = read.water if np.isfinite(read.water) else self._known.water

    def _solve(
        self, data: HorizonData, rules: FloatArray, now: pd.Timestamp, reasons: list[str]
    ) -> Solution | None:
        reasons.extend(self.problem.explain_limits(data))
        back_off = self.settings.back_off
        narrowed = data if back_off is None else back_off.narrow(data)
        try:
            solution, changed = self._starts.solve(
                self.solver, narrowed, self._shifted(now), rules, now, self.settings.time_limit
            )
        except Exception as error:  # whatever a solver dies of, the building goes on
            reasons.append(f"solver broke: {type(error).__name__}: {error}")
            self.solver.forget()
            return None
        if changed:
            reasons.append("a plan begun anew is cheaper than the one carried on: it is used")
        ended = f"{solution.solver} solver: {solution.status}, {solution.message}"
        if not solution.usable:
            reasons.append(ended)
            self.solver.forget()
            return solution
        held = self._horizon.edges[1:] <= self._horizon.control_step + 1e-6
        self._known.heat = solution.rollout.heat[held].mean(axis=0)
        if solution.status is not Status.CONVERGED:
            reasons.append(f"{ended}; its best plan is used")
        reasons.extend(explain_comfort(self.problem, data, solution, self.points.zones, now))
        return solution

    def _shifted(self, now: pd.Timestamp) -> FloatArray | None:
        if self._known.plan is None:
            return None
        stamp, plan = self._known.plan
        age = (now - stamp).total_seconds()
        return self._horizon.shifted(plan, age) if 0.0 <= age < self._horizon.edges[-1] else None

    def _choose(
        self, solution: Solution | None, now: pd.Timestamp, measurements: Mapping[str, float], reasons: list[str]
    ) -> tuple[FloatArray, Source]:
        if solution is not None and solution.usable:
            self._known.plan = (now, solution.plan)
            return solution.plan[0], Source.OPTIMAL
        shifted = self._shifted(now)
        if shifted is not None:
            reasons.append("the previous plan is followed")
            return shifted[0], Source.PREVIOUS
        reasons.append("no plan: the rules decide")
        outdoor = self.points.read(measurements, self._system).outdoor
        return self.settings.rule.setpoints(self._channels, outdoor), Source.RULES

    def _safe(self, values: FloatArray, reasons: list[str]) -> FloatArray:
        """Hold setpoints within ranges and rates; what is not finite becomes what stood before."""
        hours, previous, lost = self._horizon.control_step / 3600.0, self._known.previous, ~np.isfinite(values)
        lower, upper, most = np.array([(c.lower, c.upper, c.rate * hours) for c in self._channels]).T
        names = (self._channels[k].name for k in np.flatnonzero(lost))
        reasons.extend(f"{name} was not finite: what stood before stays" for name in names)
        before = np.clip(previous, lower, upper)
        moved = np.clip(np.where(lost, previous, values), before - most, before + most)
        return np.asarray(np.clip(moved, lower, upper))

    def save_state(self) -> dict[str, Any]:
        """Everything that the next actions depend on, as plain values and arrays."""
        return {
            "possible": dict(self._possible.memory),
            "known": vars(self._known).copy(), "estimate": self.observer.memory, "solver": self.solver.memory,
            "peaks": dict(self._demand.peaks), "windows": list(self._demand.windows), "stuck": self._stuck.memory,
            "far": self._far.count, "begun": self._starts.begun,
        }  # fmt: skip

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Return to a saved state.

        Parameters
        ----------
        saved : mapping of str to object
            Of `save_state`.
        """
        self._known, self.observer.memory = _Known(**saved["known"]), saved["estimate"]
        self._stuck.memory, self._far.count, self._starts.begun = saved["stuck"], saved["far"], saved["begun"]
        self._possible.memory = dict(saved.get("possible", {}))
        self._demand.peaks, self._demand.windows = dict(saved["peaks"]), list(saved["windows"])
        self.solver.memory = saved["solver"]


def _possible(forecast: Forecast | None, reasons: list[str]) -> Forecast | None:
    """Take out of a forecast what cannot be; it counts as missing."""
    if forecast is None:
        return None
    kept = possible_values(forecast.table, READINGS)
    lost = forecast.table.notna() & kept.isna()
    for column in forecast.table.columns[lost.any()]:
        reasons.append(f"forecast of {column}: {int(lost[column].sum())} values that cannot be count as missing")
    return Forecast(kept) if lost.any(axis=None) else forecast
