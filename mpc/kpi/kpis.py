"""Key performance indicators of a closed loop: BOPTEST's names and formulas, and those that users register."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from mpc.errors import MpcError
from mpc.kpi.record import PlantRecord, excess
from mpc.scenario.rates import HOUR, KILOWATT_HOUR
from mpc.scenario.scenario import Scenario
from mpc.scenario.tariff import window_means
from thermal._types import FloatArray, IntArray

#: Length of the mean whose highest value is a peak [s], as in BOPTEST.
PEAK_WINDOW = 900.0


@dataclass(frozen=True)
class ZoneComfort:
    """Comfort of a zone over a run.

    Parameters
    ----------
    zone : str
        Name.
    below, above : float
        Integral of what its temperature lacks or exceeds of the band [K h].
    occupied_below, occupied_above : float
        The same while people are in [K h].
    largest_below, largest_above : float
        Largest lack and excess at any time [K].
    occupied_hours, occupied_hours_outside : float
        Time that people were in, and the part of it out of the band [h].
    """

    zone: str
    below: float
    above: float
    occupied_below: float
    occupied_above: float
    largest_below: float
    largest_above: float
    occupied_hours: float
    occupied_hours_outside: float


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """A run as indicators see it: what the plant did, and the scenario in which it did so.

    Parameters
    ----------
    record : PlantRecord
        Of whole steps of the scenario, in one or more steps of the plant each.
    scenario : Scenario
        Bands, prices, emissions and people.
    first_step : int
        Step of the scenario in which the run began.
    co2_limit : float
        Upper limit of carbon dioxide as a share of volume, such as 1e-3 [-]; needed where the plant simulates it.
    control_step : float
        Time between actions [s]; default the scenario's step.

    Raises
    ------
    MpcError
        When the record does not fit the scenario, or a limit or price is needed.
    """

    record: PlantRecord
    scenario: Scenario
    first_step: int = 0
    co2_limit: float | None = None
    control_step: float | None = None

    def __post_init__(self) -> None:
        record, grid, counted = self.record, self.scenario.grid, bool(self.scenario.carbon_kind)
        each = float(grid.step / record.step)
        steps = float(record.n_steps / each)
        whole, found = each >= 1 and each.is_integer() and steps.is_integer(), f"{record.n_steps} of {record.step:g} s"
        MpcError.unless(whole, "record: steps", f"whole steps of {grid.step:g} s of the scenario", found)
        first, last, zones = self.first_step, self.first_step + steps, len(self.scenario.zones)
        within = first >= 0 and last <= grid.n_steps
        MpcError.unless(within, "record", f"steps within the scenario's {grid.n_steps}", f"{first} to {last:g}")
        found = f"{record.zone_temperature.shape[1]}"
        MpcError.unless(found == f"{zones}", "record: zone_temperature", f"{zones} zones", found)
        price, carbon = self.scenario.district_price, self.scenario.district_carbon
        known = record.district_heating is None or (price is not None and (not counted or carbon is not None))
        MpcError.unless(known, "district heating", "its price, and its emissions where they count", "none")
        limited = record.co2 is None or 0 < (self.co2_limit or 0.0) < 1
        MpcError.unless(limited, "co2_limit", "a share of volume, such as 1e-3", self.co2_limit)

    @cached_property
    def rows(self) -> IntArray:
        """Row of the scenario that each step of the plant lies in, shape (n,)."""
        return self.first_step + np.arange(self.record.n_steps) // int(self.scenario.grid.step / self.record.step)

    @cached_property
    def zones(self) -> tuple[ZoneComfort, ...]:
        """Comfort of each zone."""
        start, end = self.record.zone_temperature[:-1], self.record.zone_temperature[1:]
        lower, upper = self.scenario.lower[self.rows], self.scenario.upper[self.rows]
        occupied, hours = self.scenario.occupancy[self.rows] > 0.0, self.record.step / HOUR
        sides = [(lower - start, lower - end), (start - upper, end - upper)]
        means, shares = zip(*(excess(*ends) for ends in sides), strict=True)
        columns = [mean.sum(0) * hours for mean in means]
        columns += [(mean * occupied).sum(0) * hours for mean in means]
        columns += [np.maximum(np.maximum(*ends).max(0), 0.0) for ends in sides]
        columns += [occupied.sum(0) * hours, sum((share * occupied).sum(0) * hours for share in shares)]
        rows = zip(self.scenario.zones, np.array(columns).T.tolist(), strict=True)
        return tuple(ZoneComfort(zone, *row) for zone, row in rows)

    def energy(
        self, electricity: FloatArray | float, gas: FloatArray | float, district: FloatArray | float | None
    ) -> float:
        """Energy over the run, each carrier times a factor per kilowatt-hour, per floor area [unit of the factor/m2].

        Parameters
        ----------
        electricity, gas : float or ndarray, shape (n,)
            Factor [1/kWh], the same always or of each step.
        district : float, ndarray, shape (n,), or None
            That of district heating [1/kWh]; counted where the plant has it.
        """
        powers = (self.record.electricity, self.record.gas, self.record.district_heating)
        factors = (np.asarray(factor, dtype=float) for factor in (electricity, gas, district))
        terms = zip(powers, factors, strict=True)
        total = sum(float(np.sum(power * factor)) for power, factor in terms if power is not None)
        return total * self.record.step / KILOWATT_HOUR / self.scenario.floor_area

    def peak(self, power: FloatArray | None) -> float | None:
        """Highest mean over a quarter of an hour, per floor area [kW/m2]; None for a plant without.

        Parameters
        ----------
        power : ndarray, shape (n,), or None
            Means over the steps [W].
        """
        if power is None:
            return None
        starts = self.scenario.grid.edges[self.first_step] + np.arange(self.record.n_steps) * self.record.step
        means, _ = window_means(power, starts, self.record.step, PEAK_WINDOW)
        return float(means.max() / 1000.0) / self.scenario.floor_area


class Indicator(NamedTuple):
    """An indicator as it is registered.

    Parameters
    ----------
    function : callable
        Called as ``function(run)`` with a `MeasuredRun`; gives a number, or None for what a plant does not have.
    unit : str
        Of the number; ``currency`` stands for that of the run.
    description : str
        What it says, for reports.
    """

    function: Callable[[MeasuredRun], float | None]
    unit: str
    description: str


def _comfort(run: MeasuredRun) -> float:
    return float(np.mean([zone.below + zone.above for zone in run.zones]))


def _air(run: MeasuredRun) -> float | None:
    co2, limit = run.record.co2, run.co2_limit
    if co2 is None or limit is None:
        return None
    mean, _ = excess(co2[:-1] - limit, co2[1:] - limit)
    return float(mean.sum(0).mean() * run.record.step / HOUR * 1e6)


def _cost(run: MeasuredRun) -> float:
    scenario = run.scenario
    return _weighed(run, scenario.electricity_price, scenario.gas_price, scenario.district_price)


def _emissions(run: MeasuredRun) -> float | None:
    scenario = run.scenario
    carbons = scenario.electricity_carbon, scenario.gas_carbon, scenario.district_carbon
    return _weighed(run, *carbons) if scenario.carbon_kind else None


def _weighed(run: MeasuredRun, electricity: FloatArray, gas: FloatArray, district: FloatArray | None) -> float:
    """Energy of a run by factors on the steps of its scenario, see `MeasuredRun.energy`."""
    rows = run.rows
    return run.energy(electricity[rows], gas[rows], None if district is None else district[rows])


def _time_ratio(run: MeasuredRun) -> float | None:
    seconds, between = run.record.controller_seconds, run.control_step
    if seconds is None or not len(seconds):
        return None
    return float(np.mean(seconds)) / (run.scenario.grid.step if between is None else between)


def _demand(run: MeasuredRun) -> float:
    power, step = run.record.electricity, run.record.step
    return sum(c.cost(power, step, run.first_step) for c in run.scenario.demand) / run.scenario.floor_area


#: Every indicator by name: BOPTEST's, demand charges, then those of users.
KPIS: dict[str, Indicator] = {
    "tdis_tot": Indicator(_comfort, "K h", "thermal discomfort, mean of the zones"),
    "idis_tot": Indicator(_air, "ppm h", "discomfort of indoor air, mean of the zones"),
    "ener_tot": Indicator(lambda run: run.energy(1.0, 1.0, 1.0), "kWh/m2", "energy"),
    "cost_tot": Indicator(_cost, "currency/m2", "cost of energy, demand charges apart"),
    "emis_tot": Indicator(_emissions, "kg/m2", "emissions"),
    "pele_tot": Indicator(lambda run: run.peak(run.record.electricity), "kW/m2", "peak of electricity"),
    "pgas_tot": Indicator(lambda run: run.peak(run.record.gas), "kW/m2", "peak of gas"),
    "pdih_tot": Indicator(lambda run: run.peak(run.record.district_heating), "kW/m2", "peak of district heating"),
    "time_rat": Indicator(_time_ratio, "-", "time that the controller took over the time between actions"),
    "demand_cost": Indicator(_demand, "currency/m2", "demand charges"),
}


def register_kpi(name: str, function: Callable[[MeasuredRun], float | None], unit: str, description: str) -> None:
    """Have an indicator measured with every run: `measure_kpis`, comparisons and reports show it beside BOPTEST's.

    Parameters
    ----------
    name : str
        A valid name that no other indicator has; the same function may be registered again.
    function : callable
        Called as ``function(run)`` with a `MeasuredRun`; gives a number, or None for what a plant does not have.
    unit : str
        Of the number; ``currency`` stands for that of the run.
    description : str
        What it says, for reports.

    Raises
    ------
    MpcError
        When the name is taken or none.

    Examples
    --------
    >>> def warmest(run):
    ...     return float(run.record.zone_temperature.max())
    >>> register_kpi("warmest_zone", warmest, "K", "highest temperature of any zone")
    >>> KPIS.pop("warmest_zone").unit
    'K'
    """
    taken = name in Kpis.__dataclass_fields__ or (name in KPIS and KPIS[name].function is not function)
    MpcError.unless(name.isidentifier() and not taken, "indicator", f"a name beside {', '.join(KPIS)}", repr(name))
    KPIS[name] = Indicator(function, unit, description)


@dataclass(frozen=True, repr=False)
class Kpis:
    """Indicators of a run, per floor area of the building where BOPTEST has them so.

    Parameters
    ----------
    tdis_tot : float
        Thermal discomfort, mean of the zones [K h].
    idis_tot : float or None
        Discomfort of indoor air, mean of the zones [ppm h]; None where carbon dioxide was not simulated.
    ener_tot : float
        Energy [kWh/m2].
    cost_tot : float
        Its cost [currency/m2], demand charges apart.
    emis_tot : float or None
        Its emissions [kg/m2]; None when the scenario does not count them.
    pele_tot, pgas_tot, pdih_tot : float or None
        Highest mean over a quarter of an hour of electricity, gas and district heating [kW/m2]; None for a plant
        without.
    time_rat : float or None
        Mean time that the controller took for an action over the time between actions [-]; None when not measured.
    demand_cost : float
        Demand charges, each peak as if it were that of its whole month [currency/m2]. BOPTEST has none.
    currency, carbon_kind : str
        Of the costs; whether emissions are ``average`` or ``marginal``.
    floor_area : float
        Of the zones [m2].
    hours : float
        Length of the run [h].
    zones : tuple of ZoneComfort
        One a zone.
    own : mapping of str to float or None
        What users have registered by `register_kpi` [its unit].
    """

    tdis_tot: float
    idis_tot: float | None
    ener_tot: float
    cost_tot: float
    emis_tot: float | None
    pele_tot: float | None
    pgas_tot: float | None
    pdih_tot: float | None
    time_rat: float | None
    demand_cost: float
    currency: str
    carbon_kind: str
    floor_area: float
    hours: float
    zones: tuple[ZoneComfort, ...]
    own: Mapping[str, float | None] = field(default_factory=dict)

    @property
    def values(self) -> dict[str, float | None]:
        """Every indicator by name: BOPTEST's, then those of users [its unit]."""
        return {name: getattr(self, name) for name in KPIS if name in vars(self)} | dict(self.own)

    def to_dict(self) -> dict[str, Any]:
        """Give the indicators as plain types, for JSON; zones by name."""
        plain = asdict(self)
        plain["zones"] = {zone.pop("zone"): zone for zone in plain["zones"]}
        return plain | dict(plain.pop("own"))

    def to_frame(self) -> pd.DataFrame:
        """Table of the indicators by name, with unit and description."""
        rows = [(value, KPIS[name].unit.replace("currency", self.currency), KPIS[name].description)
                for name, value in self.values.items()]  # fmt: skip
        index = pd.Index(list(self.values), name="indicator")
        return pd.DataFrame(rows, columns=["value", "unit", "description"], index=index)

    def __repr__(self) -> str:
        known = ", ".join(f"{name}={value:.4g}" for name, value in self.values.items() if value is not None)
        return f"Kpis({self.hours:g} h, {known})"


