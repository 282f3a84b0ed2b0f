"""Time series that drive effects, made from a case's telemetry; values stand for the step that ends at their stamp."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd

from thermal._types import FloatArray
from thermal.case.case import Case
from thermal.case.points import DISCHARGE_TEMPERATURE, SUPPLY_FLOW
from thermal.errors import EffectError
from thermal.inputs.sun import Sun, suffices, sun_of
from thermal.units import AIR_HEAT_CAPACITY

#: Temperature from which states, boundaries and signals that stand for a temperature are counted in a replay [K].
REFERENCE_TEMPERATURE = 293.15

#: Stefan-Boltzmann constant [W/m2/K4].
STEFAN_BOLTZMANN = 5.670374419e-8

#: Wind where none is measured [m/s].
_USUAL_WIND = 3.0

#: Hours of a working day unless occupancy is measured, and how long people take to come and go [h].
_WORK, _RAMP = (8.0, 18.0), 1.0

#: Points of the weather station that effects need.
IRRADIANCE, INFRARED, WIND = (
    "direct_normal_irradiance_sensor",
    "horizontal_infrared_irradiance_sensor",
    "wind_speed_sensor",
)
_OCCUPANCY = "occupancy_count_sensor"


class Drivers:
    """What a case's telemetry says of sun, sky, wind, people and heat.

    Parameters
    ----------
    case : Case
        With telemetry.
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        self.zones = case.building.zone_names

    @property
    def stamps(self) -> pd.DatetimeIndex:
        """Ends of the steps, in the building's time zone."""
        return self.case.stamps

    @cached_property
    def weather(self) -> pd.DataFrame:
        """Points of the weather station, gaps filled by straight lines: shape (n_time, n_point), library's units."""
        return self.case.weather().interpolate(limit_direction="both")

    def measured(self, point: str) -> bool:
        """Whether the weather station has a point, or those that it follows from.

        Parameters
        ----------
        point : str
            Point type. Beam and diffuse irradiance follow from the global one, and from each other with it.
        """
        if point == IRRADIANCE:
            return suffices(self.weather)
        return point in self.weather.columns and bool(self.weather[point].notna().any())

    def _need(self, point: str) -> None:
        if not self.measured(point):
            raise EffectError(f"weather station: expected {point}, which an effect of the model needs, came none")

    @cached_property
    def outdoor(self) -> FloatArray:
        """Outdoor temperature, shape (n_time,) [K]."""
        return self._filled(self.case.boundary_temperatures()["outdoor"])

    @cached_property
    def wind(self) -> FloatArray:
        """Wind speed at the station, shape (n_time,) [m/s]."""
        self._need(WIND)
        return np.maximum(self._filled(self.weather[WIND]), 0.0)

    @cached_property
    def sky(self) -> FloatArray:
        """Longwave from the sky less that of a black body at outdoor temperature, shape (n_time,) [W/m2]; negative."""
        self._need(INFRARED)
        infrared = self._filled(self.weather[INFRARED])
        return np.asarray(infrared - STEFAN_BOLTZMANN * self.outdoor**4)

    @cached_property
    def sun(self) -> Sun:
        """Sun's place and irradiances."""
        self._need(IRRADIANCE)
        return sun_of(self.case.building.location, self.stamps, self.case.step, self.weather)

    @cached_property
    def heat(self) -> FloatArray:
        """Metered heat of the zones, shape (n_time, n_zone) [W]."""
        return self._filled(self.case.zone_heat())

    @cached_property
    def airflow(self) -> FloatArray:
        """Directed airflows from zone to zone, shape (n_time, n_airflow) [kg/s]."""
        return self._filled(self.case.airflow_rates())

    @cached_property
    def usual(self) -> FloatArray:
        """Zone temperatures as they usually are at that hour of a working day or a day off, (n_time, n_zone) [K].

        A mean over the telemetry, for products with a signal that varies: the measured temperature of the same stamp
        would tell a prediction its own future.
        """
        zone = self.case.zone_temperatures()
        local = self.stamps
        slot = [(local.day_of_week < 5), np.asarray(local.hour)]
        profile = zone.groupby(slot).transform("mean")
        filled = profile.fillna(zone.mean()).fillna(float(np.nanmean(zone.to_numpy(dtype=float))))
        return filled.to_numpy(dtype=float)

    @cached_property
    def occupancy(self) -> FloatArray:
        """Presence of people between 0 and 1, shape (n_time,): as counted, or working days from 8 to 18."""
        frame = self.case.usable
        counted = [c for c in frame.columns if c.endswith(f"/{_OCCUPANCY}") and frame[c].notna().any()]
        if counted:
            total = self._filled(frame[counted].sum(axis=1, min_count=1))
            return np.asarray(total / max(float(total.max()), 1e-9))
        middle = self.stamps - pd.Timedelta(seconds=self.case.step / 2.0)
        hour = np.asarray(middle.hour + middle.minute / 60.0 + middle.second / 3600.0, dtype=float)
        rise = np.clip((hour - _WORK[0]) / _RAMP + 0.5, 0.0, 1.0)
        fall = np.clip((_WORK[1] - hour) / _RAMP + 0.5, 0.0, 1.0)
        return np.where(middle.day_of_week < 5, rise * fall, 0.0)

    @cached_property
    def openings(self) -> FloatArray:
        """Whether a window of each zone is seen to stand open, shape (n_time, n_zone): 1 where one is.

        Telemetry has no window contacts: windows are shut unless a diagnosis sees what they let out, and sets this.
        """
        return np.zeros((len(self.stamps), len(self.zones)))

    @cached_property
    def through_windows(self) -> FloatArray:
        """Air that passes an open window, times how much colder it is outdoor: shape (n_time, n_zone) [K*m/s].

        Flow per area of a window of 1 m height on one side of a room, ``½ (0.001 v² + 0.0035 h |ΔT| + 0.01)^½``
        (de Gids and Phaff 1982, Air Infiltration Review 4(1), 1-5).
        """
        difference = self.outdoor[:, None] - self.usual
        wind = self.wind if self.measured(WIND) else np.full(len(self.stamps), _USUAL_WIND)
        speed = 0.5 * np.sqrt(0.001 * wind[:, None] ** 2 + 0.0035 * np.abs(difference) + 0.01)
        return np.asarray(speed * difference)

    @cached_property
    def supply(self) -> tuple[FloatArray, FloatArray]:
        """Supply air of each zone: flow [kg/s] and heat above the zone's own temperature [W], (n_time, n_zone) each."""
        frame, zones = self.case.usable, self.case.zone_temperatures()
        flow = np.zeros((len(frame), len(self.zones)))
        heat = np.zeros_like(flow)
        for device in self.case.building.devices:
            rate = frame.get(f"{device.name}/{SUPPLY_FLOW}")
            if device.zone is None or rate is None:
                continue
            k = self.zones.index(device.zone)
            flow[:, k] += self._filled(rate)
            warm = frame.get(f"{device.name}/{DISCHARGE_TEMPERATURE}")
            if warm is not None:
                brought = rate * AIR_HEAT_CAPACITY * (warm - zones[device.zone])
                heat[:, k] += self._filled(brought.where(rate != 0.0, 0.0))
        return flow, heat

    def _filled(self, values: pd.Series | pd.DataFrame) -> FloatArray:
        """Values with gaps filled by straight lines, 0 where there are none at all."""
        return values.interpolate(limit_direction="both").fillna(0.0).to_numpy(dtype=float)


@dataclass(frozen=True)
class Signal:
    """A time series that drives sources of a network.

    Parameters
    ----------
    name : str
        Unique within a network.
    unit : str
        Its unit.
    of : callable
        Makes it from the drivers of a case, shape (n_time,) [unit].
    """

    name: str
    unit: str
    of: Callable[[Drivers], FloatArray]


def signal_values(signals: Sequence[Signal], drivers: Drivers) -> FloatArray:
    """Make signals from a case.

    Parameters
    ----------
    signals : sequence of Signal
        Such as `ThermalNetwork.signals`.
    drivers : Drivers
        Of the case.

    Returns
    -------
    ndarray, shape (n_time, n_signal)
        One column a signal [signal unit].

    Raises
    ------
    EffectError
        When the weather station lacks what a signal is made of.
    """
    return np.column_stack([np.empty((len(drivers.stamps), 0)), *(s.of(drivers) for s in signals)])
