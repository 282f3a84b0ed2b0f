"""The three electricity prices of BOPTEST's scenarios, made of a building's tariff."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from mpc.scenario.grid import StepGrid
from mpc.scenario.rates import ConstantRate, Rate, SeriesRate

#: Names that a scenario's ``electricity_price`` takes, and the forecast point of each.
PRICE_POINTS: Mapping[str, str] = {
    "constant": "PriceElectricPowerConstant",
    "dynamic": "PriceElectricPowerDynamic",
    "highly_dynamic": "PriceElectricPowerHighlyDynamic",
}

# Shape of a day of a day-ahead market with much sun: a morning and a higher evening peak, a trough at noon. Assumed, of
# the form that such markets have; its mean is 1.
_MORNING = (0.82, 0.78, 0.76, 0.76, 0.80, 0.92, 1.12, 1.30, 1.28, 1.12, 0.94, 0.80)
_EVENING = (0.72, 0.68, 0.70, 0.80, 0.98, 1.26, 1.52, 1.56, 1.38, 1.16, 0.96, 0.88)
_SHAPE = np.array((*_MORNING, *_EVENING)) / np.mean((*_MORNING, *_EVENING))
_SPREAD = 0.35  # standard deviation of a day's logarithm, assumed
_STREAM = 21  # of random numbers, apart from those of plants


@dataclass(frozen=True, eq=False)
class MarketRate:
    """A price that changes every hour and from day to day, as on a day-ahead market; assumed, not measured.

    Each day has the same shape times a factor of its own, drawn from its date alone.

    Parameters
    ----------
    mean : float
        Its mean over many days [currency/kWh].
    """

    mean: float

    def on(self, grid: StepGrid) -> np.ndarray:
        """Average over each step of a grid, shape (n_steps,) [per kWh].

        Parameters
        ----------
        grid : StepGrid
            Steps in the building's time zone.
        """
        zone = grid.start.tz
        first = grid.start.tz_localize(None).normalize() - pd.Timedelta(days=1)
        last = grid.stamps[-1].tz_localize(None).normalize() + pd.Timedelta(days=2)
        start, end = first.tz_localize(zone), last.tz_localize(zone)
        hours = pd.date_range(start, end, freq="h", inclusive="left")
        factors = {day: self._factor(day) for day in {stamp.toordinal() for stamp in hours.date}}
        values = [self.mean * _SHAPE[s.hour] * factors[s.toordinal()] for s in hours]
        return SeriesRate(pd.Series(values, index=hours), "start").on(grid)

    def _factor(self, day: int) -> float:
        draw = np.random.default_rng([_STREAM, day]).standard_normal()
        return float(np.exp(_SPREAD * draw - 0.5 * _SPREAD**2))


def scenario_prices(electricity: Rate, year: StepGrid) -> dict[str, Rate]:
    """Make the prices of BOPTEST's scenarios.

    Parameters
    ----------
    electricity : Rate
        The building's, which is the dynamic one.
    year : StepGrid
        What the constant price is the mean over.

    Returns
    -------
    dict of str to Rate
        ``constant``: its mean; ``dynamic``: the tariff itself; ``highly_dynamic``: an assumed market of the same mean.
    """
    mean = float(electricity.on(year).mean())
    return {"constant": ConstantRate(mean), "dynamic": electricity, "highly_dynamic": MarketRate(mean)}
