"""Heat that zones receive from their devices, as metered, and estimated where a meter's sensor fails for long."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pandas as pd

from thermal.case.building import Building, Device
from thermal.case.commands import air_column
from thermal.case.estimated import Estimated, like_others, long_gaps
from thermal.case.plan import zone_sizes
from thermal.case.points import DISCHARGE_TEMPERATURE, HEATING_POWER, SUPPLY_FLOW
from thermal.case.validation import TERMINAL_TYPES
from thermal.units import AIR_HEAT_CAPACITY

#: Points of a device that tell its heat.
HEAT_POINTS = (SUPPLY_FLOW, DISCHARGE_TEMPERATURE, HEATING_POWER)

#: Points that the parts of `heat_parts` follow from.
_OF_PARTS = ((SUPPLY_FLOW, DISCHARGE_TEMPERATURE), (HEATING_POWER,))


def heat_parts(
    building: Building, frame: pd.DataFrame, temperatures: pd.DataFrame
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Heat that air brings and heat that devices report as power, of the zones that have such devices.

    Parameters
    ----------
    building
        With its devices.
    frame
        Usable telemetry, shape (n_time, n_column) [library's units].
    temperatures
        Of the zones, shape (n_time, n_zone) [K].

    Returns
    -------
    tuple of DataFrame
        By air, by power [W], a column a zone; NaN where something is missing.
    """
    unknown, columns = pd.Series(np.nan, index=frame.index), set(frame.columns)
    air: dict[str, pd.Series] = {}
    power: dict[str, pd.Series] = {}
    for device in building.devices:
        zone = device.zone
        if zone is None:
            continue
        flow, _, watts = (frame.get(f"{device.name}/{point}") for point in HEAT_POINTS)
        discharge = frame.get(air_column(building, device, columns) or "")
        if watts is not None:
            power[zone] = power.get(zone, 0.0) + watts
        if flow is not None or _is_unmetered(building, device, frame):
            rate, warm = (unknown if series is None else series for series in (flow, discharge))
            brought = rate * AIR_HEAT_CAPACITY * (warm - temperatures[zone])
            air[zone] = air.get(zone, 0.0) + brought.where(rate != 0.0, 0.0)
    return pd.DataFrame(air, index=frame.index), pd.DataFrame(power, index=frame.index)


def total_heat(building: Building, parts: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Add up the parts of the heat of all zones.

    Parameters
    ----------
    building
        With its zones.
    parts
        From `heat_parts`.

    Returns
    -------
    DataFrame
        Shape (n_time, n_zone) [W]; 0 for a zone without devices.
    """
    air, power = (part.reindex(columns=list(building.zone_names), fill_value=0.0) for part in parts)
    return air + power


def estimate_parts(
    building: Building, frame: pd.DataFrame, parts: Sequence[pd.DataFrame], step: float
) -> tuple[list[pd.DataFrame], tuple[Estimated, ...]]:
    """Estimate parts of the heat where a flow, a discharge temperature or a power is missing for long.

    Parameters
    ----------
    building
        With its devices.
    frame
        Usable telemetry, shape (n_time, n_column) [library's units].
    parts
        From `heat_parts` [W].
    step
        Time from a stamp to the next [s].

    Returns
    -------
    tuple
        The parts with the estimates of `like_others`, by floor area, in them [W]; and where points are missing for
        over 30 minutes. In a building of one zone, whose error would be all there is, nothing is estimated.
    """
    areas = pd.Series({zone: area for zone, (area, _) in zone_sizes(building).items()})
    filled, found = [], []
    for part, points in zip(parts, _OF_PARTS, strict=True):
        lacking = [str(zone) for zone in part if part[zone].isna().any() and len(areas) > 1]
        gaps = [gap for zone in lacking for gap in _gaps(building, frame, zone, points, step)]
        whole, density = part.copy(), (part / areas)[part.columns]
        for gap in gaps:  # no flow is no heat without a discharge temperature too, but no sample of what is missing
            density.loc[gap.start : gap.end, gap.zone] = np.nan
        guess = {zone: areas[zone] * like_others(density, zone, step) for zone in {gap.zone for gap in gaps}}
        for gap in gaps:
            whole.loc[gap.start : gap.end, gap.zone] = whole[gap.zone].fillna(guess[gap.zone])
        filled.append(whole)
        found += gaps
    return filled, tuple(found)


def _gaps(
    building: Building, frame: pd.DataFrame, zone: str, points: Sequence[str], step: float
) -> Iterator[Estimated]:
    """Find where some points of a zone's devices are missing for long."""
    for device in building.devices_of(zone):
        columns = [f"{device.name}/{point}" for point in points]
        air = air_column(building, device, set(frame.columns))
        if DISCHARGE_TEMPERATURE in points and air is not None:
            columns[points.index(DISCHARGE_TEMPERATURE)] = air
        expected = SUPPLY_FLOW in points and _is_unmetered(building, device, frame)
        if expected or any(column in frame for column in columns):
            for column in columns:
                for a, b in long_gaps(frame.get(column, pd.Series(np.nan, frame.index)), step):
                    yield Estimated(zone, column, frame.index[a], frame.index[b])


def _is_unmetered(building: Building, device: Device, frame: pd.DataFrame) -> bool:
    """Whether a device gives heat, and nothing tells how much."""
    if any(own.device == device.name for own in building.commanded):
        return False
    flow, discharge, power = (f"{device.name}/{point}" in frame for point in HEAT_POINTS)
    return not flow and not power and (discharge or device.type in TERMINAL_TYPES)
