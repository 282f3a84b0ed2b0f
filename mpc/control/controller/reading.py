"""Names of a building's points, and what a controller reads off its measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mpc.control.problem.channels import Channel
from mpc.errors import ControlError
from mpc.loop.actuators import STATIC_PRESSURE, SUPPLY_AIR
from thermal._types import FloatArray
from thermal.case.points import OUTDOOR_TEMPERATURE, ZONE_TEMPERATURE
from thermal.errors import describe
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


class _Reading(NamedTuple):
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


class Readings:
    """Reads measurements by name.

    Parameters
    ----------
    points : SitePoints
        Names.
    system : HvacSystem
        Which terminal serves which zone.

    Raises
    ------
    ControlError
        When there are not as many names as zones, terminals and air handlers.
    """

    def __init__(self, points: SitePoints, system: HvacSystem) -> None:
        found = (len(points.zones), len(points.terminals), len(points.air_handlers))
        wanted = (system.zone_count, len(system.terminals), len(system.air_handlers))
        if found != wanted:
            expected = "names of {} zones, {} terminals, {} air handlers".format(*wanted)
            raise ControlError(describe("site points", expected, "{}, {}, {}".format(*found)))
        self.points, self.place = points, system.terminals.zone

    def read(self, measurements: Mapping[str, float]) -> _Reading:
        """Read a control step.

        Parameters
        ----------
        measurements : mapping of str to float
            By ``ENTITY/POINT`` [library's units].
        """
        points, place, n_zone = self.points, self.place, len(self.points.zones)
        seen = np.array([_value(measurements, f"{name}/{ZONE_TEMPERATURE}") for name in points.terminals])
        known = np.isfinite(seen)
        count = np.bincount(place[known], minlength=n_zone)
        total = np.bincount(place[known], seen[known], n_zone)
        zone = np.where(count > 0, total / np.maximum(count, 1), np.nan)
        own = np.array([_value(measurements, f"{name}/{ZONE_TEMPERATURE}") for name in points.zones])
        zone = np.where(np.isfinite(own), own, zone)
        flow = np.array([_value(measurements, f"{name}/supply_air_flowrate_sensor") for name in points.terminals])
        warm = np.array([_value(measurements, f"{name}/discharge_air_temperature_sensor") for name in points.terminals])
        each = AIR_HEAT_CAPACITY * flow * (warm - zone[place])
        heat = np.asarray(np.bincount(place, each, n_zone), dtype=float)
        outdoor = _value(measurements, f"{points.weather_station}/{OUTDOOR_TEMPERATURE}")
        water = _value(measurements, f"{points.boiler}/supply_water_temperature_sensor")
        power = sum((_value(measurements, column) for column in points.meters), 0.0)
        missing = [f"zone temperature of {z!r} is missing: its model goes on alone"
                   for z, t in zip(points.zones, zone, strict=True) if not np.isfinite(t)]  # fmt: skip
        # where the zone itself did not report, its heat is unknown too and has been said
        lost = np.flatnonzero(~np.isfinite(each) & np.isfinite(zone[place]))
        names = [points.terminals[k] for k in lost]
        missing += [f"flow or discharge temperature of {name!r} is missing: the plan's heat is taken" for name in names]
        if not np.isfinite(water):
            missing.append(f"supply water temperature of {points.boiler!r} is missing: its last value is taken")
        return _Reading(zone, heat, outdoor, water, power, tuple(missing))


def _value(measurements: Mapping[str, float], column: str) -> float:
    if column not in measurements:
        return float("nan")
    try:
        return float(measurements[column])
    except (TypeError, ValueError):
        return float("nan")
