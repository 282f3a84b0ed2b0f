"""EnergyPlus as a plant: setpoints in, measurements out, by its runtime interface in a process of its own."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import timedelta

import numpy as np
import pandas as pd

from mpc.adapters.energyplus.building import EnergyPlusBuilding
from mpc.adapters.energyplus.points import CELSIUS, Reader, actuators_of, columns_of, meters, prepared
from mpc.adapters.energyplus.process import EnergyPlusProcess, Job
from mpc.adapters.foreign import ForeignPlant
from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import checked_actions
from mpc.loop.history import RecentSteps
from mpc.loop.noise import NoiseSource, SensorNoise
from mpc.loop.plant import Measurements, PointLayout, need_running
from mpc.scenario.forecast import Forecast, Forecaster
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.case.telemetry import Telemetry

_DAY, _HOUR = 86_400, 3_600  # s


@dataclass(frozen=True)
class EnergyPlusSettings:
    """How a building is run and measured.

    Parameters
    ----------
    control_steps : int
        Steps of the plant in a control step.
    lead_days : int
        Days under the building's own control before the run [d], at least 1, after EnergyPlus' warm-up.
    limits : mapping of str to tuple of float
        Ranges by kind of action in the place of the default ones [K].
    noise : SensorNoise, optional
        Errors of what is measured; none by default.
    seed : int
        Of the noise.
    patience : float
        Longest time for an answer of EnergyPlus [s]; then its process is ended.
    """

    control_steps: int = 1
    lead_days: int = 1
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    noise: SensorNoise | None = None
    seed: int = 0
    patience: float = 600.0


class EnergyPlusPlant(ForeignPlant):
    """A building of EnergyPlus in closed loop.

    Every run has a process of its own, which waits at each control step. What an action leaves out stays as the
    building has it, so that ``step({})`` is the building's own control.

    Parameters
    ----------
    source : EnergyPlusBuilding
        The building, of `energyplus_building`.
    scenario : Scenario
        Its grid begins at midnight by the clock of the weather file, with a step of an hour divided by a whole number;
        it may be longer than the run, for forecasts. Bands and prices are those of indicators and forecasts: the
        building has its own schedules, people and weather.
    days : int
        Length of the run [d].
    settings : EnergyPlusSettings
        How it is run and measured.
    forecaster : Forecaster, optional
        Forecasts of the scenario; none by default.

    Raises
    ------
    PlantError
        When the parts do not fit each other.
    EnergyPlusError
        When EnergyPlus is not installed.
    """

    def __init__(
        self,
        source: EnergyPlusBuilding,
        scenario: Scenario,
        days: int,
        settings: EnergyPlusSettings = EnergyPlusSettings(),
        forecaster: Forecaster | None = None,
    ) -> None:
        self.source, self.scenario, self.forecaster = source, scenario, forecaster
        self.settings, self.control_steps, self._days = settings, settings.control_steps, days
        self._seed, self._patience = settings.seed, settings.patience
        self._check()
        self.zone_names, self.control_step = scenario.zones, self.control_steps * float(scenario.grid.step)
        self._per_day = round(_DAY / scenario.grid.step)
        self._handles = actuators_of(source, settings.limits)
        self.actuators = tuple(self._handles.values())
        self._by_name = {a.name: a for a in self.actuators}
        columns = columns_of(source.layout, source.building.weather_station, source.full_water_flow)
        self._reader = Reader(columns, source.layout)
        self._layout = PointLayout(self._reader.names, source.building.location.timezone)
        self._noise = None if settings.noise is None else NoiseSource(self._layout, settings.noise)
        electric, gas = (meters(source.meters, kind) for kind in ("Electricity", "NaturalGas"))
        self._meters, self._electric = (*electric, *gas), len(electric)
        self._process: EnergyPlusProcess | None = None
        self._number = -1
        self._clear()

    @property
    def steps(self) -> int:
        """Steps of the run."""
        return self._days * self._per_day

    @property
    def finished(self) -> bool:
        """Whether less than a control step of the run is left."""
        return self._number + self.control_steps > self.steps

    @property
    def now(self) -> int:
        """Number of the scenario's step that comes next."""
        return max(self._number, 0)

    def job(self) -> Job:
        """Give what EnergyPlus is run with."""
        start = self.scenario.grid.start.date() - timedelta(days=self.settings.lead_days)
        days = self._days + self.settings.lead_days
        content = prepared(self.source, start, days, round(_HOUR / self.scenario.grid.step))
        return Job(
            json.dumps(content), "in.epJSON", self.source.weather, self._reader.outputs, self._reader.products,
            self._meters, tuple(self._handles),
        )  # fmt: skip

    def reset(self, seed: int | None = None) -> Measurements:
        """Start EnergyPlus anew, and run the days before.

        Parameters
        ----------
        seed : int, optional
            Of the sensors' noise, all that is random; as before by default.

        Returns
        -------
        Measurements
            Of the last control step before the run.
        """
        self.close()
        self._seed = self._seed if seed is None else seed
        self._process, self._number = EnergyPlusProcess(self.job(), self._patience), 0
        self._clear()
        rows, ends, _ = self._ask(self.settings.lead_days * self._per_day, {})
        self._rooms.append(self._reader.rooms(ends[-1]))
        return self._seen(self._read(rows[-self.control_steps :], 0))

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Hold setpoints for a control step.

        Parameters
        ----------
        actions : mapping of str to float
            Setpoints by ``ENTITY/POINT`` [K]; what is left out stays as the building has it.

        Returns
        -------
        Measurements
            Means over the control step.

        Raises
        ------
        PlantActionError
            When a setpoint is unknown, no finite number or outside its range.
        PlantError
            When the run is over, or `reset` was not called.
        EnergyPlusError
            When EnergyPlus breaks off, ends with severe errors or does not answer.
        """
        need_running(self._number >= 0)
        given = checked_actions(actions, self._by_name)
        found = f"{self.steps - self._number} of its {self.steps}"
        PlantError.unless(not self.finished, "run", f"{self.control_steps} more steps", found, "make it longer")
        rows, ends, energy = self._ask(self.control_steps, given)
        fresh = self._read(rows, self._number)
        self._rows.append(fresh)
        self._rooms += [self._reader.rooms(end) for end in ends]
        self._energy.append(energy)
        self._number += self.control_steps
        if self._number == self.steps and self._process is not None:
            self._process.finish()
            self.close()
        return self._seen(fresh)

    def forecast(self) -> Forecast:
        """Forecast the steps from now on.

        Raises
        ------
        PlantError
            When the plant has no forecaster.
        """
        if self.forecaster is None:
            raise PlantError("forecast", "a plant with a forecaster", "none", "pass `forecaster`")
        return self.forecaster.table(self.now)

    def record(self) -> PlantRecord:
        """Give the run since the reset, for indicators: meters of the end uses for heating and air conditioning.

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        step, temperature, electricity, gas = self.recent(self.steps)
        return PlantRecord(step, np.array(temperature), np.array(electricity), np.array(gas))

    def recent(self, steps: int) -> RecentSteps:
        """Give the last steps of `record`, at a cost that does not grow with the run.

        Parameters
        ----------
        steps : int
            How many of the plant's own steps, 1 or more.

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        last, count = self._kept(self._energy)[-steps // self.control_steps :], self._electric
        step = float(self.scenario.grid.step)
        power = np.concatenate(last)[-steps:] / step
        electricity, gas = power[:, :count].sum(axis=1), power[:, count:].sum(axis=1)
        return RecentSteps(step, self._rooms[-steps - 1 :], electricity.tolist(), gas.tolist())

    def metered(self) -> dict[str, float]:
        """Add up the meters over the run since the reset [J].

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        total = np.concatenate(self._kept(self._energy)).sum(axis=0)
        return dict(zip(self._meters, map(float, total), strict=True))

    def telemetry(self) -> pd.DataFrame:
        """Give what was measured in the run since the reset, shape (n_steps, n_column) [library's units].

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        rows = np.concatenate(self._kept(self._rows))
        index = self.scenario.grid.stamps[: len(rows)].rename("timestamp")
        return pd.DataFrame(rows, index=index, columns=list(self.columns))

    def case(self) -> Case:
        """Give the run as a case, which `thermal.save_case` saves and calibration and diagnosis take."""
        return Case(self.source.building, Telemetry.from_frame(self.telemetry(), where="EnergyPlus"))

    def close(self) -> None:
        """End EnergyPlus' process and remove its folder; what was measured stays."""
        if self._process is not None:
            self._process.close()
            self._process = None

    def _clear(self) -> None:
        self._rows: list[FloatArray] = []
        self._energy: list[FloatArray] = []
        self._rooms: list[FloatArray] = []

    def _kept(self, parts: list[FloatArray]) -> list[FloatArray]:
        PlantError.unless(parts, "run", "a step at least", "none since the reset")
        return parts

    def _ask(self, steps: int, given: Mapping[str, float]) -> tuple[FloatArray, FloatArray, FloatArray]:
        if self._process is None:
            raise PlantError("plant: it was closed; call reset() before the next step")
        values = [CELSIUS.out(given[a.name]) if a.name in given else None for a in self.actuators]
        try:
            answer = self._process.ask(steps, values)
        except PlantError:
            self._process = None
            raise
        rows, ends, energy = (np.array(answer[kind], dtype=float) for kind in ("rows", "ends", "energy"))
        return rows, ends, energy

    def _read(self, rows: FloatArray, first: int) -> FloatArray:
        values = self._reader.read(rows)
        if self._noise is None:
            return values
        return np.stack([self._noise.disturb(first + k, row, self._seed) for k, row in enumerate(values)])

    def _seen(self, rows: FloatArray) -> Measurements:
        return Measurements(self._layout, int(self.scenario.grid.edges[self.now]), rows.mean(axis=0))

    def _check(self) -> None:
        grid, step = self.scenario.grid, self.scenario.grid.step
        if self.scenario.zones != self.source.building.zone_names:
            expected = f"a scenario of the {len(self.source.building.zone_names)} zones of {self.source.building.name}"
            raise PlantError("plant", expected, f"one of {len(self.scenario.zones)} zones")
        if grid.start.tz_convert(self.source.building.location.timezone).time() != pd.Timestamp(0).time():
            raise PlantError("scenario", "a start at midnight", str(grid.start))
        if _HOUR % step or not 60.0 <= step <= 3600.0:
            raise PlantError("scenario", "a step of an hour divided by 1 to 60", f"{step:g} s")
        lead = self.settings.lead_days
        if self._days < 1 or lead < 1 or self._days * _DAY > grid.n_steps * step:
            found = f"{self._days} and {lead} days on a grid of {grid.n_steps * step / _DAY:g}"
            raise PlantError("plant", "days that the scenario covers", found)
        if self.control_steps < 1 or round(self._days * _DAY / step) % self.control_steps:
            expected = "control steps of which the run has a whole number"
            raise PlantError("control_steps", expected, repr(self.control_steps))
