"""Settings of many cases: intervals that each reads by its own clock, and how a record spells them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from calibration.errors import CalibrationError
from calibration.evaluation.intervals import Interval, parse_interval
from calibration.evaluation.settings import INTERVALS, CalibrationSettings, ModelSettings, calibration_settings
from calibration.results import to_json
from thermal.case.case import Case

#: Settings of many cases: of `calibrate` or of `diagnose`, with intervals as texts that each reads in its own zone.
Settings = ModelSettings | Mapping[str, Any]


def read_intervals(texts: Mapping[str, Sequence[Interval | str]], case: Case) -> tuple[list[Interval], list[Interval]]:
    """Read what tunes and what is held out by the clock of a case.

    Parameters
    ----------
    texts : mapping of str to sequence of Interval or str
        By ``tune`` and ``hold_out``; empty where one is not there.
    case : Case
        Whose telemetry they cut.
    """

    def read(name: str) -> list[Interval]:
        return [parse_interval(entry, case) if isinstance(entry, str) else entry for entry in texts.get(name, ())]

    return read("tune"), read("hold_out")


def split_intervals(settings: Mapping[str, Any]) -> tuple[dict[str, Sequence[Interval | str]], dict[str, Any]]:
    """Take the intervals out of settings.

    Parameters
    ----------
    settings : mapping of str to Any
        With ``tune`` and ``hold_out`` or without.

    Raises
    ------
    CalibrationError
        When one is no list.
    """
    intervals = {name: settings[name] for name in INTERVALS if name in settings}
    for name, value in intervals.items():
        if isinstance(value, str) or not isinstance(value, Sequence):
            raise CalibrationError(f"settings.{name}: expected a list of intervals START/END, got {value!r}")
    return intervals, {k: v for k, v in settings.items() if k not in intervals}


def split_settings(
    settings: Settings | None,
) -> tuple[dict[str, Sequence[Interval | str]], CalibrationSettings]:
    """Intervals and settings of many calibrations; refuse what `calibrate` does not take.

    Parameters
    ----------
    settings : CalibrationSettings, mapping of str to Any, or None
        A mapping may have the intervals too, as texts that each case reads in its own time zone.

    Raises
    ------
    CalibrationError
        When a name is unknown.
    """
    if not isinstance(settings, Mapping):
        return {}, calibration_settings(settings)
    intervals, rest = split_intervals(settings)
    return intervals, calibration_settings(rest)


def check_settings(settings: Settings | None) -> dict[str, Any]:
    """Spell settings as a record does, with their defaults; refuse what `calibrate` does not take.

    Parameters
    ----------
    settings : CalibrationSettings, mapping of str to Any, or None
        As `calibrate_many` takes them.

    Raises
    ------
    CalibrationError
        When a name is unknown, or a value cannot be written down.
    """
    intervals, chosen = split_settings(settings)
    return spelled(intervals, {f.name: getattr(chosen, f.name) for f in fields(chosen)})


def spelled(intervals: Mapping[str, Sequence[Interval | str]], chosen: Mapping[str, Any]) -> dict[str, Any]:
    """Spell settings as a record does.

    Parameters
    ----------
    intervals : mapping of str to sequence of Interval or str
        By ``tune`` and ``hold_out``.
    chosen : mapping of str to Any
        The others.

    Raises
    ------
    CalibrationError
        When a value cannot be written down.
    """
    values: dict[str, Any] = dict.fromkeys(INTERVALS, ())
    for name, entries in intervals.items():
        values[name] = [e if isinstance(e, str) else f"{e.start.isoformat()}/{e.end.isoformat()}" for e in entries]
    written = {}
    for name, value in {**values, **chosen}.items():
        try:
            written[name] = json.loads(to_json({name: value}))[name]
        except TypeError as error:
            raise CalibrationError(
                f"settings.{name}: expected plain values that a record can hold, got {value!r}"
            ) from error
    return written
