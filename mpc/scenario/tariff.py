"""What energy costs and emits: prices, charges for the highest demand of a month, carbon."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from mpc.errors import ScenarioError
from mpc.scenario.grid import Calendar, StepGrid, by_clock, means_of_steps
from mpc.scenario.rates import ConstantRate, HourlyRate, Rate, monthly_rate
from thermal._types import FloatArray, IntArray


def window_means(power: ArrayLike, starts: ArrayLike, step: float, window: float) -> tuple[FloatArray, FloatArray]:
    """Average power over the demand windows of the clock.

    Power is constant over each step, so that its integral is known at any time: windows need not be whole steps.

    Parameters
    ----------
    power : array_like, shape (n_steps,)
        Means over the steps [W].
    starts : array_like, shape (n_steps,)
        Starts of the steps, seconds since 1970 [s].
    step : float
        Length of a step [s].
    window : float
        Length of a window [s]; windows begin at its multiples. The first and the last have the mean of the part that
        lies within the steps.

    Returns
    -------
    mean : ndarray, shape (n_window,)
        Means [W].
    begin : ndarray, shape (n_window,)
        When each window begins [s].
    """
    first = np.asarray(starts, dtype=float)
    edges = np.append(first, first[-1] + step)
    inner = np.arange(np.floor(edges[0] / window) + 1, np.ceil(edges[-1] / window)) * window
    bounds = np.concatenate([edges[:1], inner, edges[-1:]])
    return means_of_steps(edges, np.asarray(power, dtype=float), bounds), bounds[:-1]


@dataclass(frozen=True, eq=False)
class DemandBuckets:
    """Which peaks a demand charge counts apart on a grid.

    Parameters
    ----------
    grid : StepGrid
        Steps.
    bucket : ndarray, shape (n_steps,)
        Number of the peak that each step belongs to; -1 for none.
    rate : ndarray, shape (n_bucket,)
        Charge for each [currency/kW].
    names : tuple of str
        Month, charge and period of each.
    window : float
        Length of the mean whose highest value counts [s].
    """

    grid: StepGrid
    bucket: IntArray
    rate: FloatArray
    names: tuple[str, ...]
    window: float

    def peaks(self, power: ArrayLike, step: float | None = None, first_step: int = 0) -> FloatArray:
        """Highest mean power over a window, of each peak.

        Parameters
        ----------
        power : array_like, shape (n,)
            Means over steps of a run [W].
        step : float
            Length of those steps [s]; default the grid's.
        first_step : int
            Step of the grid in which the run began.

        Returns
        -------
        ndarray, shape (n_bucket,)
            0 or more [W].

        Raises
        ------
        ScenarioError
            When the run is not within the grid.
        """
        values, length = np.asarray(power, dtype=float), self.grid.step if step is None else step
        starts = self.grid.edges[first_step] + np.arange(len(values)) * length
        within = values.ndim == 1 and len(values) and starts[-1] + length <= self.grid.edges[-1]
        expected = f"means over steps within {self.grid.start} to {self.grid.stamps[-1]}"
        ScenarioError.unless(within, "power", expected, f"shape {values.shape}, steps of {length:g} s")
        mean, begin = window_means(values, starts, length, self.window)
        owner = self.bucket[np.searchsorted(self.grid.edges, begin, side="right") - 1]
        peak = np.zeros(len(self.rate))
        np.maximum.at(peak, owner[owner >= 0], mean[owner >= 0])
        return peak

    def cost(self, power: ArrayLike, step: float | None = None, first_step: int = 0) -> float:
        """Charge for the peaks, each as if it were that of its whole month [currency].

        Parameters
        ----------
        power : array_like, shape (n,)
            Means over steps of a run [W].
        step : float
            Length of those steps [s]; default the grid's.
        first_step : int
            Step of the grid in which the run began.
        """
        return float(self.peaks(power, step, first_step) @ self.rate / 1000.0)


@dataclass(frozen=True, eq=False)
class DemandCharge:
    """A charge for the highest mean power in each month, in each period of the day that has one.

    Parameters
    ----------
    rates : sequence of float
        Charge of each period [currency/kW].
    weekday : array_like of int, shape (12, 24)
        Period of each month and local hour [-], numbers into `rates`; -1 is free. Default: period 0 always, a flat
        charge.
    weekend : array_like of int, shape (12, 24)
        The same for Saturdays, Sundays and holidays [-]; default as on weekdays.
    window : float
        Length of the mean [s]; default a quarter of an hour, as BOPTEST's peaks and most tariffs have it.
    name : str
        For reports.
    calendar : Calendar
        Which days are holidays; default none.

    Raises
    ------
    ScenarioError
        When a table has another shape or names a period that has no rate.

    Examples
    --------
    >>> import pandas as pd
    >>> flat = DemandCharge([12.5])
    >>> hours = StepGrid(pd.Timestamp("2023-07-31 22:00", tz="America/Chicago"), 3600.0, 4)
    >>> flat.on(hours).names, flat.on(hours).cost([5000.0, 3000.0, 1000.0, 2000.0])
    (('2023-07 flat', '2023-08 flat'), 87.5)
    """

    rates: Sequence[float]
    weekday: ArrayLike | None = None
    weekend: ArrayLike | None = None
    window: float = 900.0
    name: str = "flat"
    calendar: Calendar = field(default_factory=Calendar)

    def __post_init__(self) -> None:
        rates = np.asarray(self.rates, dtype=float)
        possible = rates.ndim == 1 and len(rates) and (np.isfinite(rates) & (rates >= 0)).all()
        ScenarioError.unless(possible, "demand charge: rates", "numbers of 0 or more", self.rates)
        ScenarioError.unless(self.window > 0, "demand charge: window", "seconds above 0", repr(self.window))
        weekday = np.zeros((12, 24)) if self.weekday is None else np.asarray(self.weekday)
        weekend = weekday if self.weekend is None else np.asarray(self.weekend)
        for key, table in (("weekday", weekday), ("weekend", weekend)):
            fit = table.shape == (12, 24) and np.isin(table, np.arange(-1, len(rates))).all()
            expected = f"12 rows of 24 periods from -1 to {len(rates) - 1}"
            ScenarioError.unless(fit, f"demand charge: {key}", expected, f"shape {table.shape}")
            object.__setattr__(self, key, table.astype(float))

    def on(self, grid: StepGrid) -> DemandBuckets:
        """Tell which peak each step of a grid belongs to; a step belongs where it begins.

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        """
        tables = np.stack([np.asarray(self.weekday), *[np.asarray(self.weekend)] * 2])
        first = grid.middles[:: grid.per_step]
        number = by_clock(tables, self.calendar, grid)[:: grid.per_step].astype(np.int64)
        keys = (np.asarray(first.year) * 12 + np.asarray(first.month) - 1) * len(self.rates) + number
        keys[number < 0] = -1
        known = np.unique(keys[keys >= 0])
        bucket = np.where(keys < 0, -1, np.searchsorted(known, keys))
        months, periods = np.divmod(known, len(self.rates))
        label = [self.name if len(self.rates) == 1 else f"{self.name} {p}" for p in periods]
        names = tuple(f"{m // 12}-{m % 12 + 1:02d} {text}" for m, text in zip(months, label, strict=True))
        rates = np.asarray(self.rates, dtype=float)
        return DemandBuckets(grid, bucket.astype(np.int64), rates[periods], names, float(self.window))


@dataclass(frozen=True, eq=False)
class Tariff:
    """What energy costs.

    Fixed and minimum charges are left out: no controller changes them.

    Parameters
    ----------
    electricity, gas : Rate
        Price of a kilowatt-hour [currency/kWh]; gas by its upper heating value.
    demand : sequence of DemandCharge
        For electricity; default none.
    currency : str
        For reports.
    name : str
        For reports.
    district_heating : Rate, optional
        Price of a kilowatt-hour of district heating [currency/kWh]; needed where a plant has it.
    """

    electricity: Rate
    gas: Rate
    demand: Sequence[DemandCharge] = ()
    currency: str = "USD"
    name: str = ""
    district_heating: Rate | None = None

    def to_dict(self) -> dict[str, Any]:
        """Give what a report says of the tariff, as plain types."""
        charges = [{"name": d.name, "rates": [float(r) for r in d.rates], "window": d.window} for d in self.demand]
        return {"name": self.name, "currency": self.currency, "demand_charges": charges}


#: Carbon dioxide of natural gas by its upper heating value [kg/kWh]: 53.06 kg/mmBtu (40 CFR 98, table C-1).
GAS_CARBON = 53.06 / 293.0711


@dataclass(frozen=True, eq=False)
class CarbonIntensity:
    """Emissions of a kilowatt-hour.

    Average intensity (all emissions of the grid over all generation) is what inventories count; marginal intensity
    (of the plants that follow a change of demand) is what a shift of load changes. They may differ in sign of their
    slope over a day, so that there is no default.

    Parameters
    ----------
    electricity : Rate
        Constant, by the local hour or a published series [kg/kWh].
    kind : str
        ``average`` or ``marginal``: which of the two `electricity` is.
    gas : Rate
        By the upper heating value [kg/kWh]; default `GAS_CARBON`, burnt on site.
    district_heating : Rate, optional
        [kg/kWh]; needed where a plant has it.

    Raises
    ------
    ScenarioError
        When the kind is none of the two.
    """

    electricity: Rate
    kind: Literal["average", "marginal"]
    gas: Rate = field(default_factory=lambda: ConstantRate(GAS_CARBON))
    district_heating: Rate | None = None

    def __post_init__(self) -> None:
        ScenarioError.unless_known(self.kind, ("average", "marginal"), "carbon: kind", "'average' or 'marginal'")


# google/sbsim, smart_control/reward: PG&E's time of use for commerce [USD/kWh], EIA's gas price for California in 2020
# [USD/kcf], carbon of the grid at the pilot [kg/MWh]; its 1000 cubic feet are 293.07107 kWh and emit 53.12 kg.
_WEEKDAY = (0.16,) * 6 + (0.18,) * 6 + (0.20,) * 7 + (0.16,) * 5
_WEEKEND = (0.16,) * 24
_GAS_BY_MONTH = (9.02, 8.35, 7.77, 7.26, 6.69, 6.86, 6.77, 6.76, 6.99, 7.19, 7.96, 8.98)
_GAS_ENERGY, _GAS_CARBON = 293.07107, 53.12  # kWh, kg
_CARBON_BY_HOUR = (
    *(88.19666493, 87.79190866, 87.87607686, 87.83054163, 88.00279618, 88.19648183, 89.70663283, 93.97947901),
    *(98.85868291, 100.7853521, 101.3866866, 101.7795612, 102.5919168, 103.4403736, 104.1380294, 104.7359292),
    *(102.0714466, 97.04226176, 93.57895651, 92.46355045, 91.72914657, 90.69209747, 89.76552213, 88.99950995),
)


def paper_tariff(calendar: Calendar | None = None) -> Tariff:
    """Prices of the paper's simulator: PG&E's time of use, gas by the month.

    The simulator reads them with the hour in UTC; here the local clock counts, as on the bill.

    Parameters
    ----------
    calendar : Calendar
        Holidays; default none.
    """
    days = calendar or Calendar()
    gas = monthly_rate([price / _GAS_ENERGY for price in _GAS_BY_MONTH])
    return Tariff(HourlyRate(_WEEKDAY, _WEEKEND, days), gas, name="PG&E as in google/sbsim")


def paper_carbon() -> CarbonIntensity:
    """Carbon intensities of the paper's simulator: average by the local hour of the day, and that of gas."""
    rate = HourlyRate([value / 1000.0 for value in _CARBON_BY_HOUR])
    return CarbonIntensity(rate, "average", ConstantRate(_GAS_CARBON / _GAS_ENERGY))
