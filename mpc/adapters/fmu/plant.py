"""A functional mock-up unit as a plant of ours."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
import pandas as pd

from mpc.adapters.fmu.unit import Interface, Unit
from mpc.adapters.foreign import SAME, Declared, ForeignSignals, SignalPlant
from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import checked_actions
from mpc.loop.conversion import conversion
from mpc.loop.plant import Measurements, need_running
from mpc.scenario.forecast import Forecast, Forecaster
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray
from thermal.case.points import ZONE_TEMPERATURE

#: Longest communication step unless told otherwise [s]: BOPTEST's test cases note down their outputs as often.
COMMUNICATION_STEP = 30.0

_READABLE = ("output", "local", "input", "calculatedParameter", "parameter")


class FmuSignals(ForeignSignals):
    """Variables of a functional mock-up unit under the names of the case format; parameters as `ForeignSignals`.

    Examples
    --------
    >>> signals = FmuSignals({"room/zone_air_temperature_sensor": "T"}, {"room/heating_power": "Q"}, {"room": "T"})
    >>> signals.zones["room"]
    'T'
    """


@dataclass(frozen=True)
class FmuTime:
    """When a unit runs.

    Parameters
    ----------
    start : Timestamp
        When it begins, with a time zone.
    duration : float
        How long it goes on [s].
    communication_steps : int, optional
        Of a control step; by default as many as make them of `COMMUNICATION_STEP` at most.
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
    communication_steps: int | None = None
    start_time: float | None = None
    warm_up: float = 0.0

    def __post_init__(self) -> None:
        PlantError.unless(self.start.tzinfo is not None, "start", "a time with a time zone", str(self.start))

    def steps_of(self, control_step: float) -> int:
        """Tell the number of communication steps of a control step.

        Parameters
        ----------
        control_step : float
            [s].
        """
        return self.communication_steps or max(math.ceil(control_step / COMMUNICATION_STEP - 1e-9), 1)


