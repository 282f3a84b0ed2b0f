"""Input files as EnergyPlus' own JSON: named fields, looked up as EnergyPlus does, without regard to case."""

import calendar
import copy
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from datetime import date, timedelta
from functools import cache
from pathlib import Path
from typing import Any

from mpc.adapters.energyplus.process import Job, data_folder, run_energyplus
from mpc.errors import EnergyPlusError
from thermal.errors import nearest

#: Weather that the reference buildings were sized for.
CHICAGO = "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3"

_REPORTS = (
    "Output:Variable", "Output:Meter", "Output:Meter:MeterFileOnly", "Output:Table:Monthly", "Output:Table:TimeBins",
    "Output:Table:SummaryReports", "Output:SQLite", "Output:EnvironmentalImpactFactors", "Output:Surfaces:Drawing",
    "Output:Surfaces:List", "Output:Constructions", "Output:JSON", "Output:Schedules",
)  # fmt: skip
_CLOCK = ("RunPeriod", "Timestep", "RunPeriodControl:DaylightSavingTime")
_MONTHS = [name.lower() for name in calendar.month_abbr]
_WEEKDAYS = [name.lower() for name in calendar.day_name]
_COUNTED = re.compile(r"(last|\d)(?:st|nd|rd|th)?\s+([a-z]+day)\s+in\s+([a-z]{3})[a-z]*", re.I)
_FIXED = re.compile(r"(?:([a-z]{3})[a-z]*\s+|(\d+)\s*/\s*)(\d+)", re.I)


def _brought(folder: str, ending: str) -> dict[str, Path]:
    """Files of a kind that EnergyPlus brings, by their names without ending."""
    return {path.stem: path for path in sorted((data_folder() / folder).glob(f"*{ending}"))}


def reference_buildings() -> tuple[str, ...]:
    """List the reference buildings, by the names of their files without ``.idf``.

    Raises
    ------
    EnergyPlusError
        When EnergyPlus is not installed.
    """
    return tuple(_brought("model", ".idf"))


def weather_files() -> tuple[str, ...]:
    """List the weather files, by their names without ``.epw``.

    Raises
    ------
    EnergyPlusError
        When EnergyPlus is not installed.
    """
    return tuple(_brought("weather", ".epw"))


def building_path(name: str | Path) -> Path:
    """Find an input file.

    Parameters
    ----------
    name : str or Path
        A file, or one of `reference_buildings`.

    Raises
    ------
    EnergyPlusError
        When there is none.
    """
    return _path(name, "model", ".idf", "building")


def weather_path(name: str | Path) -> Path:
    """Find a weather file.

    Parameters
    ----------
    name : str or Path
        A file, or one of `weather_files`.

    Raises
    ------
    EnergyPlusError
        When there is none.
    """
    return _path(name, "weather", ".epw", "weather")


def _path(name: str | Path, folder: str, ending: str, what: str) -> Path:
    given = Path(name)
    if given.suffix.lower() == ending:
        if given.is_file():
            return given.resolve()
        raise EnergyPlusError(what, f"a file {ending}", f"none at {given}")
    known = _brought(folder, ending)
    EnergyPlusError.unless_known(str(name), known, what, f"a file {ending} or one that EnergyPlus brings")
    return known[str(name)]


def entity(name: str) -> str:
    """Make a name of EnergyPlus one that columns can have.

    Parameters
    ----------
    name : str
        Of an object.
    """
    return name.replace("/", "-").strip()


