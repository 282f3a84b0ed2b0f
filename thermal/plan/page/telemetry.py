"""Telemetry on the labelling page: a table is read, its columns are matched, and it is put into the case."""

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from thermal.case.building import Building
from thermal.case.check import CaseCheck, describe_case
from thermal.case.load import load_case
from thermal.case.points import POINT_TYPES
from thermal.case.quality import plain
from thermal.errors import LabelError, PlanError
from thermal.intake.series import RawSeries, read_series
from thermal.intake.source import DATABASE, SUFFIXES, shown
from thermal.intake.stamps import ClockReport, checked_zone
from thermal.intake.telemetry import ImportSettings, match_series, telemetry_of_series, tells_of_heat
from thermal.plan.guard import checked_file, inside_folder
from thermal.plan.match import PointMatch, read_matches, write_matches
from thermal.plan.page.draft import building_of_draft, zones_of
from thermal.plan.page.drawings import Upload
from thermal.plan.page.findings import find_faults
from thermal.plan.page.jobs import Progress
from thermal.plan.page.outline import outline
from thermal.plan.page.sources import Point, Source
from thermal.plan.page.store import CaseStore, write_whole
from thermal.units import QUANTITIES, from_si

#: Parts of time of the small picture of a column, and of the large one.
SMALL, LARGE = 60, 600

_MOST_MARKS = 500  # of one picture

#: What an upload may end in.
TELEMETRY_KINDS = SUFFIXES

#: Remark of a column that a person has left out.
LEFT_OUT = "left out"

_POINTS, _TAKEN = "points.csv", "taken.json"


@dataclass(frozen=True)
class _Table:
    """A table that was read, and what its columns are taken for."""

    where: str
    settings: ImportSettings
    series: Mapping[str, RawSeries]
    clock: ClockReport
    matches: tuple[PointMatch, ...]


