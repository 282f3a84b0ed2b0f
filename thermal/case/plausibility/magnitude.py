"""Flows, heat and rates against the size of the building: what no building has is a wrong unit, or a wrong column."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from thermal.case.case import Case
from thermal.case.plan import zone_sizes
from thermal.case.plausibility.anomaly import Anomaly, Certainty, Severity
from thermal.case.points import OUTDOOR_TEMPERATURE, SUPPLY_FLOW, ZONE_TEMPERATURE
from thermal.errors import some_of
from thermal.units import AIR_HEAT_CAPACITY, air_density

#: Air changes of a zone by its supply air, 1 % of the time exceeded [1/h]: offices have 2 to 10, operating theatres
#: 20 to 30, clean rooms 60 and more (ASHRAE Applications 2019, ch. 19); 100 is no building that is calibrated here.
UNUSUAL_CHANGES, IMPOSSIBLE_CHANGES = 30.0, 100.0

#: Air changes below which supply air does nothing [1/h]: a tight house leaks ten times as much.
LEAST_CHANGES = 0.005

#: What supply flows may have been given in instead of kg/s, and how many of it are one.
FLOW_UNITS = {"kg/h": 3600.0, "m^3/h": 2990.0, "cfm": 1760.0, "L/s": 830.0, "1/3600 kg/s": 1.0 / 3600.0}

#: Heat of a zone by its floor area, 1 % of the time exceeded [W/m2]: offices are designed for 50 to 150, an old house
#: in deep cold takes 200, the bathroom of a test house 110.
UNUSUAL_HEAT, IMPOSSIBLE_HEAT = 500.0, 2000.0

#: Mean heat by floor area and by how much warmer it is inside than outside [W/m2/K]: well insulated houses have 0.5
#: to 1, old ones 3 to 5, a hall without insulation 10. Judged where it is warmer by `LEAST_WARMER` [K] in the mean;
#: below the smallest, people and sun are not enough to make so much difference.
MOST_LOSS, LEAST_LOSS, LEAST_WARMER = 30.0, 0.02, 10.0

#: Change within an hour that air hardly makes, of zones and outdoors [K]; 99.9 % of hours are below. A light test
#: cell with 50 W/m2 makes 6 K, fronts and inversions make 8 K.
FASTEST = {ZONE_TEMPERATURE: 12.0, OUTDOOR_TEMPERATURE: 12.0}

_LARGEST = 0.99


def magnitudes(case: Case) -> Iterator[Anomaly]:
    """Find flows, heat and rates that do not fit the building's size.

    Parameters
    ----------
    case
        Case.

    Yields
    ------
    Anomaly
        ``unit``, ``heat`` or ``rate``.
    """
    frame, building, sizes = case.usable, case.building, zone_sizes(case.building)
    density = air_density(building.location.elevation)
    groups: dict[tuple[bool, str], list[tuple[str, float]]] = {}
    blamed = set()
    for device in building.devices:
        column = f"{device.name}/{SUPPLY_FLOW}"
        if device.zone is None or column not in frame or not (flow := frame[column].dropna()).size:
            continue
        largest = float(flow.quantile(_LARGEST))
        changes = 3600.0 * largest / density / sizes[device.zone][1]
        if changes > UNUSUAL_CHANGES or 0.0 < changes < LEAST_CHANGES:
            groups.setdefault((changes > IMPOSSIBLE_CHANGES, "high" if changes > 1.0 else "low"), []).append(
                (column, changes)
            )
            blamed.add(device.zone)
    for (impossible, side), found in groups.items():
        columns, typical = tuple(c for c, _ in found), float(np.median([changes for _, changes in found]))
        units = [unit for unit, factor in FLOW_UNITS.items() if 0.5 <= typical / factor <= 20.0]
        looks = f"; they look like {some_of(units)}" if units else ""
        what = f"supply air changes the air of its zones {_rounded(typical)} times an hour: {some_of(columns)}{looks}"
        advice = "correct the unit of supply_air_flowrate_sensor under 'units', or the volume of the zones"
        certainty: Certainty = "certain" if impossible else "likely" if side == "low" else "possible"
        yield Anomaly("unit", "error" if impossible else "warning", certainty, columns, *_ends(frame), what, advice)
    heat = case.zone_heat()
    yield from _heat(heat.drop(columns=[z for z in heat if z in blamed]), sizes)
    if not blamed and not case.building.commanded:
        yield from _loss(case, heat, sum(area for area, _ in sizes.values()))
    yield from _rates(case)


def _rounded(value: float) -> str:
    """Write a number to three digits without an exponent."""
    return f"{float(f'{value:.3g}'):.12g}"


def _ends(frame: pd.DataFrame) -> tuple[pd.Timestamp, pd.Timestamp]:
    return frame.index[0], frame.index[-1]


def _heat(heat: pd.DataFrame, sizes: dict[str, tuple[float, float]]) -> Iterator[Anomaly]:
    """Find zones with more heat than any room takes."""
    largest = heat.abs().quantile(_LARGEST) if len(heat.columns) else pd.Series(dtype=float)
    by_area = {str(z): float(q) / sizes[str(z)][0] for z, q in largest.items() if q > UNUSUAL_HEAT * sizes[str(z)][0]}
    if by_area:
        worst = max(by_area.values())
        impossible = worst > IMPOSSIBLE_HEAT
        what = f"heat of up to {_rounded(worst)} W by m2 of floor in {some_of(by_area)}"
        advice = "correct the unit of heat or flow, or the floor area"
        severity: Severity = "error" if impossible else "warning"
        sure: Certainty = "certain" if impossible else "possible"
        yield Anomaly("heat", severity, sure, tuple(by_area), *_ends(heat), what, advice)


def _loss(case: Case, heat: pd.DataFrame, area: float) -> Iterator[Anomaly]:
    """Hold the mean heat of the building against how warm it is."""
    warmer = (case.zone_temperatures().mean(axis=1) - case.boundary_temperatures()["outdoor"]).rename("warmer")
    known = pd.concat([heat.sum(axis=1, min_count=1), warmer], axis=1).dropna()
    if not len(known) or known["warmer"].mean() < LEAST_WARMER:
        return
    mean, difference = float(known[0].mean()), float(known["warmer"].mean())
    loss = mean / area / difference
    if not LEAST_LOSS <= loss <= MOST_LOSS:
        what = f"the building is {difference:.0f} K warmer than the outdoors on {mean:.3g} W, {loss:.2g} W/m2/K"
        few = (
            "heat is not metered, or kW are given as W"
            if loss < LEAST_LOSS
            else "W are given as kW, or a meter of more"
        )
        advice = f"usual are 0.3 to 10; {few}"
        yield Anomaly("heat", "warning", "likely", tuple(map(str, heat)), *_ends(heat), what, advice)


def _rates(case: Case) -> Iterator[Anomaly]:
    """Find temperatures that change faster than air does."""
    rows = max(1, round(3600.0 / case.step))
    hours = rows * case.step / 3600.0
    for column in map(str, case.usable):
        fastest = FASTEST.get(column.rpartition("/")[2])
        if fastest is None or case.usable[column].notna().sum() <= rows:
            continue
        change = float(case.usable[column].diff(rows).abs().quantile(0.999)) / hours
        if change > fastest:
            what = f"{column} changes by {change:.0f} K within an hour"
            advice = f"air hardly makes {fastest:.0f} K: see which sensor, and which unit, it is"
            air = 3600.0 / AIR_HEAT_CAPACITY / air_density(case.building.location.elevation)
            what += f" (a m3 of air takes {change / air:.0f} W for that)" if column.endswith(ZONE_TEMPERATURE) else ""
            yield Anomaly("rate", "warning", "likely", (column,), *_ends(case.usable), what, advice)
