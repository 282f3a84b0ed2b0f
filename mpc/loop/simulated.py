"""Our plant: air handlers, hot water and terminals on a building model, driven by a scenario."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import SUPPLY_AIR, SUPPLY_WATER, Actuator, actuators_of, checked_actions
from mpc.loop.building import BuildingModel
from mpc.loop.history import PlantStep, RecentSteps, SystemBalance
from mpc.loop.loop import LoopState, PlantLoop
from mpc.loop.noise import SensorNoise
from mpc.loop.operation import Operation, scheduled_operation, shared_rows
from mpc.loop.plant import Measurements, need_running
from mpc.loop.sensors import Sensors, plant_devices
from mpc.loop.signals import EffectSignals, boundary_series, check_parts
from mpc.scenario.forecast import Forecast, Forecaster
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.case.telemetry import Telemetry
from thermal.errors import describe
from thermal.system.points import energy_balance
from thermal.system.system import HvacSystem

_DAY = 86400.0


@dataclass(frozen=True, eq=False)
class _Saved:
    """A plant at some time; the steps are those of a list that only grows."""

    number: int
    loop: LoopState
    first: FloatArray
    seed: int
    drawn: int | None
    steps: list[PlantStep]
    count: int


class SimulatedPlant:
    """A building of ours in closed loop with its plant: measurements out, setpoints in.

    A control step is one or more steps of the scenario; in each the thermostats see their zones, the plant meets their
    calls as far as the setpoints let it, and the building takes up the heat, that of people, light and equipment, and
    the weather.

    Parameters
    ----------
    scenario : Scenario
        Weather, people, and the steps of the plant.
    system : HvacSystem
        Air handlers, hot water and terminals.
    model : BuildingModel
        The building, `GridBuilding` or `ReducedBuilding`; with effects that a controller's model may lack.
    operation : Operation, optional
        Schedules; those of `scheduled_operation` by default.
    control_steps : int
        Steps of the plant in a control step.
    noise : SensorNoise, optional
        Errors of what is measured; none by default. Local controls see no noise.
    forecaster : Forecaster, optional
        Forecasts of the scenario; none by default.
    limits : mapping of str to tuple of float, optional
        Ranges by kind of action in the place of those that the components declare [K] or [Pa].
    default_actions : mapping of str to float, optional
        Setpoints by kind of action during the warm-up [K] or [Pa]; 287.15 K of air and 333.15 K of water, or what
        is nearest in the range, by default.
    warm_up_days : int
        How often the scenario's first day is run before it begins [d], with expected people, so that walls forget
        how they started.
    count_people : bool
        Whether people in the zones are measured.
    pressures : bool
        Whether the pressures of ducts and loop are measured; a case that has them is one of format 2.
    boundaries : mapping of str to float or ndarray, optional
        Temperatures of boundaries beside outdoor, one or one a step [K].
    seed : int
        Of sensor noise, the random shuffle and, after `reset(seed)`, the people.

    Raises
    ------
    PlantError
        When the parts do not fit each other.
    """

    def __init__(
        self,
        scenario: Scenario,
        system: HvacSystem,
        model: BuildingModel,
        operation: Operation | None = None,
        *,
        control_steps: int = 1,
        noise: SensorNoise | None = None,
        forecaster: Forecaster | None = None,
        limits: Mapping[str, tuple[float, float]] | None = None,
        default_actions: Mapping[str, float] | None = None,
        warm_up_days: int = 1,
        count_people: bool = False,
        pressures: bool = False,
        boundaries: Mapping[str, float | FloatArray] | None = None,
        seed: int = 0,
    ) -> None:
        check_parts(scenario, model, control_steps, warm_up_days, seed)
        self.devices = plant_devices(scenario.building, system)
        self.system = system = self.devices.named(system)
        self.scenario, self.model, self.forecaster = scenario, model, forecaster
        self.control_steps, self._seed = control_steps, seed
        self._warm_up_steps = warm_up_days * round(_DAY / scenario.grid.step)
        self.actuators: tuple[Actuator, ...] = actuators_of(system, scenario.zones, limits)
        self._by_name = {a.name: a for a in self.actuators}
        usual, given = {SUPPLY_AIR: 287.15, SUPPLY_WATER: 333.15}, default_actions or {}
        kinds = {a: a.name.rpartition("/")[2] for a in self.actuators}
        chosen = {a.name: float(np.clip(usual[k], a.lowest, a.highest)) for a, k in kinds.items() if k in usual}
        chosen |= {a.name: given[kind] for a, kind in kinds.items() if kind in given}
        #: Setpoints during the warm-up, of all required actuators and what was given beside [K] or [Pa].
        self.default_actions = checked_actions(chosen, self._by_name)
        self.operation = operation or scheduled_operation(scenario, len(system.air_handlers))
        self.operation.fits(scenario.grid.n_steps, len(scenario.zones), len(system.air_handlers))
        boundary = boundary_series(scenario, model, boundaries or {})
        self.loop = PlantLoop(scenario, system, model, self.operation, boundary)
        self._step = float(scenario.grid.step)
        self.sensors = Sensors(system, self.devices.chiller, scenario, noise, count_people, pressures)
        self._signals = self._given_signals = EffectSignals(model.network, scenario, system)
        self.given, self._gains = scenario, shared_rows(scenario.gains)
        self._drawn: int | None = None
        self._warm: tuple[LoopState, PlantStep] | None = None
        self._number, self._steps = -1, list[PlantStep]()
        self._asked: tuple[Mapping[str, float] | None, dict[str, float]] = (None, {})
        self._first = np.zeros(len(scenario.zones))

    @property
    def control_step(self) -> float:
        """Time between two actions [s]."""
        return self.control_steps * self._step

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Names of the zones, in the order of records."""
        return self.scenario.zones

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the measurements."""
        return self.sensors.layout.columns

    @property
    def finished(self) -> bool:
        """Whether less than a control step of the scenario is left."""
        return self._number + self.control_steps > self.scenario.grid.n_steps

    @property
    def now(self) -> int:
        """Number of the scenario's step that comes next."""
        return max(self._number, 0)

    def reset(self, seed: int | None = None) -> Measurements:
        """Start anew, after the warm-up.

        Parameters
        ----------
        seed : int, optional
            Of sensor noise, random shuffle and people; as before by default.

        Returns
        -------
        Measurements
            Of the last step of the warm-up, or, without one, of a step of default setpoints that is not kept.
        """
        if seed is not None:
            if seed < 0:
                raise PlantError(describe("seed", "0 or more", repr(seed)))
            self._seed = seed
            self._draw(seed)
        warm, last = self.warmed_up()
        self.loop.restore(warm)
        self.model.reseed(self._seed)
        self._first, self._number, self._steps = self.loop.air, 0, []
        return self._seen([last], int(self.scenario.grid.edges[0]))

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Hold setpoints for a control step.

        Parameters
        ----------
        actions : mapping of str to float
            Setpoints by ``ENTITY/POINT`` [K] or [Pa]: every required one; the others stay as the building has them.

        Returns
        -------
        Measurements
            Means over the control step.

        Raises
        ------
        PlantActionError
            When a setpoint is missing, unknown, no finite number or outside its range.
        PlantError
            When the scenario is over, or `reset` was not called.
        """
        need_running(self._number >= 0)
        if actions != self._asked[0]:  # the same ones have been checked
            self._asked = dict(actions), checked_actions(actions, self._by_name)
        given = self._asked[1]
        if self.finished:
            found = f"{self.scenario.grid.n_steps - self._number} of its {self.scenario.grid.n_steps}"
            raise PlantError(describe("scenario", f"{self.control_steps} more steps", found, "make it longer"))
        first, advance, gains = self._number, self.loop.advance, self._gains
        fresh = [advance(k, given, gains[k], self._signals) for k in range(first, first + self.control_steps)]
        self._steps += fresh
        self._number += self.control_steps
        return self._seen(fresh, int(self.scenario.grid.edges[self._number]))

    def forecast(self) -> Forecast:
        """Forecast the steps from now on.

        Raises
        ------
        PlantError
            When the plant has no forecaster.
        """
        if self.forecaster is None:
            raise PlantError(describe("forecast", "a plant with a forecaster", "none", "pass `forecaster`"))
        return self.forecaster.table(self.now)

    def save_state(self) -> Any:
        """Keep everything that the next steps depend on, and the run so far; for `restore_state`, on this plant."""
        need_running(self._number >= 0)
        steps = self._steps
        return _Saved(self._number, self.loop.save(), self._first, self._seed, self._drawn, steps, len(steps))

    def restore_state(self, saved: Any) -> None:
        """Return to a saved state: what follows is bit for bit what followed then.

        Parameters
        ----------
        saved : object
            Of `save_state`.

        Raises
        ------
        PlantError
            When it is no such state, or that of another building.
        """
        if not isinstance(saved, _Saved) or len(saved.first) != len(self.zone_names):
            raise PlantError(describe("state", "what save_state of such a plant gave", type(saved).__name__))
        self.loop.restore(saved.loop)
        self._number, self._first, self._seed = saved.number, saved.first, saved.seed
        self._draw(saved.drawn)
        self._steps = saved.steps[: saved.count]

    def record(self) -> PlantRecord:
        """Give the run since the reset on the plant's own steps: true temperatures, for indicators and rewards.

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        step, temperature, electricity, gas = self.recent(len(self._kept()))
        return PlantRecord(step, np.array(temperature), np.array(electricity), np.array(gas))

    def recent(self, steps: int) -> RecentSteps:
        """Give the last steps of `record`, at a cost that does not grow with the run.

        Parameters
        ----------
        steps : int
            How many of the plant's own steps, 1 or more.
        """
        last, before = self._kept()[-steps:], len(self._steps) - steps
        zones = [self._steps[before - 1].end if before > 0 else self._first, *(s.end for s in last)]
        return RecentSteps(self._step, zones, [s.done.electric_power for s in last], [s.done.fuel_power for s in last])

    def telemetry(self) -> pd.DataFrame:
        """Give what was measured in the run since the reset, shape (n_steps, n_column) [library's units].

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        people, seed = self.scenario.occupancy, self._seed
        rows = np.stack([self._read(s, people, seed) for s in self._kept()])
        index = self.scenario.grid.stamps[self._number - len(rows) : self._number]
        return pd.DataFrame(rows, index=index.rename("timestamp"), columns=list(self.columns))

    def case(self) -> Case:
        """Give the run as a case, which `thermal.save_case` saves and calibration and diagnosis take."""
        return Case(self.scenario.building, Telemetry.from_frame(self.telemetry(), where="closed loop"))

    def balance(self) -> SystemBalance:
        """Add up where the energy of the last step went, over building and plant.

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        last = self._kept()[-1]
        gains = float(self.scenario.gains[last.number].sum())
        return SystemBalance(energy_balance(self.system, last.conditions, last.done), gains, self.model.flows())

    def outside(self, scenario: Scenario) -> FloatArray:
        """Give what drives the building from outside: boundaries and signals of effects, shape (n_steps, n_outside).

        Parameters
        ----------
        scenario : Scenario
            The plant's own, or with other people.

        Raises
        ------
        PlantError
            When a signal is known only while the plant runs.
        """
        signals = self._given_signals
        if scenario is not self.given and self.model.network.signals:
            signals = EffectSignals(self.model.network, scenario, self.system)
        return np.hstack([self.loop.boundary, signals.in_advance()])

    def _draw(self, seed: int | None) -> None:
        """Let other people come, those of a seed; None are those of the scenario as it was given."""
        if seed != self._drawn:
            self.scenario = self.given if seed is None else self.given.redrawn(seed)
            self._gains, self._drawn = shared_rows(self.scenario.gains), seed
            self._signals = self._given_signals
            if seed is not None and self.model.network.signals:  # some may be those of people
                self._signals = EffectSignals(self.model.network, self.scenario, self.system)

    def _kept(self) -> list[PlantStep]:
        if not self._steps:
            raise PlantError(describe("run", "a step at least", "none since the reset"))
        return self._steps

    def _read(self, step: PlantStep, people: FloatArray, seed: int) -> FloatArray:
        return self.sensors.read(step, people[step.number], seed)

    def _seen(self, steps: list[PlantStep], seconds: int) -> Measurements:
        """Measurements of some steps, read when they are asked for."""
        people, seed = self.scenario.occupancy, self._seed

        def values() -> FloatArray:
            rows = [self._read(step, people, seed) for step in steps]
            return rows[0] if len(rows) == 1 else np.mean(rows, axis=0)

        return Measurements(self.sensors.layout, seconds, values)

    def warmed_up(self) -> tuple[LoopState, PlantStep]:
        """State after the first day, run with expected people from a steady state, and its last step; once for all."""
        if self._warm is None:
            loop, effects, gains = self.loop, self._given_signals, shared_rows(self.given.expected_gains)
            day = min(round(_DAY / self._step), self.scenario.grid.n_steps)
            loop.start(effects.known(0))
            begin = loop.save()
            for k in range(max(self._warm_up_steps, 1)):
                last = loop.advance(k % day, self.default_actions, gains[k % day], effects)
            self._warm = loop.save() if self._warm_up_steps else begin, last
        return self._warm
