"""A functional mock-up unit as a plant of ours."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd

from mpc.adapters.fmu.unit import Unit
from mpc.adapters.foreign import Declared, ForeignSignals, SignalPlant
from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import checked_actions
from mpc.loop.conversion import conversion
from mpc.loop.plant import Measurements, need_running
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.points import ZONE_TEMPERATURE
from thermal.errors import nearest

_READABLE = ("output", "local", "input", "calculatedParameter", "parameter")


@dataclass(frozen=True)
class FmuSignals(ForeignSignals):
    """Variables of a functional mock-up unit under the names of the case format.

    Parameters
    ----------
    measurements : mapping of str to str
        Variable of each column ``ENTITY/POINT``; its declared unit is converted.
    actuators : mapping of str to str
        Input of each actuator ``ENTITY/POINT``; its declared limits become the actuator's range.
    zones : mapping of str to str
        Variable with the air temperature of each zone [its declared unit].
    electricity, gas, district_heating : tuple of str
        Variables whose sum is the power that is bought [W].
    limits : mapping of str to tuple of float
        Ranges of actuators in the place of those declared [library's unit].

    Raises
    ------
    PlantError
        When there is no zone, a column is of no known point, or a limit is of no actuator.

    Examples
    --------
    >>> signals = FmuSignals({"room/zone_air_temperature_sensor": "T"}, {"room/heating_power": "Q"}, {"room": "T"})
    >>> signals.zones["room"]
    'T'
    """

    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, pair in self.limits.items():
            if name not in self.actuators or not -math.inf < pair[0] < pair[1] < math.inf:
                advice = nearest(name, self.actuators)
                raise PlantError(f"limits: {name}", "a lower and a higher number of an actuator", repr(pair), advice)


@dataclass(frozen=True)
class FmuTime:
    """When a unit runs.

    Parameters
    ----------
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

    Raises
    ------
    PlantError
        When the start has no time zone.
    """

    start: pd.Timestamp
    duration: float
    communication_steps: int = 1
    start_time: float | None = None
    warm_up: float = 0.0

    def __post_init__(self) -> None:
        PlantError.unless(self.start.tzinfo is not None, "start", "a time with a time zone", str(self.start))


class FmuPlant(SignalPlant):
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
    time : FmuTime
        When it runs, a control step at least.
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

    signals: FmuSignals

    def __init__(
        self,
        path: str | PathLike[str],
        signals: FmuSignals,
        control_step: float,
        time: FmuTime,
        *,
        parameters: Mapping[str, float] | None = None,
        drivers: Mapping[str, FloatArray] | None = None,
    ) -> None:
        steps = time.communication_steps
        if not (control_step > 0 and time.duration >= control_step and steps >= 1 and time.warm_up >= 0):
            found = f"{control_step} s, {time.duration} s, {steps} and {time.warm_up} s"
            raise PlantError("plant", "a positive control step within the duration, 1 step or more", found)
        self.control_step, self.signals, self._time = float(control_step), signals, time
        self._step = control_step / steps
        self._actions, self._warm = int(time.duration / control_step + 1e-9), int(time.warm_up / self._step + 1e-9)
        self._zero = int(time.start.timestamp())
        year = pd.Timestamp(time.start.year, 1, 1, tz=time.start.tz).timestamp()
        self._start = float(time.start.timestamp() - year if time.start_time is None else time.start_time)
        self._given = dict(parameters or {})
        self._drivers = {name: np.asarray(values, dtype=float) for name, values in (drivers or {}).items()}
        self._number, self._rows = -1, list[list[float]]()
        self._unit = Unit(Path(path))
        try:
            self._look_around()
        except BaseException:
            self._unit.close()
            raise

    def close(self) -> None:
        """Free the unit and what it was unpacked to."""
        self._number = -1
        self._unit.close()

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
        first = {name: values[0] for name, values in self._drivers.items()}
        self._unit.start(self._start - self._warm * self._step, self._given | first)
        for k in range(-self._warm, 0):
            self._communicate(k)
        self._number = 0
        self._rows = [self._note()]
        return self._measured()

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
            When the duration is over, or `reset` was not called, or the unit fails; the plant must then be reset.
        """
        need_running(self._number >= 0)
        given = checked_actions(actions, self._by_name)
        if self.finished:
            raise PlantError("FMU", f"a step of {self._actions}", "none left", "make the duration longer")
        number, steps = self._number, self._time.communication_steps
        self._number = -1  # until the step is done: a unit that failed within it is of no use
        self._unit.set(self._sent(given))
        rows = []
        for k in range(number * steps, (number + 1) * steps):
            self._communicate(k)
            rows.append(self._note())
        self._rows += rows
        self._number = number + 1
        return self._measured()

    def forecast(self) -> Forecast:
        """Refuse: a unit of FMI forecasts nothing.

        Raises
        ------
        PlantError
            Always.
        """
        raise PlantError("forecast", "a plant with a forecaster", "an FMU", "run the loop without forecasts")

    def record(self) -> PlantRecord:
        """Give the run since the reset on the communication steps, for indicators and rewards.

        Raises
        ------
        PlantError
            When there was no step yet.
        """
        PlantError.unless(len(self._rows) >= 2, "run", "a step at least", "none since the reset")
        table = np.array(self._rows)
        count = len(self.zone_names)
        powers = {kind: table[1:, count + k] for k, kind in enumerate(self.signals.powers)}
        return self._record(self._step, table[:, :count], powers)

    def _look_around(self) -> None:
        """Find the variables of all signals."""
        unit, signals = self._unit, self.signals
        for name in self._given:
            unit.real(name, ("parameter", "input"), "parameter")
        needed = (self._warm + self._actions * self._time.communication_steps,)
        for name, values in self._drivers.items():
            unit.real(name, ("input",), "driver")
            if values.shape != needed or not np.isfinite(values).all():
                raise PlantError(f"driver {name}", f"{needed[0]} finite values", f"shape {values.shape}")
        zones = [unit.real(name, _READABLE, "zone") for name in signals.zones.values()]
        self._zones = [(v.name, conversion(ZONE_TEMPERATURE, v.name, v.unit)) for v in zones]
        for name in (n for names in signals.powers.values() for n in names):
            variable = unit.real(name, _READABLE, "power")
            PlantError.unless(variable.unit in (None, "", "W"), f"power {name}", "watts", repr(variable.unit))

        def input_of(name: str) -> Declared:
            v = unit.real(name, ("input", "parameter"), "actuator")
            return Declared(v.unit, *(None if text is None else float(text) for text in (v.min, v.max)))

        self._map(
            str(self._time.start.tz), lambda name: Declared(unit.real(name, _READABLE, "measurement").unit), input_of,
            signals.limits,
        )  # fmt: skip

    def _communicate(self, k: int) -> None:
        """Take a communication step; those before the start have negative numbers."""
        self._unit.set({name: float(values[self._warm + k]) for name, values in self._drivers.items()})
        self._unit.step(self._start + k * self._step, self._step)

    def _note(self) -> list[float]:
        """Temperatures of the zones and sums of the powers now."""
        powers = self.signals.powers.values()
        values = self._unit.get(self.signals.recorded)
        temperatures = [line.into(values[name]) for name, line in self._zones]
        return [*temperatures, *(sum(values[name] for name in names) for names in powers)]

    def _measured(self) -> Measurements:
        values = self._unit.get(self.signals.measurements.values())
        return self._seen(values, self._zero + round(self._number * self.control_step))
