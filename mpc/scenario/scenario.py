"""All that drives a closed loop from outside, on one grid of steps: a step is a row of arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mpc.errors import ScenarioError
from mpc.scenario.carbon import CarbonIntensity
from mpc.scenario.comfort import ComfortBand
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import OFFICE_AREA_PER_PERSON, Occupancy, ScheduledOccupancy
from mpc.scenario.tariff import DemandBuckets, Tariff
from mpc.scenario.weather import Weather
from thermal._types import FloatArray
from thermal.case.areas import zone_floor_areas
from thermal.case.building import Building, ZoneTable
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.errors import describe, nearest

OCCUPANCY_POINT = "occupancy_count_sensor"


@dataclass(frozen=True, eq=False)
class Scenario:
    """What drives a closed loop, one row a step; made by `build_scenario`.

    Parameters
    ----------
    building : Building
        Which building, and so its zones, in order.
    grid : StepGrid
        Steps.
    areas : ndarray, shape (n_zone,)
        Floor areas [m2].
    weather : Weather
        Means over the steps.
    occupancy, expected_occupancy : ndarray, shape (n_steps, n_zone)
        People as they come, and as a forecast may expect them [-].
    gains, expected_gains : ndarray, shape (n_steps, n_zone)
        Sensible heat of people, light and equipment, into the zone [W]; `radiant_gains` is the part that radiates.
    latent : ndarray, shape (n_steps, n_zone)
        Latent heat of people [W].
    lower, upper : ndarray, shape (n_steps, n_zone)
        Edges of the comfort band [K].
    electricity_price, gas_price : ndarray, shape (n_steps,)
        Prices [currency/kWh].
    electricity_carbon, gas_carbon : ndarray, shape (n_steps,)
        Emissions [kg/kWh].
    demand : tuple of DemandBuckets
        Peaks that cost.
    currency : str
        Of the prices.
    carbon_kind : str
        ``average`` or ``marginal``; empty when emissions are not counted.
    people : Occupancy
        Where the people come from.
    heat : InternalGains
        What they and their equipment give off.
    """

    building: Building
    grid: StepGrid
    areas: FloatArray
    weather: Weather
    occupancy: FloatArray
    expected_occupancy: FloatArray
    gains: FloatArray
    expected_gains: FloatArray
    latent: FloatArray
    lower: FloatArray
    upper: FloatArray
    electricity_price: FloatArray
    gas_price: FloatArray
    electricity_carbon: FloatArray
    gas_carbon: FloatArray
    demand: tuple[DemandBuckets, ...]
    currency: str
    carbon_kind: str
    people: Occupancy
    heat: InternalGains

    def redrawn(self, seed: int) -> Scenario:
        """Let other people come and go, as for the next episode of a training; all else stays.

        Parameters
        ----------
        seed : int
            Same seed, same people at the same times; 0 or more.
        """
        drawn = self.people.draw(self.grid, self.zones, seed)
        gains = self.heat.heat(drawn, self.people.people(self.zones), self.areas)
        return replace(self, occupancy=drawn, gains=gains, latent=self.heat.moisture_heat(drawn))

    @cached_property
    def radiant_gains(self) -> FloatArray:
        """The part of the gains that radiates to the surfaces, shape (n_steps, n_zone) [W]."""
        return self.heat.radiant_heat(self.occupancy, self.people.people(self.zones), self.areas)

    @property
    def zones(self) -> tuple[str, ...]:
        """Names of the zones, in the order of the columns."""
        return self.building.zone_names

    @property
    def outdoor(self) -> FloatArray:
        """Outdoor air temperature, shape (n_steps,) [K]."""
        return self.weather.outdoor

    @cached_property
    def floor_area(self) -> float:
        """Floor area of all zones [m2]."""
        return float(self.areas.sum())


def build_scenario(
    building: Building,
    grid: StepGrid,
    weather: Weather,
    tariff: Tariff,
    *,
    carbon: CarbonIntensity | None = None,
    occupancy: Occupancy | None = None,
    gains: InternalGains | None = None,
    comfort: ComfortBand | Mapping[str, ComfortBand] | None = None,
    seed: int = 0,
) -> Scenario:
    """Put all that drives a closed loop on one grid of steps.

    Parameters
    ----------
    building : Building
        Zones, floor areas and time zone.
    grid : StepGrid
        Steps, long enough for the run and the horizon of its last forecast.
    weather : Weather
        Covers the grid.
    tariff : Tariff
        Prices.
    carbon : CarbonIntensity
        Emissions; default none are counted.
    occupancy : Occupancy
        People; default an office's schedule with one person per 18.58 m2.
    gains : InternalGains
        Heat of people, light and equipment; default an office's.
    comfort : ComfortBand or mapping of str to ComfortBand
        Band of all zones, or of each; default BOPTEST's office band.
    seed : int
        Of the people's coming and going; 0 or more.

    Returns
    -------
    Scenario
        One row a step.

    Raises
    ------
    ScenarioError
        When something does not cover the grid, or a zone has no band.
    """
    zones, areas = building.zone_names, zone_areas(building)
    here = weather.on(grid)
    here.require([OUTDOOR_TEMPERATURE])
    people = occupancy or ScheduledOccupancy(dict(zip(zones, areas / OFFICE_AREA_PER_PERSON, strict=True)))
    heat, assigned = gains or InternalGains(), people.people(zones)
    drawn, expected = people.draw(grid, zones, seed), people.expected(grid, zones)
    bands = [_band(comfort, zone).on(grid) for zone in zones]
    none = np.zeros(grid.n_steps)
    return Scenario(
        building=building,
        grid=grid,
        areas=areas,
        weather=here,
        occupancy=drawn,
        expected_occupancy=expected,
        gains=heat.heat(drawn, assigned, areas),
        expected_gains=heat.heat(expected, assigned, areas),
        latent=heat.moisture_heat(drawn),
        lower=np.column_stack([band[0] for band in bands]),
        upper=np.column_stack([band[1] for band in bands]),
        electricity_price=tariff.electricity.on(grid),
        gas_price=tariff.gas.on(grid),
        electricity_carbon=none if carbon is None else carbon.electricity.on(grid),
        gas_carbon=none if carbon is None else carbon.gas.on(grid),
        demand=tuple(charge.on(grid) for charge in tariff.demand),
        currency=tariff.currency,
        carbon_kind="" if carbon is None else carbon.kind,
        people=people,
        heat=heat,
    )


def zone_areas(building: Building) -> FloatArray:
    """Floor area of each zone, shape (n_zone,) [m2].

    Parameters
    ----------
    building : Building
        With floor plans or a zone table.
    """
    if isinstance(building.geometry, ZoneTable):
        return np.array([zone.floor_area for zone in building.geometry.zones], dtype=float)
    areas = zone_floor_areas(building.geometry)
    return np.array([areas[zone] for zone in building.zone_names], dtype=float)


def _band(comfort: ComfortBand | Mapping[str, ComfortBand] | None, zone: str) -> ComfortBand:
    if not isinstance(comfort, Mapping):
        return comfort or ComfortBand()
    if zone not in comfort:
        raise ScenarioError(describe("comfort", f"a band of zone {zone!r}", "none", nearest(zone, comfort)))
    return comfort[zone]
