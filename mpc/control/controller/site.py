"""What a controller gets from its site and gives it: points, readings, rules, actions, and the settings between."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

import numpy as np
import pandas as pd

from mpc.control.controller.ranges import READINGS
from mpc.control.predictor.predictor import Predictor
from mpc.control.problem.assembly import ComfortOperation
from mpc.control.problem.channels import Channel
from mpc.control.solvers.solution import Solution
from mpc.control.solvers.uncertainty import BackOff, Margin
from mpc.errors import ControlError
from mpc.kpi.rewards import DISCOMFORT_PRICE
from mpc.loop.actuators import STATIC_PRESSURE, SUPPLY_AIR, SUPPLY_WATER
from mpc.scenario.forecast import Forecast
from mpc.scenario.tariff import DemandCharge
from thermal._types import FloatArray
from thermal.case.points import (
    DISCHARGE_TEMPERATURE,
    OUTDOOR_TEMPERATURE,
    SUPPLY_FLOW,
    ZONE_TEMPERATURE,
    numbers,
    possible_values,
)
from thermal.system.smooth import SmoothHvac
from thermal.system.system import HvacSystem
from thermal.units import AIR_HEAT_CAPACITY

_OF_TERMINALS = (ZONE_TEMPERATURE, SUPPLY_FLOW, DISCHARGE_TEMPERATURE)
_WATER = "supply_water_temperature_sensor"


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
        Boiler, or what else supplies the hot water.
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

    @property
    def columns(self) -> tuple[str, ...]:
        """All that `read` looks at, ``ENTITY/POINT``."""
        terminals = [f"{name}/{point}" for point in _OF_TERMINALS for name in self.terminals]
        zones = [f"{zone}/{ZONE_TEMPERATURE}" for zone in self.zones]
        others = (f"{self.weather_station}/{OUTDOOR_TEMPERATURE}", f"{self.boiler}/{_WATER}")
        return (*terminals, *zones, *others, *self.meters)

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
            for point in _OF_TERMINALS
        )
        known = np.isfinite(seen)
        count, total = (np.bincount(place[known], weights, n_zone) for weights in (None, seen[known]))
        zone = np.where(count > 0, total / np.maximum(count, 1), np.nan)
        own = values_of(measurements, self.zones, ZONE_TEMPERATURE)
        zone = np.where(np.isfinite(own), own, zone)
        each = AIR_HEAT_CAPACITY * flow * (warm - zone[place])
        heat = np.asarray(np.bincount(place, each, n_zone), dtype=float)
        outdoor = float(values_of(measurements, [self.weather_station], OUTDOOR_TEMPERATURE)[0])
        water = float(values_of(measurements, [self.boiler], _WATER)[0])
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

    def past_steps(self, telemetry: pd.DataFrame, control_step: float) -> list[PastStep]:
        """Cut telemetry into control steps, the last of which ends with it.

        Parameters
        ----------
        telemetry : DataFrame, shape (n_time, n_column)
            Means over the steps that end at its stamps.
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
        taken = possible_values(telemetry, READINGS)
        means = taken.resample(length, closed="right", label="right", origin=index[-1]).mean()
        column = f"{self.weather_station}/{OUTDOOR_TEMPERATURE}"
        outdoor = means.reindex(columns=[column]).ffill().bfill().to_numpy()[:, 0]
        if np.isnan(outdoor).any():
            raise ControlError("start-up: telemetry", "an outdoor temperature", "none", str(self.weather_station))
        gains = means.reindex(columns=[f"{zone}/internal_gain" for zone in self.zones]).fillna(0.0).to_numpy()
        rows = zip(means.index, means.to_dict("records"), outdoor, gains, strict=True)
        return [(stamp, {str(k): v for k, v in row.items()}, float(air), heat) for stamp, row, air, heat in rows]

    def past_forecast(self, telemetry: pd.DataFrame) -> Forecast:
        """Take what signals of effects are made of from telemetry: the weather, and who was in which zone.

        Parameters
        ----------
        telemetry : DataFrame
            By ``ENTITY/POINT`` [library's units].
        """
        station = f"{self.weather_station}/"
        weather = {column: column.removeprefix(station) for column in map(str, telemetry) if column.startswith(station)}
        people = [f"{zone}/occupancy_count_sensor" for zone in self.zones]
        return Forecast(telemetry[[*weather, *(c for c in people if c in telemetry)]].rename(columns=weather))


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
    """Look a point of several entities up, shape (n_entity,) [library's units]; NaN where it is missing or cannot be.

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
    found = numbers([measurements[c] if c in measurements else np.nan for c in columns])
    kinds = [READINGS.get(column.rpartition("/")[2]) for column in columns]
    return np.array([v if k is None or k.possible(v) else np.nan for k, v in zip(kinds, found, strict=True)])


@dataclass(frozen=True)
class ResetRule:
    """Outdoor reset: straight lines between a cold and a warm day.

    Parameters
    ----------
    cold, warm : float
        Outdoor temperatures between which the setpoints move [K]: defaults -7 and 16 degC.
    air, water : tuple of float
        Setpoints on the cold and on the warm day [K]. Defaults 18 to 13 degC for air (ASHRAE 90.1's reset of 5 K) and
        80 to 50 degC for water.
    """

    cold: float = 266.15
    warm: float = 289.15
    air: tuple[float, float] = (291.15, 286.15)
    water: tuple[float, float] = (353.15, 323.15)

    def setpoints(self, channels: Sequence[Channel], outdoor: float) -> FloatArray:
        """Setpoints at an outdoor temperature, shape (n_channel,) [unit of the channel].

        Parameters
        ----------
        channels : sequence of Channel
            What is decided; pressures and zones get the middle of their range.
        outdoor : float
            Outdoor temperature [K]; what is not finite counts as half-way.
        """
        share = np.clip((outdoor - self.cold) / (self.warm - self.cold), 0.0, 1.0) if np.isfinite(outdoor) else 0.5
        by_rule = {SUPPLY_AIR: self.air, SUPPLY_WATER: self.water}
        values = []
        for channel in channels:
            first, last = by_rule.get(channel.quantity, (0.5 * (channel.lower + channel.upper),) * 2)
            values.append(np.clip(first + share * (last - first), channel.lower, channel.upper))
        return np.array(values)

    def plan(self, predictor: Predictor, outdoor: FloatArray) -> FloatArray:
        """Plan by rule, shape (n_block, n_channel) [unit of the channel].

        Parameters
        ----------
        predictor : Predictor
            Of the horizon.
        outdoor : ndarray, shape (N,)
            Outdoor temperature over each step [K].
        """
        horizon = predictor.horizon
        means = [outdoor[horizon.block_of == b].mean() for b in range(horizon.n_block)]
        return np.stack([self.setpoints(predictor.channels, float(mean)) for mean in means])


class Source(StrEnum):
    """Where an action comes from."""

    OPTIMAL = "optimal plan"
    PREVIOUS = "previous plan"
    RULES = "rules"


@dataclass(frozen=True, eq=False)
class Action(Mapping[str, float]):
    """Setpoints for the next control step, by ``ENTITY/POINT``, and why.

    Parameters
    ----------
    setpoints : dict of str to float
        Finite, within the ranges of their channels [K or Pa].
    source : Source
        Optimal plan, previous plan or rules.
    reasons : tuple of str
        In words: what failed, what was missing, whether a plan begun anew took the place of the one carried on, where
        comfort is not met and what stands in its way.
    solution : Solution or None
        Of the solver; None where it did not run or broke.
    stamp : pandas.Timestamp
        When the action begins.
    """

    setpoints: dict[str, float]
    source: Source
    reasons: tuple[str, ...]
    solution: Solution | None
    stamp: pd.Timestamp

    def __getitem__(self, name: str) -> float:
        return self.setpoints[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.setpoints)

    def __len__(self) -> int:
        return len(self.setpoints)


@dataclass(frozen=True)
class ControllerSettings:
    """What a controller pays for, and how long it may think.

    Parameters
    ----------
    comfort_price : float
        Of a zone's kelvin outside of its band for an hour [currency/K/h].
    carbon_price : float
        Of emissions [currency/kg].
    heat_value : float
        Of heat that the building holds at the end [currency/kWh].
    time_limit : float
        Wall time of a solve [s].
    second_start : float
        Time between solves that begin anew as well as at the plan that is carried on [s], see `Starts`; infinite is
        never.
    operation : ComfortOperation
        Schedules of the building's automation.
    rule : ResetRule
        First guess, and what is done when there is no plan.
    demand : tuple of DemandCharge
        Of the tariff.
    back_off : BackOff or Margin, optional
        Narrows the comfort bands by what is uncertain; none by default.
    false_alarm, resolution : float
        Of the recognition of stuck sensors, see `StuckSensors` [-], [K].

    Raises
    ------
    ControlError
        When the price of discomfort is negative or no number: a controller would seek discomfort, or never find a plan.
    """

    comfort_price: float = DISCOMFORT_PRICE
    carbon_price: float = 0.0
    heat_value: float = 0.0
    time_limit: float = 60.0
    second_start: float = 7200.0
    operation: ComfortOperation = field(default_factory=ComfortOperation)
    rule: ResetRule = field(default_factory=ResetRule)
    demand: tuple[DemandCharge, ...] = ()
    back_off: BackOff | Margin | None = None
    false_alarm: float = 1e-5
    resolution: float = 0.1

    def __post_init__(self) -> None:
        ControlError.unless(0 <= self.comfort_price < np.inf, "comfort price", "a number from 0 on", self.comfort_price)
