"""From a forecast, a tariff and a building's schedules to the data of a horizon."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd

from mpc.control.problem.horizon import Horizon, PeakData
from mpc.errors import ScenarioError
from mpc.scenario.forecast import Forecast
from mpc.scenario.grid import StepGrid, means_of_steps
from mpc.scenario.tariff import DemandCharge
from thermal._types import FloatArray, IntArray
from thermal.case.points import OUTDOOR_TEMPERATURE

_HOUR = 3600.0  # s
_NARROWEST = (np.maximum, np.minimum)  # of lower and of upper edges


class Expected(NamedTuple):
    """A forecast on the steps of a horizon.

    Parameters
    ----------
    outdoor_temperature : ndarray, shape (N,)
        [K].
    gains : ndarray, shape (N, n_zone)
        [W].
    lower, upper : ndarray, shape (N, n_zone)
        Bands at the ends of the steps: the narrower of the step and the next [K].
    band : tuple of ndarray, shape (N, n_zone)
        Lower and upper edge of the steps themselves, the narrowest within each [K].
    electricity_price, gas_price : ndarray, shape (N,)
        Emissions included, at their price [currency/kWh].
    """

    outdoor_temperature: FloatArray
    gains: FloatArray
    lower: FloatArray
    upper: FloatArray
    band: tuple[FloatArray, FloatArray]
    electricity_price: FloatArray
    gas_price: FloatArray


def expect(
    forecast: Forecast,
    horizon: Horizon,
    now: pd.Timestamp,
    zones: Sequence[str],
    carbon_price: float = 0.0,
    fill: Literal["hold"] | None = None,
) -> Expected:
    """Put a forecast on the steps of a horizon: means of what flows, the narrowest of the bands.

    Parameters
    ----------
    forecast : Forecast
        On regular steps.
    horizon : Horizon
        Steps.
    now : pandas.Timestamp
        Start of the horizon.
    zones : sequence of str
        Names of the zones.
    carbon_price : float
        Of emissions [currency/kg].
    fill : str
        ``hold`` carries the last known values on where the forecast has gaps or ends early.

    Raises
    ------
    ScenarioError
        Which column is missing, for how many steps and when first, or where the forecast ends.
    """
    carbon = ["electricity_carbon_intensity", "gas_carbon_intensity"] if carbon_price else []
    flowing = [OUTDOOR_TEMPERATURE, "electricity_price", "gas_price", *carbon, *(f"{z}/internal_gain" for z in zones)]
    sides = [[f"{zone}/comfort_{side}_temperature" for zone in zones] for side in ("lower", "upper")]
    index = pd.DatetimeIndex(forecast.table.index)
    ends = (index - now).total_seconds().to_numpy()
    step = float(np.median(np.diff(ends))) if len(ends) > 1 else float(horizon.control_step)
    edges = np.concatenate([[ends[0] - step], ends])
    first, last = now + pd.Timedelta(seconds=edges[0]), now + pd.Timedelta(seconds=horizon.edges[-1])
    covered = fill is not None or (edges[-1] >= horizon.edges[-1] - 1e-6 and edges[0] <= 1e-6)
    advice = 'pass fill="hold"'
    ScenarioError.unless(covered, "forecast", f"steps from {now} to {last}", f"{first} to {index[-1]}", advice)
    values = forecast.values([*flowing, *sides[0], *sides[1]], fill=fill)
    edges[0], edges[-1] = min(edges[0], 0.0), max(edges[-1], horizon.edges[-1])
    flows, *bands = np.split(values, [len(flowing), len(flowing) + len(zones)], axis=1)
    mean = means_of_steps(edges, flows, horizon.edges)
    lower, upper = (_extremes(edges, b, horizon.edges, of) for b, of in zip(bands, _NARROWEST, strict=True))
    emitted = mean[:, 3:5] * carbon_price if carbon else np.zeros((len(horizon), 2))
    return Expected(
        mean[:, 0], mean[:, 3 + len(carbon) :], np.maximum(lower, np.vstack([lower[1:], lower[-1:]])),
        np.minimum(upper, np.vstack([upper[1:], upper[-1:]])), (lower, upper), *(mean[:, 1:3] + emitted).T,
    )  # fmt: skip


def _extremes(edges: FloatArray, values: FloatArray, steps: FloatArray, of: np.ufunc) -> FloatArray:
    """Largest or smallest value that each step touches."""
    first = np.clip(np.searchsorted(edges, steps[:-1] + 1e-6, side="right") - 1, 0, len(values) - 1)
    last = np.clip(np.searchsorted(edges, steps[1:] - 1e-6, side="left"), first + 1, len(values))
    return np.stack([of.reduce(values[a:b], axis=0) for a, b in zip(first, last, strict=True)])


@dataclass(frozen=True)
class ComfortOperation:
    """Schedules of a building's automation as they follow from its comfort bands.

    Parameters
    ----------
    margin : float
        Setpoints of the thermostats lie this far inside of the band [K].
    lead_hours : float
        By how much setpoints and plant come before the occupied hours [h].
    widest_occupied : float
        Bands up to this width are those of occupied hours [K].
    always : bool
        Whether plant and fans run around the clock.
    """

    margin: float = 0.5
    lead_hours: float = 1.5
    widest_occupied: float = 8.0
    always: bool = False

    def schedule(self, band: tuple[FloatArray, FloatArray], edges: FloatArray) -> Schedule:
        """Schedule a horizon.

        Parameters
        ----------
        band : tuple of ndarray, shape (N, n_zone)
            Lower and upper edge of the band over each step [K].
        edges : ndarray, shape (N + 1,)
            Edges of the steps [s].
        """
        lower, upper = band[0].copy(), band[1].copy()
        occupied = upper - lower <= self.widest_occupied
        soon = occupied.copy()
        for k in range(len(lower) - 2, -1, -1):
            stop = int(np.searchsorted(edges[:-1], edges[k] + self.lead_hours * _HOUR + 1e-6))
            ahead = occupied[k:stop]
            lead = ~occupied[k] & ahead.any(axis=0)
            first = k + ahead.argmax(axis=0)
            zone = np.flatnonzero(lead)
            lower[k, zone], upper[k, zone] = band[0][first[zone], zone], band[1][first[zone], zone]
            soon[k] |= lead
        inside = np.minimum(self.margin, 0.5 * (upper - lower))
        running = np.ones(len(lower)) if self.always else soon.any(axis=1).astype(float)
        return Schedule(lower + inside, upper - inside, running, occupied.any(axis=1).astype(float))


class Schedule(NamedTuple):
    """Schedules of a building's automation over a horizon.

    Parameters
    ----------
    heating, cooling : ndarray, shape (N, n_zone)
        Setpoints of the thermostats [K].
    running, ventilation : ndarray, shape (N,)
        Of all air handlers, 0 to 1 [-].
    """

    heating: FloatArray
    cooling: FloatArray
    running: FloatArray
    ventilation: FloatArray


class DemandCount:
    """Counts the power of each step for the windows of demand charges.

    Parameters
    ----------
    charges : sequence of DemandCharge
        Of the tariff.
    """

    def __init__(self, charges: Sequence[DemandCharge]) -> None:
        self.charges = tuple(charges)
        #: Highest mean of each peak so far, by name [W].
        self.peaks: dict[str, float] = {}
        #: Of each charge: start of the window that runs [s since 1970], and energy used in it [J].
        self.windows = [(0.0, 0.0)] * len(self.charges)

    def add(self, electricity: float, now: pd.Timestamp, step: float) -> None:
        """Add the power of the step that has ended to the window that it began in; a window that is over is a peak.

        Parameters
        ----------
        electricity : float
            Mean over the step [W]; NaN counts as nothing.
        now : pandas.Timestamp
            End of the step.
        step : float
            Its length [s].
        """
        for k, charge in enumerate(self.charges):
            begin = float(np.floor((now.timestamp() - step) / charge.window) * charge.window)
            start, used = self.windows[k] if self.windows[k][0] == begin else (begin, 0.0)
            used += electricity * step if np.isfinite(electricity) else 0.0
            if now.timestamp() >= begin + charge.window:
                one = pd.Timestamp(begin, unit="s", tz="UTC").tz_convert(now.tz)
                for name in charge.on(StepGrid(one, charge.window, 1)).names:
                    self.peaks[name] = max(self.peaks.get(name, 0.0), used / max(charge.window, step))
                start, used = begin + charge.window, 0.0
            self.windows[k] = (start, used)

    def ahead(self, horizon: Horizon, now: pd.Timestamp) -> PeakData:
        """Windows of the charges over a horizon, with what was used of those that run.

        Parameters
        ----------
        horizon : Horizon
            Steps.
        now : pandas.Timestamp
            Start of the horizon, in the building's time zone.
        """
        parts: list[tuple[FloatArray | IntArray, ...]] = []
        seconds, count, begin = horizon.edges, 0, now.timestamp()
        for charge, (start, energy) in zip(self.charges, self.windows, strict=True):
            first = np.floor(begin / charge.window) * charge.window - begin
            bounds = np.arange(first, seconds[-1], charge.window)[:, None]
            overlap = np.minimum(seconds[1:], bounds + charge.window) - np.maximum(seconds[:-1], bounds)
            weights, offset = np.maximum(overlap, 0.0), np.zeros(len(bounds))
            # windows that the horizon's end cuts count with the mean of their part
            whole = np.maximum(weights.sum(axis=1), 1e-9)
            whole[0] = charge.window
            if 0.0 < begin - start < charge.window:
                offset[0] = energy / (begin - start) * -first / charge.window
            buckets = charge.on(StepGrid(now + pd.Timedelta(seconds=float(first)), charge.window, len(bounds)))
            kept = buckets.bucket >= 0
            highest = np.array([self.peaks.get(name, 0.0) for name in buckets.names])
            shares = weights[kept] / whole[kept, None]
            parts.append((shares, offset[kept], buckets.bucket[kept] + count, buckets.rate, highest))
            count += len(buckets.rate)
        return PeakData(*map(np.concatenate, zip(*parts, strict=True))) if parts else PeakData.none(len(horizon))
