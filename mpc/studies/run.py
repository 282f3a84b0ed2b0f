"""A study run with one controller, and with several side by side on the same weather, people, prices and noise."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from calibration.progress import Forward, Progress
from mpc.control.controller.controller import MpcController
from mpc.control.controller.site import Action
from mpc.control.identified.action import PlannedAction
from mpc.control.predictor.predictor import Predictor
from mpc.errors import ControlError
from mpc.identify.telemetry import on_control_steps, run_recorded
from mpc.kpi.bought import costs_of, fuel_of
from mpc.kpi.kpis import Kpis, measure_kpis
from mpc.loop.plant import Controller, Measurements
from mpc.loop.run import ClosedLoopRun, run_closed_loop
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.forecast import Forecast
from mpc.scenario.rates import KILOWATT_HOUR
from mpc.studies.described import PlantStudy, RecordedPlant, SeenStudy
from mpc.studies.optimal_control import MODEL_STEP
from mpc.studies.registry import RegisteredController, find_controller
from mpc.studies.study import Study
from thermal._types import FloatArray

#: Time that a run with optimal control takes, in those with a rule [-]: a guess, by which progress alone is told.
_SLOWNESS = 20.0

#: How far ahead predictions are kept to be compared with what came [s].
AHEAD = 3600.0


class Decision(NamedTuple):
    """An action of optimal control and what it expected.

    Parameters
    ----------
    stamp : pandas.Timestamp
        When it began, local.
    source : str
        ``optimal plan``, ``previous plan`` or ``rules``.
    status : str
        Of the solver; empty where it did not run.
    reasons : tuple of str
        In words.
    zone : ndarray, shape (n_zone,)
        Temperatures expected after `AHEAD` [K]; NaN without a plan.
    power : tuple of float
        Electricity and gas expected over the time until then [W].
    seconds : float
        That the solver took [s].
    """

    stamp: pd.Timestamp
    source: str
    status: str
    reasons: tuple[str, ...]
    zone: FloatArray
    power: tuple[float, float]
    seconds: float


@dataclass(frozen=True, eq=False)
class ControlRun:
    """A study run with a controller.

    Parameters
    ----------
    entry : RegisteredController
        Which controller.
    study : Study or SeenStudy
        What it was run on.
    loop : ClosedLoopRun
        Record, measurements and actions.
    kpis : Kpis
        Indicators.
    decisions : tuple of Decision
        Of optimal control; () for rules.
    plant : SimulatedPlant or RecordedPlant
        As the run left it, with its telemetry.
    """

    entry: RegisteredController
    study: Study | SeenStudy
    loop: ClosedLoopRun
    kpis: Kpis
    decisions: tuple[Decision, ...]
    plant: SimulatedPlant | RecordedPlant

    @property
    def controller(self) -> str:
        """Name of the controller."""
        return self.entry.name

    @property
    def cost(self) -> float:
        """Of energy, and demand charges where the tariff has any [currency]."""
        return (self.kpis.cost_tot + self.kpis.demand_cost) * self.kpis.floor_area

    @property
    def objective(self) -> float:
        """Cost with discomfort at the price that optimal control has for it [currency]."""
        return self.cost + self.study.comfort_price * len(self.study.scenario.zones) * self.kpis.tdis_tot

    @property
    def sources(self) -> Mapping[str, int]:
        """How often actions came from a plan, the plan before, or rules."""
        return Counter(decision.source for decision in self.decisions)


def run_controller(study: Study | PlantStudy, name: str, progress: Progress | None = None) -> ControlRun:
    """Run a study with a controller.

    Parameters
    ----------
    study : Study or PlantStudy
        What it is run on.
    name : str
        ``mpc``, ``schedule``, ``reset``, ``guideline36``, one that was registered, or ``bound``: optimal control with
        the plant's own parameters and exact sensors, that knows the weather and the people. Where the plant is its own
        model it knows the state; the state of a grid it estimates.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    ControlError
        When the controller is not known, or what its function gives is none.

    Examples
    --------
    >>> run_controller(study, "guideline36").kpis.cost_tot  # doctest: +SKIP
    """
    if isinstance(study, PlantStudy):
        return _run_described(study, name, progress)
    entry = find_controller(name, "case")
    step = study.settings.control_step if entry.predictive else MODEL_STEP
    plant = study.plant(step, bound=entry.perfect)
    watched = _Watched(_made(entry, study, plant))
    count = int(study.steps * MODEL_STEP / step)
    report = None if progress is None else (lambda done, _: progress(name, done, count))
    seed, ahead = study.settings.seed, entry.predictive
    loop = run_closed_loop(plant, watched, steps=count, seed=seed, forecasts=ahead, progress=report)
    kpis = measure_kpis(loop.record, plant.scenario, control_step=step)
    return ControlRun(entry, study, loop, kpis, tuple(watched.decisions), plant)


def _run_described(study: PlantStudy, name: str, progress: Progress | None) -> ControlRun:
    """Run a described plant on its control steps; indicators are measured on its own ones."""
    entry = find_controller(name, "plant")
    with study.plant() as plant:
        watched, total = _Watched(_made(entry, study, plant)), study.steps(plant)
        report = None if progress is None else (lambda done, _: progress(name, done, total))
        loop, seen = run_recorded(plant, watched, study.site, progress=report)
        scenario = study.scenario(plant, seen)
        kpis = measure_kpis(loop.record, scenario, control_step=plant.control_step)
        left = RecordedPlant(seen, tuple(plant.columns), plant.control_step)
    steps = len(loop.measurements)
    coarse = loop._replace(record=on_control_steps(loop.record, left.control_step))
    return ControlRun(entry, SeenStudy(study, scenario, steps), coarse, kpis, tuple(watched.decisions), left)


def _made(entry: RegisteredController, study: Study | PlantStudy, plant: Any) -> Controller:
    """Make a controller, and refuse what is none."""
    controller = entry.make(study, plant)
    asked = callable(getattr(controller, "step", None))
    expected, advice = "an object with step(measurements, forecast)", "return one from the function that was registered"
    ControlError.unless(asked, f"controller {entry.name!r}", expected, repr(controller), advice)
    return controller


class _Watched:
    """A controller whose decisions are written down, where it is optimal control."""

    def __init__(self, controller: Controller) -> None:
        self._controller, self.decisions = controller, list[Decision]()

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        action = self._controller.step(measurements, forecast)
        if isinstance(action, Action) and isinstance(self._controller, MpcController):
            self.decisions.append(_decision(action, self._controller.problem.predictor))
        elif isinstance(action, PlannedAction):
            self.decisions.append(_planned(action))
        return action


def _decision(action: Action, predictor: Predictor) -> Decision:
    """Keep what an action expected."""
    horizon, solution = predictor.horizon, action.solution
    zone, power = np.full(predictor.n_zone, np.nan), (np.nan, np.nan)
    if solution is not None and solution.usable:
        row = int(np.searchsorted(horizon.edges, AHEAD - 1e-6))
        share = horizon.steps[:row] / horizon.edges[row]
        zone = solution.rollout.zone[row].copy()
        power = float(share @ solution.rollout.electric[:row]), float(share @ solution.rollout.fuel[:row])
    status, seconds = ("", 0.0) if solution is None else (str(solution.status), solution.seconds)
    return Decision(action.stamp, str(action.source), status, action.reasons, zone, power, seconds)


def _planned(action: PlannedAction) -> Decision:
    """Keep what an action of a described plant expected."""
    solution, step = action.solution, action.step
    if solution is None:
        return Decision(action.stamp, action.source, "", action.reasons, np.full(1, np.nan), (np.nan, np.nan), 0.0)
    row = max(round(AHEAD / step), 1)
    power = action.power[:row].mean(axis=0)
    powers = float(power[0]), float(power[1])
    told = str(solution.status), action.reasons
    zone = action.zone[min(row, len(action.zone) - 1)]
    return Decision(action.stamp, action.source, *told, zone, powers, action.seconds)


def prediction_errors(run: ControlRun) -> dict[str, Any]:
    """Compare what optimal control expected after an hour with what came.

    Parameters
    ----------
    run : ControlRun
        Of a study.

    Returns
    -------
    dict
        ``zone_mae`` and ``zone_bias`` [K], ``cost_error`` (expected over realised energy cost, less 1) [-], ``count``;
        empty for rules and runs shorter than an hour.
    """
    rows = compared_decisions(run)
    if not rows:
        return {}
    record, scenario = run.loop.record, run.study.scenario
    ahead = round(AHEAD / record.step)
    costs, unit = costs_of(record, scenario), record.step / KILOWATT_HOUR
    prices = [unit * price for price in (scenario.electricity_price, fuel_of(record, scenario).price)]
    error, expected, came = [], 0.0, 0.0
    for first, decision in rows:
        error.append(decision.zone - record.zone_temperature[first + ahead])
        part = slice(first, first + ahead)
        came += float(sum(cost[part].sum() for cost in costs))
        expected += float(sum(price[part].sum() * power for price, power in zip(prices, decision.power, strict=True)))
    return {
        "zone_mae": float(np.mean(np.abs(error))), "zone_bias": float(np.mean(error)),
        "cost_error": expected / came - 1.0 if came > 0.0 else 0.0, "count": len(rows),
    }  # fmt: skip


def compared_decisions(run: ControlRun) -> list[tuple[int, Decision]]:
    """Give the decisions with a plan whose hour ends within the run, with the step that they began at.

    Parameters
    ----------
    run : ControlRun
        Of a study.
    """
    step, start = run.loop.record.step, run.study.scenario.grid.start
    rows = ((round((d.stamp - start).total_seconds() / step), d) for d in run.decisions)
    last = run.loop.record.n_steps - round(AHEAD / step)
    return [(first, d) for first, d in rows if first <= last and np.isfinite(d.zone).all()]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Runs of several controllers on one study.

    Parameters
    ----------
    study : Study or SeenStudy
        What they were run on.
    runs : tuple of ControlRun
        In the order asked for.
    """

    study: Study | SeenStudy
    runs: tuple[ControlRun, ...]

    def of(self, controller: str) -> ControlRun | None:
        """Give the run of a controller, where there is one.

        Parameters
        ----------
        controller : str
            Its name.
        """
        return next((run for run in self.runs if run.controller == controller), None)

    @property
    def best_rule(self) -> ControlRun | None:
        """The rule whose cost with discomfort is lowest, where there is one."""
        rules = [run for run in self.runs if not run.entry.predictive]
        return min(rules, key=lambda run: run.objective) if rules else None

    def saving(self, run: ControlRun) -> float | None:
        """Share of the best rule's cost, with discomfort, that a run saves [-]; None without a rule.

        Parameters
        ----------
        run : ControlRun
            One of the runs.
        """
        best = self.best_rule
        return None if best is None or best.objective <= 0.0 else 1.0 - run.objective / best.objective

    def way_to_bound(self, run: ControlRun) -> float | None:
        """Share of the way from the best rule to the perfect bound, cost with discomfort [-].

        Parameters
        ----------
        run : ControlRun
            One of the runs.

        Returns
        -------
        float or None
            None without a rule or a bound, or where the bound is no better than the rule.
        """
        best, bound = self.best_rule, self.of("bound")
        if best is None or bound is None or best.objective <= bound.objective:
            return None
        return (best.objective - run.objective) / (best.objective - bound.objective)


def compare_controllers(
    study: Study | PlantStudy, names: Sequence[str], progress: Progress | None = None
) -> Comparison:
    """Run several controllers on a study, one after the other.

    Parameters
    ----------
    study : Study or PlantStudy
        What they are run on.
    names : sequence of str
        Such as ``("guideline36", "mpc", "bound")``.
    progress : callable, optional
        Called with stage, done, total.

    Raises
    ------
    ControlError
        When a controller is not known, or named twice, or none is.
    """
    known = [find_controller(name).name for name in names]
    ControlError.unless(known and len(set(known)) == len(known), "controllers", "some, each once", list(names))
    whole, runs = Forward(progress), []
    left = [_SLOWNESS if find_controller(name).predictive else 1.0 for name in known]
    for number, name in enumerate(known):
        part = whole.part(left[number] / sum(left[number:]), f"controller {number + 1} of {len(known)}")
        runs.append(run_controller(study, name, part))
    return Comparison(runs[0].study, tuple(runs))
