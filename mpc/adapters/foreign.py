"""Plants behind another program: its signals under the names of the case format, their units and ranges."""

import math
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Self

import numpy as np

from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import Actuator, ActuatorKind
from mpc.loop.conversion import SIGNAL_UNITS, Conversion, conversion
from mpc.loop.plant import Measurements, PointLayout
from thermal._types import FloatArray
from thermal.case.points import POINT_TYPES, split_column
from thermal.errors import CaseError

#: Share of a value beyond which another one was used than was sent [-].
SAME = 1e-6

_SWITCH = "_activate"
# quantities whose sensors do not jump when an input does
_STATES = ("temperature", "concentration", "irradiance", "speed")


@dataclass(frozen=True)
class ForeignSignals:
    """Signals of another program under the names of the case format.

    Parameters
    ----------
    measurements : mapping of str to str
        Signal of each column ``ENTITY/POINT``; its declared unit is converted.
    actuators : mapping of str to str
        Input of each actuator ``ENTITY/POINT``; its declared limits become the actuator's range.
    zones : mapping of str to str
        Signal with the air temperature of each zone.
    electricity, gas, district_heating : tuple of str
        Signals whose sum is the power that is bought [W].
    limits : mapping of str to tuple of float
        Ranges of actuators in the place of those declared [library's unit].
    kinds : mapping of str to str
        ``on_off`` or ``modulating`` of actuators that are not continuous; a Boolean input is on-off anyhow.
    minimums : mapping of str to float
        Smallest values of modulating actuators that are not off [library's unit].
    releases : mapping of str to str
        Input that hands an actuator over while it is 1, and back to the building's own control with 0. BOPTEST's
        convention holds by default: ``X_activate`` of an input ``X_u``.
    units : mapping of str to str
        Units of signals whose declared one is missing or wrong.

    Raises
    ------
    PlantError
        When there is no zone, a column is of no known point, two actuators are one input, a limit, kind, minimum or
        release is of no actuator, or a limit is beyond its point.
    """

    measurements: Mapping[str, str]
    actuators: Mapping[str, str]
    zones: Mapping[str, str]
    electricity: tuple[str, ...] = ()
    gas: tuple[str, ...] = ()
    district_heating: tuple[str, ...] = ()
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict, kw_only=True)
    kinds: Mapping[str, ActuatorKind] = field(default_factory=dict, kw_only=True)
    minimums: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    releases: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    units: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    _kind, _error = "a variable", PlantError

    def __post_init__(self) -> None:
        self._error.unless(self.zones, "signals", f"{self._kind} for the temperature of a zone at least", "none")
        for column in self.measurements:
            try:
                split_column(column, "signals")
            except CaseError as error:
                raise self._error(str(error)) from error
        for what in ("limits", "kinds", "minimums", "releases"):
            for name in getattr(self, what):
                self._error.unless_known(name, self.actuators, what, "an actuator of these signals")
        for name, pair in self.limits.items():
            finite = -math.inf < pair[0] < pair[1] < math.inf
            self._error.unless(finite, f"limits: {name}", "a lower and a higher number", repr(pair))
            kind = POINT_TYPES.get(name.rpartition("/")[2])
            if kind is not None and not kind.possible(pair).all():
                expected = f"numbers from {kind.lowest:g} to {kind.highest:g}, in the library's unit"
                raise self._error(f"limits: {name}", expected, f"{pair[0]:g} to {pair[1]:g}")
        by_signal: dict[str, str] = {}
        for name, signal in self.actuators.items():
            other = by_signal.setdefault(signal, name)
            self._error.unless(other == name, f"actuators: {name}", "an input of its own", f"{signal!r} of {other}")

    def activations(self, inputs: Collection[str]) -> dict[str, str]:
        """Find the input that hands each actuator over, where it has one.

        Parameters
        ----------
        inputs : collection of str
            All inputs of the other program.

        Returns
        -------
        dict of str to str
            By signal of the actuator.

        Raises
        ------
        PlantError
            When an actuator would reach nothing: it is a switch itself, or its switch is not there.
        """
        switches, found = [name for name in inputs if name.endswith(_SWITCH)], dict[str, str]()
        for name, signal in self.actuators.items():
            if signal not in inputs:
                continue  # refused by name where it is looked up, or a parameter
            where, switch = f"actuator {name}: {signal!r}", self.releases.get(name, activation(signal))
            if signal.endswith(_SWITCH) and signal.replace(_SWITCH, "_u") in inputs:
                advice = "name the input that ends in _u: it is activated while it is acted upon"
                raise self._error(where, "an input that carries a value", "the switch of one", advice)
            if switch in inputs and switch != signal:
                found[signal] = switch
            elif name in self.releases or (signal.endswith("_u") and switches):
                advice = "map another input, or say which switch it has with `releases`"
                listed = ", ".join(switches[:8]) or "none"
                raise self._error(
                    where, f"a switch {switch!r}, without which it reaches nothing", f"the switches {listed}", advice
                )
        return found

    def unit_of(self, signal: str, declared: str | None) -> str | None:
        """Tell the unit of a signal.

        Parameters
        ----------
        signal : str
            Its name.
        declared : str or None
            What the other program says.
        """
        return self.units.get(signal, declared)

    @property
    def powers(self) -> Mapping[str, tuple[str, ...]]:
        """Signals of each kind of energy."""
        kinds = {"electricity": self.electricity, "gas": self.gas, "district_heating": self.district_heating}
        return {kind: names for kind, names in kinds.items() if names}

    @property
    def recorded(self) -> list[str]:
        """Signals of the zones and of the powers, once each."""
        return list(dict.fromkeys([*self.zones.values(), *(n for names in self.powers.values() for n in names)]))


