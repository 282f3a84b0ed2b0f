"""Receding horizon control of an identified plant: duties become runs, with a cost and a limit of starts."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal, get_args

import numpy as np

from calibration.estimation.state_space import REFERENCE
from mpc.control.identified.action import PlannedAction
from mpc.control.identified.ahead import Ahead
from mpc.control.identified.beyond import PowerLearner, bought
from mpc.control.identified.by_rule import estimate_rule
from mpc.control.identified.conformal import AFTER, ConformalBackOff, Guarantee, risen
from mpc.control.identified.electric import Electric, ElectricNow
from mpc.control.identified.meter import ElectricMeter
from mpc.control.identified.mixed_integer import WHOLE, RunLimits, RunPlanner
from mpc.control.identified.observer import GreyBoxObserver
from mpc.control.identified.problem import SCALE, IdentifiedProblem
from mpc.control.identified.runs import HALF, Runs, RunSettings, command_of
from mpc.control.identified.thermostats import Thermostats
from mpc.control.rule_estimate import RuleEstimate
from mpc.control.solvers.solution import Status
from mpc.control.solvers.stages import StageData, StageMethod, StageSolution, StageSolver
from mpc.errors import ControlError
from mpc.identify.machines import as_heated
from mpc.identify.model import PlantModel
from mpc.loop.actuators import Actuator, need_actuator
from mpc.loop.plant import Measurements
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.building import Location

#: Share of a day's starts that may be used at once [-].
_AT_ONCE = 1.0 / 3.0

#: Tolerances of the solver [-]: batteries and charges make problems nearly linear, whose optimum is flat; 1e-3 costs
#: less than a tenth of a percent there.
_EXACT, _LINEAR = 1e-6, 1e-3

#: Who solves where nothing limits machines together, and where something does: there fatrop took its most iterations,
#: 300, in 8 of 10 problems of the office's cold days, making each step shorter as it thought the problem no convex one.
#: Ipopt took 24.
_FREE: StageMethod = "fatrop"
_LIMITED: StageMethod = "ipopt"

#: Plans of a step where a source counts by tangents: a third changed nothing in two days of the office.
_PLANS = 2

#: How machines that are run whole are planned.
RunPlanning = Literal["dithering", "mixed_integer"]


@dataclass(frozen=True)
class IdentifiedSettings:
    """Choices of the controller.

    Parameters
    ----------
    comfort_price : float
        Of a zone's kelvin outside of its band for an hour [currency/K/h]: some hundred times what a kelvin less saves
        a house in an hour, so that bands are left only where they cannot be kept.
    back_off : float
        Distance that is kept from the lower edges of the bands, the upper ones where machines cool [K]; where a
        guarantee is asked for, that of its start.
    start_price : float
        Of a start of a machine [currency]: a compressor of 5,000 that bears 100,000 starts.
    starts : int
        Most starts of a machine within 24 hours.
    run : float
        Shortest run and shortest rest of a machine [s].
    guarantee : Guarantee or None
        Share of violations that is kept; None keeps the back-off as it is.
    runs : str
        How machines that are run whole are planned: ``dithering`` decides the next run or rest and leaves later steps
        relaxed, ``mixed_integer`` decides those of the next six hours at once by HiGHS.

    Raises
    ------
    ControlError
        When the way of planning runs is not known.
    """

    comfort_price: float = 10.0
    back_off: float = 0.0
    start_price: float = 0.05
    starts: int = 10
    run: float = 1800.0
    guarantee: Guarantee | None = field(default_factory=Guarantee)
    runs: RunPlanning = "dithering"

    def __post_init__(self) -> None:
        ControlError.unless_known(self.runs, get_args(RunPlanning), "mpc: runs", "a way of planning them")


class IdentifiedController:
    """Plans a day ahead at every control step, on the grey box with its maps, and does the first step of the plan.

    A machine in duty runs whole steps. At each step the plan is solved twice: with the machine on for its shortest run,
    and off; later steps stay relaxed. The cheaper of the two is done, starts at their price, which grows as the starts
    that are left are used up. A third of a day's starts may be used at once, the others come back evenly over the day,
    so that no 24 hours have more than the limit; a machine that goes off with less than one left is planned to stay off
    until there is one. Deciding the first step by whole numbers and relaxing the rest is
    exact for the step that is done, as far as the relaxed rest is what will come.

    The power of a source that is dear at part load is concave in its load, and such a problem has many local optima. It
    counts by its tangents at the plan before, which lie nowhere below it, so that no plan is worse than the one that it
    begins from (concave-convex procedure, Yuille and Rangarajan 2003, doi:10.1162/08997660360581958). The first plan of
    all begins from the line through nothing and full load.

    Parameters
    ----------
    model : PlantModel
        Identified.
    actuators : sequence of Actuator
        Of the plant.
    location : Location
        Where it stands, for the sun.
    settings : IdentifiedSettings, optional
        Choices.
    electric : Electric, optional
        Battery, photovoltaics and charges; machines alone, by the price of electricity, by default.

    Raises
    ------
    ControlError
        When the plant lacks an actuator of the model, or the battery's.
    """

    def __init__(
        self,
        model: PlantModel,
        actuators: tuple[Actuator, ...],
        location: Location,
        settings: IdentifiedSettings | None = None,
        electric: Electric | None = None,
    ) -> None:
        beside = [electric.command] if electric is not None and electric.command else []
        beside += [] if model.water is None else [model.water.actuator.name]
        need_actuator("mpc", [m.machine.name for m in model.maps] + beside, actuators, every=True)
        model = model.bound(actuators)
        self.model, self.settings, self._location = model, settings or IdentifiedSettings(), location
        self._problem, self._observer = IdentifiedProblem(model, electric), GreyBoxObserver(model)
        self._planner = RunPlanner(self._problem.stage, round(WHOLE / model.step))
        self._meter = None if electric is None else ElectricMeter(electric, model)
        self._tolerance = _EXACT if electric is None else _LINEAR
        self._solvers: dict[tuple[int, StageMethod], StageSolver] = {}
        self._before: tuple[Ahead, FloatArray] | None = None
        self._plan: StageSolution | None = None
        at_once, hold = max(_AT_ONCE * self.settings.starts, 1.0), max(round(self.settings.run / model.step), 1)
        back = max(self.settings.starts - at_once, 0.0) * model.step / 86_400.0
        told = RunSettings(at_once, back, hold, self.settings.start_price)
        self._runs = [Runs(k, told) for k, found in enumerate(model.maps) if found.operation == "duty"]
        self._thermostats, self._learner = Thermostats(model), PowerLearner(model)
        asked, zones = self.settings.guarantee, len(model.box.zones)
        self.conformal = None if asked is None else ConformalBackOff(asked, zones, self.settings.back_off)
        self._edges: FloatArray = np.empty((0, zones))
        self._kept: FloatArray = np.empty((0, zones))
        self._now: ElectricNow | None = None
        self.back_offs: list[float] = []

    def _back_off(self, ahead: Ahead) -> FloatArray:
        """Distance that is kept from the edges that machines keep zones from, shape (N, n_zone) [K]."""
        if self.conformal is None:
            return np.full(ahead.lower.shape, self.settings.back_off)
        kept = ahead.edges(self.model.sign)[0]
        return self.conformal.along(risen(kept, self.model.step, self._edges), ahead.occupied)

    def step(self, measurements: Measurements, forecast: Forecast | None) -> PlannedAction:
        """Choose values of the actuators.

        Parameters
        ----------
        measurements : Measurements
            Of the step that has just ended.
        forecast : Forecast or None
            Of what comes; it must be there.

        Raises
        ------
        ControlError
            When there is no forecast.
        """
        if forecast is None:
            raise ControlError("mpc", "forecasts of the plant", "none", "describe its weather and prices")
        begin = time.perf_counter()
        ahead = Ahead.of(self.model, forecast, self._location)
        self._observe(measurements, ahead)
        outdoor, led = ahead.outdoor, self._thermostats
        led.expect(outdoor)
        beyond, by_itself = self._learner.along(outdoor, led.most(outdoor)), led.runs_by_itself(ahead)
        ahead = replace(ahead, beyond=beyond, together=led.together(outdoor), running=by_itself)
        if self._plan is not None and len(self._plan.decisions) != len(outdoor):
            self._plan = None
        self._kept = self._back_off(ahead)
        if self._meter is not None:
            self._now = self._meter.read(measurements, forecast, self._location)
        self.back_offs.append(float(self._kept[0].mean()))
        on = np.zeros(len(self.model.maps), dtype=bool)
        on[[runs.machine for runs in self._runs]] = [runs.on for runs in self._runs]
        solution = self._decided(ahead)
        decided = None if solution is None else solution.decisions
        levels = self._by_rule(measurements, ahead) if decided is None else decided[0, : len(self.model.maps)]
        source, reasons = ("optimal plan", ()) if solution is not None else ("rules", ("the solver found no plan",))
        for runs in self._runs:
            runs.note(float(levels[runs.machine]))
        planned = replace(ahead, running=self._problem.running(ahead.running, decided))
        self._before, self._plan = (planned, levels), solution
        values = self._values(levels, solution, ahead, measurements)
        if decided is not None:
            values |= self._problem.command(decided[0])
        if self._meter is not None:
            self._meter.note(levels, values, planned, self._observer.state)
        action = PlannedAction(values, measurements.stamp, source, reasons)
        action.step, action.seconds = self.model.step, time.perf_counter() - begin
        if solution is not None:
            action.solution, action.power = solution, self._powers(solution, planned)
            action.zone = solution.states[:, : len(self.model.box.zones)] + REFERENCE
            action.compare = self._compared(solution, ahead, on) if self._meter is None else None
        return action

    def _observe(self, measurements: Measurements, ahead: Ahead) -> None:
        """Take what was measured, and learn from how comfortable it was."""
        if self._before is None:
            self._observer.start(measurements, float(ahead.outdoor[0]))
            return
        before, levels = self._before
        outdoor = self._observer.outdoor(measurements, before)
        self._thermostats.learn(measurements, self._observer.zones(measurements), outdoor)
        self._learner.learn(measurements, levels, outdoor, self._observer.state)
        self._observer.update(measurements, before, levels)
        kept = before.edges(self.model.sign)[0][:1]
        if self.conformal is not None:
            inside, spent = self._inside(measurements, before), self._thermostats.spent(levels, before)
            after_rise = risen(kept, self.model.step, self._edges)[0]
            self.conformal.update(inside, before.occupied[0], after_rise, spent)
        count = max(round(AFTER / self.model.step), 1)
        self._edges = np.vstack([self._edges, kept])[-count:]

    def _inside(self, measurements: Measurements, ahead: Ahead) -> FloatArray:
        """Distance of zones from the edge of the first step's band, positive inside, shape (n_zone,) [K].

        From the edge that machines can do something about: the lower one where they heat.
        """
        zone = as_heated(self._observer.zones(measurements), self.model.sign)
        return np.asarray(zone - ahead.edges(self.model.sign)[0][0])

    def _decided(self, ahead: Ahead) -> StageSolution | None:
        """Plan, with the first steps of machines in duty whole."""
        count, m = len(ahead.outdoor), len(self.model.maps)
        low, high = np.zeros((count, m)), self._thermostats.most(ahead.outdoor)
        best: StageSolution | None = None
        if self._runs and self.settings.runs == "mixed_integer":
            planned = self._mixed(ahead, (low, high))
            if planned is not None:
                return planned
        for runs in self._runs:
            choices, k = [], runs.machine
            for on in runs.possible():
                steps, fixed = runs.block(on, count), (low.copy(), high.copy())
                fixed[0][:steps, k] = fixed[1][:steps, k] = float(on)
                found = self._solve(ahead, fixed)
                if found is not None:
                    choices.append((found.cost / SCALE + runs.starting(on, found.decisions[steps:, k]), on, found))
            if not choices:
                return None
            _, on, best = min(choices, key=lambda c: c[0])
            low[:1, k] = high[:1, k] = float(on)
        return best if self._runs else self._solve(ahead, (low, high))

    def _mixed(self, ahead: Ahead, ends: tuple[FloatArray, FloatArray]) -> StageSolution | None:
        """Plan the runs of the coming hours by HiGHS about the relaxed plan, then the rest with these runs."""
        relaxed = self._solve(ahead, ends)
        if relaxed is None:
            return None
        limits, whole = [], [runs.machine for runs in self._runs]
        for runs in self._runs:
            told = runs.settings
            bound, price = max(told.hold - runs.since, 0), SCALE * told.price
            limits.append(RunLimits(runs.machine, runs.on, bound, told.hold, runs.left, told.back, price))
        # loads as the problem counts them, within their ends; those of machines that are run whole are from 0 to 1
        shares, m = relaxed.decisions.copy(), len(self.model.maps)
        shares[:, :m] = np.divide(shares[:, :m], ends[1], out=np.zeros_like(ends[1]), where=ends[1] > 0.0)
        chosen = self._planner.plan(self._data(ahead, ends), relaxed.states, shares, limits)
        if chosen is None:
            return None
        low, high = ends[0].copy(), ends[1].copy()
        low[: len(chosen), whole] = high[: len(chosen), whole] = chosen
        return self._solve(ahead, (low, high))

    def _data(self, ahead: Ahead, ends: tuple[FloatArray, FloatArray], before: FloatArray | None = None) -> StageData:
        """Fill the problem in, from the state that is estimated; a source counts by its tangents at a plan before."""
        price, state = self.settings.comfort_price, self._observer.state
        planned = None if before is None else before[:, : len(self.model.maps)]
        most = None if self.model.water is None else self._thermostats.with_hottest(ahead.outdoor)
        return self._problem.data(state, ahead, self._kept, price, ends, self._now, planned, most)

    def _solve(self, ahead: Ahead, ends: tuple[FloatArray, FloatArray]) -> StageSolution | None:
        """Plan within ends of the decisions; they are then duties and loads themselves."""
        before = None if self._plan is None else self._plan.shifted()[1]
        if self.model.source is None and self.model.water is None:
            return self._solve_about(before, ahead, ends)
        plans: list[StageSolution] = []
        for _ in range(_PLANS):
            found = self._solve_about(before, ahead, ends)
            if found is None:
                break
            before = found.decisions
            plans.append(replace(found, cost=self._cost_of(found, ahead)))
        return min(plans, key=lambda plan: plan.cost, default=None)

    def _cost_of(self, plan: StageSolution, ahead: Ahead) -> float:
        """Cost of a plan by the power of its source itself, which its tangents at the plan are."""
        free = np.ones((len(plan.decisions), len(self.model.maps)))
        data = self._data(ahead, (0.0 * free, free), plan.decisions)
        return self._problem.stage.cost_along(data, plan.states, plan.decisions)

    def _solver(self, ahead: Ahead) -> StageSolver:
        """Choose who solves: where a source limits what several machines take, fatrop stalls, and Ipopt does not."""
        count, method = len(ahead.outdoor), _FREE if np.isinf(ahead.together).all() else _LIMITED
        if (count, method) not in self._solvers:
            self._solvers = {key: solver for key, solver in self._solvers.items() if key[0] == count}
            made = StageSolver(self._problem.stage, count, method, self._tolerance)
            self._solvers[count, method] = made
        return self._solvers[count, method]

    def _solve_about(
        self, before: FloatArray | None, ahead: Ahead, ends: tuple[FloatArray, FloatArray]
    ) -> StageSolution | None:
        """Plan, beginning from a plan before."""
        solver, (low, high), m = self._solver(ahead), ends, len(self.model.maps)
        data = self._data(ahead, ends, before)
        guess = np.full((len(low), self._problem.decisions), HALF)
        if before is not None:
            guess = before.copy()
            np.divide(before[:, :m] - low, high - low, out=guess[:, :m], where=high > low)
        found = solver.solve(data, self._problem.stage.follow(data, guess), guess)
        if found.status is Status.FAILED:
            return None
        chosen = np.clip(found.decisions, 0.0, 1.0)
        chosen[:, :m] = low + (high - low) * chosen[:, :m]
        return replace(found, decisions=chosen)

    def _by_rule(self, measurements: Measurements, ahead: Ahead) -> FloatArray:
        """Levels without a plan: full where a zone is too cold, or too warm where machines cool, else none."""
        inside = self._inside(measurements, ahead)
        return np.array([float((inside < self._kept[0])[mine].any()) for mine in self.model.box.serves])

    def _values(
        self, levels: FloatArray, solution: StageSolution | None, ahead: Ahead, measurements: Measurements
    ) -> dict[str, float]:
        """Values of the actuators for levels."""
        planned = self._observer.state[None] if solution is None else solution.states[1:]
        zone = planned[:, : len(self.model.box.zones)] + REFERENCE
        most, values = self._thermostats.most(ahead.outdoor[:1])[0], dict[str, float]()
        shared = self._thermostats.shares_all(levels, ahead.outdoor[:1])
        for k, found in enumerate(self.model.maps):
            level = float(levels[k])
            if found.operation == "setpoint":
                edges = self._edges_of(k, ahead, measurements)
                values |= found.machine.told(self._thermostats.tell(k, level, most[k], zone, edges, shared), edges[1])
            else:
                values[found.machine.name] = command_of(found, level)
        if solution is None:  # nothing says how hot it has to be: the plant has it
            self._thermostats.leave_water()
            return values
        return values | self._thermostats.tell_water(levels, ahead.outdoor[:1], zone[0])

    def _edges_of(self, k: int, ahead: Ahead, measurements: Measurements) -> tuple[float, float]:
        """Edges of a machine's zones: that which it keeps them from, with the distance, and where it stops [K]."""
        served, sign = self.model.box.serves[k], self.model.sign
        near, far = ahead.edges(sign)
        kept, other = float((near[0] + self._kept[0])[served].max()), float(far[:2, served].min())
        stops = self.model.maps[k].machine.farthest(kept, other, measurements)
        return as_heated(kept, sign), as_heated(stops, sign)

    def _compared(self, solution: StageSolution, ahead: Ahead, on: FloatArray) -> Callable[[], RuleEstimate]:
        """Give what holds a plan against the rule on the same model."""
        most = self._thermostats.most(ahead.outdoor)
        free = np.zeros_like(most), np.ones_like(most)
        data = self._problem.data(self._observer.state, ahead, self._kept, self.settings.comfort_price, free)
        planned = solution.states, solution.decisions
        water = self._water_along(solution, ahead)
        return partial(estimate_rule, self._problem, ahead, data.parameters, planned, most, on, water)

    def _water_along(self, solution: StageSolution, ahead: Ahead) -> FloatArray | None:
        """Supply water of a plan, shape (N,) [K]; None where it is not decided."""
        levels, zone = solution.decisions[:, : len(self.model.maps)], solution.states[0, : len(self.model.box.zones)]
        return self._thermostats.water(levels, ahead.outdoor, zone + REFERENCE)

    def _powers(self, solution: StageSolution, ahead: Ahead) -> FloatArray:
        """Give expected electricity and other carriers, shape (N, 2) [W]."""
        states, water = solution.states[:-1], self._water_along(solution, ahead)
        by_map = bought(self.model, ahead.beyond, states, solution.decisions, ahead.outdoor, water)
        powers = by_map.sum(axis=1) + self.model.bought_anyway(ahead.running)
        return np.column_stack([powers[:, 0], powers[:, 1:].sum(axis=1)])