class TelemetryDesk:
    """The telemetry of a case on the page.

    Parameters
    ----------
    store : CaseStore
        The case.
    """

    def __init__(self, store: CaseStore) -> None:
        self._store = store
        self.folder = store.own / "telemetry"
        self._table: _Table | None = None
        self._checked: tuple[object, CaseCheck | None] | None = None

    def state(self) -> dict[str, Any]:
        """Give what the page shows of it, as plain types.

        Returns
        -------
        dict
            Files that were given; the table that was read, its columns and what they are taken for; names of entities
            and points; what was done when telemetry was put into the case the last time.
        """
        files = [path.name for path in self._files()]
        table = None
        if self._table is not None:
            rows = [self._row(match, self._table.series[match.column]) for match in self._table.matches]
            found = asdict(self._table.settings)
            table = {"where": self._table.where, **found, "columns": rows, **_span(self._table)}
        units = {point: QUANTITIES[kind.quantity].file_unit for point, kind in POINT_TYPES.items()}
        draft = self._store.draft
        entities = {*(d.name for d in draft.devices), *zones_of(draft.floors), draft.weather_station}
        names = {"entities": sorted(entities), "points": units}
        return {"files": files, "table": table, "taken": self._taken(), **names}

    def _files(self) -> list[Path]:
        known = (p for p in self.folder.iterdir() if p.suffix.lower() in TELEMETRY_KINDS and p.is_file())
        return sorted(p for p in known if p.name != _POINTS and p.name[0] != ".")

    def keep(self, upload: Upload) -> str:
        """Keep a table that was given to the page, in place of the one before.

        Parameters
        ----------
        upload : Upload
            The table, on its way in.

        Returns
        -------
        str
            Its name.

        Raises
        ------
        PlanError
            It is not what its name says.
        """
        file = checked_file(upload.close(), TELEMETRY_KINDS)
        PlanError.unless(file.name != _POINTS, file.name, "another name", "that of the page's own list", "rename it")
        kept = upload.keep()
        for file in self._files():
            if file.name != kept.name:
                file.unlink()
        return kept.name

    def _row(self, match: PointMatch, series: RawSeries) -> dict[str, Any]:
        picture = outline(series.values, SMALL)
        return {
            **asdict(match),
            "heat": bool(match.remark) and tells_of_heat(series),
            **{key: picture[key] for key in ("low", "high")},
        }

    def look(self, source: Source, progress: Progress) -> dict[str, Any]:
        """Read a table, and propose what its columns are.

        Parameters
        ----------
        source : Source
            The table.
        progress : callable
            Told stage, steps done and all steps.

        Returns
        -------
        dict
            Where it is from, and how many columns it has.

        Raises
        ------
        PlanError
            One of its family: it cannot be read.
        LabelError
            The draft is no valid case yet, or the source is neither a file of the page nor a database.
        """
        building = self._building()
        path = self._path(source)
        progress(f"reading {shown(path)}", 0, 2)
        checked_zone(source.timezone, "time zone")
        settings = ImportSettings(source.table, source.timezone, source.step)
        series, clock = read_series(path, source.table, source.timezone)
        progress("matching columns", 1, 2)
        matches = self._remembered(building, series, match_series(building, series))
        self._table = _Table(shown(path), settings, series, clock, matches)
        return {"where": shown(path), "columns": len(series)}

    def _path(self, source: Source) -> str:
        if source.address:
            expected = f"an address that begins with {DATABASE[0]}"
            advice = "postgresql://USER:PASSWORD@HOST/DATABASE"
            found = repr(source.address.partition("://")[0][:20])
            LabelError.unless(source.address.startswith(DATABASE), "database", expected, found, advice)
            return source.address
        file = inside_folder(self.folder, source.file, "telemetry")
        there = file.is_file() and file.parent == self.folder.resolve() and file.name != _POINTS
        PlanError.unless(there, "telemetry", "the name of a file on the page", repr(source.file[:80]))
        return str(file)

    def _building(self) -> Building:
        """Make the draft's building; whether the telemetry that it has fits it is not asked."""
        faults = [f for f in find_faults(self._store.draft) if f.level == "error"]
        found = f"{len(faults)} to put right, such as: {faults[0].message}" if faults else ""
        LabelError.unless(not faults, "telemetry", "a valid case to match columns to", found, "see Problems")
        return building_of_draft(self._store.draft)

    def _remembered(
        self, building: Building, series: Mapping[str, RawSeries], proposed: tuple[PointMatch, ...]
    ) -> tuple[PointMatch, ...]:
        """Put what a person said the last time in the place of what is proposed, where it still fits."""
        file = self.folder / _POINTS
        said = {m.column: m for m in read_matches(file) if m.column in series} if file.is_file() else {}
        known = _entities(building)
        kept = {c: m for c, m in said.items() if not m.entity or m.entity in known}
        return tuple(kept.get(match.column, match) for match in proposed)

    def correct(self, points: list[Point]) -> dict[str, Any]:
        """Take what a person says that columns are, and remember it.

        Parameters
        ----------
        points : list of Point
            Columns that differ from what was proposed.

        Returns
        -------
        dict
            What all columns are taken for now.

        Raises
        ------
        LabelError
            No table was read.
        PlanError
            A column, entity or point is not known.
        """
        table = self._read_table()
        known, said = _entities(self._building()), {}
        for point in points:
            where = f"column {point.column[:80]!r}"
            PlanError.unless(point.column in table.series, where, "a column of the table", "none of that name")
            if point.entity:
                PlanError.unless_known(point.entity, known, where, "a device, a zone or the weather station")
            if point.point:
                PlanError.unless_known(point.point, POINT_TYPES, where, "a point type")
            lacking = "" if point.entity else "whose it is is not said yet", "" if point.point else "no point type yet"
            remark = LEFT_OUT if all(lacking) else "".join(lacking)
            given = (point.entity, point.point, 0.0 if remark else 1.0, remark, point.unit)
            said[point.column] = PointMatch(point.column, *given)
        matches = tuple(said.get(match.column, match) for match in table.matches)
        self._table = replace(table, matches=matches)
        self._remember(matches)
        return {"columns": [asdict(match) for match in matches]}

    def _remember(self, matches: tuple[PointMatch, ...]) -> None:
        draft = self.folder / f".{_POINTS}"
        write_matches(matches, draft).replace(self.folder / _POINTS)

    def take(self, progress: Progress, guard: Callable[[], Any]) -> dict[str, Any]:
        """Put the table that was read into the case, and check it.

        Parameters
        ----------
        progress : callable
            Told stage, steps done and all steps.
        guard : callable
            Gives the lock under which the case is written.

        Returns
        -------
        dict
            As `check`.

        Raises
        ------
        LabelError
            No table was read, or the draft is no valid case.
        PlanError
            No column is matched, or two are for the same point.
        CaseError
            A unit does not measure its point, or the steps are out of range.
        """
        table = self._read_table()
        progress("bringing columns to regular steps", 0, 3)
        made = telemetry_of_series(
            self._building(), table.series, table.clock, table.settings, table.matches, table.where
        )
        progress("writing the case", 1, 3)
        found = {
            "where": table.where,
            "remarks": list(made.remarks),
            "unmatched_heat": list(made.unmatched_heat),
            "left_out": len(table.series) - made.telemetry.frame.shape[1],
        }
        before = self._taken()
        with guard():
            file = self._store.put_telemetry(made.telemetry, replaces=str((before or {}).get("file", "")))
            write_whole(self.folder / _TAKEN, json.dumps({**found, "file": file}).encode("utf-8"))
        self._remember(table.matches)
        write_matches(table.matches, self._store.folder / _POINTS)
        progress("checking", 2, 3)
        return self.check()

    def _taken(self) -> dict[str, Any] | None:
        try:
            content = json.loads((self.folder / _TAKEN).read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return None
        whole = isinstance(content, dict) and {"where", "remarks", "unmatched_heat", "left_out", "file"} <= {*content}
        return content if whole else None

    def check(self) -> dict[str, Any]:
        """Say what the library's check finds in the telemetry that the case has.

        Returns
        -------
        dict
            Span and step; points, with a small picture and the number of flaws of each; anomalies; remarks. Without
            telemetry, ``points`` is empty.

        Raises
        ------
        CaseError
            One of its family: the case does not load.
        """
        found = self._describe()
        if found is None:
            return {"points": []}
        flaws: dict[str, dict[str, int]] = {}
        for column, flaw in found.quality:
            kinds = flaws.setdefault(column, {})
            kinds[flaw.kind] = kinds.get(flaw.kind, 0) + 1
        points = []
        for point in found.points:
            picture = outline(self._in_unit(found.case.telemetry.frame[point.column]), SMALL)
            seen = {"flaws": flaws.get(point.column, {}), "low": picture["low"], "high": picture["high"]}
            points.append(plain(point) | seen)
        span = {"start": plain(found.start), "end": plain(found.end), "step": found.step}
        told = {"anomalies": plain(found.anomalies), "remarks": list(found.remarks)}
        return {**span, "fit": found.is_fit_for_calibration, "points": points, **told}

    def _describe(self) -> CaseCheck | None:
        """Check the case, unless it is the same as the last time; None without telemetry."""
        state = self._store.files_state()
        if self._checked is None or self._checked[0] != state:
            found = describe_case(load_case(self._store.folder)) if self._store.has_telemetry else None
            self._checked = (state, found)
        return self._checked[1]

    @staticmethod
    def _in_unit(values: pd.Series) -> pd.Series:
        quantity = POINT_TYPES[str(values.name).rpartition("/")[2]].quantity
        return pd.Series(from_si(values.to_numpy(), QUANTITIES[quantity].file_unit, quantity), index=values.index)

    def plot(self, column: str, of: str) -> dict[str, Any]:
        """Give the outline of a column.

        Parameters
        ----------
        column : str
            Its name.
        of : str
            ``table``: of the table that was read; ``case``: of the telemetry that the case has.

        Returns
        -------
        dict
            See `outline`, with its unit, and where a check found something: start, end, what.

        Raises
        ------
        PlanError
            There is no such column, or `of` is neither.
        """
        timezone = self._store.draft.site.timezone or "UTC"
        PlanError.unless_known(of, ("table", "case"), "of", "table or case")
        if of == "table":
            series = self._read_table().series
            PlanError.unless(column in series, "column", "one of the table", repr(column[:80]))
            return outline(series[column].values, LARGE, timezone) | {"unit": series[column].unit, "marks": []}
        found = self._describe()
        frame = found.case.telemetry.frame if found is not None else pd.DataFrame()
        if found is None or column not in frame:
            raise PlanError("column", "one of the case's telemetry", repr(column[:80]))
        marks = [(plain(flaw.start), plain(flaw.end), flaw.kind) for name, flaw in found.quality if name == column]
        marks += [(plain(a.start), plain(a.end), a.kind) for a in found.anomalies if column in a.columns]
        unit = QUANTITIES[POINT_TYPES[column.rpartition("/")[2]].quantity].file_unit
        picture = outline(self._in_unit(frame[column]), LARGE, timezone)
        return picture | {"unit": unit, "marks": marks[:_MOST_MARKS]}

    def _read_table(self) -> _Table:
        if self._table is None:
            raise LabelError("telemetry", "a table that was read", "none", "choose a file or a database first")
        return self._table


def _span(table: _Table) -> dict[str, str]:
    ends = [(s.values.index.min(), s.values.index.max()) for s in table.series.values() if len(s.values)]
    return {"start": min(first for first, _ in ends).isoformat(), "end": max(last for _, last in ends).isoformat()}


def _entities(building: Building) -> set[str]:
    return {*(d.name for d in building.devices), *building.zone_names, building.weather_station}
