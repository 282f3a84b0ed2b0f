"""What a served building forecasts, under BOPTEST's names of boundary conditions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mpc.adapters.boptest.case import BoptestCase
from mpc.adapters.boptest.prices import PRICE_POINTS
from mpc.adapters.boptest.signals import Metadata
from mpc.scenario.forecast import ErrorGrowth
from mpc.scenario.rates import Rate
from mpc.scenario.scenario import Scenario
from thermal._types import FloatArray

#: BOPTEST's names of weather, with unit, point of the case format, factor from the library's unit, and meaning.
WEATHER_NAMES: Mapping[str, tuple[str, str, float, str]] = {
    "TDryBul": ("K", "outside_air_temperature_sensor", 1.0, "Outdoor air temperature"),
    "HGloHor": ("W/m2", "global_horizontal_irradiance_sensor", 1.0, "Global irradiance on the horizontal"),
    "HDirNor": ("W/m2", "direct_normal_irradiance_sensor", 1.0, "Direct normal irradiance"),
    "HDifHor": ("W/m2", "diffuse_horizontal_irradiance_sensor", 1.0, "Diffuse irradiance on the horizontal"),
    "HHorIR": ("W/m2", "horizontal_infrared_irradiance_sensor", 1.0, "Infrared irradiance from the sky"),
    "winSpe": ("m/s", "wind_speed_sensor", 1.0, "Wind speed"),
    "winDir": ("rad", "wind_direction_sensor", float(np.pi / 180.0), "Direction that the wind comes from"),
}

#: BOPTEST's names of what each zone has, with unit and meaning; a point is ``name[zone]``.
ZONE_NAMES: Mapping[str, tuple[str, str]] = {
    "LowerSetp": ("K", "Lower edge of the comfort band"),
    "UpperSetp": ("K", "Upper edge of the comfort band"),
    "Occupancy": ("number of people", "People expected"),
    "InternalGainsCon": ("W", "Expected sensible heat of people, light and equipment into the air"),
    "InternalGainsLat": ("W", "Expected latent heat of people"),
}

# Irradiances, and what `thermal.inputs.Sun` calls them.
_SUN = {
    "global_horizontal_irradiance_sensor": "horizontal",
    "direct_normal_irradiance_sensor": "normal",
    "diffuse_horizontal_irradiance_sensor": "diffuse",
}

#: Levels of ``temperature_uncertainty`` and ``solar_uncertainty``: the deviation at long leads as a share of that of
#: day-ahead weather prediction, assumed [-].
UNCERTAINTY: Mapping[str, float] = {"low": 0.5, "medium": 1.0, "high": 1.5}
_STREAM = 22  # of random numbers of a seed
_GROWTH = {"temperature": ErrorGrowth(2.0, 24 * 3600.0), "sun": ErrorGrowth(0.3, 6 * 3600.0)}


def forecast_metadata(case: BoptestCase) -> Metadata:
    """Describe each forecast point with its unit, as `GET /forecast_points` does.

    Parameters
    ----------
    case : BoptestCase
        What is served.
    """
    per_kwh = f"{case.tariff.currency}/kWh"
    known = set(case.weather_points)
    if "global_horizontal_irradiance_sensor" in known or known >= {*_SUN} - {"global_horizontal_irradiance_sensor"}:
        known |= {*_SUN}  # any two give the third, and the global one alone is split
    rows: dict[str, tuple[str, str]] = {
        name: (unit, f"{text}, mean from the time on")
        for name, (unit, point, _, text) in WEATHER_NAMES.items()
        if point in known
    }
    for kind, name in PRICE_POINTS.items():
        rows[name] = (per_kwh, f"Price of electricity, {kind.replace('_', ' ')}")
    rows["PriceGasPower"] = (per_kwh, "Price of gas by its upper heating value")
    rows["EmissionsElectricPower"] = ("kgCO2/kWh", f"Emissions of electricity, {case.carbon.kind}")
    rows["EmissionsGasPower"] = ("kgCO2/kWh", "Emissions of gas")
    for name, (unit, text) in ZONE_NAMES.items():
        rows |= {f"{name}[{zone}]": (unit, f"{text}, zone {zone}") for zone in case.building.zone_names}
    return {name: {"Unit": unit, "Description": text} for name, (unit, text) in rows.items()}


class BoundaryConditions:
    """Boundary conditions of a test's scenario, step by step.

    Parameters
    ----------
    scenario : Scenario
        That drives the plant.
    prices : mapping of str to Rate
        Of the scenarios.
    """

    def __init__(self, scenario: Scenario, prices: Mapping[str, Rate]) -> None:
        self._scenario, grid = scenario, scenario.grid
        self.prices = {kind: np.asarray(rate.on(grid), dtype=float) for kind, rate in prices.items()}
        self._zone = {zone: k for k, zone in enumerate(scenario.zones)}
        self._single = {PRICE_POINTS[kind]: values for kind, values in self.prices.items()} | {
            "PriceGasPower": scenario.gas_price,
            "EmissionsElectricPower": scenario.electricity_carbon,
            "EmissionsGasPower": scenario.gas_carbon,
        }
        self._latent = scenario.heat.moisture_heat(scenario.expected_occupancy)

    def series(self, name: str) -> FloatArray:
        """Values over the steps of the scenario, shape (n_steps,) [unit of the point].

        Parameters
        ----------
        name : str
            A forecast point of the case.
        """
        if name in self._single:
            return self._single[name]
        if name in WEATHER_NAMES:
            _, point, factor, _ = WEATHER_NAMES[name]
            weather = self._scenario.weather
            if point in _SUN and point not in weather.frame:
                return np.asarray(getattr(weather.sun, _SUN[point]), dtype=float)
            return factor * weather.values(point)
        kind, _, zone = name.removesuffix("]").partition("[")
        s = self._scenario
        table: Any = {
            "LowerSetp": s.lower,
            "UpperSetp": s.upper,
            "Occupancy": s.expected_occupancy,
            "InternalGainsCon": s.expected_gains,
            "InternalGainsLat": self._latent,
        }[kind]
        return np.asarray(table[:, self._zone[zone]], dtype=float)

    def rows(self, seconds: FloatArray) -> tuple[NDArray[np.int64], bool]:
        """Find the steps that hold at some times; beyond the scenario those of the same hour of its last day.

        Parameters
        ----------
        seconds : ndarray, shape (n,)
            Since 1970 in UTC [s].

        Returns
        -------
        tuple
            Numbers of the steps, shape (n,), and whether any lies beyond the scenario.
        """
        grid = self._scenario.grid
        numbers = np.floor((seconds - grid.edges[0]) / grid.step + 1e-9).astype(np.int64)
        day = min(round(86_400.0 / grid.step), grid.n_steps)
        late = numbers >= grid.n_steps
        beyond = numbers[late] - grid.n_steps
        numbers[late] = grid.n_steps - day + beyond % day
        return numbers, bool(late.any())


def uncertain(name: str, values: FloatArray, level: str, seed: tuple[int, ...], interval: float) -> FloatArray:
    """Add the errors of an uncertain forecast of temperature or sun.

    Parameters
    ----------
    name : str
        ``TDryBul`` or ``HGloHor``; others pass unchanged.
    values : ndarray, shape (n,)
        The truth, from now on [unit of the point].
    level : str
        A key of `UNCERTAINTY`.
    seed : tuple of int
        Of the errors.
    interval : float
        Time between values [s].
    """
    if name == "TDryBul":
        return values + UNCERTAINTY[level] * _path("temperature", seed, values.size, interval)
    if name == "HGloHor":
        return values * np.maximum(1.0 + UNCERTAINTY[level] * _path("sun", seed, values.size, interval), 0.0)
    return values


def _path(kind: str, seed: tuple[int, ...], count: int, interval: float) -> FloatArray:
    rng = np.random.default_rng([_STREAM, len(kind), *seed])
    later = _GROWTH[kind].path(rng, max(count - 1, 0), interval)
    return np.concatenate([[0.0], later])[:count]
