"""What every plant gives and takes: ours, EnergyPlus and BOPTEST behind the same few methods."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import pandas as pd

from mpc.errors import PlantError
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import Actuator
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.points import POINT_TYPES, split_column
from thermal.errors import describe, nearest
from thermal.units import QUANTITIES, from_si


@dataclass(frozen=True, eq=False)
class PointLayout:
    """Which points a plant measures, in which order.

    Parameters
    ----------
    columns : tuple of str
        ``ENTITY/POINT`` with the point types of the case format.
    timezone : str
        IANA name of the building's time zone.
    """

    columns: tuple[str, ...]
    timezone: str

    @cached_property
    def position(self) -> Mapping[str, int]:
        """Position of each column."""
        return {column: k for k, column in enumerate(self.columns)}

    @cached_property
    def quantities(self) -> tuple[str, ...]:
        """What each column measures, a key of `thermal.units.QUANTITIES`."""
        return tuple(POINT_TYPES[split_column(column, "plant")[1]].quantity for column in self.columns)


class Measurements(Mapping[str, float]):
    """What a building's sensors and meters say of a control step that has ended: means over it, by ``ENTITY/POINT``.

    Values are in the library's units, those of `thermal.case.telemetry.Telemetry`; `in_file_units` gives those of
    case folders.

    Parameters
    ----------
    layout : PointLayout
        Columns.
    seconds : int
        End of the control step, since 1970 in UTC [s].
    source : ndarray or callable
        Values in the order of the columns [library's units], or what makes them when they are first asked for.

    Examples
    --------
    >>> import numpy as np
    >>> layout = PointLayout(("weather_station/outside_air_temperature_sensor",), "UTC")
    >>> seen = Measurements(layout, 0, np.array([283.15]))
    >>> seen["weather_station/outside_air_temperature_sensor"], round(float(seen.in_file_units().iloc[0]), 3)
    (283.15, 10.0)
    """

    def __init__(self, layout: PointLayout, seconds: int, source: FloatArray | Callable[[], FloatArray]) -> None:
        self.layout, self.seconds, self._source = layout, seconds, source

    @cached_property
    def values_array(self) -> FloatArray:
        """Values in the order of the columns, shape (n_column,) [library's units]; NaN is missing."""
        values = self._source() if callable(self._source) else self._source
        self._source = values
        return values

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the values."""
        return self.layout.columns

    @property
    def stamp(self) -> pd.Timestamp:
        """End of the control step, local."""
        return pd.Timestamp(self.seconds, unit="s", tz="UTC").tz_convert(self.layout.timezone)

    def __getitem__(self, column: str) -> float:
        at = self.layout.position.get(column)
        if at is None:
            raise KeyError(describe("measurements", "a column", repr(column), nearest(column, self.columns)))
        return float(self.values_array[at])

    def __contains__(self, column: object) -> bool:
        return column in self.layout.position  # without the search for the nearest name that a lookup ends in

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    def in_file_units(self) -> pd.Series:
        """Values in the units of case folders [degC, kg/s, W, %], by column; the stamp is its name."""
        values = [
            float(from_si(value, QUANTITIES[quantity].file_unit, quantity))
            for value, quantity in zip(self.values_array, self.layout.quantities, strict=True)
        ]
        return pd.Series(values, index=list(self.columns), name=self.stamp)


class Actuated(Protocol):
    """What a controller can be made for: a plant, or a building that is reached otherwise."""

    @property
    def control_step(self) -> float:
        """Time between two actions [s]."""

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        """What a controller may set, required ones first."""


class Plant(Actuated, Protocol):
    """A building with its plant that a controller can be tested on; hands out measurements, never states."""

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Names of the zones, in the order of records."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the measurements."""

    @property
    def finished(self) -> bool:
        """Whether the time that the plant has inputs for is over."""

    def reset(self, seed: int | None = None) -> Measurements:
        """Start anew.

        Parameters
        ----------
        seed : int, optional
            Of all that is random; that of the run before by default.

        Returns
        -------
        Measurements
            Before the first action.
        """

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Hold setpoints for a control step.

        Parameters
        ----------
        actions : mapping of str to float
            Setpoints by ``ENTITY/POINT`` [K] or [Pa].

        Returns
        -------
        Measurements
            Of that control step.
        """

    def forecast(self) -> Forecast:
        """Forecast what comes, from now on."""

    def record(self) -> PlantRecord:
        """Give the run since the reset on the plant's own steps, for indicators: the truth, not for controllers."""


class RestorablePlant(Plant, Protocol):
    """A plant whose state can be kept and returned to, as planning and learning want it."""

    def save_state(self) -> Any:
        """Keep everything that the next steps depend on; what it is concerns nobody else."""

    def restore_state(self, saved: Any) -> None:
        """Return to a saved state: what follows is bit for bit what followed then.

        Parameters
        ----------
        saved : object
            Of `save_state`.
        """


class Controller(Protocol):
    """What sets the setpoints: rules, optimal control or a learned policy."""

    def step(self, measurements: Measurements, forecast: Forecast | None) -> Mapping[str, float]:
        """Choose setpoints for the next control step.

        Parameters
        ----------
        measurements : Measurements
            Of the control step that has just ended.
        forecast : Forecast or None
            Of what comes; None where the plant was asked for none.

        Returns
        -------
        mapping of str to float
            Setpoints by ``ENTITY/POINT`` [K] or [Pa].
        """


def need_running(started: bool) -> None:
    """Refuse a step before a reset.

    Parameters
    ----------
    started : bool
        Whether `reset` was called.
    """
    if not started:
        raise PlantError("plant: call reset() before the first step")
