"""Sensors against what they can see: values out of range, wrong units, two sensors of one thing that disagree."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from thermal.case.case import Case
from thermal.case.plausibility.anomaly import Anomaly, Certainty
from thermal.case.points import OUTDOOR_TEMPERATURE, POINT_TYPES, SUPPLY_FLOW, ZONE_TEMPERATURE, split_column
from thermal.errors import some_of
from thermal.units import QUANTITIES, from_si

CO2, HUMIDITY = "zone_air_co2_concentration_sensor", "_air_relative_humidity_sensor"

#: Carbon dioxide that indoor air cannot fall below [ppm]: outdoor air has over 390 ppm since 2011 (NOAA, Mauna Loa),
#: and a sensor for rooms is within 50 ppm and 3 % of its reading.
LEAST_CO2 = 330.0

#: Median of carbon dioxide that no room in use has [ppm]: the limit of eight hours at work (EU 2006/15/EC).
MOST_CO2 = 5000.0

#: Medians of relative humidity between which air is [%]: outdoor air of -25 degC has 2 to 3 % when it is heated to
#: 21 degC, and a sensor that lies wet reports 100 % for good; outdoors fog does too.
LEAST_HUMIDITY, MOST_HUMIDITY = 2.0, 97.0

#: Difference of two temperature sensors of one thing that needs an explanation [K]: a thermometer is within 0.5 K
#: (Pt100 of class B with its transmitter), a screen in the sun reads up to 1.5 K too much (WMO No. 8, ch. 2).
DISAGREEMENT = 2.0

#: Least time that two sensors are compared over [s]: a day, so that sun and night are both in it.
LEAST_COMPARED = 24 * 3600.0

#: Share of impossible values above which a column, rather than a value, is wrong [-].
IMPOSSIBLE_SHARE = 0.05


def out_of_range(case: Case) -> Iterator[Anomaly]:
    """Find columns whose values lie where the thing that they measure is not.

    Parameters
    ----------
    case
        Case.

    Yields
    ------
    Anomaly
        ``range`` or ``unit``, one a column.

    Notes
    -----
    Judged on quantiles, so that single bad values, which `thermal.case.quality` leaves out, say nothing here.
    """
    start, end = case.stamps[0], case.stamps[-1]
    failed: dict[str, list[tuple[str, float]]] = {}
    for name in case.telemetry.frame.columns:
        column = str(name)
        point = POINT_TYPES[split_column(column, "telemetry")[1]]
        unit = QUANTITIES[point.quantity].file_unit
        raw = case.telemetry.frame[column].dropna().to_numpy(dtype=float)
        if not raw.size or point.name == SUPPLY_FLOW:  # flows are held against the zone (`magnitude`)
            continue
        values = from_si(raw, unit, point.quantity)
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
        if np.mean((raw < point.lowest) | (raw > point.highest)) > IMPOSSIBLE_SHARE:
            failed.setdefault(point.name, []).append((column, float(middle)))
        elif point.name == CO2 and (low < LEAST_CO2 or middle > MOST_CO2):
            ends = (
                f"5 % of its values are below {low:.0f} ppm" if low < LEAST_CO2 else f"its median is {middle:.0f} ppm"
            )
            what = f"{column}: {ends}; outdoor air has over 400 ppm, a room in use under {MOST_CO2:.0f} ppm"
            yield Anomaly("range", "warning", "certain", (column,), start, end, what, "calibrate the sensor outdoors")
        elif point.name.endswith(HUMIDITY) and high <= 1.0 < 100.0 * high:
            what = f"{column}: 95 % of its values are below {high:.2g} %"
            yield Anomaly("unit", "warning", "likely", (column,), start, end, what, "its unit looks like 1, not %")
        elif point.name.endswith(HUMIDITY) and not LEAST_HUMIDITY <= middle <= MOST_HUMIDITY:
            what = f"{column}: its median is {middle:.3g} %, which air hardly has"
            yield Anomaly("range", "warning", "likely", (column,), start, end, what, "look at the sensor and its unit")
    for name, columns in failed.items():
        names, middle = tuple(column for column, _ in columns), float(np.median([median for _, median in columns]))
        quantity = POINT_TYPES[name].quantity
        what = (
            f"{some_of(names)}: over {100 * IMPOSSIBLE_SHARE:.0f} % of the values are impossible "
            f"(median {middle:.4g} {QUANTITIES[quantity].file_unit})"
        )
        advice = f"correct the unit of {name} under 'units'{_hint(quantity, middle)}, or the sensor"
        yield Anomaly("unit", "warning", "certain", names, start, end, what, advice)


def _hint(quantity: str, middle: float) -> str:
    """Name the unit that impossible values look like [unit of files]."""
    if quantity != "temperature":
        return ""
    return " (they look like degF)" if 40.0 < middle < 110.0 else " (they look like K)" if 250 < middle < 320 else ""


def disagreements(case: Case) -> Iterator[Anomaly]:
    """Find sensors of the same zone, or of the outdoors, that differ by more than sensors and places explain.

    Parameters
    ----------
    case
        Case.

    Yields
    ------
    Anomaly
        ``disagreement``, one a pair.
    """
    frame, building = case.usable, case.building
    groups = {
        f"the temperature of zone {zone!r}": [f"{e}/{ZONE_TEMPERATURE}" for e in (zone, *devices)]
        for zone, devices in ((z, [d.name for d in building.devices_of(z)]) for z in building.zone_names)
    }
    groups["the outdoor temperature"] = [str(c) for c in frame if str(c).endswith(f"/{OUTDOOR_TEMPERATURE}")]
    for thing, columns in groups.items():
        for first, second in combinations([c for c in columns if c in frame], 2):
            gap = (frame[first] - frame[second]).dropna()
            if len(gap) * case.step < LEAST_COMPARED:
                continue
            low, middle, high = np.quantile(gap, [0.1, 0.5, 0.9])
            apart = abs(middle) > DISAGREEMENT
            if not apart and high - low <= 4.0 * DISAGREEMENT:
                continue
            used = "their mean is used" if "zone" in thing else "the weather station's is used, or else the mean"
            what = (
                f"{first} and {second} both measure {thing} and differ by {middle:+.1f} K "
                f"(80 % of the time {low:+.1f} to {high:+.1f} K)"
            )
            sure: Certainty = "certain" if low * high > 0.0 else "likely"
            advice = f"find out which one is right and drop the other: {used}"
            yield Anomaly("disagreement", "warning", sure, (first, second), gap.index[0], gap.index[-1], what, advice)
