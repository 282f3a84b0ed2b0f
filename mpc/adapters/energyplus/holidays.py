"""Holidays of a building of EnergyPlus: days on which its schedules are those of a Sunday."""

from __future__ import annotations

import calendar
import re
from collections.abc import Iterable
from datetime import date, timedelta

from mpc.adapters.energyplus.input import InputFile
from mpc.errors import EnergyPlusError
from thermal.errors import describe

_MONTHS = [name.lower() for name in calendar.month_abbr]
_WEEKDAYS = [name.lower() for name in calendar.day_name]
_COUNTED = re.compile(r"(last|\d)(?:st|nd|rd|th)?\s+([a-z]+day)\s+in\s+([a-z]{3})[a-z]*", re.I)
_NAMED = re.compile(r"([a-z]{3})[a-z]*\s+(\d+)", re.I)
_NUMBERED = re.compile(r"(\d+)\s*/\s*(\d+)")


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
                raise EnergyPlusError(describe(f"{source.name}: {name}", expected, repr(fields["start_date"])))
            found |= {first + timedelta(days=k) for k in range(length)}
    return frozenset(found)


def _first_day(text: str, year: int) -> date | None:
    """Read a date of a year; None where it is none."""
    try:
        if match := _COUNTED.fullmatch(text):
            weekday, month = _WEEKDAYS.index(match[2].lower()), _MONTHS.index(match[3].lower())
            last = calendar.monthrange(year, month)[1]
            days = [d for d in range(1, last + 1) if date(year, month, d).weekday() == weekday]
            return date(year, month, days[-1] if match[1].lower() == "last" else days[int(match[1]) - 1])
        if match := _NAMED.fullmatch(text):
            return date(year, _MONTHS.index(match[1].lower()), int(match[2]))
        if match := _NUMBERED.fullmatch(text):
            return date(year, int(match[1]), int(match[2]))
    except (ValueError, IndexError):
        return None
    return None
