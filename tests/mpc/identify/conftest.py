"""A house of four nodes with a heat pump that draws power at any speed above zero: known to the last coefficient."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import expm

from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import Actuator, checked_actions
from mpc.loop.plant import Measurements, PointLayout
from mpc.scenario.forecast import Forecast, Forecaster
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import ComfortBand, Occupancy
from mpc.scenario.rates import ConstantRate, HourlyRate
from mpc.scenario.scenario import build_scenario
from mpc.scenario.tariff import Tariff
from mpc.scenario.weather import Weather
from thermal.case.building import Building, Location, ZoneEntry, ZoneTable

AREA, STEP, PART = 192.0, 900.0, 60.0
STANDING, FULL, CAPACITY = 1600.0, 3500.0, 15000.0  # W
HEAT_PUMP = "heat_pump/compressor_speed"
COLUMNS = (
    "house/zone_air_temperature_sensor",
    "heat_pump/electrical_power_sensor",
    "heat_pump/heating_power_sensor",
    "weather_station/outside_air_temperature_sensor",
)
# J/K of air, floor, walls and envelope, and W/K of their links
CAPACITIES = np.array([3e6, 2.2e7, 2e7, 3e7])
LINKS = {(0, 1): 1500.0, (0, 2): 1000.0, (0, 3): 400.0}
OUT = np.array([60.0, 0.0, 0.0, 150.0])
APERTURE = 6.0


class AtHome(Occupancy):
    """Three people from the evening to the morning."""

    def expected(self, grid: StepGrid, zones: Any) -> Any:
        hours = grid.stamps.hour.to_numpy()
        return np.where((hours < 8) | (hours >= 17), 3.0, 0.0)[:, None]


def heat_of(speed: float, outdoor: float) -> float:
    """Heat into the floor [W]."""
    return CAPACITY * speed * (1.0 + 0.02 * (outdoor - 280.15))


def power_of(speed: float, outdoor: float) -> float:
    """Electricity [W]."""
    return (STANDING if speed > 0 else 0.0) + speed * FULL * (1.0 - 0.005 * (outdoor - 280.15))


class House:
    """The plant: its own control modulates by the deviation from 22 degC; speed as fast as that is continuous."""

    control_step, zone_names, columns, timezone = STEP, ("house",), COLUMNS, "Etc/GMT-1"

    def __init__(self, days: int = 14, start: str = "2023-01-16", kind: Any = "modulating", seed: int = 0) -> None:
        minimum = 0.2 if kind == "modulating" else None
        self.actuators = (Actuator(HEAT_PUMP, "1", 0.0, 1.0, required=False, kind=kind, minimum=minimum),)
        self._layout = PointLayout(COLUMNS, self.timezone)
        self._steps = 96 * days
        grid = StepGrid(pd.Timestamp(start, tz=self.timezone), STEP, self._steps + 96)
        rng = np.random.default_rng(seed)
        hours = np.arange(grid.n_steps) / 4.0
        drift = np.cumsum(rng.normal(0.0, 0.25, grid.n_steps)) * 0.5
        outdoor = 275.0 + 3.0 * np.sin(2 * np.pi * (hours - 9.0) / 24.0) + drift - np.linspace(0, drift[-1], drift.size)
        clear = np.repeat(rng.uniform(0.1, 1.0, grid.n_steps // 96), 96)
        sun = 350.0 * clear * np.maximum(np.sin(np.pi * ((hours % 24.0) - 8.0) / 9.0), 0.0) * ((hours % 24.0) < 17.0)
        self.outdoor, self.sun = outdoor, np.maximum(sun, 0.0)
        place = Location(latitude=50.8, longitude=4.35, elevation=100.0, timezone=self.timezone)
        table = pd.DataFrame(
            {"outside_air_temperature_sensor": outdoor, "global_horizontal_irradiance_sensor": self.sun},
            index=grid.stamps,
        )
        zones = ZoneTable((ZoneEntry(name="house", floor_area=AREA, volume=500.0),))
        price = [0.15] * 7 + [0.35] * 3 + [0.2] * 7 + [0.45] * 3 + [0.2] * 4
        self.scenario = build_scenario(
            Building("house", place, 0.0, zones, weather_station="weather_station"), grid,
            Weather(table, place, step=STEP), Tariff(HourlyRate(price, price), ConstantRate(0.0), (), "EUR"),
            occupancy=AtHome({"house": 3.0}), gains=InternalGains(equipment=0.0, lights=0.0),
            comfort={"house": ComfortBand((294.15, 297.15), (288.15, 303.15), (7.0, 22.0), (7.0, 22.0), (7.0, 22.0))},
        )  # fmt: skip
        self.forecaster = Forecaster(self.scenario, 96)
        matrix = np.zeros((4, 4))
        for (a, b), value in LINKS.items():
            matrix[[a, b], [a, b]] += value
            matrix[a, b] -= value
            matrix[b, a] -= value
        matrix += np.diag(OUT)
        push = np.column_stack([OUT, [0.3, 0, 0.7, 0], [0, 1, 0, 0], [1, 0, 0, 0]])
        big = np.zeros((8, 8))
        big[:4] = np.hstack([-matrix, push]) / CAPACITIES[:, None] * PART
        self._exact = expm(big)[:4]
        self._number = -1

    def __enter__(self) -> House:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """Nothing is held."""

    @property
    def finished(self) -> bool:
        return self._number >= self._steps

    def reset(self, seed: int | None = None) -> Measurements:
        self._number, self._state = 0, np.array([295.15, 297.0, 295.0, 288.0])
        self._zone, self._power, self._integral = [295.15], [], 0.3
        self._seen = [295.15, 0.0, 0.0, self.outdoor[0]]
        return self._told()

    def step(self, actions: Mapping[str, float]) -> Measurements:
        given = checked_actions(actions, {a.name: a for a in self.actuators})
        k, rows = self._number, []
        outdoor, gain = self.outdoor[k], float(self.scenario.gains[k, 0])
        for _ in range(int(STEP / PART)):
            error = 295.15 - self._state[0]
            self._integral = min(max(self._integral + 2e-4 * error, 0.0), 0.8)
            own = min(max(0.5 * error + self._integral, 0.0), 1.0)
            speed = given.get(HEAT_PUMP, own if own > 0.05 else 0.0)
            heat, power = heat_of(speed, outdoor), power_of(speed, outdoor)
            u = np.array([outdoor, APERTURE * self.sun[k], heat, gain])
            before = self._state[0]
            self._state = self._exact @ np.concatenate([self._state, u])
            rows.append([0.5 * (before + self._state[0]), power, heat, outdoor])
            self._zone.append(self._state[0])
            self._power.append(power)
        self._number += 1
        self._seen = np.mean(rows, axis=0)
        return self._told()

    def _told(self) -> Measurements:
        return Measurements(self._layout, int(self.scenario.grid.edges[self._number]), np.array(self._seen))

    def forecast(self) -> Forecast:
        return self.forecaster.table(self._number)

    def record(self) -> PlantRecord:
        return PlantRecord(PART, np.array(self._zone)[:, None], np.array(self._power))


@pytest.fixture(scope="session")
def truth() -> SimpleNamespace:
    """The house's numbers."""
    return SimpleNamespace(
        House=House, heat_of=heat_of, power_of=power_of, capacities=CAPACITIES, standing=STANDING, heat_pump=HEAT_PUMP
    )
