"""Years of an office in which one thing changes, or nothing: made by explicit balances beside the library's walls.

Walls, slabs, windows and furniture are those of the library's network, with parameters drawn from their priors, on a
finer grid than the model that watches them. What acts on them has code of its own, out of balance at each step:
leakage that follows wind and temperature difference, windows that stand open, doors, people who come and go as they
like, terminals with a limit, valves that leak, sensors and meters that read wrong. Beside that the plant has sun on its
walls, a cold sky and wind on its films, which the model that watches lacks.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from calibration.estimation.state_space import REFERENCE, state_space
from calibration.monitoring.days import Days
from calibration.monitoring.filter import DayFilter, noise_of
from thermal import Building, Case
from thermal.case.building import FloorPlans
from thermal.effects.catalogue import chosen
from thermal.errors import ThermalError
from thermal.inputs.normalisation import Normalisation
from thermal.inputs.provider import InputProvider
from thermal.inputs.signals import signal_values
from thermal.model.matrices import SymbolicModel
from thermal.model.reduce import reduced_model
from thermal.network.build import build_network
from thermal.network.network import ThermalNetwork
from thermal.parameters import Parameter
from thermal.pilot.building import pilot_building
from thermal.pilot.telemetry import TelemetrySettings, generate_telemetry
from thermal.pilot.thermostat import size_terminals
from thermal.pilot.weather import draw_disturbance, generate_weather
from thermal.units import AIR_HEAT_CAPACITY, air_density

Array = NDArray[np.float64]

STEP, DAYS, RUN_IN = 1800.0, 364, 14
START = "2023-01-02"

#: Floor areas that are tried, each a hundredth larger.
_ATTEMPTS = 20

#: What the plant has beside walls and air [parameter units], each drawn between two values; the second ones are what no
#: model that watches has.
_KNOWN = {"solar_heat_gain_coefficient": (0.25, 0.5)}
_UNKNOWN = {"solar_absorptance": (0.3, 0.7), "sky_exchange_factor": (0.3, 0.8), "wind_film_slope": (1.0, 4.0)}

#: What changes, with the ids of the catalogue that are right for it, whether it is in one zone, and the range of its
#: size: W/m2, K, share, m2, 1/h, share, share, W/m2, m3/s, h.
CHANGES: dict[str, tuple[tuple[str, ...], bool, tuple[float, float]]] = {
    "valve_leak": (("valve_leak",), True, (6.0, 15.0)),
    "sensor_bias": (("sensor_bias",), True, (0.5, 1.3)),
    "blinds_down": (("solar_gain", "blinds"), False, (0.5, 0.8)),
    "window_open": (("window_opening",), True, (0.04, 0.15)),
    "infiltration": (("infiltration",), False, (0.3, 0.8)),
    "flow_gain": (("flow_gain",), True, (0.15, 0.3)),
    "capacity_limit": (("capacity_limit",), True, (0.4, 0.7)),
    "internal_gains": (("internal_gains",), False, (5.0, 10.0)),
    "door_open": (("zone_mixing",), True, (0.05, 0.2)),
    "clock_shift": (("clock_shift",), False, (1.0, 1.0)),
}


@dataclass(frozen=True)
class Change:
    """What changes in a year.

    Parameters
    ----------
    kind : str
        Of `CHANGES`; empty where nothing does.
    effects : tuple of str
        Ids of the catalogue that are right.
    zones : tuple of str
        Where; empty for the whole building.
    size : float
        In the units of the kind, with its sign.
    start, end : int
        First day, and the first on which it is mended; the days of the year where it is not.
    over : float
        Days over which a sensor drifts to its size [d]; 0 is at once.
    """

    kind: str = ""
    effects: tuple[str, ...] = ()
    zones: tuple[str, ...] = ()
    size: float = 0.0
    start: int = DAYS
    end: int = DAYS
    over: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """Label."""
        return asdict(self)


def draw_change(
    building: Building, seed: int, outside: list[str], pairs: list[tuple[str, str]], kind: str = ""
) -> Change:
    """Draw what changes: kinds take turns, half of them are mended after three to ten weeks."""
    rng = np.random.default_rng([seed, 11])
    kind = kind or list(CHANGES)[seed % len(CHANGES)]
    effects, zonal, (low, high) = CHANGES[kind]
    size = float(rng.uniform(low, high)) * (-1.0 if kind in ("sensor_bias", "flow_gain", "clock_shift")
                                             and rng.random() < 0.5 else 1.0)  # fmt: skip
    zones: tuple[str, ...] = (str(rng.choice(outside if kind == "window_open" else building.zone_names)),)
    if kind == "door_open":
        zones = pairs[int(rng.integers(len(pairs)))]
    start = int(rng.integers(56, DAYS - 84))
    end = start + int(rng.integers(21, 71)) if (seed // len(CHANGES)) % 2 else DAYS
    return Change(kind, effects, zones if zonal else (), size, start, end)


def make_year(seed: int, changed: bool, days: int = DAYS, kind: str = "", **when: float) -> tuple[Case, Change]:
    """Make a year of telemetry, or so many days, and say what changed: what is drawn, or a kind, `when` of `Change`."""
    rng = np.random.default_rng([seed, 12])
    zones = int(rng.integers(4, 6))
    building = _drawn_building(seed, float(rng.uniform(28.0, 45.0)) * zones, zones)
    weather = _weather(building, seed, rng, days)
    plant = _Plant(building, weather, seed, rng)
    outside = [z for z, exposed in zip(building.zone_names, plant.exposed, strict=True) if exposed]
    change = draw_change(building, seed, outside, plant.pairs, kind) if changed else Change()
    if kind:
        change = replace(change, **{"end": DAYS} | when)
    plant.change = change
    plans = building.geometry
    if not isinstance(plans, FloorPlans):
        raise TypeError(f"expected floor plans, found {type(plans).__name__}")
    noise = float(rng.choice([0.03, 0.06]))
    sensors = TelemetrySettings(seed, float(RUN_IN), building.weather_station, noise, float(rng.choice([0.02, 0.1])))
    telemetry = generate_telemetry(plant, plans, weather, sensors)
    frame = _read_wrong(telemetry.frame.copy(), change, building)
    return Case(building, replace(telemetry, frame=frame)), change


def evidence_of_oracle(changed: Days, quiet: Days, reference: int) -> Array:
    """Evidence by day for a change of which is known what it does to the errors, on average, shape (n_day,) [-].

    ``½ gᵀ V⁻¹ g`` with g what is left in the innovations of what the same year without the change differs by.
    Thermostats take another course in it, which counts as if it were the change: an upper bound.
    """
    moved = np.nan_to_num(changed.errors - quiet.errors)
    filtered = DayFilter(quiet, noise_of(quiet, reference))
    state, evidence = filtered.start(), np.zeros(len(quiet))
    taken = np.zeros(state.mean.size)  # what the filter makes of the change
    for day in range(len(quiet)):
        state, innovation = filtered.step(state, day)
        if innovation is not None:
            left = moved[day][innovation.seen] - innovation.observe @ taken
            taken = taken + innovation.gain @ left
            evidence[day] = 0.5 * np.sum(solve_triangular(innovation.root, left, lower=True) ** 2)
    return evidence


def _drawn_building(seed: int, floor_area: float, zones: int) -> Building:
    """Draw an office of a floor area that whole cells can have, close to the one that is asked for."""
    for attempt in range(_ATTEMPTS):
        try:
            area = floor_area * (1.0 + 0.01 * attempt)
            return pilot_building(seed, floor_area=area, zones=zones, floors=1, name=f"year_{seed}")
        except ThermalError:
            if attempt + 1 == _ATTEMPTS:
                raise
    raise AssertionError("unreachable")


def _weather(building: Building, seed: int, rng: np.random.Generator, days: int) -> pd.DataFrame:
    """Make a mild climate colder, with a wider year, by as much as is drawn."""
    begin = str((pd.Timestamp(START) - pd.Timedelta(days=RUN_IN)).date())
    weather = generate_weather(
        seed, start=begin, days=days + RUN_IN, step_seconds=STEP, location=building.location,
        station=building.weather_station,
    )  # fmt: skip
    index = pd.DatetimeIndex(weather.index)
    year = np.cos(2.0 * np.pi * (index.day_of_year.to_numpy() - 15.0) / 365.25)
    colder = rng.uniform(-2.0, 6.0) + rng.uniform(0.0, 7.0) * year
    weather[f"{building.weather_station}/outside_air_temperature_sensor"] -= np.round(colder, 3)
    return weather


def _read_wrong(frame: pd.DataFrame, change: Change, building: Building) -> pd.DataFrame:
    """Let meters and clocks read wrong while the change lasts."""
    per_day = round(86400.0 / STEP)
    rows = slice(change.start * per_day, change.end * per_day)
    if change.kind == "flow_gain":
        column = f"VAV_{change.zones[0]}/supply_air_flowrate_sensor"
        # a gain of the metered heat: the air brought (1 + size) times what the meter says
        frame.iloc[rows, frame.columns.get_loc(column)] /= 1.0 + change.size  # type: ignore[index]
    if change.kind == "clock_shift":
        steps = round(change.size * 3600.0 / STEP)
        for column in [c for c in frame if str(c).startswith(f"{building.weather_station}/")]:
            moved = np.roll(frame[column].to_numpy(), steps)
            frame.iloc[rows, frame.columns.get_loc(column)] = moved[rows]  # type: ignore[index]
    return frame


def _between(rng: np.random.Generator, ranges: dict[str, tuple[float, float]]) -> dict[str, float]:
    return {name: float(rng.uniform(*ends)) for name, ends in ranges.items()}


def _drawn(rng: np.random.Generator, parameters: tuple[Parameter, ...]) -> dict[str, float]:
    """Parameters of the baseline, half of their prior's spread about its centre."""
    return {
        p.name: float(np.clip(p.inverse(p.transform(p.start) + 0.5 * p.prior_deviation * rng.standard_normal()),
                              p.lower, p.upper))
        for p in parameters if p.effect is None
    }  # fmt: skip


