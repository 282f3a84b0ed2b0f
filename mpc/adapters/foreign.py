"""Plants behind another program: its signals under the names of the case format, their units and ranges."""

import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import Actuator
from mpc.loop.conversion import SIGNAL_UNITS, Conversion, conversion
from mpc.loop.plant import Measurements, PointLayout
from thermal._types import FloatArray
from thermal.case.points import POINT_TYPES, split_column
from thermal.errors import CaseError


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

    Raises
    ------
    PlantError
        When there is no zone, or a column is of no known point.
    """

    measurements: Mapping[str, str]
    actuators: Mapping[str, str]
    zones: Mapping[str, str]
    electricity: tuple[str, ...] = ()
    gas: tuple[str, ...] = ()
    district_heating: tuple[str, ...] = ()
    _kind, _error = "a variable", PlantError

    def __post_init__(self) -> None:
        self._error.unless(self.zones, "signals", f"{self._kind} for the temperature of a zone at least", "none")
        for column in self.measurements:
            try:
                split_column(column, "signals")
            except CaseError as error:
                raise self._error(str(error)) from error

    @property
    def powers(self) -> Mapping[str, tuple[str, ...]]:
        """Signals of each kind of energy."""
        kinds = {"electricity": self.electricity, "gas": self.gas, "district_heating": self.district_heating}
        return {kind: names for kind, names in kinds.items() if names}

    @property
    def recorded(self) -> list[str]:
        """Signals of the zones and of the powers, once each."""
        return list(dict.fromkeys([*self.zones.values(), *(n for names in self.powers.values() for n in names)]))


class Declared(NamedTuple):
    """What another program says of a signal.

    Parameters
    ----------
    unit : str or None
        Its unit; None is taken for the library's.
    lowest, highest : float or None
        Its limits [unit]; None is no limit.
    """

    unit: str | None
    lowest: float | None = None
    highest: float | None = None


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
        limits: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        """Find units and ranges of all signals; `limits` are in the place of those declared [library's units]."""
        signals = self.signals
        self.zone_names = tuple(signals.zones)
        self._layout = PointLayout(tuple(signals.measurements), timezone)
        self._read = [
            (name, conversion(column.rpartition("/")[2], name, outputs(name).unit))
            for column, name in signals.measurements.items()
        ]
        self._by_name: dict[str, Actuator] = {}
        self._lines: dict[str, Conversion] = {}
        for name, signal in signals.actuators.items():
            point, declared = name.rpartition("/")[2], inputs(signal)
            line = self._lines[name] = conversion(point, signal, declared.unit)
            unit = SIGNAL_UNITS[POINT_TYPES[point].quantity] if point in POINT_TYPES else declared.unit or "1"
            low, high = (None if value is None else line.into(value) for value in declared[1:])
            most = sys.float_info.max
            span = (limits or {}).get(name, (-most if low is None else low, most if high is None else high))
            self._by_name[name] = Actuator(name, unit, *span, required=False)
        self.actuators = tuple(self._by_name.values())

    def _sent(self, given: Mapping[str, float]) -> dict[str, float]:
        """Values of the inputs that stand for setpoints [their declared units]."""
        return {self.signals.actuators[name]: self._lines[name].out(value) for name, value in given.items()}

    def _seen(self, values: Mapping[str, Any], seconds: int) -> Measurements:
        """Measurements of values by signal [their declared units]; what is no number is NaN."""
        numbers = np.full(len(self._read), np.nan)
        for k, (name, line) in enumerate(self._read):
            value = values.get(name)
            if isinstance(value, int | float) and not isinstance(value, bool):
                numbers[k] = line.into(value)
        return Measurements(self._layout, seconds, numbers)

    def _record(self, step: float, zones: FloatArray, powers: dict[str, FloatArray]) -> PlantRecord:
        """Record of temperatures at the edges of steps and mean powers over them; no electricity is none used."""
        return PlantRecord(step, zones, **{"electricity": np.zeros(len(zones) - 1), **powers})