def activation(name: str) -> str:
    """Name the signal that activates an input by BOPTEST's convention.

    Parameters
    ----------
    name : str
        Of the input, ``<name>_u``.
    """
    return f"{name.removesuffix('_u')}{_SWITCH}"


class Declared(NamedTuple):
    """What another program says of a signal.

    Parameters
    ----------
    unit : str or None
        Its unit; None is taken for the library's.
    lowest, highest : float or None
        Its limits [unit]; None is no limit.
    on_off : bool
        Whether it is a Boolean.
    """

    unit: str | None
    lowest: float | None = None
    highest: float | None = None
    on_off: bool = False


class ForeignPlant(ABC):
    """A plant behind another program; `close` frees that, as does leaving a ``with`` block."""

    control_step: float
    zone_names: tuple[str, ...]
    actuators: tuple[Actuator, ...]
    _layout: PointLayout

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Free what the plant holds of the other program."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the measurements."""
        return self._layout.columns


class SignalPlant(ForeignPlant):
    """A plant whose measurements and actuators are single signals of the other program."""

    signals: ForeignSignals

    def _map(
        self,
        timezone: str,
        outputs: Callable[[str], Declared],
        inputs: Callable[[str], Declared],
        known: Collection[str],
    ) -> None:
        """Find units and ranges of all signals, and the switches of the actuators among all known inputs."""
        signals = self.signals
        self._switches = signals.activations(known)
        self.zone_names = tuple(signals.zones)
        self._layout = PointLayout(tuple(signals.measurements), timezone)
        self._read = [
            (name, conversion(column.rpartition("/")[2], name, signals.unit_of(name, outputs(name).unit)))
            for column, name in signals.measurements.items()
        ]
        self._by_name: dict[str, Actuator] = {}
        self._lines: dict[str, Conversion] = {}
        for name, signal in signals.actuators.items():
            point, declared = name.rpartition("/")[2], inputs(signal)
            declared = declared._replace(unit=signals.unit_of(signal, declared.unit))
            line = self._lines[name] = conversion(point, signal, declared.unit)
            unit = SIGNAL_UNITS[POINT_TYPES[point].quantity] if point in POINT_TYPES else declared.unit or "1"
            low, high = (None if value is None else line.into(value) for value in (declared.lowest, declared.highest))
            most = sys.float_info.max
            span = signals.limits.get(name, (-most if low is None else low, most if high is None else high))
            kind = signals.kinds.get(name, "on_off" if declared.on_off else "continuous")
            minimum = signals.minimums.get(name)
            self._by_name[name] = Actuator(name, unit, *span, required=False, kind=kind, minimum=minimum)
        self.actuators = tuple(self._by_name.values())
        kinds = zip(self._layout.columns, self._layout.quantities, strict=True)
        self._lines_between = np.array([q in _STATES and c.endswith("_sensor") for c, q in kinds], dtype=bool)

    def _sent(self, given: Mapping[str, float]) -> dict[str, float]:
        """Values of the inputs that stand for setpoints [their declared units], and of the switches of all actuators.

        What is not acted upon is released.
        """
        sent = {self.signals.actuators[name]: self._lines[name].out(value) for name, value in given.items()}
        return sent | {switch: float(signal in sent) for signal, switch in self._switches.items()}

    def _mean(self, rows: FloatArray, seconds: int) -> Measurements:
        """Average readings at the begin of a control step and at the ends of its parts, shape (n_part + 1, n_column).

        States such as temperatures lie on straight lines between readings. All else may jump when an input does, at
        the begin of the step: it is what it is at the end of each part.
        """
        if not rows.size:  # nothing is measured
            return Measurements(self._layout, seconds, np.empty(0))
        lines, ends = 0.5 * (rows[1:] + rows[:-1]), rows[1:]
        return Measurements(self._layout, seconds, np.where(self._lines_between, lines, ends).mean(axis=0))

    def _seen(self, values: Mapping[str, Any], seconds: int) -> Measurements:
        """Measurements of values by signal [their declared units]; what is no number is NaN."""
        return Measurements(self._layout, seconds, self._numbers(values))

    def _numbers(self, values: Mapping[str, Any]) -> FloatArray:
        """Give readings in the order of the columns, shape (n_column,) [library's units]; what is no number is NaN."""
        numbers = np.full(len(self._read), np.nan)
        for k, (name, line) in enumerate(self._read):
            value = values.get(name)
            if isinstance(value, int | float) and not isinstance(value, bool):
                numbers[k] = line.into(value)
        return numbers

    def _record(self, step: float, zones: FloatArray, powers: dict[str, FloatArray]) -> PlantRecord:
        """Record of temperatures at the edges of steps and mean powers over them; no electricity is none used."""
        return PlantRecord(step, zones, **{"electricity": np.zeros(len(zones) - 1), **powers})