class _Plant:
    """Steps the building; the change acts from its first to its last day."""

    def __init__(self, building: Building, weather: pd.DataFrame, seed: int, rng: np.random.Generator) -> None:
        self.step_seconds, self.zone_names = STEP, building.zone_names
        effects = chosen(["solar_gain", "solar_opaque", "longwave_sky", "wind_film"])
        network = build_network(building, dx=0.5, effects=effects)
        values = _drawn(rng, network.parameters) | _between(rng, _KNOWN) | _between(rng, _UNKNOWN)
        theta = network.values(values)
        modes = reduced_model(SymbolicModel(network), [theta]).matrices(theta).modal.modes
        self.space = state_space(modes, STEP)
        self.boundary = _boundary(building, network, weather)
        self.sunny = np.array([0] + ["sun through glass" in s.name for s in network.signals], dtype=bool)
        rooms = [network.anatomy.rooms[z] for z in building.zone_names]
        self.area, self.volume = np.array([r.floor_area for r in rooms]), np.array([r.volume for r in rooms])
        outside = {zone for zone, _ in network.anatomy.facades}
        self.exposed = np.array([z in outside for z in building.zone_names], dtype=float)
        self.pairs = list(network.anatomy.partitions)
        self.air = 1006.0 * air_density(building.location.elevation)
        index = pd.DatetimeIndex(weather.index)
        self.wind = weather[f"{building.weather_station}/wind_speed_sensor"].to_numpy()
        self.leak = rng.uniform(0.05, 0.25), rng.uniform(0.0, 0.04), rng.uniform(0.0, 0.04)
        gains = _people(rng, index, len(rooms)) * self.area * rng.uniform(6.0, 14.0)
        gains += self.area * rng.uniform(0.5, 2.0)
        deviation = rng.uniform(0.3, 1.5) * self.area
        self.gains = gains + draw_disturbance(seed, len(index), deviation, float(rng.uniform(1800.0, 14400.0)), STEP)
        self.largest = np.zeros(len(rooms))
        self.terminals = size_terminals(seed, self.area)
        self.bias = np.zeros(len(rooms))
        self.change = Change()
        self.number = 0
        self.zone = np.empty(0)

    def reset(self, zone_temperatures: Array, /) -> Array:
        self.number = 0
        self.state = (float(np.mean(zone_temperatures)) - REFERENCE) * self.space.uniform
        self.zone = zone_temperatures.copy()
        return self.zone

    def step(self, zone_heat: Array, boundary_temperatures: Array, /) -> Array:
        k, change = self.number, self.change
        day = k * STEP / 86400.0 - RUN_IN
        kind = change.kind if change.start <= day < change.end else ""
        at = [self.zone_names.index(z) for z in change.zones]
        outdoor = float(boundary_temperatures[0])
        true = self.zone - self.bias
        self.bias = np.zeros(len(true))
        heat = self._delivered(zone_heat, kind, at) + self.gains[k]
        # air of a known temperature brings more to a zone that is colder than its sensor says
        heat = heat + AIR_HEAT_CAPACITY * self._flow(zone_heat) * (self.zone - true)
        boundary = self.boundary[k].copy()
        if kind == "valve_leak":
            heat[at] += change.size * self.area[at]
        elif kind == "internal_gains":
            heat = heat + change.size * self.area
        elif kind == "blinds_down":
            boundary[self.sunny] *= 1.0 - change.size
        drives = np.concatenate([boundary, heat])
        drives[0] = outdoor - REFERENCE
        mean = self.space.observation @ self.state + self.space.feedthrough @ drives + REFERENCE
        # air is exchanged at the temperatures of this step: at those of the last one an open door would not be stable
        through, between = self._exchange(outdoor - true, float(self.wind[k]), kind, at)
        by_heat, lost = self.space.feedthrough[:, -len(true) :], np.diag(through) + between
        mean = np.linalg.solve(np.eye(len(true)) + by_heat @ lost, mean + by_heat @ (through * outdoor))
        drives[-len(true) :] += through * outdoor - lost @ mean
        self.state = self.space.advance(self.state) + self.space.drive @ drives
        self.number += 1
        if kind == "sensor_bias":
            self.bias[at] = change.size * (min((day - change.start) / change.over, 1.0) if change.over else 1.0)
        self.zone = mean + self.bias
        return self.zone

    def _exchange(self, cold: Array, wind: float, kind: str, at: list[int]) -> tuple[Array, Array]:
        """Conductances of air to outdoor, (n,), and a matrix of those between zones, (n, n) [W/K]."""
        n, by_wind, by_stack = self.leak
        rate = n + by_wind * wind + by_stack * np.sqrt(np.abs(cold))
        rate = rate + (self.change.size if kind == "infiltration" else 0.0)
        through, between = self.exposed * self.air * self.volume * rate / 3600.0, np.zeros((len(cold), len(cold)))
        if kind == "window_open":
            speed = 0.5 * np.sqrt(0.001 * wind**2 + 0.0035 * np.abs(cold[at]) + 0.01)
            through[at] += self.air * self.change.size * speed
        elif kind == "door_open":
            between[np.ix_(at, at)] += self.air * self.change.size * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return through, between

    def _flow(self, zone_heat: Array) -> Array:
        """Supply air of the zones [kg/s], as their terminals choose it."""
        t = self.terminals
        reach = np.abs(np.where(zone_heat >= 0.0, t.warmest, t.coldest) - self.zone)
        return np.clip(np.abs(zone_heat) / (AIR_HEAT_CAPACITY * np.maximum(reach, 1e-9)), t.minimum_flow, t.design_flow)

    def _delivered(self, zone_heat: Array, kind: str, at: list[int]) -> Array:
        """Heat that the terminals bring, beside what they are asked for."""
        if self.number * STEP / 86400.0 - RUN_IN < self.change.start:
            self.largest = np.maximum(self.largest, np.abs(zone_heat))
        heat = zone_heat.copy()
        if kind == "capacity_limit":
            most = (1.0 - self.change.size) * self.largest[at]
            heat[at] = np.clip(heat[at], -most, most)
        return heat