class FmuPlant(SignalPlant):
    """A functional mock-up unit (FMI 2.0 or 3.0, co-simulation or model exchange) as a `Plant`.

    Inputs are held over a control step, which consists of communication steps. A unit's variables are what they are at
    an instant: they are read at the end of each communication step, and measurements are their means over the control
    step, `SignalPlant`. For indicators temperatures are those at the edges of the communication steps, and powers those
    at their ends.

    An input ``X_u`` with a switch ``X_activate``, as BOPTEST's units have, is activated while it is acted upon, and
    released in each step whose action leaves it out. What has no switch stays as it was. Where the unit says what it
    used, an output ``X_y``, another value than was sent is an error.

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
        Values of parameters, inputs and start values before it begins [their declared units]; 0 and 1 of Booleans.
    drivers : mapping of str to ndarray, optional
        Values of inputs that are no actuators, one a communication step from the begin of the warm-up on [their
        declared units].
    interface : {"co-simulation", "model exchange"}, optional
        How it is run; model exchange by default, where the unit has it.
    forecaster : Forecaster, optional
        Forecasts of a scenario whose first step begins with the run and whose steps are its control steps.

    Raises
    ------
    PlantError
        When the unit cannot be run, a variable is not there or of another kind, an actuator would reach nothing, or
        the forecaster's scenario is of other zones or steps.
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
        interface: Interface | None = None,
        forecaster: Forecaster | None = None,
    ) -> None:
        steps = time.steps_of(control_step) if control_step > 0 else 0
        if not (control_step > 0 and time.duration >= control_step and steps >= 1 and time.warm_up >= 0):
            found = f"{control_step} s, {time.duration} s, {steps} and {time.warm_up} s"
            raise PlantError("plant", "a positive control step within the duration, 1 step or more", found)
        self.control_step, self.signals, self._time, self._parts = float(control_step), signals, time, steps
        self._step = control_step / steps
        self._actions, self._warm = int(time.duration / control_step + 1e-9), int(time.warm_up / self._step + 1e-9)
        self._zero = int(time.start.timestamp())
        year = pd.Timestamp(time.start.year, 1, 1, tz=time.start.tz).timestamp()
        self._start = float(time.start.timestamp() - year if time.start_time is None else time.start_time)
        self._given = dict(parameters or {})
        self._drivers = {name: np.asarray(values, dtype=float) for name, values in (drivers or {}).items()}
        self._number, self._rows, self._last = -1, list[list[float]](), np.zeros(0)
        self.forecaster = forecaster
        if forecaster is not None:
            _check_scenario(forecaster.scenario, signals, self.control_step, time.start)
        self.unit = Unit(Path(path), interface)
        try:
            self._look_around()
        except BaseException:
            self.unit.close()
            raise

    def close(self) -> None:
        """Free the unit and what it was unpacked to."""
        self._number = -1
        self.unit.close()

    @property
    def finished(self) -> bool:
        """Whether the duration is over."""
        return self._number >= self._actions

    def reset(self, seed: int | None = None) -> Measurements:
        """Start anew, after the warm-up under the building's own control.

        Parameters
        ----------
        seed : int, optional
            Without effect: units of FMI repeat.

        Returns
        -------
        Measurements
            At the start, an instant.
        """
        self._number, self._rows = -1, []
        released = dict.fromkeys(self._switches.values(), 0.0)
        first = {name: values[0] for name, values in self._drivers.items()}
        self.unit.start(self._start - self._warm * self._step, released | self._given | first, self._step)
        for k in range(-self._warm, 0):
            self._communicate(k)
        self._number = 0
        self._rows = [self._note()]
        self._last = self._readings()
        return Measurements(self._layout, self._zero, self._last)

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Hold setpoints for a control step.

        Parameters
        ----------
        actions : mapping of str to float
            Values by ``ENTITY/POINT`` [unit of the actuator]; what is left out is released where it has a switch, and
            stays as it was otherwise.

        Returns
        -------
        Measurements
            Means over the step.

        Raises
        ------
        PlantActionError
            When a value is unknown, no finite number or outside its range.
        PlantError
            When the duration is over, or `reset` was not called, or the unit fails or used another value than was sent;
            the plant must then be reset.
        """
        need_running(self._number >= 0)
        given = checked_actions(actions, self._by_name)
        if self.finished:
            raise PlantError("FMU", f"a step of {self._actions}", "none left", "make the duration longer")
        number, steps, sent = self._number, self._parts, self._sent(given)
        self._number = -1  # until the step is done: a unit that failed within it is of no use
        self.unit.set(sent)
        rows, readings = [], [self._last]
        for k in range(number * steps, (number + 1) * steps):
            self._communicate(k)
            rows.append(self._note())
            readings.append(self._readings())
        self._check_used(given, sent)
        self._rows += rows
        self._number, self._last = number + 1, readings[-1]
        return self._mean(np.array(readings), self._zero + round(self._number * self.control_step))

    def forecast(self) -> Forecast:
        """Forecast the control steps from now on.

        Raises
        ------
        PlantError
            When the plant has no forecaster.
        """
        if self.forecaster is None:
            advice = "pass `forecaster`, or name weather, prices and bands in a plant.yaml"
            raise PlantError("forecast", "a plant with a forecaster", "an FMU without", advice)
        return self.forecaster.table(max(self._number, 0))

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
        unit, signals = self.unit, self.signals
        for name in self._given:
            starts = getattr(unit.variables.get(name), "initial", None) in ("exact", "approx")
            unit.variable(name, ("parameter", "input", *(("local", "output") if starts else ())), "parameter")
        needed = (self._warm + self._actions * self._parts,)
        for name, values in self._drivers.items():
            unit.variable(name, ("input",), "driver")
            if values.shape != needed or not np.isfinite(values).all():
                raise PlantError(f"driver {name}", f"{needed[0]} finite values", f"shape {values.shape}")
        zones = [unit.variable(name, _READABLE, "zone", ("real",)) for name in signals.zones.values()]
        units = [signals.unit_of(v.name, unit.declared(v, "unit")) for v in zones]
        self._zones = [(v.name, conversion(ZONE_TEMPERATURE, v.name, u)) for v, u in zip(zones, units, strict=True)]
        for name in (n for names in signals.powers.values() for n in names):
            variable = unit.variable(name, _READABLE, "power", ("real",))
            unit_of = signals.unit_of(name, unit.declared(variable, "unit"))
            PlantError.unless(unit_of in (None, "", "W"), f"power {name}", "watts", repr(unit_of))

        def output(name: str) -> Declared:
            return Declared(unit.declared(unit.variable(name, _READABLE, "measurement"), "unit"))

        def input_of(name: str) -> Declared:
            v = unit.variable(name, ("input", "parameter"), "actuator")
            texts = (unit.declared(v, "min"), unit.declared(v, "max"))
            low, high = (None if text is None else float(text) for text in texts)
            on_off = v.type == "Boolean"
            return Declared(unit.declared(v, "unit"), 0.0 if on_off else low, 1.0 if on_off else high, on_off)

        self._map(str(self._time.start.tz), output, input_of, unit.inputs)
        for switch in self._switches.values():
            unit.variable(switch, ("input",), "switch")
        echoes = {signal: f"{signal.removesuffix('_u')}_y" for signal in self._switches}
        self._echoes = {signal: y for signal, y in echoes.items() if y in unit.variables}

    def _communicate(self, k: int) -> None:
        """Take a communication step; those before the start have negative numbers."""
        self.unit.set({name: float(values[self._warm + k]) for name, values in self._drivers.items()})
        self.unit.step(self._start + k * self._step, self._step)

    def _check_used(self, given: Mapping[str, float], sent: Mapping[str, float]) -> None:
        """Refuse a step in which the unit used another value than was sent, where it says which."""
        used = self.unit.get(self._echoes.values())
        for name in given:
            signal = self.signals.actuators[name]
            value = used.get(self._echoes.get(signal, ""), sent[signal])
            if not abs(value - sent[signal]) <= SAME * max(abs(sent[signal]), 1.0):
                advice = f"the overwrite reached nothing: is {self._switches[signal]!r} its switch?"
                raise PlantError(f"actuator {name}: {signal} = {sent[signal]:g}", "the same used", f"{value:g}", advice)

    def _note(self) -> list[float]:
        """Temperatures of the zones and sums of the powers now."""
        powers = self.signals.powers.values()
        values = self.unit.get(self.signals.recorded)
        temperatures = [line.into(values[name]) for name, line in self._zones]
        return [*temperatures, *(sum(values[name] for name in names) for names in powers)]

    def _readings(self) -> FloatArray:
        """Measured variables now, shape (n_column,) [library's units]."""
        return self._numbers(self.unit.get(self.signals.measurements.values()))


def _check_scenario(scenario: Scenario, signals: FmuSignals, control_step: float, start: pd.Timestamp) -> None:
    """Refuse a scenario of another plant."""
    expected = f"zones {', '.join(signals.zones)}, steps of {control_step:g} s from {start} on"
    grid = scenario.grid
    fits = scenario.zones == tuple(signals.zones) and grid.step == control_step and grid.start == start
    found = f"zones {', '.join(scenario.zones)}, steps of {grid.step:g} s from {grid.start} on"
    PlantError.unless(fits, "forecaster: scenario", expected, found)
