"""Any building of EnergyPlus as a plant of single outputs, meters and actuators, as EnergyPlus' own lists name them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pandas as pd

from mpc.adapters.energyplus.input import InputFile, read_input
from mpc.adapters.energyplus.process import EnergyPlusProcess, Job
from mpc.adapters.foreign import Declared, ForeignSignals, SignalPlant
from mpc.errors import EnergyPlusError, PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import checked_actions
from mpc.loop.conversion import conversion
from mpc.loop.plant import Measurements, need_running
from mpc.scenario.forecast import Forecast, Forecaster
from thermal._types import FloatArray
from thermal.case.points import POINT_TYPES, ZONE_TEMPERATURE

_DAY, _HOUR = 86_400, 3_600  # s


class EnergyPlusSignals(ForeignSignals):
    """Signals of a building of EnergyPlus; parameters as `ForeignSignals`.

    An output is named ``KEY, Variable Name``, as its object ``Output:Variable`` says it; a meter by its name, such as
    ``Electricity:HVAC`` [W, the mean]; an actuator ``KEY, Component Type, Control Type``, as the file ``.edd`` lists
    it. Temperatures are in degC there unless `units` says otherwise.

    Examples
    --------
    >>> signals = EnergyPlusSignals(
    ...     {"living/zone_air_temperature_sensor": "LIVING, Zone Mean Air Temperature"},
    ...     {"heat_pump/on": "HP_AVAIL, Schedule:Constant, Schedule Value"},
    ...     {"living": "LIVING, Zone Mean Air Temperature"},
    ...     ("Electricity:HVAC",),
    ... )
    >>> signals.names
    ['LIVING, Zone Mean Air Temperature', 'Electricity:HVAC']
    """

    @property
    def names(self) -> list[str]:
        """Outputs and meters that are read, once each."""
        return list(dict.fromkeys([*self.measurements.values(), *self.recorded]))


@dataclass(frozen=True)
class EnergyPlusRun:
    """What is run, and when.

    Parameters
    ----------
    model, weather : Path
        An ``.idf`` or ``.epJSON`` file, and an ``.epw`` file.
    start : Timestamp
        Midnight by the clock of the weather file, which is never put forward or back.
    days : int
        Length of the run [d].
    steps_per_hour : int
        Of zones and weather, a divisor of 60.
    lead_days : int
        Days under the building's own control before the run [d], at least 1, after EnergyPlus' warm-up.

    Raises
    ------
    PlantError
        When a number is out of its range, or the start is no midnight.
    """

    model: Path
    weather: Path
    start: pd.Timestamp
    days: int
    steps_per_hour: int = 12
    lead_days: int = 1

    def __post_init__(self) -> None:
        midnight = self.start.tzinfo is not None and self.start == self.start.normalize()
        PlantError.unless(midnight, "start", "midnight in a time zone", str(self.start))
        fits = self.days >= 1 and self.lead_days >= 1 and self.steps_per_hour >= 1 and 60 % self.steps_per_hour == 0
        found = f"{self.days} and {self.lead_days} days, {self.steps_per_hour} steps"
        PlantError.unless(fits, "run", "a day or more before and in the run, steps that divide an hour", found)

    @property
    def step(self) -> float:
        """Step of zones and weather [s]."""
        return _HOUR / self.steps_per_hour

    def content(self) -> str:
        """Text of the input file for the run."""
        if self.model.suffix.lower() == ".epjson":
            source = InputFile(json.loads(self.model.read_text(encoding="utf-8")), self.model.stem)
        else:
            source = read_input(self.model)
        first = self.start.date() - timedelta(days=self.lead_days)
        return json.dumps(source.with_period(first, self.days + self.lead_days, self.steps_per_hour))


class EnergyPlusSignalPlant(SignalPlant):
    """A building of EnergyPlus in closed loop, by signals that are named one by one.

    Every run has a process of its own, which waits at each control step. What an action leaves out is released:
    ``step({})`` is the building's own control. Measurements are means over the control step, EnergyPlus' own.

    Parameters
    ----------
    run : EnergyPlusRun
        What is run, and when.
    signals : EnergyPlusSignals
        What its outputs, meters and actuators are.
    control_step : float
        Time between two actions, whole steps of the run [s].
    forecaster : Forecaster, optional
        Forecasts of a scenario on the control steps, from the start on.
    patience : float
        Longest time for an answer of EnergyPlus [s]; then its process is ended.

    Raises
    ------
    PlantError
        When a name has another form, or the control step is none of whole steps.
    EnergyPlusError
        When EnergyPlus is not installed, or cannot read the file.
    """

    signals: EnergyPlusSignals

    def __init__(
        self,
        run: EnergyPlusRun,
        signals: EnergyPlusSignals,
        control_step: float,
        forecaster: Forecaster | None = None,
        patience: float = 600.0,
    ) -> None:
        self.control_step, self.forecaster, self._run, self._patience = control_step, forecaster, run, patience
        self._parts = round(control_step / run.step)
        fits = self._parts >= 1 and abs(self._parts * run.step - control_step) < 1e-6
        PlantError.unless(fits, "control step", f"whole steps of {run.step:g} s", f"{control_step:g} s")
        self.signals = replace(signals, units=_celsius(signals) | dict(signals.units))
        self._map(str(run.start.tz), lambda name: Declared(None), lambda name: Declared(None), ())
        self._meters = [name for name in signals.names if "," not in name]
        self._outputs = [name for name in signals.names if "," in name]
        self._handles = {name: _parts_of(name, signal) for name, signal in signals.actuators.items()}
        self._zones = [conversion(ZONE_TEMPERATURE, n, self.signals.units.get(n)) for n in signals.zones.values()]
        self._content = run.content()
        self._process: EnergyPlusProcess | None = None
        self._number, self._rows, self._rooms = -1, list[FloatArray](), list[FloatArray]()

    @property
    def finished(self) -> bool:
        """Whether less than a control step of the run is left."""
        return (self._number + 1) * self.control_step > self._run.days * _DAY + 1e-6

    def close(self) -> None:
        """End EnergyPlus' process and remove its folder."""
        if self._process is not None:
            self._process.close()
            self._process = None

    def reset(self, seed: int | None = None) -> Measurements:
        """Start EnergyPlus anew, and run the days before.

        Parameters
        ----------
        seed : int, optional
            Without effect: EnergyPlus repeats.

        Returns
        -------
        Measurements
            Of the last control step before the run.
        """
        self.close()
        variables = [(name.rpartition(",")[2].strip(), name.rpartition(",")[0].strip()) for name in self._outputs]
        job = Job(
            self._content, "in.epJSON", self._run.weather, variables, (), self._meters,
            [(component, control, key) for key, component, control in self._handles.values()],
        )  # fmt: skip
        self._process, self._number, self._rows, self._rooms = EnergyPlusProcess(job, self._patience), 0, [], []
        rows, rooms = self._ask(round(self._run.lead_days * _DAY / self._run.step), {})
        self._rooms = [rooms[-1]]
        return self._told(rows[-self._parts :])

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Hold setpoints for a control step.

        Parameters
        ----------
        actions : mapping of str to float
            Values by ``ENTITY/POINT`` [unit of the actuator]; what is left out is released.

        Returns
        -------
        Measurements
            Means over the control step.

        Raises
        ------
        PlantActionError
            When a value is unknown, no finite number or outside its range.
        PlantError
            When the run is over, or `reset` was not called.
        EnergyPlusError
            When EnergyPlus breaks off, lacks what a signal names, or does not answer.
        """
        need_running(self._number >= 0)
        given = checked_actions(actions, self._by_name)
        PlantError.unless(not self.finished, "run", "a control step left", "none", "make it longer")
        rows, rooms = self._ask(self._parts, given)
        self._rows.append(rows)
        self._rooms += [*rooms]
        self._number += 1
        if self.finished and self._process is not None:
            if self._number * self.control_step > self._run.days * _DAY - 1e-6:
                self._process.finish()
            self.close()
        return self._told(rows)

    def forecast(self) -> Forecast:
        """Forecast the control steps from now on.

        Raises
        ------
        PlantError
            When the plant has no forecaster.
        """
        if self.forecaster is None:
            raise PlantError("forecast", "a plant with a forecaster", "none", "pass `forecaster`")
        return self.forecaster.table(max(self._number, 0))

    def record(self) -> PlantRecord:
        """Give the run since the reset on EnergyPlus' own steps, for indicators.

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        PlantError.unless(self._rows, "run", "a step at least", "none since the reset")
        table, names = np.concatenate(self._rows), [*self._outputs, *self._meters]
        sums = {
            kind: np.sum([table[:, names.index(name)] for name in listed], axis=0)
            for kind, listed in self.signals.powers.items()
        }
        return self._record(self._run.step, np.array(self._rooms), sums)

    def _ask(self, steps: int, given: Mapping[str, float]) -> tuple[FloatArray, FloatArray]:
        """Rows of outputs and meters [their units, W], and temperatures of the zones at the ends [K]."""
        if self._process is None:
            raise PlantError("plant: it was closed; call reset() before the next step")
        values = [self._lines[n].out(given[n]) if n in given else None for n in self._handles]
        try:
            answer = self._process.ask(steps, values)
        except EnergyPlusError:
            self._process, self._number = None, -1
            raise
        rows, ends, energy = (np.array(answer[kind], dtype=float) for kind in ("rows", "ends", "energy"))
        zones = zip(self._zones, self.signals.zones.values(), strict=True)
        rooms = np.column_stack([a.offset + a.slope * ends[:, self._outputs.index(name)] for a, name in zones])
        return np.hstack([rows, energy.reshape(steps, -1) / self._run.step]), rooms

    def _told(self, rows: FloatArray) -> Measurements:
        """Means over rows."""
        values = dict(zip([*self._outputs, *self._meters], rows.mean(axis=0).tolist(), strict=True))
        return self._seen(values, int(self._run.start.timestamp()) + round(self._number * self.control_step))


def _celsius(signals: EnergyPlusSignals) -> dict[str, str]:
    """Signals of temperatures, which EnergyPlus has in degC."""
    pairs = [*signals.measurements.items(), *signals.actuators.items()]
    points = [(column.rpartition("/")[2], signal) for column, signal in pairs]
    warm = [signal for point, signal in points if point in POINT_TYPES and POINT_TYPES[point].quantity == "temperature"]
    return dict.fromkeys([*warm, *signals.zones.values()], "degC")


def _parts_of(name: str, signal: str) -> tuple[str, str, str]:
    parts = [part.strip() for part in signal.split(",")]
    if len(parts) != 3:
        raise PlantError(f"actuator {name}", "a signal 'KEY, Component Type, Control Type'", repr(signal))
    return parts[0], parts[1], parts[2]