class InputFile:
    """A building as EnergyPlus reads it.

    Parameters
    ----------
    content : mapping
        Object type to name to fields.
    name : str
        For error messages.
    """

    def __init__(self, content: Mapping[str, Mapping[str, Mapping[str, Any]]], name: str) -> None:
        self.content, self.name = content, name

    def of_type(self, kind: str) -> Mapping[str, Mapping[str, Any]]:
        """Give the objects of a type by name; none where there are none.

        Parameters
        ----------
        kind : str
            Object type.
        """
        return self.content.get(kind, {})

    def find(self, kind: str, name: str) -> Mapping[str, Any]:
        """Look an object up.

        Parameters
        ----------
        kind, name : str
            Type and name.

        Raises
        ------
        EnergyPlusError
            When there is none.
        """
        objects = self.of_type(kind)
        found = objects.get(name) or next((v for k, v in objects.items() if k.lower() == name.lower()), None)
        if found is None:
            raise EnergyPlusError(f"{self.name}: {kind}", repr(name), "none", nearest(name, objects))
        return found

    def begins(self, prefix: str) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
        """Give type, name and fields of the objects of all types that begin so.

        Parameters
        ----------
        prefix : str
            Such as ``SetpointManager:``.
        """
        for kind, objects in self.content.items():
            if kind.startswith(prefix):
                for name, fields in objects.items():
                    yield kind, name, fields

    def nodes(self, name: str) -> tuple[str, ...]:
        """Give the nodes that a name stands for, a node or a list of nodes.

        Parameters
        ----------
        name : str
            Of either.
        """
        for title, fields in self.of_type("NodeList").items():
            if title.lower() == name.lower():
                return tuple(str(entry["node_name"]) for entry in fields["nodes"])
        return (name,)

    def with_period(self, start: date, days: int, steps_per_hour: int) -> dict[str, Any]:
        """Copy the content with its clock and reports replaced.

        Reports of its own are left out, daylight saving time too: the building's clock is that of its weather file.
        Holidays stay.

        Parameters
        ----------
        start : date
            First day; its day of the week counts.
        days : int
            Number of days.
        steps_per_hour : int
            Of zones and weather.

        Returns
        -------
        dict
            Content of an input file, to be written as JSON.
        """
        last = start + timedelta(days=days - 1)
        content = {k: copy.deepcopy(dict(v)) for k, v in self.content.items() if k not in (*_REPORTS, *_CLOCK)}
        content["Timestep"] = {"Timestep 1": {"number_of_timesteps_per_hour": steps_per_hour}}
        control: dict[str, Any] = dict(next(iter(content.get("SimulationControl", {"": {}}).values())))
        control |= {"run_simulation_for_sizing_periods": "No", "run_simulation_for_weather_file_run_periods": "Yes"}
        content["SimulationControl"] = {"SimulationControl 1": control}
        content["RunPeriod"] = {
            "run": {
                "begin_month": start.month, "begin_day_of_month": start.day, "begin_year": start.year,
                "end_month": last.month, "end_day_of_month": last.day, "end_year": last.year,
                "day_of_week_for_start_day": start.strftime("%A"), "use_weather_file_holidays_and_special_days": "No",
                "use_weather_file_daylight_saving_period": "No", "apply_weekend_holiday_rule": "No",
                "use_weather_file_rain_indicators": "Yes", "use_weather_file_snow_indicators": "Yes",
            }
        }  # fmt: skip
        return content


@cache
def read_input(path: Path) -> InputFile:
    """Read an input file through EnergyPlus' own conversion.

    Parameters
    ----------
    path : Path
        An ``.idf`` file.

    Raises
    ------
    EnergyPlusError
        When EnergyPlus cannot read it.
    """
    job = Job(
        path.read_text(encoding="latin-1"), "in.idf", weather_path(CHICAGO), options=("--convert-only",), stepped=False
    )
    text = run_energyplus(job, ["in.epJSON"])["in.epJSON"]
    return InputFile(json.loads(text), path.stem)


def holidays(source: InputFile, years: Iterable[int]) -> frozenset[date]:
    """List the holidays of an input file.

    Parameters
    ----------
    source : InputFile
        The building; its objects ``RunPeriodControl:SpecialDays`` of the type ``Holiday`` count.
    years : iterable of int
        Of which years.

    Raises
    ------
    EnergyPlusError
        When a date is written in no form that EnergyPlus knows.
    """
    found = set()
    for name, fields in source.of_type("RunPeriodControl:SpecialDays").items():
        if fields.get("special_day_type", "CustomDay2") != "Holiday":
            continue
        length = int(fields.get("duration", 1))
        for year in years:
            first = _first_day(str(fields["start_date"]).strip(), year)
            if first is None:
                expected = "a date such as 'July 4', '7/4' or '1st Monday in September'"
                raise EnergyPlusError(f"{source.name}: {name}", expected, repr(fields["start_date"]))
            found |= {first + timedelta(days=k) for k in range(length)}
    return frozenset(found)


def _first_day(text: str, year: int) -> date | None:
    """Read a date of a year; None where it is none."""
    try:
        if match := _COUNTED.fullmatch(text):
            weekday, month = _WEEKDAYS.index(match[2].lower()), _MONTHS.index(match[3].lower())
            days = [week[weekday] for week in calendar.monthcalendar(year, month) if week[weekday]]
            return date(year, month, days[-1] if match[1].lower() == "last" else days[int(match[1]) - 1])
        if match := _FIXED.fullmatch(text):
            return date(year, int(match[2] or _MONTHS.index(match[1].lower())), int(match[3]))
    except (ValueError, IndexError):
        return None
    return None
