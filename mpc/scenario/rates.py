"""What a kilowatt-hour costs or emits: constant, by the local hour, or as a series of published values."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from mpc.errors import ScenarioError
from mpc.scenario.grid import Calendar, StepGrid, by_clock, index_seconds, means_of_steps, regular_steps, require_cover
from thermal._types import FloatArray

#: Energy of a kilowatt-hour [J], and length of an hour [s].
KILOWATT_HOUR, HOUR = 3.6e6, 3600.0

#: Energy of the units that gas is sold by [kWh]: 10^5 and 10^6 Btu (IT); a thousand cubic feet at 1,036 Btu each,
#: upper heating value (U.S. EIA, Monthly Energy Review, table A4, 2023).
GAS_UNITS = {"kWh": 1.0, "therm": 29.30711, "mmBtu": 293.0711, "kcf": 303.6216, "MWh": 1000.0, "GJ": 277.7778}


class Rate(Protocol):
    """A price or an emission factor per kilowatt-hour over time."""

    def on(self, grid: StepGrid) -> FloatArray:
        """Average over each step of a grid, shape (n_steps,) [per kWh].

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        """
        ...


@dataclass(frozen=True)
class ConstantRate:
    """The same at all times.

    Parameters
    ----------
    value : float
        Price or factor [1/kWh of the currency or of kg].
    """

    value: float

    def __post_init__(self) -> None:
        ScenarioError.unless(np.isfinite(self.value), "rate", "a finite number per kWh", repr(self.value))

    def on(self, grid: StepGrid) -> FloatArray:
        """Average over each step of a grid, shape (n_steps,) [per kWh].

        Parameters
        ----------
        grid : StepGrid
            Its number of steps counts.
        """
        return np.full(grid.n_steps, float(self.value))


@dataclass(frozen=True, eq=False)
class HourlyRate:
    """A rate that follows the local clock: time of use.

    The local hour decides, so that the 23 and 25 hours of the days on which clocks change are right: the hour that is
    skipped costs nothing, the hour that comes twice costs twice what it says. A step that straddles a change of the
    rate has the mean over it.

    Parameters
    ----------
    weekday : ndarray, shape (24,) or (12, 24)
        For each local hour from midnight, or each month and hour [1/kWh].
    weekend : ndarray, shape (24,) or (12, 24)
        On Saturdays, Sundays and holidays [1/kWh]; default as on weekdays.
    calendar : Calendar
        Which days are holidays; default none.

    Raises
    ------
    ScenarioError
        When a table has another shape or a value is not finite.

    Examples
    --------
    >>> from datetime import date
    >>> rate = HourlyRate([0.1] * 16 + [0.3] * 4 + [0.1] * 4, [0.1] * 24)
    >>> monday = StepGrid(pd.Timestamp("2023-07-03", tz="America/Los_Angeles"), 3600.0, 24)
    >>> rate.on(monday)[15:18].tolist()
    [0.1, 0.3, 0.3]
    """

    weekday: ArrayLike
    weekend: ArrayLike | None = None
    calendar: Calendar = field(default_factory=Calendar)

    def __post_init__(self) -> None:
        weekday = _month_hours(self.weekday, "weekday")
        weekend = weekday if self.weekend is None else _month_hours(self.weekend, "weekend")
        object.__setattr__(self, "weekday", weekday)
        object.__setattr__(self, "weekend", weekend)

    def on(self, grid: StepGrid) -> FloatArray:
        """Average over each step of a grid, shape (n_steps,) [per kWh].

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        """
        tables = np.stack([np.asarray(self.weekday), *[np.asarray(self.weekend)] * 2])
        return grid.mean(by_clock(tables, self.calendar, grid))


def _month_hours(values: ArrayLike, name: str) -> FloatArray:
    table = np.asarray(values, dtype=float)
    fit = table.shape in ((24,), (12, 24)) and bool(np.isfinite(table).all())
    expected = "24 finite numbers, or 12 rows of 24, one an hour of the local day"
    ScenarioError.unless(fit, f"hourly rate: {name}", expected, f"shape {table.shape}")
    return np.array(np.broadcast_to(table, (12, 24)))


def monthly_rate(values: Sequence[float]) -> HourlyRate:
    """Rate that changes with the local month.

    Parameters
    ----------
    values : sequence of float
        January to December [1/kWh].

    Raises
    ------
    ScenarioError
        When there are not 12 finite numbers.
    """
    fit = np.shape(values) == (12,) and np.isfinite(values).all()
    ScenarioError.unless(fit, "monthly rate", "12 finite numbers", values)
    return HourlyRate(np.repeat(np.asarray(values, dtype=float)[:, None], 24, axis=1))


@dataclass(frozen=True, eq=False)
class SeriesRate:
    """A rate as a market or an operator publishes it.

    Parameters
    ----------
    series : pandas.Series
        Values at regular stamps with a time zone [1/kWh], without gaps; constant over each interval.
    stamped : str
        Where in its interval a stamp stands: ``start`` as most markets write it, or ``end``. There is no default,
        since the wrong one is an hour off.

    Raises
    ------
    ScenarioError
        When the stamps have no time zone or are irregular, or a value is missing.
    """

    series: pd.Series
    stamped: Literal["start", "end"]

    def __post_init__(self) -> None:
        index = self.series.index
        ScenarioError.unless_known(self.stamped, ("start", "end"), "series: stamped", "'start' or 'end'")
        regular_steps(index, "series", ScenarioError)
        empty = self.series.isna().to_numpy()
        found = f"{empty.sum()} missing of {len(empty)}, first {index[int(np.argmax(empty))]}"
        ScenarioError.unless(not empty.any(), "series", "a value at each stamp", found)

    def on(self, grid: StepGrid) -> FloatArray:
        """Average over each step of a grid, shape (n_steps,) [per kWh].

        Parameters
        ----------
        grid : StepGrid
            Within the time that the series covers.

        Raises
        ------
        ScenarioError
            When the series does not cover the grid.
        """
        stamps = index_seconds(pd.DatetimeIndex(self.series.index))
        length = stamps[1] - stamps[0]
        edges = np.append(stamps, stamps[-1] + length) - (length if self.stamped == "end" else 0)
        require_cover(grid, edges[0], edges[-1], "series", ScenarioError)
        return means_of_steps(edges.astype(float), self.series.to_numpy(dtype=float), grid.edges.astype(float))


def gas_price(value: float, unit: str) -> ConstantRate:
    """Price of gas by the unit that it is sold in.

    Parameters
    ----------
    value : float
        Price [1/unit in the currency].
    unit : str
        A key of `GAS_UNITS`: ``kWh``, ``MWh``, ``GJ``, ``therm``, ``mmBtu`` or ``kcf`` (a thousand cubic feet).

    Raises
    ------
    ScenarioError
        When the unit is not known.

    Examples
    --------
    >>> round(gas_price(1.2, "therm").value, 4)
    0.0409
    """
    ScenarioError.unless(unit in GAS_UNITS, "gas price", f"a price per {', '.join(GAS_UNITS)}", repr(unit))
    return ConstantRate(value / GAS_UNITS[unit])
