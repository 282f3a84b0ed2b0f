"""Key performance indicators of a closed loop, under BOPTEST's names and formulas."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mpc.errors import MpcError
from mpc.kpi.record import PlantRecord
from mpc.scenario.rates import KILOWATT_HOUR
from mpc.scenario.scenario import Scenario
from mpc.scenario.tariff import window_means
from thermal._types import FloatArray
from thermal.errors import describe


def excess(start: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of the positive part of a straight line over a step, and the share of the step in which it is positive.

    With a⁺ and b⁺ the positive parts of the ends, the line is positive over the share ``(a⁺ - b⁺) / (a - b)``, and its
    positive part has the mean ``(a⁺ + b⁺) / 2`` times that share. So a step in two halves gives the same integral as
    the whole, which the trapezoid of clipped values does not.

    Parameters
    ----------
    start, end : ndarray
        Excess over a limit at the ends of each step, negative within it [any].

    Returns
    -------
    mean : ndarray
        0 or more [as given].
    share : ndarray
        0 to 1 [-].
    """
    first, last, span = np.maximum(start, 0.0), np.maximum(end, 0.0), start - end
    share = np.divide(first - last, span, out=(first > 0.0).astype(float), where=span != 0.0)
    return 0.5 * (first + last) * share, share


#: Length of the mean whose highest value is a peak [s], as in BOPTEST.
PEAK_WINDOW = 900.0

_HOUR = 3600.0  # s


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


@dataclass(frozen=True)
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

    def to_dict(self) -> dict[str, Any]:
        """Give the indicators as plain types, for JSON; zones by name."""
        plain = asdict(self)
        plain["zones"] = {zone.pop("zone"): zone for zone in plain["zones"]}
        return plain


def measure_kpis(
    record: PlantRecord,
    scenario: Scenario,
    *,
    first_step: int = 0,
    co2_limit: float | None = None,
    district_price: float | None = None,
    district_carbon: float | None = None,
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
    district_price, district_carbon : float
        Price [currency/kWh] and emissions [kg/kWh] of district heating; needed where the plant has it.
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
    rows = _rows(record, scenario, first_step)
    comfort = _comfort(record, scenario, rows)
    powers = {"electricity": record.electricity, "gas": record.gas, "district heating": record.district_heating}
    area = scenario.floor_area
    peaks = [None if power is None else _peak(power, record, scenario, first_step) / area for power in powers.values()]
    prices = (scenario.electricity_price[rows], scenario.gas_price[rows], district_price)
    carbons = (scenario.electricity_carbon[rows], scenario.gas_carbon[rows], district_carbon)
    counted = bool(scenario.carbon_kind)
    if record.district_heating is not None and (district_price is None or (counted and district_carbon is None)):
        raise MpcError(describe("district heating", "its price, and its emissions where they count", "none"))
    energy = sum(float(power.sum()) for power in powers.values() if power is not None) * record.step / KILOWATT_HOUR
    seconds = record.controller_seconds
    between = scenario.grid.step if control_step is None else control_step
    return Kpis(
        tdis_tot=float(np.mean([zone.below + zone.above for zone in comfort])),
        idis_tot=None if record.co2 is None else _air_discomfort(record, co2_limit),
        ener_tot=energy / area,
        cost_tot=_weighed(powers.values(), prices, record.step) / area,
        emis_tot=_weighed(powers.values(), carbons, record.step) / area if counted else None,
        pele_tot=peaks[0],
        pgas_tot=peaks[1],
        pdih_tot=peaks[2],
        time_rat=None if seconds is None or not len(seconds) else float(np.mean(seconds)) / between,
        demand_cost=sum(charge.cost(record.electricity, record.step, first_step) for charge in scenario.demand) / area,
        currency=scenario.currency,
        carbon_kind=scenario.carbon_kind,
        floor_area=area,
        hours=record.n_steps * record.step / _HOUR,
        zones=comfort,
    )


def _rows(record: PlantRecord, scenario: Scenario, first_step: int) -> NDArray[np.int64]:
    """Row of the scenario that each step of the plant lies in."""
    each = scenario.grid.step / record.step
    steps = record.n_steps / each
    if not (each >= 1 and float(each).is_integer() and float(steps).is_integer()):
        expected = f"whole steps of {scenario.grid.step:g} s of the scenario"
        raise MpcError(describe("record", expected, f"{record.n_steps} steps of {record.step:g} s"))
    if first_step < 0 or first_step + steps > scenario.grid.n_steps:
        expected = f"steps within the scenario's {scenario.grid.n_steps}"
        raise MpcError(describe("record", expected, f"{first_step} to {first_step + steps:g}"))
    if record.zone_temperature.shape[1] != len(scenario.zones):
        found = f"{record.zone_temperature.shape[1]}"
        raise MpcError(describe("record: zone_temperature", f"{len(scenario.zones)} zones", found))
    return first_step + np.arange(record.n_steps) // int(each)


def _comfort(record: PlantRecord, scenario: Scenario, rows: NDArray[np.int64]) -> tuple[ZoneComfort, ...]:
    start, end = record.zone_temperature[:-1], record.zone_temperature[1:]
    lower, upper, occupied = scenario.lower[rows], scenario.upper[rows], scenario.occupancy[rows] > 0.0
    sides = [(lower - start, lower - end), (start - upper, end - upper)]
    hours = record.step / _HOUR
    columns: list[FloatArray] = []
    outside = np.zeros(len(scenario.zones))
    for first, last in sides:
        mean, share = excess(first, last)
        columns.append(np.stack([mean.sum(0), (mean * occupied).sum(0)]) * hours)
        columns.append(np.maximum(np.maximum(first, last).max(0), 0.0)[None])
        outside += (share * occupied).sum(0) * hours
    (below, below_in), (least,), (above, above_in), (most,) = columns
    time_in = occupied.sum(0) * hours
    table = np.stack([below, above, below_in, above_in, least, most, time_in, outside], axis=1)
    return tuple(ZoneComfort(zone, *map(float, row)) for zone, row in zip(scenario.zones, table, strict=True))


def _air_discomfort(record: PlantRecord, limit: float | None) -> float:
    if limit is None or record.co2 is None or not 0 < limit < 1:
        raise MpcError(describe("co2_limit", "a share of volume, such as 1e-3", repr(limit)))
    mean, _ = excess(record.co2[:-1] - limit, record.co2[1:] - limit)
    return float(mean.sum(0).mean() * record.step / _HOUR * 1e6)


def _weighed(powers: Any, factors: Any, step: float) -> float:
    """Sum of energies times their price or emission, powers that are not there left out."""
    terms = (float(np.sum(power * factor)) for power, factor in zip(powers, factors, strict=True) if power is not None)
    return sum(terms) * step / KILOWATT_HOUR


def _peak(power: FloatArray, record: PlantRecord, scenario: Scenario, first_step: int) -> float:
    """Highest mean over a quarter of an hour [kW]."""
    starts = scenario.grid.edges[first_step] + np.arange(record.n_steps) * record.step
    return float(window_means(power, starts, record.step, PEAK_WINDOW)[0].max() / 1000.0)
