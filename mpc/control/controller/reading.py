"""Names of a building's points, and what a controller reads off measurements and past telemetry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from mpc.control.problem.channels import Channel
from mpc.errors import ControlError
from mpc.loop.actuators import STATIC_PRESSURE, SUPPLY_AIR
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray
from thermal.case.points import OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE
from thermal.system.smooth import SmoothHvac
from thermal.system.system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY


@dataclass(frozen=True)
class SitePoints:
    """Names of a building's zones and devices, in the order of model and plant.

    Parameters
    ----------
    zones : tuple of str
        Zones.
    terminals : tuple of str
        Terminals, in the order of the plant.
    air_handlers : tuple of str
        Air handlers.
    boiler : str
        Boiler.
    weather_station : str
        Weather station.
    meters : tuple of str
        Columns of electric power that demand charges count.
    """

    zones: tuple[str, ...]
    terminals: tuple[str, ...]
    air_handlers: tuple[str, ...]
    boiler: str
    weather_station: str
    meters: tuple[str, ...] = ()

    def setpoints(self, channels: Sequence[Channel], values: FloatArray, hvac: SmoothHvac) -> dict[str, float]:
        """Spread the values of channels to the devices they belong to.

        Parameters
        ----------
        channels : sequence of Channel
            What is decided.
        values : ndarray, shape (n_channel,)
            Setpoints [unit of the channel].
        hvac : SmoothHvac
            The plant.
        """
        named: dict[str, float] = {}
        for channel, value in zip(channels, values, strict=True):
            of_air = channel.quantity in (SUPPLY_AIR, STATIC_PRESSURE)
            chosen = range(hvac.n_air_handler) if channel.air_handlers is None else channel.air_handlers
            entities = [self.air_handlers[k] for k in chosen] if of_air else [self.boiler]
            if channel.of_zones:
                zones = set(range(hvac.n_zone) if channel.zones is None else channel.zones)
                place = hvac.system.terminals.zone
                entities = [name for name, zone in zip(self.terminals, place, strict=True) if int(zone) in zones]
            named |= {f"{entity}/{channel.quantity}": float(value) for entity in entities}
        return named

    def fit(self, system: HvacSystem) -> None:
        """Refuse a plant that has another number of zones, terminals or air handlers.

        Parameters
        ----------
        system : HvacSystem
            The plant.

        Raises
        ------
        ControlError
            When there are not as many names.
        """
        found = (len(self.zones), len(self.terminals), len(self.air_handlers))
        wanted = (system.zone_count, len(system.terminals), len(system.air_handlers))
        expected = "names of {} zones, {} terminals, {} air handlers".format(*wanted)
        ControlError.unless(found == wanted, "site points", expected, "{}, {}, {}".format(*found))

    def read(self, measurements: Mapping[str, float], system: HvacSystem) -> Reading:
        """Read a control step.

        Parameters
        ----------
        measurements : mapping of str to float
            By ``ENTITY/POINT`` [library's units].
        system : HvacSystem
            Which terminal belongs to which zone.
        """
        place, n_zone = system.terminals.zone, len(self.zones)
        seen, flow, warm = (
            values_of(measurements, self.terminals, point)
            for point in (ZONE_TEMPERATURE, "supply_air_flowrate_sensor", "discharge_air_temperature_sensor")
        )
        known = np.isfinite(seen)
        count, total = (np.bincount(place[known], weights, n_zone) for weights in (None, seen[known]))
        zone = np.where(count > 0, total / np.maximum(count, 1), np.nan)
        own = values_of(measurements, self.zones, ZONE_TEMPERATURE)
        zone = np.where(np.isfinite(own), own, zone)
        each = AIR_HEAT_CAPACITY * flow * (warm - zone[place])
        heat = np.asarray(np.bincount(place, each, n_zone), dtype=float)
        outdoor = float(values_of(measurements, [self.weather_station], OUTDOOR_TEMPERATURE)[0])
        water = float(values_of(measurements, [self.boiler], "supply_water_temperature_sensor")[0])
        power = float(values_of(measurements, self.meters).sum())
        missing = [f"zone temperature of {z!r} is missing: its model goes on alone"
                   for z, t in zip(self.zones, zone, strict=True) if not np.isfinite(t)]  # fmt: skip
        # where the zone itself did not report, its heat is unknown too and has been said
        lost = np.flatnonzero(~np.isfinite(each) & np.isfinite(zone[place]))
        names = [self.terminals[k] for k in lost]
        missing += [f"flow or discharge temperature of {name!r} is missing: the plan's heat is taken" for name in names]
        if not np.isfinite(water):
            missing.append(f"supply water temperature of {self.boiler!r} is missing: its last value is taken")
        return Reading(zone, heat, outdoor, water, power, tuple(missing))



#: Of a control step that has gone: its end, means by ``ENTITY/POINT``, outdoor temperature [K], and expected heat of
#: people, lights and equipment in each zone, shape (n_zone,) [W].
PastStep = tuple[pd.Timestamp, dict[str, float], float, FloatArray]


class Reading(NamedTuple):
    """What was measured over a control step.

    Parameters
    ----------
    zone : ndarray, shape (n_zone,)
        Temperatures [K]; NaN where missing.
    heat : ndarray, shape (n_zone,)
        Metered heat of the terminals [W]; NaN where it cannot be known.
    outdoor, water : float
        Outdoor and supply-water temperature [K]; NaN where missing.
    electricity : float
        Of the meters [W]; NaN where one is missing.
    missing : tuple of str
        What is, in words.
    """

    zone: FloatArray
    heat: FloatArray
    outdoor: float
    water: float
    electricity: float
    missing: tuple[str, ...]


def values_of(measurements: Mapping[str, float], entities: Sequence[str], point: str = "") -> FloatArray:
    """Look a point of several entities up, shape (n_entity,) [library's units]; NaN where it is missing or no number.

    Parameters
    ----------
    measurements : mapping of str to float
        By ``ENTITY/POINT`` [library's units].
    entities : sequence of str
        Zones or devices; whole columns where there is no point.
    point : str
        What is measured.
    """
    columns = [f"{entity}/{point}" if point else entity for entity in entities]
    found = pd.Series([measurements[c] if c in measurements else np.nan for c in columns], dtype=object)
    return pd.to_numeric(found, errors="coerce").to_numpy(dtype=float)


def past_steps(telemetry: pd.DataFrame, points: SitePoints, control_step: float) -> list[PastStep]:
    """Cut telemetry into control steps, the last of which ends with it.

    Parameters
    ----------
    telemetry : DataFrame, shape (n_time, n_column)
        Means over the steps that end at its stamps.
    points : SitePoints
        Names of zones and weather station.
    control_step : float
        [s].

    Raises
    ------
    ControlError
        When stamps have no time zone or do not rise, there is less than a control step, or no outdoor temperature.
    """
    index = telemetry.index
    if not isinstance(index, pd.DatetimeIndex) or index.tz is None or not index.is_monotonic_increasing:
        raise ControlError("start-up: telemetry", "stamps with a time zone that rise", f"{index.dtype}")
    length = pd.Timedelta(seconds=control_step)
    step = index[1] - index[0] if len(index) > 1 else length
    if not len(index) or step > length or index[-1] - index[0] + step < length:
        raise ControlError("start-up: telemetry", f"a control step, {length}, or more", f"{len(index)} rows")
    means = telemetry.resample(length, closed="right", label="right", origin=index[-1]).mean()
    column = f"{points.weather_station}/{OUTDOOR_TEMPERATURE}"
    outdoor = means.reindex(columns=[column]).ffill().bfill().to_numpy()[:, 0]
    if np.isnan(outdoor).any():
        raise ControlError("start-up: telemetry", "an outdoor temperature", "none", str(points.weather_station))
    gains = means.reindex(columns=[f"{zone}/internal_gain" for zone in points.zones]).fillna(0.0).to_numpy()
    rows = zip(means.index, means.to_dict("records"), outdoor, gains, strict=True)
    return [(stamp, {str(k): v for k, v in row.items()}, float(air), heat) for stamp, row, air, heat in rows]


def past_forecast(telemetry: pd.DataFrame, points: SitePoints) -> Forecast:
    """Take what signals of effects are made of from telemetry: the weather, and who was in which zone.

    Parameters
    ----------
    telemetry : DataFrame
        By ``ENTITY/POINT`` [library's units].
    points : SitePoints
        Names of the weather station and the zones.
    """
    station = f"{points.weather_station}/"
    weather = {column: column.removeprefix(station) for column in map(str, telemetry) if column.startswith(station)}
    people = [f"{zone}/occupancy_count_sensor" for zone in points.zones]
    return Forecast(telemetry[[*weather, *(c for c in people if c in telemetry)]].rename(columns=weather))