def _boundary(building: Building, network: ThermalNetwork, weather: pd.DataFrame) -> Array:
    """Boundary of each step: room for the outdoor temperature, and the signals of the effects."""
    station, index = building.weather_station, pd.DatetimeIndex(weather.index)
    series = {str(c).partition("/")[2]: weather[c].to_numpy(dtype=float) for c in weather}
    series["outdoor"] = series["outside_air_temperature_sensor"]
    usual = {zone: (294.5,) * 48 for zone in building.zone_names}
    provider = InputProvider(building, index, STEP, series, Normalisation(usual, wind=2.5), f"weather of {station}")
    values = signal_values(network.signals, provider)
    return np.hstack([np.zeros((len(index), 1)), values])


def _people(rng: np.random.Generator, index: pd.DatetimeIndex, zones: int) -> Array:
    """Presence: a course for each zone and day, with days off that no calendar has."""
    middle = index - pd.Timedelta(seconds=STEP / 2)
    hour, day = np.asarray(middle.hour + middle.minute / 60.0), np.asarray(middle.day_of_year + 366 * middle.year)
    present = np.zeros((len(index), zones))
    for number in np.unique(day):
        rows = np.flatnonzero(day == number)
        if middle[rows[0]].day_of_week >= 5 or rng.random() < 0.03:
            continue
        come, leave = 8.0 + 0.7 * rng.standard_normal(zones), 17.5 + 0.9 * rng.standard_normal(zones)
        many = np.clip(1.0 + 0.3 * rng.standard_normal(zones), 0.0, 2.0) * (rng.random(zones) > 0.05)
        there = (hour[rows, None] >= come) & (hour[rows, None] < leave)
        present[rows] = there * many
    return present
