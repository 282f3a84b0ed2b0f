"""A plant of ours as a site: an office with air handlers behind a BACnet/IP device, with what its own control costs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from _site_files import AHEAD

from mpc.adapters.described.schema import PlantFile
from mpc.kpi.daily import by_day
from mpc.kpi.record import PlantRecord
from mpc.loop.actuators import SUPPLY_AIR, SUPPLY_WATER, Actuator
from mpc.loop.make import PlantSettings, pilot_weather, simulated_plant
from mpc.loop.noise import SensorNoise
from mpc.loop.plant import Measurements, PointLayout
from mpc.loop.simulated import SimulatedPlant
from mpc.scenario.forecast import Forecast
from mpc.scenario.weather import WEATHER_POINTS
from thermal.case.building import Building
from thermal.case.points import ZONE_TEMPERATURE
from thermal.effects.catalogue import chosen
from thermal.network.build import build_network

#: What the building's own control holds, whatever the weather [K]: 13 degC of air, 75 degC of water.
OWN = {SUPPLY_AIR: 286.15, SUPPLY_WATER: 348.15}

#: Step of the plant, so that every point moves each minute; control step; how far forecasts reach [s].
STEP, CONTROL_STEP, HORIZON = 60.0, 900.0, 12 * 3600.0

#: Days under its own control before a week that is judged [d]: it begins in a steady state, as no building ever does.
RUN_IN = 7


#: What the building has beside the baseline; and the spread of its parameters about their starting values (a factor).
EFFECTS, SPREAD = ("solar_gain",), 0.25

#: Share of the sun on the windows that comes in [-].
SUN = 0.4


def drawn_parameters(building: Building, seed: int) -> dict[str, float]:
    """Draw the parameters of the building [parameter units]."""
    rng, network = np.random.default_rng(seed), build_network(building, effects=chosen(EFFECTS))
    values = {p.name: float(np.clip(p.start * np.exp(SPREAD * rng.normal()), p.lower, p.upper))
              for p in network.parameters}  # fmt: skip
    return values | {"solar_heat_gain_coefficient": SUN}


class OwnControl:
    """A plant whose supply setpoints go back to its own control when nobody commands them.

    Parameters
    ----------
    building : Building
        With its devices.
    start : str
        Local day of its begin, ISO 8601.
    days : float
        Length [d].
    seed : int
        Of parameters, weather, people and noise.
    step : float
        Of the plant [s].
    run_in : int
        Days before the start under its own control [d]: a plant of ours begins in a steady state.
    """

    def __init__(
        self, building: Building, start: str, days: float, seed: int, step: float = STEP, run_in: int = 0
    ) -> None:
        self.building, self.control_step, self._lead = building, step, round(run_in * 86400.0 / step)
        self.steps, self._done = round(days * 86400.0 / step), 0
        start, days = f"{pd.Timestamp(start) - pd.Timedelta(days=run_in):%Y-%m-%d}", days + run_in
        reach = round((HORIZON + (AHEAD + 1) * CONTROL_STEP) / step)
        end = (pd.Timestamp(start) + pd.Timedelta(days=days, seconds=reach * step)).isoformat()
        self.settings = PlantSettings(
            parameters=drawn_parameters(building, seed), effects=chosen(EFFECTS), step_seconds=step, horizon=reach,
            noise=SensorNoise(), seed=seed,
        )  # fmt: skip
        weather = pilot_weather(seed, start, np.ceil(days + 1.0), step_seconds=step)
        self.plant: SimulatedPlant = simulated_plant(building, weather, start, end, self.settings)
        kinds = {a.name: a.name.rpartition("/")[2] for a in self.plant.actuators}
        self.own = {name: OWN[kind] for name, kind in kinds.items() if kind in OWN}
        self.actuators: tuple[Actuator, ...] = tuple(a for a in self.plant.actuators if a.name in self.own)
        self.zone_names = self.plant.zone_names
        # a site has the temperatures by zone, our plant by the terminal that reads them
        zones = {d.name: d.zone for d in self.plant.scenario.building.devices if d.type == "vav"}
        names = [column.rpartition("/") for column in self.plant.columns]
        self._layout = PointLayout(
            tuple(f"{zones[entity] if point == ZONE_TEMPERATURE else entity}/{point}" for entity, _, point in names),
            building.location.timezone,
        )
        self.columns = self._layout.columns

    @property
    def finished(self) -> bool:
        """Whether its days are over."""
        return self._done >= self.steps

    def reset(self, seed: int | None = None) -> Measurements:
        """Start anew, as `Plant.reset`."""
        self._done, seen = 0, self.plant.reset(seed)
        for _ in range(self._lead):
            seen = self.plant.step(self.own)
        return self._named(seen)

    def step(self, actions: Mapping[str, float]) -> Measurements:
        """Take a step with what is commanded, its own setpoints for the rest, as `Plant.step`."""
        self._done += 1
        return self._named(self.plant.step(self.own | dict(actions)))

    def _named(self, seen: Measurements) -> Measurements:
        return Measurements(self._layout, seen.seconds, seen.values_array)

    def forecast(self) -> Forecast:
        """Forecast the control steps from now on."""
        table, step = self.plant.forecast().table, pd.Timedelta(seconds=CONTROL_STEP)
        whole = table.iloc[: len(table) // round(CONTROL_STEP / STEP) * round(CONTROL_STEP / STEP)]
        return Forecast(whole.resample(step, closed="right", label="right", origin=whole.index[0] - pd.Timedelta(
            seconds=STEP)).mean())  # fmt: skip

    def record(self) -> PlantRecord:
        """Give the run, as `Plant.record`."""
        return self.plant.record()

    def described(self, name: str, start: str) -> PlantFile:
        """Describe it as a building that is reached otherwise."""
        scenario, actuated = self.plant.scenario, {a.name: [a.lowest, a.highest] for a in self.actuators}
        place = scenario.building.location
        points = set(self.columns)
        zones: dict[str, Any] = {
            zone: {"temperature": f"{zone}/zone_air_temperature_sensor", "floor_area": float(area)}
            for zone, area in zip(scenario.zones, scenario.areas, strict=True)
        }
        content = {
            "format": 1, "name": name, "plant": {"kind": "site"}, "control_step": CONTROL_STEP,
            "location": {"latitude": place.latitude, "longitude": place.longitude, "elevation": place.elevation,
                         "timezone": place.timezone},
            "period": {"start": f"{pd.Timestamp(start):%Y-%m-%d %H:%M}", "days": 1}, "zones": zones,
            "measurements": {column: column for column in self.columns if column not in actuated},
            "actuators": {entity: {"signal": entity, "range": ends} for entity, ends in actuated.items()},
            "prices": {"electricity": 0.0, "gas": 0.0, "currency": scenario.currency},
            "weather": {p: p for p in WEATHER_POINTS if f"{scenario.building.weather_station}/{p}" in points},
            "forecast": {"hours": HORIZON / 3600.0},
        }  # fmt: skip
        return PlantFile.model_validate(content)

    def bought(self) -> pd.DataFrame:
        """Cost of energy [currency], energy [kWh] and discomfort of all zones [K h] by local day."""
        return by_day(self.record(), self.plant.scenario, since=self._lead)
