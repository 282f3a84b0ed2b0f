"""A case: a building and what it reported."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cached_property
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pandas as pd

from thermal.case.building import OUTDOOR, Building
from thermal.case.commands import command_signals, commanded_devices
from thermal.case.emitters import power_by_device
from thermal.case.estimated import Estimated, estimate_remarks, estimate_temperatures, like_others, long_gaps
from thermal.case.metered_heat import estimate_parts, heat_parts, total_heat
from thermal.case.points import OUTDOOR_TEMPERATURE, SUPPLY_FLOW, ZONE_TEMPERATURE
from thermal.case.quality import QualityReport, assess, usable
from thermal.case.telemetry import Telemetry
from thermal.case.validation import remarks
from thermal.case.years import EXPECTED, FIRST_YEAR, LAST_YEAR
from thermal.errors import CaseError


def local_timestamp(time: str | datetime, building: Building) -> pd.Timestamp:
    """Read a time.

    Parameters
    ----------
    time
        ISO 8601 text, or a datetime; without an offset it is local to the building.
    building
        Building whose time zone counts.

    Returns
    -------
    Timestamp
        In the building's time zone.

    Raises
    ------
    CaseError
        It is not ISO 8601, of no year that stamps can lie in, or a local time that the clock skips or shows twice.

    Examples
    --------
    >>> from thermal.case.building import Building, Location, ZoneEntry, ZoneTable
    >>> site = Location(latitude=48, longitude=12, elevation=690, timezone="Europe/Berlin")
    >>> house = Building("house", site, 0.0, ZoneTable((ZoneEntry(name="room", volume=50, floor_area=20),)))
    >>> local_timestamp("2023-07-06T07:10", house).isoformat()
    '2023-07-06T07:10:00+02:00'
    """
    zone = building.location.timezone
    try:
        parsed = datetime.fromisoformat(time.strip()) if isinstance(time, str) else time
        stamp = pd.Timestamp(parsed)
        if pd.isna(stamp):
            raise ValueError("no time")
        CaseError.unless(FIRST_YEAR <= stamp.year <= LAST_YEAR, "time", EXPECTED, repr(str(time)))
    except (TypeError, ValueError, OverflowError) as error:
        raise CaseError("time", "ISO 8601, such as 2023-07-06T07:10", repr(time)) from error
    if stamp.tzinfo is not None:
        return stamp.tz_convert(zone)
    naive = stamp.to_pydatetime()
    first, second = (naive.replace(tzinfo=ZoneInfo(zone), fold=fold).utcoffset() for fold in (0, 1))
    advice = "give the time with its offset, such as +02:00"
    CaseError.unless(first == second, "time", f"a time that the clocks of {zone} show once", stamp.isoformat(), advice)
    return stamp.tz_localize(zone)


@dataclass(frozen=True, eq=False)
class Case:
    """A building and its telemetry.

    Parameters
    ----------
    building
        What stands where.
    telemetry
        What its sensors reported.
    path
        Folder it was loaded from; None for a case made in memory.
    judged
        Quality of the telemetry where it is known already, as for an interval of a longer case; default: judged when
        first asked for.
    """

    building: Building
    telemetry: Telemetry
    path: Path | None = None
    judged: QualityReport | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        found = commanded_devices(self.building, set(self.telemetry.frame.columns))
        if found != self.building.commanded:
            object.__setattr__(self, "building", replace(self.building, commanded=found))

    @cached_property
    def quality(self) -> QualityReport:
        """Quality of the telemetry: `judged`, or else what `assess` finds."""
        return self.judged if self.judged is not None else assess(self.telemetry, self.building)

    @cached_property
    def usable(self) -> pd.DataFrame:
        """Telemetry with what `quality` flags set to NaN: shape (n_time, n_column), library's units."""
        return usable(self.telemetry.frame, self.quality)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is valid in the case and yet worth a look, one sentence each."""
        return (*remarks(self.building, self.telemetry), *estimate_remarks(self.estimated))

    @property
    def step(self) -> float:
        """Time from a stamp to the next [s]."""
        return self.telemetry.step

    @property
    def stamps(self) -> pd.DatetimeIndex:
        """Stamps of the telemetry, shape (n_time,), in the building's time zone."""
        return pd.DatetimeIndex(self.telemetry.frame.index)

    def slice(self, start: str | datetime | None = None, end: str | datetime | None = None) -> Case:
        """Cut an interval out of the case.

        Parameters
        ----------
        start, end
            First and last time of the interval, both included; ISO 8601, local to the building without an offset.
            Default: from the first, to the last stamp.

        Returns
        -------
        Case
            The same building, and the rows with ``start <= stamp <= end``. A value stands for the step that ends at
            its stamp, so the first row speaks of the step before `start`. What was flagged in the whole stays flagged.

        Raises
        ------
        CaseError
            A time is not ISO 8601.
        CaseError
            Fewer than two stamps lie in the interval.
        """
        stamps = self.stamps
        first = stamps[0] if start is None else local_timestamp(start, self.building)
        last = stamps[-1] if end is None else local_timestamp(end, self.building)
        frame = self.telemetry.frame.loc[first:last]
        if len(frame) < 2:
            expected = f"an interval with stamps of the telemetry, {stamps[0]} to {stamps[-1]}"
            raise CaseError("interval", expected, f"{first} to {last}")
        ends = (frame.index[0], frame.index[-1])
        missing = tuple(stamp for stamp in self.telemetry.missing_rows if ends[0] <= stamp <= ends[1])
        telemetry = Telemetry(frame=frame, step=self.step, missing_rows=missing)
        return replace(self, telemetry=telemetry, judged=self.quality.restricted(*ends))

    def with_weather_moved(self, hours: float) -> Case:
        """Move what the weather station says, as if its clock had been wrong.

        Parameters
        ----------
        hours
            By how much later it is said [h], rounded to whole steps; negative for earlier.

        Returns
        -------
        Case
            With the same stamps; what comes in at an end is the value there.
        """
        return self._with_moved(lambda entity, point: entity == self.building.weather_station, hours)

    def with_heat_moved(self, hours: float) -> Case:
        """Move what devices say but for setpoints and air of zones and outdoors, as if their meters' clock was wrong.

        Parameters
        ----------
        hours
            By how much later it is said [h], rounded to whole steps; negative for earlier.

        Returns
        -------
        Case
            With the same stamps; what comes in at an end is the value there.
        """
        devices = {device.name for device in self.building.devices}

        def are_moved(entity: str, point: str) -> bool:
            own = not point.startswith(("zone_", "outside_")) and not point.endswith("_setpoint")
            return entity in devices and own

        return self._with_moved(are_moved, hours)

    def _with_moved(self, are_moved: Callable[[str, str], bool], hours: float) -> Case:
        frame = self.telemetry.frame.copy()
        steps = round(hours * 3600.0 / self.step)
        named = (c.rpartition("/") for c in map(str, frame))
        columns = ["".join(parts) for parts in named if are_moved(parts[0], parts[2])]
        rows = np.clip(np.arange(len(frame)) - steps, 0, len(frame) - 1)
        frame[columns] = frame[columns].to_numpy()[rows]
        return Case(self.building, replace(self.telemetry, frame=frame))

    def weather(self) -> pd.DataFrame:
        """Weather, as far as the station measures it.

        Returns
        -------
        DataFrame
            Shape (n_time, n_point), columns the point types present, such as ``direct_normal_irradiance_sensor``, in
            the library's units ([K], [m/s], [deg], [W/m2]). NaN = missing or unusable.
        """
        prefix = f"{self.building.weather_station}/"
        columns = [column for column in self.usable.columns if column.rpartition("/")[0] + "/" == prefix]
        return self.usable[columns].rename(columns=lambda column: column.removeprefix(prefix))

    def zone_temperatures(self) -> pd.DataFrame:
        """Measured air temperature of each zone.

        Returns
        -------
        DataFrame
            Shape (n_time, n_zone) [K], columns `building.zone_names`. NaN = missing or unusable; the column of a zone
            that nothing measures is all NaN. Where several sensors measure a zone (its devices', its own), it is the
            mean of those that are usable at the stamp.
        """
        return self._zone_temperatures.copy()

    @cached_property
    def _zone_temperatures(self) -> pd.DataFrame:
        frame = self.usable
        measured = {}
        for zone in self.building.zone_names:
            entities = [zone, *(device.name for device in self.building.devices_of(zone))]
            columns = [f"{entity}/{ZONE_TEMPERATURE}" for entity in entities]
            measured[zone] = frame.reindex(columns=[column for column in columns if column in frame]).mean(axis=1)
        return pd.DataFrame(measured, index=frame.index, dtype=float)

    def zone_heat(self) -> pd.DataFrame:
        """Metered heat that each zone receives from its devices.

        Returns
        -------
        DataFrame
            Shape (n_time, n_zone) [W], columns `building.zone_names`, heating positive. 0 for a zone without devices;
            NaN where an input is missing or unusable.

        Notes
        -----
        ``q = flow * 1006 J/kg/K * (discharge - zone temperature) + heating_power``, of measured temperatures of the
        same stamp. A flow of exactly zero brings no heat, whatever the discharge sensor says or fails to say. A
        terminal unit or heater of a known type that reports neither flow nor power makes its zone's heat unknown: NaN,
        unless a valve, a damper or a counter tells what it does (`building.commanded`): such heat is fitted, and not
        in this.
        """
        return self._zone_heat.copy()

    @cached_property
    def _zone_heat(self) -> pd.DataFrame:
        return total_heat(self.building, heat_parts(self.building, self.usable, self._zone_temperatures))

    def command_signals(self) -> pd.DataFrame:
        """Give what the heat of devices that no meter tells is in proportion to.

        Returns
        -------
        DataFrame
            Shape (n_time, n_commanded), columns 0..n-1 in the order of `building.commanded`, NaN where something is
            missing; see `thermal.case.commands.command_signals`.
        """
        return command_signals(self.building, self.usable, self._estimated_temperatures[0])

    def zone_heat_estimated(self) -> pd.DataFrame:
        """Heat that each zone receives, estimated where a sensor that it follows from is dead or stuck for long.

        Returns
        -------
        DataFrame
            `zone_heat` [W], but for the intervals of `estimated`: what a replay is driven by.
        """
        return self._estimated[0].copy()

    def zone_temperatures_estimated(self) -> pd.DataFrame:
        """Temperatures of the zones, estimated where a sensor is dead or stuck for long, (n_time, n_zone) [K]."""
        return self._estimated_temperatures[0].copy()

    def heating_power_estimated(self) -> pd.DataFrame:
        """Heat that each device reports as power, estimated as in `zone_heat_estimated`, of which it is a part.

        Returns
        -------
        DataFrame
            Shape (n_time, n_device) [W], columns 0..n-1 in the order of `building.devices`; 0 without such a report.
        """
        return self._estimated[2].copy()

    def heat_is_estimated(self) -> pd.DataFrame:
        """Whether the heat of each zone is an estimate, shape (n_time, n_zone)."""
        return self._estimated[0].notna() & self._zone_heat.isna()

    @property
    def estimated(self) -> tuple[Estimated, ...]:
        """Where a zone's heat is estimated: a sensor that it follows from is dead or stuck for over 30 minutes."""
        return self._estimated[1]

    @cached_property
    def _estimated_temperatures(self) -> tuple[pd.DataFrame, tuple[Estimated, ...]]:
        return estimate_temperatures(self._zone_temperatures, self.step)

    @cached_property
    def _estimated(self) -> tuple[pd.DataFrame, tuple[Estimated, ...], pd.DataFrame]:
        temperatures, found = self._estimated_temperatures
        parts = heat_parts(self.building, self.usable, temperatures)
        filled, lacking = estimate_parts(self.building, self.usable, parts, self.step)
        devices, power = power_by_device(self.building, self.usable, filled[1])
        stages = [total_heat(self.building, stage) for stage in (parts, (filled[0], power))]
        gained = [heat.notna() & self._zone_heat.isna() for heat in stages]
        kept = [
            i
            for own, g in zip((found, lacking), gained, strict=True)
            for i in own
            if g.loc[i.start : i.end, i.zone].any()
        ]
        return stages[-1], tuple(kept), devices

    def boundary_temperatures(self) -> pd.DataFrame:
        """Temperatures that the zones look out on.

        Returns
        -------
        DataFrame
            Shape (n_time, 1 + n_boundary) [K]: ``outdoor``, then `building.measured_boundaries`. Outdoor is the weather
            station's; without one, the mean of what devices (air handlers) report; all NaN when nothing does.
        """
        frame = self.usable
        station = f"{self.building.weather_station}/{OUTDOOR_TEMPERATURE}"
        others = [column for column in frame.columns if column.endswith(f"/{OUTDOOR_TEMPERATURE}")]
        outdoor = [station] if station in frame else others
        columns = {OUTDOOR: frame[outdoor].mean(axis=1)}
        for boundary in self.building.measured_boundaries:
            columns[boundary] = frame[f"{boundary}/{ZONE_TEMPERATURE}"]
        return pd.DataFrame(columns, index=frame.index, dtype=float)

    def airflow_rates(self) -> pd.DataFrame:
        """Air that goes on from zone to zone.

        Returns
        -------
        DataFrame
            Shape (n_time, n_airflow) [kg/s], columns 0..n-1 in the order of `building.airflows`: the device's flow
            times the fraction. NaN where the flow is missing or unusable.
        """
        flows = self.usable.reindex(columns=[f"{airflow.device}/{SUPPLY_FLOW}" for airflow in self.building.airflows])
        rates = flows * [airflow.fraction for airflow in self.building.airflows]
        return rates.set_axis(range(len(self.building.airflows)), axis=1).astype(float)

    def airflow_rates_estimated(self) -> pd.DataFrame:
        """Air that goes on from zone to zone; where it is missing for over 30 minutes, its mean until a day before.

        Returns
        -------
        DataFrame
            `airflow_rates` [kg/s], but for such gaps; what is missing all the time stays missing.
        """
        rates = self.airflow_rates()
        for number in rates:
            usual = like_others(rates[[number]], number, self.step)
            for a, b in long_gaps(rates[number], self.step):
                rates.loc[self.stamps[a] : self.stamps[b], number] = usual
        return rates