def measure_kpis(
    record: PlantRecord,
    scenario: Scenario,
    *,
    first_step: int = 0,
    co2_limit: float | None = None,
    control_step: float | None = None,
) -> Kpis:
    """Measure a run on the plant's own steps.

    Integrals are exact for what the plant says: powers are constant over its steps, temperatures straight lines
    between their edges. So they do not depend on where a step is cut in two. BOPTEST (Blum et al. 2021,
    doi:10.1080/19401493.2021.1986574) takes trapezoids of values every 30 s, which tend to the same as that time
    shrinks.

    Parameters
    ----------
    record : PlantRecord
        Of whole steps of the scenario, in one or more steps of the plant each.
    scenario : Scenario
        Bands, prices, emissions and people.
    first_step : int
        Step of the scenario in which the run began.
    co2_limit : float
        Upper limit of carbon dioxide as a share of volume, such as 1e-3 [-]; needed where the plant simulates it.
    control_step : float
        Time between actions [s]; default the scenario's step.

    Returns
    -------
    Kpis
        Indicators.

    Raises
    ------
    MpcError
        When the record does not fit the scenario, or a limit or price is needed.
    """
    run = MeasuredRun(record, scenario, first_step, co2_limit, control_step)
    values: dict[str, Any] = {name: indicator.function(run) for name, indicator in KPIS.items()}
    own = {name: values.pop(name) for name in tuple(values) if name not in Kpis.__dataclass_fields__}
    return Kpis(
        **values, currency=scenario.currency, carbon_kind=scenario.carbon_kind, floor_area=scenario.floor_area,
        hours=record.n_steps * record.step / HOUR, zones=run.zones, own=own,
    )  # fmt: skip
