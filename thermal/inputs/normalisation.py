"""Constants that inputs are counted by: fitted on tuning intervals and kept, never made of the series they scale."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from pydantic import TypeAdapter

from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.case.points import DISCHARGE_TEMPERATURE, SUPPLY_FLOW
from thermal.units import AIR_HEAT_CAPACITY, REFERENCE_TEMPERATURE

#: Share of the time in which flow and heat of a zone are below what counts as their largest [-].
_LARGEST = 0.99

#: Point types of the inputs that are normalised.
WIND, OCCUPANCY = "wind_speed_sensor", "occupancy_count_sensor"


@dataclass(frozen=True)
class Normalisation:
    """Constants of a building's inputs, as they were in tuning intervals.

    Parameters
    ----------
    usual : mapping of str to tuple of float
        Temperature of each zone by hour, 24 values of a day off and 24 of a working day [K].
    people : float, optional
        Largest number of people in the building [-]; None where nobody counts them.
    wind : float, optional
        Mean wind speed [m/s]; None where it is not measured.
    flow, heat : mapping of str to float
        Supply air flow [kg/s] and metered heat, heating or cooling [W], of each zone that it exceeds 1 % of the time.
    peak_flow : mapping of str to float
        Largest supply air flow of each zone [kg/s].

    Examples
    --------
    >>> Normalisation.from_dict(Normalisation(people=12.0).to_dict()).people
    12.0
    """

    usual: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    people: float | None = None
    wind: float | None = None
    flow: Mapping[str, float] = field(default_factory=dict)
    heat: Mapping[str, float] = field(default_factory=dict)
    peak_flow: Mapping[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Entry of ``calibration.json``."""
        return asdict(self)

    @classmethod
    def from_dict(cls, entry: Mapping[str, Any]) -> Normalisation:
        """Read what `to_dict` wrote.

        Parameters
        ----------
        entry : mapping
            Of ``calibration.json``.

        Raises
        ------
        ValueError
            When it is not what `to_dict` writes.
        """
        return TypeAdapter(cls).validate_python(entry)

    def __repr__(self) -> str:
        return f"Normalisation({len(self.usual)} zones, people={self.people}, wind={self.wind})"


def fit_normalisation(case: Case, intervals: Iterable[tuple[pd.Timestamp, pd.Timestamp]] = ()) -> Normalisation:
    """Fit the constants of a case's inputs.

    Parameters
    ----------
    case : Case
        With telemetry.
    intervals : iterable of tuple of Timestamp
        First and last stamp of each interval to fit on, such as the tuning ones; all the telemetry by default.
    """
    stamps, parts = case.stamps, list(intervals)
    rows = np.logical_or.reduce([(stamps >= a) & (stamps <= b) for a, b in parts]) if parts else slice(None)
    weather, people = case.weather()[rows], counted_people(case)
    flow, _ = supply_air(case)
    heat = case.zone_heat()[rows]
    return Normalisation(
        usual=usual_temperatures(case.zone_temperatures()[rows]),
        people=None if people is None else float(np.nan_to_num(people[rows].max())),
        wind=float(filled(weather[WIND]).clip(0.0).mean()) if WIND in weather else None,
        flow=_quantiles(flow[rows], _LARGEST),
        heat=_quantiles(heat.abs(), _LARGEST),
        peak_flow=_quantiles(flow[rows], 1.0),
    )


def usual_temperatures(zone: pd.DataFrame) -> dict[str, tuple[float, ...]]:
    """Mean temperatures by hour on days off and on working days, 48 values a zone [K].

    For products with a signal that varies: the measured temperature of the same stamp would tell a prediction its own
    future. An hour that is not there is that of the other days, or the mean of all.

    Parameters
    ----------
    zone : DataFrame, shape (n_time, n_zone)
        Temperatures [K], NaN where missing; the index has the building's time zone.
    """
    index = pd.DatetimeIndex(zone.index)
    working, hour = index.day_of_week < 5, np.asarray(index.hour)
    slots = zone.groupby(24 * working + hour).mean().reindex(range(48))
    days = pd.concat([zone.groupby(hour).mean().reindex(range(24))] * 2).set_axis(range(48))
    whole = zone.melt()["value"].mean()
    profile = slots.fillna(days).fillna(zone.mean()).fillna(REFERENCE_TEMPERATURE if np.isnan(whole) else whole)
    return {str(name): tuple(profile[name].tolist()) for name in profile}


def counted_people(case: Case) -> pd.Series | None:
    """Add up the people in the building, NaN where it is missing [-]; None where nobody counts them.

    Parameters
    ----------
    case : Case
        With telemetry.
    """
    frame = case.usable
    counted = [c for c in frame.columns if c.endswith(f"/{OCCUPANCY}") and frame[c].notna().any()]
    return frame[counted].sum(axis=1, min_count=1) if counted else None


def supply_air(case: Case) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Supply air of each zone: flow [kg/s] and heat above the zone's own temperature [W], (n_time, n_zone) each.

    Parameters
    ----------
    case : Case
        With telemetry.
    """
    frame, zones = case.usable, case.zone_temperatures()
    flow, heat = (pd.DataFrame(0.0, index=frame.index, columns=zones.columns) for _ in range(2))
    for device in case.building.devices:
        rate = frame.get(f"{device.name}/{SUPPLY_FLOW}")
        if device.zone is None or rate is None:
            continue
        flow[device.zone] += filled(rate)
        warm = frame.get(f"{device.name}/{DISCHARGE_TEMPERATURE}")
        if warm is not None:
            brought = rate * AIR_HEAT_CAPACITY * (warm - zones[device.zone])
            heat[device.zone] += filled(brought.where(rate != 0.0, 0.0))
    return flow, heat


def filled(values: pd.Series | pd.DataFrame) -> FloatArray:
    """Values with gaps filled by straight lines, 0 where there are none at all [their unit].

    Parameters
    ----------
    values : Series or DataFrame
        In order of time.
    """
    return values.interpolate(limit_direction="both").fillna(0.0).to_numpy(dtype=float)


def _quantiles(values: pd.DataFrame, share: float) -> dict[str, float]:
    """Values of each column that a share of the time is below."""
    quantiles = np.quantile(filled(values), share, axis=0)
    return dict(zip(map(str, values.columns), quantiles.tolist(), strict=True))
