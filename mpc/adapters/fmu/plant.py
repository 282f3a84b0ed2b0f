"""A functional mock-up unit as a plant of ours."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from types import TracebackType

import numpy as np
import pandas as pd

from mpc.adapters.fmu.signals import FmuSignals, actuator_of
from mpc.adapters.fmu.unit import Unit
from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import checked_actions
from mpc.loop.conversion import conversion
from mpc.loop.plant import Measurements, PointLayout, need_running
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.points import ZONE_TEMPERATURE
from thermal.errors import describe

_READABLE = ("output", "local", "input", "calculatedParameter", "parameter")


class FmuPlant:
    """A functional mock-up unit for co-simulation (FMI 2.0) as a `Plant`.

    Inputs are held over a control step, which consists of communication steps. Measurements are what the unit's
    variables say at the end of the control step. For indicators temperatures are those at the edges of the
    communication steps, and powers those at their ends.

    A unit is a compiled program that runs within this process: use those of makers that you trust.

    Parameters
    ----------
    path : str or path-like
        The ``.fmu`` file.
    signals : FmuSignals
        What its variables are.
    control_step : float
        Time between two actions [s].
    start : Timestamp
        When it begins, with a time zone.
    duration : float
        How long it goes on [s].
    communication_steps : int
        Of a control step.
    start_time : float, optional
        The unit's own time at the start [s]; seconds since the local new year by default, as BOPTEST's units count.
    warm_up : float
        Time before the start that is run first, without actions [s]; whole communication steps.
    parameters : mapping of str to float, optional
        Values of parameters and inputs before it begins [their declared units].
    drivers : mapping of str to ndarray, optional
        Values of inputs that are no actuators, one a communication step from the begin of the warm-up on [their
        declared units].

    Raises
    ------
    PlantError
        When the unit cannot be run, or a variable is not there or of another kind.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        signals: FmuSignals,
        control_step: float,
        start: pd.Timestamp,
        duration: float,
        *,
        communication_steps: int = 1,
        start_time: float | None = None,
        warm_up: float = 0.0,
        parameters: Mapping[str, float] | None = None,
        drivers: Mapping[str, FloatArray] | None = None,
    ) -> None:
        if start.tzinfo is None:
            raise PlantError(describe("start", "a time with a time zone", str(start)))
        if not (control_step > 0 and duration >= control_step and communication_steps >= 1 and warm_up >= 0):
            found = f"{control_step} s, {duration} s, {communication_steps} and {warm_up} s"
            raise PlantError(describe("plant", "a positive control step within the duration, 1 step or more", found))
        self.control_step, self.signals = float(control_step), signals
        self._step, self._per_action = control_step / communication_steps, communication_steps
        self._actions, self._warm = int(duration / control_step + 1e-9), int(warm_up / self._step + 1e-9)
        self._zero = int(start.timestamp())
        year = pd.Timestamp(start.year, 1, 1, tz=start.tz).timestamp()
        self._start_time = float(start.timestamp() - year if start_time is None else start_time)
        self._given = dict(parameters or {})
        self._drivers = {name: np.asarray(values, dtype=float) for name, values in (drivers or {}).items()}
        self._number, self._rows = -1, list[list[float]]()
        self._unit = Unit(Path(path))
        try:
            self._look_around(str(start.tz))
        except BaseException:
            self._unit.close()
            raise

    def __enter__(self) -> FmuPlant:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the unit and what it was unpacked to."""
        self._number = -1
        self._unit.close()

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Names of the zones, in the order of records."""
        return tuple(self.signals.zones)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the measurements."""
        return self._layout.columns

    @property
    def finished(self) -> bool:
        """Whether the duration is over."""
        return self._number >= self._actions

    def reset(self, seed: int | None = None) -> Measurements:
        """Start anew, after the warm-up.

        Parameters
        ----------
        seed : int, optional
            Without effect: units of FMI repeat.

        Returns
        -------
        Measurements
            At the start.
        """
        self._number, self._rows = -1, []
        begin = self._start_time - self._warm * self._step
        self._unit.start(begin, self._given | {name: values[0] for name, values in self._drivers.items()})
        for k in range(self._warm):
            self._communicate(k, begin + k * self._step)
        self._number = 0
        self._rows = [self._note()]
        return self._seen()

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Hold setpoints for a control step.

        Parameters
        ----------
        actions : mapping of str to float
            Values by ``ENTITY/POINT`` [unit of the actuator]; what is left out stays as it was.

        Returns
        -------
        Measurements
            At the end of the step.

        Raises
        ------
        PlantActionError
            When a value is unknown, no finite number or outside its range.
        PlantError
            When the duration is over, or `reset` was not called.
        PlantError
            When the unit fails; the plant must then be reset.
        """
        need_running(self._number >= 0)
        given = checked_actions(actions, self._by_name)
        if self.finished:
            raise PlantError(describe("FMU", f"a step of {self._actions}", "none left", "make the duration longer"))
        first, number = self._number * self._per_action, self._number
        self._number = -1  # until the step is done: a unit that failed within it is of no use
        self._unit.set({self.signals.actuators[name]: self._lines[name].out(value) for name, value in given.items()})
        rows = []
        for k in range(first, first + self._per_action):
            self._communicate(self._warm + k, self._start_time + k * self._step)
            rows.append(self._note())
        self._rows += rows
        self._number = number + 1
        return self._seen()

    def forecast(self) -> Forecast:
        """Refuse: a unit of FMI forecasts nothing.

        Raises
        ------
        PlantError
            Always.
        """
        raise PlantError(describe("forecast", "a plant with a forecaster", "an FMU", "run the loop without forecasts"))

    def record(self) -> PlantRecord:
        """Give the run since the reset on the communication steps, for indicators and rewards.

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        if len(self._rows) < 2:
            raise PlantError(describe("run", "a step at least", "none since the reset"))
        table = np.array(self._rows)
        count = len(self.signals.zones)
        powers = {kind: table[1:, count + k] for k, kind in enumerate(self.signals.powers)}
        powers.setdefault("electricity", np.zeros(len(table) - 1))
        return PlantRecord(self._step, table[:, :count], **powers)

    def _look_around(self, timezone: str) -> None:
        """Find the variables of all signals."""
        unit, signals = self._unit, self.signals
        for name in self._given:
            unit.real(name, ("parameter", "input"), "parameter")
        needed = (self._warm + self._actions * self._per_action,)
        for name, values in self._drivers.items():
            unit.real(name, ("input",), "driver")
            if values.shape != needed or not np.isfinite(values).all():
                raise PlantError(describe(f"driver {name}", f"{needed[0]} finite values", f"shape {values.shape}"))
        self._layout = PointLayout(tuple(signals.measurements), timezone)
        self._read = []
        for column, name in signals.measurements.items():
            variable = unit.real(name, _READABLE, "measurement")
            self._read.append((name, conversion(column.rpartition("/")[2], name, variable.unit)))
        zones = [unit.real(name, _READABLE, "zone") for name in signals.zones.values()]
        self._zones = [(v.name, conversion(ZONE_TEMPERATURE, v.name, v.unit)) for v in zones]
        for name in (n for names in signals.powers.values() for n in names):
            variable = unit.real(name, _READABLE, "power")
            if variable.unit not in (None, "", "W"):
                raise PlantError(describe(f"power {name}", "watts", repr(variable.unit)))
        made = [
            actuator_of(name, unit.real(variable, ("input", "parameter"), "actuator"), signals.limits.get(name))
            for name, variable in signals.actuators.items()
        ]
        self.actuators = tuple(actuator for actuator, _ in made)
        self._by_name = {a.name: a for a in self.actuators}
        self._lines = {actuator.name: line for actuator, line in made}

    def _communicate(self, k: int, time: float) -> None:
        self._unit.set({name: float(values[k]) for name, values in self._drivers.items()})
        self._unit.step(time, self._step)

    def _note(self) -> list[float]:
        """Temperatures of the zones and sums of the powers now."""
        powers = self.signals.powers.values()
        values = self._unit.get([*(n for n, _ in self._zones), *(n for names in powers for n in names)])
        temperatures = [line.into(values[name]) for name, line in self._zones]
        return [*temperatures, *(sum(values[name] for name in names) for names in powers)]

    def _seen(self) -> Measurements:
        values = self._unit.get([name for name, _ in self._read])
        numbers = np.array([line.into(values[name]) for name, line in self._read], dtype=float)
        return Measurements(self._layout, self._zero + round(self._number * self.control_step), numbers)
