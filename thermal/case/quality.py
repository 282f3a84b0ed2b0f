"""Quality of telemetry: what a sensor did not report, and what it reported that cannot be true.

Nothing here is an error. What is found is reported, and left out of every fit (`usable`): gaps, impossible values,
flat lines and spikes. The thresholds lean to the side of letting data pass, since a wrongly dropped stretch costs a
fit more than a short flaw does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from pydantic import BaseModel

from thermal.case.building import Building
from thermal.case.points import (
    DISCHARGE_TEMPERATURE,
    OUTDOOR_TEMPERATURE,
    POINT_TYPES,
    SUPPLY_FLOW,
    ZONE_TEMPERATURE,
    split_column,
)
from thermal.case.signal_faults import flat_lines, impossible_values, runs, spikes, stuck_meters
from thermal.case.telemetry import Telemetry

GAP, IMPOSSIBLE, FLAT, SPIKE, CONSTANT = "gap", "impossible", "flat", "spike", "constant"
EXCLUDED = (IMPOSSIBLE, FLAT, SPIKE)  # a gap is NaN already; a constant input may be meant


@dataclass(frozen=True)
class Finding:
    """One flaw of one column.

    Parameters
    ----------
    kind
        ``gap``, ``impossible``, ``flat``, ``spike`` or ``constant`` (all the record the same value: reported only).
    start, end
        First and last stamp of it.
    steps
        Number of stamps, both ends included.
    detail
        What was seen, in words.
    """

    kind: str
    start: pd.Timestamp
    end: pd.Timestamp
    steps: int
    detail: str = ""


@dataclass(frozen=True)
class ColumnQuality:
    """Quality of one column.

    Parameters
    ----------
    column
        ``ENTITY/POINT``.
    missing_share
        Share of the stamps without a value, 0 to 1 [-].
    unusable_share
        Share of the stamps without a usable value, 0 to 1 [-]: missing, impossible, flat or spike.
    findings
        In the order of time.
    """

    column: str
    missing_share: float
    unusable_share: float
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class QualityReport:
    """Quality of a stretch of telemetry.

    Parameters
    ----------
    start, end
        First and last stamp.
    step
        Time from a stamp to the next [s].
    n_time
        Number of stamps.
    missing_rows
        Stretches that the source left out altogether: irregularities of its clock.
    columns
        One entry a column, in the telemetry's order.
    """

    start: pd.Timestamp
    end: pd.Timestamp
    step: float
    n_time: int
    missing_rows: tuple[Finding, ...]
    columns: tuple[ColumnQuality, ...]

    def __iter__(self) -> Iterator[tuple[str, Finding]]:
        """Go through all findings: column and finding."""
        return ((entry.column, finding) for entry in self.columns for finding in entry.findings)

    def count(self, kind: str) -> int:
        """Count the findings of a kind.

        Parameters
        ----------
        kind
            ``gap``, ``impossible``, ``flat``, ``spike`` or ``constant``.

        Returns
        -------
        int
            Over all columns.
        """
        return sum(finding.kind == kind for _, finding in self)

    def restricted(self, start: pd.Timestamp, end: pd.Timestamp) -> QualityReport:
        """Cut the report down to an interval of its telemetry.

        Parameters
        ----------
        start, end
            First and last stamp of the interval; both are stamps of the telemetry.

        Returns
        -------
        QualityReport
            Findings that reach into the interval, cut at its ends. Nothing is judged again.
        """
        n_time = _stamps(start, end, self.step)
        columns = []
        for entry in self.columns:
            findings = _cut(entry.findings, start, end, self.step)
            missing = sum(finding.steps for finding in findings if finding.kind == GAP)
            bad = sum(finding.steps for finding in findings if finding.kind in EXCLUDED)
            columns.append(ColumnQuality(entry.column, missing / n_time, (missing + bad) / n_time, findings))
        rows = _cut(self.missing_rows, start, end, self.step)
        return QualityReport(start, end, self.step, n_time, rows, tuple(columns))

    def to_dict(self) -> dict[str, Any]:
        """Give the report as plain types, for JSON."""
        names = {"step": "step_seconds", "n_time": "stamps"}
        return {names.get(key, key): value for key, value in plain(self).items()}


def plain(value: Any) -> Any:
    """Give dataclasses, models, times and sequences as plain types, for JSON.

    Parameters
    ----------
    value
        What to take apart; other types stay as they are.
    """
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, BaseModel):
        return value.model_dump()
    return value.isoformat() if isinstance(value, pd.Timestamp) else value


def assess(telemetry: Telemetry, building: Building) -> QualityReport:
    """Judge the quality of telemetry.

    Parameters
    ----------
    telemetry
        In the library's units.
    building
        Building that it is of; says which temperatures are outdoor, of zones, of boundaries.

    Returns
    -------
    QualityReport
        What is missing, and what cannot be true.

    Notes
    -----
    Impossible values are judged for every point (`thermal.case.points`), flat lines and spikes for the temperatures of
    zones, measured boundaries and outdoors only, flows and discharge temperatures by those of other devices
    (`stuck_meters`). Other signals do jump, and do stand still, in sound buildings: flows and powers at zero or at full
    load, sun at night, wind calm, setpoints, water and supply air under control.
    """
    frame, step, stamps = telemetry.frame, telemetry.step, telemetry.frame.index
    clean = {str(name): frame[name].to_numpy(dtype=float, copy=True) for name in frame.columns}
    findings: dict[str, list[Finding]] = {name: [] for name in clean}

    def note(name: str, kind: str, found: list[tuple[int, int, str]]) -> None:
        for first, last, detail in found:
            findings[name].append(Finding(kind, stamps[first], stamps[last], last - first + 1, detail))
            if kind in EXCLUDED:
                clean[name][first : last + 1] = np.nan

    for name, values in clean.items():
        note(name, GAP, [(*ends, "") for ends in runs(np.isnan(values))])
        note(name, IMPOSSIBLE, impossible_values(values, POINT_TYPES[split_column(name, "")[1]]))
    outdoor = [name for name in clean if name.endswith(f"/{OUTDOOR_TEMPERATURE}")]
    station = f"{building.weather_station}/{OUTDOOR_TEMPERATURE}"
    reference = next((clean[name] for name in (station, *outdoor) if name in clean), None)
    for name in [*outdoor, *(name for name in clean if name.endswith(f"/{ZONE_TEMPERATURE}"))]:
        values, entity = clean[name], name.rpartition("/")[0]
        is_input = name in outdoor or entity in building.measured_boundaries
        note(name, FLAT, flat_lines(values, None if name in outdoor else reference, step, is_input=is_input))
        finite = values[np.isfinite(values)]
        if finite.size > 1 and np.ptp(finite) == 0.0:
            note(name, CONSTANT, [(0, len(values) - 1, f"always {finite[0] - 273.15:.2f} degC")])
        note(name, SPIKE, spikes(values, step))
    for point in (SUPPLY_FLOW, DISCHARGE_TEMPERATURE):
        meters = {name: clean[name].copy() for name in clean if name.endswith(f"/{point}")}
        for name, values in meters.items():
            note(name, FLAT, stuck_meters(values, [meters[other] for other in meters if other != name], step))
    columns = []
    for name, flaws in findings.items():
        missing = sum(finding.steps for finding in flaws if finding.kind == GAP) / len(frame)
        flaws.sort(key=lambda finding: (finding.start, finding.kind))
        columns.append(ColumnQuality(name, missing, float(np.isnan(clean[name]).mean()), tuple(flaws)))
    missing_rows = runs(stamps.isin(telemetry.missing_rows))
    rows = tuple(Finding(GAP, stamps[a], stamps[b], b - a + 1, "no row at all") for a, b in missing_rows)
    return QualityReport(stamps[0], stamps[-1], step, len(frame), rows, tuple(columns))


def usable(frame: pd.DataFrame, report: QualityReport) -> pd.DataFrame:
    """Leave out what a report flags.

    Parameters
    ----------
    frame
        Shape (n_time, n_column); telemetry that the report is of, or an interval of it.
    report
        Its quality.

    Returns
    -------
    DataFrame
        The same shape; impossible values, flat lines and spikes are NaN, like gaps.
    """
    values = frame.to_numpy(dtype=float, copy=True)
    positions = {str(column): position for position, column in enumerate(frame.columns)}
    for column, finding in report:
        if finding.kind in EXCLUDED and column in positions:
            first = frame.index.searchsorted(finding.start)
            last = frame.index.searchsorted(finding.end, side="right")
            values[first:last, positions[column]] = np.nan
    return pd.DataFrame(values, index=frame.index, columns=frame.columns)


def _stamps(start: pd.Timestamp, end: pd.Timestamp, step: float) -> int:
    return round((end - start).total_seconds() / step) + 1


def _cut(findings: tuple[Finding, ...], start: pd.Timestamp, end: pd.Timestamp, step: float) -> tuple[Finding, ...]:
    kept = []
    for finding in findings:
        first, last = max(finding.start, start), min(finding.end, end)
        if first <= last:
            kept.append(replace(finding, start=first, end=last, steps=_stamps(first, last, step)))
    return tuple(kept)
