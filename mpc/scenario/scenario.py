"""All that drives a closed loop from outside, on one grid of steps: a step is a row of arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from calibration.estimation.disturbance import DisturbanceModel
from mpc.errors import ScenarioError
from mpc.scenario.gains import InternalGains
from mpc.scenario.grid import StepGrid
from mpc.scenario.occupancy import OFFICE_AREA_PER_PERSON, ComfortBand, Occupancy, ScheduledOccupancy
from mpc.scenario.rates import ConstantRate
from mpc.scenario.tariff import CarbonIntensity, DemandBuckets, Tariff
from mpc.scenario.weather import Weather
from thermal._types import FloatArray
from thermal.case.building import Building, ZoneTable
from thermal.case.plan import zone_floor_areas
from thermal.case.points import OUTDOOR_TEMPERATURE
from thermal.errors import nearest

OCCUPANCY_POINT = "occupancy_count_sensor"


@dataclass(frozen=True, eq=False, repr=False)
class Scenario:
    """What drives a closed loop, one row a step; made by `build_scenario`.

    Parameters
    ----------
    building : Building
        Which building, and so its zones, in order.
    grid : StepGrid
        Steps.
    areas, assigned : ndarray, shape (n_zone,)
        Floor areas [m2], and people that belong to the zones [-].
    weather : Weather
        Means over the steps.
    occupancy, expected_occupancy : ndarray, shape (n_steps, n_zone)
        People as they come, and as a forecast may expect them [-].
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
    unmeasured : DisturbanceModel or ndarray, shape (n_steps, n_zone), optional
        Heat in the zones that nobody measures or foresees, drawn or as it was [W]; none by default.
    seed : int
        Of that heat.
    district_price, district_carbon : ndarray, shape (n_steps,), optional
        Price [currency/kWh] and emissions [kg/kWh] of district heating; needed where the plant has it.
    """

    building: Building
    grid: StepGrid
    areas: FloatArray
    assigned: FloatArray
    weather: Weather
    occupancy: FloatArray
    expected_occupancy: FloatArray
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
    unmeasured: DisturbanceModel | FloatArray | None = None
    seed: int = 0
    district_price: FloatArray | None = None
    district_carbon: FloatArray | None = None

    def redrawn(self, seed: int) -> Scenario:
        """Let other people and unmeasured heat come and go, as for the next episode of a training; all else stays.

        Parameters
        ----------
        seed : int
            Same seed, same people at the same times; 0 or more.
        """
        return replace(self, occupancy=self.people.draw(self.grid, self.zones, seed), seed=seed)

    @cached_property
    def gains(self) -> FloatArray:
        """Sensible heat of people, light and equipment into the zones, and unmeasured heat, (n_steps, n_zone) [W]."""
        heat = self.heat.heat(self.occupancy, self.assigned, self.areas)
        if self.unmeasured is None:
            return heat
        if not isinstance(self.unmeasured, DisturbanceModel):
            return np.asarray(heat + self.unmeasured)
        rng = np.random.default_rng((self.seed, len("unmeasured")))  # another stream than that of the people
        n_steps, n_zone = heat.shape
        return np.asarray(heat + self.unmeasured.drawn(self.grid.step, n_steps, n_zone, rng))

    @cached_property
    def expected_gains(self) -> FloatArray:
        """Gains of the people that may be expected, shape (n_steps, n_zone) [W]."""
        return self.heat.heat(self.expected_occupancy, self.assigned, self.areas)

    @cached_property
    def radiant_gains(self) -> FloatArray:
        """Part of the gains that radiates to the surfaces, shape (n_steps, n_zone) [W]."""
        return self.heat.heat(self.occupancy, self.assigned, self.areas, radiant=True)

    @property
    def latent(self) -> FloatArray:
        """Latent heat of people, shape (n_steps, n_zone) [W]."""
        return self.heat.moisture_heat(self.occupancy)

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

    def to_frame(self, expected: bool = False) -> pd.DataFrame:
        """Table of all that drives the loop, one row a step, columns and units as those of a `Forecast`.

        Parameters
        ----------
        expected : bool
            Whether people and gains are those that a forecast may expect, rather than those that come.
        """
        columns = {str(point): self.weather.frame[point].to_numpy(dtype=float) for point in self.weather.frame}
        columns |= {
            "electricity_price": self.electricity_price,
            "gas_price": self.gas_price,
            "electricity_carbon_intensity": self.electricity_carbon,
            "gas_carbon_intensity": self.gas_carbon,
        }
        district = {"price": self.district_price, "carbon_intensity": self.district_carbon}
        columns |= {f"district_heating_{name}": values for name, values in district.items() if values is not None}
        of_zones = {
            OCCUPANCY_POINT: self.expected_occupancy if expected else self.occupancy,
            "internal_gain": self.expected_gains if expected else self.gains,
            "comfort_lower_temperature": self.lower,
            "comfort_upper_temperature": self.upper,
        }
        for name, values in of_zones.items():
            columns |= {f"{zone}/{name}": values[:, i] for i, zone in enumerate(self.zones)}
        return pd.DataFrame(columns, index=self.grid.stamps)

    def __repr__(self) -> str:
        return f"Scenario({len(self.zones)} zones, {self.floor_area:g} m2, {self.grid!r})"


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

    Returns
    -------
    Scenario
        One row a step; people come and go by seed 0, other people with `Scenario.redrawn`.

    Raises
    ------
    ScenarioError
        When something does not cover the grid, or a zone has no band.
    """
    zones, areas = building.zone_names, zone_areas(building)
    here = weather.on(grid)
    here.require([OUTDOOR_TEMPERATURE])
    people = occupancy or ScheduledOccupancy(dict(zip(zones, areas / OFFICE_AREA_PER_PERSON, strict=True)))
    bands = [_band(comfort, zone).on(grid) for zone in zones]
    emitted = carbon or CarbonIntensity(ConstantRate(0.0), "average", ConstantRate(0.0))
    district = [None if rate is None else rate.on(grid) for rate in (tariff.district_heating, emitted.district_heating)]
    return Scenario(
        building, grid, areas, people.people(zones), here,
        occupancy=people.draw(grid, zones, 0), expected_occupancy=people.expected(grid, zones),
        lower=np.column_stack([band[0] for band in bands]), upper=np.column_stack([band[1] for band in bands]),
        electricity_price=tariff.electricity.on(grid), gas_price=tariff.gas.on(grid),
        electricity_carbon=emitted.electricity.on(grid), gas_carbon=emitted.gas.on(grid),
        demand=tuple(charge.on(grid) for charge in tariff.demand), currency=tariff.currency,
        carbon_kind=carbon.kind if carbon else "", people=people, heat=gains or InternalGains(),
        district_price=district[0], district_carbon=district[1],
    )  # fmt: skip


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
    ScenarioError.unless(zone in comfort, "comfort", f"a band of zone {zone!r}", "none", nearest(zone, comfort))
    return comfort[zone]
